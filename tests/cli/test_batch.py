"""Many captures in one line: each whole or not at all, none stopped by another, and what is done is kept."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deskew import io
from deskew.cli import restoring
from deskew.cli.pictures import Wanted
from deskew.types import Calibration, Capture, PatternKind, Pinhole
from tests.cli.conftest import Command

K = np.array([[10.0, 0, 5.5], [0, 10, 3.5], [0, 0, 1]])
CAMERA = Pinhole((12, 8), K, np.zeros(5), np.eye(3), np.array([0, 0, 9.0]))
PROJECTOR = Pinhole((6, 5), K, np.zeros(5), np.eye(3), np.array([0, 0, 9.0]))
RESIDUALS = {"camera_rms_px": 0.1, "projector_rms_px": 0.2, "stereo_rms_px": 0.3}


def write_page(folder: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    white, black, *planes = (rng.integers(0, 255, (8, 12), dtype=np.uint8) for _ in range(14))
    io.write_capture(Capture(white, black, (6, 5), PatternKind.GRAY_CODE, planes[:6], planes[6:]), folder)


@pytest.fixture
def done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Three pages on disk in the working folder, and the names of those that the stand-in has restored."""
    for i, name in enumerate(("a", "b", "c")):
        write_page(tmp_path / name, i)
    io.write_calibration(Calibration(CAMERA, PROJECTOR, RESIDUALS, {}, 2, "mm"), tmp_path / "c.json")
    monkeypatch.chdir(tmp_path)
    restored: list[str] = []

    def scan(folder: Path, *rest: Any) -> tuple[str, Capture]:
        return folder.name, io.read_capture(folder)

    def restore(found: tuple[str, Capture], method: str, wanted: Wanted, settings: Any) -> Any:
        name, capture = found
        list(capture.columns)
        io.write_image(capture.white, wanted.output)
        restored.append(name)
        return {"method": method}, [wanted.output]

    monkeypatch.setattr(restoring, "scan_page", scan)
    monkeypatch.setattr(restoring, "restore_page", restore)
    return restored


LINE = "run a b c -c c.json -o out --json"


def states(out: str) -> list[str]:
    return [row["state"] for row in json.loads(out)["captures"]]


def test_each_capture_gets_a_folder_and_what_is_done_is_kept(deskew: Command, done: list[str]) -> None:
    code, out, err = deskew(LINE)
    assert (code, err, states(out)) == (0, "", ["restored"] * 3)
    for name in ("a", "b", "c"):
        picture = io.read_image(Path("out") / name / "restored.png")
        assert np.array_equal(picture, io.read_capture(Path(name)).white)
    assert json.loads(out)["captures"][1]["restored"] == ["out/b/restored.png"]
    assert json.loads(Path("out/batch.json").read_text())["captures"] == json.loads(out)["captures"]
    code, out, err = deskew(LINE)
    assert (code, err, states(out), len(done)) == (0, "", ["kept"] * 3, 3)
    code, out, _ = deskew("run c a -c c.json -o out")
    assert (code, out) == (0, "batch: out\nrestored: 0\nkept: 2\nfailed: 0\n")


CHANGES: dict[str, tuple[Callable[[], object], str, list[str]]] = {
    "a capture": (lambda: (shutil.rmtree("b"), write_page(Path("b"), 9)), LINE, ["b"]),
    "a picture lost": (lambda: Path("out/c/restored.png").unlink(), LINE, ["c"]),
    "a record damaged": (lambda: Path("out/a/run.json").write_text('{"key": "'), LINE, ["a"]),
    "a folder lost": (lambda: shutil.rmtree("out/a"), LINE, ["a"]),
    "an option": (lambda: None, f"{LINE} --shape 9 9", ["a", "b", "c"]),
    "the pictures' format": (lambda: None, f"{LINE} --format tif", ["a", "b", "c"]),
    "the calibration": (lambda: Path("c.json").write_bytes(Path("c.json").read_bytes() + b"\n"), LINE, ["a", "b", "c"]),
    "nothing but a hidden file": (lambda: Path("a/.thumbnail").touch(), LINE, []),
}  # fmt: skip


@pytest.mark.parametrize("case", list(CHANGES))
def test_a_rerun_does_what_has_changed_and_nothing_else(deskew: Command, done: list[str], case: str) -> None:
    assert deskew(LINE)[0] == 0
    done.clear()
    change, line, wanted = CHANGES[case]
    change()
    code, _, err = deskew(line)
    assert (code, err, done) == (0, "", wanted)
    done.clear()
    assert deskew(line)[0] == 0
    assert done == []
    assert {p.name for p in Path("out").iterdir()} == {"a", "b", "c", "batch.json"}
    assert {p.name for p in Path("out/a").iterdir()} == {"run.json", f"restored.{'tif' if 'tif' in line else 'png'}"}


