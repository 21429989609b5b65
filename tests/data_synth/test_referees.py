"""The rig against two renderers of others: what it sees, what lies in shadow, and how bright its white frame is.

Neither is a dependency; CONTRIBUTING says how to install them. OpenCV undoes the lenses here, not the rig.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from scipy.ndimage import map_coordinates, maximum_filter

import data_synth as ds
from data_synth.pages import PAPER_ALBEDO
from data_synth.shading import SUBSAMPLES, sample_scene
from data_synth.truth import true_sheet_seen
from deskew.types import Floats, Pinhole

Bools = npt.NDArray[np.bool_]

MARGIN_PX = 2
DESK_ALBEDO = 0.3
# The referees trace in single precision, the rig keeps its shadow map at two samples a projector pixel [mm].
NEARER_MM = 0.1


@dataclass(frozen=True)
class Hits:
    """What embree's rays meet first: world points (N, 3) [mm] (the desk where they miss the sheet), and the rest."""

    points: Floats
    normals: Floats
    on_page: Bools
    page: Floats  # (N, 2) page coordinates [mm], 0 on the desk


def shadowing_sheet() -> ds.TrueSheet:
    """A page 12 mm over the desk: a wall in its own shadow, one corner turned up and one turned over the page.

    The wall and the corners shade the page, the page the desk; the corner turned over hides a strip of the page.
    """
    tent = ds.tent()
    vertices = tent.vertices[::3, ::3] + np.array([0.0, 0.0, 12.0])
    for x, y, azimuth_deg, tilt_deg in ((-100.0, 80.0, 140.0, 14.0), (105.0, -80.0, -35.0, 55.0)):
        azimuth, tilt = np.radians([azimuth_deg, tilt_deg])
        normal = np.array([-np.sin(tilt) * np.cos(azimuth), -np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
        # What the mirror's plane cuts off is turned up by twice the plane's tilt.
        below = np.minimum((vertices - (x, y, 12.0)) @ normal, 0.0)
        vertices = vertices - 2 * below[..., None] * normal
    return ds.TrueSheet(vertices, tent.flat[::3, ::3])


@pytest.fixture(scope="module")
def sheet() -> ds.TrueSheet:
    return shadowing_sheet()


@pytest.fixture(scope="module")
def rig() -> ds.Rig:
    """The default optics with neither noise, nor ambient light, nor a dark level, and the sharpest lens there is."""
    config = ds.RigConfig(
        camera_psf_sigma_px=0.3,
        projector_contrast=1e9,
        projector_code=255,
        ambient=0.0,
        pedestal_grey=0.0,
        desk_albedo=DESK_ALBEDO,
        noise_scale=0.0,
    )
    return replace(ds.default_rig(), config=config)


def triangles(sheet: ds.TrueSheet) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """The sheet as vertices (V, 3) and faces (F, 3), counter-clockwise from above."""
    height, width = sheet.vertices.shape[:2]
    index = np.arange(height * width, dtype=np.uint32).reshape(height, width)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]))
    return sheet.vertices.reshape(-1, 3), np.concatenate([np.stack([a, c, b], -1), np.stack([d, b, c], -1)])


def centre_of(device: Pinhole) -> Floats:
    return np.asarray(-device.R.T @ device.t)


def undistorted(device: Pinhole, pixels: Floats) -> Floats:
    """Raw pixels (N, 2) to x/z, y/z in the device's frame, by OpenCV."""
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-14)
    found = cv2.undistortPoints(pixels.reshape(-1, 1, 2), device.K, device.distortion, criteria=criteria)
    return np.asarray(found, dtype=np.float64).reshape(-1, 2)


def directions(device: Pinhole, pixels: Floats) -> Floats:
    return np.asarray(np.column_stack([undistorted(device, pixels), np.ones(len(pixels))]) @ device.R)


def in_frame(device: Pinhole, points: Floats, margin_px: float) -> Bools:
    """Whether world points (N, 3) lie in the device's frame, by OpenCV."""
    seen = cv2.projectPoints(points, cv2.Rodrigues(device.R)[0], device.t, device.K, device.distortion)[0][:, 0]
    return np.asarray((np.abs(seen - np.divide(device.size, 2)) < np.divide(device.size, 2) - margin_px).all(axis=-1))


