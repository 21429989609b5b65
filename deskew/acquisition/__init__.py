"""From a capture to a depth map and a mesh (section 2): corners, calibration, decoding, culling, triangulation."""

from deskew.acquisition.accuracy import (
    DISCARDED_SHARE,
    PlaneDeviation,
    average_deviation,
    depth_points,
    fit_plane,
    flatness_mm,
    length_errors,
    plane_deviation,
)
from deskew.acquisition.boardcheck import (
    BoardAccuracy,
    board_accuracy,
    board_border,
    corners_in_view,
    scanned_points,
)
from deskew.acquisition.calibration import BoardView, board_points, calibrate, view_board
from deskew.acquisition.corners import (
    find_board,
    kitchen_rosenfeld_peaks,
    refine_kitchen_rosenfeld,
    refine_saddle,
)
from deskew.acquisition.decoding import DecoderSettings, decode, settings_for_ink
from deskew.acquisition.denoise import DenoiseSettings, denoise_depth, depth_noise
from deskew.acquisition.depthmap import DepthSettings, depth_map
from deskew.acquisition.epipolar import epipolar_distance
from deskew.acquisition.graycode import GrayCodeSettings, decode_gray
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.ink import InkSettings, correct_ink
from deskew.acquisition.matches import require_same_devices
from deskew.acquisition.materials import page_leaf
from deskew.acquisition.mesh import PageMesh, page_mesh, page_sheet
from deskew.acquisition.outline import Outline, page_outline, straight_outline
from deskew.acquisition.pagemask import page_mask
from deskew.acquisition.phase import PhaseSettings, decode_phase
from deskew.acquisition.spheres import Probing, Sphere, fit_sphere, probe_sphere, spacing_error_mm
from deskew.acquisition.stripes import decode_sweep
from deskew.acquisition.sweep import SweepSettings
from deskew.acquisition.triangulation import triangulate

__all__ = [
    "DISCARDED_SHARE",
    "BoardAccuracy",
    "BoardView",
    "DecoderSettings",
    "DenoiseSettings",
    "DepthSettings",
    "GrayCodeSettings",
    "InkSettings",
    "Outline",
    "PageMesh",
    "PhaseSettings",
    "PlaneDeviation",
    "Probing",
    "Sphere",
    "SweepSettings",
    "average_deviation",
    "board_accuracy",
    "board_border",
    "board_points",
    "calibrate",
    "corners_in_view",
    "correct_ink",
    "decode",
    "decode_gray",
    "decode_phase",
    "decode_sweep",
    "denoise_depth",
    "depth_map",
    "depth_noise",
    "depth_points",
    "epipolar_distance",
    "find_board",
    "fit_plane",
    "fit_sphere",
    "flatness_mm",
    "grey_levels",
    "kitchen_rosenfeld_peaks",
    "length_errors",
    "page_leaf",
    "page_mask",
    "page_mesh",
    "page_outline",
    "page_sheet",
    "plane_deviation",
    "probe_sphere",
    "refine_kitchen_rosenfeld",
    "refine_saddle",
    "require_same_devices",
    "scanned_points",
    "settings_for_ink",
    "spacing_error_mm",
    "straight_outline",
    "triangulate",
    "view_board",
]
