"""The command: judge a rerun, or look after a baseline."""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NoReturn

from deskew.errors import DeskewError, InputError, require
from experiments.gate.baseline import Baseline, read_baseline
from experiments.gate.report import junit, markdown, write_all
from experiments.gate.rerun import Rerun, require_same_settings, rerun, stored, with_method_named
from experiments.gate.upkeep import derive, record, redraw
from experiments.gate.verdict import Judgement, judge

HOLDS, REGRESSION, CANNOT_JUDGE = 0, 1, 2

_EPILOG = """\
exit code: 0 the baseline holds (or is bettered), 1 a regression, 2 cannot judge

  python -m experiments.gate --baseline reports/baseline/smoke.csv
  python -m experiments.gate --baseline reports/baseline/smoke.csv --method own.module:flatten --junit gate.xml
  python -m experiments.gate --baseline reports/baseline/smoke.csv --results out/a/results.csv out/b/results.csv

looking after a baseline:

  python -m experiments.gate record --baseline NAME.csv ['experiment=... trials=4 ...' ...]
  python -m experiments.gate redraw --baseline NAME.csv --draws 101-110 --table redrawn.csv.gz
  python -m experiments.gate derive --baseline NAME.csv --draws 101-110 --table redrawn.csv.gz
"""


class _Parser(argparse.ArgumentParser):
    """One line instead of the usage, and no exit."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"The arguments must be as --help says, got: {message}.")


def main(arguments: Sequence[str]) -> int:
    """Run ``python -m experiments.gate ARGUMENTS``.

    Returns
    -------
    int
        0 if the baseline holds, 1 for a regression, 2 if nothing can be judged.
    """
    tasks = {"record": _record, "redraw": _redraw, "derive": _derive}
    try:
        if arguments and arguments[0] in tasks:
            tasks[arguments[0]](arguments[1:])
            return HOLDS
        return _judge(arguments)
    except (DeskewError, OSError) as error:
        if str(error):  # a run that was refused has said why
            print(" ".join(str(error).split()), file=sys.stderr)
    except KeyboardInterrupt:
        print("Interrupted before a verdict.", file=sys.stderr)
    except Exception:
        # Python would end with 1, which here means a regression.
        traceback.print_exc()
    return CANNOT_JUDGE


def _judge(arguments: Sequence[str]) -> int:
    parser = _parser("Whether the present code, or a method, is worse than a baseline on the same pages.", _EPILOG)
    parser.add_argument("--method", help="package.module:function in the place of the baseline's method")
    parser.add_argument(
        "--results", type=Path, nargs="+", metavar="CSV", help="judge these results.csv instead of running anything"
    )
    parser.add_argument("--junit", type=Path, metavar="XML", help="write the verdicts as JUnit XML too")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="keep the rerun in this new folder")
    parser.add_argument("settings", nargs="*", metavar="KEY=VALUE", help="for every run, such as engine=serial")
    options = parser.parse_args(arguments)
    baseline = read_baseline(options.baseline)
    found = _found(baseline, options)
    require_same_settings(baseline, found)
    if options.method is not None:
        found = with_method_named(found, baseline, options.method)
    judgement = judge(baseline.rows, found.rows, baseline.floors, found.reasons)
    _publish(baseline, judgement, options)
    return REGRESSION if judgement.regressions else HOLDS


def _found(baseline: Baseline, options: argparse.Namespace) -> Rerun:
    if options.results is not None:
        return stored(options.results)
    with ExitStack() as stack:
        out = options.out
        if out is None:
            out = Path(stack.enter_context(TemporaryDirectory(prefix="gate.")))
        else:
            # What an older run left there would be taken for this one's.
            require(not out.exists(), "--out", "be a new folder", f"{out}, which is there")
        return rerun(baseline, out, options.method, options.settings)


def _publish(baseline: Baseline, judgement: Judgement, options: argparse.Namespace) -> None:
    text = markdown(baseline, judgement, options.method)
    summary = os.environ.get("GITHUB_STEP_SUMMARY")
    print(text)
    write_all(
        (
            (options.junit, junit(baseline, judgement), "wb"),
            (Path(summary) if summary else None, text.encode(), "ab"),
        )
    )


def _record(arguments: Sequence[str]) -> None:
    parser = _parser("Run a baseline's trials and keep their rows. Floors are to be derived anew.")
    parser.add_argument(
        "runs", nargs="*", metavar="RUN", help="arguments of `python -m experiments`, quoted; none: as before"
    )
    options = parser.parse_args(arguments)
    record(options.baseline, options.runs)


def _redraw(arguments: Sequence[str]) -> None:
    parser = _parser("Run a baseline's trials with redrawn noise and add each draw to a table.")
    _add_table(parser)
    options = parser.parse_args(arguments)
    redraw(options.baseline, options.table, _draws(options.draws))


def _derive(arguments: Sequence[str]) -> None:
    parser = _parser("Derive a baseline's floors from some draws of a table.")
    _add_table(parser)
    options = parser.parse_args(arguments)
    derive(options.baseline, options.table, _draws(options.draws))


def _parser(description: str, epilog: str = "") -> _Parser:
    parser = _Parser(
        "python -m experiments.gate",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--baseline", type=Path, required=True, metavar="NAME.csv", help="with NAME.json beside it")
    return parser


def _add_table(parser: _Parser) -> None:
    parser.add_argument("--draws", required=True, metavar="FIRST-LAST", help="such as 101-110")
    parser.add_argument("--table", type=Path, required=True, metavar="CSV.GZ", help="one line a figure and page")


def _draws(text: str) -> range:
    first, dash, last = text.partition("-")
    numbers = first.isdecimal() and (not dash or last.isdecimal())
    require(numbers, "--draws", "be FIRST-LAST, whole numbers above 0", text)
    draws = range(int(first), int(last or first) + 1)
    require(len(draws) > 0 and draws[0] > 0, "--draws", "be FIRST-LAST, whole numbers above 0", text)
    return draws
