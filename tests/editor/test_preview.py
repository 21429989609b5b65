"""What a map does to the page as it is shown: invariances, and the last solution kept for comparison."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from deskew import metrics, pipeline
from deskew.editor.preview import LONGEST, Preview
from deskew.errors import InputError, StepError
from deskew.io import StiffnessMap
from deskew.types import Flattened, Scan, Status

LEAF = slice(150, 430), slice(160, 620)  # the leaf in the photograph, roughly


def two(scan: Scan, leaf: float, sleeve: float = 30.0) -> StiffnessMap:
    labels = np.zeros(scan.camera.size[::-1], np.uint8)
    labels[LEAF] = 1
    return StiffnessMap(labels, {0: sleeve, 1: leaf})


def test_the_first_look_has_nothing_to_differ_from(scan: Scan) -> None:
    preview = Preview(scan)
    with pytest.raises(StepError, match="nothing was solved yet"):
        preview.look("white")
    preview.solve(two(scan, 30.0))
    look = preview.look("white")
    assert (look.difference, look.last) == (None, None)
    assert look.image.shape == look.page.shape == look.strain.shape
    assert 0.5 < look.page.mean() < 0.95
    assert np.isfinite(look.strain[look.page]).mean() > 0.98
    assert not np.isfinite(look.strain[~look.page]).any()
    assert 0.1 < look.figures["strain_rms_percent"] < look.figures["strain_max_percent"] < 3


def test_only_ratios_count(scan: Scan) -> None:
    preview = Preview(scan)
    preview.solve(two(scan, 3.0, 30.0))
    preview.solve(two(scan, 0.3, 3.0))
    assert preview.look("white").figures["moved_max_mm"] < 0.01


def test_what_is_softer_takes_the_strain(scan: Scan) -> None:
    preview = Preview(scan)
    stretched = []
    for leaf in (3.0, 3000.0):
        preview.solve(two(scan, leaf))
        strain = preview.look("white").strain
        middle = tuple(slice(n // 3, 2 * n // 3) for n in strain.shape)
        stretched.append(float(np.sqrt(np.nanmean(strain[middle] ** 2))))
    look = preview.look("white")
    assert stretched[0] > 3 * stretched[1]
    assert 0.3 < look.figures["moved_mean_mm"] < look.figures["moved_max_mm"] < 6
    assert look.figures["difference_rms_grey"] > 5
    assert look.last is not None
    assert look.difference is not None
    shared = look.page & look.last[1]
    assert np.array_equal(np.isfinite(look.difference), shared)
    assert np.allclose(look.difference[shared], look.image[shared].astype(float) - look.last[0][shared])


def test_the_same_stiffness_is_not_solved_again(scan: Scan) -> None:
    preview = Preview(scan)
    preview.solve(two(scan, 3.0))
    preview.solve(two(scan, 300.0))
    moved = preview.look("white").figures["moved_mean_mm"]
    desk = two(scan, 300.0)
    desk.labels[:3] = 1  # beyond the page's border
    preview.solve(desk)
    assert preview.look("white").figures["moved_mean_mm"] == moved


def test_the_difference_is_free_of_a_turn_of_the_whole_page(scan: Scan, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solution that lies elsewhere on the desk is the same page."""
    preview = Preview(scan)
    preview.solve(two(scan, 3.0))
    straight = pipeline.flattening.flatten

    def turned(*args: object, **settings: object) -> Flattened:
        flat = straight(*args, **settings)
        turn = np.array([[np.cos(0.05), np.sin(0.05), 0], [-np.sin(0.05), np.cos(0.05), 0], [0, 0, 1]])
        return replace(
            flat, vertices=flat.vertices @ turn + [4.0, 1.0, 0.0], surface=flat.surface @ turn + [4.0, 1.0, 0.0]
        )

    monkeypatch.setattr("deskew.flattening.flatten", turned)
    preview.solve(two(scan, 0.3, 3.0))
    assert preview.look("white").figures["moved_max_mm"] < 0.01


