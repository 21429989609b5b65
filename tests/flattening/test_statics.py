from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import deskew
from deskew.errors import InputError
from deskew.flattening import StaticSettings, energies, flatten
from deskew.flattening.chords import chord_lengths
from deskew.flattening.descent import newton
from deskew.flattening.flatforces import count_folded, flat_energy, flat_forces
from deskew.flattening.gridstart import conformal_start
from deskew.flattening.laplace import laplacian
from deskew.flattening.multigrid import framed, unframed
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import Springs, grid_springs
from deskew.types import Array, Sheet, Status
from tests.flattening.bent_sheets import cylinder, flat_grid, mirror_folds, rigid_error

SHAPE = (23, 31)


def folded(seed: int, shape: tuple[int, int] = SHAPE, slope_deg: float = 20.0) -> Array:
    return mirror_folds(seed, shape, slope_deg)[0]


def forces(x: Array, springs: Springs) -> Array:
    force = np.zeros_like(framed(x))
    flat_forces(framed(x), springs.rest, springs.k_s, np.empty((2, springs.grid[1])), force)
    assert not force[:, [0, -1]].any()
    assert not force[:, :, [0, -1]].any()
    return unframed(force)


def turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("seed", range(6))
def test_ends_where_the_particles_of_the_paper_come_to_rest(seed: int) -> None:
    sheet = Sheet(folded(seed))
    still, moving = flatten(sheet, rest="chord"), flatten(sheet, method="paper_rk4")
    assert still.status is Status.AT_REST
    if moving.status is not Status.AT_REST:
        pytest.skip(f"the dynamics end {moving.status}")
    assert rigid_error(still.vertices[..., :2], moving.vertices[..., :2]).max() < 0.02
    assert still.counters["spring_energy"] <= moving.counters["spring_energy"] * (1 + 1e-6)


def test_dynamics_rest_on_all_but_few_of_the_sheets_compared() -> None:
    resting = [flatten(Sheet(folded(seed)), method="paper_rk4").status is Status.AT_REST for seed in range(6)]
    assert sum(resting) >= 4


def test_flat_sheet_stays_as_it_is() -> None:
    flat = flat_grid((30, 41), (200.0, 150.0)) + np.array([5.0, -3.0, 40.0])
    result = flatten(Sheet(flat))
    assert np.abs(result.vertices[..., :2] - flat[..., :2]).max() < 1e-6
    assert not result.vertices[..., 2].any()


@pytest.mark.parametrize("radius", [15.0, 40.0, 300.0])
def test_fine_cylinder_unrolls_to_its_development(radius: float) -> None:
    bent, flat = cylinder(radius, (61, 241))
    assert 0 < rigid_error(flatten(Sheet(bent)).vertices[..., :2], flat).max() < 2e-3


def test_roll_of_more_than_a_turn_unrolls() -> None:
    # An Archimedean spiral of 1.6 turns, parametrised by arc length, seen edge on by no camera but flat all the same.
    angle = np.linspace(0.0, 3.2 * np.pi, 4000)
    radius = 12.0 + 0.8 * angle
    x, z = radius * np.cos(angle), radius * np.sin(angle)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    u = np.linspace(0.0, arc[-1], 161)
    v = np.linspace(0.0, 60.0, 31)
    bent = np.stack(np.broadcast_arrays(np.interp(u, arc, x), -v[:, None], np.interp(u, arc, z)), axis=-1)
    flat = np.stack(np.broadcast_arrays(u, -v[:, None]), axis=-1)
    result = flatten(Sheet(bent))
    assert result.status is Status.AT_REST
    assert rigid_error(result.vertices[..., :2], flat).max() < 0.02


