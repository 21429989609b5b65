"""Files made of the reports: current, without typed figures, and true to the rows."""

from __future__ import annotations

import csv
import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from data_synth import BOARD, Checkerboard
from deskew.errors import InputError
from experiments.composed import composed
from experiments.reporting import generated
from experiments.reporting.artifact import minutes, with_artifact
from experiments.reporting.beside import nulls, real
from experiments.reporting.beside.measures import Once, Rest, cell, mean
from experiments.reporting.claims.measures import Evidence, Values
from experiments.reporting.commands import command
from experiments.reporting.expectations import EXPECTED, rerun_interval
from experiments.reporting.export import csv_text
from experiments.studies.real_boards import BOARD as REAL_BOARD
from experiments.trials import Row, TrialKey
from experiments.trials.plan import settings_of

REPORTS = generated.ROOT / "reports"


@pytest.mark.parametrize("name", generated.GENERATED)
def test_a_generated_file_is_current(name: str) -> None:
    assert (generated.ROOT / name).read_text() == generated.GENERATED[name](generated.ROOT), (
        "run `python -m experiments.reporting.generated`"
    )


def test_check_names_what_is_outdated_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(generated, "ROOT", tmp_path)
    monkeypatch.setattr(generated, "GENERATED", {"PAGE.md": lambda root: "new\n"})
    assert generated.main(["--check"]) == 1
    assert not (tmp_path / "PAGE.md").exists()
    assert generated.main([]) == 0
    assert (tmp_path / "PAGE.md").read_text() == "new\n"
    assert generated.main(["--check"]) == 0
    assert capsys.readouterr().out == "PAGE.md\nPAGE.md\n"
    assert generated.main(["--chekc"]) == 2


def report(folder: Path, name: str, values: list[float], seconds: dict[str, float]) -> None:
    (folder / name).mkdir(parents=True)
    key = TrialKey("corner_distance", seed=1)
    rows = [Row.of(TrialKey("corner_distance", trial=i, seed=1), "restored", "spring", "corner_mean_px", v)
            for i, v in enumerate(values)]  # fmt: skip
    (folder / name / "results.csv").write_text(csv_text(rows))
    times = [Row.of(key, "prepare" if m == "seconds_prepare" else "-", "-", m, v) for m, v in seconds.items()]
    (folder / name / "timings.csv").write_text(csv_text(times))
    run = {"experiment": "corner_distance", "config": {"seed": 1}, "machine": {"cores": 2}, "commit": "0" * 40}
    (folder / name / "run.json").write_text(json.dumps(run))


def test_the_artifact_shows_mean_tolerance_and_minutes(tmp_path: Path) -> None:
    report(tmp_path, "corner_distance", [0.1, 0.2, 0.3], {"seconds_prepare": 60.0, "seconds_trial": 240.0})
    text = with_artifact("a\n<!-- runs -->\nold\n<!-- end -->\nb\n<!-- figures -->\n<!-- end -->\n", tmp_path)
    assert "| 3 | 3 | unknown, 2 cores |" in text  # one minute, and four over two cores
    assert "`python -m experiments experiment=corner_distance seed=1 trials=3 out=out/corner_distance`" in text
    low, high = rerun_interval([0.1, 0.2, 0.3]) or (0.0, 0.0)
    assert f"| 0.200 px | 3 | ± 0.001 | {low:.3f}..{high:.3f} |" in text
    assert text.count("no report") == len(EXPECTED) - 1
    assert "old" not in text
    assert with_artifact(text, tmp_path) == text


def test_stages_alone_are_a_lower_bound_of_the_minutes(tmp_path: Path) -> None:
    report(tmp_path, "a", [1.0], {"seconds_scan": 240.0, "peak_mb": 9000.0})
    report(tmp_path, "b", [1.0], {"seconds_scan": 20.0, "seconds_trial": 30.0})
    assert minutes(tmp_path / "a" / "timings.csv", 2) == "over 2"
    assert minutes(tmp_path / "b" / "timings.csv", 2) == "under 1"


def test_every_figure_of_the_artifact_has_rows() -> None:
    evidence = Evidence(REPORTS)
    for expected in EXPECTED:
        assert len(expected.values.read(evidence)) > 1, expected


def test_a_rerun_lies_in_its_interval_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(2000):
        first, second = rng.normal(3.0, 1.0, (2, 8))
        low, high = rerun_interval(list(first)) or (0.0, 0.0)
        hits += low <= second.mean() <= high
    low, high = stats.binom.ppf([0.001, 0.999], 2000, 0.95)
    assert low <= hits <= high


@given(st.lists(st.floats(0.0, 100.0), min_size=2, max_size=20))
def test_a_rerun_interval_holds_the_mean_and_nothing_below_zero(values: list[float]) -> None:
    low, high = rerun_interval(values) or (np.nan, np.nan)
    assert 0.0 <= low <= np.mean(values) + 1e-9
    assert np.mean(values) - 1e-9 <= high


