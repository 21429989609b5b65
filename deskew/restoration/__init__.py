"""From a flattened sheet back to a picture of the flat page (section 3.5)."""

from deskew.restoration.warp import texture_quads, undistorted_view, undistortion_map, view_camera

__all__ = ["texture_quads", "undistorted_view", "undistortion_map", "view_camera"]
