"""Draw docs/figures/rig.png: `python docs/figures/rig.py` from a checkout."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import data_synth as ds
from deskew.types import PatternKind, Pinhole


def centre(device: Pinhole) -> np.ndarray:
    """Where a device stands [mm]."""
    return -device.R.T @ device.t


def seen(device: Pinhole, row: float) -> list[np.ndarray]:
    """Where the rays of a row's two ends meet the bed, without the lens's distortion [mm]."""
    found = []
    for column in (0, device.size[0] - 1):
        ray = device.R.T @ np.linalg.solve(device.K, [column, row, 1.0])
        eye = centre(device)
        found.append(eye - ray * eye[2] / ray[2])
    return found


def side_view(axes: plt.Axes, rig: ds.Rig, sheet: ds.TrueSheet) -> None:
    """Draw the bench from the front, to scale."""
    for device, row, colour, name in (
        (rig.camera, 239.5, "tab:blue", "camera 640 x 480"),
        (rig.projector, 383.5, "tab:orange", "projector 1024 x 768"),
    ):
        eye, ends = centre(device), seen(device, row)
        axes.fill([eye[0], *(p[0] for p in ends)], [eye[2], *(p[2] for p in ends)], color=colour, alpha=0.15, lw=0)
        axes.plot(*eye[[0, 2]], "o", color=colour, ms=9)
        axes.annotate(
            f"{name}\n({eye[0]:.0f}, {eye[1]:.0f}, {eye[2]:.0f}) mm", eye[[0, 2]], (8, 4), textcoords="offset points"
        )
    middle = sheet.vertices[len(sheet.vertices) // 2]
    axes.plot(middle[:, 0], middle[:, 2], color="black", lw=1.5)
    axes.axhline(0, color="0.6", lw=0.8)
    axes.set(
        aspect="equal",
        xlim=(-220, 760),
        ylim=(-25, 1030),
        xlabel="X [mm]",
        ylabel="Z [mm]",
        title="the bench, to scale\n",
    )
    axes.spines[["top", "right"]].set_visible(False)


def main() -> None:
    """Draw and write."""
    rig, sheet, page = ds.default_rig(), ds.shipped_crumple(4), ds.Checkerboard()
    sweep = ds.photograph(rig, sheet, page, 1)
    gray = ds.photograph(rig, sheet, page, 1, PatternKind.GRAY_CODE)
    pictures = {
        "white frame": sweep.white,
        "a frame of the line sweep, brightened": 4.0 * next(islice(iter(sweep.columns), 500, None)),
        "a bit of the Gray code": next(islice(iter(gray.columns), 8, None)),
        "black frame, brightened": 8.0 * sweep.black,
    }
    figure = plt.figure(figsize=(11, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(1.1, 1, 1))
    side_view(figure.add_subplot(grid[:, 0]), rig, sheet)
    for i, (title, picture) in enumerate(pictures.items()):
        axes = figure.add_subplot(grid[i // 2, 1 + i % 2])
        axes.imshow(np.clip(picture, 0, 255), cmap="gray", vmin=0, vmax=255)
        axes.set_axis_off()
        axes.set_title(title, fontsize=10)
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    main()
