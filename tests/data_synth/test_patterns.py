"""What the rig projects beside lines: Gray code and fringes, their light, and projectors that are at fault."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

import data_synth as ds
from data_synth.coded import light_profile
from data_synth.patterns import projected_lines
from deskew.errors import InputError
from deskew.types import Capture, Fringe, PatternKind, Pinhole

CODED = [PatternKind.GRAY_CODE, PatternKind.GRAY_PHASE, PatternKind.MULTI_PHASE]


def smaller(device: Pinhole, factor: int) -> Pinhole:
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / factor - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= factor
    return replace(device, size=(device.size[0] // factor, device.size[1] // factor), K=K)


def small_rig(**config: float) -> ds.Rig:
    rig = ds.default_rig()
    return ds.Rig(smaller(rig.camera, 4), smaller(rig.projector, 4), replace(rig.config, **config))  # type: ignore[arg-type]


def photograph(pattern: PatternKind, **config: float) -> Capture:
    return ds.photograph(small_rig(**config), ds.flat_sheet(), ds.Blank(), 11, pattern)


@pytest.mark.parametrize("pattern", CODED)
def test_frames_can_be_read_again_and_alone_and_come_out_the_same(pattern: PatternKind) -> None:
    rows = photograph(pattern).rows
    once, again = list(rows), list(rows)
    assert all(np.array_equal(a, b) for a, b in zip(once, again, strict=True))
    assert np.array_equal(rows[len(rows) - 1], once[-1])  # type: ignore[index]
    assert len({frame.tobytes() for frame in once}) == len(once)


def test_a_gray_code_plane_and_its_inverse_add_up_to_white_and_black() -> None:
    capture = photograph(PatternKind.GRAY_CODE, noise_scale=0.0)
    both = capture.white.astype(int) + capture.black
    for frames in (capture.columns, capture.rows):
        planes = list(frames)
        for plane, inverse in zip(planes[::2], planes[1::2], strict=True):
            assert np.abs(plane.astype(int) + inverse - both).max() <= 2  # four roundings
            assert (plane.astype(int) - inverse).std() > 5


def test_gray_codes_of_neighbouring_lines_differ_in_one_bit_and_all_lines_differ() -> None:
    lines = projected_lines(PatternKind.GRAY_CODE, 200, ())
    assert np.array_equal(lines[::2] + lines[1::2], np.ones((8, 200)))
    assert np.array_equal(np.abs(np.diff(lines[::2], axis=1)).sum(axis=0), np.ones(199))
    assert len({column.tobytes() for column in lines.T}) == 200
    assert lines[0, 0] == 0
    assert lines[0, -1] == 1  # most significant first


def test_half_periods_are_counted_before_the_steps_of_a_fringe() -> None:
    lines = projected_lines(PatternKind.GRAY_PHASE, 200, (Fringe(20.0, 5),))
    planes, steps = lines[:10:2], lines[10:]  # 20 half periods of 10 lines, 5 bits
    assert len(steps) == 5
    assert np.array_equal(np.flatnonzero(np.diff(planes, axis=1).any(axis=0)), np.arange(9, 190, 10))
    np.testing.assert_allclose(steps.sum(axis=0), 2.5)
    np.testing.assert_allclose(steps[:, ::20], np.tile(steps[:, :1], 10), atol=1e-12)
    assert np.array_equal(np.argmax(steps[:, [0, 4, 8, 12, 16]], axis=0), np.arange(5))  # a step moves it by a fifth


@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.5])
def test_a_fringe_loses_what_the_pixels_and_the_blur_of_the_projector_take(sigma: float) -> None:
    """``sinc(1 / P) exp(-2 (pi sigma / P)^2)`` of its modulation, and nothing of its phase."""
    period = 16.0
    profile, start = light_profile((1 + np.cos(2 * np.pi * np.arange(256) / period)) / 2, sigma)
    place = start + np.arange(len(profile)) / 64
    passed = np.sinc(1 / period) * np.exp(-2 * (np.pi * sigma / period) ** 2)
    inside = (place >= 32) & (place < 224)  # twelve periods
    first = 2 * (profile[inside] * np.exp(2j * np.pi * place[inside] / period)).mean()
    assert first == pytest.approx(passed / 2, abs=2e-5)
    assert profile[inside].mean() == pytest.approx(0.5, abs=5e-5)
    assert profile[0] == pytest.approx(0.0, abs=1e-6)


def test_a_driver_that_knows_the_gamma_makes_light_linear_and_another_leaves_the_rest() -> None:
    asked = np.linspace(0, 1, 101)
    np.testing.assert_allclose(ds.RigConfig().shown(asked), asked, atol=0.01)  # 8-bit codes
    np.testing.assert_allclose(ds.RigConfig(driver_gamma=1.0).shown(asked), asked**2.2, atol=0.01)
    np.testing.assert_allclose(ds.RigConfig(projector_gamma=1.8, driver_gamma=1.5).shown(asked), asked**1.2, atol=0.01)


def test_averaged_exposures_are_quieter_by_their_root_and_have_16_bits() -> None:
    one, many = (photograph(PatternKind.GRAY_PHASE, exposures=n) for n in (1, 16))
    silent = photograph(PatternKind.GRAY_PHASE, exposures=24, noise_scale=0.5)
    assert (one.white.dtype, many.white.dtype) == (np.uint8, np.uint16)
    page = np.s_[30:90, 40:120]
    noises = []
    for capture, unit in ((one, 1.0), (many, 257.0)):
        frame, clean = (next(islice(c.columns, 14, None)).astype(float) for c in (capture, silent))
        noises.append((frame[page] / unit - clean[page] / 257.0).std())
    assert 2.8 < noises[0] / noises[1] < 4.2  # 4, less what the clean picture keeps of noise
    with pytest.raises(InputError, match="`exposures` must be 1 for a line_sweep"):
        photograph(PatternKind.LINE_SWEEP, exposures=2)


@pytest.mark.parametrize("pattern", [PatternKind.LINE_SWEEP, PatternKind.GRAY_PHASE])
def test_a_repeated_frame_shows_the_pattern_before_and_a_late_one_both(pattern: PatternKind) -> None:
    healthy, stuck, late = (
        photograph(pattern, noise_scale=0.0, **fault)
        for fault in ({}, {"repeated_share": 1.0}, {"late_share_max": 1.0})  # type: ignore[arg-type]
    )
    frames, repeated = list(healthy.columns), list(stuck.columns)
    assert np.abs(repeated[0].astype(int) - healthy.black).max() <= 1
    assert all(np.array_equal(a, b) for a, b in zip(frames[:-1], repeated[1:], strict=True))
    shares = []
    for i, mixed in enumerate(islice(late.columns, 12)):
        before = (frames[i - 1] if i else healthy.black).astype(float)
        change = frames[i] - before
        moved = np.abs(change) > 20
        if moved.sum() > 50:
            share = 1 - (mixed - before)[moved] / change[moved]
            shares.append(float(np.median(share)))
            assert np.percentile(np.abs(share - shares[-1]), 95) < 0.1
    if pattern is not PatternKind.LINE_SWEEP:  # the first lines lie beside the page
        assert min(shares) < 0.4 < 0.6 < max(shares)


def test_a_rig_in_step_and_one_that_is_not_differ_in_nothing_but_that() -> None:
    healthy, faulty = (photograph(PatternKind.GRAY_CODE, repeated_share=share) for share in (0.0, 0.2))
    assert np.array_equal(healthy.white, faulty.white)
    same = [np.array_equal(a, b) for a, b in zip(healthy.columns, faulty.columns, strict=True)]
    assert 0 < same.count(False) < len(same) // 2


@pytest.mark.parametrize(
    ("setting", "value"), [("late_share_max", 1.1), ("repeated_share", -0.1), ("exposures", 1.5), ("driver_gamma", 0.0)]
)
def test_a_fault_out_of_range_is_refused(setting: str, value: float) -> None:
    with pytest.raises(InputError, match=f"`{setting}` must"):
        ds.RigConfig(**{setting: value})  # type: ignore[arg-type]
