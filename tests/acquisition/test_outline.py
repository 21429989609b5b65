"""The outline is found where an analytically drawn page has it, whatever shades the page and the desk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from deskew import projection
from deskew.acquisition.outline import Outline, page_outline, straight_outline
from deskew.acquisition.pagemask import page_mask
from deskew.errors import InputError, StepError
from deskew.types import Floats, Pinhole

WIDTH, HEIGHT = 320, 240
RAYS = 2
CAMERA = Pinhole(
    size=(WIDTH, HEIGHT),
    K=np.array([[520.0, 0.0, 157.0], [0.0, 522.0, 121.0], [0.0, 0.0, 1.0]]),
    distortion=np.array([-0.18, 0.05, 0.001, -0.0008, 0.0]),
    R=np.diag([1.0, -1.0, -1.0]),
    t=np.array([0.0, 0.0, 800.0]),
)


@dataclass(frozen=True)
class Page:
    """A page with curved sides, turned by an angle: each side a known function on the undistorted grid."""

    angle_deg: float = 4.0
    bow_px: float = 4.0
    half: tuple[float, float] = (92.0, 60.0)
    centre: tuple[float, float] = (158.0, 119.0)

    def to_page(self, pixels: Floats) -> Floats:
        a = np.radians(self.angle_deg)
        return (pixels - self.centre) @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])

    def from_page(self, points: Floats) -> Floats:
        a = np.radians(self.angle_deg)
        return points @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + self.centre

    def margins(self, pixels: Floats) -> Floats:
        """Distance inwards from top, right, bottom, left, (..., 4); exact to first order in the sides' slopes."""
        x, y = np.moveaxis(self.to_page(pixels), -1, 0)
        w, h = self.half
        top, bottom = -h + self.bow_px * np.sin(x / 40.0), h + 0.5 * self.bow_px * np.cos(x / 30.0)
        left, right = -w + 0.7 * self.bow_px * np.sin(y / 25.0), w - self.bow_px * np.cos(y / 35.0)
        slopes = (
            self.bow_px * np.cos(x / 40.0) / 40.0,
            self.bow_px * np.sin(y / 35.0) / 35.0,
            -0.5 * self.bow_px * np.sin(x / 30.0) / 30.0,
            0.7 * self.bow_px * np.cos(y / 25.0) / 25.0,
        )
        raw = (y - top, right - x, bottom - y, x - left)
        return np.stack([m / np.hypot(1.0, s) for m, s in zip(raw, slopes, strict=True)], axis=-1)

    def corner(self, first: int, second: int, guess: Floats) -> Floats:
        """Where two sides meet, by Newton's method on their margins."""
        p = self.from_page(np.asarray(guess))
        for _ in range(20):
            value = self.margins(p)[[first, second]]
            jacobian = np.stack(
                [(self.margins(p + d) - self.margins(p - d))[[first, second]] / 2e-4 for d in 1e-4 * np.eye(2)], axis=-1
            )
            p = p - np.linalg.solve(jacobian, value)
        return p

    @property
    def corners(self) -> Floats:
        w, h = self.half
        places = ((0, 3, (-w, -h)), (0, 1, (w, -h)), (2, 1, (w, h)), (2, 3, (-w, h)))
        return np.stack([self.corner(i, j, np.array(g)) for i, j, g in places])


@cache
def undistorted_rays() -> Floats:
    """Where the rays through RAYS x RAYS points of every raw pixel meet the undistorted grid."""
    steps = (np.arange(RAYS) + 0.5) / RAYS - 0.5
    x = (np.arange(WIDTH)[:, None] + steps).ravel()
    y = (np.arange(HEIGHT)[:, None] + steps).ravel()
    normalised = projection.undistort(CAMERA, np.stack(np.meshgrid(x, y), axis=-1))
    return normalised @ CAMERA.K[:2, :2].T + CAMERA.K[:2, 2]


