"""The experiment `stiffness`: run small through the whole chain, and what it refuses."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

import data_synth
from data_synth import Case, Leaf, kontron
from deskew.io import write_image
from deskew.types import Calibration, Pinhole
from experiments.program import main
from experiments.reporting.curves import curve_plot
from experiments.settings import Config
from experiments.studies import stiffness
from experiments.studies.bench import Bench
from experiments.studies.stiffness import material_figures
from experiments.studies.stiffness_layout import LAYOUT
from experiments.trials.schema import Row

SHIPPED = Path(data_synth.__file__).parent / "shipped"


def true_bench(config: Config, mode: str, camera: Pinhole) -> Bench:
    """The true devices, which saves the boards' photographs."""
    rig = data_synth.manuscript_rig(config.rig.noise_scale)
    return Bench(rig, Calibration(camera, rig.projector, {}, camera_psf_px=0.805))


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One page of case A, at both ends of the ratios."""
    folder = tmp_path_factory.mktemp("stiffness") / "out"
    line = (
        "experiment=stiffness seed=512 trials=1 engine=serial method=spring mesh.rows=31 mesh.columns=31 "
        f"stiffness.vellum_over_paper=[0.01,100] sheet.paths=[{SHIPPED / 'two_materials_A_1.npz'}]"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stiffness, "calibrated_bench", true_bench)
        patch.setattr(kontron, "KONTRON_SIZE", (998, 725))  # a quarter of the photograph's pixels, and of its time
        patch.setattr(stiffness, "_SCALE", 1.0)
        assert main([*line.split(), f"out={folder}"]) == 0
    return folder


def test_each_material_is_measured_with_each_choice(out: Path) -> None:
    rows: dict[str, dict[str, float]] = defaultdict(dict)
    with (out / "results.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["condition"]][row["metric"]] = float(row["value"])
    right, wrong = (rows[f"restored/A/vellum_over_paper={ratio}"] for ratio in ("0.01", "100"))
    assert 0 < right["kept_mean_mm"] < 0.7
    assert right["kept_gain_over_wrong"] == pytest.approx(wrong["kept_mean_mm"] / right["kept_mean_mm"])
    assert right["kept_gain_over_wrong"] > 3.0
    assert right["changed_gain_over_wrong"] > 1.5
    assert "kept_gain_over_even" not in right
    assert right["dense_affine_mean_mm"] < right["dense_mean_mm"]
    assert (right["max_z_mm"], right["folded_quads"], right["at_rest"]) == (0.0, 0.0, 1.0)
    free, page = rows["restored/A/free_scale"], rows["unrestored/A"]
    assert free["kept_gain_over_wrong"] > 6.0
    assert free["shrink_error"] == pytest.approx(abs(free["shrink_estimated"] - page["shrink_true"]))
    assert free["shrink_error"] < 0.4
    assert 1.0 < page["shrink_true"] < 3.0
    assert page["slope_p90_deg"] > 5
    assert 0 < page["materials_wrong"] < 0.03
    assert 0 < page["materials_border_mm"] < 2.0
    assert 0 < page["registration_error_px"] < 0.3
    assert rows["difference/A"]["difference_rms_grey"] > 10.0
    assert not any("failed" in metrics for metrics in rows.values())


def test_the_page_is_printed_like_the_papers_figure_5(out: Path) -> None:
    names = {path.name for path in (out / "figures").iterdir()}
    assert names == {"figure_5.png", "kept_against_ratio.png", "changed_against_ratio.png"}
    assert "**A: the vellum shrank.**" in (out / "table.md").read_text()


def test_errors_are_drawn_against_ratios_on_logarithmic_axes() -> None:
    curve = LAYOUT.curves[0]
    ratios = {0.01: 0.3, 1.0: 2.0, 100.0: 2.1}
    rows = [
        Row("stiffness", f"restored/A/vellum_over_paper={ratio:g}", "spring", trial, 1, metric, value, "mm")
        for ratio, error in ratios.items()
        for trial in (0, 1)
        for metric, value in (("vellum_over_paper", ratio), ("kept_mean_mm", error * (1 + 0.1 * trial)))
    ]
    figure = curve_plot(curve, rows)
    assert figure is not None
    (axes,) = figure.axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    drawn = axes.lines[0]
    assert np.allclose(drawn.get_xdata(), list(ratios))
    assert np.allclose(drawn.get_ydata(), [1.05 * error for error in ratios.values()])


def test_border_is_off_by_what_was_shaved_off() -> None:
    leaf = Leaf()
    u, v = np.meshgrid(np.arange(-5.0, 285.0, 0.25), np.arange(-5.0, 222.0, 0.25))
    uv = np.stack([u, v], axis=-1)
    uv[(u < 0) | (u > 279) | (v < 0) | (v > 216)] = np.nan
    depth = np.nan_to_num(leaf.depth(u, v), nan=-1.0)
    assert material_figures(depth > 0, uv, leaf) == {"materials_wrong": 0.0, "materials_border_mm": 0.0}
    for shaved in (0.5, 2.0):
        figures = material_figures(depth > shaved, uv, leaf)
        assert figures["materials_border_mm"] == pytest.approx(shaved, rel=0.06)
        assert figures["materials_wrong"] == pytest.approx(figures["materials_border_mm"] * 767 / (279 * 216), rel=0.02)


def test_every_case_has_its_trials_and_a_file_its_own() -> None:
    config = Config("stiffness", seed=3, trials=2)
    config.page.kind = "vellum"
    study = stiffness.Stiffness()
    keys = study.plan(config)
    assert {(key.condition, key.trial) for key in keys} == {(f"restored/{case}", i) for case in Case for i in (0, 1)}
    config.sheet.paths = [str(SHIPPED / f"two_materials_{name}.npz") for name in ("N_0", "B_2")]
    assert [(key.condition, key.trial) for key in study.plan(config)] == [("restored/N", 0), ("restored/B", 1)]
    assert set(study.inputs(config)) == {"sheet.paths[0]", "sheet.paths[1]"}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("page=lettered", "`page.kind` must be vellum in this experiment, got lettered"),
        ("sheet=physical", "`sheet.kind` must be left out: this experiment has its own sheets, got physical"),
        ("sheet.paths=[a.npz] trials=2", "`trials` must be at most 1"),
        ("sheet.paths=[a.npz] trials=1 sheet.drawn=true", "`sheet.drawn` must be false where sheet.paths gives"),
        ("sheet.paths=[a.npz] trials=1", "`a.npz` must be a file"),
        ("stiffness.vellum_over_paper=[1,10]", "`stiffness.vellum_over_paper` must be a list of different numbers in"),
        ("stiffness.vellum_over_paper=[0.1,0.1,10]", "`stiffness.vellum_over_paper` must be a list of different"),
        ("stiffness.vellum_over_paper=[0,10]", "`stiffness.vellum_over_paper` must be a list of different numbers in"),
        ("stiffness.materials=leaf.jpg", "`stiffness.materials` must be texture or a PNG file, got 'leaf.jpg'"),
        ("stiffness.materials=none.png", "`none.png` must be a file"),
        ("stiffness.materials=dark.png", "`stiffness.materials` must show where the vellum is, and the rest black"),
        ("stiffness.materials=small.png", "`small.png` must"),
    ],
)
def test_what_the_experiment_cannot_use_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_image(np.zeros((576, 768), np.uint8), tmp_path / "dark.png")
    write_image(np.full((57, 76), 255, np.uint8), tmp_path / "small.png")
    assert main(["experiment=stiffness", *line.split(), f"out={tmp_path / 'out'}"]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
