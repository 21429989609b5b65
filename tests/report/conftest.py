"""One report of the committed runs, made once for all tests and processes, and a browser to look at it."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import data_synth
from deskew.types import Sheet
from experiments.page.document import document
from experiments.page.runs import Run, read_runs
from experiments.page.verdicts import judged_claims
from experiments.reporting.claims.measures import Evidence
from experiments.studies.falling_sheet import FallingSheet, fallen, vertex_error

REPORTS = Path(__file__).resolve().parents[2] / "reports"
_FEW = ("corner_distance", "ocr_misses", "integrators", "settling")
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


@pytest.fixture(scope="session")
def sheet() -> FallingSheet:
    """A crumpled page with its true flat place, its photographs five checkerboards."""
    true = data_synth.crumpled(np.random.default_rng(3), data_synth.PAGE_SIZE_MM, 25.0)
    step = [max(1, extent // 24) for extent in true.vertices.shape[:2]]
    vertices, flat = (grid[:: step[0], :: step[1]][:24, :24] for grid in (true.vertices, true.flat))
    frames, steps, times = fallen(Sheet(vertices), 8)
    error = vertex_error(frames[-1], flat * [1.0, -1.0])
    error[0, 0] = np.nan
    places = (flat - flat.min(axis=(0, 1))) / np.ptp(flat, axis=(0, 1))
    y, x = np.indices((240, 320))
    pictures = {
        name: np.where((y // size + x // size) % 2, 255 - 2 * size, 2 * size).astype(np.uint8)
        for name, size in {"white": 8, "above": 12, "raking": 17, "uv": 23, "backlight": 30}.items()
    }
    return FallingSheet(frames, steps, times, places, error, 0.2 * error, pictures)


@pytest.fixture(scope="session")
def runs() -> list[Run]:
    return read_runs(REPORTS)


@pytest.fixture(scope="session")
def report(sheet: FallingSheet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report; the first process that asks makes it, the others wait."""
    return _made("report", read_runs(REPORTS), sheet, tmp_path_factory)


@pytest.fixture(scope="session")
def short_report(runs: list[Run], sheet: FallingSheet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of a few runs that has every kind of part, for what walks through all of it."""
    few = [run for run in runs if run.name in _FEW]
    assert len(few) == len(_FEW)
    return _made("short", few, sheet, tmp_path_factory)


def _made(name: str, runs: list[Run], sheet: FallingSheet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    path = base / f"{name}.html"
    with (base / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.is_file():
            path.write_text(document(runs, judged_claims(Evidence(REPORTS)), sheet), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """A Chromium of the system, with its WebGL in software."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if path is None:
        pytest.skip(f"there is no browser: none of {', '.join(_BROWSERS)} is on the path")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=_FLAGS)
        yield chromium
        chromium.close()
