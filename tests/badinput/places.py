"""Places that cannot be read or written: folders, pipes, devices, full disks, names that are no names; and options."""

from __future__ import annotations

import os
from pathlib import Path

from tests.badinput.case import Break, Case, written


def pipe(name: str) -> Break:
    """Return what puts a named pipe, into which nobody writes, in a file's place."""

    def make(here: Path) -> None:
        (here / name).unlink(missing_ok=True)
        os.mkfifo(here / name)

    return make


INPUTS = (
    Case(
        "a mesh that is a pipe",
        "deskew flatten a.obj -o out/f.ply",
        ("`a.obj`", "be a file", "something else"),
        pipe("a.obj"),
    ),
    Case("a scan that is a pipe", "deskew restore a.npz -o out/r.png", ("`a.npz`", "be a file"), pipe("a.npz")),
    Case(
        "a calibration that is a pipe",
        "deskew run page -c c.json -o out/r.png",
        ("`c.json`", "be a file"),
        pipe("c.json"),
    ),
    Case(
        "a frame that is a pipe",
        "deskew scan sweep -c c.json -o out/s.npz",
        ("`sweep/columns/0002.png`", "be a file"),
        pipe("sweep/columns/0002.png"),
    ),
    Case(
        "a capture.toml that is a pipe",
        "deskew run page -c c.json -o out/r.png",
        ("`page/capture.toml`", "be a file"),
        pipe("page/capture.toml"),
    ),
    Case(
        "a light's picture that is a pipe",
        "deskew run page -c c.json -o out/r.png",
        ("`page/textures/uv.png`", "be a file"),
        pipe("page/textures/uv.png"),
    ),
    Case("a picture that is a pipe", "deskew score a.png --truth grey.png", ("`a.png`", "be a file"), pipe("a.png")),
    Case(
        "a table of results that is a pipe",
        "experiments.reporting.agreement reports/surfaces/results.csv a.csv",
        ("`a.csv`",),
        pipe("a.csv"),
    ),
    Case(
        "seeds that are a pipe",
        f"experiments.hidden_seeds check a.txt {'0' * 64}",
        ("`a.txt`", "be a file"),
        pipe("a.txt"),
    ),
    Case("a calibration that is /dev/zero", "deskew run page -c /dev/zero -o out/r.png", ("`/dev/zero`", "be a file")),
    Case(
        "a mesh that is a link to /dev/zero",
        "deskew flatten a.obj -o out/f.ply",
        ("`a.obj`", "be a file"),
        lambda here: (here / "a.obj").symlink_to("/dev/zero"),
    ),
    Case(
        "a mesh that is a link to nowhere",
        "deskew flatten a.obj -o out/f.ply",
        ("`a.obj`", "be a file"),
        lambda here: (here / "a.obj").symlink_to("nowhere"),
    ),
    Case(
        "a mesh that is a link to itself",
        "deskew flatten a.obj -o out/f.ply",
        ("`a.obj`", "be a file"),
        lambda here: (here / "a.obj").symlink_to("a.obj"),
    ),
    Case(
        "a mesh of the kernel's memory",
        "deskew flatten a.obj -o out/f.ply",
        ("`a.obj`",),
        lambda here: (here / "a.obj").symlink_to("/proc/self/mem"),
    ),
    Case("a mesh of a name too long", f"deskew flatten {'x' * 300}.obj -o out/f.ply", ("be a file", "nothing there")),
    Case("a mesh of an empty name", "deskew flatten '' -o out/f.ply", ("--voxel",)),
    Case("a name with a line break and an escape", "deskew flatten $'a\n\x1b[31mred.obj' -o out/f.ply", ("be a file",)),
)

