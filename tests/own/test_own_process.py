"""A method in a process of its own: what it may do, what becomes of it if it does anything else, what it can see."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.flattening import flatten
from deskew.own.confinement import Limits, hidden
from deskew.own.methods import OwnMethod, own_method
from deskew.plugins import Kind
from deskew.types import Sheet, Status
from tests.flattening.bent_sheets import mirror_folds

UNRULY = "tests.own.unruly"
QUICK = Limits(seconds=20.0, memory_mb=1024, file_mb=8)


def unruly(name: str, limits: Limits = QUICK) -> OwnMethod:
    return OwnMethod(f"{UNRULY}:{name}", Kind.FLATTENER, limits)


@pytest.fixture(scope="module")
def sheet() -> Sheet:
    vertices = mirror_folds(3, (9, 11), n_folds=2)[0]
    return Sheet(vertices, stiffness=np.full((8, 10), 2.0), crease_width=0.5)


def test_a_method_of_its_own_process_flattens_as_it_would_here(sheet: Sheet) -> None:
    found = flatten(sheet, method=own_method(f"{UNRULY}:flatten", QUICK))
    assert np.array_equal(found.vertices, sheet.vertices * [1.0, 1.0, 0.0])
    assert (found.status, found.counters, found.surface) == (Status.AT_REST, {"steps": 3.0}, None)
    again = flatten(sheet, method=f"{UNRULY}:flatten")
    assert np.array_equal(found.vertices, again.vertices)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("crash", "`tests.own.unruly:crash` crashed with SIGSEGV; it last said: not again."),
        ("hoard", "`tests.own.unruly:hoard` ran out of the 1024 MB that it may take."),
        ("tear", "Flattening by `tests.own.unruly:tear` must return finite vertices unless it diverged, got at_rest"),
        ("shorten", "Flattening by `tests.own.unruly:shorten` must keep the shape (9, 11, 3), got (8, 11, 3)."),
        ("leave", "`tests.own.unruly:leave` ended with exit code 0 and without a result."),
        ("raise_two_lines", "`tests.own.unruly:raise_two_lines` raised ValueError: first line second line."),
        ("return_an_object", ":return_an_object` must return vertices as an array of real numbers, got object."),
        ("return_nothing", "`tests.own.unruly:return_nothing` must return a Flattened, got NoneType."),
        ("prattle", "`tests.own.unruly:prattle` raised ValueError: tired of [31mtalking."),
        ("forge", "`tests.own.unruly:forge` left a result that cannot be read: "),
        ("pickle_code", "`tests.own.unruly:pickle_code` left a result that cannot be read: "),
        ("flood", "`tests.own.unruly:flood` raised OSError: [Errno 27] File too large."),
        ("restore", "`tests.own.unruly:restore` is a restorer and was called as a flattener."),
    ],
)
def test_a_method_that_does_not_return_is_a_step_error_in_one_line(sheet: Sheet, name: str, reason: str) -> None:
    with pytest.raises(StepError) as raised:
        flatten(sheet, method=unruly(name))
    assert reason in str(raised.value)
    assert str(raised.value).isprintable()
    assert not Path(__file__).with_name("sprung").exists()


def test_a_method_that_hangs_is_ended(sheet: Sheet) -> None:
    start = time.monotonic()
    with pytest.raises(StepError, match=r"hang` took longer than the 2 s that it may take\."):
        unruly("hang", Limits(seconds=2.0))(sheet)
    assert time.monotonic() - start < 60.0


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="only Linux lets a process adopt its orphans")
def test_what_a_method_leaves_behind_ends_with_it(sheet: Sheet) -> None:
    before = _processes()
    assert unruly("abandon")(sheet).status is Status.AT_REST
    assert not [pid for pid in _processes() - before if "deskew.own.child" in _command(pid)]


def test_a_method_sees_its_sheet_and_nothing_of_what_called_it(sheet: Sheet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("THE_SECRET", "42")
    truth = np.zeros((5, 7, 2))  # what would be there if a fork had taken this process's memory along
    seen = unruly("spy")(sheet).counters
    assert truth.shape[-1] == 2
    assert len(seen) == 8
    if not Path("/proc/self/stat").exists():
        del seen["seen_memory"]
    assert seen == dict.fromkeys(seen, 0.0)


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="only Linux shows memory as files")
def test_memory_is_open_to_others_of_the_same_user_unless_it_is_hidden() -> None:
    look = (
        "import os, sys; from deskew.own.confinement import confine\n"
        "if sys.argv[1:]: confine(1024, 8)\n"
        "open(f'/proc/{os.getppid()}/environ', 'rb').read()"
    )
    codes = [subprocess.run([sys.executable, "-c", look], stderr=subprocess.DEVNULL).returncode]
    with hidden():
        codes.append(subprocess.run([sys.executable, "-c", look, "confined"], stderr=subprocess.DEVNULL).returncode)
    codes.append(subprocess.run([sys.executable, "-c", look], stderr=subprocess.DEVNULL).returncode)
    assert codes == [0, 1, 0]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("flatten", Kind.FLATTENER), ("restore", Kind.RESTORER), ("dewarp", Kind.DEWARPER)],
)
def test_the_kind_is_told_by_its_mark(name: str, kind: Kind) -> None:
    assert own_method(f"{UNRULY}:{name}", QUICK).deskew_kind is kind


def test_a_module_that_is_not_there_or_takes_too_long_is_a_wrong_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "slow_to_import.py").write_text("import time\ntime.sleep(3600)\n")
    (tmp_path / "marks_itself.py").write_text("def f(x): ...\nf.deskew_kind = 'ironer'\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    for name, limits, words in (
        ("no_such_module:f", QUICK, "No module named 'no_such_module'"),
        ("slow_to_import:f", Limits(seconds=1.0), "took longer than the 1 s"),
        ("marks_itself:f", QUICK, "`deskew_kind` must be one of flattener, restorer, dewarper, got 'ironer'"),
        ("no_such_entry_point", QUICK, "`method` must be package.module:function, or a method installed as"),
    ):
        with pytest.raises(InputError, match="`method` must ") as raised:
            own_method(name, limits)
        assert words in str(raised.value)


def test_limits_are_checked() -> None:
    for wrong in ({"seconds": 0.0}, {"memory_mb": 64}, {"memory_mb": 1.5}, {"file_mb": 4096}):
        with pytest.raises(InputError, match=f"`{next(iter(wrong))}` must be "):
            Limits(**wrong)  # type: ignore[arg-type]


def _processes() -> set[int]:
    return {int(folder.name) for folder in Path("/proc").glob("[0-9]*")}


def _command(pid: int) -> str:
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""
