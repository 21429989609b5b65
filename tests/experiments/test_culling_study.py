"""The study of culling: its shares by hand, and a page of a quarter of the size at two noise levels."""

from __future__ import annotations

import csv
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from data_synth import Rig
from deskew.types import Calibration, Pinhole
from experiments.program import main
from experiments.settings import RigSettings
from experiments.studies import culling
from experiments.studies.bench import Bench, configured_rig
from experiments.studies.culling import culling_figures

# Projector lines lie four times as far apart here, and so do outliers.
TINY = [
    "culling.outlier_mm=12",
    "experiment=culling",
    "trials=1",
    "engine=serial",
    "out=out",
    "culling.noise_scales=[1,4]",
]


def test_shares_are_of_the_outliers_of_the_culled_and_of_the_good() -> None:
    outlier = np.array([True] * 4 + [False] * 16)
    culled = np.array([True] * 3 + [False] * 9 + [True] * 2 + [False] * 6)
    found = culling_figures(outlier, culled)
    assert found == {
        "outliers_percent": 20.0,
        "culled_percent": 25.0,
        "recall_percent": 75.0,
        "precision_percent": 60.0,
        "good_lost_percent": 12.5,
    }


def test_without_outliers_or_without_culling_there_is_no_share_of_them() -> None:
    none, some = np.zeros(4, np.bool_), np.array([True, False, False, False])
    assert "recall_percent" not in culling_figures(none, some)
    assert culling_figures(none, some)["precision_percent"] == 0.0
    assert "precision_percent" not in culling_figures(some, none)
    assert culling_figures(some, none)["recall_percent"] == 0.0


def smaller(device: Pinhole) -> Pinhole:
    """A quarter of the pixels each way."""
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / 4 - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= 4
    return replace(device, size=(device.size[0] // 4, device.size[1] // 4), K=K)


def small_rig(settings: RigSettings) -> Rig:
    rig = configured_rig(settings)
    return replace(rig, camera=smaller(rig.camera), projector=smaller(rig.projector))


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, float]]:
    folder = tmp_path_factory.mktemp("culling")
    rig = small_rig(RigSettings())
    bench = Bench(rig, Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.8))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(culling, "calibrated_bench", lambda config, mode: bench)
        patch.setattr(culling, "configured_rig", small_rig)
        assert main(TINY) == 0
    assert (folder / "out" / "figures" / "depth_error.png").stat().st_size > 10_000
    rows: dict[str, dict[str, float]] = defaultdict(dict)
    with (folder / "out" / "results.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["condition"]][row["metric"]] = float(row["value"])
    return rows


def test_every_reading_noise_tolerance_and_gate_has_its_rows(found: dict[str, dict[str, float]]) -> None:
    culled = {
        f"{r}/culled/noise={n}/tolerance={t}" for r in ("guarded", "unguarded") for n in (1, 4) for t in (1, 2, 4)
    }
    choices = ("no_gate", "epipolar", "others", "all")
    gated = {f"{r}/gated/noise={n}/{g}" for r in ("guarded", "unguarded") for n in (1, 4) for g in choices}
    assert set(found) == culled | gated | {"page"}
    assert found["page"]["outlier_limit_mm"] == 12.0


def test_culling_takes_the_outliers_of_an_unguarded_reading_and_spares_the_rest(
    found: dict[str, dict[str, float]],
) -> None:
    wild, tame = (found[f"{reading}/culled/noise=4/tolerance=2"] for reading in ("unguarded", "guarded"))
    assert wild["outliers_percent"] > 0.1 > tame["outliers_percent"]
    assert wild["recall_percent"] > 90.0
    assert wild["good_lost_percent"] < 5.0
    before, after = (found[f"unguarded/gated/noise=4/{gates}"]["depth_raw_rms_mm"] for gates in ("no_gate", "epipolar"))
    assert before > 3 * after


def test_a_narrower_tolerance_culls_more_of_both(found: dict[str, dict[str, float]]) -> None:
    for metric in ("culled_percent", "recall_percent", "good_lost_percent"):
        shares = [found[f"unguarded/culled/noise=4/tolerance={t}"][metric] for t in (1, 2, 4)]
        assert shares == sorted(shares, reverse=True)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("culling.noise_scales=[20]", "`culling.noise_scales` must be a list of different values"),
        ("culling.tolerances_px=[0]", "`culling.tolerances_px` must be a list of different numbers in [0.1, 100]"),
        ("culling.outlier_mm=0", "`culling.outlier_mm` must lie in [0.1, 100] mm"),
    ],
)
def test_what_it_cannot_do_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], override: str, message: str
) -> None:
    assert main([*TINY, override, f"out={tmp_path / 'no'}"]) == 2
    assert message in capfd.readouterr().err
