"""What redrawn noise alone does to a figure, measured once; no worsening within it is a regression.

A rerun of the same trials gives the same bytes, so its own noise is nothing and says nothing of how far a harmless
change of the code may move a figure. Photographing the same pages with other noise does. A figure's value on page i
in draw r is modelled as a constant of the page, plus what the draw moves on all pages alike (its calibration), plus
what it moves on this page:

    x_ri = m_i + c_r + e_ri.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import StringIO
from math import inf, sqrt
from pathlib import Path
from typing import NamedTuple

from scipy import stats

from deskew.errors import InputError, require
from deskew.io.files import read_bytes
from deskew.types import Floats
from experiments.trials import unit_of

_COLUMNS = ("experiment", "condition", "method", "metric", "unit", "draws", "run_sd", "page_sd")
_DEVIATIONS = 3.0


class Figure(NamedTuple):
    """What is judged: a metric over the pages of one condition and method."""

    experiment: str
    condition: str
    method: str
    metric: str


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of one figure under redrawn noise, in its unit.

    Attributes
    ----------
    draws : int
        From how many draws they are estimated, at least 3.
    run_sd : float
        Of what a draw moves on all pages alike.
    page_sd : float
        Of what it moves on one page.
    """

    draws: int
    run_sd: float
    page_sd: float

    def __post_init__(self) -> None:
        require(self.draws >= 3, "draws", "be at least 3", self.draws)
        for name in ("run_sd", "page_sd"):
            value = getattr(self, name)
            require(0 <= value < inf, name, "be finite and not negative", value)

    def difference_sd(self, n_pages: int) -> float:
        """Return the standard deviation of the mean difference between two draws over so many pages."""
        return sqrt(2.0 * (self.run_sd**2 + self.page_sd**2 / n_pages))

    def floor(self, n_pages: int, slack: float) -> float:
        """Return the worsening of the mean below which nothing is called: 3 standard deviations, and the slack."""
        return max(slack, _DEVIATIONS * self.difference_sd(n_pages))

    def p_value(self, worsening: float, n_pages: int) -> float:
        """Return how probable noise alone makes a mean worsening by so much or more, by Student's t."""
        spread = self.difference_sd(n_pages)
        if spread == 0.0:
            return 0.0 if worsening > 0 else 1.0
        return float(stats.t.sf(worsening / spread, self.draws - 1))


def noise_of(values: Floats) -> Noise:
    """Estimate a figure's noise.

    Parameters
    ----------
    values : (R, N) array
        How bad the figure is in each of R draws, at least 3, on each of N pages.

    Returns
    -------
    Noise
        By the analysis of variance of two ways, draws and pages; a negative component is 0.
    """
    draws, pages = values.shape
    apart = values - values.mean(axis=0)
    means = apart.mean(axis=1)
    of_means = float(means.var(ddof=1))
    if pages == 1:
        return Noise(draws, sqrt(of_means), 0.0)
    of_pages = float(((apart - means[:, None]) ** 2).sum()) / ((draws - 1) * (pages - 1))
    return Noise(draws, sqrt(max(0.0, of_means - of_pages / pages)), sqrt(of_pages))


def floors_text(floors: Mapping[Figure, Noise]) -> str:
    """Return floors as CSV, sorted; numbers with six digits."""
    buffer = StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for figure, noise in sorted(floors.items()):
        sds = f"{noise.run_sd:.6g}", f"{noise.page_sd:.6g}"
        writer.writerow([*figure, unit_of(figure.metric), noise.draws, *sds])
    return buffer.getvalue()


def read_floors(path: Path) -> dict[Figure, Noise]:
    """Read floors that :func:`floors_text` made.

    Raises
    ------
    InputError
        If the file is none.
    """
    try:
        return dict(_parsed(csv.DictReader(StringIO(read_bytes(path).decode("utf-8"), newline=""))))
    except (ValueError, KeyError, TypeError, csv.Error) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"`{path}` must hold the floors of a baseline, got: {reason}.") from error


def _parsed(lines: Iterable[Mapping[str, str]]) -> Iterable[tuple[Figure, Noise]]:
    for line in lines:
        figure = Figure(line["experiment"], line["condition"], line["method"], line["metric"])
        yield figure, Noise(int(line["draws"]), float(line["run_sd"]), float(line["page_sd"]))
