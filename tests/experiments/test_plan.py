"""What the config hash depends on, and what not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from experiments.settings import (
    AblationSettings,
    Config,
    RealBoardsSettings,
    SensitivitySettings,
    SheetSettings,
    allowed_text,
    known_keys,
)
from experiments.trials import fingerprint, plan, settings_of

CONFIG = Config(experiment="fake", trials=3)


def test_a_changed_source_changes_the_fingerprint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "_ROOT", tmp_path)
    monkeypatch.setattr(plan, "SOURCES", ("stage", "study.py"))
    (tmp_path / "stage").mkdir()
    (tmp_path / "stage" / "a.py").write_text("1")
    (tmp_path / "study.py").write_text("2")
    first = fingerprint({"seed": 1})
    assert fingerprint({"seed": 1}) == first != fingerprint({"seed": 2})
    (tmp_path / "stage" / "a.nbi").write_text("cache")
    assert fingerprint({"seed": 1}) == first
    (tmp_path / "stage" / "a.py").write_text("3")
    assert fingerprint({"seed": 1}) != first


def test_inputs_count_by_content_and_not_by_place(tmp_path: Path) -> None:
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "white.png").write_bytes(b"white")
    config = replace(CONFIG, experiment="real_boards")
    found = [
        settings_of(
            replace(config, real_boards=RealBoardsSettings(str(tmp_path / name))), {"real_boards.path": tmp_path / name}
        )
        for name in ("here", "there")
    ]
    assert found[0] == found[1]
    assert str(tmp_path) not in str(found)
    (tmp_path / "there" / "white.png").write_bytes(b"grey")
    assert settings_of(config, {"real_boards.path": tmp_path / "there"}) != found[0]


def test_single_sheets_count_by_content(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(b"1")
    config = replace(CONFIG, sheet=SheetSettings(paths=[str(path)]))
    first = settings_of(config, {"sheet.paths[0]": path})
    assert str(tmp_path) not in str(first)
    path.write_bytes(b"2")
    assert settings_of(config, {"sheet.paths[0]": path}) != first


def test_one_name_and_a_list_of_one_are_the_same_methods() -> None:
    assert settings_of(replace(CONFIG, method="a"), {}) == settings_of(replace(CONFIG, method=["a"]), {})


def test_a_section_of_another_experiment_is_no_part() -> None:
    other = replace(CONFIG, real_boards=RealBoardsSettings("somewhere"))
    assert settings_of(other, {}) == settings_of(CONFIG, {})


def test_a_longer_list_of_ablations_leaves_old_rows_good() -> None:
    other = replace(CONFIG, ablations=AblationSettings(gamma=[1.0]))
    assert settings_of(other, {}) == settings_of(CONFIG, {})


def test_what_is_changed_in_one_trial_counts_and_what_has_trials_of_its_own_does_not() -> None:
    config = replace(CONFIG, experiment="sensitivity")
    for changed, counts in (("noise_scale", False), ("slope_p90_deg", False), ("mesh", True)):
        other = replace(config, sensitivity=SensitivitySettings(**{changed: []}))
        assert (settings_of(other, {}) != settings_of(config, {})) == counts


def test_ranges_are_known_by_dotted_key() -> None:
    assert allowed_text("rig.noise_scale") == "lie in [0, 10] times the rig's own noise"
    assert allowed_text("trials") == "be a whole number in [1, 100000]"
    assert allowed_text("rig.colour") is allowed_text("nothing.here") is None
    assert known_keys("mesh") == ["columns", "rows"]
    assert known_keys("seed") == known_keys("nothing") == []