def test_near_vertical_wall_lies_down() -> None:
    profile = np.array([0.0, 30.0, 30.6, 60.6])  # a step of 25 mm, 88.6 degrees steep
    heights = np.array([0.0, 0.0, 25.0, 25.0])
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(profile), np.diff(heights)))])
    u, v = np.linspace(0.0, arc[-1], 86), np.linspace(0.0, 50.0, 41)
    x, z = np.interp(u, arc, profile), np.interp(u, arc, heights)
    bent = np.stack(np.broadcast_arrays(x, -v[:, None], z), axis=-1)
    result = flatten(Sheet(bent))
    flat = np.stack(np.broadcast_arrays(u, -v[:, None]), axis=-1)
    assert result.status is Status.AT_REST
    # Two creases, each cutting at most a quad's corner off: a chord is short by less than half its length.
    assert rigid_error(result.vertices[..., :2], flat).mean() < 0.3


@settings(max_examples=12, deadline=None)
@given(
    angle=st.floats(-3.1, 3.1), x=st.floats(-500, 500), y=st.floats(-500, 500), scale=st.sampled_from([1e-3, 1.0, 1e4])
)
def test_turned_moved_and_scaled_sheet_flattens_alike(angle: float, x: float, y: float, scale: float) -> None:
    vertices = folded(3, (13, 17))
    plain = flatten(Sheet(vertices)).vertices
    moved = flatten(Sheet((vertices @ turned(angle).T + [x, y, 0.0]) * scale)).vertices
    assert np.allclose(moved, (plain @ turned(angle).T + [x, y, 0.0]) * scale, atol=2e-3 * scale)


@pytest.mark.parametrize("flip", [np.s_[::-1, :], np.s_[:, ::-1], np.s_[::-1, ::-1]])
def test_grid_numbered_from_another_corner_flattens_alike_and_is_never_mirrored(flip: Any) -> None:
    vertices = folded(5)
    assert np.allclose(flatten(Sheet(vertices[flip])).vertices[flip], flatten(Sheet(vertices)).vertices, atol=2e-3)


def test_transposed_grid_flattens_alike() -> None:
    vertices = folded(6)
    other = flatten(Sheet(np.ascontiguousarray(vertices.transpose(1, 0, 2)))).vertices.transpose(1, 0, 2)
    assert np.allclose(other, flatten(Sheet(vertices)).vertices, atol=2e-3)


@pytest.mark.parametrize(
    "shape", [(2, 2), (2, 9), (3, 3), (7, 4), (2, 200), (90, 5), (64, 65), (3, 300), (300, 3), (9, 210)]
)
def test_any_grid_flattens(shape: tuple[int, int]) -> None:
    bent, flat = cylinder(60.0, shape)
    result = flatten(Sheet(bent))
    assert result.status is Status.AT_REST
    assert result.counters["starts"] == 1
    chord = 60.0 * (100.0 / (shape[1] - 1) / 60.0) ** 3 / 24 * (shape[1] - 1)
    assert rigid_error(result.vertices[..., :2], flat).max() < 0.01 + chord


def test_multigrid_and_newton_find_the_same_minimum() -> None:
    sheet = Sheet(folded(2))
    quick = flatten(sheet, tolerance=1e-9)
    a, b, rest, k_s = grid_springs(sheet, SpringSettings()).pairs()
    springs = energies.Springs(np.stack([a, b], axis=-1), k_s, rest)
    matrix = laplacian(springs.ends, k_s, SHAPE[0] * SHAPE[1])
    exact = newton(springs, matrix, quick.vertices[..., :2].reshape(-1, 2), 1e-8, 50)
    assert exact.converged
    assert np.abs(exact.x.reshape(*SHAPE, 2) - quick.vertices[..., :2]).max() < 1e-5
    assert quick.counters["spring_energy"] == pytest.approx(springs.value(exact.x), rel=1e-9)


def test_default_tolerance_is_within_a_thousandth_of_a_millimetre() -> None:
    for seed in range(4):
        sheet = Sheet(folded(seed, (45, 45)))
        quick, exact = flatten(sheet).vertices, flatten(sheet, tolerance=1e-10).vertices
        assert 0 < rigid_error(quick[..., :2], exact[..., :2]).max() < 1e-3


