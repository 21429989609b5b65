import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from deskew.acquisition.graycode import GrayCodeSettings, decode_gray
from deskew.errors import InputError
from deskew.projection import pixel_grid
from deskew.types import Capture, PatternKind, Reason

SIZE, PROJECTOR = (160, 120), (200, 150)
OVERSAMPLING = 16


def _intensities(extent, blur_px):
    """Light of each pattern and its inverse along the projector's axis, oversampled and blurred: (2 bits, n)."""
    index = np.arange(extent)
    gray = index ^ (index >> 1)
    n_bits = (extent - 1).bit_length()
    light = []
    for bit in range(n_bits - 1, -1, -1):
        on = np.repeat((gray >> bit & 1).astype(float), OVERSAMPLING)
        light += [gaussian_filter1d(pattern, blur_px * OVERSAMPLING, mode="nearest") for pattern in (on, 1 - on)]
    return np.array(light)


def _see(light, coordinate, albedo, noise, rng):
    """Frames of the camera whose pixels look at projector `coordinate`."""
    position = (np.arange(light.shape[1]) + 0.5) / OVERSAMPLING - 0.5
    for line in light:
        frame = (
            10 + 180 * albedo * np.interp(coordinate, position, line) + noise * rng.standard_normal(coordinate.shape)
        )
        yield np.clip(np.rint(frame), 0, 255).astype(np.uint8)


def _capture(column, row, albedo, noise=0.0, blur_px=0.6):
    rng = np.random.default_rng(3)
    columns = list(_see(_intensities(PROJECTOR[0], blur_px), column, albedo, noise, rng))
    rows = list(_see(_intensities(PROJECTOR[1], blur_px), row, albedo, noise, rng))
    white, black = (np.rint(10 + level * 180 * albedo).astype(np.uint8) for level in (1, 0))
    return Capture(white, black, PROJECTOR, PatternKind.GRAY_CODE, columns, rows)


def _coordinates():
    x, y = np.moveaxis(pixel_grid(SIZE), -1, 0)
    return 20 + 0.43 * x + 0.05 * y + 1e-3 * x * y / 4, 15 + 0.02 * x + 0.47 * y


def test_decodes_a_smooth_surface_to_a_twentieth_of_a_projector_pixel():
    column, row = _coordinates()
    decoded = decode_gray(_capture(column, row, np.ones(column.shape), noise=1.5))
    ok = decoded.reason == Reason.OK
    assert 0.85 < ok.mean() < 1.0
    for got, true in ((decoded.column, column), (decoded.row, row)):
        error = (got - true)[ok]
        assert abs(error.mean()) < 0.01  # a half-pixel shift would be seen
        assert 0.0 < np.sqrt(np.mean(error**2)) < 0.05


def test_index_alone_has_the_quantisation_of_one_pixel():
    column, row = _coordinates()
    decoded = decode_gray(_capture(column, row, np.ones(column.shape)), GrayCodeSettings(subpixel=False))
    error = (decoded.column - column)[decoded.reason == Reason.OK]
    assert np.abs(error).max() < 0.75
    assert 0.25 < np.sqrt(np.mean(error**2)) < 0.32  # 1 / sqrt(12) = .289


def test_ink_does_not_bend_the_code_and_its_edges_say_so():
    """Pattern minus inverse cancels albedo; only where a pixel straddles an edge of ink could it be bent."""
    column, row = _coordinates()
    x, y = np.moveaxis(pixel_grid(SIZE), -1, 0)
    albedo = np.where((x // 16 + y // 16) % 2 == 0, 1.0, 0.15)
    decoded = decode_gray(_capture(column, row, albedo, noise=1.0))
    ok = decoded.reason == Reason.OK
    assert np.sqrt(np.mean((decoded.column - column)[ok] ** 2)) < 0.08
    inside = (np.abs(x % 16 - 7.5) < 5) & (np.abs(y % 16 - 7.5) < 5)
    at_edge = (x % 16 == 0) & (x > 0) & (np.abs(y % 16 - 7.5) < 5)
    assert ok[inside].mean() > 0.9
    assert not ok[at_edge].any()
    assert (decoded.reason[at_edge] == Reason.EDGE).mean() > 0.7  # the others were weak or at the image border


def test_projector_out_of_focus_is_decoded_from_its_coarser_bits():
    column, row = _coordinates()
    capture = _capture(column, row, np.ones(column.shape), noise=1.0, blur_px=2.5)
    full = decode_gray(capture, GrayCodeSettings(n_dropped_max=0))
    coarser = decode_gray(capture, GrayCodeSettings(n_dropped_max=2))
    assert np.isfinite(full.column).mean() < 0.6
    assert np.isfinite(coarser.column).mean() > 0.8
    assert 0.0 < np.sqrt(np.nanmean((coarser.column - column) ** 2)) < 0.25


def test_unlit_pixels_are_shadow_and_wild_codes_are_weak():
    column, row = _coordinates()
    albedo = np.ones(column.shape)
    albedo[40:60, 50:90] = 0.0
    capture = _capture(column, row, albedo)
    capture.columns[1][80:90, 20:40] = capture.columns[0][80:90, 20:40]  # a bit equal to its inverse
    capture.columns[3][80:90, 20:40] = capture.columns[2][80:90, 20:40]
    decoded = decode_gray(capture)
    assert (decoded.reason[40:60, 50:90] == Reason.SHADOW).all()
    assert (decoded.reason[80:90, 20:40] == Reason.WEAK).all()
    assert np.array_equal(np.isfinite(decoded.column), decoded.reason == Reason.OK)
    assert np.array_equal(np.isfinite(decoded.row), decoded.reason == Reason.OK)


def test_codes_beyond_the_projector_are_refused():
    """8 bits code 256 columns; a decoded column 230 of a projector of 200 is no column."""
    column, row = _coordinates()
    wide = Capture(
        *(lambda c: (c.white, c.black))(_capture(column, row, np.ones(column.shape))),
        PROJECTOR,
        PatternKind.GRAY_CODE,
        list(_see(_intensities(256, 0.6), column + 120, np.ones(column.shape), 0.0, np.random.default_rng(0))),
        _capture(column, row, np.ones(column.shape)).rows,
    )
    decoded = decode_gray(wide)
    beyond = column + 120 > 201
    assert beyond.any()
    assert (decoded.reason[beyond] == Reason.WEAK).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("shadow_snr", 0.0),
        ("bit_snr", -1.0),
        ("bit_snr", float("nan")),
        ("gap_max_px", 1),
        ("n_dropped_max", -1),
        ("ink_slope_max", 0.0),
        ("shadow_snr", float("inf")),
        ("gap_max_px", 2.5),
        ("n_dropped_max", 1.5),
        ("subpixel", "x"),
    ],
)
def test_settings_out_of_range_are_refused(name, value):
    with pytest.raises(InputError, match=f"`{name}` must"):
        GrayCodeSettings(**{name: value})


def test_a_line_sweep_is_no_gray_code():
    column, row = _coordinates()
    capture = _capture(column, row, np.ones(column.shape))
    frames = [capture.white] * PROJECTOR[0]
    sweep = Capture(capture.white, capture.black, PROJECTOR, PatternKind.LINE_SWEEP, frames, frames[: PROJECTOR[1]])
    with pytest.raises(InputError, match="hold a Gray code"):
        decode_gray(sweep)