def test_one_trial_foretells_nothing() -> None:
    assert rerun_interval([1.0]) is None
    with pytest.raises(InputError, match="`values` must hold at least one number"):
        rerun_interval([])


def settings(overrides: list[str]) -> dict[str, Any]:
    """What run.json says of a run with these arguments."""
    return settings_of(composed(overrides), {})


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        (["experiment=surfaces", "surfaces.noise_mm=0.3"], ["surfaces.noise_mm=0.3"]),
        (["experiment=corner_distance", "sheet=physical", "method=paper_rk4"],
         ["method=[paper_rk4]", "sheet.kind=physical"]),
        (["experiment=stiffness", "scan.ink=true", "stiffness.vellum_over_paper=[0.1,1,10]"],
         ["scan.ink=true", "stiffness.vellum_over_paper=[0.1,1.0,10.0]"]),
        (["experiment=textures"], []),
    ],
)  # fmt: skip
def test_the_command_of_a_report_gives_its_settings_again(asked: list[str], shown: list[str]) -> None:
    config = settings([*asked, "seed=7"])
    again = shlex.split(command({"experiment": config["experiment"], "config": config}, 3, "elsewhere"))
    assert again[:3] == ["python", "-m", "experiments"]
    assert again[4:6] == ["seed=7", "trials=3"]
    assert sorted(again[6:-1]) == sorted(shown)
    assert settings(again[3:]) == config


def test_given_files_are_asked_for() -> None:
    run = {"experiment": "real_boards", "config": {"seed": 1, "sha256 of real_boards.path": "ab"}}
    assert command(run, 5, "x").endswith("trials=5 real_boards.path=FOLDER out=x")


def test_squares_are_as_long_as_the_targets_say() -> None:
    corners = Checkerboard().corners
    assert np.linalg.norm(corners[0, 1] - corners[0, 0]) == pytest.approx(real.PAGE_SQUARE_MM)
    assert BOARD.square == real.BOARD_SQUARE_MM
    assert REAL_BOARD.square == real.REAL_SQUARE_UNITS


def test_what_all_trials_share_is_one_figure(tmp_path: Path) -> None:
    report(tmp_path, "same", [0.5, 0.5, 0.5], {})
    report(tmp_path, "other", [0.5, 0.6], {})
    evidence = Evidence(tmp_path)
    same, other = (Once(Values(name, "restored", "corner_mean_px", "spring")) for name in ("same", "other"))
    assert cell(same, evidence) == ["0.500", "1"]
    assert cell(other, evidence) == ["–", "–"]


def test_without_reports_nulls_are_dashes_and_no_pair_stands_beside_nothing(tmp_path: Path) -> None:
    lines = [line for line in nulls.nulls_page(Evidence(tmp_path)).splitlines() if line.startswith("| ")][2:]
    assert len(lines) == len(nulls.LINES)
    assert all(line.endswith("| – | – | – | – |") for line in lines)
    assert "| 1. " not in real.real_page(Evidence(tmp_path))


def test_what_is_not_missed_is_read(tmp_path: Path) -> None:
    report(tmp_path, "a", [1.0, 2.0, 6.0], {})
    evidence = Evidence(tmp_path)
    part = mean("a", "restored", "corner_mean_px", "spring")
    one, rest = part.figure(evidence), Rest(100.0, part).figure(evidence)
    assert one.interval is not None
    assert (rest.value, rest.n) == (97.0, 3)
    assert rest.interval == (100.0 - one.interval[1], 100.0 - one.interval[0])


def test_every_null_has_its_rows() -> None:
    evidence = Evidence(REPORTS)
    for line in nulls.LINES:
        assert line.truth.figure(evidence).n > 1, line
        assert line.spoilt.figure(evidence).n > 1, line


def test_a_null_that_is_not_called_blind_reads_worse_than_the_truth() -> None:
    evidence = Evidence(REPORTS)
    for line in nulls.LINES:
        truth, spoilt = line.truth.figure(evidence).value, line.spoilt.figure(evidence).value
        if "blind" in line.null:
            assert spoilt == pytest.approx(truth, abs=0.03), line
        else:
            assert abs(spoilt - truth) > 0.005 + 0.02 * abs(truth), line


def rows_of(name: str) -> list[dict[str, str]]:
    with (REPORTS / name / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_page_of_real_figures_says_what_the_rows_say() -> None:
    values = [float(r["value"]) for r in rows_of("real_boards")
              if (r["condition"], r["metric"]) == ("left_out", "length_error_units")]  # fmt: skip
    text = (REPORTS / "SYNTHETIC_AND_REAL.md").read_text()
    line = next(line for line in text.splitlines() if "held-out lengths" in line)
    assert f"| {100 * np.mean(values) / 75:.2f} (" in line
