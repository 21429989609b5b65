"""What a stiffness map does to the page: flattened anew, restored at the size of a screen, held against the last one.

The scan is made once. A change of the map leads to one solve of the springs, 20 to 300 ms at 45 x 45 vertices, and one
texturing of at most a megapixel.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from deskew import flattening, metrics, pipeline, projection, restoration
from deskew.editor.pictures import eight_bits, grey, shrunk
from deskew.errors import StepError
from deskew.io import StiffnessMap
from deskew.restoration import UNSHADED, Registration
from deskew.types import WHITE, Array, Flattened, Floats, Scan, Sheet, Status

LONGEST = 900
"""Longer side of the view that is shown [px]."""

_ROOM = 0.06  # shown round the page as it was scanned, as a share of its longer side

METHOD = "spring"
"""The flattening method: the one that answers at once, and finds a material's scale."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Look:
    """A restored page as it is shown, and what it differs by from the last one.

    Attributes
    ----------
    image : (H, W[, 3]) uint8 array
        The restored page.
    page : (H, W) bool array
        Where it shows the page.
    last : (image, page) or None
        The last restored page in the same light, turned and moved as this one; None if there was none.
    difference : (H, W) array or None
        This page's grey levels less those of the last one, laid onto it [grey levels of 255]; NaN off the page, None if
        there was none.
    strain : (H, W) array
        Strain of the quad that each pixel lies in; NaN off the page.
    figures : mapping of name to float
        `strain_rms_percent`, `strain_max_percent` (the largest without its sign), `solve_seconds`; from the second on
        `moved_{mean,max}_mm`, how far the sheet's vertices lie from the last one's, and `difference_rms_grey`; with a
        free scale `shrink_estimated` [%].
    remedy : str
        What is wrong with the flattening; empty if it came to rest.
    """

    image: npt.NDArray[np.uint8]
    page: Mask
    last: tuple[npt.NDArray[np.uint8], Mask] | None
    difference: Floats | None
    strain: Floats
    figures: Mapping[str, float]
    remedy: str


@dataclass(frozen=True, slots=True)
class _Solved:
    """One solution, laid onto the one before."""

    sheet: Sheet
    free_scale: bool
    flat: Flattened
    strain: Floats
    seconds: float
    views: dict[str, tuple[Array, Mask]]  # by light; they take most of the time, and are made once

    def answers(self, sheet: Sheet, free_scale: bool) -> bool:
        old, new = self.sheet.stiffness, sheet.stiffness
        return free_scale == self.free_scale and old is not None and new is not None and np.array_equal(old, new)


