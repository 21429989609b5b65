"""Every wrong input ends in one line that names it, with code 2 or 3, and leaves everything as it was.

Most cases are run in forks of one warm process by the function that the module's own `python -m` calls (see
`forked`); some of every family are run once more as a user would, each in an interpreter of its own.
"""

from __future__ import annotations

import os
import resource
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.badinput import arrays, captures, images, meshes, places, programs, texts
from tests.badinput.case import Case
from tests.badinput.corpus import Bench, asked, faults, listing
from tests.badinput.samples import write_rendered, write_samples

FAMILIES = {
    module.__name__.rpartition(".")[2]: module.CASES
    for module in (images, captures, meshes, texts, arrays, places, programs)
}
CASES = [case for cases in FAMILIES.values() for case in cases]
AS_A_USER_WOULD = (
    *("a sparse OBJ of 400 MB", "a mesh that is a pipe", "a disk full of a restored page"),
    "an override nested 3000 deep",
)
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    write_samples(folder)
    write_rendered(folder)
    return folder


@pytest.fixture(scope="module")
def server() -> Iterator[subprocess.Popen[str]]:
    # Arrow's own allocator reserves more addresses than a case may have; Python's cache of a method is no output.
    variables = {**os.environ, "ARROW_DEFAULT_MEMORY_POOL": "system", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "tests.badinput.forked"]
    with subprocess.Popen(
        command, cwd=ROOT, env=variables, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process


@pytest.fixture(scope="module")
def bench(samples: Path) -> Iterator[Bench]:
    with tempfile.TemporaryDirectory(prefix="badinput.") as folder:
        yield Bench(samples, Path(folder) / "here")


@pytest.fixture
def here(bench: Bench) -> Iterator[Path]:
    """A folder of whole samples."""
    yield bench.folder
    bench.mend()


def test_the_corpus_holds_150_cases_of_different_names() -> None:
    names = [case.name for case in CASES]
    assert len(names) == len(set(names)) >= 150
    programs = {case.program for case in CASES}
    assert {"deskew", "experiments", "data_synth.captures", "experiments.hidden_seeds"} <= programs
    commands = {case.arguments[0] for case in CASES if case.program == "deskew" and case.arguments}
    assert {"calibrate", "scan", "accuracy", "flatten", "restore", "run", "score"} <= commands


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_a_wrong_input_is_one_line_and_leaves_nothing(server: subprocess.Popen[str], here: Path, case: Case) -> None:
    if case.broken is not None:
        case.broken(here)
    before = listing(here)
    answer = asked(server, case, here)
    assert faults(case, answer, before, listing(here)) == []


@pytest.mark.parametrize("name", AS_A_USER_WOULD)
def test_a_wrong_input_in_an_interpreter_of_its_own(here: Path, name: str) -> None:
    (case,) = (case for case in CASES if case.name == name)
    if case.broken is not None:
        case.broken(here)
    before = listing(here)
    answer = _run(case, here)
    assert faults(case, answer, before, listing(here)) == []


def _run(case: Case, folder: Path) -> dict[str, object]:
    """Run a case by `python -m`."""
    assert not case.absent  # nothing can be hidden from another interpreter

    def confine() -> None:
        if case.file_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (case.file_bytes,) * 2)

    with subprocess.Popen(
        [sys.executable, "-m", *shlex.split(case.line)],
        cwd=folder,
        env={**os.environ, **case.environment, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=confine,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        out, err = process.stdout.read(), process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return {"code": process.returncode, "out": out, "err": err, "peak_mb": usage.ru_maxrss / 1024.0}
