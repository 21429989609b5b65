"""The fields of a data class, shown as the arguments that make it.

They are documented once, under "Attributes"; napoleon would show these without their types where several share a line.
"""

from __future__ import annotations

from sphinx.application import Sphinx

HEADING = ["Attributes", "----------"]


def as_parameters(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Rename the section of a class, before napoleon reads it."""
    at = next((i for i in range(len(lines) - 1) if lines[i : i + 2] == HEADING), None)
    if what == "class" and at is not None:
        lines[at] = "Parameters"


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect."""
    app.connect("autodoc-process-docstring", as_parameters, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
