"""The recorded sheet in the page: its states packed into whole numbers, its pictures, and what turns and lights it."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
from matplotlib import colormaps

from deskew.types import Array, Floats
from experiments.page.markup import element
from experiments.page.pictures import photograph
from experiments.studies.falling_sheet import FallingSheet

_LIGHTS = {
    "white": "Projector",
    "above": "Lamp above",
    "raking": "Raking light",
    "uv": "Ultra-violet",
    "backlight": "Back-light",
}
_MAP = "viridis"  # even in lightness, and told apart by readers who do not tell red from green
_N_STOPS = 17
_ROUND = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_TURNS = (
    ("ArrowLeft", "←", "Turn left"),
    ("ArrowRight", "→", "Turn right"),
    ("ArrowUp", "↑", "Tilt up"),
    ("ArrowDown", "↓", "Tilt down"),
    ("+", "+", "Nearer"),
    ("-", "−", "Farther"),
    ("t", "From above", ""),
    ("r", "As at first", ""),
)


def sheet_html(sheet: FallingSheet) -> str:
    """Return the view with its controls and data.

    Without scripts the pictures remain, and say so.
    """
    full = full_colour_mm(sheet.error_mm)
    lasts = len(sheet.frames) - 1
    return (
        f'<div class="stage" id="stage">{_canvas()}{_scale(full)}'
        f'<div class="desk">{_fall(10 * lasts)}<div class="choices">{_shown()}{_turning()}</div></div></div>'
        '<p id="no-view" hidden>This browser offers no WebGL, so the sheet is shown by its photographs alone.</p>'
        '<p class="unscripted">Without scripts the sheet stands still: these are its photographs, as it lay.</p>'
        f"{_lights(sheet)}{_caption(sheet)}"
        f'<script type="application/json" id="recording">{packed(sheet)}</script>'
    )


def full_colour_mm(error_mm: Floats) -> float:
    """Return the end of the colour scale: of 100 vertices 99 lie below it, and it is a round number [mm]."""
    top = float(np.nanpercentile(error_mm, 99))
    unit = 10.0 ** np.floor(np.log10(top))
    return float(next(end for end in _ROUND if end * unit >= top) * unit)


def packed(sheet: FallingSheet) -> str:
    """Return a sheet as JSON: positions to 16 bits of its extent, which is some 5 micrometres.

    A vertex whose error is unknown, beside the page's edge, gets the mean of its neighbours': it has to have a colour.
    """
    low, high = sheet.frames.min(axis=(0, 1, 2)), sheet.frames.max(axis=(0, 1, 2))
    step = (high - low) / 65535
    error = _without_gaps(sheet.error_mm)
    error_step = float(error.max()) / 65535
    flat = sheet.frames[-1].reshape(-1, 3)
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    values: dict[str, Any] = {
        "grid": list(sheet.error_mm.shape),
        "low_mm": low.round(6).tolist(),
        "step_mm": step.round(9).tolist(),
        "positions": _base64((sheet.frames - low) / step),
        "picture_xy": _base64(sheet.picture_xy * 65535),
        "error": _base64(error / error_step),
        "error_step_mm": error_step,
        "steps": sheet.steps.tolist(),
        "times_s": sheet.times_s.round(7).tolist(),
        "stops": _stops(),
        "full_colour_mm": full_colour_mm(sheet.error_mm),
        "middle_mm": middle[:2].round(3).tolist(),
        "half_mm": (np.ptp(flat[:, :2], axis=0) / 2).round(3).tolist(),
    }
    return json.dumps(values, separators=(",", ":"))


def _base64(values: Array) -> str:
    whole = np.clip(np.rint(values), 0, 65535).astype("<u2")
    return b64encode(whole.tobytes()).decode()


def _without_gaps(values: Floats) -> Floats:
    filled = values.copy()
    while np.isnan(filled).any():
        around = np.pad(filled, 1, constant_values=np.nan)
        near = np.stack([around[1 + r : around.shape[0] - 1 + r or None, :] for r in (-1, 0, 1)])
        near = np.stack([near[:, :, 1 + c : near.shape[2] - 1 + c or None] for c in (-1, 0, 1)])
        known = np.isfinite(near)
        count = known.sum(axis=(0, 1))
        mean = np.where(known, near, 0.0).sum(axis=(0, 1)) / np.maximum(count, 1)
        filled = np.where(np.isnan(filled) & (count > 0), mean, filled)
    return filled


def _stops() -> list[list[int]]:
    colours = colormaps[_MAP](np.linspace(0.0, 1.0, _N_STOPS))[:, :3]
    return [[round(255 * float(part)) for part in colour] for colour in colours]


def _canvas() -> str:
    said = "A crumpled page above the bed, in three dimensions. Arrow keys turn and tilt it, plus and minus zoom."
    return element("canvas", "", id="view", tabindex="0", role="img", aria_label=said)


def _scale(full: float) -> str:
    """Return the colour bar; its colours are those that the sheet gets."""
    stops = "".join(
        f'<stop offset="{i / (_N_STOPS - 1):.4f}" stop-color="rgb({",".join(map(str, stop))})"/>'
        for i, stop in enumerate(_stops())
    )
    bar = (
        f'<svg viewBox="0 0 100 6" preserveAspectRatio="none" aria-hidden="true"><defs><linearGradient id="map">{stops}'
        '</linearGradient></defs><rect width="100" height="6" fill="url(#map)"/></svg>'
    )
    ends = f'<div class="ends"><span>0</span><span>{full / 2:g}</span><span>{full:g} and more</span></div>'
    return f'<div id="scale" hidden>Distance from the true place [mm]{bar}{ends}</div>'


def _fall(last: int) -> str:
    slider = f'<input type="range" id="way" min="0" max="{last}" step="1" value="0">'
    return (
        '<div class="row"><button type="button" id="fall">Let it fall</button>'
        f'<label class="long">From the scan (left) to the flat page (right){slider}</label></div>'
        '<div id="where"></div>'
    )


def _choices(name: str, legend: str, choices: Sequence[tuple[str, str]]) -> str:
    keys = "".join(
        f'<label class="choice"><input type="radio" name="{name}" value="{value}"{" checked" if i == 0 else ""}>'
        f"<span>{escape(text)}</span></label> "
        for i, (value, text) in enumerate(choices)
    )
    return f"<fieldset><legend>{escape(legend)}</legend>{keys}</fieldset>"


def _shown() -> str:
    return _choices("shown", "Show", (("page", "The page"), ("error", "Its error in mm")))


def _turning() -> str:
    buttons = " ".join(
        element("button", text, type="button", data_turn=key, **({"aria_label": said} if said else {}))
        for key, text, said in _TURNS
    )
    return f"<fieldset><legend>Turn (or drag; arrow keys on the view)</legend>{buttons}</fieldset>"


def _lights(sheet: FallingSheet) -> str:
    """Return the photographs, which are also what chooses the light."""
    labels = ""
    for i, (name, image) in enumerate(sheet.pictures.items()):
        picture, text = photograph(image, 65), _LIGHTS.get(name, name)
        checked = " checked" if i == 0 else ""
        labels += (
            f'<label class="light"><input type="radio" name="light" value="{escape(name)}"{checked}>'
            f'<img src="{picture.source}" width="{picture.width}" height="{picture.height}" '
            f'alt="The crumpled page: {escape(text)}"><span>{escape(text)}</span></label>'
        )
    legend = "<legend>Light: the photographs, each stretched to its own brightest</legend>"
    return f'<fieldset>{legend}<div class="lights">{labels}</div></fieldset>'


def _caption(sheet: FallingSheet) -> str:
    mean, top = float(np.nanmean(sheet.error_mm)), float(np.nanmax(sheet.error_mm))
    best = float(np.nanmean(sheet.best_error_mm))
    rows, columns = sheet.error_mm.shape
    return (
        f'<p class="small soft">Mesh of {rows} x {columns} vertices; {len(sheet.frames)} states recorded from the '
        f"solver, straight lines between them; at rest after {sheet.steps[-1]} steps. Error of the vertices against "
        f"the truth, rigidly aligned: mean {mean:.2f} mm, largest {top:.2f} mm by the paper’s method, as coloured; "
        f"mean {best:.2f} mm by the best method. While the sheet is bent, a place has the colour of the error that it "
        "ends with.</p>"
    )
