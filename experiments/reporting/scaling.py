"""The tables of docs/scaling.md: reckoned from measurements, so that no figure in them is typed by hand.

What stands between `<!-- NAME -->` and `<!-- end -->` is the table of that name below, of docs/scaling.csv, which
``python -m experiments.scaling`` measures, and of the reports' `timings.csv`.
"""

from __future__ import annotations

import csv
import math
import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median

from deskew.errors import InputError

_BLOCK = re.compile(r"(<!-- (?P<name>[a-z]+) -->\n).*?(<!-- end -->)", re.DOTALL)
_PATTERNS = {"line_sweep": "line sweep", "gray_code": "Gray code"}
_PAGES_A_DAY = (100, 10_000)
_SECONDS_A_DAY = 86_400
# What a machine-vision camera of 640 x 480 pixels gives at the least.
_FRAMES_A_SECOND = 30.0
_EXPERIMENTS = ("plane_accuracy", "corner_distance", "ocr_misses", "stiffness", "textures")

Cells = Sequence[str]


@dataclass(frozen=True, slots=True)
class Measured:
    """What the tables are made of.

    Attributes
    ----------
    values : mapping of (subject, case, quantity) to list of float
        The lines of docs/scaling.csv.
    reports : Path
        Folder of the reports.
    """

    values: dict[tuple[str, str, str], list[float]]
    reports: Path

    @classmethod
    def read(cls, path: Path, reports: Path) -> Measured:
        """Read docs/scaling.csv."""
        values = defaultdict[tuple[str, str, str], list[float]](list)
        with path.open(newline="") as file:
            for line in csv.DictReader(file):
                values[line["subject"], line["case"], line["quantity"]].append(float(line["value"]))
        return cls(dict(values), reports)

    def of(self, subject: str, case: str, quantity: str) -> float:
        """Return the median of what was measured."""
        return median(self.values[subject, case, quantity])


def _page(measured: Measured) -> list[Cells]:
    """Say what the commands cost for one page, or one calibration."""
    rows: list[Cells] = [("pattern", "command", "CPU [s]", "wall clock [s]", "peak [MB]")]
    for pattern, name in _PATTERNS.items():
        for command in ("start", "scan", "restore", "run", "calibrate"):
            cpu, wall, peak = (measured.of(pattern, command, q) for q in ("seconds_cpu", "seconds_wall", "peak_mb"))
            said = "(any, to its help)" if command == "start" else f"`deskew {command}`"
            rows.append((name, said, f"{cpu:.1f}", f"{wall:.1f}", f"{peak:.0f}"))
    return rows


def _bytes(measured: Measured) -> list[Cells]:
    """Say what lies on disk."""
    rows: list[Cells] = [("pattern", "pictures a page", "page [MB]", "board [MB]", "scan.npz [MB]", "restored [MB]")]
    for pattern, name in _PATTERNS.items():
        sizes = [measured.of(pattern, case, "bytes") / 1e6 for case in ("page", "board", "scan", "restored")]
        frames = measured.of(pattern, "page", "frames")
        rows.append((name, f"{frames:.0f}", *(f"{size:.1f}" for size in sizes)))
    return rows


def _needs(measured: Measured) -> list[Cells]:
    """Say what so many pages a day ask for, each by `deskew run` on its stored capture."""
    rows: list[Cells] = [
        ("pages a day", "pattern", "CPU [h]", "cores", "memory [GB]", "captures [GB a day]", "cameras at 30 frames/s")
    ]
    for pages in _PAGES_A_DAY:
        for pattern, name in _PATTERNS.items():
            cpu = pages * measured.of(pattern, "run", "seconds_cpu")
            cores = math.ceil(cpu / _SECONDS_A_DAY / _efficiency(measured))
            memory = cores * measured.of(pattern, "run", "peak_mb") / 1e3
            disk = pages * measured.of(pattern, "page", "bytes") / 1e9
            cameras = math.ceil(pages * measured.of(pattern, "page", "frames") / _FRAMES_A_SECOND / _SECONDS_A_DAY)
            numbers = (f"{cpu / 3600.0:.1f}", f"{cores}", f"{memory:.1f}", f"{disk:.1f}", f"{cameras}")
            rows.append((f"{pages:,}", name, *numbers))
    return rows