def pixels_of(shape: tuple[int, int], subsamples: int = 1, margin_px: int = 0) -> Floats:
    """Raw camera pixels (N, 2) of an image (rows, columns) of sub-samples."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.asarray((np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) / subsamples - 0.5 - margin_px)


def near_edges(images: list[npt.NDArray[Any]], jump: float, reach: int) -> Bools:
    """Where some image (h, w) changes between neighbours by more than `jump` within `reach` samples."""
    cracks = np.zeros(images[0].shape, dtype=bool)
    for image in images:
        values = image.astype(np.float64)
        cracks[1:] |= np.abs(np.diff(values, axis=0)) > jump
        cracks[:, 1:] |= np.abs(np.diff(values, axis=1)) > jump
    return np.asarray(maximum_filter(cracks, 2 * reach + 1))


class Embree:
    """A sheet on the desk in embree."""

    def __init__(self, sheet: ds.TrueSheet) -> None:
        reason = "embree is not installed: pip install embreex"
        scene = pytest.importorskip("embreex.rtcore_scene", reason=reason)
        construction = pytest.importorskip("embreex.mesh_construction", reason=reason)
        self.vertices, self.faces = triangles(sheet)
        self.flat = sheet.flat.reshape(-1, 2)
        self.scene = scene.EmbreeScene()
        construction.TriangleMesh(self.scene, self.vertices.astype(np.float32), self.faces)

    def first(self, origin: Floats, rays: Floats) -> Hits:
        """Follow rays (N, 3) from a point."""
        starts = np.broadcast_to(origin, rays.shape).astype(np.float32)
        found = self.scene.run(starts, rays.astype(np.float32), output=1)
        on_page = found["primID"] >= 0
        corners = self.faces[np.where(on_page, found["primID"], 0)]
        weights = np.stack([1 - found["u"] - found["v"], found["u"], found["v"]], axis=-1).astype(np.float64)
        a, b, c = np.moveaxis(self.vertices[corners], 1, 0)
        normals = np.cross(b - a, c - a)
        desk = origin - rays * (origin[2] / rays[:, 2:])
        return Hits(
            np.where(on_page[:, None], np.einsum("nk,nki->ni", weights, self.vertices[corners]), desk),
            np.where(on_page[:, None], normals, (0.0, 0.0, 1.0)),
            on_page,
            np.einsum("nk,nki->ni", weights, self.flat[corners]) * on_page[:, None],
        )


@pytest.fixture(scope="module")
def embree(sheet: ds.TrueSheet) -> Embree:
    return Embree(sheet)


def test_the_camera_sees_what_embree_sees(embree: Embree, rig: ds.Rig, sheet: ds.TrueSheet) -> None:
    shape = rig.camera.size[::-1]
    pixels = pixels_of(shape)
    hits = embree.first(centre_of(rig.camera), directions(rig.camera, pixels))
    seen = true_sheet_seen(sheet, rig.camera).page_at(pixels)
    u, v, on_page = (part.reshape(shape) for part in (hits.page[:, 0], hits.page[:, 1], hits.on_page))
    # The page's coordinates jump where one part of it hides another, and the desk has none.
    calm = ~near_edges([u, v, 1e3 * on_page], jump=4.0, reach=1).ravel()
    hidden = near_edges([u, v], jump=4.0, reach=0).ravel() & ~near_edges([on_page], jump=0.5, reach=2).ravel()
    assert 0.95 < calm.mean() < 1.0
    assert hidden.sum() > 10
    assert np.array_equal(np.isfinite(seen[calm, 0]), hits.on_page[calm])
    both = calm & hits.on_page
    assert 0.0 < np.abs(seen - hits.page)[both].max() < 0.01


def test_what_lies_in_shadow_is_what_embree_says(embree: Embree, rig: ds.Rig, sheet: ds.TrueSheet) -> None:
    samples = sample_scene(rig, sheet, ds.Blank(), MARGIN_PX)
    shape = samples.lit.shape
    hits = embree.first(centre_of(rig.camera), directions(rig.camera, pixels_of(shape, SUBSAMPLES, MARGIN_PX)))
    lamp = centre_of(rig.projector)
    to_point = hits.points - lamp
    blocked = np.linalg.norm(embree.first(lamp, to_point).points - lamp, axis=-1)
    cast = blocked < np.linalg.norm(to_point, axis=-1) - NEARER_MM
    turned_away = np.einsum("ni,ni->n", to_point, hits.normals) >= 0
    lit = ~(cast | turned_away)
    edges = [image.reshape(shape) for image in (lit, hits.on_page)]
    folds = [hits.page[:, k].reshape(shape) for k in (0, 1)]
    silhouettes = near_edges(edges, jump=0.5, reach=4) | near_edges(folds, jump=4.0, reach=4)
    calm = ~silhouettes.ravel() & in_frame(rig.projector, hits.points, margin_px=2.0)
    assert 0.9 < calm.mean() < 1.0
    for kind in (turned_away & hits.on_page, cast & ~turned_away & hits.on_page, cast & ~hits.on_page):
        assert (kind & calm).sum() > 3000
    assert np.array_equal((samples.lit.ravel() > 0)[calm], lit[calm])


def mitsuba_view(rig: ds.Rig, shapes: dict[str, Any], pixels: Floats) -> Floats:
    """Radiance (N,) that Mitsuba's camera sees at raw pixels (N, 2), under its own projector with nothing in the slide.

    Mitsuba knows no lens distortion: it renders the undistorted view, from which OpenCV takes the raw pixels.
    """
    mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install mitsuba")
    # The variants that compile need a fitting LLVM on the system; this one runs everywhere.
    mi.set_variant("scalar_rgb")
    focal, width, height = 1700.0, 720, 560

    def placed(device: Pinhole) -> Any:
        eye, (_, down, ahead) = centre_of(device), device.R
        return mi.ScalarTransform4f().look_at(list(eye), list(eye + ahead), list(-down))

    film = {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "pixel_format": "luminance",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    scene = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": {
            "type": "perspective",
            "fov": float(np.degrees(2 * np.arctan(width / 2 / focal))),
            "fov_axis": "x",
            "to_world": placed(rig.camera),
            "film": film,
            "sampler": {"type": "stratified", "sample_count": 4},
        },
        "projector": {
            "type": "projector",
            "fov": float(np.degrees(2 * np.arctan(0.45))),
            "to_world": placed(rig.projector),
            "irradiance": {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(np.ones((8, 8, 1), dtype=np.float32))},
        },
    }
    picture = np.array(mi.render(mi.load_dict(scene | shapes)), dtype=np.float32).reshape(height, width)
    # A pixel's centre lies half a pixel inside the film.
    places = undistorted(rig.camera, pixels) * focal + np.array([width / 2, height / 2]) - 0.5
    return np.asarray(map_coordinates(picture.astype(np.float64), places.T[::-1], order=1))


def mitsuba_desk(albedo: float) -> dict[str, Any]:
    mi = pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install mitsuba")
    mi.set_variant("scalar_rgb")
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}}
    return {"desk": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(1000.0), "bsdf": diffuse}}


def test_the_white_frame_is_as_bright_as_mitsubas(rig: ds.Rig, sheet: ds.TrueSheet, tmp_path: Path) -> None:
    shapes = mitsuba_desk(DESK_ALBEDO)
    path = tmp_path / "sheet.ply"
    trimesh.Trimesh(*triangles(sheet), process=False).export(path)
    paper = {"type": "diffuse", "reflectance": {"type": "rgb", "value": PAPER_ALBEDO}}
    shapes["sheet"] = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": paper}
    shape = rig.camera.size[::-1]
    pixels = pixels_of(shape)
    # The unit of exposure: a white diffuser on the bed, seen at the world's origin.
    origin = cv2.projectPoints(
        np.zeros((1, 3)), cv2.Rodrigues(rig.camera.R)[0], rig.camera.t, rig.camera.K, rig.camera.distortion
    )[0].reshape(1, 2)
    diffuser = mitsuba_view(rig, mitsuba_desk(1.0), origin)
    expected = rig.config.exposure_grey * mitsuba_view(rig, shapes, pixels) / diffuser
    white = ds.photograph(rig, sheet, ds.Blank(), 0).white.astype(np.float64)
    eye, rays = centre_of(rig.camera), directions(rig.camera, pixels)
    # A point of the desk or over it is lit if the ray's ends at both heights of the working volume are.
    heights = (eye + rays * ((z - eye[2]) / rays[:, 2:]) for z in (0.0, 45.0))
    framed = np.logical_and.reduce([in_frame(rig.projector, points, margin_px=3.0) for points in heights])
    calm = framed & ~near_edges([expected.reshape(shape)], jump=4.0, reach=2).ravel()
    bright = calm & (expected > 10.0)
    deviation = white.ravel()[bright] / expected[bright] - 1.0
    assert bright.mean() > 0.7
    assert 0.0 < np.median(np.abs(deviation)) < 0.01
    # What is left is the rounding to whole grey levels: nowhere more, and no bias.
    assert abs(np.median(deviation)) < 0.001
    assert np.percentile(np.abs(white.ravel() - expected)[bright], 99) < 1.0
    dark = calm & (expected == 0.0)
    assert dark.sum() > 1000
    # Where one dark surface ends in front of another, light comes through a shadow map's last sample.
    assert (white.ravel()[dark] == 0.0).mean() > 0.98
