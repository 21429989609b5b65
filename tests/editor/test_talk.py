"""What the page asks and is answered, whatever comes."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from deskew.editor import Desk
from deskew.editor.talk import answer

PAINT = {"do": "paint", "tool": "rectangle", "label": 0, "points": [[160, 150], [620, 430]]}
JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
ASKED = st.sampled_from(["open", "paint", "leaf", "add", "change", "remove", "undo", "redo", "light", "free_scale"])
KEYS = st.sampled_from(["tool", "points", "label", "width", "tolerance", "stiffness", "name", "light", "on", "id"])


def pictures(state: dict, data: list[bytes]) -> dict[str, np.ndarray]:
    assert len(state["pictures"]) == len(data)
    decoded = (cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED) for png in data)
    return dict(zip(state["pictures"], decoded, strict=True))


def test_a_page_that_opens_gets_everything(desk: Desk) -> None:
    state, data = answer(desk, {"do": "open", "id": 7})
    shown = pictures(state, data)
    assert list(shown) == ["photograph", "overlay", "restored", "strain"]
    assert shown["photograph"].shape[:2] == shown["overlay"].shape[:2] == (576, 768)
    assert shown["restored"].shape[:2] == shown["strain"].shape[:2]
    assert not shown["overlay"][..., 3].any()
    assert (state["id"], state["error"], state["size"], state["saved"]) == (7, "", [768, 576], False)
    json.dumps(state, allow_nan=False)


def test_a_session_of_work(desk: Desk) -> None:
    for message in (
        {"do": "add"},
        {**PAINT, "label": 1},
        {"do": "change", "label": 1, "stiffness": 0.3, "name": "vellum"},
    ):
        state, data = answer(desk, message)
        assert state["error"] == ""
    shown = pictures(state, data)
    assert "difference" in shown
    assert "last" in shown
    assert "photograph" not in shown
    assert np.array_equal(shown["overlay"][..., 3] > 0, desk.painting.labels == 1)
    page, vellum = state["materials"]
    assert (vellum["name"], vellum["stiffness"], vellum["label"]) == ("vellum", 0.3, 1)
    assert vellum["share"] == pytest.approx(461 * 281 / (768 * 576))
    assert page["share"] + vellum["share"] == pytest.approx(1)
    assert state["figures"]["moved_mean_mm"] > 0.1
    state, _ = answer(desk, {"do": "save_map"})
    assert state["said"] == f"Saved {desk.files.map} and the table beside it."
    assert state["saved"]
    state, _ = answer(desk, {"do": "undo"})
    assert (state["undo"], state["redo"], state["saved"]) == (2, 1, False)


def test_colours_tell_which_way(desk: Desk) -> None:
    """Blue is squeezed, brown stretched; off the page the picture is clear."""
    state, data = answer(desk, {"do": "open"})
    strain = pictures(state, data)["strain"]
    look = desk.last_look()
    blue, red, alpha = (strain[..., c].astype(int) for c in (0, 2, 3))
    strong = np.abs(100 * look.strain) > 0.2 * state["limits"]["strain"]
    assert strong.any()
    assert np.array_equal((blue < red)[strong], (look.strain > 0)[strong])
    assert np.array_equal(alpha > 0, np.isfinite(look.strain))


def test_what_cannot_be_solved_is_said_and_the_last_page_shown(desk: Desk) -> None:
    answer(desk, {"do": "open"})
    state, data = answer(desk, {"do": "free_scale", "on": True})
    assert "two" in state["error"]
    assert "restored" in pictures(state, data)
    state, _ = answer(desk, {"do": "free_scale", "on": False})
    assert state["error"] == ""


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({}, "`do` must be one of open, paint,"),
        ({"do": ["open"]}, "`do` must be one of open, paint,"),
        ({**PAINT, "tool": "spray"}, "`tool` must be one of brush, rectangle, polygon, similar, got 'spray'."),
        ({**PAINT, "points": "here"}, "`points` must be places [x, y], got 'here'."),
        ({**PAINT, "points": [[1, 2], [3]]}, "`points` must be places [x, y]"),
        ({**PAINT, "label": True}, "`label` must be a whole number, got True."),
        ({**PAINT, "label": 9}, "`label` must be one of 0, got 9."),
        ({**PAINT, "width": "wide"}, "`width` must be a number, got 'wide'."),
        ({"do": "change", "label": 0, "stiffness": 0}, "`stiffness` must be in (0, 1e+09] [kg/s^2], got 0.0."),
        ({"do": "change", "label": 0, "name": 5}, "`name` must be 1 to 40 printable characters, got 5."),
        ({"do": "light", "light": "uv"}, "`light` must be one of white, got 'uv'."),
        ({"do": "free_scale", "on": "yes"}, "`on` must be true or false, got 'yes'."),
        ({"do": "leaf", "label": 0}, "`leaf` must be looked for in a capture, got a scan alone."),
    ],
)
def test_what_is_wrong_is_said_in_one_line_and_changes_nothing(desk: Desk, message: dict, error: str) -> None:
    before = desk.painting
    state, _ = answer(desk, message)
    assert state["error"].startswith(error)
    assert desk.painting is before


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(name=ASKED, rest=st.dictionaries(KEYS, JSON, max_size=5))
def test_whatever_comes_is_answered(desk: Desk, name: str, rest: dict) -> None:
    state, data = answer(desk, {"do": name, **rest})
    assert len(data) == len(state["pictures"])
    assert "\n" not in state["error"]
