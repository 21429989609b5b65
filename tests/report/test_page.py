"""What the file says and holds, whatever stands in the runs' files."""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from hashlib import sha256
from html import escape
from pathlib import Path

import cv2
import numpy as np
import pytest

from experiments.page.__main__ import main
from experiments.page.document import document
from experiments.page.markup import inline, slug
from experiments.page.pictures import figure_picture
from experiments.page.reports import made
from experiments.page.runs import Run, read_runs
from experiments.page.sheet import full_colour_mm, packed
from experiments.page.verdicts import judged_claims
from experiments.reporting.claims.measures import Evidence
from experiments.studies.falling_sheet import FallingSheet
from tests.report.tables_in import Reader, tables_in

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>"
HEADER = "experiment,condition,method,trial,seed,metric,value,unit\n"


@pytest.fixture
def reports(tmp_path: Path) -> Path:
    """One run, every name and reason in which is hostile."""
    folder = tmp_path / "reports" / "evil"
    (folder / "figures").mkdir(parents=True)
    quoted = '"' + HOSTILE.replace('"', '""') + '"'
    row = "surfaces,flattened/{},{},0,1,{},1.5,mm\n"
    rows = [row.format("a", "spring", "flat_rigid_mean_mm"), f"surfaces,{quoted},{quoted},0,1,failed,1.0,1\n"]
    (folder / "results.csv").write_text(HEADER + "".join(rows))
    (folder / "timings.csv").write_text(HEADER)
    failure = {"condition": HOSTILE, "method": HOSTILE, "trial": 0, "seed": 1, "reason": HOSTILE}
    run = {
        "experiment": "surfaces",
        "commit": HOSTILE,
        "changed_since_commit": True,
        "config": {"seed": 1, "sheet": {"kind": HOSTILE}},
        "failures": [failure],
        "machine": {"processor": HOSTILE},
    }
    (folder / "run.json").write_text(json.dumps(run))
    cv2.imwrite(str(folder / "figures" / "a'b&c.png"), np.full((40, 60, 3), 200, np.uint8))
    return tmp_path / "reports"


def test_hostile_text_stays_text(reports: Path, sheet: FallingSheet) -> None:
    html = document(read_runs(reports), judged_claims(Evidence(reports)), sheet)
    reader = Reader()
    reader.feed(html)
    assert reader.tags.count("script") == 3  # two of its own, and the recorded sheet's numbers
    assert reader.tags.count("img") == 6  # five lights and one figure
    assert "<img src=x" not in html
    assert escape(HOSTILE) in html
    tables = tables_in(html)
    assert [table.lines for table in tables if "reason" in table.headings] == [[["0", "1", *[HOSTILE] * 3]]]
    assert any(line[0] == HOSTILE for table in tables for line in table.lines if table.section == "evil")


def test_claim_without_its_report_is_not_tested(reports: Path, sheet: FallingSheet) -> None:
    claims = judged_claims(Evidence(reports))
    html = document(read_runs(reports), claims, sheet)
    n_lines = sum(len(claim.lines) for claim in claims)
    assert f'aria-label="{n_lines} not tested: report missing"' in html
    assert html.count('<dd class="main">–') == 6


