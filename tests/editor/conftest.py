"""A page of two materials as a scan without error has it: the editor's tests are not about acquisition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import data_synth
from data_synth import Case
from data_synth.splines import resampled
from deskew import io
from deskew.editor import Desk, Files
from deskew.projection import ideal
from deskew.types import DepthMap, Scan, Sheet

N, STEPS = 17, 4


@pytest.fixture(scope="session")
def scan() -> Scan:
    """A leaf that shrank in its sleeve, photographed in PAL; 17 x 17 vertices."""
    rig, two = data_synth.manuscript_rig(), data_synth.shipped_two_materials(Case.A, 0)
    white = data_synth.photograph(rig, two.sheet, data_synth.VellumPage(5, two.leaf), 20013).white
    surface = resampled(two.sheet.vertices, ((N - 1) * STEPS + 1,) * 2)
    depth = DepthMap(np.full(white.shape[:2], 900.0), np.zeros(white.shape[:2], np.uint8), ideal(rig.camera))
    sheet = Sheet(surface[::STEPS, ::STEPS], surface=surface)
    return Scan({"white": white}, depth, rig.camera, sheet, np.zeros((4, 2)))


@pytest.fixture(scope="session")
def scan_file(scan: Scan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scan") / "leaf.npz"
    io.write_scan(scan, path)
    return path


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(tmp_path / "map.png", tmp_path / "restored.png")


@pytest.fixture
def desk(scan: Scan, files: Files) -> Desk:
    return Desk(scan, files, "leaf")
