"""Depth maps and scans on disk: NPZ for the whole, TIFF for depth that other programs look at."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from deskew.errors import InputError, require
from deskew.io.arrays import read_arrays, require_arrays, write_arrays
from deskew.io.captures import LIGHT_NAME
from deskew.io.colour import is_profile
from deskew.io.files import shown, write_bytes
from deskew.io.images import encoded, read_raster, require_picture
from deskew.types import Array, DepthMap, Floats, Pinhole, Reason, Scan, Sheet

SCAN_VERSION = 1

_PINHOLE: dict[str, tuple[int | None, ...]] = {"size": (2,), "K": (3, 3), "distortion": (5,), "R": (3, 3), "t": (3,)}
_DEPTH: dict[str, tuple[int | None, ...]] = {
    "version": (),
    "depth_z": (None, None),
    "depth_reason": (None, None),
    **{f"depth_camera_{name}": shape for name, shape in _PINHOLE.items()},
}
_SCAN: dict[str, tuple[int | None, ...]] = {
    **_DEPTH,
    "image_white": (None, None),
    **{f"camera_{name}": shape for name, shape in _PINHOLE.items()},
    "sheet_vertices": (None, None, 3),
    "outline": (4, 2),
    "filled_fraction": (),
}
_OPTIONAL: dict[str, tuple[int | None, ...]] = {"sheet_crease_width": ()}


def _pinhole_arrays(device: Pinhole, prefix: str) -> dict[str, Array]:
    return {f"{prefix}_{name}": np.asarray(getattr(device, name)) for name in _PINHOLE}


def _pinhole(arrays: Mapping[str, Array], prefix: str) -> Pinhole:
    size = arrays[f"{prefix}_size"]
    require(size.dtype.kind in "iu", f"{prefix}_size", "be whole numbers of pixels", size.dtype)
    width, height = (int(side) for side in size)
    return Pinhole((width, height), *(arrays[f"{prefix}_{name}"] for name in ("K", "distortion", "R", "t")))


def _depth_arrays(depth: DepthMap) -> dict[str, Array]:
    return {
        "version": np.array(SCAN_VERSION),
        "depth_z": depth.z,
        "depth_reason": depth.reason,
        **_pinhole_arrays(depth.camera, "depth_camera"),
    }


def _depth(arrays: Mapping[str, Array], path: Path) -> DepthMap:
    version, reason = arrays["version"], arrays["depth_reason"]
    require(version == SCAN_VERSION, f"{path}: version", f"be {SCAN_VERSION}", version)
    known = reason.dtype == np.uint8 and int(reason.max(initial=0)) <= max(Reason)
    require(known, f"{path}: depth_reason", f"be uint8 in [0, {int(max(Reason))}]", reason.dtype)
    return DepthMap(arrays["depth_z"], reason, _pinhole(arrays, "depth_camera"))


def write_depth(depth: DepthMap, path: Path) -> None:
    """Write a depth map: ``.npz`` keeps everything, ``.tif`` the camera z alone.

    Parameters
    ----------
    depth : DepthMap
        Camera z [mm].
    path : Path
        A TIFF holds float32, good to 0.0001 mm at a metre, NaN where there is no depth; reasons and camera are lost.

    Raises
    ------
    InputError
        If the suffix is another.
    StepError
        If the file system refuses.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    require(suffix in (".npz", ".tif", ".tiff"), str(path), "end in .npz, .tif or .tiff", suffix or "no suffix")
    if suffix == ".npz":
        write_arrays(_depth_arrays(depth), path)
    else:
        write_bytes(encoded(depth.z.astype(np.float32), suffix), path)


def read_depth(path: Path) -> DepthMap:
    """Read a depth map from NPZ, bit for bit what was written.

    Raises
    ------
    InputError
        If the file is damaged or its arrays do not make a depth map.
    """
    path = Path(path)
    arrays = read_arrays(path)
    require_arrays(arrays, _DEPTH, path)
    try:
        return _depth(arrays, path)
    except InputError as error:
        raise _named(error, path) from error


def read_depth_image(path: Path) -> Floats:
    """Read the camera z [mm] of a depth TIFF, (height, width) float32, NaN where there is none.

    Raises
    ------
    InputError
        If it is not a single-channel floating-point TIFF.
    """
    path = Path(path)
    require(path.suffix.lower() in (".tif", ".tiff"), str(path), "end in .tif or .tiff", path.suffix or "no suffix")
    z = read_raster(path)
    good = z.ndim == 2 and z.dtype == np.float32
    require(good, str(path), "hold one float32 channel", f"{z.dtype} of shape {z.shape}")
    return z