def _efficiency(measured: Measured) -> float:
    """Return the speed of two cores over twice that of one."""
    one, two = (measured.of("surfaces", f"workers={n}", "seconds_wall") for n in (1, 2))
    return one / two / 2.0


def _cores(measured: Measured) -> list[Cells]:
    """Say how two workers compare with one, from the command to the report."""
    one, two = (measured.values["surfaces", f"workers={n}", "seconds_wall"] for n in (1, 2))
    n_trials = measured.of("surfaces", "trials", "count")
    store = f"{measured.of('surfaces', 'store', 'bytes') / n_trials / 1e3:.1f}"
    rows: list[Cells] = [("experiment", "trials", "1 worker [s]", "2 workers [s]", "faster", "store [kB a trial]")]
    rows += [
        ("`surfaces`", f"{n_trials:.0f}", f"{a:.1f}", f"{b:.1f}", f"{a / b:.2f}x", store)
        for a, b in zip(one, two, strict=True)
    ]
    return rows


def _engines(measured: Measured) -> list[Cells]:
    """Say what engines cost beside the trials themselves: 200 trials that do nothing, by two workers."""
    rows: list[Cells] = [("engine", "to the first trial [s]", "each further trial [ms]", "all in all, a trial [ms]")]
    for name, said in (
        ("serial", "serial"),
        ("processes", "processes"),
        ("ray", "ray, started here"),
        ("slurm", "slurm, local jobs"),
    ):
        start, rest = (measured.of("engine", name, quantity) for quantity in ("seconds_start", "seconds_trials"))
        rows.append((said, f"{start:.1f}", f"{rest / 199 * 1e3:.0f}", f"{(start + rest) / 200 * 1e3:.0f}"))
    return rows


def _trials(measured: Measured) -> list[Cells]:
    """Say what a trial of the committed reports took, by stage, all its methods together."""
    rows: list[Cells] = [
        ("experiment", "trials", "prepared once [s]", "a trial [s]", "of which", "peak [MB]", "report [MB]")
    ]
    for experiment in _EXPERIMENTS:
        folder = measured.reports / experiment
        with (folder / "timings.csv").open(newline="") as file:
            lines = list(csv.DictReader(file))
        n_trials = len({line["trial"] for line in lines})
        stages = defaultdict[str, float](float)
        for line in lines:
            if line["metric"].startswith("seconds_"):
                stages[line["metric"].removeprefix("seconds_")] += float(line["value"])
        prepared = stages.pop("prepare", 0.0)
        longest = sorted(stages, key=lambda name: -stages[name])
        shares = ", ".join(f"{name} {stages[name] / n_trials:.1f}" for name in longest[:4])
        peak = fmean(float(line["value"]) for line in lines if line["metric"] == "peak_mb")
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.suffix in (".png", ".csv", ".md", ".json"))
        total = f"{sum(stages.values()) / n_trials:.1f}"
        rows.append(
            (f"`{experiment}`", f"{n_trials}", f"{prepared:.0f}", total, shares, f"{peak:.0f}", f"{size / 1e6:.1f}")
        )
    return rows


TABLES: dict[str, Callable[[Measured], list[Cells]]] = {
    "page": _page,
    "bytes": _bytes,
    "needs": _needs,
    "cores": _cores,
    "engines": _engines,
    "trials": _trials,
}


def with_figures(text: str, measured: Measured) -> str:
    """Return the document's text with each marked block filled.

    Raises
    ------
    InputError
        If a block names no table.
    """

    def filled(block: re.Match[str]) -> str:
        if block["name"] not in TABLES:
            raise InputError(f"`docs/scaling.md` must name one of {', '.join(TABLES)}, got {block['name']}.")
        head, *rows = TABLES[block["name"]](measured)
        lines = [head, ["---"] * len(head), *rows]
        return block[1] + "".join(f"| {' | '.join(cells)} |\n" for cells in lines) + block[3]

    return _BLOCK.sub(filled, text)
