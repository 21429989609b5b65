"""`deskew edit`: what it refuses, in one line, and what it puts on the desk."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deskew import io
from deskew.cli import main
from deskew.editor import serving
from deskew.editor.desk import Desk
from deskew.errors import StepError
from deskew.types import Scan


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "c.json").write_text("{}")
    return tmp_path


@pytest.mark.parametrize(
    ("line", "code", "message"),
    [
        ("edit nosuch", 2, "`nosuch` must be a capture folder or a scan.npz, got neither."),
        ("edit nosuch.npz", 2, "`nosuch.npz` must be a file, got nothing there."),
        ("edit empty", 2, "`--calibration` must be given for a capture folder, got none."),
        ("edit nosuch -c c.json", 2, "`c.json`"),
        ("edit {scan} -c c.json", 2, "`--calibration` must be left out for a scan, got c.json."),
        ("edit {scan} -o map.jpg", 2, "`map.jpg` must end in .png, got .jpg."),
        ("edit {scan} -o gone/map.png", 2, "`gone/map.png` must lie in an existing folder"),
        ("edit {scan} -o a.png -r a.png", 2, "`--restored` must be another file than the map, got a.png."),
        ("edit {scan} -r page.gif", 2, "`page.gif` must end in .png or .tif or .tiff, got .gif."),
        ("edit {scan} --scale 0", 2, "`--scale` must lie in (0, 16], got 0.0."),
        ("edit {scan} --port 70000", 2, "`--port` must be a whole number in [0, 65535], got 70000."),
        ("edit", 2, "CAPTURE"),
    ],
)
def test_bad_input_is_one_line(
    here: Path, scan_file: Path, capsys: pytest.CaptureFixture[str], line: str, code: int, message: str
) -> None:
    assert main(line.format(scan=scan_file).split()) == code
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    assert message in printed.err
    assert sorted(path.name for path in here.iterdir()) == ["c.json", "empty"]


def test_a_machine_without_marimo_is_told_the_remedy(
    here: Path, scan_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(serving, "find_spec", lambda name: None if name == "marimo" else object())
    assert main(["edit", str(scan_file)]) == 2
    wanted = "deskew: `deskew edit` must find its packages (pip install 'deskew3d[editor]'), got no marimo.\n"
    assert capsys.readouterr().err == wanted


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Desk, int]]:
    """The desks that would be served, with their ports."""
    desks: list[tuple[Desk, int]] = []

    def serve(desk: Desk, port: int, ready: Any) -> None:
        desks.append((desk, port))
        ready("http://127.0.0.1:1/?access_token=secret")

    monkeypatch.setattr("deskew.editor.serve", serve)
    return desks


def test_files_are_named_after_the_scan_and_the_map(
    here: Path, scan_file: Path, served: list[tuple[Desk, int]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["edit", str(scan_file), "--no-browser", "--port", "0"]) == 0
    (desk, port) = served[0]
    assert (desk.files.map, desk.files.restored) == (Path("leaf-stiffness.png"), Path("leaf-stiffness-restored.png"))
    assert (desk.name, port, desk.can_find_leaf) == ("leaf", 0, False)
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "the editor of leaf is at http://127.0.0.1:1/?access_token=secret (Ctrl-C ends it)\n" in printed.err


def test_what_was_left_is_taken_up_and_named(
    here: Path, scan: Scan, scan_file: Path, served: list[tuple[Desk, int]], capsys: pytest.CaptureFixture[str]
) -> None:
    labels = np.zeros(scan.camera.size[::-1], np.uint8)
    labels[200:300] = 5
    io.write_stiffness(io.StiffnessMap(labels, {0: 30.0, 5: 3.0}), Path("m.png"))
    assert main(["edit", str(scan_file), "-o", "m.png", "--no-browser"]) == 0
    assert "going on with what m.png holds." in capsys.readouterr().err
    assert served[0][0].saved
    assert served[0][0].painting.names == {0: "material 0", 5: "material 5"}


def test_a_port_in_use_is_passed_over() -> None:
    with serving.bound(0) as first:
        first.listen()
        with serving.bound(first.getsockname()[1]) as second:
            assert second.getsockname()[0] == "127.0.0.1"
            assert second.getsockname()[1] != first.getsockname()[1]


def test_no_port_at_all_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError

    monkeypatch.setattr(socket.socket, "bind", refuse)
    with pytest.raises(StepError, match=r"no port of 127\.0\.0\.1 is free"):
        serving.bound(0)


def test_the_notebook_by_itself_says_how_to_open_it() -> None:
    with pytest.raises(StepError, match="open it by `deskew edit CAPTURE`"):
        serving.served_desk()
