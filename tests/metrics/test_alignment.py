"""What alignment may and may not hide."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from deskew.errors import InputError
from deskew.metrics import fit_affine, fit_rigid
from deskew.types import Floats

angles = st.floats(-np.pi, np.pi)
shifts = st.tuples(st.floats(-500, 500), st.floats(-500, 500))
seeds = st.integers(0, 2**31)


def cloud(seed: int, n: int = 30) -> Floats:
    return np.random.default_rng(seed).uniform(-100, 100, (n, 2))


def turn(angle: float) -> Floats:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@settings(deadline=None)
@given(seeds, angles, shifts)
def test_rigid_fit_recovers_rotation_and_shift(seed: int, angle: float, shift: tuple[float, float]) -> None:
    points = cloud(seed)
    moved = points @ turn(angle).T + shift
    fit = fit_rigid(points, moved)
    np.testing.assert_allclose(fit.matrix, turn(angle), atol=1e-9)
    np.testing.assert_allclose(fit.apply(points), moved, atol=1e-9)


@settings(deadline=None)
@given(seeds, st.lists(st.floats(-2, 2), min_size=4, max_size=4), shifts)
def test_affine_fit_recovers_any_affine_map(seed: int, entries: list[float], shift: tuple[float, float]) -> None:
    points, matrix = cloud(seed), np.array(entries).reshape(2, 2)
    fit = fit_affine(points, points @ matrix.T + shift)
    np.testing.assert_allclose(fit.matrix, matrix, atol=1e-9)
    np.testing.assert_allclose(fit.offset, shift, atol=1e-6)


@settings(deadline=None)
@given(seeds, angles, shifts)
def test_residual_does_not_depend_on_where_the_points_lie(seed: int, angle: float, shift: tuple[float, float]) -> None:
    source, target = cloud(seed), cloud(seed + 1)
    for fit in (fit_rigid, fit_affine):
        before = np.linalg.norm(fit(source, target).apply(source) - target, axis=1)
        moved = source @ turn(angle).T + shift
        after = np.linalg.norm(fit(moved, target).apply(moved) - target, axis=1)
        np.testing.assert_allclose(after, before, atol=1e-8)


@settings(deadline=None)
@given(seeds)
def test_rigid_fit_agrees_with_scipys_kabsch(seed: int) -> None:
    source, target = cloud(seed), cloud(seed + 7)
    flat = np.zeros((len(source), 1))
    p, q = np.hstack([source - source.mean(0), flat]), np.hstack([target - target.mean(0), flat])
    # In space a planar mirror image is a turn about an axis in the plane; only turns about Z are comparable.
    rotation, _ = Rotation.align_vectors(q, p)
    ours = fit_rigid(source, target)
    assert np.linalg.det(ours.matrix) == pytest.approx(1.0)
    residual = np.linalg.norm(ours.apply(source) - target)
    if rotation.as_matrix()[2, 2] > 0:
        assert residual == pytest.approx(np.linalg.norm(rotation.apply(p) - q), rel=1e-6)
    else:
        assert residual > np.linalg.norm(rotation.apply(p) - q)


@pytest.mark.parametrize("fit", [fit_rigid, fit_affine])
def test_no_nearby_alignment_is_better(fit: type) -> None:
    source, target = cloud(3), cloud(3) @ turn(0.3).T + np.random.default_rng(4).normal(0, 2, (30, 2))
    best = fit(source, target)
    least = ((best.apply(source) - target) ** 2).sum()
    for step in (0.01, -0.01):
        turned = source @ (turn(step) @ best.matrix).T + best.offset
        assert ((turned - target) ** 2).sum() > least
        assert ((best.apply(source) + step - target) ** 2).sum() > least


def test_scale_shows_in_the_rigid_and_not_in_the_affine_residual() -> None:
    points = cloud(5)
    affine = np.linalg.norm(fit_affine(1.02 * points, points).apply(1.02 * points) - points, axis=1)
    rigid = np.linalg.norm(fit_rigid(1.02 * points, points).apply(1.02 * points) - points, axis=1)
    assert affine.max() < 1e-10
    np.testing.assert_allclose(rigid, 0.02 * np.linalg.norm(points - points.mean(0), axis=1), atol=1e-9)


def test_mirror_image_is_not_undone_by_the_rigid_fit() -> None:
    points = cloud(6)
    mirrored = points * [-1.0, 1.0]
    assert np.linalg.norm(fit_rigid(mirrored, points).apply(mirrored) - points, axis=1).mean() > 20.0
    assert np.linalg.norm(fit_affine(mirrored, points).apply(mirrored) - points, axis=1).max() < 1e-10


def test_degenerate_point_sets_are_refused() -> None:
    line = np.stack([np.arange(9.0), 2 * np.arange(9.0)], axis=-1)
    with pytest.raises(InputError, match="`source` must span a plane, got points on one line"):
        fit_affine(line, cloud(1, 9))
    with pytest.raises(InputError, match=r"`source` must have shape \(N >= 3, 2\), got \(2, 2\)"):
        fit_affine(line[:2], line[:2])
    with pytest.raises(InputError, match="`target` must have the source's shape"):
        fit_rigid(line, line[1:])
    with pytest.raises(InputError, match="`points` must be finite"):
        fit_rigid(line, line * np.nan)