class Preview:
    """Solves and shows; remembers the last solution, to lay the next one onto it.

    Parameters
    ----------
    scan : Scan
        The page.
    """

    def __init__(self, scan: Scan) -> None:
        self.scan = scan
        self._small = _shrunk(scan)
        self._crop = _crop(self._small)
        self._now: _Solved | None = None
        self._last: _Solved | None = None
        self._registrations: dict[str, Registration] | None = None

    def solve(self, materials: StiffnessMap, *, free_scale: bool = False) -> None:
        """Flatten the page with a map, unless each quad is as stiff as it was.

        Raises
        ------
        InputError
            If the map does not suit the scan, or a free scale the map.
        StepError
            If the flattening diverged. What was solved before is kept, and shown.
        """
        sheet = pipeline.with_stiffness(self.scan, materials).sheet
        if self._now is not None and self._now.answers(sheet, free_scale):
            return
        begun = time.perf_counter()
        flat = flattening.flatten(sheet, method=METHOD, free_scale=free_scale)
        if flat.status is Status.DIVERGED:
            raise StepError(f"Flattening diverged: {flat.remedy}")
        if self._now is not None:
            flat = metrics.laid_onto(flat, self._now.flat)
        seconds = time.perf_counter() - begun
        self._last = self._now
        self._now = _Solved(sheet, free_scale, flat, metrics.quad_strain(sheet, flat), seconds, {})

    def look(self, light: str) -> Look:
        """Show the last solution in a light, and what it differs by from the one before.

        Raises
        ------
        StepError
            If the light does not fit the scan, or nothing was solved yet.
        """
        now, last = self._now, self._last
        if now is None:
            raise StepError("Preview: nothing was solved yet; change a stiffness.")
        image, page = self._view(now, light)
        figures = {**_strain_figures(now.strain), **_shrinkage(now.flat), "solve_seconds": now.seconds}
        difference, shown_before = None, None
        if last is not None:
            before, page_before = self._view(last, light)
            both = page & page_before
            levels, found = metrics.image_difference(grey(image), grey(before), both)
            difference = np.where(both, levels, np.nan)
            figures |= found | _moved(now.flat, last.flat)
            shown_before = eight_bits(before), page_before
        strain = self._spread(now, page)
        return Look(eight_bits(image), page, shown_before, difference, strain, figures, now.flat.remedy)

    def _view(self, solved: _Solved, light: str) -> tuple[Array, Mask]:
        """Restore one light at the view's size; where lights of another format show the page is found once."""
        if light not in solved.views:
            images = self._small.images
            if self._registrations is None and images[light].shape[:2] != images[WHITE].shape[:2]:
                self._registrations = restoration.register_textures(images, images.get(UNSHADED, images[WHITE]))
            scan = replace(self._small, sheet=solved.sheet)
            known = self._registrations or {}
            textures = restoration.restore_textures(scan, solved.flat, [light], registrations=known)
            solved.views[light] = (
                np.ascontiguousarray(textures.images[light][self._crop]),
                np.isfinite(textures.backward_map[self._crop][..., 0]),
            )
        return solved.views[light]

    def _spread(self, solved: _Solved, page: Mask) -> Floats:
        """Give each pixel of the view the strain of the quad that it lies in."""
        view = restoration.view_camera(self._small.camera)
        origin = [part.start for part in self._crop[::-1]]
        corners = np.round((projection.project(view, solved.flat.vertices) - origin) * 16).astype(np.int32)
        shown = np.full(page.shape, np.nan, np.float32)
        for r, c in np.argwhere(np.isfinite(solved.strain)):
            around = corners[[r, r, r + 1, r + 1], [c, c + 1, c + 1, c]]
            cv2.fillConvexPoly(shown, around, float(solved.strain[r, c]), shift=4)
        shown[~page] = np.nan
        return shown.astype(np.float64)


def _shrunk(scan: Scan) -> Scan:
    """Photograph the page with a camera of as many pixels as are shown, through the same lens."""
    images = {light: shrunk(image, LONGEST) for light, image in scan.images.items()}
    size = images[WHITE].shape[1], images[WHITE].shape[0]
    K = scan.camera.K.copy()
    for axis in (0, 1):
        share = size[axis] / scan.camera.size[axis]
        K[axis] *= share
        K[axis, 2] += (share - 1.0) / 2  # the first pixel's centre is the origin, whatever its width
    return replace(scan, images=images, camera=replace(scan.camera, size=size, K=K))


def _crop(scan: Scan) -> tuple[slice, slice]:
    """Rows and columns of the view round the page, wide enough for what unfolding adds to it."""
    view = restoration.view_camera(scan.camera)
    places = projection.project(view, scan.sheet.vertices).reshape(-1, 2)
    low, high = places.min(axis=0), places.max(axis=0)
    room = _ROOM * (high - low).max()
    (left, top), (right, bottom) = np.maximum(low - room, 0).astype(int), (high + room + 1).astype(int)
    return slice(int(top), min(int(bottom), view.size[1])), slice(int(left), min(int(right), view.size[0]))


def _strain_figures(strain: Floats) -> dict[str, float]:
    known = 100 * strain[np.isfinite(strain)]
    return {
        "strain_rms_percent": float(np.sqrt((known**2).mean())),
        "strain_max_percent": float(np.abs(known).max()),
    }


def _shrinkage(flat: Flattened) -> dict[str, float]:
    found = flat.counters.get("shrink_estimated")
    return {} if found is None else {"shrink_estimated": float(found)}


def _moved(flat: Flattened, last: Flattened) -> dict[str, float]:
    moved = np.linalg.norm((flat.vertices - last.vertices)[..., :2], axis=-1)
    return {"moved_mean_mm": float(moved.mean()), "moved_max_mm": float(moved.max())}
