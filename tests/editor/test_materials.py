"""What is painted: materials, their labels, and the map that they make."""

from __future__ import annotations

import numpy as np
import pytest

from deskew.editor.materials import MAX_MATERIALS, STIFFNESS, Material, Painting
from deskew.errors import InputError
from deskew.io import StiffnessMap


def left_half(painting: Painting) -> np.ndarray:
    return np.arange(painting.size[0])[None, :] < np.full((painting.size[1], 1), painting.size[0] // 2)


def test_a_page_begins_as_one_material_of_the_papers_stiffness() -> None:
    blank = Painting.blank((6, 4))
    assert (blank.size, blank.map.size) == ((6, 4), (6, 4))
    assert dict(blank.map.constants) == {0: STIFFNESS}
    assert not blank.labels.any()


def test_paint_lies_where_it_was_laid_and_nowhere_else() -> None:
    blank = Painting.blank((6, 4)).with_new()
    painted = blank.painted(left_half(blank), 1)
    assert np.array_equal(painted.labels == 1, left_half(blank))
    assert not blank.labels.any()


def test_what_is_removed_leaves_the_pages_own_material_behind() -> None:
    painted = Painting.blank((6, 4)).with_new().with_new()
    painted = painted.painted(left_half(painted), 1).painted(~left_half(painted), 2)
    rest = painted.without(1)
    assert rest.names == {0: "page", 2: "material 3"}
    assert np.array_equal(rest.labels == 0, left_half(painted))
    assert rest.with_new().materials[-1].label == 1


def test_a_change_of_one_material_leaves_the_others() -> None:
    painted = Painting.blank((6, 4)).with_new().changed(1, stiffness=0.3).changed(1, name="vellum")
    assert painted.materials == (Material(0, "page", STIFFNESS), Material(1, "vellum", 0.3))


def test_a_map_from_a_file_keeps_its_labels() -> None:
    found = StiffnessMap(np.array([[7, 200]], np.uint8), {7: 0.3, 200: 30.0, 9: 1.0})
    taken = Painting.of(found, {7: "vellum"})
    assert taken.names == {7: "vellum", 9: "material 9", 200: "material 200"}
    assert dict(taken.map.constants) == dict(found.constants)
    assert np.array_equal(taken.map.labels, found.labels)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p.changed(0, stiffness=0.0), r"`stiffness` must be in \(0, 1e\+09\] \[kg/s\^2\], got 0.0"),
        (lambda p: p.changed(0, stiffness=float("nan")), "`stiffness` must be in .*, got nan"),
        (lambda p: p.changed(0, name=" "), "`name` must be 1 to 40 printable characters, got ' '"),
        (lambda p: p.changed(0, name="a\nb"), "`name` must be 1 to 40 printable characters"),
        (lambda p: p.changed(0, name="x" * 41), "`name` must be 1 to 40 printable characters"),
        (lambda p: p.changed(3, name="x"), "`label` must be one of 0, got 3"),
        (lambda p: p.without(0), "`label` must be another than the page's own material"),
        (lambda p: p.painted(left_half(p), 5), "`label` must be one of 0, got 5"),
        (lambda p: Painting(p.labels + np.uint16(4), p.materials), r"`labels` must be of 0, got \[4\]"),
        (lambda p: Painting(p.labels, ()), "`materials` must be one or more"),
        (lambda p: Painting(p.labels.astype(np.uint8), p.materials), "`labels` must be a non-empty"),
    ],
)
def test_what_makes_no_map_is_refused(change, message: str) -> None:
    with pytest.raises(InputError, match=message):
        change(Painting.blank((6, 4)))


def test_there_are_as_many_materials_as_colours() -> None:
    painting = Painting.blank((2, 2))
    for _ in range(MAX_MATERIALS - 1):
        painting = painting.with_new()
    with pytest.raises(InputError, match="`materials` must be at most 8, got 9"):
        painting.with_new()
