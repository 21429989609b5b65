"""The ground truth of one rendered sheet, exact at any raw camera pixel; only metrics may hold it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from data_synth.devices import packed, see_all
from data_synth.geometry import Ints, buckets, gather, locate
from data_synth.lights import Light
from data_synth.sheets import TrueSheet
from deskew.errors import require
from deskew.types import Floats, Pinhole


@dataclass(frozen=True, slots=True)
class Truth:
    """What the camera really saw.

    Each query intersects the pixel's ray with the rendered mesh itself, so nothing is interpolated between pixels and
    neither borders nor creases blur; the error is that of projecting 0.3 mm triangles, below 1e-4 mm.

    Attributes
    ----------
    sheet : TrueSheet
        The surface.
    camera : Pinhole
        The true camera.
    screen : (h, w, 3) array
        The sheet's vertices in the camera: raw pixel x, y and depth [mm].
    texture_maps : mapping of light name to (2, 3) array
        Scan pixel (x, y, 1) to pixel of the light's image, for those of another format than the scan's.
    """

    sheet: TrueSheet
    camera: Pinhole
    screen: Floats
    texture_maps: Mapping[str, Floats] = field(default_factory=dict)

    def page_at(self, raw_pixels: Floats) -> Floats:
        """Page coordinates seen by raw camera pixels.

        Parameters
        ----------
        raw_pixels : (..., 2) array
            x, y; NaN allowed.

        Returns
        -------
        (..., 2) array
            (u, v) [mm], NaN off the page and off the image.
        """
        return self._values_at(self.sheet.flat, raw_pixels)

    def depth_at(self, raw_pixels: Floats) -> Floats:
        """Camera z [mm] of the page at raw pixels (..., 2): (...), NaN off the page and off the image."""
        points = self.points_at(raw_pixels)
        return np.asarray(np.einsum("...i,i", points, self.camera.R[2]) + self.camera.t[2])

    def points_at(self, raw_pixels: Floats) -> Floats:
        """World points [mm] of the page seen at raw pixels (..., 2): (..., 3), NaN off the page and off the image."""
        return self._values_at(self.sheet.vertices, raw_pixels)

    def pixels_of(self, page_points: Floats) -> Floats:
        """Raw camera pixels of page points, whether or not another part of the sheet hides them.

        Parameters
        ----------
        page_points : (..., 2) array
            (u, v) on the page [mm].

        Returns
        -------
        (..., 2) array
            Raw pixels x, y; NaN off the page.
        """
        # Looking at the flat page as a screen of unit depth makes this the same question the other way round.
        page = np.concatenate([self.sheet.flat, np.ones((*self.sheet.flat.shape[:2], 1))], axis=-1)
        points = _intersect(page, self.sheet.vertices, page_points, _cells(self.sheet.page_size_mm))
        seen = see_all(packed(self.camera), points.reshape(1, -1, 3))[0, :, :2]
        return np.asarray(seen.reshape(page_points.shape))

    def _values_at(self, values: Floats, raw_pixels: Floats) -> Floats:
        """Vertex values at raw pixels."""
        return _intersect(self.screen, values, raw_pixels, self.camera.size)


def true_sheet_seen(sheet: TrueSheet, camera: Pinhole, lights: Sequence[Light] = ()) -> Truth:
    """Build the truth of a sheet under a camera, and of the formats that further images were taken in."""
    maps = {light.name: light.readout.from_scan for light in lights if light.readout is not None}
    return Truth(sheet, camera, see_all(packed(camera), sheet.vertices), maps)


def _cells(page_size_mm: tuple[float, float]) -> tuple[int, int]:
    """Size of a raster with a cell a millimetre that holds the page with its far border."""
    return int(page_size_mm[0]) + 2, int(page_size_mm[1]) + 2


def _intersect(screen: Floats, values: Floats, points: Floats, size: tuple[int, int]) -> Floats:
    """Values (h, w, n) of the nearest triangle at screen points (..., 2): (..., n)."""
    require(points.ndim >= 1 and points.shape[-1] == 2, "raw_pixels", "have shape (..., 2)", points.shape)
    x, y = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2).T.copy()
    order, starts = buckets(x, y, size[1], size[0])
    ids: Ints = locate(screen, x, y, order, starts, size[0])[1]
    return np.asarray(gather(values, screen, ids, x, y)).reshape(*points.shape[:-1], values.shape[-1])
