from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from data_synth.cylinder import Bend, roll
from data_synth.plate import Plate, band_width, curvatures, derivatives, energy, normals, unbent, unchanged, yielded
from data_synth.relaxation import relax, relax_plastically
from deskew.types import Floats

SHAPE = (9, 7)
SPACING = (1.3, 0.9)


def page(shape: tuple[int, int] = SHAPE, spacing: tuple[float, float] = SPACING) -> Floats:
    x, y = (step * (np.arange(n) - (n - 1) / 2) for n, step in zip(shape, spacing, strict=True))
    return np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros(shape)], axis=-1)


def free(shape: tuple[int, int] = SHAPE, spacing: tuple[float, float] = SPACING) -> Plate:
    return Plate(spacing, 0.5, unbent(shape), np.zeros(shape), np.zeros(shape), unchanged(shape))


def loaded(rng: np.random.Generator) -> Plate:
    n, m = SHAPE
    rest = (0.1 * rng.normal(size=(n, m)), 0.1 * rng.normal(size=(n, m)), 0.1 * rng.normal(size=(n - 1, m - 1)))
    return Plate(SPACING, 0.5, rest, rng.random(SHAPE), rng.random(SHAPE), rng.uniform(0.95, 1.05, (n - 1, m - 1)))


def dense(band: Floats) -> Floats:
    n, width = band.shape
    H = np.zeros((n, n))
    for j in range(n):
        for offset in range(min(width, n - j)):
            H[j + offset, j] = H[j, j + offset] = band[j, offset]
    return H


def assembled(x: Floats, plate: Plate) -> tuple[Floats, Floats]:
    band = np.empty((x.size, band_width(SHAPE)))
    gradient = derivatives(x, plate, normals(x), band)
    return gradient, dense(band)


def test_the_gradient_is_that_of_the_energy() -> None:
    rng = np.random.default_rng(0)
    x, plate = page() + 0.1 * rng.normal(size=(*SHAPE, 3)), loaded(rng)
    at = normals(x)
    slopes = []
    for step in 1e-5 * np.eye(x.size).reshape(-1, *x.shape):
        slopes.append((energy(x + step, plate, at) - energy(x - step, plate, at)) / 2e-5)
    gradient, _ = assembled(x, plate)
    assert np.abs(gradient).max() > 0.1
    assert np.abs(gradient - slopes).max() < 1e-8


def test_the_hessian_is_the_gradients_derivative_under_tension_and_positive_under_any_load() -> None:
    rng = np.random.default_rng(1)
    plate = loaded(rng)
    taut = page() * 1.2 + 0.01 * rng.normal(size=(*SHAPE, 3))
    _, H = assembled(taut, plate)
    band, at = np.empty((taut.size, band_width(SHAPE))), normals(taut)
    for direction in rng.normal(size=(5, *taut.shape)):
        step = 1e-6 * direction
        change = (derivatives(taut + step, plate, at, band) - derivatives(taut - step, plate, at, band)) / 2e-6
        assert np.abs(change - H @ direction.ravel()).max() < 1e-6 * np.abs(change).max()
    _, H = assembled(page() * 0.9 + 0.1 * rng.normal(size=(*SHAPE, 3)), plate)
    assert np.linalg.eigvalsh(H).min() > -1e-9


def test_a_cylinder_stretches_nothing_and_bends_by_its_curvature() -> None:
    shape, spacing, radius = (61, 41), (0.5, 0.5), 40.0
    x = roll(page(shape, spacing), [Bend(0.0, 29.99, 29.99 / radius)], azimuth=0.0)
    plate = free(shape, spacing)
    along, across, twist = curvatures(x, spacing)
    assert np.abs(np.abs(along[2:-2]) * radius - 1).max() < 1e-4
    assert np.abs(across).max() < 1e-10
    assert np.abs(twist).max() < 1e-10
    area = 29.0 * 20.0  # the second difference is missing on the border, so half a cell there and its neighbour's half
    assert energy(x, plate) == pytest.approx(0.5 * plate.bending / radius**2 * area, rel=0.03)


def test_energy_does_not_change_with_the_pose() -> None:
    rng = np.random.default_rng(2)
    x, plate = page() + 0.1 * rng.normal(size=(*SHAPE, 3)), replace(loaded(rng), pull=np.zeros(SHAPE))
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    Q *= np.linalg.det(Q)
    moved = np.einsum("...j,kj->...k", x, Q) + 5.0
    assert energy(moved, plate) == pytest.approx(energy(x, plate), rel=1e-12)


def test_what_bends_beyond_the_yield_keeps_the_rest() -> None:
    x = roll(page((31, 21), (1.0, 1.0)), [Bend(0.0, 10.0, 1.0)], azimuth=0.0)
    plate = free((31, 21), (1.0, 1.0))
    plate = replace(plate, rest=yielded(x, plate, 0.03))
    assert np.abs(plate.rest[0][15]).max() == pytest.approx(0.1 - 0.03, rel=0.01)
    assert np.abs(plate.rest[0][2]).max() == 0
    again = yielded(x, plate, 0.03)
    for before, after in zip(plate.rest, again, strict=True):
        assert np.abs(after - before).max() < 1e-12


def test_a_sheet_that_never_yielded_springs_back_flat() -> None:
    x = roll(page((21, 15), (1.0, 1.0)), [Bend(0.0, 10.0, 0.6)], azimuth=0.3)
    plate = free((21, 15), (1.0, 1.0))
    rested = relax(x, plate, 60)
    assert 0 <= energy(rested, plate) < 1e-3 * energy(x, plate)
    assert np.ptp(rested[..., 2]) < 2.0 or np.linalg.svd((rested - rested.mean(axis=(0, 1))).reshape(-1, 3))[1][2] < 1


def test_relaxing_never_raises_the_energy_and_a_crease_stays() -> None:
    shape = (21, 15)
    pull, heights = np.zeros(shape), np.zeros(shape)
    pull[[3, 10, 17], 7], heights[[3, 10, 17], 7] = 1.0, [0.0, 3.0, 0.0]
    plate = replace(free(shape, (1.0, 1.0)), pull=pull, heights=heights)
    x = page(shape, (1.0, 1.0))
    energies = [energy(x, plate)]
    for _ in range(6):
        x = relax(x, plate, 1)
        energies.append(energy(x, plate))
    assert all(after < before * 1.001 for before, after in pairwise(energies))
    assert energies[-1] < 0.2 * energies[0]
    x, plate = relax_plastically(x, plate, 0.01, 3, 5)
    left = relax(x, replace(plate, pull=np.zeros(shape)), 20)
    assert np.ptp(left[:, 7, 2]) > 1.0
