"""What passes between the stages: frozen data that checks itself, and no mathematics.

Lengths are millimetres, angles radians. The world's Z = 0 is the bed that the page lies on, Z points up, towards the
camera. Pixel (0, 0) is the centre of the first pixel. Images are (height, width[, 3]); sizes are (width, height).
"""

from deskew.types.arrays import Array, Floats, Size
from deskew.types.captures import (
    WHITE,
    Capture,
    Frames,
    Fringe,
    Fringes,
    PatternKind,
    half_periods,
    n_frames,
    n_planes,
    require_fringes,
)
from deskew.types.depth import Correspondence, DepthMap, ProjectorCheck, Reason
from deskew.types.devices import Board, Calibration, Pinhole
from deskew.types.pages import Dewarped, Flattened, Restoration, Scan, Sheet, Status

__all__ = [
    "WHITE",
    "Array",
    "Board",
    "Calibration",
    "Capture",
    "Correspondence",
    "DepthMap",
    "Dewarped",
    "Flattened",
    "Floats",
    "Frames",
    "Fringe",
    "Fringes",
    "PatternKind",
    "Pinhole",
    "ProjectorCheck",
    "Reason",
    "Restoration",
    "Scan",
    "Sheet",
    "Size",
    "Status",
    "half_periods",
    "n_frames",
    "n_planes",
    "require_fringes",
]