def _named(error: InputError, path: Path) -> InputError:
    message = str(error)
    return error if str(path) in message else InputError(f"`{path}`: {message}")


def _text(letters: Array) -> str:
    text = letters.astype(np.uint8).tobytes().decode("utf-8", "replace")
    require(
        bool(text) and len(text) <= 64 and text.isprintable(), "unit", "be 1 to 64 printable characters", shown(text)
    )
    return text


def _profiles(arrays: Mapping[str, Array], images: Mapping[str, Array]) -> dict[str, bytes]:
    """Colour profiles of the images that have one."""
    found = {n.removeprefix("profile_"): v.tobytes() for n, v in arrays.items() if n.startswith("profile_")}
    for light, icc in found.items():
        fits = light in images and is_profile(icc, 1 if images[light].ndim == 2 else 3)
        require(fits, f"profile_{shown(light)}", "be the ICC profile of that light's image", f"{len(icc)} bytes")
    return found


def write_scan(scan: Scan, path: Path) -> None:
    """Write a scan as NPZ: images, depth, camera, sheet and outline, everything that a restoration may see.

    Raises
    ------
    InputError
        If the suffix is not ``.npz`` or the sheet is no grid.
    StepError
        If the file system refuses.
    """
    require(scan.sheet.faces is None, "sheet", "be a grid", "triangles")
    arrays = {
        **_depth_arrays(scan.depth),
        **{f"image_{light}": np.asarray(image) for light, image in scan.images.items()},
        **_pinhole_arrays(scan.camera, "camera"),
        "sheet_vertices": scan.sheet.vertices,
        "outline": np.asarray(scan.outline),
        "filled_fraction": np.array(scan.filled_fraction),
        "unit": np.frombuffer(scan.unit.encode(), np.uint8),
        **{f"profile_{light}": np.frombuffer(icc, np.uint8) for light, icc in scan.profiles.items()},
    }
    if scan.sheet.stiffness is not None:
        arrays["sheet_stiffness"] = scan.sheet.stiffness
    if scan.sheet.cut is not None:
        arrays["sheet_cut"] = scan.sheet.cut
    if scan.sheet.surface is not None:
        arrays["sheet_surface"], arrays["sheet_crease_width"] = scan.sheet.surface, np.array(scan.sheet.crease_width)
    write_arrays(arrays, Path(path))


def read_scan(path: Path) -> Scan:
    """Read a scan, bit for bit what was written.

    Raises
    ------
    InputError
        If the file is damaged or its arrays do not make a scan.
    """
    path = Path(path)
    arrays = read_arrays(path)
    colour = arrays.get("image_white", np.empty((0, 0))).ndim == 3
    further = {name: shape for name, shape in _OPTIONAL.items() if name in arrays}
    require_arrays(arrays, {**_SCAN, **further, "image_white": (None, None, 3) if colour else (None, None)}, path)
    try:
        images = {name.removeprefix("image_"): v for name, v in arrays.items() if name.startswith("image_")}
        for light, image in images.items():
            named = bool(LIGHT_NAME.fullmatch(light))
            require(named, "image_LIGHT", "name its light in letters, digits, - and _", shown(light))
            require_picture(image, f"image_{light}")
        camera = _pinhole(arrays, "camera")
        white = images["white"].shape[1::-1]
        require(white == camera.size, "image_white", f"have the camera's size {camera.size}", white)
        outline = arrays["outline"]
        require(bool(np.isfinite(outline).all()), "outline", "be finite", "NaN or infinity")
        sheet = Sheet(
            arrays["sheet_vertices"],
            stiffness=arrays.get("sheet_stiffness"),
            cut=arrays.get("sheet_cut"),
            surface=arrays.get("sheet_surface"),
            crease_width=float(arrays.get("sheet_crease_width", 0.0)),
        )
        filled = float(arrays["filled_fraction"])
        require(0 <= filled <= 1, "filled_fraction", "be in [0, 1]", filled)
        unit = _text(arrays["unit"]) if "unit" in arrays else "mm"
        profiles = _profiles(arrays, images)
        return Scan(
            images,
            _depth(arrays, path),
            camera,
            sheet,
            outline,
            filled_fraction=filled,
            unit=unit,
            profiles=profiles,
        )
    except InputError as error:
        raise _named(error, path) from error
