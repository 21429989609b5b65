"""The difference image of two restorations of one page, as in the paper's figure 5."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deskew.errors import StepError, require
from deskew.metrics.alignment import fit_rigid
from deskew.types import Array, Flattened, Floats


def laid_onto(flattened: Flattened, other: Flattened) -> Flattened:
    """Turn and move a flattened sheet on the plane until it fits another flattening of the same sheet best.

    Two solutions of the same springs lie turned by some angle, which alone makes text differ by 20 grey levels.

    Parameters
    ----------
    flattened, other : Flattened
        The same vertices.

    Returns
    -------
    Flattened
        `flattened` moved rigidly, its `surface` with it.
    """
    shape = other.vertices.shape
    require(flattened.vertices.shape == shape, "flattened", f"have the other's shape {shape}", flattened.vertices.shape)
    motion = fit_rigid(flattened.vertices[..., :2].reshape(-1, 2), other.vertices[..., :2].reshape(-1, 2))

    def moved(vertices: Floats) -> Floats:
        return np.concatenate([motion.apply(vertices[..., :2]), vertices[..., 2:]], axis=-1)

    surface = None if flattened.surface is None else moved(flattened.surface)
    return replace(flattened, vertices=moved(flattened.vertices), surface=surface)


def image_difference(first: Array, second: Array, page: Array) -> tuple[Floats, dict[str, float]]:
    """Subtract two restored images.

    Parameters
    ----------
    first, second : (H, W) arrays
        Grey images of one view.
    page : (H, W) bool array
        Pixels that show the page in both.

    Returns
    -------
    (H, W) array
        first - second [grey levels]; 0 off the page.
    dict
        `difference_rms_grey`, the root mean square over the page.

    Raises
    ------
    StepError
        If no pixel shows the page in both.
    """
    require(first.ndim == 2, "first", "be a grey image (H, W)", first.shape)
    require(second.shape == first.shape, "second", f"have the first's shape {first.shape}", second.shape)
    require(page.shape == first.shape, "page", f"have the images' shape {first.shape}", page.shape)
    if not page.any():
        raise StepError("Difference image: no pixel shows the page in both images; look at the restored images.")
    difference = np.where(page, first.astype(np.float64) - second.astype(np.float64), 0.0)
    return difference, {"difference_rms_grey": float(np.sqrt((difference[page] ** 2).mean()))}
