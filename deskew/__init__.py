"""Restore an arbitrarily warped page from its 3D shape (Brown and Seales, ICCV 2001).

`deskew.pipeline` chains the stages: `acquisition` (section 2), `flattening` (section 3), `restoration` (section 3.5);
`deskew.metrics` measures the result, `deskew.io` reads and writes, `deskew.types` is what passes between them.
`deskew.flatten` flattens a surface of anyone's; `flattener`, `restorer` and `dewarper` mark methods of anyone's own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from deskew.plugins import dewarper, flattener, restorer

if TYPE_CHECKING:
    from deskew.types import Array, Flattened, Floats

__all__ = ["dewarper", "flatten", "flattener", "restorer"]


def flatten(
    vertices: Floats,
    faces: Array | None = None,
    *,
    method: str = "spring",
    noise_mm: float | str = 0.0,
    stiffness: Floats | Callable[[Floats], Floats] | None = None,
    **settings: object,
) -> Flattened:
    """Flatten a surface onto the plane Z = 0.

    Parameters
    ----------
    vertices : (R, C, 3) or (V, 3) array
        A grid, or with `faces` a triangle mesh [mm].
    faces : (F, 3) int array, optional
        Triangles: one piece with a border; holes and overhangs are welcome.
    method : str
        `spring`, the best one; `paper_euler` or `paper_rk4`, the paper's particle system (grids only); `lscm`, `arap`
        or `slim` of libigl, if that is installed; or a flattener of your own, as `package.module:function` or by the
        name of an entry point in `deskew.methods`.
    noise_mm : float or "auto"
        Standard deviation of the scanner's noise across the sheet [mm], to be removed first; "auto" estimates it. For
        `spring` alone.
    stiffness : (R - 1, C - 1) or (F,) array or callable, optional
        Spring constant of each quad or face [kg/s^2], or a function that takes their middles, (N, 3) [mm], and returns
        these, (N,).
    **settings
        Of the method; see :func:`deskew.flattening.flatten`.

    Returns
    -------
    Flattened
        Its `vertices` have the shape of the given ones, with z = 0 where its `status` is `AT_REST`.

    Raises
    ------
    InputError
        If the surface, the method or a setting is not what it must be; the message names it.
    """
    # Here, not above: `import deskew` costs nothing, and the commands say what is wrong with their arguments at once.
    from deskew import flattening
    from deskew.errors import require
    from deskew.types import Sheet

    sheet = Sheet(vertices, faces)
    if stiffness is not None:
        sheet = flattening.with_stiffness(sheet, stiffness)
    if not (isinstance(noise_mm, int | float) and noise_mm == 0):  # methods without noise need not be told of none
        known = method in flattening.METHODS and method != flattening.DEFAULT
        require(not known, "noise_mm", f"be 0 for {method}: only {flattening.DEFAULT} removes noise", noise_mm)
        settings = {**settings, "noise_mm": noise_mm}
    return flattening.flatten(sheet, method=method, **settings)
