"""The experiment `ocr_misses`, run small, and what it refuses before any work."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path
from shutil import which

import cv2
import numpy as np
import pytest

import data_synth
from data_synth.lettering import set_words
from deskew import metrics
from deskew.errors import InputError
from deskew.metrics import ocr
from deskew.types import Calibration
from experiments.program import main
from experiments.settings import Config
from experiments.studies import ocr_misses
from experiments.studies.bench import Bench

WORDS = ("HELMET", "OXEN", "GROUND", "ZEBRA", "PLATE", "WATCH")
needs_program = pytest.mark.skipif(which("tesseract") is None, reason="the program tesseract is not installed")


def true_bench(config: Config, mode: str) -> Bench:
    """The true devices, which saves the boards' photographs."""
    rig = data_synth.default_rig(config.rig.noise_scale)
    return Bench(rig, Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.805))


def rows_of(out: Path) -> dict[tuple[str, str], dict[str, float]]:
    rows: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    with (out / "results.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["condition"], row["method"]][row["metric"]] = float(row["value"])
    return rows


@pytest.fixture
def photographs(tmp_path: Path) -> Path:
    """One document, flat and so dark that nothing can be read."""
    folder = tmp_path / "real" / "00001"
    folder.mkdir(parents=True)
    text = set_words(WORDS, (160.0, 70.0), capital_mm=10.0, margin_mm=10.0)
    x, y = np.meshgrid(np.arange(320.0), np.arange(140.0))
    side = np.full(x.size, 0.5)
    ink = text.coverage((x.ravel() + 0.5) / 2, (y.ravel() + 0.5) / 2, side, side).reshape(x.shape)
    cv2.imwrite(str(folder / "flat_document.png"), np.rint(220.0 - 200.0 * ink))
    cv2.imwrite(str(folder / "warped_document_crumpleshard_bright.jpg"), np.zeros((140, 320), np.uint8))
    (folder / "ground_truth_words.json").write_text(json.dumps([{"text": word} for word in WORDS]))
    return folder.parent


@pytest.mark.parametrize(
    ("given", "slopes"),
    [(["budget=smoke"], [30]), ([], [30, 44]), (["budget=full"], [20, 30, 36, 44]), (["ocr.severities=[35]"], [35])],
)
def test_a_budget_has_its_severities_unless_others_are_given(
    monkeypatch: pytest.MonkeyPatch, given: list[str], slopes: list[int]
) -> None:
    planned: list[Config] = []

    def refuse(config: Config) -> None:
        planned.append(config)
        raise InputError("`nothing` must be run.")

    monkeypatch.setattr(ocr_misses, "require_methods", refuse)
    assert main(["experiment=ocr_misses", *given]) == 2
    assert planned[0].ocr.severities == slopes


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ocr_misses, "calibrated_bench", true_bench)


