"""Reading and writing what the stages exchange: captures, boards, calibrations, scans, meshes, images.

Every reader takes a path, checks what it finds and raises `deskew.errors.InputError` naming the file; every writer
takes the thing, then the path, and leaves either the whole file or nothing. Colour images are RGB in memory.
"""

from deskew.io.arrays import read_arrays, write_arrays
from deskew.io.boards import read_board, read_board_file, read_procam_graycode, write_board
from deskew.io.calibrations import read_calibration, write_calibration
from deskew.io.captures import read_capture, write_capture
from deskew.io.colour import is_profile, read_profile
from deskew.io.files import require_writable, write_bytes
from deskew.io.images import read_image, write_image
from deskew.io.meshes import MESH_SUFFIXES, Mesh, grid_faces, read_mesh, sheet_mesh, write_mesh
from deskew.io.scans import read_depth, read_depth_image, read_scan, write_depth, write_scan
from deskew.io.stiffness import StiffnessMap, face_stiffness, read_stiffness, write_stiffness
from deskew.io.tifxyz import Segment, read_tifxyz

__all__ = [
    "MESH_SUFFIXES",
    "Mesh",
    "Segment",
    "StiffnessMap",
    "face_stiffness",
    "grid_faces",
    "is_profile",
    "read_arrays",
    "read_board",
    "read_board_file",
    "read_calibration",
    "read_capture",
    "read_depth",
    "read_depth_image",
    "read_image",
    "read_mesh",
    "read_procam_graycode",
    "read_profile",
    "read_scan",
    "read_stiffness",
    "read_tifxyz",
    "require_writable",
    "sheet_mesh",
    "write_arrays",
    "write_board",
    "write_bytes",
    "write_calibration",
    "write_capture",
    "write_depth",
    "write_image",
    "write_mesh",
    "write_scan",
    "write_stiffness",
]
