"""The page's outline to a fraction of a pixel: four sides and four corners on the undistorted grid."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from scipy import ndimage

from deskew import projection
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.lightdesk import is_light, light_desk_page
from deskew.acquisition.pagemask import Mask, largest_filled, page_mask, require_page_shape
from deskew.errors import StepError, require
from deskew.types import Array, DepthMap, Floats, Pinhole

# Profiles across the boundary: reach and step [px], and the stretches that show pure desk and pure page.
REACH_PX, STEP_PX = 6.0, 0.25
DESK_STRETCH_PX, PAGE_STRETCH_PX = (3.0, 6.0), (-4.5, -1.5)
# The boundary is followed in steps of about one pixel; it is smoothed this much before its normals are taken.
RING_SMOOTHING_PX = 3.0
# Averages the camera's noise over neighbouring points; more would round off the kinks where folds cross a side.
OFFSET_SMOOTHING_PX = 1.0
# A corner turns by about 90 degrees between legs of this length; a fold that crosses a side turns it by less than that.
LEG_PX = 14.0
TURN_MIN_DEG = 50.0
# Blur rounds a corner off: boundary points this close to one are replaced by the corner itself.
ROUNDED_PX = 3.0
# Four sides enclose what the border does, but for the rounding of its corners.
AREA_TOLERANCE = 0.02
# On a light desk: step of the light that says where the border is, in grey levels; without one it stays as found.
FAINT_STEP_GREY = 6.0


@dataclass(frozen=True, slots=True)
class Outline:
    """The page's boundary on the undistorted pixel grid.

    Attributes
    ----------
    top, bottom : (n, 2) arrays
        Sides from left to right as the page lies in the picture [px]; they become the grid's first and last row.
    left, right : (n, 2) arrays
        Sides from top to bottom [px]; the grid's first and last column. Neighbouring sides share their corner.
    """

    top: Floats
    right: Floats
    bottom: Floats
    left: Floats

    def __post_init__(self) -> None:
        for name in ("top", "right", "bottom", "left"):
            side = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, side)
            require(side.ndim == 2 and side.shape[1] == 2 and len(side) >= 2, name, "be (n >= 2, 2)", side.shape)
            require(bool(np.isfinite(side).all()), name, "be finite", "NaN or infinity")
        starts = np.stack([self.top[0], self.top[-1], self.bottom[-1], self.bottom[0]])
        ends = np.stack([self.left[0], self.right[0], self.right[-1], self.left[-1]])
        gap = float(np.abs(starts - ends).max())
        require(gap < 1e-9, "sides", "share their corners", f"a gap of {gap:.3g} px")

    @property
    def corners(self) -> Floats:
        """The four corners, (4, 2) [px], in the grid's order: top left, top right, bottom right, bottom left."""
        return np.stack([self.top[0], self.top[-1], self.bottom[-1], self.bottom[0]])

    @property
    def ring(self) -> Floats:
        """The whole boundary once round, (n, 2) [px], clockwise in the picture, first point not repeated."""
        return np.concatenate([self.top[:-1], self.right[:-1], self.bottom[:0:-1], self.left[:0:-1]])


def straight_outline(corners: Floats) -> Outline:
    """Return the outline of a quadrilateral: corners (4, 2) on the undistorted grid [px] in the grid's order."""
    require(np.shape(corners) == (4, 2), "corners", "have shape (4, 2)", np.shape(corners))
    a, b, c, d = np.asarray(corners, dtype=np.float64)
    return Outline(top=np.stack([a, b]), right=np.stack([b, c]), bottom=np.stack([d, c]), left=np.stack([a, d]))