@pytest.mark.parametrize("ratio", [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3])
def test_any_ratio_of_stiffness_converges_to_where_no_force_is_left(ratio: float) -> None:
    vertices = folded(4)
    vertices[8:15, 10:20, :2] *= 1.01  # a leaf that grew: no flat shape suits all springs
    stiffness = np.full((SHAPE[0] - 1, SHAPE[1] - 1), 1.0)
    stiffness[8:15, 10:20] = ratio
    result = flatten(Sheet(vertices, stiffness=stiffness))
    assert result.status is Status.AT_REST
    assert result.counters["iterations"] < 60
    springs = grid_springs(Sheet(vertices, stiffness=stiffness), SpringSettings())
    force = forces(result.vertices[..., :2], springs)
    assert np.abs(force).max() < 1e-4 * max(1.0, ratio) * springs.rest_mean


@pytest.mark.parametrize("k_s", [1e-9, 0.3, 7.0, 1e12])
def test_constant_of_even_springs_changes_nothing_but_the_energy(k_s: float) -> None:
    vertices = folded(4)
    plain = flatten(Sheet(vertices))
    by_map = Sheet(vertices, stiffness=np.full((SHAPE[0] - 1, SHAPE[1] - 1), k_s))
    for result in (flatten(Sheet(vertices), k_s=k_s), flatten(by_map)):
        assert result.counters["iterations"] == plain.counters["iterations"]
        assert result.counters["spring_energy"] == pytest.approx(k_s * plain.counters["spring_energy"], rel=1e-6)
        assert np.allclose(result.vertices, plain.vertices, atol=1e-6)


def test_stiff_region_keeps_its_shape_and_the_soft_one_gives() -> None:
    vertices = folded(4)
    leaf = np.s_[8:15, 10:20]
    grown = vertices.copy()
    grown[..., 2] += np.random.default_rng(0).normal(0, 2.0, SHAPE)  # no part of it lies flat at its own lengths
    errors = []
    for ratio in (1e-3, 1e3):
        stiffness = np.full((SHAPE[0] - 1, SHAPE[1] - 1), 1.0)
        stiffness[8:14, 10:19] = ratio
        flat = flatten(Sheet(grown, stiffness=stiffness)).vertices
        chords, now = chord_lengths(grown[leaf])[0], chord_lengths(flat[leaf])[0]
        errors.append(np.abs(now - chords).mean())
    assert 0 < errors[1] < 0.7 * errors[0]


def test_stiffness_may_be_a_function_of_place() -> None:
    vertices = folded(4)
    middles = (vertices[:-1, :-1] + vertices[:-1, 1:] + vertices[1:, :-1] + vertices[1:, 1:]) / 4
    given_ = np.where(middles[..., 0] > 0, 50.0, 1.0)
    by_function = deskew.flatten(vertices, stiffness=lambda p: np.where(p[:, 0] > 0, 50.0, 1.0))
    assert np.array_equal(by_function.vertices, deskew.flatten(vertices, stiffness=given_).vertices)


def test_dynamics_and_statics_agree_on_a_sheet_of_two_materials() -> None:
    sheet = Sheet(folded(1), stiffness=np.where(np.arange(30) < 12, 1.0, 8.0) * np.ones((22, 1)))
    moving = flatten(sheet, method="paper_rk4")
    assert moving.status is Status.AT_REST
    assert rigid_error(flatten(sheet, rest="chord").vertices[..., :2], moving.vertices[..., :2]).max() < 0.03


@pytest.mark.parametrize("more", [{"bending": 0.5}, {"more": 0.5}, {"bending": 1.0, "more": 0.25}])
def test_more_springs_agree_in_dynamics_and_statics_and_keep_an_isometric_sheet(more: dict[str, float]) -> None:
    bent, flat = cylinder(60.0, (13, 27))
    still, moving = flatten(Sheet(bent), rest="chord", **more), flatten(Sheet(bent), method="paper_rk4", **more)
    assert (still.status, moving.status) == (Status.AT_REST, Status.AT_REST)
    assert rigid_error(still.vertices[..., :2], moving.vertices[..., :2]).max() < 0.02
    # Their rest is the sum of the springs that they span, so that they ask for no other shape than those.
    plain = rigid_error(flatten(Sheet(bent)).vertices[..., :2], flat).max()
    assert rigid_error(still.vertices[..., :2], flat).max() < 1.5 * plain + 1e-3


