"""Text and tables to HTML: whatever comes from a file is escaped here, and nowhere else is HTML made of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape

from experiments.reporting.blocks import Block, Heading, Note, Table

# From this column on numbers stand; those before say what a line is about.
_TEXT_COLUMNS = frozenset({"condition", "method", "metric", "figure", "against", "reason", "claim", "measured"})
_CODE = re.compile(r"`([^`]+)`")
_BOLD = re.compile(r"\*\*([^*]+)\*\*")


def inline(text: str) -> str:
    """Return the HTML of a sentence in Markdown that has nothing but `code` and **bold** in it."""
    return _BOLD.sub(r"<strong>\1</strong>", _CODE.sub(r"<code>\1</code>", escape(text)))


def element(name: str, content: str, **attributes: str) -> str:
    """Return an element around HTML; attributes are escaped, and `class_` and `aria_label` written as HTML has them."""
    written = (f' {key.rstrip("_").replace("_", "-")}="{escape(value)}"' for key, value in attributes.items())
    return f"<{name}{''.join(written)}>{content}</{name}>"


def slug(text: str) -> str:
    """Return a name for a link: lower-case letters and digits, the rest one hyphen."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def table_html(table: Table, name: str) -> str:
    """Return a table in a box that scrolls by itself; its first column is a heading and stays in sight.

    A column's heading, or a line, names the metric that it shows as `data-metric`.

    Parameters
    ----------
    table : Table
        Cells as text.
    name : str
        What the box is called to those who hear it.
    """
    of_columns = table.of_columns or [""] * len(table.headings)
    of_lines = table.of_lines or [""] * len(table.lines)
    heads = "".join(_head(heading, metric) for heading, metric in zip(table.headings, of_columns, strict=True))
    texts = [heading in _TEXT_COLUMNS for heading in table.headings]
    lines = "".join(_line(line, texts, metric) for line, metric in zip(table.lines, of_lines, strict=True))
    # What closes a cell or a line may be left out: a third of a large table.
    n_texts = next((i for i, text in enumerate(texts) if not text), len(texts))
    content = f"<table class=lead-{n_texts}><thead><tr>{heads}<tbody>{lines}</table>"
    return element("div", content, class_="scroll", tabindex="0", role="group", aria_label=name)


def _head(heading: str, metric: str) -> str:
    return f"<th scope=col{_metric(metric)}>{inline(heading)}"


def _line(line: Sequence[str], texts: Sequence[bool], metric: str) -> str:
    first, *others = line
    cells = (
        f"<td class=text>{inline(cell)}" if text and len(cell) > 40 else f"<td>{inline(cell)}"
        for cell, text in zip(others, texts[1:], strict=True)
    )
    paper = " class=paper" if first == "the paper" else ""
    return f"<tr{paper}{_metric(metric)}><th scope=row>{inline(first)}{''.join(cells)}"


def _metric(metric: str) -> str:
    return f' data-metric="{escape(metric)}"' if metric else ""


def blocks_html(blocks: Sequence[Block], name: str) -> str:
    """Return the parts of a page of tables: the summary as it is, all others folded up.

    Parameters
    ----------
    blocks : sequence of Block
        Without the page's own heading.
    name : str
        Of the report: begins the names of its parts.
    """
    parts, folded = list[str](), False
    title = name
    for block in blocks:
        if isinstance(block, Heading):
            title = block.text
            parts.append("</details>" if folded else "")
            folded = title != "Summary"
            head = inline(title)
            parts.append(f"<details><summary>{head}</summary>" if folded else element("h3", head))
        elif isinstance(block, Note):
            parts.append(element("p", inline(block.text)))
        else:
            parts.append(table_html(block, f"{name}: {title}"))
    return "".join(parts) + ("</details>" if folded else "")