def page_outline(
    white: Array, black: Array, camera: Pinhole, mask: Mask | None = None, depth: DepthMap | None = None
) -> Outline:
    """Find the page's sides and corners from the white and black frames, or from a mask drawn by hand.

    Each boundary point lies where the white frame passes half way from the desk's level to the page's own level just
    there, so neither shading nor the lens's blur shifts it.

    Parameters
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector.
    camera : Pinhole
        The raw camera.
    mask : (height, width) bool array, optional
        True on the page, raw pixels; taken as it is, sides to .3 px and corners to 1, instead of what the frames show.
    depth : DepthMap, optional
        Of the same scene: on a desk nearly as light as the page, height above it tells them apart where light does not.

    Returns
    -------
    Outline

    Raises
    ------
    InputError
        If shapes disagree or the mask is empty.
    StepError
        If there is no page, it touches the picture's border, or it has not four corners.
    """
    width, height = camera.size
    require(white.shape[:2] == (height, width), "white", f"have the camera's shape {(height, width)}", white.shape)
    if mask is None:
        faint = depth is not None and is_light(white, black)
        page = light_desk_page(white, black, camera, depth) if depth is not None and faint else page_mask(white, black)
        signal = grey_levels(white).astype(np.float64)
    else:
        require(mask.shape == (height, width), "mask", f"have the camera's shape {(height, width)}", mask.shape)
        require(bool(mask.any()), "mask", "hold at least one pixel of the page", "an empty mask")
        page = largest_filled(mask)
        require_page_shape(page)
        signal, faint = cv2.GaussianBlur(page.astype(np.float64), (0, 0), 1.0), False
    ring = _boundary(signal, page, faint)
    normalised = projection.undistort(camera, ring)
    ring = normalised @ camera.K[:2, :2].T + camera.K[:2, 2]
    outline = _split_at_corners(ring)
    _require_same_area(outline, ring)
    return outline


def _require_same_area(outline: Outline, ring: Floats) -> None:
    """Refuse corners that lines along a ragged border have thrown far off the border itself."""
    found, seen = (cv2.contourArea(points.astype(np.float32).reshape(-1, 1, 2)) for points in (outline.ring, ring))
    if abs(found - seen) > AREA_TOLERANCE * seen:
        raise StepError(
            f"Page outline: the sides enclose {found / seen:.0%} of the region found; "
            "use a darker desk, unfold the page's corners, or give a mask."
        )


def _resample(ring: Floats, step: float) -> Floats:
    """Return a closed polygon's points at even arc lengths of about `step`."""
    closed = np.concatenate([ring, ring[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], max(16, round(along[-1] / step)), endpoint=False)
    return np.stack([np.interp(wanted, along, closed[:, k]) for k in range(2)], axis=-1)


def _boundary(signal: Floats, page: Mask, faint: bool) -> Floats:
    """Move the mask's contour along its normals to the half level; (n, 2) raw pixels, clockwise in the picture."""
    contours, _ = cv2.findContours(page.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ring = _resample(max(contours, key=len).reshape(-1, 2).astype(np.float64), 1.0)
    x, y = ring.T
    if np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) < 0:
        ring = ring[::-1]
    ring = ndimage.gaussian_filter1d(ring, RING_SMOOTHING_PX, axis=0, mode="wrap")
    tangent = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    outward = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1)
    offset = _half_level_offset(signal, ring, outward, faint)
    return np.asarray(ring + offset[:, None] * outward)


def _half_level_offset(signal: Floats, ring: Floats, outward: Floats, faint: bool) -> Floats:
    """Signed distance [px] along each outward normal to where the signal is half way from page to desk.

    It falls there; on a light desk, where the border is `faint`, it may rise as well, or show nothing.
    """
    t = np.arange(-REACH_PX, REACH_PX + STEP_PX / 2, STEP_PX)
    places = ring[:, None] + t[:, None] * outward[:, None]
    profile = ndimage.map_coordinates(signal, [places[..., 1], places[..., 0]], order=1, mode="nearest")
    desk = np.median(profile[:, (t >= DESK_STRETCH_PX[0]) & (t <= DESK_STRETCH_PX[1])], axis=1)
    # The brighter part of the inner stretch: ink that comes close to the edge must not lower the page's level.
    inner = profile[:, (t >= PAGE_STRETCH_PX[0]) & (t <= PAGE_STRETCH_PX[1])]
    paper = np.percentile(inner, 75, axis=1)
    if faint:
        paper = np.median(inner, axis=1)
        sign = np.where(paper >= desk, 1.0, -1.0)
        profile, desk, paper = profile * sign[:, None], desk * sign, paper * sign
    above = profile >= ((desk + paper) / 2)[:, None]
    last = above.shape[1] - 1 - above[:, ::-1].argmax(axis=1)
    rows = np.arange(len(ring))
    ahead = np.minimum(last + 1, len(t) - 1)
    here, there = profile[rows, last], profile[rows, ahead]
    drop = np.where(here > there, here - there, 1.0)
    offset = t[last] + STEP_PX * np.clip((here - (desk + paper) / 2) / drop, 0.0, 1.0)
    contrast = paper - desk
    sound = above.any(axis=1) & (last < len(t) - 1) & (contrast > 0.2 * np.median(contrast))
    # A neighbour's shadow or a speck on the desk throws single points off: hold them to their surroundings.
    sound &= np.abs(offset - ndimage.median_filter(offset, 15, mode="wrap")) < 1.0
    if faint:
        kept = np.where(sound & (contrast > FAINT_STEP_GREY), offset, 0.0)
        return np.asarray(ndimage.gaussian_filter1d(ndimage.median_filter(kept, 5, mode="wrap"), 1.5, mode="wrap"))
    if sound.mean() < 0.5:
        raise StepError(
            f"Page outline: {1 - sound.mean():.0%} of the boundary shows no clear step from page to desk; "
            "use a darker desk or give a mask."
        )
    whole = np.interp(rows, rows[sound], offset[sound], period=len(rows))
    return np.asarray(ndimage.gaussian_filter1d(whole, OFFSET_SMOOTHING_PX, mode="wrap"))