def test_sections_lay_a_coarse_grid_down_as_the_dense_one_would() -> None:
    dense, flat = mirror_folds(7, (133, 177))
    coarse = Sheet(dense[::4, ::4], surface=dense)
    chord = rigid_error(flatten(coarse, rest="chord").vertices[..., :2], flat[::4, ::4]).mean()
    section = flatten(coarse)
    error = rigid_error(section.vertices[..., :2], flat[::4, ::4]).mean()
    assert 0 < error < 0.15 * chord
    assert section.surface is not None
    assert np.allclose(section.surface[::4, ::4], section.vertices)
    assert rigid_error(section.surface[..., :2], flat).mean() < 1.2 * error
    through = flatten(Sheet(dense), through=4)
    assert np.allclose(through.vertices, section.surface)


def test_sections_serve_the_other_energy_as_well() -> None:
    dense, flat = mirror_folds(7, (133, 177))
    coarse = Sheet(dense[::4, ::4], surface=dense)
    errors = [
        rigid_error(flatten(coarse, **{"energy": "arap"} | asked).vertices[..., :2], flat[::4, ::4]).mean()
        for asked in ({"energy": "springs"}, {}, {"rest": "chord"})
    ]
    assert 0 < errors[1] < 1.2 * errors[0] < 0.15 * errors[2]
    with pytest.raises(InputError, match="`noise_mm` must be 0 for a sheet with a surface"):
        flatten(coarse, noise_mm="auto")


def test_noise_of_a_grid_is_found_and_removed() -> None:
    vertices, flat = mirror_folds(3, (90, 120))
    vertices[..., 2] += np.random.default_rng(0).normal(0, 0.3, vertices.shape[:2])
    blind, clean = deskew.flatten(vertices), deskew.flatten(vertices, noise_mm="auto")
    assert clean.vertices.shape == vertices.shape
    assert clean.counters["noise_estimated_mm"] == pytest.approx(0.3, rel=0.03)
    assert 0 < rigid_error(clean.vertices[..., :2], flat).mean() < 0.1
    assert rigid_error(blind.vertices[..., :2], flat).mean() > 0.5


def test_wrong_ways_through_a_dense_grid_are_refused() -> None:
    with pytest.raises(InputError, match="`through` must divide both sides' 22 and 30 quads, got 4"):
        flatten(Sheet(folded(0)), through=4)
    with pytest.raises(InputError, match="`through` must be 1 for a sheet with a surface, a stiffness or cuts"):
        flatten(Sheet(folded(0), stiffness=np.ones((22, 30))), through=2)


def test_cut_pieces_flatten_without_pulling_at_each_other() -> None:
    flat = flat_grid((21, 21), (100.0, 100.0))
    raised = flat.copy()
    raised[:, 11:, 2] += 12.0
    cut = np.zeros((20, 20), dtype=bool)
    cut[:, 10] = True
    result = flatten(Sheet(raised, cut=cut))
    assert result.status is Status.AT_REST
    for part in (np.s_[:, :11], np.s_[:, 11:]):
        assert rigid_error(result.vertices[part][..., :2], flat[part][..., :2]).max() < 1e-3


def test_vertices_inside_a_cut_may_be_loose_and_coincide() -> None:
    vertices, flat = mirror_folds(3, (17, 17))
    cut = np.zeros((16, 16), dtype=bool)
    cut[3:9, 3:9] = True
    vertices[4:9, 4:9] = vertices[6, 6]
    held = np.ones((17, 17), dtype=bool)
    held[4:9, 4:9] = False
    for stiffness in (None, np.where(np.arange(16) < 8, 1.0, 100.0) * np.ones((16, 1))):
        result = flatten(Sheet(vertices, stiffness=stiffness, cut=cut))
        assert result.status is Status.AT_REST
        assert 0 < rigid_error(result.vertices[held][:, None, :2], flat[held][:, None]).mean() < 0.5


