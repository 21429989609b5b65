from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import data_synth as ds
from data_synth.captures import main, scaled, write_example
from deskew.errors import InputError
from deskew.io import read_board, read_capture
from deskew.types import PatternKind, Pinhole


def smaller(device: Pinhole, factor: int) -> Pinhole:
    """The same view with fewer pixels: a tenth of the frames, a hundredth of the bytes."""
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / factor - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= factor
    return replace(device, size=(device.size[0] // factor, device.size[1] // factor), K=K)


@pytest.fixture(scope="module")
def rig() -> ds.Rig:
    rig = ds.default_rig()
    return replace(rig, camera=smaller(rig.camera, 8), projector=smaller(rig.projector, 32))


def test_an_example_reads_back_as_what_the_rig_photographs(tmp_path: Path, rig: ds.Rig) -> None:
    write_example(rig, tmp_path / "example", seed=3, n_pages=2, n_poses=3)
    assert sorted(p.name for p in (tmp_path / "example").iterdir()) == ["board", "flat", "page_00", "page_01"]
    board, poses = read_board(tmp_path / "example" / "board")
    assert (board, len(poses)) == (ds.BOARD, 3)
    pages = [read_capture(tmp_path / "example" / name) for name in ("page_00", "page_01", "flat")]
    assert all(page.camera_size == (80, 60) for page in pages)
    assert [len(list(page.columns)) for page in pages] == [32, 32, 32]
    assert len({page.white.tobytes() for page in pages}) == 3
    rng = np.random.default_rng(np.random.SeedSequence([3, 1, 1]))
    rendered = ds.photograph(rig, ds.crumpled(rng), ds.Checkerboard(), rng)
    assert np.array_equal(rendered.white, pages[1].white)
    for ours, theirs in zip(rendered.rows, pages[1].rows, strict=True):
        assert np.array_equal(ours, theirs)


def test_lights_planes_and_patterns_are_written_on_request(tmp_path: Path, rig: ds.Rig) -> None:
    gray = PatternKind.GRAY_CODE
    write_example(rig, tmp_path / "example", n_poses=3, pattern=gray, n_planes=2, lights=True)
    wanted = ["board", "flat", "page_00", "plane_01"]
    assert sorted(p.name for p in (tmp_path / "example").iterdir()) == wanted
    page = read_capture(tmp_path / "example" / "page_00")
    assert page.pattern is gray
    assert list(page.textures) == ["above", "raking", "uv", "backlight"]
    planes = [read_capture(tmp_path / "example" / name).white for name in ("flat", "plane_01")]
    assert len({plane.tobytes() for plane in planes}) == 2
    assert all((plane[[0, -1]] < plane.max() / 4).all() for plane in planes[1:])  # desk shows all round


def test_a_scaled_bench_sees_the_same_with_fewer_pixels() -> None:
    rig, small = ds.default_rig(), scaled(ds.default_rig(), 0.25)
    assert (small.camera.size, small.projector.size) == ((160, 120), (256, 192))
    # The middle of a block of 4 x 4 pixels is the small pixel's centre.
    block = (smaller(rig.camera, 4), smaller(rig.projector, 4))
    for found, wanted in zip((small.camera, small.projector), block, strict=True):
        assert np.allclose(found.K, wanted.K, rtol=1e-12)
    with pytest.raises(InputError, match=r"`scale` must be in \[0.1, 1\], got 2"):
        scaled(rig, 2)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"seed": -1}, "`seed` must be at least 0, got -1"),
        ({"n_pages": 0}, r"`n_pages` must be in \[1, 100\], got 0"),
        ({"n_planes": 0}, r"`n_planes` must be in \[1, 100\], got 0"),
        ({"n_poses": 2}, r"`n` must be in \[3, 12\], got 2"),
        ({"slope_p90_deg": 60.0}, r"`slope_p90_deg` must be in \[1, 45\], got 60"),
        ({"slope_p90_deg": float("nan")}, r"`slope_p90_deg` must be in \[1, 45\], got nan"),
    ],
    ids=["seed", "pages", "planes", "poses", "slope", "slope NaN"],
)
def test_a_wrong_setting_leaves_nothing(tmp_path: Path, rig: ds.Rig, setting: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_example(rig, tmp_path / "example", **setting)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "the following arguments are required: folder"),
        ("{0}/new --page 3", "unrecognized arguments: --page 3"),
        ("{0}/new --pages three", "invalid int value: 'three'"),
        ("{0}/new --pages 0", "`n_pages` must be in [1, 100], got 0"),
        ("{0}/no/new", "must lie in an existing folder"),
        ("{0}", "must be new or an empty folder"),
    ],
)
def test_a_wrong_line_is_one_line_and_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, message: str
) -> None:
    (tmp_path / "mine.txt").touch()
    try:
        code: object = main(line.format(tmp_path).split())
    except SystemExit as end:
        code = end.code
    printed = capsys.readouterr()
    assert (code, printed.out, printed.err.count("\n")) == (2, "", 1)
    assert message in printed.err
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_help_shows_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    assert "Example: python -m data_synth.captures" in capsys.readouterr().out
