"""What a reader finds in the report's HTML, read with the standard library and none of the report's own code."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser

_VOID = {"img", "meta", "input", "stop", "rect", "br"}


@dataclass
class FoundTable:
    """A table as it stands in the page: headings with their metrics, lines with theirs."""

    section: str
    title: str
    headings: list[str] = field(default_factory=list)
    of_columns: list[str] = field(default_factory=list)
    lines: list[list[str]] = field(default_factory=list)
    of_lines: list[str] = field(default_factory=list)

    def column(self, heading: str) -> int:
        return self.headings.index(heading)


class Reader(HTMLParser):
    """Collects the tables of each section; the page leaves the ends of cells and lines out."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.tables: list[FoundTable] = []
        self.tags: list[str] = []
        self._section = self._box = ""
        self._cell: list[str] | None = None
        self._in_head = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.tags.append(tag)
        if tag == "section":
            self._section = given.get("id", "")
        elif tag == "div" and "scroll" in given.get("class", ""):
            self._box = given["aria-label"]
        elif tag == "table":
            self.tables.append(FoundTable(self._section, self._box))
        elif tag in ("thead", "tbody"):
            self._in_head = tag == "thead"
        elif tag == "tr" and not self._in_head:
            self.tables[-1].lines.append([])
            self.tables[-1].of_lines.append(given.get("data-metric", ""))
        elif tag in ("th", "td"):
            found = self.tables[-1]
            cells = found.headings if self._in_head else found.lines[-1]
            cells.append("")
            if self._in_head:
                found.of_columns.append(given.get("data-metric", ""))
            self._cell = cells

    def handle_endtag(self, tag: str) -> None:
        if tag == "table":
            self._cell = None

    def handle_data(self, data: str) -> None:
        if self._cell is not None:
            self._cell[-1] += data


def tables_in(html: str) -> list[FoundTable]:
    reader = Reader()
    reader.feed(html)
    return reader.tables
