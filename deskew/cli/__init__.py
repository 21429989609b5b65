"""The ``deskew`` command: captures and meshes in; calibrations, scans, flat meshes, figures and restored pages out.

Figures go to stdout, one a line or, with --json, as one JSON object; progress and errors go to stderr. Exit codes:
0 done, 2 a wrong input, 3 a step that failed on valid input. Nothing is written unless the work succeeds; if only the
figures cannot be printed afterwards, the error says that the file is there.

The stages are imported inside the commands: --help and wrong options answer at once, without numba and OpenCV.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from deskew.cli import accuracy, editing, flattening, importing, restoring, scanning, scoring
from deskew.cli.printing import say
from deskew.errors import DeskewError

__all__ = ["app", "main"]

app = typer.Typer(
    help="Restore an arbitrarily warped page from its 3D shape.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

for _command in (
    scanning.calibrate,
    scanning.scan,
    accuracy.accuracy,
    flattening.flatten,
    restoring.restore,
    restoring.run,
    scoring.score,
    editing.edit,
):
    app.command()(_command)
app.command("import")(importing.import_captures)


def _value_of(error: typer.TyperException, given: Sequence[str]) -> str:
    """Say what was given for the option at fault, which Typer's own message does not always."""
    parameter = getattr(error, "param", None)
    named = next((i for i, word in enumerate(given) if word in getattr(parameter, "opts", ())), None)
    if parameter is None or named is None:
        return ""
    return f", got {' '.join(given[named + 1 : named + 1 + parameter.nargs])}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        0 done, 2 wrong input or usage, 3 a step failed, 130 interrupted.
    """
    given = sys.argv[1:] if argv is None else list(argv)
    try:
        # Typer's own handling would print usage, a hint and the error: three lines and no house wording.
        return int(app(args=given, prog_name="deskew", standalone_mode=False) or 0)
    except typer.TyperException as error:
        say(f"{error.format_message()}{_value_of(error, given)} (deskew --help shows what is allowed)")
        return 2
    except DeskewError as error:
        say(str(error))
        return error.exit_code
    except (OSError, MemoryError) as error:
        say(f"The system refused: {error or 'out of memory'}; free some room or name another place.")
        return 3
    except (KeyboardInterrupt, typer.Abort):
        say("interrupted; nothing was written.")
        return 130
