"""Options that several commands share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from deskew.errors import require

if TYPE_CHECKING:
    from deskew.acquisition import DepthSettings

CaptureFolder = Annotated[
    Path, typer.Argument(metavar="CAPTURE", help="Capture folder (capture.toml, white.png, ...).")
]
CalibrationFile = Annotated[Path, typer.Option("--calibration", "-c", help="calibration.json of the same devices.")]
Shape = Annotated[tuple[int, int], typer.Option("--shape", metavar="R C", help="Mesh vertices down and across.")]
Mask = Annotated[
    Path | None,
    typer.Option("--mask", metavar="IMAGE", help="The page in the camera's picture, not black; found if not given."),
]
Ink = Annotated[
    bool | None,
    typer.Option("--ink/--no-ink", help="Take out what ink does to the depth. Done unless the method is the paper's."),
]
Denoise = Annotated[
    bool | None,
    typer.Option("--denoise/--no-denoise", help="Filter the depth, its creases kept. Done unless as above."),
]
Method = Annotated[
    str,
    typer.Option(
        "--method",
        "-m",
        help="spring (the best), paper_euler or paper_rk4 (the paper's), lscm, arap or slim (libigl's), "
        "or one of your own: package.module:function or an installed entry point, run in this very process.",
    ),
]
EVERY_LIGHT = "all"
Lights = Annotated[
    list[str] | None,
    typer.Option(
        "--light",
        "-l",
        metavar="NAME",
        help=f"Light to restore; may be repeated; {EVERY_LIGHT}: every one of the capture. White unless any is named.",
    ),
]
Combine = Annotated[
    list[str] | None,
    typer.Option(
        "--combine",
        metavar="HOW",
        help="mean, max, ratio:A/B or components of the named lights, or of all; may be repeated.",
    ),
]
Scale = Annotated[float, typer.Option("--scale", metavar="S", help="Restored pixels for each of the camera's.")]
Stiffness = Annotated[
    Path | None,
    typer.Option(
        "--stiffness",
        metavar="MAP.png",
        help="Grey picture of material labels, with MAP.toml beside it: [stiffness], LABEL = k_s [kg/s^2].",
    ),
]
FreeScale = Annotated[
    bool,
    typer.Option(
        "--free-scale",
        help="Let the softer of the map's two materials have shrunk or grown, and say by how much; spring alone.",
    ),
]
Heights = Annotated[
    tuple[float, float],
    typer.Option("--heights", metavar="LOW HIGH", help="Heights above the bed that are believed [calibration's unit]."),
]
Neighbour = Annotated[
    float,
    typer.Option("--neighbour", metavar="D", help="Pixels that differ in depth by less support each other [unit]."),
]
Jump = Annotated[
    float,
    typer.Option("--jump", metavar="D", help="Nothing is interpolated over a larger step in depth [unit]."),
]
Hole = Annotated[
    float,
    typer.Option("--hole", metavar="PX", help="The mesh spans gaps in the depth up to so far from what was measured."),
]
HEIGHTS, NEIGHBOUR, JUMP, HOLE = (-10.0, 150.0), 1.0, 3.0, 12.0
"""For a page in millimetres, some 800 mm from the camera; what is far away or in another unit needs others."""

_HOLE_MAX_PX = 10_000.0


@dataclass(frozen=True, slots=True)
class Gates:
    """What is believed of measured depth, as the options say."""

    heights: tuple[float, float] = HEIGHTS
    neighbour: float = NEIGHBOUR
    jump: float = JUMP
    hole: float = HOLE

    def __post_init__(self) -> None:
        low, high = self.heights
        require(-math.inf < low < high < math.inf, "--heights", "be LOW HIGH, the first below the second", self.heights)
        for name in ("neighbour", "jump"):
            value = getattr(self, name)
            require(0 < value < math.inf, f"--{name}", "be finite and above 0", value)
        require(0 <= self.hole <= _HOLE_MAX_PX, "--hole", f"lie in [0, {_HOLE_MAX_PX:g}] px", self.hole)

    def settings(self) -> DepthSettings:
        """Return them as the depth map takes them."""
        from deskew.acquisition import DepthSettings

        low, high = self.heights
        return DepthSettings(z_min_mm=low, z_max_mm=high, neighbour_mm=self.neighbour, jump_mm=self.jump)


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
