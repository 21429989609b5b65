"""The rig's own projection against OpenCV's, which the reconstruction uses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import data_synth as ds
from data_synth.devices import from_raw, on_bed, packed, see, see_all, to_raw
from data_synth.rig import default_camera, default_projector
from deskew.errors import InputError
from deskew.projection import centre, onto_bed, project
from deskew.types import Pinhole

DEVICES = pytest.mark.parametrize("device", [default_camera(), default_projector()], ids=["camera", "projector"])


@DEVICES
def test_projection_agrees_with_opencv(device: Pinhole) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-150, -110, 0], [150, 110, 80], (40, 25, 3))
    seen = see_all(packed(device), points)
    assert np.allclose(seen[..., :2], project(device, points), atol=1e-9)
    assert np.allclose(seen[..., 2], (points @ device.R.T + device.t)[..., 2], atol=1e-9)


@given(
    distortion=st.tuples(*[st.floats(-0.2, 0.2)] * 2, *[st.floats(-2e-3, 2e-3)] * 2, st.floats(-0.1, 0.1)),
    x=st.floats(-0.25, 0.25),
    y=st.floats(-0.2, 0.2),
)
@settings(deadline=None)
def test_undistorting_inverts_distorting(distortion: tuple[float, ...], x: float, y: float) -> None:
    device = packed(replace(default_camera(), distortion=np.array(distortion)))
    assert from_raw(device, *to_raw(device, x, y)) == pytest.approx((x, y), abs=1e-11)


@DEVICES
def test_a_ray_meets_the_bed_where_opencv_says(device: Pinhole) -> None:
    rng = np.random.default_rng(1)
    for pixel in rng.uniform(0, np.array(device.size) - 1, (50, 2)):
        X, Y, depth = on_bed(packed(device), *pixel)
        assert onto_bed(device, pixel) == pytest.approx([X, Y], abs=1e-7)
        assert see(packed(device), X, Y, 0.0) == pytest.approx((*pixel, depth), abs=1e-8)


def test_the_bench_is_laid_out_as_described() -> None:
    rig = ds.default_rig()
    camera, projector = rig.camera, rig.projector
    assert camera.size == (640, 480)
    assert projector.size == (1024, 768)
    step = onto_bed(camera, np.array([[320.0, 240.0], [321.0, 240.0], [320.0, 241.0]]))
    assert np.allclose(np.linalg.norm(step[1:] - step[0], axis=1), 0.475, atol=0.005)
    to_camera, to_projector = centre(camera), centre(projector)
    across = [np.arctan2(eye[0], eye[2]) for eye in (to_camera, to_projector)]
    assert 22 < np.degrees(across[1] - across[0]) < 25
    # A real lens shift: the principal point lies below the projector's last row.
    assert projector.K[1, 2] > projector.size[1]
    # Both lenses bend the image by 1 to 6 px in some corner.
    for device in (camera, projector):
        ideal = replace(device, distortion=np.zeros(5))
        w, h = device.size
        corners = onto_bed(ideal, np.array([[0.0, 0], [w, 0], [w, h], [0, h]]))
        world = np.concatenate([corners, np.zeros((4, 1))], axis=1)
        bent = np.linalg.norm(project(device, world) - project(ideal, world), axis=1)
        assert 1 < bent.max() < 6


def test_the_projector_covers_the_page_and_the_desk_around_it_up_to_60_mm() -> None:
    projector = ds.default_rig().projector
    for z, margin in ((0.0, 2.0), (30.0, 1.0), (60.0, 0.0)):
        x, y = 139.5 + margin, 108.0 + margin
        pixels = project(projector, np.array([[sx * x, sy * y, z] for sx in (-1, 1) for sy in (-1, 1)]))
        assert pixels.min() > 0
        assert (pixels.max(axis=0) < np.array(projector.size) - 1).all()


@pytest.mark.parametrize("baseline", [100.0, 213.0, 426.0, 700.0])
def test_a_baseline_turns_the_projector_about_the_place_it_is_aimed_at(baseline: float) -> None:
    rig, default = ds.default_rig(baseline_mm=baseline), ds.default_rig()
    eye = centre(rig.projector)
    assert (eye - centre(rig.camera))[0] == pytest.approx(baseline)
    aim = np.array([-9.0, -135.0, 0.0])
    assert np.linalg.norm(eye - aim) == pytest.approx(np.linalg.norm(centre(default.projector) - aim))
    axis = np.array(rig.projector.R[2])
    assert np.allclose(eye + axis * np.linalg.norm(eye - aim), aim)
    assert np.array_equal(rig.projector.K, default.projector.K)
    if baseline == 426.0:
        assert np.array_equal(rig.projector.t, -rig.projector.R @ [432.0, -135.0, 985.0])


@pytest.mark.parametrize("baseline", [99.0, 701.0, np.nan])
def test_a_baseline_out_of_range_is_refused(baseline: float) -> None:
    with pytest.raises(InputError, match=r"`baseline_mm` must be in \[100, 700\]"):
        ds.default_rig(baseline_mm=baseline)


def test_skewed_devices_are_refused() -> None:
    K = default_camera().K.copy()
    K[0, 1] = 2.0
    with pytest.raises(InputError, match=r"`K` must have no skew, got 2\.0\."):
        packed(replace(default_camera(), K=K))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("noise_scale", -1.0),
        ("noise_draw", -1),
        ("projector_code", 0),
        ("camera_psf_sigma_px", 0.1),
        ("desk_albedo", 1.5),
        ("ambient", np.nan),
    ],
)
def test_bad_settings_are_named(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"`{name}` must be .*, got {value}"):
        ds.RigConfig(**{name: value})  # type: ignore[arg-type]
