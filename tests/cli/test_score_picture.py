"""`deskew score`: a restored picture against a scan of the flat page."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from deskew import metrics
from deskew.io import write_image
from tests.cli.conftest import Command
from tests.metrics.printed_pages import printed_page


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    page = printed_page()
    write_image(page, tmp_path / "scan.png")
    write_image(np.dstack([metrics.shifted(page, 2)] * 3), tmp_path / "restored.tif")
    write_image(np.full((100, 200), 200, np.uint8), tmp_path / "blank.png")
    write_image(page[:20], tmp_path / "strip.png")
    (tmp_path / "cut.png").write_bytes((tmp_path / "scan.png").read_bytes()[:999])
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("here")
def test_a_picture_has_the_library_figures(deskew: Command) -> None:
    code, out, err = deskew("score restored.tif --truth scan.png --json")
    found = json.loads(out)
    assert (code, err, found.pop("restored"), found.pop("truth")) == (0, "", "restored.tif", "scan.png")
    page = printed_page()
    assert found == pytest.approx(metrics.image_figures(metrics.shifted(page, 2), page), abs=1e-9)
    assert found["ld_dis_px"] == pytest.approx(1.0, abs=0.05)
    code, out, err = deskew("score restored.tif -t scan.png")
    assert (code, err) == (0, "")
    assert "ms_ssim_docunet: 0." in out


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("score gone.png -t scan.png", "`gone.png` must be a file, got nothing there"),
        ("score restored.tif -t scan.obj", "`scan.obj` must end in .png or .tif or .tiff, got .obj"),
        ("score cut.png -t scan.png", "`cut.png` must be"),
        ("score restored.tif -t blank.png", "`scan` must show something, got one grey level throughout"),
        ("score restored.tif -t strip.png", "`scan` must have sides in a ratio up to 19, got 880x20 px"),
        ("score restored.jpg -t scan.png", "`restored.jpg` must end in one of .obj, .ply, .png, .tif, .tiff, got .jpg"),
    ],
)
def test_a_wrong_picture_is_one_line_and_code_2(deskew: Command, line: str, message: str) -> None:
    code, out, err = deskew(line)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
