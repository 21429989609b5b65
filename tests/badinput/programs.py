"""The experiments and what reads their files: configuration, references, given sheets and meshes, tables, seeds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from deskew.types import Array
from tests.badinput.case import Break, Case, edited, written
from tests.badinput.forged import npz_that_declares
from tests.badinput.places import pipe
from tests.badinput.samples import TABLE, sheet_arrays

RUN = "experiments experiment={} budget=smoke engine=serial out=new "
SURFACES, SHEETS = RUN.format("surfaces"), RUN.format("corner_distance") + "sheet.paths=[sheet.npz]"
AGREE = "experiments.reporting.agreement {} reports/surfaces/results.csv"


def config(what: str, override: str, *words: str) -> Case:
    """A configuration that is refused."""
    return Case(what, f"{SURFACES} {override}", words)


def sheet(what: str, change: Callable[[dict[str, Array]], object], *words: str) -> Case:
    """A given sheet that could be no page."""

    def write(here: Path) -> None:
        arrays = sheet_arrays()
        change(arrays)
        np.savez(here / "sheet.npz", **arrays)  # type: ignore[arg-type]

    return Case(what, SHEETS, ("sheet.npz", *words), write)


def table(what: str, text: str | bytes, *words: str) -> Case:
    """A table of results that cannot be compared."""
    return Case(what, AGREE.format("a.csv"), ("`a.csv`", *words), written("a.csv", text))


def claims(what: str, broken: Break, *words: str) -> Case:
    """Reports from which no page of claims can be made."""
    return Case(what, "experiments.reporting.claims reports", words, broken)


CONFIGURATIONS = (
    Case("no experiment", "experiments", ("`experiment`", "one of ablations", "nothing")),
    Case("an unknown experiment", "experiments experiment=surface", ("`experiment`", "surfaces", "'surface'")),
    config("trials below one", "trials=0", "`trials`", "[1, 100000]", "0"),
    config("added noise of NaN", "surfaces.noise_mm=nan", "`surfaces.noise_mm`", "[0, 10]", "nan"),
    config("a list where a number is due", "mesh.rows=[1,2]", "`mesh.rows`", "[2, 1000]", "[1, 2]"),
    config("an override that cannot be parsed", "'trials=[[['", "`trials=[[[`", "KEY=VALUE"),
    config("an override nested 3000 deep", "trials=" + "[" * 3000 + "]" * 3000, "nested less deeply"),
    config("a value for the environment", "'out=${oc.env:DESKEW_NO_SUCH}'", "DESKEW_NO_SUCH"),
    config("a number from the environment", "'trials=${oc.env:HOME}'", "`trials`", "[1, 100000]"),
    config("a reference to itself", "'trials=${trials}'", "`trials`"),
    config("a resolver that is not there", "'seed=${eval:1+1}'", "`seed`"),
    config("a choice by a budget that is not there", "'trials=${at:huge,1,2,3}'", "`trials`"),
    config("a decoded bomb", "'trials=${oc.decode:${oc.env:PATH}}'", "KEY=VALUE"),
    config("a method that is not there", "method=no.such:thing", "`method`", "no.such:thing"),
    config("a rerun from a pickle", "--experimental-rerun bent.obj", "--experimental-rerun", "unpickle"),
    config("another folder of configuration", "--config-dir /proc/none", "config"),
    config("reports below a file", "out=c.json/new", "`out`", "c.json"),
    config("reports in a folder of the kernel's", "out=/proc/new", "`out`", "/proc/new"),
    config("an output with a line break", "'out=\"a\nb\"'", "`out`", "line breaks"),
    Case(
        "a store that is none",
        f"{SURFACES} out=theirs",
        ("`out`", "theirs/results.sqlite"),
        written("theirs/results.sqlite", b"SQLite format 3\0" + bytes(4000)),
    ),
    config("a given mesh that is not there", "surfaces.paths=[no.obj]", "surfaces.paths", "no.obj"),
    config("a mesh in another format", "surfaces.paths=[c.json]", "`surfaces.paths`", "OBJ or PLY"),
    Case(
        "a mesh that is a pipe for an experiment",
        f"{SURFACES} surfaces.paths=[a.obj]",
        ("surfaces.paths", "a.obj"),
        pipe("a.obj"),
    ),
    Case(
        "captures that are not the real boards",
        RUN.format("real_boards") + "real_boards.path=board",
        ("real_boards.path", "SHA-256"),
    ),
    Case(
        "no folder of photographs", RUN.format("ocr_misses") + "ocr.real_path=c.json", ("ocr.real_path", "be a folder")
    ),
    Case(
        "no reading machine", RUN.format("ocr_misses"), ("`ocr.engine`", "Install"), absent=("tesserocr", "pytesseract")
    ),
    Case(
        "not the reading machine that is asked for",
        RUN.format("ocr_misses") + "ocr.engine=tesserocr",
        ("`ocr.engine`", "tesserocr"),
        absent=("tesserocr",),
    ),
    Case(
        "no SLURM",
        SURFACES.replace("engine=serial", "engine=slurm"),
        ("`engine.cluster`", "sbatch"),
        environment={"PATH": "/nowhere"},
    ),
    Case("no Ray", SURFACES.replace("engine=serial", "engine=ray"), ("engine",), absent=("ray",)),
)

SHEETS_GIVEN = (
    sheet("a sheet without F", lambda a: a.pop("F"), "V (h, w, 3) and F (h, w, 2)"),
    sheet("a sheet of NaN", lambda a: a["V"].fill(np.nan), "V", "finite"),
    sheet("a sheet of one row", lambda a: a.update(V=a["V"][:1], F=a["F"][:1]), "h, w >= 2"),
    sheet("a sheet of other grids", lambda a: a.update(F=a["F"][:-1]), "F", "as V has"),
    sheet("a sheet 10 km away", lambda a: a.update(V=a["V"] + 1e7), "1000 mm"),
    sheet("a sheet of another page", lambda a: a.update(F=2 * a["F"]), "span the page"),
    sheet("a sheet stretched to twice its size", lambda a: a.update(V=2 * a["V"]), "lengths", "100%"),
    sheet("a sheet of texts", lambda a: a.update(V=np.array(["a", "b"])), "hold numbers"),
    Case(
        "a sheet of objects",
        SHEETS,
        ("sheet.npz", "hold numbers"),
        lambda here: np.savez(here / "sheet.npz", V=np.array([{}], dtype=object)),
    ),
    Case(
        "a sheet that is a bomb",
        SHEETS,
        ("sheet.npz", "unpack to at most"),
        lambda here: (here / "sheet.npz").write_bytes(npz_that_declares(1 << 40)),
    ),
    Case("a sheet that is not there", SHEETS, ("`sheet.npz`", "be a file"), lambda here: (here / "sheet.npz").unlink()),
    Case("fewer sheets than trials", f"{SHEETS} trials=2", ("`trials`", "at most 1", "2")),
)

TABLES = (
    table("an empty table", "", "results.csv"),
    table("a table without its columns", "a,b\n1,2\n", "results.csv"),
    table("a table with a row twice", TABLE + TABLE.splitlines()[1] + "\n", "each row once"),
    table("a table of words for numbers", TABLE.replace("0.25", "much"), "results.csv"),
    table("a table of bytes", bytes(range(256)) * 9, "results.csv"),
    table("a table with an open quotation", TABLE + '"' + "x" * 100, "results.csv"),
    table("a table of ragged rows", TABLE + "1,2,3,4,5,6,7,8,9,10,11\n", "results.csv"),
    Case("a table that is not there", AGREE.format("no.csv"), ("no.csv",)),
    Case("a folder and a table", AGREE.format("reports"), ()),
    Case("one table alone", "experiments.reporting.agreement a.csv", ("two files or two folders", "1")),
    claims(
        "claims of a table of words",
        edited("reports/corner_distance/results.csv", "0.25", "much"),
        "`reports/corner_distance/results.csv`",
        "much",
    ),
    claims(
        "claims of a table without its columns",
        written("reports/corner_distance/results.csv", "a,b\n1,2\n"),
        "`reports/corner_distance/results.csv`",
    ),
    claims(
        "claims of a table with a line cut short",
        written("reports/corner_distance/results.csv", TABLE + "corner_distance,control,-,0,1"),
        "`reports/corner_distance/results.csv`",
        "cut short",
    ),
    Case("claims of no folder", "experiments.reporting.claims nowhere", ("`REPORTS_FOLDER`", "be a folder", "nowhere")),
    Case(
        "seeds by a digest that is none",
        "experiments.hidden_seeds check seeds.txt 123",
        ("`SHA256`", "64 hexadecimal digits", "123"),
    ),
    Case("seeds without number", "experiments.hidden_seeds draw new.txt 0", ("`COUNT`", "[1, 1000]", "0")),
    Case("a number of seeds that is no number", "experiments.hidden_seeds draw new.txt 1e3", ("`COUNT`", "1e3")),
    Case("10^5000 seeds", f"experiments.hidden_seeds draw new.txt {'9' * 5000}", ("`COUNT`", "[1, 1000]")),
    Case("no command for seeds", "experiments.hidden_seeds", ("draw FILE",)),
    Case("an unknown option for the generated pages", "experiments.reporting.generated --chek", ("--check",)),
)

GATE = "experiments.gate --baseline baseline.csv --results reports/surfaces/results.csv"
PAGE = "experiments.page --reports reports --out out/page.html"
JUDGED = (
    Case("a baseline that is not there", GATE.replace("baseline.csv", "no.csv"), ("`no.csv`", "be a file")),
    Case("a baseline that is a pipe", GATE, ("`baseline.csv`", "be a file"), pipe("baseline.csv")),
    Case("a baseline of words", GATE, ("`baseline.csv`", "much"), edited("baseline.csv", "0.25", "much")),
    Case("a baseline of NaN", GATE, ("`baseline.csv`", "finite", "nan"), edited("baseline.csv", "0.25", "nan")),
    Case("a baseline of other columns", GATE, ("`baseline.csv`", "columns"), written("baseline.csv", "a,b\n1,2\n")),
    Case("a baseline of nothing known", GATE, ("`baseline.json`",), written("baseline.json", "[" * 100_000)),
    Case(
        "a baseline of another version", GATE, ("`baseline.json`", "version 9"), edited("baseline.json", ": 1,", ": 9,")
    ),
    Case("floors of words", GATE, ("`baseline.floors.csv`", "much"), edited("baseline.floors.csv", "0.01", "much")),
    Case(
        "results of bytes for the gate",
        GATE,
        ("results.csv",),
        written("reports/surfaces/results.csv", bytes(range(256))),
    ),
    Case("a page of no reports", PAGE.replace("reports reports", "reports out"), ("`--reports`", "run.json", "none")),
    Case("a page of a damaged run", PAGE, ("reports/surfaces",), written("reports/surfaces/run.json", "[" * 100_000)),
    Case(
        "a page of a run of nothing known",
        PAGE,
        ("`reports/surfaces`", "experiment"),
        written("reports/surfaces/run.json", "{}"),
    ),
    Case("a page of a run that is a pipe", PAGE, ("run.json",), pipe("reports/surfaces/run.json")),
    Case(
        "a page of words for numbers",
        PAGE,
        ("reports/surfaces", "much"),
        edited("reports/surfaces/results.csv", "0.25", "much"),
    ),
    Case("a page into another format", PAGE.replace(".html", ".pdf"), (".html", ".pdf")),
    Case(
        "an editor of no capture",
        "deskew edit nowhere -c c.json -o out/m.png --no-browser",
        ("`nowhere`", "be a folder"),
    ),
    Case(
        "an editor of a capture without its devices",
        "deskew edit page -o out/m.png --no-browser",
        ("`--calibration`", "none"),
    ),
    Case(
        "an editor of a damaged scan",
        "deskew edit scan.npz -o out/m.png --no-browser",
        ("`scan.npz`",),
        written("scan.npz", b""),
    ),
    Case(
        "an editor of a map in another format",
        "deskew edit scan.npz -o out/m.tif --no-browser",
        ("end in .png", ".tif"),
    ),
    Case(
        "an editor on port 65536",
        "deskew edit scan.npz -o out/m.png --port 65536 --no-browser",
        ("`--port`", "[0, 65535]"),
    ),
)

CASES: tuple[Case, ...] = CONFIGURATIONS + SHEETS_GIVEN + TABLES + JUDGED
