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


def test_an_empty_store_leaves_no_folder_behind(tmp_path: Path) -> None:
    with Store(tmp_path / "a" / "b", "f"):
        assert (tmp_path / "a" / "b").is_dir()
    assert list(tmp_path.iterdir()) == []
