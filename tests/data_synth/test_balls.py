import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import data_synth as ds
from data_synth.devices import packed
from data_synth.shading import irradiance
from deskew.errors import InputError


@given(st.floats(0, 5), st.floats(0, 360))
@settings(deadline=None, max_examples=5)
def test_every_vertex_lies_on_a_ball_or_on_the_plate(tilt, azimuth):
    body = ds.ball_plate(tilt_deg=tilt, azimuth_deg=azimuth)
    points = body.sheet.vertices
    polar = body.polar_deg(points)
    assert points[..., 2].min() == pytest.approx(0.0, abs=1e-12)
    assert body.spacing_mm == pytest.approx(150.0)
    plate = (polar > 55.0).all(axis=0)
    heights = points[plate] @ body.normal
    assert np.ptp(heights) < 1e-9
    for angle, centre in zip(polar, body.centres, strict=True):
        ball = points[angle < 55.0]
        # About pi (r sin 55)^2 of the plate in cells of 0.09 mm^2.
        assert len(ball) == pytest.approx(np.pi * 603.9 / 0.09, rel=0.01)
        np.testing.assert_allclose(np.linalg.norm(ball - centre, axis=1), 30.0, atol=1e-9)
        np.testing.assert_allclose((ball - centre).max(), 30.0, atol=0.2)


@pytest.mark.parametrize("azimuth", [0.0, 60.0, 120.0, 180.0, 240.0, 300.0])
def test_a_tilted_ball_is_seen_and_lit_all_around(azimuth):
    rig = ds.default_rig()
    body = ds.ball_plate(tilt_deg=5.0, azimuth_deg=azimuth)
    eye = -rig.camera.R.T @ rig.camera.t
    on_balls = (body.polar_deg(body.sheet.vertices) < 55.0).any(axis=0)
    points = body.sheet.vertices[on_balls]
    nearest = np.argmin(np.linalg.norm(points[:, None] - body.centres, axis=-1), axis=1)
    normals = (points - body.centres[nearest]) / body.radius_mm
    assert ((eye - points) * normals).sum(axis=1).min() > 0
    steepest = np.argsort(normals[:, 0])[:200]
    projector = packed(rig.projector)
    assert min(irradiance(projector, *points[i], *normals[i]) for i in steepest) > 0


def test_balls_that_do_not_fit_are_refused():
    for arguments, name in (
        ({"spacing_mm": 250.0}, "spacing_mm"),
        ({"spacing_mm": 40.0}, "spacing_mm"),
        ({"rim_deg": 80.0}, "rim_deg"),
        ({"tilt_deg": -1.0}, "tilt_deg"),
        ({"radius_mm": 0.0}, "radius_mm"),
        ({"azimuth_deg": np.nan}, "azimuth_deg"),
    ):
        with pytest.raises(InputError, match=f"`{name}` must"):
            ds.ball_plate(**arguments)
