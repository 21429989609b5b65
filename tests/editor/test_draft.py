"""The draft: nothing that was painted is lost, and what cannot be read is said in one line."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from deskew.editor.draft import draft_of, opened, read_draft, write_draft
from deskew.editor.materials import Painting
from deskew.errors import InputError
from deskew.io import write_arrays, write_stiffness

SIZE = (9, 5)


def painting(label: int = 1) -> Painting:
    blank = Painting.blank(SIZE).with_new().changed(1, name="Pergament, weiß", stiffness=1 / 3)
    return blank.painted(np.eye(5, 9, dtype=bool), label)


def same(one: Painting, other: Painting) -> bool:
    return one.materials == other.materials and np.array_equal(one.labels, other.labels)


def aged(path: Path, seconds: int) -> None:
    for file in (path, path.with_suffix(".toml")):
        if file.exists():
            os.utime(file, (1e9 + seconds, 1e9 + seconds))


def test_a_draft_comes_back_as_it_was(tmp_path: Path) -> None:
    write_draft(painting(), tmp_path / "map.draft.npz")
    assert same(read_draft(tmp_path / "map.draft.npz"), painting())


def test_nothing_there_is_a_blank_page(tmp_path: Path) -> None:
    found, source = opened(tmp_path / "map.png", SIZE)
    assert same(found, Painting.blank(SIZE))
    assert source is None


@pytest.mark.parametrize(("map_age", "draft_age"), [(1, 2), (2, 1), (1, 1)])
def test_what_was_written_last_is_taken_up_and_the_names_from_the_draft(
    tmp_path: Path, map_age: int, draft_age: int
) -> None:
    path = tmp_path / "map.png"
    write_stiffness(painting(0).map, path)
    write_draft(painting(1), draft_of(path))
    aged(path, map_age)
    aged(draft_of(path), draft_age)
    found, source = opened(path, SIZE)
    if map_age > draft_age:
        assert (source, found.labels.any(), found.names[1]) == (path, False, "Pergament, weiß")
    else:
        assert source == draft_of(path)
        assert same(found, painting(1))


def test_a_map_of_another_photograph_is_refused(tmp_path: Path) -> None:
    write_stiffness(painting().map, tmp_path / "map.png")
    with pytest.raises(InputError, match=r"map\.png` must be 10x5 px, the photograph's size.* got 9x5 px"):
        opened(tmp_path / "map.png", (10, 5))


@pytest.mark.parametrize("text", ["", "[]", "[[0]]", "[[0, 5, 1]]", '[[0, "page", -1]]', "{", '[["x", "y", "z"]]'])
def test_a_damaged_draft_is_one_line_that_says_what_to_do(tmp_path: Path, text: str) -> None:
    path = tmp_path / "map.draft.npz"
    write_arrays({"labels": np.zeros((5, 9), np.uint16), "materials": np.frombuffer(text.encode(), np.uint8)}, path)
    with pytest.raises(InputError, match=r"`.*map\.draft\.npz` must be a draft of the editor, .*delete it"):
        read_draft(path)


def test_a_draft_without_labels_is_refused(tmp_path: Path) -> None:
    write_arrays({"labels": np.zeros(3)}, tmp_path / "map.draft.npz")
    with pytest.raises(InputError, match="must be a draft of the editor"):
        read_draft(tmp_path / "map.draft.npz")
