"""The desk that a page lies on while its stiffness is edited: what is painted, what came of it, and the files.

One desk serves every window that shows it, and outlives them: a page that is loaded again finds everything as it was.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deskew import pipeline, restoration
from deskew.editor.draft import draft_of, opened, write_draft
from deskew.editor.materials import Painting
from deskew.editor.pictures import as_png, eight_bits, overlay
from deskew.editor.preview import METHOD, Look, Preview
from deskew.editor.strokes import Mask, Stroke
from deskew.errors import InputError, require
from deskew.io import read_stiffness, write_image, write_stiffness
from deskew.projection import project
from deskew.restoration import UNSHADED
from deskew.types import WHITE, Scan

HISTORY = 50
"""Most changes that can be undone; fewer of a photograph so large that they would fill the memory."""

LONGEST_PAINTED = 1800
"""Longer side of the photograph that is painted on [px]."""

_HISTORY_BYTES = 1 << 29


@dataclass(frozen=True, slots=True)
class Files:
    """Where the results go.

    Attributes
    ----------
    map : Path
        The stiffness map, a PNG; its table and its draft lie beside it.
    restored : Path
        The restored page, PNG or TIFF.
    scale : float
        Pixels of the restored page for each of the camera's.
    """

    map: Path
    restored: Path
    scale: float = 1.0


class Desk:
    """What one capture's editor knows and does. Every method may be called from any thread.

    Parameters
    ----------
    scan : Scan
        The page.
    files : Files
        Where the results go; a map or a draft that is there already is taken up.
    name : str
        What the page is called.
    find_leaf : callable, optional
        Returns the second, darker material, (height, width) bool, or raises a StepError; None if that is not known.

    Raises
    ------
    InputError
        If the map or the draft is damaged, or not of the photograph's size.
    """

    def __init__(self, scan: Scan, files: Files, name: str, find_leaf: Callable[[], Mask] | None = None) -> None:
        self.scan, self.files, self.name, self._find_leaf = scan, files, name, find_leaf
        self.photograph = eight_bits(scan.images[WHITE])
        self.light, self.free_scale = WHITE, False
        self.painting, self.taken_up = opened(files.map, scan.camera.size)
        self._saved = self.painting if _holds(files.map, self.painting) else None
        self.lock = threading.RLock()
        self._undone: list[Painting] = []
        self._before: list[Painting] = []
        self._overlay: tuple[Painting | None, bytes] = None, b""
        self._preview = Preview(scan)

    @property
    def mm_per_px(self) -> float:
        """Millimetres of the page for a pixel of the photograph, in the mean."""
        corners = self.scan.sheet.vertices[[0, 0, -1, -1], [0, -1, -1, 0]]
        pixels = project(self.scan.camera, corners)
        sides = (np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1).sum() for places in (corners, pixels))
        return float(np.divide(*sides))

    @property
    def saved(self) -> bool:
        """Whether the map's file holds what is painted."""
        return self._saved is self.painting

    @property
    def can_find_leaf(self) -> bool:
        """Whether the second material can be looked for."""
        return self._find_leaf is not None

    @property
    def undoable(self) -> tuple[int, int]:
        """How many changes can be undone, and how many done again."""
        return len(self._before), len(self._undone)

    def paint(self, stroke: Stroke, label: int) -> None:
        """Lay a material where a stroke covers the photograph."""
        with self.lock:
            alike = self.scan.images.get(UNSHADED, self.photograph)
            self._become(self.painting.painted(stroke.covered(eight_bits(alike)), label))

    def paint_leaf(self, label: int) -> None:
        """Lay a material on the darker leaf, found by its texture.

        Raises
        ------
        InputError
            If only the scan is there, not its capture.
        StepError
            If the page does not show two materials.
        """
        with self.lock:
            if self._find_leaf is None:
                require(False, "leaf", "be looked for in a capture", "a scan alone")
                return
            self._become(self.painting.painted(self._find_leaf(), label))

    def add(self) -> None:
        """Add a material."""
        with self.lock:
            self._become(self.painting.with_new())

    def change(self, label: int, name: str | None = None, stiffness: float | None = None) -> None:
        """Rename a material or set how stiff it is [kg/s^2]."""
        with self.lock:
            self._become(self.painting.changed(label, name, stiffness))

    def remove(self, label: int) -> None:
        """Take a material away."""
        with self.lock:
            self._become(self.painting.without(label))

    def undo(self) -> None:
        """Take the last change back, if there is one."""
        with self.lock:
            if self._before:
                now = self.painting
                self._keep(self._before[-1])
                self._before, self._undone = self._before[:-1], [*self._undone, now]

    def redo(self) -> None:
        """Do again what was undone last, if there is something."""
        with self.lock:
            if self._undone:
                now = self.painting
                self._keep(self._undone[-1])
                self._before, self._undone = [*self._before, now], self._undone[:-1]

    def show(self, light: str) -> None:
        """Choose the light that the restored page is shown and saved in."""
        known = list(self.scan.images)
        require(light in known, "light", f"be one of {', '.join(known)}", repr(light)[:60])
        self.light = light

    def look(self) -> Look:
        """Solve for what is painted, and look at it.

        Raises
        ------
        DeskewError
            If it cannot be solved; `last_look` still shows what could.
        """
        with self.lock:
            self._preview.solve(self.painting.map, free_scale=self.free_scale)
            return self._preview.look(self.light)

    def last_look(self) -> Look:
        """Look at what was solved last."""
        with self.lock:
            return self._preview.look(self.light)

    def overlay(self) -> bytes:
        """Return the materials in colours, a PNG of at most `LONGEST_PAINTED` pixels; made once for a painting."""
        with self.lock:
            painting, picture = self._overlay
            if painting is not self.painting:
                painting = self.painting
                order = [material.label for material in painting.materials]
                picture = as_png(overlay(painting.labels, order, LONGEST_PAINTED))
                self._overlay = painting, picture
            return picture

    def save_map(self) -> Path:
        """Write the stiffness map for `deskew restore --stiffness`.

        Raises
        ------
        StepError
            If the file system refuses.
        """
        with self.lock:
            write_stiffness(self.painting.map, self.files.map, self.painting.names)
            self._saved = self.painting
            write_draft(self.painting, draft_of(self.files.map))  # the younger of the two: it knows the names
            return self.files.map

    def save_restored(self) -> Path:
        """Write the restored page at full size: the very picture of `deskew restore` with the saved map.

        Raises
        ------
        DeskewError
            If the page cannot be restored, or the file system refuses.
        """
        with self.lock:
            scan = pipeline.with_stiffness(self.scan, self.painting.map)
            light, scale = self.light, self.files.scale
            made = pipeline.restore_lights(scan, method=METHOD, lights=[light], scale=scale, free_scale=self.free_scale)
            dpi = restoration.dots_per_inch(scan, made.camera, made.backward_map)
            write_image(made.images[light], self.files.restored, profile=scan.profiles.get(light), dpi=dpi)
            return self.files.restored

    def _become(self, painting: Painting) -> None:
        """Take a change over, to be undone at will."""
        before = self.painting
        self._keep(painting)
        depth = max(3, min(HISTORY, _HISTORY_BYTES // painting.labels.nbytes))
        self._before = [*self._before, before][-depth:]
        self._undone = []

    def _keep(self, painting: Painting) -> None:
        """Write the draft before anything else is believed: what cannot be kept is refused."""
        write_draft(painting, draft_of(self.files.map))
        self.painting = painting


def _holds(path: Path, painting: Painting) -> bool:
    """Tell whether a map's file holds a painting; one that cannot be read does not."""
    try:
        found, own = read_stiffness(path), painting.map
    except InputError:
        return False
    return dict(found.constants) == dict(own.constants) and bool(np.array_equal(found.labels, own.labels))