def _turns(ring: Floats, leg: int) -> Floats:
    """Angle [degrees] by which each point's leading leg turns off its trailing one, positive where convex."""
    skip = max(1, leg // 4)
    back = np.roll(ring, skip, axis=0) - np.roll(ring, leg, axis=0)
    ahead = np.roll(ring, -leg, axis=0) - np.roll(ring, -skip, axis=0)
    cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
    return np.asarray(np.degrees(np.arctan2(cross, (back * ahead).sum(axis=1))))


def _quadrilateral_area(points: Floats) -> float:
    first, second = points[2] - points[0], points[3] - points[1]
    return float(abs(first[0] * second[1] - first[1] * second[0]) / 2)


def _corner_indices(ring: Floats) -> tuple[int, ...]:
    """Of all points that turn like a corner, the four that span the largest area, in order along the ring."""
    turns = _turns(ring, round(LEG_PX))
    peaks = turns == ndimage.maximum_filter1d(turns, 2 * round(LEG_PX) + 1, mode="wrap")
    candidates = np.flatnonzero(peaks & (turns > TURN_MIN_DEG))
    candidates = np.sort(candidates[np.argsort(-turns[candidates])][:12])
    if len(candidates) < 4:
        raise StepError(
            f"Page outline: {len(candidates)} corners that turn by more than {TURN_MIN_DEG:.0f} degrees found, "
            "4 needed; unfold the page's corners or give a mask."
        )
    return max(combinations(candidates.tolist(), 4), key=lambda c: _quadrilateral_area(ring[list(c)]))


def _fit_line(points: Floats) -> tuple[Floats, Floats]:
    """Total least squares: a point on the line and its unit direction."""
    middle = points.mean(axis=0)
    return middle, np.linalg.svd(points - middle)[2][0]


def _refine_corner(ring: Floats, index: int) -> Floats:
    """Intersect the lines through both sides just beyond where blur rounds the corner off."""
    leg = np.arange(round(ROUNDED_PX) + 1, round(LEG_PX) + 1)
    p, d = _fit_line(ring[(index - leg) % len(ring)])
    q, e = _fit_line(ring[(index + leg) % len(ring)])
    s = np.linalg.solve(np.stack([d, -e], axis=-1), q - p)
    return np.asarray(p + s[0] * d)


def _split_at_corners(ring: Floats) -> Outline:
    """Cut the closed boundary at its corners into four sides, the first being the one that runs along the top."""
    ring = _resample(ring, 1.0)
    indices = _corner_indices(ring)
    corners = np.stack([_refine_corner(ring, i) for i in indices])
    sides = []
    for k in range(4):
        i, j = indices[k], indices[(k + 1) % 4]
        between = ring[np.arange(i, j if j > i else j + len(ring)) % len(ring)]
        a, b = corners[k], corners[(k + 1) % 4]
        clear = (np.linalg.norm(between - a, axis=1) > ROUNDED_PX) & (np.linalg.norm(between - b, axis=1) > ROUNDED_PX)
        sides.append(np.concatenate([[a], between[clear], [b]]))
    # The ring runs clockwise in the picture, so of the four sides the top one runs most nearly along +x,
    # judged together with the bottom one that runs back.
    chords = np.roll(corners, -1, axis=0) - corners
    along = chords - np.roll(chords, -2, axis=0)
    first = int(np.argmax(along[:, 0] / np.linalg.norm(along, axis=1)))
    top, right, bottom, left = (sides[(first + k) % 4] for k in range(4))
    return Outline(top=top, right=right, bottom=bottom[::-1].copy(), left=left[::-1].copy())
