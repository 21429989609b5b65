from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.flattening import flatten
from deskew.flattening.dynamics import choose_constants, folded_quads
from deskew.flattening.forces import spring_energy
from deskew.flattening.integrators import advance, start
from deskew.flattening.schemes import INTEGRATORS
from deskew.flattening.settings import ParticleSettings, SpringSettings
from deskew.flattening.springs import grid_springs
from deskew.types import Sheet, Status
from tests.flattening.bent_sheets import cylinder, flat_grid, mirror_folds, rigid_error, slope_p90_deg

METHODS = ["paper_euler", "paper_rk4"]


@pytest.mark.parametrize("method", METHODS)
def test_crumpled_pages_end_flat_unfolded_and_close_to_the_true_page(method: str) -> None:
    means = []
    for seed in range(10):
        vertices, truth = mirror_folds(seed)
        assert 18 < slope_p90_deg(vertices) < 22
        result = flatten(Sheet(vertices), method=method)
        assert result.status is Status.AT_REST, (seed, result.remedy)
        assert result.counters["folded_quads"] == 0
        assert (result.vertices[..., 2] == 0).all()
        means.append(rigid_error(result.vertices[..., :2], truth).mean())
    assert 0.05 < np.median(means) < 0.6
    assert max(means) < 1.2


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_comes_to_the_rest_that_statics_finds(integrator: str) -> None:
    sheet = Sheet(mirror_folds(3)[0])
    statics = flatten(sheet, method="spring", rest="chord").vertices
    result = flatten(sheet, method="particles", integrator=integrator)
    assert result.status is Status.AT_REST
    assert rigid_error(result.vertices[..., :2], statics[..., :2]).max() < 0.05


def test_particles_with_the_papers_integrators_are_the_papers_methods() -> None:
    sheet = Sheet(mirror_folds(3, (15, 15), n_folds=2)[0])
    for method in METHODS:
        same = flatten(sheet, method="particles", integrator=method.removeprefix("paper_"))
        assert np.array_equal(flatten(sheet, method=method).vertices, same.vertices)


def test_halving_keeps_particles_above_minus_eps_and_without_it_they_go_deep() -> None:
    sheet = Sheet(mirror_folds(3)[0])
    halved, not_halved = (flatten(sheet, method="paper_euler", halving=halving) for halving in ("working", "none"))
    assert 0 < halved.counters["penetration_mm"] <= 0.05
    assert halved.counters["steps_rejected"] > 0
    assert not_halved.counters["steps_rejected"] == 0
    assert not_halved.counters["penetration_mm"] > 1.0
    # It is lifted all the same: where the springs have the least energy does not depend on the way there.
    assert rigid_error(not_halved.vertices[..., :2], halved.vertices[..., :2]).max() < 0.01


def test_literal_halving_lets_no_particle_below_the_plane_and_does_not_end() -> None:
    result = flatten(Sheet(mirror_folds(3)[0]), method="paper_euler", halving="literal", max_steps=2_000)
    assert result.counters["penetration_mm"] == 0.0
    assert result.status is Status.LOCKED


def test_history_tells_how_the_push_became_flatness() -> None:
    history = flatten(Sheet(mirror_folds(3)[0]), method="paper_euler").history
    assert (np.diff(history["time_s"]) > 0).all()
    assert history["time_s"][0] == history["kinetic_energy_uj"][0] == 0.0
    assert history["spring_energy_uj"][0] < 1e-20
    assert history["height_max_mm"][0] > 10 > 0.05 > history["height_max_mm"][-1]
    # The push works against drag and springs: all energy together falls.
    total = history["spring_energy_uj"] + history["kinetic_energy_uj"] + history["potential_energy_uj"]
    assert (np.diff(total) < 0).all()


@pytest.mark.parametrize("method", METHODS)
def test_flat_sheet_stays_where_it_is(method: str) -> None:
    sheet = Sheet(flat_grid())
    result = flatten(sheet, method=method)
    assert result.status is Status.AT_REST
    assert np.array_equal(result.vertices, sheet.vertices)
    assert result.counters["spring_energy"] == 0.0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("radius_mm", [60.0, 100.0, 300.0])
