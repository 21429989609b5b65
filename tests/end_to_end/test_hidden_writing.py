"""Writing that one light alone shows reads after restoration, and only under that light."""

import numpy as np

import data_synth
from data_synth import Layer
from deskew import pipeline, restoration
from deskew.acquisition import InkSettings, SweepSettings
from deskew.types import Calibration
from experiments.studies.hidden_writing import Reader

SEED = 6301


def test_fluorescent_writing_reads_after_restoration_and_under_no_other_light():
    rig, rng = data_synth.default_rig(), np.random.default_rng(SEED)
    page = data_synth.hidden_manuscript(rng)
    lights = [light for light in data_synth.standard_lights() if light.name in ("above", "uv")]
    capture, truth = data_synth.render(rig, data_synth.crumpled(rng, slope_p90_deg=20.0), page, rng, lights=lights)
    known = Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.805)
    scan = pipeline.scan(capture, known, sweep=SweepSettings(mode="temporal"), ink=InkSettings())

    def share_read(reader, image, layer=Layer.FLUORESCENCE):
        return reader.letters_read(reader.flattened_contrast(image), layer)

    pixels = restoration.undistortion_map(rig.camera).astype(np.float64)
    before = Reader.of(page, truth.page_at(pixels), restoration.view_camera(rig.camera))
    crumpled = share_read(before, restoration.undistorted_view(capture.textures["uv"], rig.camera))
    restored = pipeline.restore_lights(scan)
    after = Reader.of(page, truth.page_at(restored.backward_map.astype(np.float64)), restored.camera)
    assert share_read(after, restored.images["uv"]) > 0.95
    assert share_read(after, restored.images["uv"]) > crumpled
    for other in ("white", "above"):
        assert share_read(after, restored.images[other]) < 0.15
    assert share_read(after, restored.images["uv"], Layer.TRANSMITTANCE) < 0.15
    shown = np.isfinite(restored.backward_map[..., 0])
    ratio = restoration.combined(restored.images, shown, "ratio:uv/above")["ratio-uv-above"]
    assert share_read(after, ratio) > 0.95
