from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from deskew.errors import InputError
from deskew.flattening.conformal import lscm, signed_areas, tutte
from deskew.flattening.edges import edges_of
from deskew.flattening.energies import springs
from deskew.flattening.intrinsic import triangles
from deskew.flattening.laplace import laplacian
from deskew.flattening.meshes import flatten_mesh
from deskew.types import Array, Sheet, Status
from tests.flattening.bent_meshes import arch, error_mm, folded_mesh, irregular_fold, meshed, roll
from tests.flattening.bent_sheets import flat_grid

V, F, FLAT = folded_mesh(24)
FLATTENED = flatten_mesh(Sheet(V, F)).vertices
TILT = Rotation.from_euler("xyz", (0.3, -0.2, 1.0)).as_matrix()


def chord_arch() -> tuple[Array, Array, Array]:
    """The arch's chords span its development, shorter than the arcs by sin(h) / h."""
    vertices, faces, flat = arch()
    half = 100.0 / 40 / 25 / 2
    return vertices, faces, flat * (np.sin(half) / half, 1.0)


@pytest.mark.parametrize("energy", ["arap", "springs"])
@pytest.mark.parametrize("make", [chord_arch, lambda: roll(1.2), lambda: roll(3.0)], ids=["arch", "overhang", "scroll"])
def test_develops_what_can_be_developed_exactly(make, energy) -> None:  # type: ignore[no-untyped-def]
    vertices, faces, flat = make()
    found = flatten_mesh(Sheet(vertices, faces), energy=energy)
    assert found.status is Status.AT_REST
    assert error_mm(found.vertices, flat).max() < 1e-6
    assert found.counters["flips"] == 0
    assert not found.vertices[:, 2].any()


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_null_sheet_stays_as_it_is(energy: str) -> None:
    vertices, faces, flat = meshed(flat_grid(), flat_grid()[..., :2])
    found = flatten_mesh(Sheet(vertices, faces), energy=energy)
    np.testing.assert_allclose(found.vertices, vertices, atol=1e-9)
    tilted = flatten_mesh(Sheet(vertices @ TILT.T, faces), energy=energy)
    assert error_mm(tilted.vertices, flat).max() < 1e-9


def test_near_vertical_walls_lie_down() -> None:
    """A box pleat: floor, wall, roof, wall, floor, with walls at 89 degrees."""
    steps = np.repeat(np.radians([0.0, 89.0, 0.0, -89.0, 0.0]), 6) * 1.0
    x, z = np.cumsum(np.append(0, 2 * np.cos(steps))), np.cumsum(np.append(0, 2 * np.sin(steps)))
    y = np.linspace(0, -30, 16)[:, None]
    grid = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    flat = np.stack(np.broadcast_arrays(2.0 * np.arange(len(x)), y), axis=-1)
    vertices, faces, flat = meshed(grid, flat)
    assert error_mm(flatten_mesh(Sheet(vertices, faces)).vertices, flat).max() < 1e-6


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_holes_change_a_folded_page_little(energy: str) -> None:
    centres = FLAT[F].mean(axis=1)
    holes = (np.hypot(*(centres - (90, -110)).T) < 35) | (np.hypot(*(centres - (200, -60)).T) < 30)
    found = flatten_mesh(Sheet(V, F[~holes]), energy=energy)
    assert found.status is Status.AT_REST
    assert 0.01 < error_mm(found.vertices, FLAT, F[~holes]).mean() < 0.4


def test_error_shrinks_with_the_mesh() -> None:
    errors = [
        error_mm(flatten_mesh(Sheet(v, f)).vertices, flat).mean() for v, f, flat in map(folded_mesh, (20, 40, 80))
    ]
    assert errors[0] > 1.5 * errors[1] > 2.25 * errors[2] > 0.01


@pytest.mark.parametrize("make", [folded_mesh, irregular_fold])
def test_equals_libigl_arap_run_to_the_end(make) -> None:  # type: ignore[no-untyped-def]
    pytest.importorskip("igl")
    from deskew.flattening.peers import arap_places, lscm_places

    vertices, faces, _ = make()
    found = flatten_mesh(Sheet(vertices, faces))
    places = arap_places(vertices, faces.astype(np.int64), lscm_places(vertices, faces.astype(np.int64)), 2000)
    assert error_mm(found.vertices, places, faces).max() < 1e-3