def test_cylinder_unrolls_to_its_development_in_chords(method: str, radius_mm: float) -> None:
    vertices, development = cylinder(radius_mm)
    result = flatten(Sheet(vertices), method=method)
    assert result.status is Status.AT_REST
    step = 100.0 / 20
    chord = 2 * radius_mm * np.sin(step / (2 * radius_mm))
    assert rigid_error(result.vertices[..., :2], development * [chord / step, 1.0]).max() < 0.01
    short = 100.0 * (1 - chord / step)
    assert 0.2 * short < rigid_error(result.vertices[..., :2], development).max() < 0.5 * short + 0.01


@settings(max_examples=12, deadline=None)
@given(angle=st.floats(-np.pi, np.pi), shift=st.tuples(*3 * [st.floats(-200, 200)]))
def test_rotated_and_shifted_start_gives_rotated_and_shifted_end(angle: float, shift: tuple[float, ...]) -> None:
    vertices, _ = mirror_folds(5, (13, 16), n_folds=2)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    expected = flatten(Sheet(vertices), method="paper_euler").vertices @ turn.T + [*shift[:2], 0.0]
    result = flatten(Sheet(vertices @ turn.T + list(shift)), method="paper_euler")
    assert result.status is Status.AT_REST
    assert np.abs(result.vertices - expected).max() < 0.02


def test_stiffness_and_mass_only_set_the_clock() -> None:
    sheet = Sheet(mirror_folds(2, (15, 15), n_folds=2)[0])
    plain, other = flatten(sheet, method="paper_euler"), flatten(sheet, method="paper_euler", k_s=700.0, mass=3e-4)
    assert np.abs(plain.vertices - other.vertices).max() < 1e-6
    ratio = np.sqrt((3e-4 / 700.0) / (2.4e-6 / 1.0))
    assert other.counters["time"] == pytest.approx(ratio * plain.counters["time"], rel=1e-6)


def test_no_vertex_ends_below_the_plane_even_when_stopped_early() -> None:
    sheet = Sheet(mirror_folds(1)[0] - [0, 0, 30.0])
    for max_steps in (1, 37, 100, 250):
        assert flatten(sheet, method="paper_euler", max_steps=max_steps).vertices[..., 2].min() >= 0.0


@pytest.mark.parametrize("method", METHODS)
def test_energy_never_rises_once_the_sheet_lies_flat(method: str) -> None:
    sheet = Sheet(mirror_folds(4, (25, 25), n_folds=4)[0])
    scheme = INTEGRATORS[method.removeprefix("paper_")]
    springs = grid_springs(sheet, SpringSettings(1.0))
    vertices = sheet.vertices - [0, 0, sheet.vertices[..., 2].min()]
    run = start(vertices, scheme, 1.0)
    constants = choose_constants(springs, run.x.copy(), scheme, ParticleSettings())
    run.clock[:] = constants.pace.dt_max, 0.0, constants.pace.dt_max
    energies = []
    for _ in range(200):
        advance(run, scheme, constants.physics, constants.plane, constants.pace, 10)
        if run.x[2].max() < constants.plane.eps:
            kinetic = 0.5 * constants.physics.mass * (run.v[:2] ** 2).sum()
            energies.append(float(spring_energy(run.x, constants.physics) + kinetic))
    assert len(energies) > 50
    assert np.diff(energies).max() < 1e-3 * energies[0]
    assert energies[-1] < energies[0]


def test_weak_push_locks_and_says_what_to_raise() -> None:
    sheet = Sheet(mirror_folds(0)[0])
    gravity = flatten(sheet, method="paper_euler").counters["gravity"] / 100
    result = flatten(sheet, method="paper_euler", gravity=gravity)
    assert result.status is Status.LOCKED
    assert "gravity" in result.remedy
    assert result.counters["folded_quads"] == 0
    assert result.vertices[..., 2].max() > 0.05


def test_too_few_steps_are_told_from_a_buckle() -> None:
    result = flatten(Sheet(mirror_folds(0)[0]), method="paper_euler", max_steps=150)
    assert result.status is Status.LOCKED
    assert "max_steps" in result.remedy


def test_page_that_starts_folded_over_ends_folded() -> None:
    vertices = flat_grid()
    vertices[4, 5, 0] += 9.0  # beyond its right neighbour, 6 mm away
    result = flatten(Sheet(vertices), method="paper_euler")
    assert result.status is Status.FOLDED
    assert 1 <= result.counters["folded_quads"] <= 6
    assert "folded" in result.remedy


