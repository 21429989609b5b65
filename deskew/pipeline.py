"""A capture in, a restored page out: the one place that chains the stages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deskew import acquisition, flattening, restoration
from deskew.acquisition import DecoderSettings, DenoiseSettings, DepthSettings, InkSettings, Outline, SweepSettings
from deskew.errors import StepError, require
from deskew.io import StiffnessMap
from deskew.plugins import Kind, kind_of, name_of
from deskew.projection import project
from deskew.recipes import BEST, Recipe
from deskew.restoration import Textures
from deskew.types import (
    WHITE,
    Board,
    Calibration,
    Capture,
    Correspondence,
    DepthMap,
    Flattened,
    PatternKind,
    Restoration,
    Scan,
    Status,
)

Method = str | Callable[..., Any]

# Smoothing of a surface's normals, for an unfiltered and for a filtered depth map.
_NORMALS_PX = {False: 2.0, True: 0.6}


def decoder_for(recipe: Recipe, pattern: PatternKind) -> DecoderSettings | None:
    """Return the settings of a pattern's decoder that a recipe asks for; None for its own."""
    if pattern is PatternKind.LINE_SWEEP:
        return SweepSettings(mode=recipe.mode)
    return acquisition.settings_for_ink(pattern) if recipe.ink else None


def scan_by(
    recipe: Recipe,
    capture: Capture,
    calibration: Calibration,
    *,
    shape: tuple[int, int] = (45, 45),
    mask: npt.NDArray[np.bool_] | None = None,
    depth: DepthSettings | None = None,
    max_hole_px: float = 12.0,
) -> Scan:
    """Scan a page by a recipe; see :func:`scan` for the rest."""
    return scan(
        capture,
        calibration,
        shape=shape,
        mask=mask,
        depth=depth,
        max_hole_px=max_hole_px,
        settings=decoder_for(recipe, capture.pattern),
        ink=InkSettings() if recipe.ink else None,
        denoise=DenoiseSettings() if recipe.denoise else None,
    )


def decode(capture: Capture, settings: DecoderSettings | None = None) -> Correspondence:
    """Decode a capture, whichever pattern it holds (section 2.3); see :func:`deskew.acquisition.decode`."""
    return acquisition.decode(capture, settings)


def calibrate(
    board: Board,
    captures: Iterable[Capture],
    *,
    settings: DecoderSettings | None = None,
    watch: Callable[[Correspondence], None] | None = None,
) -> Calibration:
    """Calibrate camera and projector from captures of a printed board (section 2.2).

    Parameters
    ----------
    board : Board
        The printed board.
    captures : iterable of Capture
        One a pose, read one at a time; the first lies on the bed and defines the world.
    settings : DecoderSettings, optional
        Of the decoder of the captures' pattern.
    watch : callable, optional
        Is given each pose as it is decoded, such as to see what its frames say of the projector.

    Raises
    ------
    StepError
        If a board is not found, or the poses do not determine the devices.
    """
    views = []
    for capture in captures:
        decoded = decode(capture, settings)
        if watch is not None:
            watch(decoded)
        views.append(acquisition.view_board(board, capture, decoded))
    return acquisition.calibrate(board, views)


def scan(
    capture: Capture,
    calibration: Calibration,
    *,
    shape: tuple[int, int] = (45, 45),
    decoded: Correspondence | None = None,
    outline: Outline | None = None,
    mask: npt.NDArray[np.bool_] | None = None,
    settings: DecoderSettings | None = None,
    ink: InkSettings | None = None,
    depth: DepthSettings | None = None,
    denoise: DenoiseSettings | None = None,
    max_hole_px: float = 12.0,
) -> Scan:
    """Scan a page: decode, cull, triangulate and span a mesh over its outline (sections 2.3 and 2.4).

    Parameters
    ----------
    capture : Capture
        The page.
    calibration : Calibration
        Of the same devices.
    shape : (rows, columns)
        Vertices of the mesh; the paper's is 45 x 45.
    decoded : Correspondence, optional
        The capture, decoded before.
    outline : Outline, optional
        The page's sides; found on the desk in the white and black frames if not given.
    mask : (height, width) bool array, optional
        The page in raw pixels, instead of `outline`.
    settings : DecoderSettings, optional
        Of the decoder of the capture's pattern.
    depth : DepthSettings, optional
        Gates of the depth map.
    ink : InkSettings, optional
        Take out what ink does to the decoded coordinates; the paper does not, and by default nor is it done here. A
        Gray code then keeps the edges of ink, unless `settings` say otherwise.
    denoise : DenoiseSettings, optional
        Of the filter that the depth map passes; none if not given, as in the paper.
    max_hole_px : float
        Holes in the depth map up to this distance from measured depth are filled for the mesh.

    Raises
    ------
    InputError
        If the capture and the calibration are not of devices of the same sizes.
    """
    acquisition.require_same_devices(calibration, capture)
    if ink is not None and settings is None:
        settings = acquisition.settings_for_ink(capture.pattern)
    decoded = decoded or decode(capture, settings)
    if ink is not None:
        decoded = acquisition.correct_ink(calibration, decoded, capture, ink)
    depth_map = acquisition.depth_map(calibration, decoded, depth)
    if denoise is not None:
        depth_map = acquisition.denoise_depth(depth_map, denoise)
    found = span(capture, calibration, depth_map, shape=shape, outline=outline, mask=mask, max_hole_px=max_hole_px)
    return replace(found, projector=decoded.projector)


