"""The store keeps whole trials, each once, and only those of its own fingerprint."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from deskew.errors import InputError, StepError
from experiments.trials import Outcome, Row, Store, TrialKey
from experiments.trials.record import failed_outcome

KEY = TrialKey("fake", trial=0, seed=1)


def outcome(value: float, condition: str = "restored") -> Outcome:
    return Outcome((Row.of(KEY, condition, "a", "misses", value),), pictures={"page": b"png"})


def test_a_second_copy_of_a_trial_changes_nothing(tmp_path: Path) -> None:
    with Store(tmp_path, "f") as store:
        assert store.record(KEY, outcome(1.0))
        assert not store.record(KEY, outcome(2.0))
        assert [row.value for row in store.rows([KEY])] == [1.0]
        assert store.pictures([KEY]) == {"page": b"png"}


def test_fingerprints_share_a_file_and_never_a_row(tmp_path: Path) -> None:
    with Store(tmp_path, "f") as store:
        store.record(KEY, outcome(1.0))
    with Store(tmp_path, "g") as store:
        assert store.finished() == set()
        assert store.rows([KEY]) == []
        store.record(KEY, outcome(2.0))
    with Store(tmp_path, "f") as store:
        assert [row.value for row in store.rows([KEY])] == [1.0]


def test_a_trial_that_breaks_while_it_is_stored_leaves_no_part(tmp_path: Path) -> None:
    row = outcome(1.0).rows[0]
    with Store(tmp_path, "f") as store:
        with pytest.raises(sqlite3.IntegrityError):
            store.record(KEY, Outcome((row, row)))
        assert store.finished() == set()
        assert store.rows([KEY]) == []


def test_two_trials_that_claim_one_row_are_an_error(tmp_path: Path) -> None:
    other = TrialKey("fake", "restored", "-", 0, 1)
    with Store(tmp_path, "f") as store:
        store.record(KEY, outcome(1.0))
        store.record(other, outcome(2.0))
        assert len(store.rows([KEY])) == 1
        with pytest.raises(StepError, match="must name each row once"):
            store.rows([KEY, other])


def test_only_lost_trials_are_forgotten(tmp_path: Path) -> None:
    failed, lost = KEY, TrialKey("fake", trial=1, seed=1)
    with Store(tmp_path, "f") as store:
        store.record(failed, failed_outcome(failed, "locked"))
        store.record(lost, failed_outcome(lost, "died", lost=True))
        store.forget_lost()
        assert store.finished() == {failed}
        assert [failure.reason for failure in store.failures([failed, lost])] == ["locked"]


def test_a_store_of_another_version_is_refused(tmp_path: Path) -> None:
    with Store(tmp_path, "f") as store:
        store.record(KEY, outcome(1.0))
    connection = sqlite3.connect(tmp_path / "results.sqlite")
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(InputError, match="its version is 99"):
        Store(tmp_path, "f")


@pytest.mark.parametrize("version", [0, 1])
def test_a_database_of_another_program_is_refused_and_left_as_it_was(tmp_path: Path, version: int) -> None:
    path = tmp_path / "results.sqlite"
    connection = sqlite3.connect(path)
    connection.executescript(f"CREATE TABLE trials (a); PRAGMA user_version = {version};")
    connection.close()
    before = path.read_bytes()
    with pytest.raises(InputError, match="`out` must hold a store of this program or none"):
        Store(tmp_path, "f")
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["a\0b", "y" * 300])
def test_a_folder_that_cannot_be_is_refused_and_leaves_no_parent(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="`out` must be a folder that can be written"):
        Store(tmp_path / "new" / name, "f")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_a_failed_step_and_keeps_the_trials_before(tmp_path: Path) -> None:
    other = TrialKey("fake", trial=1, seed=1)
    with Store(tmp_path, "f") as store:
        store.record(KEY, outcome(1.0))
        # What a full disk does, without filling one.
        store._connection.execute("PRAGMA max_page_count = 1")
        with pytest.raises(StepError, match="disk is full; finished trials are kept"):
            store.record(other, Outcome((), pictures={"page": bytes(1 << 20)}))
    with Store(tmp_path, "f") as store:
        assert store.finished() == {KEY}


def test_an_empty_store_leaves_no_folder_behind(tmp_path: Path) -> None:
    with Store(tmp_path / "a" / "b", "f"):
        assert (tmp_path / "a" / "b").is_dir()
    assert list(tmp_path.iterdir()) == []
