"""What the page asks of the desk, and what it is answered: messages of plain JSON values, pictures beside them.

A message is `{"do": NAME, ...}`. Each is answered by the whole state, so that a page that missed something is right
again after the next answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from deskew.editor.desk import LONGEST_PAINTED, Desk
from deskew.editor.pictures import (
    ABOVE,
    BELOW,
    COLOURS,
    ZERO,
    as_jpeg,
    as_png,
    diverging,
    limit_of,
    on_a_desk,
    shrunk,
)
from deskew.editor.preview import Look
from deskew.editor.strokes import Stroke, Tool
from deskew.errors import DeskewError, InputError, in_one_line, require

# Least ends of the colour bars: grain and rounding are not to fill them.
_LEAST_GREY, _LEAST_PERCENT = 5.0, 0.1

Message = Mapping[str, Any]
Answer = tuple[dict[str, Any], list[bytes]]


def answer(desk: Desk, message: Message) -> Answer:
    """Do what a message asks, and tell how things stand.

    Parameters
    ----------
    desk : Desk
        The desk.
    message : mapping
        From the page; nothing about it is taken for granted.

    Returns
    -------
    dict, list of bytes
        The state, whose `pictures` name the PNG and JPEG files that follow. What failed is its `error`, in one line;
        nothing is raised, whatever came.
    """
    with desk.lock:
        said, error = "", ""
        try:
            said = _do(desk, message)
        except DeskewError as failure:
            error = str(failure)
        except Exception as failure:  # a page that is told is better than one that is not answered
            error = in_one_line(failure)
        try:
            look = desk.look()
        except DeskewError as failure:
            error = error or str(failure)
            look = desk.last_look()
        pictures = _pictures(desk, look, whole=message.get("do") == "open")
        state = _state(desk, look) | {"id": message.get("id"), "said": said, "error": error, "pictures": list(pictures)}
        return state, list(pictures.values())


def _do(desk: Desk, message: Message) -> str:
    """Do it; return what is to be said about it."""
    name = message.get("do")
    known = ", ".join(_DOINGS)
    require(isinstance(name, str) and name in _DOINGS, "do", f"be one of {known}", repr(name)[:60])
    return _DOINGS[str(name)](desk, message) or ""


def _paint(desk: Desk, message: Message) -> None:
    points = message.get("points")
    try:
        places = np.array(points, dtype=np.float64).reshape(-1, 2)
    except (TypeError, ValueError) as error:
        raise InputError(f"`points` must be places [x, y], got {repr(points)[:60]}.") from error
    tool = message.get("tool")
    require(isinstance(tool, str) and tool in list(Tool), "tool", f"be one of {', '.join(Tool)}", repr(tool)[:60])
    width, tolerance = _number(message, "width", 1.0), _number(message, "tolerance", 0.0)
    desk.paint(Stroke(Tool(str(tool)), places, width, tolerance), _label(message))


def _change(desk: Desk, message: Message) -> None:
    stiffness = _number(message, "stiffness", math.nan) if "stiffness" in message else None
    desk.change(_label(message), message.get("name"), stiffness)


def _free_scale(desk: Desk, message: Message) -> None:
    on = message.get("on")
    require(isinstance(on, bool), "on", "be true or false", repr(on)[:60])
    desk.free_scale = bool(on)


_DOINGS: dict[str, Callable[[Desk, Message], str | None]] = {
    "open": lambda desk, message: None,
    "paint": _paint,
    "leaf": lambda desk, message: desk.paint_leaf(_label(message)),
    "add": lambda desk, message: desk.add(),
    "change": _change,
    "remove": lambda desk, message: desk.remove(_label(message)),
    "undo": lambda desk, message: desk.undo(),
    "redo": lambda desk, message: desk.redo(),
    "light": lambda desk, message: desk.show(str(message.get("light"))),
    "free_scale": _free_scale,
    "save_map": lambda desk, message: f"Saved {desk.save_map()} and the table beside it.",
    "save_restored": lambda desk, message: f"Saved {desk.save_restored()}.",
}


def _label(message: Message) -> int:
    label = message.get("label")
    whole = isinstance(label, int) and not isinstance(label, bool)
    require(whole, "label", "be a whole number", repr(label)[:60])
    return int(label)  # type: ignore[arg-type]


def _number(message: Message, name: str, default: float) -> float:
    value = message.get(name, default)
    real = isinstance(value, int | float) and not isinstance(value, bool)
    require(real, name, "be a number", repr(value)[:60])
    return float(value)


def _pictures(desk: Desk, look: Look, whole: bool) -> dict[str, bytes]:
    """Encode what changes with every message, and the photograph if it is the first."""
    pictures = {"photograph": as_jpeg(shrunk(desk.photograph, LONGEST_PAINTED))} if whole else {}
    pictures["overlay"] = desk.overlay()
    pictures["restored"] = as_jpeg(on_a_desk(look.image, look.page))
    if look.last is not None:
        pictures["last"] = as_jpeg(on_a_desk(*look.last))
    pictures["strain"] = as_png(diverging(100 * look.strain, _strain_limit(look)))
    if look.difference is not None:
        pictures["difference"] = as_png(diverging(look.difference, _difference_limit(look)))
    return pictures


def _strain_limit(look: Look) -> float:
    return limit_of(100 * look.strain, _LEAST_PERCENT)


def _difference_limit(look: Look) -> float:
    return _LEAST_GREY if look.difference is None else limit_of(look.difference, _LEAST_GREY)


def _state(desk: Desk, look: Look) -> dict[str, Any]:
    painting = desk.painting
    undoable, redoable = desk.undoable
    lying = np.bincount(painting.labels.ravel(), minlength=1 << 16)
    return {
        "name": desk.name,
        "size": list(painting.size),
        "mm_per_px": desk.mm_per_px,
        "materials": [
            {
                "label": material.label,
                "name": material.name,
                "stiffness": material.stiffness,
                "colour": list(COLOURS[0 if place == 0 else 1 + (place - 1) % (len(COLOURS) - 1)]),
                "share": float(lying[material.label] / painting.labels.size),
            }
            for place, material in enumerate(painting.materials)
        ],
        "undo": undoable,
        "redo": redoable,
        "lights": list(desk.scan.images),
        "light": desk.light,
        "free_scale": desk.free_scale,
        "can_find_leaf": desk.can_find_leaf,
        "saved": desk.saved,
        "files": {"map": str(desk.files.map), "restored": str(desk.files.restored)},
        "figures": dict(look.figures),
        "remedy": look.remedy,
        "scale": [list(BELOW), list(ZERO), list(ABOVE)],
        "limits": {"difference": _difference_limit(look), "strain": _strain_limit(look)},
    }
