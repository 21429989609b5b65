"""How methods from outside are found and marked, and what restorers and dewarpers must return."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import deskew
from deskew import pipeline, restoration
from deskew.errors import InputError, StepError
from deskew.flattening import flatten
from deskew.plugins import Kind, kind_of, load, locate
from deskew.types import Array, DepthMap, Dewarped, Flattened, Pinhole, Restoration, Scan, Sheet, Status

SIZE = (64, 48)
LENS = Pinhole(
    SIZE,
    np.array([[80.0, 0.0, 31.5], [0.0, 80.0, 23.5], [0.0, 0.0, 1.0]]),
    np.array([-0.05, 0.0, 0.0, 0.0, 0.0]),
    np.diag([1.0, -1.0, -1.0]),
    np.array([0.0, 0.0, 400.0]),
)


@pytest.fixture(scope="module")
def scan() -> Scan:
    """A flat page under the camera."""
    y, x = np.mgrid[80.0:-81.0:-20.0, -100.0:101.0:25.0]
    sheet = Sheet(np.stack([x, y, 0 * x], axis=-1))
    view = restoration.view_camera(LENS)
    depth = DepthMap(np.full(SIZE[::-1], 400.0), np.zeros(SIZE[::-1], np.uint8), view)
    image = np.random.default_rng(0).integers(0, 256, SIZE[::-1]).astype(np.uint8)
    return Scan({"white": image}, depth, LENS, sheet, np.zeros((4, 2)))


def seen(scan: Scan) -> Restoration:
    backward_map = restoration.undistortion_map(scan.camera)
    image = restoration.undistorted_view(scan.images["white"], scan.camera)
    return Restoration(image, backward_map, restoration.view_camera(scan.camera))


def test_a_mark_tells_the_kind_and_leaves_the_function_alone() -> None:
    def plain(x: int) -> int:
        return x + 1

    assert kind_of(plain) is Kind.FLATTENER
    for mark, kind in (
        (deskew.restorer, Kind.RESTORER),
        (deskew.dewarper, Kind.DEWARPER),
        (deskew.flattener, Kind.FLATTENER),
    ):
        assert mark(plain) is plain
        assert kind_of(plain) is kind
    plain.deskew_kind = "restorer"  # type: ignore[attr-defined]
    assert kind_of(plain) is Kind.RESTORER
    assert plain(1) == 2


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed distribution with a method; its module ends the process that imports it."""
    (tmp_path / "ends_all.py").write_text("import os\nos._exit(7)\n")
    _install(tmp_path, "one", "ironed = ends_all:iron")
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def _install(folder: Path, name: str, entry: str) -> None:
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[deskew.methods]\n{entry}\n")


def test_an_installed_method_is_found_by_its_name_and_not_imported(distribution: Path) -> None:
    assert locate("ironed") == ("ends_all", "iron")
    assert locate("a.b:c") == ("a.b", "c")
    assert [locate(name) for name in ("folded", "", "a.b:", ":c", "..a:b", "a..b:c")] == [None] * 6
    _install(distribution, "two", "ironed = ends_all:iron")
    assert locate("ironed") == ("ends_all", "iron")
    _install(distribution, "three", "ironed = other:iron")
    with pytest.raises(InputError, match="`ironed` must be installed once, got ends_all:iron, other:iron"):
        locate("ironed")


def test_an_installed_method_is_loaded_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "presses.py").write_text("def press(sheet):\n    return 'pressed'\n")
    _install(tmp_path, "presser", "press = presses:press")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert load("press", "method", "known")(None) == "pressed"
    with pytest.raises(StepError, match="Flattening by `press` must return a Flattened, got str"):
        flatten(Sheet(np.zeros((2, 2, 3))), method="press")
    with pytest.raises(InputError, match="`method` must be known, got 'pressed'"):
        load("pressed", "method", "known")


