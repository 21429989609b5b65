"""The paper's claims, each with its test, this project's figure and a verdict by a written rule."""
