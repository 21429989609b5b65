"""From a flattened sheet back to pictures of the flat page (section 3.5), under every light (section 2.4) or none."""

from deskew.restoration.combine import (
    Components,
    as_picture,
    combined,
    lights_of,
    maximum,
    mean,
    pictures_of,
    principal_components,
    ratio,
    require_combination,
)
from deskew.restoration.registration import Registration, register
from deskew.restoration.resolution import dots_per_inch, pixels_per_unit
from deskew.restoration.restorers import dewarp_by, restore_by
from deskew.restoration.sampling import read_at
from deskew.restoration.shading import UNSHADED, divide_by_local_white, remove_shading, surface_points
from deskew.restoration.textures import Textures, register_textures, restore_textures
from deskew.restoration.warp import texture_quads, undistorted_view, undistortion_map, view_camera

__all__ = [
    "UNSHADED",
    "Components",
    "Registration",
    "Textures",
    "as_picture",
    "combined",
    "dewarp_by",
    "divide_by_local_white",
    "dots_per_inch",
    "lights_of",
    "maximum",
    "mean",
    "pictures_of",
    "pixels_per_unit",
    "principal_components",
    "ratio",
    "read_at",
    "register",
    "register_textures",
    "remove_shading",
    "require_combination",
    "restore_by",
    "restore_textures",
    "surface_points",
    "texture_quads",
    "undistorted_view",
    "undistortion_map",
    "view_camera",
]
