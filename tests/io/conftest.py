from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from deskew.io import write_capture
from deskew.types import Array, Calibration, Capture, Fringe, PatternKind, Pinhole, n_frames

CAMERA = (12, 8)
PROJECTOR = (6, 5)
FRINGES = {
    PatternKind.GRAY_PHASE: (Fringe(4.0, 5),),
    PatternKind.MULTI_PHASE: (Fringe(6.0, 4), Fringe(4.5, 6)),
}


def make_capture(
    pattern: PatternKind = PatternKind.GRAY_CODE,
    dtype: type = np.uint8,
    channels: int = 0,
    lights: tuple[str, ...] = (),
    projector_size: tuple[int, int] = PROJECTOR,
) -> Capture:
    """Random images throughout, so that no two can be mistaken for each other."""
    rng = np.random.default_rng(7)

    def image(size: tuple[int, int] = CAMERA) -> Array:
        shape = (size[1], size[0], channels) if channels else (size[1], size[0])
        return rng.integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)

    fringes = FRINGES.get(pattern, ())
    counts = tuple(n_frames(pattern, extent, fringes) for extent in projector_size)
    columns, rows = ([image() for _ in range(n)] for n in counts)
    textures = {light: image((31, 17)) for light in lights}
    return Capture(image(), image(), projector_size, pattern, columns, rows, textures, fringes)


@pytest.fixture
def new_capture() -> Callable[..., Capture]:
    return make_capture


@pytest.fixture
def gray_folder(tmp_path: Path) -> Path:
    """A valid Gray-code capture folder with one light, to be broken."""
    write_capture(make_capture(lights=("raking",)), tmp_path / "gray_page")
    return tmp_path / "gray_page"


@pytest.fixture
def sweep_folder(tmp_path: Path) -> Path:
    """A valid line-sweep capture folder, to be broken."""
    write_capture(make_capture(PatternKind.LINE_SWEEP), tmp_path / "sweep_page")
    return tmp_path / "sweep_page"


@pytest.fixture
def calibration() -> Calibration:
    rotation = np.array([[0.8, 0.6, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, -1.0]])
    camera = Pinhole(
        CAMERA, np.array([[900.0, 0.0, 6], [0, 901, 4], [0, 0, 1]]), np.arange(5) / 7, rotation, np.ones(3)
    )
    projector = Pinhole(
        PROJECTOR, np.array([[1500.0, 0, 3], [0, 1500, 9], [0, 0, 1]]), np.zeros(5), np.eye(3), np.zeros(3)
    )
    residuals = {"camera_rms_px": 0.1, "projector_rms_px": 1 / 3, "stereo_rms_px": 0.2}
    return Calibration(camera, projector, residuals, {"camera_fx_px": 1e-17}, 9, "mm")
