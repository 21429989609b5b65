"""Restorers and dewarpers of one's own in `deskew restore`: one picture of the white image, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from deskew import io
from deskew.projection import ideal
from deskew.types import DepthMap, Pinhole, Scan, Sheet
from tests.cli.conftest import Command

METHODS = """
import numpy as np
import deskew

@deskew.restorer
def see(scan):
    from deskew.restoration import undistorted_view, undistortion_map, view_camera
    from deskew.types import Restoration
    image = undistorted_view(scan.images["white"], scan.camera)
    return Restoration(image, undistortion_map(scan.camera), view_camera(scan.camera))

@deskew.dewarper
def crop(image):
    return image[:20, :30]

@deskew.dewarper
def lose(image):
    raise ValueError("nothing to see")
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "whole.py").write_text(METHODS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    K = np.array([[80.0, 0.0, 31.5], [0.0, 80.0, 23.5], [0.0, 0.0, 1.0]])
    camera = Pinhole((64, 48), K, np.zeros(5), np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 400.0]))
    y, x = np.mgrid[80.0:-81.0:-20.0, -100.0:101.0:25.0]
    sheet, depth = Sheet(np.stack([x, y, 0 * x], axis=-1)), np.full((48, 64), 400.0)
    image = np.arange(48 * 64, dtype=np.uint32).reshape(48, 64).astype(np.uint8)
    scan = Scan(
        {"white": image}, DepthMap(depth, np.zeros((48, 64), np.uint8), ideal(camera)), camera, sheet, x[:4, :2]
    )
    io.write_scan(scan, tmp_path / "scan.npz")
    return tmp_path


@pytest.mark.parametrize(("name", "kind", "size"), [("see", "restorer", (48, 64)), ("crop", "dewarper", (20, 30))])
def test_a_page_is_restored_as_a_whole(
    deskew: Command, here: Path, name: str, kind: str, size: tuple[int, int]
) -> None:
    code, out, err = deskew(f"restore scan.npz -o r.png --method whole:{name} --json")
    assert (code, err) == (0, "")
    figures = json.loads(out)
    # A focal length of 80 px, 400 mm away; a dewarper tells no scale.
    dpi = {"dpi": pytest.approx([25.4 * 80 / 400] * 2)} if kind == "restorer" else {}
    assert figures == {"restored": "r.png", "method": f"whole:{name}", "kind": kind} | dpi
    assert np.array_equal(
        io.read_image(here / "r.png"), io.read_scan(here / "scan.npz").images["white"][: size[0], : size[1]]
    )


@pytest.mark.parametrize(
    ("line", "code", "message"),
    [
        ("restore scan.npz -o r.png -m whole:see --light uv", 2, "`--light` must be left out: whole:see, a restorer,"),
        ("restore scan.npz -o r.png -m whole:crop --scale 2", 2, "`--scale` must be left out: whole:crop, a dewarper"),
        ("restore scan.npz -o r.png -m whole:crop --combine mean", 2, "`--combine` must be left out"),
        ("flatten a.obj -o f.obj -m whole:see", 2, "`--method` must be a flattener here, got whole:see, a restorer"),
        ("restore scan.npz -o r.png -m whole:none", 2, "`method` must name a function in whole"),
        ("restore scan.npz -o r.png -m whole:lose", 3, "Restoration by `lose` failed: ValueError: nothing to see."),
    ],
)
def test_what_it_cannot_do_is_one_line(deskew: Command, here: Path, line: str, code: int, message: str) -> None:
    found, out, err = deskew(line)
    assert (found, out) == (code, "")
    assert message in err
    assert err.count("\n") == 1
    assert not (here / "r.png").exists()
