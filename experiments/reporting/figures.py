"""Rows and pictures to figures: a dot a trial, so that nobody mistakes a mean for the data."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from io import BytesIO
from statistics import median
from textwrap import wrap

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from experiments.reporting.figure_layout import Montage, Plot
from experiments.trials.schema import Row


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as PNG, without the date and version that matplotlib would write into it."""
    FigureCanvasAgg(figure)
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=120, metadata={"Software": None})
    return buffer.getvalue()


def dot_plot(plot: Plot, rows: Sequence[Row]) -> Figure | None:
    """Draw one metric, a row of dots for each condition and method with the median as a bar; None without data."""
    values: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in rows:
        if row.metric == plot.metric:
            values[row.condition, row.method].append(row.value)
    if not values:
        return None
    places = sorted(values, reverse=True)
    figure = Figure(figsize=(7.0, 1.2 + 0.35 * len(places)), layout="constrained")
    axes = figure.subplots()
    for height, place in enumerate(places):
        axes.plot(values[place], [height] * len(values[place]), "o", color="tab:blue", alpha=0.6, markersize=5)
        middle = median(values[place])
        axes.plot([middle, middle], [height - 0.3, height + 0.3], color="black", linewidth=1.5)
    if plot.paper is not None:
        axes.axvline(plot.paper, color="tab:red", linestyle="--", label=f"the paper: {plot.paper:g}")
        axes.legend(loc="best", frameon=False)
    axes.set_yticks(range(len(places)), [" ".join(part for part in place if part != "-") for place in places])
    axes.set_ylim(-0.6, len(places) - 0.4)
    axes.set_xlim(left=0.0)
    axes.set_xlabel(plot.label)
    axes.grid(axis="x", alpha=0.3)
    return figure


def picture_wall(montage: Montage, pictures: Mapping[str, bytes], n_trials_max: int = 5) -> Figure | None:
    """Draw a montage of recorded pictures (PNG bytes by name), a column a trial; None without any."""
    trials = [
        trial for trial in range(n_trials_max) if any(name.format(trial=trial) in pictures for _, name in montage.lines)
    ]
    if not trials:
        return None
    size = (2.6 * len(trials), 2.0 * len(montage.lines))
    figure = Figure(figsize=size, layout="constrained")
    places = figure.subplots(len(montage.lines), len(trials), squeeze=False)
    for line, (heading, name) in enumerate(montage.lines):
        for column, trial in enumerate(trials):
            axes = places[line, column]
            axes.set(xticks=[], yticks=[])
            for spine in axes.spines.values():
                spine.set_visible(False)
            png = pictures.get(name.format(trial=trial))
            if png is not None:
                axes.imshow(_decoded(png), cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
            if column == 0:
                axes.set_ylabel(heading, fontsize=9)
            if line == 0:
                axes.set_title(f"{montage.item} {trial + 1}", fontsize=9)
    if montage.caption:
        figure.supxlabel("\n".join(wrap(montage.caption, int(14 * size[0]))), fontsize=8)
    return figure


def _decoded(png: bytes) -> npt.NDArray[np.uint8]:
    image = np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)
    return image if image.ndim == 2 else image[..., 2::-1]
