"""The command that lets an editor try stiffnesses out: `edit`."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from deskew.cli.options import Denoise, Ink, Mask, Scale, Shape
from deskew.cli.pictures import PICTURES, Wanted
from deskew.cli.printing import say
from deskew.cli.scanning import Scanning, scan_page
from deskew.errors import require, require_whole

if TYPE_CHECKING:
    from deskew.types import Array, Scan

_METHOD = "spring"  # the one that answers at once
_SUFFIX = ".npz"


def edit(
    capture: Annotated[
        Path, typer.Argument(metavar="CAPTURE", help="Capture folder, or scan.npz that `deskew scan` made of one.")
    ],
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", "-c", help="calibration.json of the same devices; a scan needs none."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="MAP.png", help="Stiffness map to edit; CAPTURE-stiffness.png if not given."
        ),
    ] = None,
    restored: Annotated[
        Path | None,
        typer.Option("--restored", "-r", metavar="IMAGE", help="Restored page to save; MAP-restored.png if not given."),
    ] = None,
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = None,
    denoise: Denoise = None,
    scale: Scale = 1.0,
    port: Annotated[int | None, typer.Option("--port", help="Port of 127.0.0.1; a free one if it is in use.")] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
) -> None:
    """Paint materials over a page, set how stiff each is, and see at once how the page comes out (section 4.3).

    Opens a page in the browser, from this machine alone; its address, with a token, is printed. What is painted is kept
    beside the map after every stroke and taken up the next time. The saved map is what `deskew restore --stiffness`
    takes. Ctrl-C ends it. Needs: pip install 'deskew3d[editor]'.

    Example: deskew edit page/ --calibration calibration.json -o materials.png
    """
    from deskew import io

    name = capture.resolve().name.removesuffix(_SUFFIX)
    map_file = output or Path(f"{name}-stiffness.png")
    picture = restored or map_file.with_name(f"{map_file.stem}-restored.png")
    io.require_writable(map_file, (".png",))
    io.require_writable(picture, PICTURES)
    require(picture.resolve() != map_file.resolve(), "--restored", "be another file than the map", str(picture))
    Wanted.of(picture, None, None, scale)
    if port is not None:
        require_whole("--port", port, 0, 65535)
    from deskew.editor import require_editor

    require_editor()
    opened = _open(capture, calibration, Scanning(shape, mask, _METHOD, ink, denoise, unshaded=True))
    say("preparing the page; the first time on a machine this takes a quarter of a minute.")
    from deskew.editor import PORT, Desk, Files, serve

    desk = Desk(opened.scan, Files(map_file, picture, scale), name, opened.find_leaf)
    if desk.taken_up is not None:
        say(f"going on with what {desk.taken_up} holds.")
    desk.look()

    def ready(address: str) -> None:
        say(f"the editor of {name} is at {address} (Ctrl-C ends it)")
        if browser:
            webbrowser.open(address)

    serve(desk, PORT if port is None else port, ready)


@dataclass(frozen=True, slots=True)
class _Opened:
    """A scan, and how to look for its second material, which only a capture tells."""

    scan: Scan
    find_leaf: Callable[[], Array] | None


def _open(source: Path, calibration: Path | None, how: Scanning) -> _Opened:
    """Scan a capture, or read a scan."""
    from deskew import io

    if source.suffix.lower() == _SUFFIX and not source.is_dir():
        require(calibration is None, "--calibration", "be left out for a scan", str(calibration))
        return _Opened(io.read_scan(source), None)
    if calibration is None:
        require(source.is_dir(), str(source), "be a capture folder or a scan.npz", "neither")
        require(False, "--calibration", "be given for a capture folder", "none")
    devices = io.read_calibration(Path(str(calibration)))
    scan = scan_page(source, devices, how)

    def find_leaf() -> Array:
        from deskew import pipeline

        return pipeline.find_leaf(scan, io.read_capture(source), devices)

    return _Opened(scan, find_leaf)