def test_what_cannot_be_solved_leaves_the_last_look(scan: Scan, monkeypatch: pytest.MonkeyPatch) -> None:
    preview = Preview(scan)
    preview.solve(two(scan, 3.0))
    before = preview.look("white")
    with pytest.raises(InputError):
        preview.solve(StiffnessMap(np.zeros((5, 5), np.uint8), {0: 1.0}))
    diverged = Flattened(scan.sheet.vertices, Status.DIVERGED, "take a smaller step")
    monkeypatch.setattr("deskew.flattening.flatten", lambda *args, **settings: diverged)
    with pytest.raises(StepError, match="Flattening diverged: take a smaller step"):
        preview.solve(two(scan, 300.0))
    assert np.array_equal(preview.look("white").image, before.image)


def test_a_free_scale_measures_what_the_leaf_shrank_by(scan: Scan) -> None:
    preview = Preview(scan)
    preview.solve(two(scan, 0.3), free_scale=True)
    assert 1.5 < preview.look("white").figures["shrink_estimated"] < 2.5  # 1.96 % in truth


def test_strain_shown_is_that_of_the_quads(scan: Scan) -> None:
    preview = Preview(scan)
    preview.solve(two(scan, 3.0))
    sheet = pipeline.with_stiffness(scan, two(scan, 3.0)).sheet
    strain = metrics.quad_strain(sheet, pipeline.flattening.flatten(sheet))
    shown = preview.look("white").strain
    assert np.isin(shown[np.isfinite(shown)].astype(np.float32), strain.astype(np.float32)).all()
    assert np.nanmean(shown) == pytest.approx(strain.mean(), abs=5e-4)


def test_a_large_photograph_is_shown_as_a_small_one_is(scan: Scan) -> None:
    """Half a pixel of the large one would be seen: the camera that shows it looks through the same lens."""
    small, white = scan.camera, scan.images["white"]
    n, size = 3, (3 * small.size[0], 3 * small.size[1])
    K = small.K.copy()
    K[:2] *= n
    K[:2, 2] += (n - 1) / 2
    large = replace(
        scan, images={"white": np.kron(white, np.ones((n, n), np.uint8))}, camera=replace(small, size=size, K=K)
    )
    preview, as_small = Preview(large), Preview(scan)
    labels = np.zeros(size[::-1], np.uint8)
    labels[n * LEAF[0].start : n * LEAF[0].stop, n * LEAF[1].start : n * LEAF[1].stop] = 1
    preview.solve(StiffnessMap(labels, {0: 30.0, 1: 3.0}))
    as_small.solve(two(scan, 3.0))
    look, wanted = preview.look("white"), as_small.look("white").image
    assert max(look.image.shape) <= LONGEST
    found = cv2.resize(look.image, wanted.shape[::-1], interpolation=cv2.INTER_AREA).astype(float)
    inside = (slice(60, -60), slice(60, -60))
    offset, _ = cv2.phaseCorrelate(wanted[inside].astype(float), found[inside])
    assert np.hypot(*offset) < 0.1
    assert np.abs(found - wanted)[inside].mean() < 4


def test_a_light_of_another_format_is_shown_pixel_on_pixel(scan: Scan) -> None:
    finer = cv2.resize(scan.images["white"], None, fx=1.7, fy=1.7, interpolation=cv2.INTER_CUBIC)
    preview = Preview(replace(scan, images={**scan.images, "photograph": finer}))
    preview.solve(two(scan, 3.0))
    white, other = (preview.look(light).image.astype(float) for light in ("white", "photograph"))
    inside = (slice(60, -60), slice(60, -60))
    offset, _ = cv2.phaseCorrelate(white[inside], other[inside])
    assert np.hypot(*offset) < 0.1
    assert np.abs(white - other)[inside].mean() < 3
