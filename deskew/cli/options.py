"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
Lights = Annotated[
    list[str] | None,
    typer.Option("--light", "-l", metavar="NAME", help="Light to restore; may be repeated. White unless any is named."),
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
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