def test_report_is_one_small_file_under_a_policy_that_lets_nothing_in(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    assert 1e6 < report.stat().st_size <= 5e6
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy[1].split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data:"
    assert "unsafe" not in policy[1]
    for kind in ("script", "style"):
        inner = re.findall(rf"<{kind}>(.*?)</{kind}>", text, re.DOTALL)
        digests = [f"'sha256-{b64encode(sha256(part.encode()).digest()).decode()}'" for part in inner]
        assert rules[f"{kind}-src"].split() == digests
    assert not re.search(r"(src|href)=[\"']?(https?:|//)", text)


def test_figures_are_all_there_dated_and_those_of_the_run(report: Path, runs: list[Run]) -> None:
    text = report.read_text(encoding="utf-8")
    sections = dict(re.findall(r'<section id="([^"]*)">(.*?)</section>', text, re.DOTALL))
    for run in runs:
        section = sections[slug(run.name)]
        captions = re.findall(r"<figcaption>(.*?)</figcaption>", section)
        assert len(captions) == len(run.figures) == section.count('<img src="data:image/webp;base64,')
        for path in run.figures:
            (caption,) = (caption for caption in captions if f"{run.name}/figures/{path.name}:" in caption)
            assert str(run.about["commit"])[:10] in caption
            assert run.day is None or f"{run.day:%B %Y}" in caption


def test_small_figures_are_exact_and_large_ones_close(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    plot = np.full((300, 400, 3), 255, np.uint8)
    cv2.putText(plot, "a plot", (30, 150), cv2.FONT_HERSHEY_SIMPLEX, 2.0, (180, 40, 20), 3)
    photograph = cv2.GaussianBlur(rng.integers(0, 255, (900, 1400), np.uint8).astype(np.uint8), (9, 9), 4)
    for name, image in (("plot", plot), ("photograph", photograph)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
    exact, lossy = (figure_picture(tmp_path / f"{name}.png") for name in ("plot", "photograph"))
    decoded = cv2.imdecode(np.frombuffer(b64decode(exact.source.partition(",")[2]), np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(decoded, plot)
    assert (exact.width, exact.height) == (400, 300)
    assert lossy.width == 1300


def test_packed_sheet_is_the_recorded_one(sheet: FallingSheet) -> None:
    values = json.loads(packed(sheet))
    whole = np.frombuffer(b64decode(values["positions"]), "<u2").reshape(sheet.frames.shape)
    positions = values["low_mm"] + whole * np.array(values["step_mm"])
    assert 0 < np.abs(positions - sheet.frames).max() < 0.01
    error = np.frombuffer(b64decode(values["error"]), "<u2").reshape(sheet.error_mm.shape) * values["error_step_mm"]
    known = np.isfinite(sheet.error_mm)
    np.testing.assert_allclose(error[known], sheet.error_mm[known], atol=1e-3)
    assert not known.all()
    beside = sheet.error_mm[:2, :2]
    assert abs(error[0, 0] - np.nanmean(beside)) < 1e-3
    assert values["steps"] == sorted(values["steps"])
    assert "<" not in packed(sheet)


@pytest.mark.parametrize(("top", "end"), [(1.6, 2.0), (0.31, 0.4), (0.081, 0.1), (1.0, 1.0), (11.0, 12.0)])
def test_colours_end_at_a_round_number(top: float, end: float) -> None:
    assert full_colour_mm(np.full((4, 4), top)) == pytest.approx(end)


def test_day_comes_from_the_run_or_from_history(runs: list[Run]) -> None:
    run = runs[0]
    dated = Run(run.name, {**run.about, "commit_date": "2031-02-03"}, run.rows, (), (), run.layout, ())
    assert made(dated) == f"3 February 2031, commit {run.commit}"
    unknown = Run(run.name, {**run.about, "commit": "f" * 40, "commit_date": "?"}, run.rows, (), (), run.layout, ())
    assert made(unknown) == "commit ffffffffff"


def test_markup_knows_code_and_bold_and_escapes_the_rest() -> None:
    assert inline("**a** `<b>` & *c*") == "<strong>a</strong> <code>&lt;b&gt;</code> &amp; *c*"
    assert slug("9. Euler's instability") == "9-euler-s-instability"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--reports", "nowhere"], "`--reports` must be a folder, got nowhere"),
        (["--reports", "empty"], "`--reports` must hold the reports of runs"),
        (["--out", "empty/page.txt"], "must end in .html, got .txt"),
        (["--out", "empty"], "must end in .html"),
        (["--colour"], "The arguments must be --reports FOLDER and --out FILE.html, got: unrecognized"),
        (["--reports", "damaged"], "must hold a run's own results.csv and run.json"),
        (["--reports", "foreign"], "must be one of the studies, got cooking"),
        (["--reports", "headless"], "must have the columns experiment,condition"),
    ],
)
def test_wrong_arguments_end_in_one_line(
    arguments: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, run in {
        "damaged": "[",
        "foreign": '{"experiment": "cooking"}',
        "headless": '{"experiment": "surfaces"}',
    }.items():
        (tmp_path / name / "a").mkdir(parents=True)
        (tmp_path / name / "a" / "run.json").write_text(run)
        (tmp_path / name / "a" / "results.csv").write_text("a,b\n1,2\n")
    (tmp_path / "empty").mkdir()
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert complaint in said.err
    assert not list(tmp_path.rglob("*.html"))