def test_a_restorer_restores_in_the_pipeline(scan: Scan) -> None:
    found = pipeline.restore(scan, method=deskew.restorer(lambda given: seen(given)))
    assert np.array_equal(found.image, seen(scan).image)
    with pytest.raises(InputError, match="`method` must be a flattener for another light, scale or setting"):
        pipeline.restore(scan, method=deskew.restorer(seen), scale=2.0)
    with pytest.raises(InputError, match="`method` must be a flattener where a sheet is flattened, got `seen`, a rest"):
        flatten(scan.sheet, method=deskew.restorer(seen))


def changed(found: Restoration, **values: Any) -> Restoration:
    parts = {name: getattr(found, name) for name in ("image", "backward_map", "camera", "flattened")}
    return Restoration(**(parts | values))


def with_pixel(backward_map: Array, value: Any) -> Array:
    changed = backward_map.copy()
    changed[5, 6] = value
    return changed


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda r: None, "must return a Restoration, got NoneType"),
        (lambda r: 1 / 0, "failed: ZeroDivisionError: division by zero"),
        (lambda r: changed(r, image=r.image.astype(float)), "must return an image of uint8, as given, got float64"),
        (lambda r: changed(r, image=r.image.tolist()), "must return an image of uint8, as given, got list"),
        (lambda r: changed(r, image=r.image[1:]), r"\(height, width\) of 64 x 48 pixels, got \(47, 64\)"),
        (lambda r: changed(r, image=np.dstack([r.image] * 3)), r"\(height, width\) of 64 x 48 pixels, got \(48, 64, 3"),
        (lambda r: changed(r, backward_map=None), "must return a backward map of floats, got NoneType"),
        (lambda r: changed(r, backward_map=r.backward_map[1:]), r"a backward map of shape \(48, 64, 2\), got \(47"),
        (lambda r: changed(r, backward_map=r.backward_map * np.nan), "shows something, got NaN everywhere"),
        (lambda r: changed(r, backward_map=with_pixel(r.backward_map, np.inf)), "NaN or finite, got infinity or half"),
        (lambda r: changed(r, backward_map=with_pixel(r.backward_map, (np.nan, 1))), "NaN or finite, got infinity or"),
        (lambda r: changed(r, backward_map=with_pixel(r.backward_map, 64.0)), "keep to raw pixels of 64 x 48"),
        (lambda r: changed(r, backward_map=with_pixel(r.backward_map, -0.6)), "keep to raw pixels of 64 x 48"),
        (lambda r: changed(r, camera=LENS), r"the camera `restoration\.view_camera\(scan\.camera\)`, got another"),
        (lambda r: changed(r, camera=None), r"the camera `restoration\.view_camera\(scan\.camera\)`, got another"),
        (lambda r: changed(r, flattened=Flattened(np.zeros((2, 2, 3)), Status.AT_REST)), r"of shape \(9, 9, 3\), or N"),
    ],
)
def test_what_a_restorer_may_not_return_is_a_step_error(scan: Scan, make: Any, words: str) -> None:
    @deskew.restorer
    def restore(given: Scan) -> Any:
        return make(seen(given))

    with pytest.raises(StepError, match=rf"Restoration by `restore` {words}|Restoration by `restore` must .*{words}"):
        restoration.restore_by(restore, scan)


def test_a_dewarper_may_return_a_picture_or_a_pair_and_cannot_change_what_it_was_given(scan: Scan) -> None:
    image = scan.images["white"]
    before = image.copy()

    def dewarp(given: Array) -> Array:
        given[:] = 0
        return given[:10, :20]

    assert restoration.dewarp_by(dewarp, image).image.shape == (10, 20)
    assert np.array_equal(image, before)
    places = np.zeros((5, 4, 2))
    for pair in ((image[:5, :4], places), Dewarped(image[:5, :4], places.astype(np.float32))):
        found = restoration.dewarp_by(lambda given, pair=pair: pair, image)
        assert found.backward_map is not None
        assert found.backward_map.dtype == np.float32
    for wrong, words in (
        (image[:1], "at least 2 x 2"),
        ((image[:5], places), r"a backward map of shape \(5, 64, 2\), got \(5, 4, 2\)"),
        ((image, places, 1), "an image of uint8, as given, got tuple"),
    ):
        with pytest.raises(StepError, match=words):
            restoration.dewarp_by(lambda given, wrong=wrong: wrong, image)
