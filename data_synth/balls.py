"""A plate with two balls let into it: the test body for probing error and sphere spacing.

Each ball stands out of the plate by less than a hemisphere, so that all of what stands out is seen by the camera and
lit by the projector, and the whole body is one surface over a page.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, page_grid, to_world
from deskew.errors import require
from deskew.types import Floats


@dataclass(frozen=True, slots=True)
class BallPlate:
    """A plate, its balls and what a calibration laboratory would certify of them.

    Attributes
    ----------
    sheet : TrueSheet
        The surface; `flat` holds its projection along the plate's normal, so print on a ball is stretched downhill.
    centres : (2, 3) array
        Centres of the balls in the world [mm].
    radius_mm : float
        Of both balls.
    normal : (3,) array
        Of the plate, away from the bed.
    """

    sheet: TrueSheet
    centres: Floats
    radius_mm: float
    normal: Floats

    @property
    def spacing_mm(self) -> float:
        """Distance of the two centres."""
        return float(np.linalg.norm(self.centres[1] - self.centres[0]))

    def polar_deg(self, points: Floats) -> Floats:
        """Angle at each ball's centre between the plate's normal and world points (..., 3): (2, ...) [deg].

        On the balls it is at most the angle of the rim, on the plate it is more; NaN stays NaN.
        """
        away = points[None] - self.centres.reshape(2, *(1,) * (points.ndim - 1), 3)
        return np.asarray(np.degrees(np.arccos(np.clip(away @ self.normal / np.linalg.norm(away, axis=-1), -1.0, 1.0))))


def ball_plate(
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    *,
    radius_mm: float = 30.0,
    spacing_mm: float = 150.0,
    rim_deg: float = 55.0,
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
) -> BallPlate:
    """Return a plate with two balls that touches the bed with its lowest point.

    Parameters
    ----------
    page_size_mm : (width, height)
        Plate [mm].
    radius_mm : float
        Of the balls. After VDI/VDE 2634-2 a ball's diameter is 0.1 to 0.2 times the diagonal of the measured volume,
        which for a letter page is 35 to 71 mm.
    spacing_mm : float
        Between the centres, which lie on a line through the plate's middle; at least 0.3 times the diagonal there.
    rim_deg : float
        Where a ball meets the plate, as an angle from its top, in [20, 75]. The default rig's projector,
        whose rays descend at 62 to 72 degrees, lights all of 55 degrees on a plate tilted by up to 5 degrees.
    tilt_deg : float
        Angle of the plate against the bed, in [0, 30].
    azimuth_deg : float
        Direction of the line of balls and in which the plate rises, counter-clockwise from +X.
    """
    require(20 <= rim_deg <= 75, "rim_deg", "be in [20, 75]", rim_deg)
    require(0 <= tilt_deg <= 30, "tilt_deg", "be in [0, 30]", tilt_deg)
    require(bool(np.isfinite(azimuth_deg)), "azimuth_deg", "be finite", azimuth_deg)
    require(radius_mm > 0, "radius_mm", "be positive", radius_mm)
    rim, tilt, azimuth = np.radians([rim_deg, tilt_deg, azimuth_deg])
    foot_mm = radius_mm * np.sin(rim)
    along = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    room = np.array(page_size_mm) / 2 - foot_mm - np.abs(along[:2]) * spacing_mm / 2
    require(bool(room.min() > 0) and spacing_mm > 2 * foot_mm, "spacing_mm", "keep both balls on the plate", spacing_mm)
    local = np.stack([-along, along]) * spacing_mm / 2 - np.array([0.0, 0.0, radius_mm * np.cos(rim)])
    flat = page_grid(page_size_mm)
    body = to_world(flat, page_size_mm)
    for centre in local:
        squared = radius_mm**2 - ((body[..., :2] - centre[:2]) ** 2).sum(axis=-1)
        body[..., 2] = np.maximum(body[..., 2], centre[2] + np.sqrt(np.maximum(squared, 0.0)))
    # A turn that lifts `along` towards Z; the axis across it stays.
    across, up = np.array([-along[1], along[0], 0.0]), np.array([0.0, 0.0, 1.0])
    c, s = np.cos(tilt), np.sin(tilt)
    turn = np.outer(across, across) + np.outer(c * along + s * up, along) + np.outer(c * up - s * along, up)
    vertices = np.einsum("...j,kj->...k", body, turn)
    lift = np.array([0.0, 0.0, -vertices[..., 2].min()])
    return BallPlate(TrueSheet(vertices + lift, flat), local @ turn.T + lift, radius_mm, turn @ up)