@pytest.mark.usefixtures("bench")
def test_restored_pages_are_read_as_the_control_is(tmp_path: Path, photographs: Path) -> None:
    line = "experiment=ocr_misses seed=1 trials=1 engine=serial ocr.severities=[]"
    own = [f"tests.own.unruly:{name}" for name in ("restore", "dewarp_with_map", "dewarp_mirrored")]
    assert (
        main(
            [
                *line.split(),
                f"method=[spring,{','.join(own)}]",
                f"ocr.real_path={photographs}",
                f"out={tmp_path / 'out'}",
            ]
        )
        == 0
    )
    rows = rows_of(tmp_path / "out")
    control, unrestored, restored = rows["control", "-"], rows["unrestored", "-"], rows["restored", "spring"]
    assert control["letters"] == unrestored["letters"] == restored["letters"] == 176
    # The machine reads words that it knows: "EOU" in capitals may become "EQU" on the flattest page.
    assert control["misses"] <= 1
    assert restored["misses"] <= 2 < unrestored["misses"]
    assert 0.0 < rows["ideal", "-"]["dense_mean_mm"] < restored["dense_mean_mm"] < 0.3
    assert rows["ideal", "-"]["misses"] <= 2
    for figures in (unrestored, restored):
        parts = (figures[part] for part in ("substitutions", "insertions", "deletions"))
        assert figures["misses"] == sum(parts)
        assert figures["error_rate_percent"] == pytest.approx(100 * figures["misses"] / 176)
        # Known shape and projector leave a fraction of the shading.
        assert 0.0 < figures["shading_unshaded_percent"] < 0.4 * figures["shading_projector_percent"]
    assert 39.0 < unrestored["slope_p90_deg"] < 41.0
    null, ideal = rows["null/shifted", "-"], rows["ideal", "-"]
    for name in ("ms_ssim_docunet", "ms_ssim_wang"):
        assert 0.1 < unrestored[name] < restored[name] < null[name] < 1.0
        assert restored[name] < ideal[name]
    # The control's picture of 561 x 429 pixels is enlarged by 1.58, and the flow halves it.
    assert null["ld_dis_px"] == pytest.approx(1.577 / 2, abs=0.02)
    assert null["ad_dis"] < 0.01
    assert 0.0 < ideal["ad_dis"] < restored["ad_dis"] < 0.2 * unrestored["ad_dis"]
    assert 0.0 < control["line_straightness_px"] < 0.3 < unrestored["line_straightness_px"]
    assert restored["line_straightness_px"] < 0.5 * unrestored["line_straightness_px"]
    assert restored["text_lines"] == control["text_lines"] > 5
    assert 70.0 < rows["null/shuffled", "-"]["error_rate_percent"] < 95.0
    assert rows["real/flat", "-"] == {"words": 6.0, "word_recall": 1.0, "word_precision": 1.0}
    assert rows["real/crumpleshard", "-"]["word_recall"] == 0.0
    run = json.loads((tmp_path / "out" / "run.json").read_text())
    wanted = {"engine", "version", "model", "model_sha256", "psm", "oem", "real_pages"}
    assert set(run["ocr"]) == wanted
    assert run["ocr"]["engine"] == "tesserocr"
    assert len(run["ocr"]["model_sha256"]) == 64
    assert (tmp_path / "out" / "figures" / "figure_4.png").is_file()
    as_it_lay, picture, mirrored = (rows["restored", name] for name in own)
    # One undistorts the picture as the page that nobody restored is undistorted; the other leaves that to the eye.
    for name in ("misses", "misses_normalised", "ms_ssim_wang", "ld_dis_px"):
        assert as_it_lay[name] == unrestored[name]
    assert as_it_lay["dense_mean_mm"] > 1.0
    assert picture["misses"] > 3
    assert picture["dense_similar_mean_mm"] > 1.0
    assert picture["page_coverage"] > 0.99
    assert not {"dense_mean_mm", "shading_percent", "misses_projector"} & set(picture)
    assert mirrored == {"failed": 1.0}
    (failure,) = run["failures"]
    assert "mirrored" in failure["reason"]


@needs_program
@pytest.mark.usefixtures("bench")
def test_severities_are_read_unrestored_alone_and_both_engines_agree_on_the_control(tmp_path: Path) -> None:
    line = "experiment=ocr_misses seed=612 trials=1 engine=serial ocr.restore=false ocr.severities=[44] page.text=full"
    found = {}
    for engine in ("tesserocr", "pytesseract"):
        out = tmp_path / engine
        assert main([*line.split(), f"ocr.engine={engine}", f"out={out}"]) == 0
        found[engine] = rows_of(out)
        assert json.loads((out / "run.json").read_text())["ocr"]["engine"] == engine
        assert set(found[engine]) == {
            ("control", "-"),
            ("null/shifted", "-"),
            ("null/shuffled", "-"),
            ("unrestored", "-"),
            ("unrestored/slope=44", "-"),
        }
        assert (out / "figures" / "severity.png").is_file()
        assert "Absent: `ocr.real_path` names no folder" in (out / "table.md").read_text()
    # Where whole lines are lost the two versions of Tesseract lose others; on the flat page they agree.
    flat = [found[engine]["control", "-"]["misses"] for engine in found]
    assert abs(flat[0] - flat[1]) <= 2
    slopes = [found["tesserocr"][f"unrestored{at}", "-"]["slope_p90_deg"] for at in ("", "/slope=44")]
    assert slopes == pytest.approx([40.0, 44.0], abs=1.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("page=checkerboard", "`page.kind` must be lettered"),
        ("page.text=latin", "`page.text` must be one of capitals, full, prose"),
        ("ocr.engine=readiris", "`ocr.engine` must be one of tesserocr, pytesseract"),
        ("ocr.severities=[20,60]", "`ocr.severities` must be a list of different numbers in [1, 45] degrees"),
        ("ocr.severities=[40]", "`ocr.severities` must leave out sheet.slope_p90_deg"),
        ("sheet.kind=physical", "`ocr.severities` must be left out for sheets that are not drawn"),
        ("ocr.real_path=nowhere", "`ocr.real_path` must be a folder, got nowhere"),
        ("ocr.real_path=.", "`ocr.real_path` must hold folders with ground_truth_words.json"),
        ("ocr.psm=0", "`ocr.psm` must be a whole number in [3, 13]"),
    ],
)
def test_what_cannot_be_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["experiment=ocr_misses", *line.split(), f"out={tmp_path / 'out'}"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_missing_engine_ends_the_run_before_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ocr, "_installed", lambda name: name == "tesserocr")
    assert main(["experiment=ocr_misses", "ocr.engine=pytesseract", f"out={tmp_path / 'out'}"]) == 2
    assert metrics.ocr.INSTALL["pytesseract"] in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
