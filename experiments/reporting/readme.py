"""Tables in hand-written pages: copied from the reports, so that no figure in them is typed by hand.

What stands between `<!-- table NAME -->` and `<!-- end -->` is the summary of `reports/NAME/table.md`; between
`<!-- table NAME: a | b | c -->` and the end, the columns of these headings alone, of the first table that has them all.
"""

from __future__ import annotations

import re
from pathlib import Path

from deskew.errors import InputError

_BLOCK = re.compile(r"(<!-- table (?P<name>\w+)(?:: (?P<columns>[^\n]+?))? -->\n).*?(<!-- end -->)", re.DOTALL)
_SUMMARY = re.compile(r"^## Summary\n\n(?P<text>.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)
_TABLE = re.compile(r"(?:^\|.*\|\n?)+", re.MULTILINE)


def with_tables(text: str, reports: Path) -> str:
    """Return a page's text with each marked block filled from the report that it names.

    Parameters
    ----------
    text : str
        Markdown with `<!-- table NAME -->` ... `<!-- end -->` blocks.
    reports : Path
        Folder that holds `NAME/table.md`.

    Raises
    ------
    InputError
        If a block names a report that is not there or has no summary, or columns that no table of it has.
    """

    def filled(block: re.Match[str]) -> str:
        path = reports / block["name"] / "table.md"
        summary = _SUMMARY.search(path.read_text()) if path.is_file() else None
        if summary is None:
            raise InputError(f"A table must be of a report with a summary, got {block['name']}, not in {path}.")
        shown = summary["text"].strip()
        if block["columns"] is not None:
            shown = narrowed(shown, [name.strip() for name in block["columns"].split("|")], str(path))
        return f"{block[1]}{shown}\n{block[4]}"

    return _BLOCK.sub(filled, text)


def narrowed(summary: str, columns: list[str], name: str) -> str:
    """Return some columns of the first table that has them; rows that have nothing in them but labels are left out.

    Parameters
    ----------
    summary : str
        Markdown with tables.
    columns : list of str
        Headings, in the order wanted.
    name : str
        What is said to be wrong if no table has them.

    Raises
    ------
    InputError
        If there is no such table.
    """
    for table in _TABLE.findall(summary):
        heading, rule, *rows = [_cells(line) for line in table.splitlines()]
        if set(columns) <= set(heading):
            places = [heading.index(column) for column in columns]
            labels = sum(rule[place] == "---" or heading[place] in ("method", "n", "failed") for place in places)
            kept = [[row[place] for place in places] for row in rows]
            told = [row for row in kept if any(cell not in ("–", "") for cell in row[labels:])]
            lines = [columns, [rule[place] for place in places], *told]
            return "\n".join("| " + " | ".join(line) + " |" for line in lines)
    raise InputError(f"`{name}` must have a table of the columns {' | '.join(columns)}, got none.")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]
