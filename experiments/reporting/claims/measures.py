"""How a claim's figure is read off the reports: means, shares and comparisons of what trials recorded."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, log, nan
from pathlib import Path
from typing import Any, Protocol

from deskew.errors import InputError, in_one_line, require
from experiments.reporting.claims.rules import Figure
from experiments.reporting.statistics import share_interval, summarise
from experiments.trials.record import FAILED

Trials = Mapping[int, float]


class MissingError(Exception):
    """A report, or what a claim needs of it, is not there."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """The reports under a folder, each read once.

    Attributes
    ----------
    folder : Path
        Holds `REPORT/results.csv`, `timings.csv` and `run.json`.
    """

    folder: Path
    _tables: dict[tuple[str, str], Mapping[tuple[str, str, str], Trials]] = field(default_factory=dict, repr=False)

    def trials(self, report: str, condition: str, method: str, metric: str) -> Trials:
        """Return the value of each trial; of a time too. Empty where there are none.

        Raises
        ------
        MissingError
            If the report is not there.
        """
        kind = "timings" if metric.startswith("seconds_") else "results"
        return self._table(report, kind).get((condition, method, metric), {})

    def conditions(self, report: str, beginning: str) -> list[str]:
        """Return the conditions of the results that begin so, sorted."""
        found = {condition for condition, _, _ in self._table(report, "results") if condition.startswith(beginning)}
        return sorted(found)

    def n_trials(self, report: str) -> int:
        """Return how many trials a report was asked for: one more than the last that is in it."""
        return 1 + max((trial for values in self._table(report, "results").values() for trial in values), default=-1)

    def run(self, report: str) -> dict[str, Any]:
        """Return a report's `run.json`."""
        path = self.folder / report / "run.json"
        if not path.is_file():
            raise MissingError(report)
        try:
            found = json.loads(path.read_bytes())
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"`{path}` must be JSON, got {in_one_line(error)}.") from error
        require(isinstance(found, dict), str(path), "hold a JSON object", type(found).__name__)
        return dict(found)

    def _table(self, report: str, kind: str) -> Mapping[tuple[str, str, str], Trials]:
        if (report, kind) not in self._tables:
            path = self.folder / report / f"{kind}.csv"
            if not path.is_file():
                raise MissingError(report)
            self._tables[report, kind] = _read(path)
        return self._tables[report, kind]


def _read(path: Path) -> Mapping[tuple[str, str, str], Trials]:
    table: dict[tuple[str, str, str], dict[int, float]] = defaultdict(dict)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if None in row.values():
                    raise ValueError("a line cut short")
                table[row["condition"], row["method"], row["metric"]][int(row["trial"])] = float(row["value"])
    except (OSError, ValueError, KeyError, csv.Error) as error:
        raise InputError(f"`{path}` must be a results.csv or timings.csv, got {in_one_line(error)}.") from error
    return table


class Measure(Protocol):
    """What makes a figure out of the evidence."""

    def figure(self, evidence: Evidence) -> Figure:
        """Return the figure; raise a MissingError where it cannot be had."""

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""


@dataclass(frozen=True, slots=True)
class Values:
    """One metric of one condition and method.

    Attributes
    ----------
    report, condition, method, metric : str
        As in the report's `results.csv`, or its `timings.csv` for `seconds_...`.
    """

    report: str
    condition: str
    metric: str
    method: str = "-"

    def read(self, evidence: Evidence) -> Trials:
        """Return the value of each trial, at least one."""
        found = evidence.trials(self.report, self.condition, self.method, self.metric)
        if not found and not self.failed(evidence):
            raise MissingError(self.report)
        return found

    def failed(self, evidence: Evidence) -> int:
        """Return how many trials of the condition and method failed."""
        return len(evidence.trials(self.report, self.condition, self.method, FAILED))


@dataclass(frozen=True, slots=True)
class Mean:
    """Mean over the trials, with its bootstrap interval.

    Attributes
    ----------
    values : tuple of Values
        More than one for a sum, trial by trial.
    unit : str
        After scaling.
    digits : int
        Decimals shown.
    scale : float
        What the mean is multiplied by.
    """

    values: tuple[Values, ...]
    unit: str = ""
    digits: int = 3
    scale: float = 1.0

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return tuple(dict.fromkeys(values.report for values in self.values))

    def figure(self, evidence: Evidence) -> Figure:
        """Return the mean of the trials that have every value."""
        read = [values.read(evidence) for values in self.values]
        common = sorted(set.intersection(*(set(trials) for trials in read)))
        n_failed = max(values.failed(evidence) for values in self.values)
        sums = [self.scale * sum(trials[trial] for trials in read) for trial in common]
        return _mean(sums, n_failed, self.reports[0], self.unit, self.digits)