def span(
    capture: Capture,
    calibration: Calibration,
    depth_map: DepthMap,
    *,
    shape: tuple[int, int] = (45, 45),
    outline: Outline | None = None,
    mask: npt.NDArray[np.bool_] | None = None,
    max_hole_px: float = 12.0,
) -> Scan:
    """Span a mesh over a page whose depth is known: the last step of :func:`scan`, which see for the parameters."""
    if outline is None:
        outline = acquisition.page_outline(capture.white, capture.black, calibration.camera, mask, depth_map)
    mesh = acquisition.page_mesh(depth_map, outline, shape, max_hole_px=max_hole_px)
    images = {WHITE: capture.white, **capture.textures}
    return Scan(
        images,
        depth_map,
        calibration.camera,
        mesh.sheet,
        outline.corners,
        filled_fraction=mesh.filled_fraction,
        unit=calibration.unit,
        profiles=capture.profiles,
    )


def with_shading_removed(scan: Scan, capture: Capture, calibration: Calibration, recipe: Recipe = BEST) -> Scan:
    """Add the image `unshaded` to a scan: its white image without the projector's shading, which its shape tells.

    Parameters
    ----------
    scan : Scan
        The page.
    capture : Capture
        It was scanned from this one.
    calibration : Calibration
        Of the same devices; the place and direction of the projector count.
    recipe : Recipe
        How it was scanned: normals of an unfiltered depth map are smoothed more.
    """
    points = restoration.surface_points(scan.depth)
    devices = calibration.camera, calibration.projector
    unshaded = restoration.remove_shading(capture.white, capture.black, *devices, points, _NORMALS_PX[recipe.denoise])
    profiles = {restoration.UNSHADED: scan.profiles[WHITE]} if WHITE in scan.profiles else {}
    images = {**scan.images, restoration.UNSHADED: unshaded}
    return replace(scan, images=images, profiles={**scan.profiles, **profiles})


def find_leaf(scan: Scan, capture: Capture, calibration: Calibration) -> npt.NDArray[np.bool_]:
    """Tell where a page is of a second, darker material, a leaf set in a sleeve, by the page's own texture.

    Parameters
    ----------
    scan : Scan
        The page, whose shape takes the shading out of its picture.
    capture : Capture
        It was scanned from this one.
    calibration : Calibration
        Of the same devices.

    Returns
    -------
    (height, width) bool array
        The leaf in raw pixels; a `StiffnessMap` gives both materials their constants.

    Raises
    ------
    StepError
        If the page does not show two materials.
    """
    if restoration.UNSHADED not in scan.images:
        scan = with_shading_removed(scan, capture, calibration)
    return acquisition.page_leaf(scan.images[restoration.UNSHADED], acquisition.page_mask(capture.white, capture.black))


def with_stiffness(scan: Scan, materials: StiffnessMap) -> Scan:
    """Give each quad of a scanned sheet the spring constant of the material seen at its middle (section 4.3).

    Parameters
    ----------
    scan : Scan
        The page.
    materials : StiffnessMap
        In the frame of the raw white image.

    Raises
    ------
    InputError
        If the map is not of the camera's size.
    """
    size = scan.camera.size
    require(materials.size == size, "stiffness map", f"have the white image's size {size}", materials.size)
    middles = flattening.middles(scan.sheet)
    constants = materials.at(project(scan.camera, middles).reshape(-1, 2)).reshape(middles.shape[:-1])
    return replace(scan, sheet=flattening.with_stiffness(scan.sheet, constants))


def restore(
    scan: Scan, *, method: Method = flattening.DEFAULT, light: str = WHITE, scale: float = 1.0, **settings: object
) -> Restoration:
    """Flatten a scan and render the page as if it had never been bent (sections 3 and 3.5).

    Parameters
    ----------
    scan : Scan
        The page.
    method : str or callable
        A flattening method's name, or a flattener or restorer from outside, by its name or itself. A restorer restores
        the white image as it is.
    light : str
        Which of the scan's images to restore.
    scale : float
        Pixels of the restored view for each of the camera's.
    **settings
        Of the flattening method.

    Raises
    ------
    StepError
        If the flattening diverged: there is nothing to texture.
    """
    require(light in scan.images, "light", f"be one of {', '.join(scan.images)}", light)
    function = method if callable(method) else flattening.find_method(method)
    if kind_of(function) is Kind.RESTORER:
        plain = light == WHITE and scale == 1.0 and not settings
        require(plain, "method", "be a flattener for another light, scale or setting", f"`{name_of(method)}`")
        return restoration.restore_by(function, scan)
    flattened = _flattened(scan, method, settings)
    return restoration.restore_textures(scan, flattened, [light], scale).restoration(light)


def restore_lights(
    scan: Scan,
    *,
    method: Method = flattening.DEFAULT,
    lights: Iterable[str] | None = None,
    scale: float = 1.0,
    **settings: object,
) -> Textures:
    """Restore a page under several lights by one and the same flattening (section 2.4).

    Parameters
    ----------
    scan : Scan
        The page.
    method : str or callable
        A flattening method's name, or a flattener from outside, by its name or itself.
    lights : names, optional
        Which of the scan's images to restore; all if not given.
    scale : float
        Pixels of the restored views for each of the camera's.
    **settings
        Of the flattening method.

    Returns
    -------
    Textures
        To add lights later, hand its `flattened` to :func:`deskew.restoration.restore_textures`.

    Raises
    ------
    StepError
        If the flattening diverged, or a light in another format does not fit the scan.
    """
    wanted = list(scan.images if lights is None else lights)
    for light in wanted:
        require(light in scan.images, "light", f"be one of {', '.join(scan.images)}", light)
    return restoration.restore_textures(scan, _flattened(scan, method, settings), wanted, scale)


def _flattened(scan: Scan, method: Method, settings: Mapping[str, object]) -> Flattened:
    flattened = flattening.flatten(scan.sheet, method=method, **settings)
    if flattened.status is Status.DIVERGED:
        raise StepError(f"Flattening diverged: {flattened.remedy}")
    return flattened