def test_conformal_start_of_a_developable_grid_is_its_development() -> None:
    bent, flat = cylinder(40.0, (24, 41))
    start = conformal_start(chord_lengths(bent))
    assert 0 < rigid_error(start, flat).max() < 0.05
    assert count_folded(start, np.zeros((23, 40), dtype=bool), -1.0) == 0


def test_forces_are_the_slope_of_the_energy() -> None:
    rng = np.random.default_rng(3)
    springs = grid_springs(Sheet(folded(0, (5, 6)), stiffness=rng.uniform(0.5, 2.0, (4, 5))), SpringSettings())
    x = flat_grid((5, 6))[..., :2] * 4 + rng.normal(0, 0.5, (5, 6, 2))
    force = forces(x, springs)
    for at in ((0, 0, 0), (2, 3, 1), (4, 5, 0), (4, 0, 1), (0, 5, 1)):
        h = np.zeros_like(x)
        h[at] = 1e-5
        slope = (flat_energy(x + h, springs.rest, springs.k_s) - flat_energy(x - h, springs.rest, springs.k_s)) / 2e-5
        assert force[at] == pytest.approx(-slope, rel=1e-6, abs=1e-7)


def test_too_few_iterations_are_told() -> None:
    result = flatten(Sheet(folded(1)), max_iterations=1)
    assert result.status is Status.LOCKED
    assert "raise `max_iterations`" in result.remedy


def bowl(n: int = 13) -> Array:
    """A surface that cannot lie flat, so that its springs are at rest in one place only."""
    grid = flat_grid((n, n), (60.0, 60.0))
    grid[..., 2] = ((grid[..., 0] - 30) ** 2 + (grid[..., 1] + 30) ** 2) / 60
    return grid


@pytest.mark.parametrize("constant", [1e-9, 0.01, 30.0, 1e11])
@pytest.mark.parametrize("ratio", [1.0, 3.0, 8.0])
def test_only_ratios_of_stiffness_matter(constant: float, ratio: float) -> None:
    quads = np.where(np.arange(12) < 6, ratio, 1.0) * np.ones((12, 1))
    one, other = (flatten(Sheet(bowl(), stiffness=k * quads)) for k in (1.0, constant))
    assert one.status is other.status is Status.AT_REST
    assert np.abs(one.vertices - other.vertices).max() < 1e-9
    assert other.counters["spring_energy"] == pytest.approx(constant * one.counters["spring_energy"], rel=1e-9)
    if ratio == 1.0:
        assert np.abs(flatten(Sheet(bowl()), k_s=constant).vertices - one.vertices).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rest", "chords"),
        ("rest", np.ones(2)),
        ("energy", np.ones(2)),
        ("noise_mm", np.ones(2)),
        ("noise_mm", True),
        ("max_iterations", 10**7),
        ("energy", "elastic"),
        ("noise_mm", -1.0),
        ("noise_mm", "much"),
        ("tolerance", 0.0),
        ("tolerance", np.nan),
        ("max_iterations", 0),
        ("bending", -0.1),
        ("more", 2e3),
        ("k_s", 0.0),
        ("through", 0),
    ],
)
def test_setting_out_of_range_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"`{name}` must .*, got "):
        StaticSettings(**{name: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("method", ["paper_rk4", "arap"])
def test_noise_is_refused_for_methods_that_cannot_remove_it(method: str) -> None:
    with pytest.raises(InputError, match=f"`noise_mm` must be 0 for {method}: only spring removes noise, got auto"):
        deskew.flatten(folded(0), method=method, noise_mm="auto")


def test_failing_function_of_stiffness_is_one_clear_error() -> None:
    for function, message in ((lambda p: 1 / 0, "ZeroDivisionError"), (lambda p: p[:3, 0], "reshape")):
        with pytest.raises(InputError, match=rf"`stiffness` must return one number a middle, got .*{message}"):
            deskew.flatten(folded(0), stiffness=function)


def test_order_of_calls_changes_no_bit() -> None:
    vertices = folded(8)
    first = flatten(Sheet(vertices)).vertices
    flatten(Sheet(folded(9)))
    assert np.array_equal(first, flatten(Sheet(vertices)).vertices)
