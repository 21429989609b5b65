"""A restorer: a scan in, the restored page's picture out, with the place in the camera's picture that it came from."""

import numpy as np
from scipy.ndimage import map_coordinates

from deskew import restorer
from deskew.projection import onto_bed, pixel_grid, project
from deskew.restoration import read_at, view_camera
from deskew.types import Restoration, Scan


@restorer
def lay_out(scan: Scan) -> Restoration:
    """Stretch the mesh evenly over a rectangle as wide as its rows are long and as high as its columns."""
    bent = scan.sheet.vertices  # (rows, columns, 3), millimetres
    width = np.linalg.norm(np.diff(bent, axis=1), axis=2).sum(axis=1).mean()
    height = np.linalg.norm(np.diff(bent, axis=0), axis=2).sum(axis=0).mean()

    # Where each pixel of the restored view lies on the bed, and so in the rectangle: in rows and columns of the mesh.
    view = view_camera(scan.camera)
    place = onto_bed(view, pixel_grid(view.size)) - bent.mean(axis=(0, 1))[:2]
    column = (0.5 + place[..., 0] / width) * (bent.shape[1] - 1)
    row = (0.5 - place[..., 1] / height) * (bent.shape[0] - 1)

    # The same place of the bent mesh, as the camera saw it; NaN off the page.
    seen = project(scan.camera, bent)
    source = np.stack([map_coordinates(seen[..., k], [row, column], order=1, cval=np.nan) for k in (0, 1)], axis=-1)
    image = read_at(scan.images["white"], source, 1.0)
    return Restoration(image, source.astype(np.float32), view)
