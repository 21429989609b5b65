"""The page's one component: it hands the page's messages to the desk, and the answers back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import anywidget

from deskew.editor.desk import Desk
from deskew.editor.talk import answer

_STATIC = Path(__file__).parent / "static"


class Bench(anywidget.AnyWidget):  # type: ignore[misc]
    """The bench that a page is edited on; what it shows and how is written in `static/`.

    Parameters
    ----------
    desk : Desk
        What it shows and changes.
    """

    # One text, since a component has no place to import its parts from.
    _esm = "\n".join((_STATIC / name).read_text(encoding="utf-8") for name in ("template.js", "painter.js", "bench.js"))
    _css = (_STATIC / "bench.css").read_text(encoding="utf-8")

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        self._desk = desk
        self.on_msg(self._asked)

    def _asked(self, _: Any, message: Any, __: Any) -> None:
        state, pictures = answer(self._desk, message if isinstance(message, dict) else {})
        self.send(state, pictures)
