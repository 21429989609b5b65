"""Physical crumples: a sheet of paper pulled to random heights, creased where it bends too sharply, and let go.

The forward model is a continuum discretised (:mod:`data_synth.plate`), solved by :mod:`data_synth.relaxation` from
coarse to fine; nothing of it is a spring system, so that no flattening program meets its own energy. Curvature gathers
in ridges between d-cones, as in crumpled paper (Witten, Stress focusing in elastic sheets, Rev. Mod. Phys. 79, 2007).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from data_synth.developables import SHAPE
from data_synth.plate import Plate
from data_synth.plate_grids import Handles, flat_plate, free_plate, levelled
from data_synth.relaxation import relax, relax_plastically
from data_synth.sheets import LEAST_CELL, PAGE_SIZE_MM, TrueSheet, laid, least_cell, page_grid_of, slopes_deg
from data_synth.splines import resampled, spline
from deskew.errors import StepError, require, require_positive, require_whole
from deskew.types import Floats

_LEVELS = ((61, 79), (121, 156))  # (short side, long side); the grid asked for comes last
_ATTEMPTS = 5
# Slope that is left when the sheet is let go, over that under load: it is less if creases formed on the coarsest grid
# alone, since the next one sharpens them without yielding.
_SPRING_BACK, _SPRING_BACK_COARSE = 0.85, 0.74


@dataclass(frozen=True, slots=True)
class Paper:
    """Material of a physical crumple, and how it is handled.

    Attributes
    ----------
    thickness_mm : float
        Bending stiffness is ``thickness^2 / 12`` of the membrane's; a coarse grid takes at least .06 of its spacing.
    yield_curvature : float
        Sharpest bend that springs back wholly [1/mm].
    handles : (fewest, most)
        Points of the sheet that are pulled to random heights, both included.
    pull : float
        Stiffness of each handle's spring, in units of the membrane's.
    """

    thickness_mm: float = 0.15
    yield_curvature: float = 0.004
    handles: tuple[int, int] = (60, 140)
    pull: float = 0.05

    def __post_init__(self) -> None:
        for name in ("thickness_mm", "yield_curvature", "pull"):
            require_positive(name, getattr(self, name), 10.0)
        fewest, most = self.handles
        require_whole("handles", fewest, 1, 1000)
        require_whole("handles", most, fewest, 1000)


def physical(
    rng: np.random.Generator,
    shape: tuple[int, int] = SHAPE,
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    slope_p90_deg: float = 17.0,
    *,
    paper: Paper | None = None,
) -> TrueSheet:
    """Crumple a sheet as a hand would; nearly isometric, within what paper of this thickness stretches.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    shape : (rows, columns)
        Grid. Time and memory grow with columns times rows cubed and squared: 121 x 156 take 10 to 20 s of one core and
        a band of .3 GB, 240 x 310 some 110 s and 2.6 GB.
    page_size_mm : (width, height)
        Page [mm].
    slope_p90_deg : float
        Wanted 90th percentile of the slope, in [3, 30]; the sheet's own comes out within some 10 % of it.
    paper : Paper
        Material.

    Returns
    -------
    TrueSheet
        With its best-fit tilt removed, its lowest vertex on the bed, centred over the world's origin.

    Raises
    ------
    StepError
        If five drawn sheets all had near-vertical walls.
    """
    require(3 <= slope_p90_deg <= 30, "slope_p90_deg", "be in [3, 30]", slope_p90_deg)
    require(min(shape) >= 8, "shape", "be (rows, columns), each at least 8", shape)
    # The band is narrow along the longer side, so that one comes first in here.
    turned = shape[1] >= shape[0]
    sizes = (page_size_mm[0], page_size_mm[1]) if turned else (page_size_mm[1], page_size_mm[0])
    last = (shape[1], shape[0]) if turned else shape
    for _ in range(_ATTEMPTS):
        with threadpool_limits(1, user_api="blas"):  # the sums' order, and so the bytes, depend on the threads
            x = _crumpled(rng, last, sizes, slope_p90_deg, paper or Paper())
        vertices = levelled(np.swapaxes(x, 0, 1) if turned else x, page_size_mm, turned)
        if least_cell(vertices) >= LEAST_CELL:
            return TrueSheet(laid(vertices), page_grid_of(shape, page_size_mm))
    raise StepError(f"physical: {_ATTEMPTS} sheets had walls; lower `slope_p90_deg`.")


def _crumpled(
    rng: np.random.Generator, last: tuple[int, int], sizes: tuple[float, float], slope_p90_deg: float, paper: Paper
) -> Floats:
    """Crumple on grids from coarse to fine, let go on the last but one: (n, m, 3), the longer side first."""
    n = int(rng.integers(paper.handles[0], paper.handles[1] + 1))
    handles = Handles(rng.uniform(0.05, 0.95, (n, 2)), rng.uniform(-1.0, 1.0, n), paper.pull)
    levels = [(n, m) for m, n in _LEVELS if n < last[0] and m < last[1]] or [last]
    x = flat_plate(levels[0], sizes)
    amplitude = 0.25
    loaded = slope_p90_deg / (_SPRING_BACK_COARSE if len(levels) == 1 and levels != [last] else _SPRING_BACK)
    for level in levels:
        # The last of these levels does the last of the pulling, so that its creases form on the way.
        share = 1.0 if level == levels[-1] else 0.9
        x = resampled(x, level)
        plate = free_plate(level, sizes, paper.thickness_mm)  # creases form anew, sharper
        x, plate, amplitude = _pulled(x, plate, handles, amplitude, share * loaded, paper)
    x = relax(x, replace(plate, pull=np.zeros(plate.pull.shape)), 12)
    if levels[-1] == last:
        return x
    along, across, twist = plate.rest
    # Linear, since a cubic would overshoot at creases. The cells' centres are stretched to the border, by half a cell.
    rest = (spline(along, last, 1), spline(across, last, 1), spline(twist, (last[0] - 1, last[1] - 1), 1))
    return relax(resampled(x, last), replace(free_plate(last, sizes, paper.thickness_mm), rest=rest), 8)


def _pulled(
    x: Floats, plate: Plate, handles: Handles, amplitude_mm: float, slope_p90_deg: float, paper: Paper
) -> tuple[Floats, Plate, float]:
    """Pull the handles farther apart, creasing all the while, until the sheet's slope under load is the wanted one."""
    shape = (x.shape[0], x.shape[1])
    for _ in range(100):
        pull, heights = handles.on(shape, amplitude_mm)
        plate = replace(plate, pull=pull, heights=heights)
        x, plate = relax_plastically(x, plate, paper.yield_curvature, 1, 5)
        if float(np.percentile(_slopes_deg(x), 90)) >= slope_p90_deg:
            return x, plate, amplitude_mm
        amplitude_mm += max(0.25, 0.06 * amplitude_mm)
    raise StepError(f"physical: a slope of {slope_p90_deg:.1f} degrees under load is out of reach; lower it.")


def _slopes_deg(x: Floats) -> Floats:
    """Slopes of a grid, whichever way it is wound [deg]."""
    slopes = slopes_deg(x)
    return np.asarray(np.minimum(slopes, 180.0 - slopes))
