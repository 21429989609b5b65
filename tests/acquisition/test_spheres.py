import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from deskew.acquisition.accuracy import flatness_mm, plane_deviation, retained
from deskew.acquisition.spheres import Sphere, fit_sphere, probe_sphere, spacing_error_mm
from deskew.errors import InputError, StepError

CENTRE = np.array([40.0, -30.0, 12.0])


def cap(n=4000, radius=30.0, rim_deg=55.0, seed=0, form=0.0):
    """Points evenly on a cap, alternately `form` / 2 above and below its sphere."""
    rng = np.random.default_rng(seed)
    cos = rng.uniform(np.cos(np.radians(rim_deg)), 1.0, n)
    angle = rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - cos**2)
    away = np.stack([sin * np.cos(angle), sin * np.sin(angle), cos], axis=-1)
    return CENTRE + (radius + form / 2 * (-1.0) ** np.arange(n))[:, None] * away


def test_a_sphere_is_found_exactly_from_a_cap():
    sphere = fit_sphere(cap())
    np.testing.assert_allclose(sphere.centre, CENTRE, atol=1e-8)
    assert sphere.radius_mm == pytest.approx(30.0, abs=1e-8)


def test_alternating_deviations_have_the_closed_form_probing_error():
    probing = probe_sphere(cap(20_000, radius=30.1, form=0.2), 30.0)
    # Drawn at random, the two halves weigh the cap unevenly by about 1 / sqrt(n).
    assert probing.form_mm == pytest.approx(0.2, abs=0.01)
    assert probing.size_mm == pytest.approx(0.2, abs=0.02)
    assert probing.n == 20_000 - 60


def test_noise_moves_the_sphere_as_the_linearised_fit_predicts():
    # 300 caps of 400 points: the sample deviation of the radius is known to 4 %.
    clean = cap(400)
    normals = (clean - CENTRE) / 30.0
    design = np.column_stack([normals, np.ones(400)])
    predicted = 0.05 * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    rng = np.random.default_rng(3)
    fits = [fit_sphere(clean + 0.05 * rng.normal(size=(400, 1)) * normals) for _ in range(300)]
    measured = np.std([[*fit.centre, fit.radius_mm] for fit in fits], axis=0)
    np.testing.assert_allclose(measured, predicted, rtol=0.16)


@given(st.integers(0, 10_000), st.lists(st.floats(-500, 500), min_size=3, max_size=3))
@settings(deadline=None, max_examples=25)
def test_figures_ignore_rotation_and_translation(seed, shift):
    rng = np.random.default_rng(seed)
    ball, sheet = cap(500, seed=seed) + rng.normal(0, 0.05, (500, 3)), rng.normal(0, 1, (500, 3)) * [80, 60, 0.1]
    R = Rotation.random(rng=rng).as_matrix()
    here, there = probe_sphere(ball, 30.0), probe_sphere(ball @ R.T + shift, 30.0)
    np.testing.assert_allclose(there.sphere.centre, R @ here.sphere.centre + shift, atol=1e-5)
    np.testing.assert_allclose((there.form_mm, there.size_mm), (here.form_mm, here.size_mm), atol=1e-5)
    assert flatness_mm(sheet @ R.T + shift) == pytest.approx(flatness_mm(sheet), abs=1e-6)


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=25)
def test_no_nearby_sphere_fits_better(seed):
    rng = np.random.default_rng(seed)
    points = cap(200, seed=seed) + rng.normal(0, 0.2, (200, 3))
    sphere = fit_sphere(points)
    best = (sphere.deviations(points) ** 2).sum()
    for _ in range(5):
        other = Sphere(sphere.centre + rng.normal(0, 0.05, 3), sphere.radius_mm + rng.normal(0, 0.05))
        assert (other.deviations(points) ** 2).sum() >= best - 1e-9


def test_a_wrong_scale_shows_in_size_and_spacing_and_not_in_flatness():
    rng = np.random.default_rng(1)
    sheet = np.column_stack([rng.uniform(-100, 100, (1000, 2)), np.zeros(1000)])
    assert flatness_mm(1.01 * sheet) < 1e-9 > plane_deviation(1.01 * sheet).rms_mm
    first, second = (probe_sphere(1.01 * (cap() + shift), 30.0) for shift in (np.zeros(3), [150.0, 0.0, 0.0]))
    assert first.size_mm == pytest.approx(0.6, abs=1e-6)
    assert spacing_error_mm(first.sphere, second.sphere, 150.0) == pytest.approx(1.5, abs=1e-6)


def test_three_per_mille_of_wild_points_change_neither_figure():
    rng = np.random.default_rng(2)
    sheet = np.column_stack([rng.uniform(-100, 100, (2000, 2)), rng.uniform(-0.1, 0.1, 2000)])
    wild = sheet.copy()
    wild[:6, 2] += 3.0
    # The plane itself tilts by a few micrometres.
    assert 0.19 < flatness_mm(wild) < 0.21
    assert flatness_mm(wild, share=0.0) > 2.9
    ball = cap(2000)
    ball[:6] += 3.0 * (ball[:6] - CENTRE) / 30.0
    assert probe_sphere(ball, 30.0).form_mm < 1e-6


def test_exactly_the_largest_residuals_go():
    keep = retained(np.array([0.1, -5.0, 0.3, 4.0, -0.2]), 0.4)
    assert keep.tolist() == [True, False, True, False, True]
    assert retained(np.arange(5.0), 0.0).all()


def test_what_curves_as_much_up_as_down_has_no_best_sphere():
    x, y = (steps.ravel() for steps in np.meshgrid(np.linspace(-50, 50, 15), np.linspace(-50, 50, 15)))
    for height in ((x**2 - y**2) / 100, x * y / 100):
        with pytest.raises(StepError, match="too little of a sphere"):
            fit_sphere(np.column_stack([x, y, height]))


def test_what_is_no_ball_is_refused():
    flat = np.random.default_rng(0).uniform(-50, 50, (100, 3)) * [1, 1, 0]
    for points, message in (
        (np.zeros((3, 3)), r"have shape \(N, 3\) with N >= 4, got \(3, 3\)"),
        (np.full((5, 3), np.nan), "be finite, got 5 points"),
        (flat, "curve out of a plane, got points in one plane"),
    ):
        with pytest.raises(InputError, match=f"`points` must {message}"):
            fit_sphere(points)
    with pytest.raises(InputError, match="`radius_mm` must be positive"):
        probe_sphere(cap(10), 0.0)
    with pytest.raises(InputError, match=r"`share` must be in \[0, 1\)"):
        probe_sphere(cap(10), 30.0, share=1.0)
    with pytest.raises(InputError, match="`known_mm` must be positive"):
        spacing_error_mm(Sphere(CENTRE, 1.0), Sphere(CENTRE, 1.0), 0.0)
