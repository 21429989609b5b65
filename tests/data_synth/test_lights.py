from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import data_synth as ds
from data_synth.devices import packed, see
from data_synth.lettering import set_words
from data_synth.lights import under_lights
from data_synth.manuscript import Layer, Lettered, Manuscript
from deskew.errors import InputError

RIG = ds.default_rig()
# A quarter of the pixels each way, for speed.
SMALL = replace(RIG, camera=ds.Format((160, 120), (0.25, 0.25), (-0.375, -0.375)).camera(RIG.camera))
SIZE = (120.0, 90.0)
SHEET = ds.flat_sheet(SIZE)
LIGHTS = ds.standard_lights()


def manuscript(**changed: str) -> Manuscript:
    texts = {layer: changed.get(layer.value, "KLMN") for layer in list(Layer)[1:]}
    hidden = {layer: set_words((word,), SIZE, capital_mm=14.0, margin_mm=25.0) for layer, word in texts.items()}
    return Manuscript(Lettered(("ABCD",), SIZE, capital_mm=8.0), hidden)


SHOWN_BY = {"relief": "raking", "fluorescence": "uv", "transmittance": "backlight"}


@pytest.mark.parametrize(("layer", "shown_by"), list(SHOWN_BY.items()))
def test_one_light_alone_shows_its_hidden_text(layer: str, shown_by: str) -> None:
    plain = under_lights(SMALL, SHEET, manuscript(), LIGHTS, 3)
    other = under_lights(SMALL, SHEET, manuscript(**{layer: "WXYZ"}), LIGHTS, 3)
    changed = {name: int(np.abs(plain[name].astype(int) - other[name]).max()) for name in plain}
    assert changed.pop(shown_by) > 3
    assert set(changed.values()) == {0}
    white = [ds.photograph(SMALL, SHEET, page, 3).white for page in (manuscript(), manuscript(**{layer: "WXYZ"}))]
    assert np.array_equal(*white)


def test_a_format_shows_the_same_rays_at_other_pixels() -> None:
    readout = ds.Format((1996, 1450), (3.05, 2.97), (11.5, -7.25))
    there = packed(readout.camera(RIG.camera))
    for point in np.random.default_rng(0).uniform(-130, 130, (50, 3)):
        here = np.array(see(packed(RIG.camera), *point)[:2])
        assert np.allclose(see(there, *point)[:2], readout.from_scan[:, :2] @ here + readout.from_scan[:, 2], atol=1e-9)


def test_a_texture_in_another_format_lies_where_its_map_says() -> None:
    readout = ds.Format((900, 660), (1.4, 1.35), (3.0, 5.0))
    light = replace(LIGHTS[0], readout=readout)
    capture, truth = ds.render(RIG, SHEET, ds.Blank(SIZE), 5, lights=[light])
    image = capture.textures["above"]
    assert image.shape == (660, 900)
    page = truth.pixels_of(np.array([[1.0, 1.0], [SIZE[0] - 1.0, SIZE[1] - 1.0]]))
    inside = page @ truth.texture_maps["above"][:, :2].T + truth.texture_maps["above"][:, 2]
    rows, columns = np.nonzero(image > 90)
    assert np.allclose((columns.min(), rows.min()), inside[0], atol=3.5)
    assert np.allclose((columns.max(), rows.max()), inside[1], atol=3.5)


@pytest.mark.parametrize("tilt_deg", [5.0, 10.0])
def test_raking_light_gains_what_the_slope_says(tilt_deg: float) -> None:
    raking = replace(LIGHTS[1], even=0.0, desk=0.0)

    def level(azimuth_deg: float, tilt: float) -> float:
        sheet = ds.plane(SIZE, tilt_deg=tilt, azimuth_deg=azimuth_deg)
        image = under_lights(SMALL, sheet, ds.Blank(SIZE), [raking], 1)["raking"]
        return float(image[50:70, 70:90].mean()) - RIG.config.pedestal_grey

    # The lamp stands at -X: a page that rises towards +X faces it.
    elevation, tilt = np.radians([raking.elevation_deg, tilt_deg])
    facing, averted = (np.sin(elevation + side * tilt) / np.sin(elevation) for side in (1, -1))
    assert level(0.0, tilt_deg) / level(0.0, 0.0) == pytest.approx(facing, rel=0.04)
    assert level(180.0, tilt_deg) / level(0.0, 0.0) == pytest.approx(averted, rel=0.06)


def test_lights_of_one_name_are_refused() -> None:
    with pytest.raises(InputError, match="`lights` must have different names"):
        under_lights(RIG, SHEET, ds.Blank(SIZE), LIGHTS[:1] * 2, 1)
