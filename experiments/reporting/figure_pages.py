"""Figure pages: pictures and numbers set in millimetres for a printed page, like the paper's figures 3, 4 and 5."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from experiments.reporting.figure_layout import FigurePage
from experiments.reporting.layout import Column
from experiments.reporting.page_numbers import FONT_PT, GAP_MM, NumbersTable, numbers_table, text_width_mm
from experiments.trials.schema import Row

WIDTH_MM, HEIGHT_MM = 180.0, 257.0
"""The text of an A4 page: the width of every figure page and the greatest height."""

_MAX_BYTES = 2_000_000
_DPI = (300, 240, 200, 150, 100)
_TITLE_PT = 9.5
_LINE_MM = 4.2
_MARGIN_MM = 13.0  # numerals and headings of the lines of pictures
_SPACE_MM = 1.5  # between pictures
_CONTROL_MM = (40.0, 75.0)  # least and greatest width of the control
_BLOCK = 5  # columns of trials side by side, as in the paper
_MAX_TRIALS = 8
_NUMERALS = ("I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII")

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class _Strip:
    """One line of pictures: its heading and, for each of the page's columns, a picture's name."""

    heading: str
    names: tuple[str, ...]


def figure_page(
    page: FigurePage, columns: Sequence[Column], rows: Sequence[Row], pictures: Mapping[str, bytes]
) -> bytes | None:
    """Print a page of recorded pictures and their numbers.

    Parameters
    ----------
    page : FigurePage
        What stands where.
    columns : sequence of Column
        The study's, which name and round the numbers.
    rows : sequence of Row
        All results.
    pictures : mapping of name to PNG bytes
        As recorded by the trials; a missing one leaves its place empty.

    Returns
    -------
    bytes or None
        A PNG of 300 dots an inch, or of fewer so that it stays below 2 MB; None if there is no picture at all.
    """
    methods = sorted({row.method for row in rows})
    shown = [column for column in _columns_of(page) if any(name in pictures for name in _names(page, column, methods))]
    if not shown:
        return None
    used = set().union(*(_names(page, column, methods) for column in shown)) & set(pictures)
    images = {name: _decoded(pictures[name]) for name in used}
    drawing = _Drawing(page, shown, _strips(page, shown, methods, pictures), images)
    drawing.draw(_control(page, shown, images), numbers_table(page, shown, columns, rows))
    return next((png for dpi in _DPI if len(png := drawing.png(dpi)) <= _MAX_BYTES), None)


def pictures_on(page: FigurePage, rows: Sequence[Row]) -> set[str]:
    """Name every picture that the page shows, or would with more room."""
    methods = sorted({row.method for row in rows})
    every = page.columns or tuple(("", str(trial)) for trial in {row.trial for row in rows})
    return {name for column in every for name in _names(page, column, methods)}


def _columns_of(page: FigurePage) -> Sequence[tuple[str, str]]:
    return page.columns or [(f"{page.item} {trial + 1}", str(trial)) for trial in range(_MAX_TRIALS)]


def _names(page: FigurePage, column: tuple[str, str], methods: Sequence[str]) -> set[str]:
    """Name all pictures of one column."""
    templates = [name for _, name in (*page.lines, *([page.control] if page.control else []))]
    return {name.format(column=column[1], method=method) for name in templates for method in ("", *methods)}


def _strips(
    page: FigurePage, shown: Sequence[tuple[str, str]], methods: Sequence[str], pictures: Mapping[str, bytes]
) -> list[_Strip]:
    """Return the lines that have pictures, one that depends on the method once for each method."""
    strips = []
    for heading, template in page.lines:
        by_method = "{method}" in template
        for method in methods if by_method else [""]:
            names = tuple(template.format(column=column, method=method) for _, column in shown)
            if any(name in pictures for name in names):
                strips.append(_Strip(f"{heading}\n{method}" if by_method else heading, names))
    return strips


def _control(page: FigurePage, shown: Sequence[tuple[str, str]], images: Mapping[str, Picture]) -> _Strip | None:
    """Return the one control that is drawn."""
    if page.control is None:
        return None
    heading, template = page.control
    names = [template.format(column=column) for _, column in shown]
    return next((_Strip(heading, (name,)) for name in names if name in images), None)


class _Drawing:
    """A page being drawn, from its upper left corner down; its axes' unit is a millimetre."""

    def __init__(
        self,
        page: FigurePage,
        shown: Sequence[tuple[str, str]],
        strips: Sequence[_Strip],
        images: Mapping[str, Picture],
    ) -> None:
        self.page, self.shown, self.strips, self.images = page, shown, strips, images
        self.figure = Figure(figsize=(WIDTH_MM / 25.4, HEIGHT_MM / 25.4))
        self.axes: Any = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.y = 0.0

    def draw(self, control: _Strip | None, table: NumbersTable | None) -> None:
        """Draw everything; what is left of the page stays white below `y`."""
        self._text(0.0, _LINE_MM / 2, self.page.title, fontsize=_TITLE_PT, weight="bold", ha="left")
        self.y = _LINE_MM + _SPACE_MM
        caption = _wrapped(self.page.caption, WIDTH_MM)
        table = None if table is None else table.within(WIDTH_MM - _MARGIN_MM - _CONTROL_MM[0] * (control is not None))
        control_mm, foot_mm = self._foot_sizes(control, table)
        n_blocks = -(-len(self.shown) // _BLOCK)
        n_side = -(-len(self.shown) // n_blocks)
        width = self._picture_width_mm(n_blocks, n_side, foot_mm + _LINE_MM * (len(caption) + 1.5))
        for first in range(0, len(self.shown), n_side):
            self.y += 0.0 if first == 0 else 2 * _SPACE_MM
            self._block(first, n_side, width)
        if foot_mm:
            self.y += _SPACE_MM
            self._foot(control, table, control_mm)
            self.y += foot_mm
        self.y += _LINE_MM / 2
        for line in caption:
            self._text(0.0, self.y + _LINE_MM / 2, line, ha="left")
            self.y += _LINE_MM
        self.axes.set(xlim=(0.0, WIDTH_MM), ylim=(HEIGHT_MM, 0.0), aspect="auto")

    def png(self, dpi: int) -> bytes:
        """Return what was drawn at a resolution, without the white below it."""
        self.figure.set_dpi(dpi)
        canvas: Any = FigureCanvasAgg(self.figure)
        canvas.draw()
        used = min(canvas.get_width_height()[1], round(self.y / 25.4 * dpi))
        return _png(np.asarray(canvas.buffer_rgba())[:used, :, :3], dpi)

    def _foot_sizes(self, control: _Strip | None, table: NumbersTable | None) -> tuple[float, float]:
        """Return the control's width and the height of control and table [mm]."""
        room = WIDTH_MM - _MARGIN_MM - (0.0 if table is None else table.width_mm + 2 * GAP_MM)
        control_mm = 0.0 if control is None else min(room, _CONTROL_MM[1])
        control_height = 0.0 if control is None else control_mm * self._aspect(control)
        return control_mm, max(control_height, 0.0 if table is None else _table_height_mm(table))

    def _picture_width_mm(self, n_blocks: int, n_side: int, below_mm: float) -> float:
        """Return the greatest width at which the pictures fill the page's width or its height."""
        across = (WIDTH_MM - _MARGIN_MM + _SPACE_MM) / n_side - _SPACE_MM
        heads = n_blocks * (_LINE_MM + (len(self.strips) + 2) * _SPACE_MM)
        aspect = n_blocks * sum(map(self._aspect, self.strips))
        return min(across, (HEIGHT_MM - self.y - below_mm - heads) / aspect) if aspect else across

    def _aspect(self, strip: _Strip) -> float:
        """Height over width of the tallest picture of a line."""
        shapes = [self.images[name].shape for name in strip.names if name in self.images]
        return max((shape[0] / shape[1] for shape in shapes), default=0.0)

    def _block(self, first: int, n: int, width: float) -> None:
        """Draw up to `n` columns from the one of number `first` on, with all their lines."""
        left = _MARGIN_MM + (WIDTH_MM - _MARGIN_MM - n * width - (n - 1) * _SPACE_MM) / 2
        places = [left + i * (width + _SPACE_MM) for i in range(n)]
        for place, (heading, _) in zip(places, self.shown[first : first + n], strict=False):
            self._text(place + width / 2, self.y + _LINE_MM / 2, heading, va="center_baseline")
        self.y += _LINE_MM
        for numeral, strip in zip(_NUMERALS, self.strips, strict=False):
            height = width * self._aspect(strip)
            self._heading(left, height, numeral, strip.heading)
            for place, name in zip(places, strip.names[first : first + n], strict=False):
                self._picture(place, width, name)
            self.y += height + _SPACE_MM

    def _foot(self, strip: _Strip | None, table: NumbersTable | None, control_mm: float) -> None:
        """Draw the control at the left and the table at the right, without going down."""
        if strip is not None:
            name = strip.names[0]
            self._heading(_MARGIN_MM, control_mm * self._aspect(strip), _NUMERALS[len(self.strips)], strip.heading)
            self._picture(_MARGIN_MM, control_mm, name)
        if table is not None:
            room = WIDTH_MM - _MARGIN_MM - control_mm
            self._table(table, _MARGIN_MM + control_mm + (room - table.width_mm) / 2)

    def _table(self, table: NumbersTable, left: float) -> None:
        heading_lines, sub_lines = table.head_lines
        right, head = left + table.width_mm, self.y + _LINE_MM * heading_lines
        first = head + _LINE_MM * (sub_lines + 0.4)
        below = len(table.labels) - table.n_below
        middles = [first + _LINE_MM * (i + 0.5 + 0.4 * (i >= below)) for i in range(len(table.labels))]
        for label, y in zip(table.labels, middles, strict=True):
            self._text(left, y, label, ha="left", va="center_baseline")
        x = left + table.label_width_mm
        for group in table.groups:
            widths = group.widths_mm
            self._text(x + (sum(widths) + GAP_MM) / 2, head - _LINE_MM * heading_lines / 2, group.heading)
            self._rule(x + GAP_MM, x + sum(widths), head)
            for i, width in enumerate(widths):
                x += width
                self._text(x, (head + first) / 2, group.subheadings[i], ha="right", multialignment="right")
                for line, y in zip(group.cells, middles, strict=True):
                    self._text(x, y, line[i], ha="right", va="center_baseline")
        self._rule(left, right, self.y - 0.4, 0.8)
        self._rule(left, right, first)
        if table.n_below:
            self._rule(left, right, middles[below] - _LINE_MM * 0.7)
        self._rule(left, right, self.y + _table_height_mm(table), 0.8)

    def _rule(self, left: float, right: float, y: float, weight_pt: float = 0.4) -> None:
        self.axes.plot([left, right], [y, y], color="black", linewidth=weight_pt, solid_capstyle="butt")

    def _heading(self, left: float, height: float, numeral: str, heading: str) -> None:
        lines = [line for part in heading.split("\n") for line in _wrapped(part, height)]
        self._text(left - _MARGIN_MM + 2.0, self.y + height / 2, numeral, weight="bold")
        self._text(left - 4.0, self.y + height / 2, "\n".join(lines), rotation=90)

    def _picture(self, left: float, width: float, name: str) -> None:
        """Draw a picture with its upper left corner at (left, y); a missing one leaves its place empty."""
        if name not in self.images:
            return
        image = self.images[name]
        height = float(width * image.shape[0] / image.shape[1])
        place = (left, left + width, self.y + height, self.y)
        self.axes.imshow(image, extent=place, interpolation="antialiased")

    def _text(self, x: float, y: float, text: str, **style: Any) -> None:
        plain = {"fontsize": FONT_PT, "ha": "center", "va": "center", "linespacing": 1.1}
        self.axes.text(x, y, text, parse_math=False, **(plain | style))


def _table_height_mm(table: NumbersTable) -> float:
    return _LINE_MM * (sum(table.head_lines) + 0.4 + len(table.labels) + 0.4 * (table.n_below > 0) + 0.3)


def _wrapped(text: str, width_mm: float) -> list[str]:
    """Break a text into lines; letters are as wide as its own are on average."""
    if not text:
        return []
    return wrap(text, max(8, int(0.98 * width_mm * len(text) / max(text_width_mm(text), 1.0))))


def _decoded(png: bytes) -> Picture:
    return np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR), np.uint8)[..., ::-1]


def _png(pixels: Picture, dpi: int) -> bytes:
    """Encode (height, width, 3) RGB, as grey if it is, and say how large it is in print."""
    grey = bool((pixels == pixels[..., :1]).all())
    ok, png = cv2.imencode(".png", pixels[..., 0] if grey else pixels[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
    assert ok
    data = png.tobytes()
    chunk = b"pHYs" + struct.pack(">IIB", *[round(dpi / 0.0254)] * 2, 1)
    header = data.index(b"IDAT") - 4
    return data[:header] + struct.pack(">I", 9) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[header:]