@cache
def draw(
    page: Page,
    *,
    ink: bool = False,
    dark_facet: bool = False,
    desk_gradient: bool = False,
    noise: float = 0.0,
    shadow: bool = False,
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """White and black frame of the page through the lens, blurred, 8-bit.

    2 x 2 rays a pixel, each covered by a side as far as that reaches into its quarter pixel: exact to second order.
    """
    n, pixels = RAYS, undistorted_rays()
    cover = np.clip(RAYS * page.margins(pixels) + 0.5, 0.0, 1.0).prod(axis=-1)
    local = page.to_page(pixels)
    paper = np.full(cover.shape, 0.85)
    light = np.ones(cover.shape)
    if ink:
        squares = (np.floor(local[..., 0] / 13) + np.floor(local[..., 1] / 13)) % 2 == 0
        paper[squares & (np.abs(local[..., 0]) < 80) & (np.abs(local[..., 1]) < 48)] = 0.05
    if dark_facet:
        light[(local[..., 0] > 40) & (local[..., 1] > -30 + 0.3 * local[..., 0])] = 0.3
    if shadow:
        light[(local[..., 0] < -67) & (np.abs(local[..., 1]) < 20)] = 0.0
    desk = 0.04 + (0.1 * (pixels[..., 0] / WIDTH) if desk_gradient else 0.0)
    albedo = cover * paper + (1 - cover) * desk
    rng = np.random.default_rng(5)
    frames = []
    for level in (0.1 + light, np.full_like(light, 0.1)):
        signal = (albedo * level).reshape(HEIGHT, n, WIDTH, n).mean(axis=(1, 3)) * 230.0
        signal = cv2.GaussianBlur(signal, (0, 0), 0.8) + noise * rng.standard_normal((HEIGHT, WIDTH))
        frames.append(np.clip(np.rint(signal), 0, 255).astype(np.uint8))
    return frames[0], frames[1]


def distances_to_truth(outline: Outline, page: Page) -> Floats:
    """Distance of every outline point between the corners from the side that it belongs to [px]."""
    sides = (outline.top, outline.right, outline.bottom, outline.left)
    return np.concatenate([np.abs(page.margins(side[1:-1])[:, k]) for k, side in enumerate(sides)])


SCENES = {
    "plain": {},
    "ink": {"ink": True},
    "dark_facet": {"dark_facet": True},
    "desk_gradient": {"desk_gradient": True},
    "everything": {"ink": True, "dark_facet": True, "desk_gradient": True, "noise": 1.5},
}


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("angle_deg", [0.0, 4.0, -31.0])
def test_sides_are_found_within_a_tenth_of_a_pixel(scene: str, angle_deg: float) -> None:
    page = Page(angle_deg=angle_deg)
    white, black = draw(page, **SCENES[scene])
    off = distances_to_truth(page_outline(white, black, CAMERA), page)
    assert 0 < np.sqrt((off**2).mean()) < 0.035
    # A single point may straddle the facet's crease, where the page's level jumps.
    assert np.percentile(off, 99) < 0.1
    assert off.max() < 0.2


@pytest.mark.parametrize("scene", SCENES)
def test_corners_are_found_within_a_quarter_of_a_pixel_in_the_grids_order(scene: str) -> None:
    page = Page()
    white, black = draw(page, **SCENES[scene])
    off = np.linalg.norm(page_outline(white, black, CAMERA).corners - page.corners, axis=1)
    assert 0 < off.max() < 0.25


def test_shadow_on_the_page_is_still_page() -> None:
    page = Page(bow_px=2.0)
    with_shadow, without = page_mask(*draw(page, shadow=True)), page_mask(*draw(page))
    lost = int((without & ~with_shadow).sum())
    assert 0 <= lost < 60


def test_global_threshold_loses_the_dark_facet_that_the_desk_level_keeps() -> None:
    white, black = draw(Page(), dark_facet=True)
    plain = page_mask(*draw(Page()))
    _, otsu = cv2.threshold(white, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    assert (plain & (otsu == 0)).sum() / plain.sum() > 0.1
    assert (plain ^ page_mask(white, black)).sum() / plain.sum() < 0.005


def test_narrow_dark_margin_beside_ink_is_still_page() -> None:
    """Four pixels of shaded margin between desk and ink, broken by noise: opened before it is filled, it is lost."""
    white = np.full((120, 160), 8.0)
    white[20:100, 25:135] = 180.0
    white[40:70, 25:29] = 60.0
    white[40:70, 29:45] = 12.0
    white[55, 25:29] = 20.0
    page = page_mask(white, np.zeros_like(white))
    assert page[40:70, 27:45].all()
    assert page.sum() == pytest.approx(80 * 110, rel=0.06)


def test_sides_join_at_the_corners_and_the_ring_runs_clockwise_once() -> None:
    outline = page_outline(*draw(Page()), CAMERA)
    ring = outline.ring
    x, y = ring.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    counted = (Page().margins(projection.pixel_grid(CAMERA.size)) > 0).all(axis=-1).sum()
    assert area == pytest.approx(counted, rel=0.002)
    assert np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).min() > 0


def test_colour_and_sixteen_bit_frames_give_the_same_outline() -> None:
    white, black = draw(Page(), ink=True)
    plain = page_outline(white, black, CAMERA).ring
    deep = page_outline(np.dstack([white] * 3).astype(np.uint16) * 257, np.dstack([black] * 3) * np.uint16(257), CAMERA)
    np.testing.assert_allclose(deep.ring, plain, atol=1e-6)


def test_mask_by_hand_is_taken_as_it_is() -> None:
    page = Page(bow_px=0.0)
    raw = projection.pixel_grid(CAMERA.size)
    pixels = projection.undistort(CAMERA, raw) @ CAMERA.K[:2, :2].T + CAMERA.K[:2, 2]
    mask = (page.margins(pixels) > 0).all(axis=-1)
    blank = np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    outline = page_outline(blank, blank, CAMERA, mask=mask)
    off = distances_to_truth(outline, page)
    assert 0.01 < np.sqrt((off**2).mean()) < 0.3
    assert np.linalg.norm(outline.corners - page.corners, axis=1).max() < 1.0


def test_straight_outline_keeps_the_corners_it_was_given() -> None:
    corners = np.array([[10.0, 12.0], [90.0, 9.0], [95.0, 70.0], [8.0, 66.0]])
    np.testing.assert_array_equal(straight_outline(corners).corners, corners)
    with pytest.raises(InputError, match=r"`corners` must have shape \(4, 2\)"):
        straight_outline(corners[:3])


def test_sides_that_do_not_meet_are_refused() -> None:
    a, b, c, d = np.array([[10.0, 10.0], [90.0, 10.0], [90.0, 70.0], [10.0, 70.0]])
    with pytest.raises(InputError, match="`sides` must share their corners"):
        Outline(top=np.stack([a, b]), right=np.stack([b, c]), bottom=np.stack([d, c + 1]), left=np.stack([a, d]))


def test_no_page_says_so_and_what_to_do() -> None:
    rng = np.random.default_rng(0)
    desk = np.clip(12 + 1.5 * rng.standard_normal((HEIGHT, WIDTH)), 0, 255).astype(np.uint8)
    with pytest.raises(StepError, match=r"Page outline: .*(darker desk|desk).*"):
        page_outline(desk, desk, CAMERA)


def test_page_over_the_border_names_the_border() -> None:
    page = Page(centre=(60.0, 119.0))
    with pytest.raises(StepError, match="touches the picture's left border"):
        page_outline(*draw(page), CAMERA)


def test_speck_is_no_page() -> None:
    with pytest.raises(StepError, match=r"covers .* of the picture"):
        page_outline(*draw(Page(half=(19.0, 15.0), bow_px=0.0)), CAMERA)


def test_disc_has_no_four_corners() -> None:
    x, y = np.moveaxis(projection.pixel_grid(CAMERA.size), -1, 0)
    disc = np.where(np.hypot(x - 160, y - 120) < 80, 200, 8).astype(np.uint8)
    with pytest.raises(StepError, match="4 needed"):
        page_outline(disc, disc // 10, CAMERA)


def test_cross_is_not_taken_for_a_page() -> None:
    x, y = np.moveaxis(projection.pixel_grid(CAMERA.size), -1, 0)
    arms = ((np.abs(x - 160) < 20) & (np.abs(y - 120) < 90)) | ((np.abs(y - 120) < 20) & (np.abs(x - 160) < 90))
    cross = np.where(arms, 200, 8).astype(np.uint8)
    with pytest.raises(StepError, match="convex hull"):
        page_outline(cross, cross // 10, CAMERA)


def test_empty_or_misshapen_mask_is_refused() -> None:
    white, black = draw(Page())
    with pytest.raises(InputError, match="`mask` must hold at least one pixel of the page, got an empty mask"):
        page_outline(white, black, CAMERA, mask=np.zeros((HEIGHT, WIDTH), dtype=bool))
    with pytest.raises(InputError, match="`mask` must have the camera's shape"):
        page_outline(white, black, CAMERA, mask=np.ones((HEIGHT, WIDTH - 1), dtype=bool))


def test_frames_of_different_size_are_refused() -> None:
    white, black = draw(Page())
    with pytest.raises(InputError, match="`black` must have white's shape"):
        page_outline(white, black[:-1], CAMERA)
    with pytest.raises(InputError, match="`white` must have the camera's shape"):
        page_outline(white[:-1], black[:-1], CAMERA)