@pytest.mark.parametrize("method", METHODS)
def test_too_long_a_step_diverges_and_is_reported(method: str) -> None:
    sheet = Sheet(mirror_folds(0, (15, 15), n_folds=2)[0])
    stable = flatten(sheet, method=method).counters["dt"]
    result = flatten(sheet, method=method, dt=3 * stable)
    assert result.status is Status.DIVERGED
    assert "dt" in result.remedy
    assert result.vertices.shape == sheet.vertices.shape


def test_literal_halving_collapses_on_a_sheet_where_the_working_one_rests() -> None:
    sheet = Sheet(mirror_folds(6, (15, 15), n_folds=2)[0])
    literal = flatten(sheet, method="paper_euler", halving="literal", max_steps=5000)
    assert literal.status is Status.LOCKED
    assert "halving" in literal.remedy
    assert literal.counters["dt_smallest"] < literal.counters["dt"] / 100
    assert flatten(sheet, method="paper_euler").status is Status.AT_REST


def test_undamped_explicit_euler_is_refused_and_undamped_rk4_is_not() -> None:
    sheet = Sheet(mirror_folds(0, (15, 15), n_folds=2)[0])
    with pytest.raises(InputError, match="`k_d` must be positive"):
        flatten(sheet, method="paper_euler", k_d=0.0, drag=0.0)
    assert flatten(sheet, method="paper_rk4", k_d=0.0, max_steps=200).counters["dt"] > 0


def test_softer_half_takes_up_the_strain() -> None:
    # A page whose middle row was drawn in: the soft half must give way more than the stiff one.
    vertices = flat_grid((13, 13), (60.0, 60.0))
    vertices[..., 2] = 8.0 * np.exp(-((vertices[..., 0] - 30) ** 2 + (vertices[..., 1] + 30) ** 2) / 200)
    stiffness = np.ones((12, 12))
    stiffness[:, :6] = 0.01
    result = flatten(Sheet(vertices, stiffness=stiffness), method="paper_euler")
    assert result.status is Status.AT_REST
    springs = grid_springs(Sheet(vertices), SpringSettings(1.0))
    a, b, rest, _ = springs.pairs()
    points = result.vertices.reshape(-1, 3)
    strain = np.abs(np.linalg.norm(points[a] - points[b], axis=1) / rest - 1)
    column = (a % 13 + b % 13) / 2
    assert strain[column < 5].mean() > 2 * strain[column > 7].mean()


def test_folded_quads_are_counted_whichever_way_the_sheet_faces() -> None:
    xy = flat_grid()[..., :2]
    assert folded_quads(xy) == folded_quads(xy * [-1, 1]) == 0
    xy[4, 5, 0] += 9.0
    assert folded_quads(xy) == folded_quads(xy * [-1, 1]) > 0


def digest(result: np.ndarray) -> str:
    return hashlib.sha256(result.tobytes()).hexdigest()


def test_same_bytes_with_one_and_two_threads() -> None:
    program = (
        "import hashlib, sys, numpy as np\nfrom deskew.flattening import flatten\nfrom deskew.types import Sheet\n"
        "v = np.frombuffer(sys.stdin.buffer.read()).reshape(45, 45, 3)\n"
        "print(hashlib.sha256(flatten(Sheet(v), method='paper_euler').vertices.tobytes()).hexdigest())"
    )
    vertices = mirror_folds(8)[0]
    digests = {digest(flatten(Sheet(vertices), method="paper_euler").vertices)}
    for threads in ("1", "2"):
        env = os.environ | dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), threads)
        done = subprocess.run(
            [sys.executable, "-c", program], input=vertices.tobytes(), env=env, capture_output=True, check=True
        )
        digests.add(done.stdout.decode().strip())
    assert len(digests) == 1


def test_two_pieces_at_different_heights_fall_flat_without_pulling_at_each_other() -> None:
    x, y = np.meshgrid(np.linspace(-40, 40, 9), np.linspace(30, -30, 7))
    z = np.where(x > 5, 12.0, 0.0)
    cut = np.zeros((6, 8), dtype=bool)
    cut[:, 4] = True
    sheet = Sheet(np.stack([x, y, z], -1), cut=cut)
    torn = flatten(sheet, method="paper_euler")
    assert torn.status is Status.AT_REST
    assert torn.counters["folded_quads"] == 0
    assert np.abs(torn.vertices[..., :2] - sheet.vertices[..., :2]).max() < 1e-6
    whole = flatten(Sheet(sheet.vertices), method="paper_euler")
    assert np.ptp(whole.vertices[..., 0]) > 84  # the step's slope was taken for paper
