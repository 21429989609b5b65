from __future__ import annotations

import numpy as np
import pytest

import data_synth as ds
from data_synth.boards import MARGIN_MM
from data_synth.devices import packed, see_all
from data_synth.pages import board_page
from deskew import restoration
from deskew.types import Floats

RIG = ds.manuscript_rig()


def test_the_finer_camera_sees_the_same_field_through_the_same_lens() -> None:
    points = np.random.default_rng(0).uniform(-130, 130, (1, 50, 3))
    coarse, fine = (see_all(packed(rig.camera), points)[0, :, :2] for rig in (ds.default_rig(), RIG))
    assert RIG.camera.size == (768, 576)
    # Pixel borders, half a pixel before the centres, are shares of the picture's sides.
    assert np.allclose((coarse + 0.5) / (640, 480), (fine + 0.5) / (768, 576), atol=1e-12)


@pytest.mark.parametrize("pose", ds.board_poses(12), ids=range(12))
def test_both_devices_see_every_board(pose: ds.BoardPose) -> None:
    width, height = board_page(ds.BOARD, MARGIN_MM).page_size_mm
    corners = np.array([[[a * width / 2, b * height / 2, 0.0] for a in (-1, 1) for b in (-1, 1)]])
    world = np.einsum("...j,kj->...k", corners, pose.R) + pose.t
    for device in RIG.camera, RIG.projector:
        x, y = see_all(packed(device), world)[0, :, :2].T
        assert min(x.min(), y.min()) > -0.5
        assert x.max() < device.size[0] - 0.5
        assert y.max() < device.size[1] - 0.5


def test_the_scans_picture_lies_whole_within_the_photograph() -> None:
    readouts = [ds.kontron_readout(np.random.default_rng(seed)) for seed in range(200)]
    for readout in readouts:
        low, high = readout.from_scan @ [0, 0, 1], readout.from_scan @ [*RIG.camera.size, 1]
        assert min(low) >= 0
        assert np.all(high <= readout.size)
    aspects = np.array([readout.scale[1] / readout.scale[0] for readout in readouts])
    assert aspects.min() < 0.97
    assert aspects.max() > 1.03


def rms(found: restoration.Registration, true: Floats) -> float:
    pixels = np.stack(np.meshgrid(*(np.linspace(0, n - 1, 41) for n in RIG.camera.size)), axis=-1)
    error = found.to_texture(pixels) - (pixels @ true[:, :2].T + true[:, 2])
    return float(np.sqrt((error**2).sum(axis=-1).mean()))


def test_a_photographed_leaf_is_registered_to_its_scan() -> None:
    rng = np.random.default_rng(900)
    two = ds.shipped_two_materials(ds.Case.A, 1)
    light = ds.kontron_light(rng)
    capture, truth = ds.render(RIG, two.sheet, ds.VellumPage(900, two.leaf), rng, lights=[light])
    found = restoration.register(capture.textures[light.name], capture.white, light.name)
    assert capture.textures[light.name].shape == ds.KONTRON_SIZE[::-1]
    assert 0 < rms(found, truth.texture_maps[light.name]) < 0.3