def test_equals_scipys_minimum_of_the_springs() -> None:
    vertices, faces, _ = folded_mesh(8)
    edges = edges_of(faces)
    lengths = np.linalg.norm(vertices[edges.ends[:, 1]] - vertices[edges.ends[:, 0]], axis=1)
    model = springs(triangles(lengths, edges), edges, np.ones(len(faces)))
    found = flatten_mesh(Sheet(vertices, faces), energy="springs")

    L = laplacian(edges.ends, model.weights, len(vertices))

    def value(x: Array) -> tuple[float, Array]:
        places = x.reshape(-1, 2)
        return model.value(places), (L @ places - model.pull(places)).ravel()

    start = found.vertices[:, :2] + np.random.default_rng(0).normal(0, 0.2, (len(vertices), 2))
    best = minimize(value, start.ravel(), jac=True, method="BFGS", options={"gtol": 1e-9})
    assert 0 < best.fun <= found.counters["energy"] < best.fun * (1 + 1e-5)
    assert 0 < error_mm(found.vertices, best.x.reshape(-1, 2)).max() < 1e-3


def test_is_within_a_thousandth_of_the_converged_minimum() -> None:
    for make in (folded_mesh, irregular_fold):
        vertices, faces, _ = make()
        found = flatten_mesh(Sheet(vertices, faces))
        converged = flatten_mesh(Sheet(vertices, faces), tolerance=1e-12)
        assert 0 < np.abs(found.vertices - converged.vertices).max() < 1e-3


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.01, 100))
def test_moving_turning_and_scaling_the_sheet_moves_turns_and_scales_the_flat_one(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    R = Rotation.from_rotvec(rng.uniform(-1, 1) * np.array([0, 0, 1.0])).as_matrix()
    moved = flatten_mesh(Sheet(scale * (V @ R.T) + rng.uniform(-100, 100, 3), F)).vertices
    np.testing.assert_allclose(
        moved - moved.mean(axis=0), scale * (FLATTENED - FLATTENED.mean(axis=0)) @ R.T, atol=1e-3 * scale
    )
    tilted = flatten_mesh(Sheet(V @ Rotation.random(rng=rng).as_matrix().T, F)).vertices
    mirrored = signed_areas(tilted[:, :2], F).sum() < 0  # seen from the other side
    assert error_mm(tilted * (1, -1 if mirrored else 1, 1), FLATTENED[:, :2]).max() < 1e-3


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6))
def test_order_of_vertices_and_faces_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(V))
    place = np.argsort(order)
    faces = np.stack(
        [np.roll(f, k) for f, k in zip(place[rng.permutation(F)], rng.integers(0, 3, len(F)), strict=True)]
    )
    found = flatten_mesh(Sheet(V[order], faces)).vertices
    np.testing.assert_allclose(found, FLATTENED[order], atol=1e-3)


def test_page_seen_from_above_is_never_mirrored_and_a_scroll_keeps_its_faces_side() -> None:
    page = flatten_mesh(Sheet(V, F[:, ::-1].copy())).vertices
    np.testing.assert_allclose(page, FLATTENED, atol=1e-3)
    vertices, faces, flat = roll(2.5)
    inside = flatten_mesh(Sheet(vertices, faces[:, ::-1].copy())).vertices
    assert error_mm(inside, flat * (1, -1)).max() < 1e-6


@pytest.mark.parametrize("energy", ["arap", "springs"])
@pytest.mark.parametrize("ratio", [1e-3, 1e-1, 10.0, 1e3])
def test_any_ratio_of_stiffness_comes_to_rest(ratio: float, energy: str) -> None:
    centres = FLAT[F].mean(axis=1)
    inside = np.hypot(*(centres - FLAT.mean(axis=0)).T) < 60
    found = flatten_mesh(Sheet(V, F, np.where(inside, ratio, 1.0)), energy=energy)
    assert found.status is Status.AT_REST
    assert 2 <= found.counters["iterations"] <= 60
    tight = flatten_mesh(Sheet(V, F, np.where(inside, ratio, 1.0)), energy=energy, tolerance=1e-12)
    assert np.abs(found.vertices - tight.vertices).max() < 1e-3


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_stiff_part_keeps_its_size_when_the_rest_was_stretched(energy: str) -> None:
    vertices, faces, flat = meshed(flat_grid((17, 17), (64.0, 64.0)), flat_grid((17, 17), (64.0, 64.0))[..., :2])
    edges = edges_of(faces)
    inside = (np.abs(flat[faces].mean(axis=1) - (32, -32)).max(axis=1)) < 16
    rest = np.linalg.norm(flat[edges.ends[:, 1]] - flat[edges.ends[:, 0]], axis=1)
    rest[np.setdiff1d(edges.of_face[~inside], edges.of_face[inside])] *= 1.02
    errors = []
    for stiff in (1e-3, 1.0, 1e3):
        sheet = Sheet(vertices, faces, np.where(inside, stiff, 1.0))
        found = flatten_mesh(sheet, energy=energy, rest=rest)
        errors.append(error_mm(found.vertices, flat, faces[inside]).mean())
    assert errors[0] > errors[1] > 10 * errors[2] > 0


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_rest_lengths_of_the_flat_sheet_give_the_flat_sheet(energy: str) -> None:
    edges = edges_of(F)
    rest = np.linalg.norm(FLAT[edges.ends[:, 1]] - FLAT[edges.ends[:, 0]], axis=1)
    for faces in (F, np.concatenate([F[:, (1, 2, 0)], F[:3]])):
        for given_ in (rest, lambda vertices, faces: rest):
            found = flatten_mesh(Sheet(V, faces), energy=energy, rest=given_)
            assert error_mm(found.vertices, FLAT).max() < 1e-6


