"""The site's navigation, added to the index while it is read: a directive in the file would show as code on GitHub."""

from __future__ import annotations

import re

from sphinx.application import Sphinx

INDEX = "docs/README"

# Heading of the side bar: pages, or a title and a page; a star takes all that match.
PAGES = {
    "Use": (
        "Overview </README>",
        "docs/capture-guide",
        "docs/stiffness-editor",
        "docs/own-method",
        "docs/gate",
        "docs/scaling",
    ),
    "Understand": ("docs/how-it-works", "docs/rig", "docs/results", "reports/CLAIMS", "docs/adr/README"),
    "Reference": ("docs/api/*",),
    "Compare": ("RULES", "ARTIFACT", "DATASHEET", "REFORMS", "reports/NULLS", "reports/SYNTHETIC_AND_REAL"),
    "Project": ("CONTRIBUTING", "CHANGELOG"),
}
SINGLE_TRIALS = re.compile(r"^## (?:All trials|Each trial)\n.*?(?=^## |\Z)", re.DOTALL | re.MULTILINE)
HIDDEN = {INDEX: "reports/*/table", "docs/gate": "docs/gate-faults", "docs/adr/README": "docs/adr/[0-9t]*"}


def toctree(pages: tuple[str, ...], caption: str = "") -> str:
    """Return the directive that lists pages."""
    options = ":hidden:\n:glob:\n" + (f":caption: {caption}\n" if caption else "")
    entries = (page if "<" in page else f"/{page}" for page in pages)
    return "\n```{toctree}\n" + options + "\n" + "\n".join(entries) + "\n```\n"


def add(app: Sphinx, page: str, source: list[str]) -> None:
    """Add to a page the lists of those below it."""
    if page == INDEX:
        source[0] += "".join(toctree(pages, caption) for caption, pages in PAGES.items())
    if page in HIDDEN:
        source[0] += toctree((HIDDEN[page],))


def summarised(app: Sphinx, page: str, source: list[str]) -> None:
    """Leave the figures of single trials out of a report's page: they are most of it, and stand in the repository."""
    if page.startswith("reports/"):
        source[0] = SINGLE_TRIALS.sub("", source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect."""
    app.connect("source-read", add)
    app.connect("source-read", summarised)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
