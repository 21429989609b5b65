"""The experiment `textures`, run small: hidden writing reads under its own light, and under no other."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import pytest

import data_synth
from deskew.types import Calibration
from experiments.program import main
from experiments.settings import Config
from experiments.studies import textures
from experiments.studies.bench import Bench

TEXTS = {"uv_text": "uv", "backlight_text": "backlight", "raking_text": "raking"}
LIGHTS = ("white", "above", "raking", "uv", "backlight")


def true_bench(config: Config, mode: str) -> Bench:
    """The true devices, which saves the boards' photographs."""
    rig = data_synth.default_rig(config.rig.noise_scale)
    return Bench(rig, Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.805))


def test_hidden_writing_reads_where_it_should_and_nowhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(textures, "calibrated_bench", true_bench)
    monkeypatch.setattr(textures, "_KONTRON", (860, 624))
    line = "experiment=textures seed=4721 trials=1 engine=serial scan.mode=temporal scan.denoise=false"
    assert main([*line.split(), f"out={tmp_path / 'out'}"]) == 0
    rows: dict[str, dict[str, float]] = defaultdict(dict)
    with (tmp_path / "out" / "results.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["condition"]][row["metric"]] = float(row["value"])
    for text, shown_by in TEXTS.items():
        reads = {light: rows[f"restored/{light}"][f"{text}_read"] for light in LIGHTS}
        assert reads.pop(shown_by) > (0.6 if shown_by == "raking" else 0.95)
        # Guessing reads 1 in 22.
        assert max(reads.values()) < 0.2
        before, after = (rows[f"{place}/{shown_by}"][f"{text}_correlation"] for place in ("unrestored", "restored"))
        assert before < after
    assert rows["restored/ratio-uv-above"]["uv_text_read"] > 0.95
    assert rows["restored/uv_fine"]["uv_text_read"] > 0.95
    for light in ("above_fine", "uv_fine"):
        found = rows[f"registration/{light}"]
        assert 0.0 < found["registration_error_px"] < min(0.3, 2 * found["registration_residual_px"])
    assert 0.0 < rows["restored"]["dense_mean_mm"] < 1.0
    assert (tmp_path / "out" / "figures" / "lights.png").is_file()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("experiment=textures page=checkerboard", "`page.kind` must be lettered"),
        ("experiment=textures sheet.paths=[a.npz] trials=2", "`trials` must be at most 1"),
        ("experiment=corner_distance page=lettered", "`page.kind` must be checkerboard"),
    ],
)
def test_a_page_that_an_experiment_cannot_use_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, message: str
) -> None:
    assert main([*line.split(), f"out={tmp_path / 'out'}"]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
