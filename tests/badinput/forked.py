"""A server that forks a process for each command: a case then costs milliseconds instead of a second of imports.

Each command is run by the very function that its module calls when it is run by name, in a process of its own that ends
after 5 s of the processor or 30 s by the clock, and cannot have more than 1 GB beyond what the imports take.

    python -m tests.badinput.forked     # a JSON request a line on stdin, a JSON answer a line on stdout
"""

from __future__ import annotations

import gc
import io
import json
import os
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from contextlib import redirect_stderr
from importlib import import_module
from pathlib import Path
from typing import Any

SECONDS_CPU, SECONDS_WALL = 5, 30
MEMORY_BYTES = 1 << 30

# What commands import on demand is here already.
_WARM = (
    *("deskew.cli", "deskew.pipeline", "deskew.flattening", "deskew.metrics", "trimesh", "pandas", "scipy.ndimage"),
    *("experiments.program", "experiments.studies.surfaces", "experiments.studies.ocr_misses", "tqdm"),
    *("data_synth.captures", "experiments.hidden_seeds", "experiments.reporting.agreement"),
    *("experiments.reporting.claims.__main__", "experiments.reporting.generated", "experiments.reporting.moved"),
    *("experiments.gate.command", "experiments.page.__main__", "deskew.editor"),
)


def entry_of(program: str) -> Callable[[list[str]], Any]:
    """Return the function that a program's own `python -m` calls with its arguments."""
    names = {"deskew": "deskew.cli", "experiments": "experiments.program"}
    names["experiments.reporting.claims"] = "experiments.reporting.claims.__main__"
    names |= {"experiments.gate": "experiments.gate.command", "experiments.page": "experiments.page.__main__"}
    entry: Callable[[list[str]], Any] = import_module(names.get(program, program)).main
    return entry


def _child(request: dict[str, Any], scratch: Path) -> int:
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(scratch / name, os.O_WRONLY | os.O_CREAT), number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(request["folder"])
    sys.path[0] = request["folder"]  # where `python -m` looks first
    os.environ.update(request["environment"])
    sys.modules.update(dict.fromkeys(request["absent"]))  # type: ignore[arg-type]  # None stands for "not there"
    used = 4096 * int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS_CPU,) * 2)
    if request["file_bytes"] is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (request["file_bytes"],) * 2)
    signal.alarm(SECONDS_WALL)
    try:
        return int(entry_of(request["program"])(request["arguments"]) or 0)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Run one command; return its code (a signal's number below 0), its output, its time [s] and its memory [MB]."""
    with tempfile.TemporaryDirectory(prefix="forked.") as scratch:
        process = os.fork()
        if process == 0:
            code = 1
            try:
                code = _child(request, Path(scratch))
            finally:
                os._exit(code)
        _, status, usage = os.wait4(process, 0)
        out, err = (_text(Path(scratch) / name) for name in ("out", "err"))
    return {
        "code": os.waitstatus_to_exitcode(status),
        "out": out,
        "err": err,
        "seconds_cpu": usage.ru_utime + usage.ru_stime,
        "peak_mb": usage.ru_maxrss / 1024.0,
    }


def _text(path: Path) -> str:
    return path.read_bytes().decode(errors="replace") if path.exists() else ""


def _warm_up() -> None:
    """Import everything, and have both command lines build their parsers."""
    for module in _WARM:
        import_module(module)
    with redirect_stderr(io.StringIO()):
        for command in ("calibrate", "scan", "accuracy", "flatten", "restore", "run", "score"):
            entry_of("deskew")([command])
        entry_of("experiments")(["experiment=surfaces", "trials=0"])
    gc.collect()
    gc.freeze()  # a collection in a child would copy every page that it looks at


def main() -> None:
    """Answer requests until stdin ends."""
    _warm_up()
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