OUTPUTS = (
    Case(
        "an output in a folder that is not there",
        "deskew flatten bent.obj -o no/f.ply",
        ("`no/f.ply`", "existing folder"),
    ),
    Case("an output below a file", "deskew flatten bent.obj -o c.json/f.ply", ("`c.json/f.ply`", "existing folder")),
    Case(
        "an output that is a folder",
        "deskew flatten bent.obj -o f.ply",
        ("`f.ply`", "a folder"),
        lambda here: (here / "f.ply").mkdir(),
    ),
    Case(
        "an output without a suffix", "deskew flatten bent.obj -o out/flat", ("`out/flat`", ".obj or .ply", "no suffix")
    ),
    Case("an output in another format", "deskew restore scan.npz -o out/r.jpg", (".png or .tif", ".jpg")),
    Case("an output of an empty name", "deskew flatten bent.obj -o ''", ("end in",)),
    Case(
        "an output of a name too long", f"deskew restore scan.npz -o out/{'x' * 300}.png", ("at most 255 bytes", "304")
    ),
    Case(
        "an output in a folder of the kernel's",
        "deskew restore scan.npz -o /proc/r.png",
        ("`/proc/r.png`", "writable folder"),
        code=3,
    ),
    Case("a calibration into a folder of the kernel's", "deskew calibrate board -o /proc/c.json", (), code=3),
    Case(
        "an example into a folder of the kernel's",
        "data_synth.captures /proc/example --pattern gray_code",
        ("`/proc/example`", "writable folder"),
        code=3,
    ),
    Case("an example over somebody's folder", "data_synth.captures page", ("`page`", "new or an empty folder")),
    Case("an example over a file", "data_synth.captures c.json", ("`c.json`", "new or an empty folder", "a file")),
    Case("an example in a folder that is not there", "data_synth.captures no/example", ("existing folder",)),
    Case("seeds over somebody's file", "experiments.hidden_seeds draw seeds.txt", ("`seeds.txt`", "not be there")),
    Case(
        "seeds into a folder of the kernel's", "experiments.hidden_seeds draw /proc/s.txt", ("`/proc/s.txt`",), code=3
    ),
    Case(
        "a disk full of a restored page",
        "deskew restore scan.npz -o out/r.png",
        ("`out/r.png`", "large", "room"),
        code=3,
        file_bytes=100,
    ),
    Case(
        "a disk full of a mesh",
        "deskew flatten bent.obj -o out/f.ply --method arap",
        ("`out/f.ply`", "room"),
        code=3,
        file_bytes=100,
    ),
    Case(
        "a disk full of a scan",
        "deskew scan rendered -c rendered.json -o out/s.npz --mask whole.png",
        ("`out/s.npz`", "room"),
        code=3,
        file_bytes=4000,
    ),
    Case(
        "a disk full of two pictures",
        "deskew restore scan.npz -o out/r.tif -l white -l uv",
        ("out/r-", "room"),
        code=3,
        file_bytes=99,
    ),
    Case(
        "a disk full of an example",
        "data_synth.captures out/example --pattern gray_code",
        ("`out/example/page_00`", "room"),
        code=3,
        file_bytes=20_000,
    ),
    Case(
        "a disk full of claims", "experiments.reporting.claims reports", ("CLAIMS.md", "room"), code=3, file_bytes=100
    ),
)