def test_starts_in_reserve_fold_nothing() -> None:
    centres = FLAT[F].mean(axis=1)
    faces = F[np.hypot(*(centres - FLAT.mean(axis=0)).T) > 40]
    used = np.unique(faces)
    faces = np.searchsorted(used, faces)
    edges = edges_of(faces)
    places = V[used]
    shapes = triangles(np.linalg.norm(places[edges.ends[:, 1]] - places[edges.ends[:, 0]], axis=1), edges)
    for start in (lscm(shapes, faces, edges), tutte(shapes, faces, edges)):
        areas = signed_areas(start, faces)
        assert areas.min() > 0
        assert 0.5 < areas.sum() / shapes.areas.sum() < 1.0001
    assert error_mm(lscm(shapes, faces, edges), FLAT[used]).max() < 6


def test_surface_that_cannot_lie_flat_is_spread_without_folds() -> None:
    polar, azimuth = np.meshgrid(np.linspace(0.1, 2.0, 15), np.linspace(0, 2 * np.pi, 40), indexing="ij")
    ball = 50 * np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    ball[:, -1] = ball[:, 0]
    vertices, faces, _ = meshed(ball, ball[..., :2])
    # The seam is closed by hand: the polar cap is a hole.
    faces = np.where(faces % 40 == 39, faces - 39, faces)
    found = flatten_mesh(Sheet(vertices, faces))
    assert found.status is Status.AT_REST
    assert found.counters["energy"] > 1


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_tube_is_spread_to_a_ring_by_a_start_in_reserve(energy: str) -> None:
    """Every edge of a tube can be unrolled along one direction, which lays its far side over its near one."""
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.linspace(0, -10, 6))
    grid = np.stack([30 * np.cos(around), 30 * np.sin(around), down], axis=-1)
    vertices, faces, _ = meshed(grid, grid[..., :2])
    faces = np.where(faces % 40 == 39, faces - 39, faces)
    found = flatten_mesh(Sheet(vertices, faces), energy=energy)
    assert found.status is Status.AT_REST
    areas = signed_areas(found.vertices[:, :2], faces)
    assert (areas > 0).all() or (areas < 0).all()
    assert np.ptp(found.vertices[:, 0]) == pytest.approx(np.ptp(found.vertices[:, 1]), rel=0.05)


def test_faces_that_turn_over_are_stiffened_until_they_lie_right() -> None:
    vertices, faces, flat = irregular_fold(250, 10)
    found = flatten_mesh(Sheet(vertices, faces), energy="springs")
    assert found.counters["stiffened_faces"] > 0
    assert found.counters["flips"] == 0
    assert signed_areas(found.vertices[:, :2], faces).min() > 0
    assert 0.1 < error_mm(found.vertices, flat, faces).mean() < 0.6


def test_turned_over_faces_are_told_with_a_remedy() -> None:
    vertices = V.copy()
    vertices[300] = vertices[40]  # a spike right across the page
    found = flatten_mesh(Sheet(vertices, F))
    assert found.status is Status.FOLDED
    assert found.counters["flips"] >= 1
    assert found.remedy.startswith(f"{found.counters['flips']:.0f} faces are turned over")


def test_too_few_steps_are_a_result_with_a_remedy() -> None:
    found = flatten_mesh(Sheet(V, F), max_iterations=1)
    assert found.status is Status.LOCKED
    assert "max_iterations" in found.remedy


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"energy": "bending"}, "`energy` must be one of springs, arap"),
        ({"tolerance": 0.5}, r"`tolerance` must be in \(0, 0.01\]"),
        ({"max_iterations": 0}, "`max_iterations` must be a whole number"),
        ({"rest": np.ones(3)}, r"`rest` must have shape \(\d+,\), one length an edge"),
        ({"rest": -np.ones(len(edges_of(F).ends))}, "`rest` must be finite, >= 0"),
    ],
)
def test_refuses_settings_out_of_range(values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        flatten_mesh(Sheet(V, F), **values)  # type: ignore[arg-type]
