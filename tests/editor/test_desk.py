"""The desk: undo, drafts, windows that share it, and files that feed `deskew restore`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deskew.cli import main
from deskew.editor import Desk, Files
from deskew.editor.draft import draft_of, read_draft
from deskew.editor.strokes import Stroke, Tool
from deskew.errors import InputError, StepError
from deskew.io import read_image, read_stiffness
from deskew.types import Scan

LEAF = Stroke(Tool.RECTANGLE, np.array([[160.0, 150.0], [620.0, 430.0]]))


def with_a_leaf(desk: Desk, stiffness: float = 0.3) -> Desk:
    desk.add()
    desk.paint(LEAF, 1)
    desk.change(1, "vellum", stiffness)
    return desk


def test_every_change_is_in_the_draft_before_it_is_believed(desk: Desk, files: Files) -> None:
    changes: list[Callable[[], None]] = [
        desk.add,
        lambda: desk.paint(LEAF, 1),
        lambda: desk.change(1, stiffness=0.3),
        desk.undo,
        desk.redo,
        lambda: desk.remove(1),
    ]
    for change in changes:
        before = desk.painting
        change()
        kept = read_draft(draft_of(files.map))
        assert desk.painting is not before
        assert kept.materials == desk.painting.materials
        assert np.array_equal(kept.labels, desk.painting.labels)


def test_what_cannot_be_kept_is_not_done(scan: Scan, tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    desk = Desk(scan, Files(folder / "map.png", folder / "restored.png"), "leaf")
    desk.add()
    (folder / "map.draft.npz").unlink()
    folder.rmdir()
    for change in (desk.add, desk.undo):
        before = desk.painting, desk.undoable
        with pytest.raises(InputError, match="must lie in an existing folder"):
            change()
        assert (desk.painting, desk.undoable) == before


def test_undo_and_redo_walk_the_same_way(desk: Desk) -> None:
    states = [desk.painting]
    for n in range(4):
        desk.paint(Stroke(Tool.BRUSH, np.array([[50.0 * n, 80.0]]), width=30), 0)
        states.append(desk.painting)
    for state in reversed(states[:-1]):
        desk.undo()
        assert desk.painting is state
    desk.undo()
    assert (desk.painting, desk.undoable) == (states[0], (0, 4))
    for state in states[1:]:
        desk.redo()
        assert desk.painting is state
    desk.undo()
    desk.add()
    assert desk.undoable == (4, 0)


def test_a_second_desk_goes_on_where_the_first_one_stopped(scan: Scan, files: Files, desk: Desk) -> None:
    with_a_leaf(desk)
    again = Desk(scan, files, "leaf")
    assert again.taken_up == draft_of(files.map)
    assert again.painting.materials == desk.painting.materials
    assert np.array_equal(again.painting.labels, desk.painting.labels)
    assert not again.saved


def test_the_saved_map_is_what_was_painted(scan: Scan, files: Files, desk: Desk) -> None:
    with_a_leaf(desk)
    assert not desk.saved
    desk.save_map()
    found = read_stiffness(files.map)
    assert desk.saved
    assert dict(found.constants) == {0: 30.0, 1: 0.3}
    assert np.array_equal(found.labels, desk.painting.labels)
    assert Desk(scan, files, "leaf").saved
    desk.change(1, stiffness=0.4)
    assert not desk.saved


@pytest.mark.parametrize("free_scale", [False, True])
def test_the_saved_page_is_the_one_that_restore_makes_of_the_saved_map(
    scan: Scan, scan_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], free_scale: bool
) -> None:
    files = Files(tmp_path / "map.png", tmp_path / "edited.png", scale=1.5)
    desk = with_a_leaf(Desk(scan, files, "leaf"))
    desk.free_scale = free_scale
    desk.save_map()
    desk.save_restored()
    line = f"restore {scan_file} -o {tmp_path}/restored.png --stiffness {files.map} --scale 1.5"
    assert main([*line.split(), *(["--free-scale"] if free_scale else [])]) == 0
    capsys.readouterr()
    assert (tmp_path / "edited.png").read_bytes() == (tmp_path / "restored.png").read_bytes()
    assert read_image(tmp_path / "edited.png").shape == (864, 1152)


def test_the_leaf_is_painted_where_it_was_found(scan: Scan, files: Files, desk: Desk) -> None:
    leaf = np.zeros(scan.camera.size[::-1], bool)
    leaf[100:200, 300:400] = True
    found = Desk(scan, files, "leaf", lambda: leaf)
    found.add()
    found.paint_leaf(1)
    assert found.can_find_leaf
    assert np.array_equal(found.painting.labels == 1, leaf)
    with pytest.raises(InputError, match="`leaf` must be looked for in a capture, got a scan alone"):
        desk.paint_leaf(0)


def test_a_colour_is_picked_from_the_page_without_its_shading(scan: Scan, files: Files) -> None:
    unshaded = np.full_like(scan.images["white"], 200)
    unshaded[200:300, 200:500] = 90
    desk = Desk(replace(scan, images={**scan.images, "unshaded": unshaded}), files, "leaf")
    desk.add()
    desk.paint(Stroke(Tool.SIMILAR, np.array([[300.0, 250.0]]), tolerance=10), 1)
    assert desk.painting.labels[205:295, 205:495].all()
    assert desk.painting.labels.sum() < 1.05 * 100 * 300


def test_a_map_that_is_damaged_is_refused_at_once(scan: Scan, files: Files) -> None:
    files.map.write_bytes(b"no picture")
    with pytest.raises((InputError, StepError), match="map"):
        Desk(scan, files, "leaf")


def test_millimetres_of_a_pixel_are_those_of_the_camera_over_the_bed(desk: Desk) -> None:
    """279.4 mm of page span 700 to 720 of 768 pixels."""
    assert 279.4 / 720 < desk.mm_per_px < 279.4 / 690
