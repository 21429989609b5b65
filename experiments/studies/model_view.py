"""A picture of a recovered 3D model, as in line II of the paper's figure 3."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

from deskew.types import Floats

_HEIGHTS = 3.0


def model_view(vertices: Floats, size: tuple[int, int] = (640, 480)) -> npt.NDArray[np.uint8]:
    """Draw a grid surface, shaded, from in front of and above the bed; heights are three times too large.

    Parameters
    ----------
    vertices : (R, C, 3) array
        World points [mm].
    size : (width, height)
        Of the picture [px].

    Returns
    -------
    (height, width, 3) uint8 array
        RGB.
    """
    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100)
    canvas: Any = FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((-0.12, -0.22, 1.24, 1.44), projection="3d")
    x, y, z = np.moveaxis(vertices[::-1], -1, 0)  # rows upwards, so that the lit side is the one above
    z = _HEIGHTS * z  # before the light falls on it, which then shows what the outline shows
    light = LightSource(azdeg=315, altdeg=40)
    axes.plot_surface(x, y, z, rstride=1, cstride=1, color="0.95", lightsource=light, linewidth=0, antialiased=False)
    spans = [float(np.ptp(axis)) for axis in (x, y, z)]
    axes.set_box_aspect((spans[0], spans[1], max(spans[2], _HEIGHTS)), zoom=1.08)
    axes.view_init(elev=48, azim=-100)
    axes.set_axis_off()
    pixels, _ = canvas.print_to_buffer()
    return np.frombuffer(pixels, np.uint8).reshape(size[1], size[0], 4)[..., :3].copy()
