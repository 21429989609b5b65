"""The README's tables: copied from the reports, so that no figure in it is typed by hand.

What stands between `<!-- table NAME -->` and `<!-- end -->` is the summary of `reports/NAME/table.md`.
"""

from __future__ import annotations

import re
from pathlib import Path

from deskew.errors import InputError

_BLOCK = re.compile(r"(<!-- table (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_SUMMARY = re.compile(r"^## Summary\n\n(?P<text>.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)


def with_tables(text: str, reports: Path) -> str:
    """Return the README's text with each marked block filled from the report that it names.

    Parameters
    ----------
    text : str
        Markdown with `<!-- table NAME -->` ... `<!-- end -->` blocks.
    reports : Path
        Folder that holds `NAME/table.md`.

    Raises
    ------
    InputError
        If a block names a report that is not there or has no summary.
    """

    def filled(block: re.Match[str]) -> str:
        path = reports / block["name"] / "table.md"
        summary = _SUMMARY.search(path.read_text()) if path.is_file() else None
        if summary is None:
            raise InputError(f"`README.md` must name reports with a summary, got {block['name']}, not in {path}.")
        return f"{block[1]}{summary['text'].strip()}\n{block[3]}"

    return _BLOCK.sub(filled, text)