def _mean(values: Sequence[float], n_failed: int, report: str, unit: str, digits: int) -> Figure:
    if not values and not n_failed:
        raise MissingError(report)
    if not values:
        return Figure(nan, None, 0, unit, digits, n_failed)
    found = summarise(values)
    return Figure(found.mean, found.interval, found.n, unit, digits, n_failed)


@dataclass(frozen=True, slots=True)
class Share:
    """Share of the trials in which something holds, with Wilson's interval; in a failed trial it does not.

    Attributes
    ----------
    values : Values
        0 or 1 a trial, or a number.
    at_most : float or None
        Of a number, what it must not exceed.
    """

    values: Values
    at_most: float | None = None

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return (self.values.report,)

    def figure(self, evidence: Evidence) -> Figure:
        """Count the trials."""
        found, n_failed = self.values.read(evidence), self.values.failed(evidence)
        limit = self.at_most
        holds = [value == 1.0 if limit is None else value <= limit for value in found.values()]
        n = len(holds) + n_failed
        return Figure(sum(holds) / n, share_interval(sum(holds), n), n, n_failed=n_failed, share=True)


@dataclass(frozen=True, slots=True)
class Fraction:
    """Mean over the trials of the percentage of a trial's conditions in which something holds.

    Attributes
    ----------
    report, beginning, method, metric : str
        A metric that is 0 or 1, of all conditions that begin so.
    unless : str
        A metric that leaves a condition of a trial out where it is 1; "" for none.
    """

    report: str
    beginning: str
    method: str
    metric: str
    unless: str = ""

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return (self.report,)

    def figure(self, evidence: Evidence) -> Figure:
        """Return the mean percentage."""
        of_trial: dict[int, list[float]] = defaultdict(list)
        n_failed = 0
        for condition in evidence.conditions(self.report, self.beginning):
            read = (
                evidence.trials(self.report, condition, self.method, metric) for metric in (self.metric, self.unless)
            )
            holds, left_out = read
            for trial, value in holds.items():
                if left_out.get(trial) != 1.0:
                    of_trial[trial].append(100.0 * value)
            n_failed += len(evidence.trials(self.report, condition, self.method, FAILED))
        means = [sum(values) / len(values) for _, values in sorted(of_trial.items())]
        return _mean(means, n_failed, self.report, "%", 1)


@dataclass(frozen=True, slots=True)
class Compared:
    """Two metrics of the same trials: by default how many times the first is the second, in the geometric mean.

    Attributes
    ----------
    values, other : Values
        Those of the same trial are compared.
    difference : bool
        The mean of the first minus the second instead.
    unit : str
        Of a difference.
    digits : int
        Decimals shown.
    """

    values: Values
    other: Values
    difference: bool = False
    unit: str = ""
    digits: int = 2

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return tuple(dict.fromkeys((self.values.report, self.other.report)))

    def figure(self, evidence: Evidence) -> Figure:
        """Compare trial by trial."""
        first, second = self.values.read(evidence), self.other.read(evidence)
        pairs = [(first[trial], second[trial]) for trial in sorted(set(first) & set(second))]
        n_failed = max(self.values.failed(evidence), self.other.failed(evidence))
        if self.difference:
            return _mean([a - b for a, b in pairs], n_failed, self.values.report, self.unit, self.digits)
        logs = _mean([log(a / b) for a, b in pairs], n_failed, self.values.report, "", self.digits)
        ends = None if logs.interval is None else (exp(logs.interval[0]), exp(logs.interval[1]))
        return Figure(exp(logs.value), ends, logs.n, "times", self.digits, n_failed)


@dataclass(frozen=True, slots=True)
class Per:
    """How often a mean goes into a number."""

    number: float
    mean: Mean
    unit: str = ""
    digits: int = 0

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return self.mean.reports

    def figure(self, evidence: Evidence) -> Figure:
        """Divide the number by the mean."""
        found = self.mean.figure(evidence)
        ends = None if found.interval is None else (self.number / found.interval[1], self.number / found.interval[0])
        return Figure(self.number / found.value, ends, found.n, self.unit, self.digits, found.n_failed)