def test_a_failed_capture_stops_no_other_and_is_told_with_its_reason(deskew: Command, done: list[str]) -> None:
    Path("b/gray/04.png").unlink()
    code, out, err = deskew(f"{LINE} --light all")
    assert (code, states(out), done) == (3, ["restored", "failed", "restored"], ["a", "c"])
    told, total = err.splitlines()
    assert told.startswith("deskew: b: `b/gray` must hold 12 frames")
    assert total == "deskew: 1 of 3 captures failed; out/batch.json says why."
    assert json.loads(out)["captures"][1]["reason"] in told
    assert sorted(p.name for p in Path("out").iterdir()) == ["a", "batch.json", "c"]
    code, out, err = deskew("run a b gone -c c.json -o out --light all")
    assert (code, err.count("\n")) == (3, 3)
    assert out.splitlines()[:4] == ["batch: out", "restored: 0", "kept: 1", "failed: 2"]
    assert "gone: `gone` must be a folder, got nothing there." in out
    shutil.rmtree("b")
    write_page(Path("b"), 1)
    assert states(deskew(f"{LINE} --light all")[1]) == ["kept", "restored", "kept"]


def test_what_a_user_keeps_in_a_folder_of_that_name_is_not_overwritten(deskew: Command, done: list[str]) -> None:
    Path("out/b").mkdir(parents=True)
    Path("out/b/mine.txt").touch()
    code, out, err = deskew(LINE)
    assert (code, states(out)) == (3, ["restored", "failed", "restored"])
    assert "`out/b` must be new or hold the run.json of an earlier batch, got something else." in err
    assert [p.name for p in Path("out/b").iterdir()] == ["mine.txt"]


def test_one_capture_into_a_folder_is_a_batch_of_one(deskew: Command, done: list[str]) -> None:
    Path("out").mkdir()
    assert deskew("run a -c c.json -o out --json")[0] == 0
    assert Path("out/a/restored.png").is_file()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("run a b -c c.json -o no/out", "`no/out` must be a folder, for several captures, or new in an existing one"),
        ("run a b -c c.json -o c.json", "`c.json` must be a folder"),
        ("run a b/../a -c c.json -o out", "`CAPTURE...` must be folders of different names, got several called a."),
        ("run a b -c c.json -o out --mask none.png", "`none.png` must be a file, got nothing there."),
        ("run a b -c c.json -o out --format jpg", "Invalid value for '--format'"),
        ("run a b -c c.json -o out --heights 9 9", "`--heights` must be LOW HIGH, the first below the second"),
        ("run a b -c c.json -o out --jump 0", "`--jump` must be finite and above 0, got 0.0."),
        ("run a b -c c.json -o out --hole -1", "`--hole` must lie in [0, 10000] px, got -1.0."),
    ],
)
def test_what_is_wrong_for_all_is_one_line_and_code_2(
    deskew: Command, done: list[str], line: str, message: str
) -> None:
    code, out, err = deskew(line)
    assert (code, out, err.count("\n"), done) == (2, "", 1, [])
    assert message in err


def test_an_interrupt_says_how_far_it_came(deskew: Command, done: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    usual = restoring.restore_page

    def stop(found: Any, *rest: Any) -> Any:
        if found[0] == "b":
            raise KeyboardInterrupt
        return usual(found, *rest)

    monkeypatch.setattr(restoring, "restore_page", stop)
    code, out, err = deskew(LINE)
    wanted = "deskew: interrupted; 1 of 3 captures are done, the same line goes on from there.\n"
    assert (code, out, err) == (130, "", wanted)
    assert sorted(p.name for p in Path("out").iterdir()) == ["a", "batch.json"]
    monkeypatch.setattr(restoring, "restore_page", usual)
    assert states(deskew(LINE)[1]) == ["kept", "restored", "restored"]


def test_a_killed_batch_leaves_nothing_that_looks_done_and_is_cleared_away(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "white.png").write_bytes(b"pixels")
    program = (
        "import os, signal, sys; from pathlib import Path; from deskew.cli.batch import Batch\n"
        "def job(capture, picture):\n"
        "    picture.write_bytes(b'half')\n"
        "    if capture.name == sys.argv[1]: os.kill(os.getpid(), signal.SIGKILL)\n"
        "    picture.write_bytes(b'whole')\n"
        "    return {}, [picture]\n"
        "Batch(Path('out'), 'restored.png', {}, (), True).run([Path('a'), Path('b')], job)\n"
    )

    def run(killed_at: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-c", program, killed_at]
        return subprocess.run(line, capture_output=True, text=True, check=False, timeout=60, cwd=tmp_path)

    assert run("b").returncode == -9
    out = tmp_path / "out"
    assert sorted(p.name for p in out.iterdir() if not p.name.startswith(".")) == ["a", "batch.json"]
    again = run("nobody")
    assert again.returncode == 0, again.stderr
    assert states(again.stdout) == ["kept", "restored"]
    assert sorted(p.name for p in out.iterdir()) == ["a", "b", "batch.json"]
    assert (out / "b" / "restored.png").read_bytes() == b"whole"
