"""Dense error and coverage against pages whose truth is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew import projection
from deskew.errors import InputError, StepError
from deskew.metrics import dense_error, page_coverage
from deskew.types import Floats, Pinhole, Restoration

PAGE = (110.0, 80.0)
SIZE = (320, 240)
# 0.5 mm a pixel on the bed.
CAMERA = Pinhole(
    size=SIZE,
    K=np.array([[1600.0, 0.0, 159.5], [0.0, 1600.0, 119.5], [0.0, 0.0, 1.0]]),
    distortion=np.zeros(5),
    R=np.diag([1.0, -1.0, -1.0]),
    t=np.array([0.0, 0.0, 800.0]),
)
NOTHING = (0.0, 0.0)


def page_places(angle: float = 0.0, shift: tuple[float, float] = NOTHING, scale: float = 1.0) -> Floats:
    """Page coordinates that a page lying flat, turned and shifted on the bed, shows at every pixel."""
    bed = projection.onto_bed(CAMERA, projection.pixel_grid(SIZE)) - shift
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    X, Y = np.moveaxis(bed @ turn / scale, -1, 0)
    return np.stack([X + PAGE[0] / 2, PAGE[1] / 2 - Y], axis=-1)


def off_page(uv: Floats, inset: float = 0.0) -> np.ndarray:
    return ((uv < inset) | (uv > np.array(PAGE) - inset)).any(axis=-1)


def restoration(drawn: np.ndarray | None = None) -> Restoration:
    backward = projection.pixel_grid(SIZE).astype(np.float32)
    if drawn is not None:
        backward[~drawn] = np.nan
    return Restoration(np.zeros(SIZE[::-1]), backward, CAMERA)


def on_page(uv: Floats) -> Floats:
    return np.where(off_page(uv)[..., None], np.nan, uv)


@settings(max_examples=15, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-5, 5), st.floats(-5, 5))
def test_flat_page_is_without_error_and_complete_wherever_it_lies(angle: float, dx: float, dy: float) -> None:
    figures = dense_error(restoration(), on_page(page_places(angle, (dx, dy))), PAGE)
    assert figures["dense_max_mm"] < 1e-9
    assert 0.9998 < figures["page_coverage"] <= 1.0


def test_sine_displacement_gives_its_closed_form_figures() -> None:
    """u off by a sine of amplitude .3 mm over whole periods: mean 2 / pi, p95 and max of a sine's absolute value."""
    uv = page_places()
    truth = on_page(uv)
    truth[..., 0] += 0.3 * np.sin(2 * np.pi * 13 * uv[..., 1] / PAGE[1])
    figures = dense_error(restoration(), truth, PAGE)
    assert figures["dense_mean_mm"] == pytest.approx(0.3 * 2 / np.pi, rel=0.02)
    assert figures["dense_p95_mm"] == pytest.approx(0.3 * np.sin(0.475 * np.pi), rel=0.02)
    assert figures["dense_max_mm"] == pytest.approx(0.3, rel=0.02)


def test_wrong_scale_is_seen() -> None:
    figures = dense_error(restoration(), on_page(page_places(scale=1.01)), PAGE)
    assert figures["dense_max_mm"] == pytest.approx(0.01 * np.hypot(*PAGE) / 2, rel=0.02)


def test_mirrored_page_is_an_error() -> None:
    uv = page_places()
    with pytest.raises(StepError, match="Dense error: the restored page is mirrored"):
        dense_error(restoration(), on_page(np.stack([PAGE[0] - uv[..., 0], uv[..., 1]], axis=-1)), PAGE)


def test_turned_by_half_is_not_mirrored() -> None:
    figures = dense_error(restoration(), on_page(np.array(PAGE) - page_places()), PAGE)
    assert figures["dense_max_mm"] < 1e-9


@pytest.mark.parametrize("angle", [0.013, 0.2])
@pytest.mark.parametrize("inset", [0.25, 0.5, 1.0, 3.0])
def test_lost_border_strip_is_missing_from_the_coverage(inset: float, angle: float) -> None:
    uv = page_places(angle)
    drawn = ~off_page(uv, inset)
    figures = dense_error(restoration(drawn), on_page(uv), PAGE)
    kept = (PAGE[0] - 2 * inset) * (PAGE[1] - 2 * inset) / (PAGE[0] * PAGE[1])
    assert figures["page_coverage"] == pytest.approx(kept, abs=0.001)


def test_drawn_up_to_the_pages_edge_alone_is_short_of_it_by_an_eighth_of_a_pixel() -> None:
    """Nothing drawn beyond the page: the outermost pixel speaks for half a pixel more, which is short on average."""
    uv = page_places(0.05)
    coverage = page_coverage(restoration(~off_page(uv)).backward_map, on_page(uv), PAGE)
    lost = 0.125 * 0.5 * 2 * sum(PAGE) / (PAGE[0] * PAGE[1])
    assert 1 - coverage == pytest.approx(lost, rel=0.3)


def test_half_shown_twice_does_not_pass_for_a_whole() -> None:
    """The left half of the page drawn in both halves of the picture."""
    uv = page_places()
    uv[..., 0] = np.where(uv[..., 0] < PAGE[0] / 2, uv[..., 0], uv[..., 0] - PAGE[0] / 2)
    truth = on_page(page_places()) * 0 + uv
    assert page_coverage(restoration().backward_map, truth, PAGE) == pytest.approx(0.5, abs=0.004)


def test_hole_is_missing_from_the_coverage() -> None:
    uv = page_places(0.1)
    hole = np.hypot(uv[..., 0] - 60, uv[..., 1] - 40) < 12
    coverage = page_coverage(restoration(~hole).backward_map, on_page(uv), PAGE)
    assert 1 - coverage == pytest.approx(np.pi * 144 / (PAGE[0] * PAGE[1]), rel=0.01)


def test_tear_does_not_count_what_lies_between() -> None:
    """A strip of 20 mm is skipped between two neighbouring columns of pixels."""
    uv = page_places()
    uv[..., 0] = np.where(uv[..., 0] < 60, uv[..., 0], uv[..., 0] + 20)
    coverage = page_coverage(restoration().backward_map, on_page(uv), PAGE)
    assert 1 - coverage == pytest.approx(20 / PAGE[0], abs=0.005)


def test_stretched_page_is_covered_all_the_same() -> None:
    for scale in (0.4, 1.05):
        uv = page_places(0.02, scale=scale)
        assert page_coverage(restoration().backward_map, on_page(uv), PAGE) > 0.9995


def test_hardly_any_page_is_a_failed_step_and_wrong_shapes_are_refused() -> None:
    nothing = np.full((*SIZE[::-1], 2), np.nan)
    with pytest.raises(StepError, match="0 restored pixels show the page, at least 100 needed"):
        dense_error(restoration(), nothing, PAGE)
    assert page_coverage(restoration().backward_map, nothing, PAGE) == 0.0
    with pytest.raises(InputError, match="`true_uv` must have the backward map's shape"):
        dense_error(restoration(), nothing[1:], PAGE)
    with pytest.raises(InputError, match="`page_size_mm` must be two positive lengths"):
        page_coverage(restoration().backward_map, on_page(page_places()), (0.0, 1.0))


@pytest.mark.parametrize("size", [(1e9, 10.0), (10.0, np.inf), (np.nan, 10.0), (-1.0, 10.0), (1e5, 1e5)])
def test_page_of_no_sound_size_is_refused(size: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="`page_size_mm` must"):
        page_coverage(restoration().backward_map, on_page(page_places()), size)