OPTIONS = (
    Case("no command", "deskew", ("--help",)),
    Case("an unknown command", "deskew flaten bent.obj", ("flaten", "--help")),
    Case("an unknown option", "deskew flatten bent.obj -o out/f.ply --metod arap", ("--metod", "--help")),
    Case("no output", "deskew flatten bent.obj", ("--output", "--help")),
    Case("an option without its value", "deskew flatten bent.obj -o", ("-o", "--help")),
    Case("an argument too many", "deskew flatten bent.obj unit.obj -o out/f.ply", ("unit.obj", "--help")),
    Case("no captures", "deskew accuracy -c c.json", ("CAPTURE", "--help")),
    Case(
        "a shape of one vertex",
        "deskew scan page -c c.json -o out/s.npz --shape 1 45",
        ("`--shape`", "2 to 1000", "1 45"),
    ),
    Case(
        "a shape of 10^9 vertices",
        "deskew run page -c c.json -o out/r.png --shape 1000000000 2",
        ("`--shape`", "2 to 1000"),
    ),
    Case("a shape of words", "deskew scan page -c c.json -o out/s.npz --shape a b", ("--shape", "integer", "got a b")),
    Case("a shape of one number", "deskew scan page -c c.json -o out/s.npz --shape 45", ("--shape",)),
    Case("a scale of NaN", "deskew restore scan.npz -o out/r.png --scale nan", ("`--scale`", "(0, 16]", "nan")),
    Case("a scale of 1e999", "deskew restore scan.npz -o out/r.png --scale 1e999", ("`--scale`", "(0, 16]", "inf")),
    Case("a scale below zero", "deskew restore scan.npz -o out/r.png --scale -1", ("`--scale`", "(0, 16]", "-1")),
    Case("noise of NaN", "deskew flatten bent.obj -o out/f.ply --noise nan", ("`--noise`", "[0, 1000] mm", "nan")),
    Case("noise that is a word", "deskew flatten bent.obj -o out/f.ply --noise much", ("`--noise`", "auto", "much")),
    Case(
        "noise of a method that knows none",
        "deskew flatten bent.obj -o out/f.ply --noise 1 --method arap",
        ("`--noise`", "left out"),
    ),
    Case("a voxel for a mesh in mm", "deskew flatten bent.obj -o out/f.ply --voxel 1", ("`--voxel`", "left out")),
    Case("an unknown method", "deskew flatten bent.obj -o out/f.ply -m sprung", ("spring", "'sprung'")),
    Case(
        "a method of the operating system", "deskew flatten bent.obj -o out/f.ply -m os:system", ("os:system",), code=3
    ),
    Case(
        "a method that is code",
        "deskew flatten bent.obj -o out/f.ply -m \"__import__('os').system('touch RUN'):x\"",
        ("method",),
    ),
    Case(
        "a method of a module that is not there",
        "deskew flatten bent.obj -o out/f.ply -m no.such:thing",
        ("no.such:thing",),
    ),
    Case(
        "a function that its module lacks",
        "deskew flatten bent.obj -o out/f.ply -m json:missing",
        ("function in json", "json:missing"),
    ),
    Case("a method that is no function", "deskew flatten bent.obj -o out/f.ply -m math:pi", ("function in math",)),
    Case("a method that leaves the package", "deskew flatten bent.obj -o out/f.ply -m ../x:f", ("../x:f",)),
    Case(
        "a method whose module exits",
        "deskew flatten bent.obj -o out/f.ply -m exits:f",
        ("exits:f", "SystemExit"),
        written("exits.py", "raise SystemExit(0)\n"),
    ),
    Case(
        "a light that the scan has not",
        "deskew restore scan.npz -o out/r.png -l infrared",
        ("`--light`", "uv", "infrared"),
    ),
    Case("a ratio by a light that is not there", "deskew restore scan.npz -o out/r.png --combine ratio:uv/ir", ("ir",)),
    Case("an unknown combination", "deskew restore scan.npz -o out/r.png --combine median", ("median",)),
    Case(
        "a free scale without a map",
        "deskew restore scan.npz -o out/r.png --free-scale",
        ("`--free-scale`", "--stiffness"),
    ),
    Case("a seed below zero", "data_synth.captures out/x --seed -1", ("`seed`", "at least 0", "-1")),
    Case("a seed that is a word", "data_synth.captures out/x --seed one", ("--seed", "'one'")),
    Case("no pages", "data_synth.captures out/x --pages 0", ("`n_pages`", "[1, 100]", "0")),
    Case("a slope of NaN", "data_synth.captures out/x --slope-p90-deg nan", ("`slope_p90_deg`", "[1, 45]", "nan")),
    Case("two boards", "data_synth.captures out/x --poses 2", ("[3, 12]", "2")),
    Case("a pattern unknown", "data_synth.captures out/x --pattern sine", ("--pattern", "sine", "line_sweep")),
)

CASES: tuple[Case, ...] = INPUTS + OUTPUTS + OPTIONS
