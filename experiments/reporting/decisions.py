"""The list of all decisions, from the first line of each."""

from __future__ import annotations

import re
from pathlib import Path

from deskew.errors import require

_HEADING = re.compile(r"# (\d{4}): (.+)")

_HEAD = """# Decisions

What was decided, why, and what it costs; one page each, from [a template](template.md). A later page says so where it
overrules an earlier one. This list is written by `python -m experiments.reporting.generated`.

"""


def decisions_page(folder: Path) -> str:
    """Return the index of a folder of decisions.

    Parameters
    ----------
    folder : Path
        Holds `NNNN-NAME.md`, each beginning with `# NNNN: TITLE`.

    Raises
    ------
    InputError
        If a page begins otherwise, or its number is not that of its name.
    """
    lines = []
    for path in sorted(folder.glob("[0-9]*.md")):
        first = path.read_text(encoding="utf-8").partition("\n")[0]
        found = _HEADING.fullmatch(first)
        same = found is not None and path.name.startswith(f"{found[1]}-")
        require(same, str(path), f"begin with `# {path.name[:4]}: ` and a title", first)
        assert found is not None
        lines.append(f"- [{found[1]}]({path.name}): {found[2]}")
    return _HEAD + "\n".join(lines) + "\n"
