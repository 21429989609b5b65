from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from deskew.cli import main
from deskew.io import Mesh, grid_faces

Command = Callable[[str], tuple[int, str, str]]


@pytest.fixture
def deskew(capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command line; exit code, stdout and stderr."""

    def run(line: str) -> tuple[int, str, str]:
        code = main(line.split())
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


@pytest.fixture
def page() -> Mesh:
    """A page of 40 x 30 mm bent round a cylinder, its texture coordinates the true flat places, v up."""
    s, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 40, 21), np.linspace(0, -30, 7)))
    bent = np.stack([25 * np.sin(s / 25 - 0.8), y, 25 * np.cos(s / 25 - 0.8)], axis=-1)
    return Mesh(bent, grid_faces(7, 21), np.stack([s, y], axis=-1))
