"""Null controls: what each metric reads of the truth itself, and of a truth that is spoilt by a stated amount."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import PAGE_SIZE_MM, Checkerboard, Lettered, Light, Rig, TrueSheet, Truth
from deskew import metrics, projection, restoration
from deskew.io import sheet_mesh
from deskew.types import Array, DepthMap, Flattened, Floats, Pinhole, Restoration, Sheet, Status
from experiments.reporting import Layout
from experiments.settings import Config
from experiments.studies.bench import configured_rig
from experiments.studies.null_layout import LAYOUT
from experiments.studies.page_reader import cut_to_page
from experiments.studies.study import Study
from experiments.studies.trial_sheets import refuse_sheets, severity
from experiments.studies.views import DETECTORS, restored_corners, seen_corners
from experiments.trials import Outcome, Recorder, TrialKey

SHIFT_MM, SHIFT_PX, STRETCH = 1.0, 1, 1.01
"""How far a page is moved aside, a picture of it, and how many times as long it is made along u."""

_SOFT = Light("soft", even=200.0)
# Of the print of Experiment II.
_CAPITAL_MM, _MARGIN_MM = 10.0, 18.0
# Every so many of the sheet's vertices, along rows and columns, is one of the mesh that is scored.
_THINNED = 15


class NullControls(Study):
    """The truth of a page, and nulls, judged by every metric as if a method had brought them.

    Geometry is judged through the true camera, so that a figure is the metric's own. Nothing is scanned.

    Conditions
    ----------
    `null/itself`
        The truth: the metric's floor.
    `null/shifted`
        The truth moved by 1 mm, a picture by 1 pixel; of depth, 1 mm farther along the line of sight.
    `null/stretched`
        The truth 1 % longer along u.
    `null/unflattened`
        The bent page as it lies: nothing was done.
    `null/another`
        What is right for another page: its shape, its depth, its words, its picture.
    `null/bed`
        Depth of the empty bed, as if there were no page.
    `null/shuffled`
        The true letters in random order; of words, the letters of each.
    `null/nothing`
        No letter read; a picture of bare paper.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a page."""
        refuse_sheets(config, "this experiment draws two mirror folds a trial")
        return Study.plan(self, config)

    def prepare(self, config: Config) -> Rig:
        """Hand on the rig; nothing is calibrated."""
        return configured_rig(config.rig)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Draw a page and another one, spoil the truth of the first and judge what is left."""
        rig: Rig = shared
        record, rng = Recorder(key), key.generator()
        sheet, other = (data_synth.crumpled(rng, PAGE_SIZE_MM, config.sheet.slope_p90_deg) for _ in range(2))
        with record.stage("render"):
            seen = _Seen.photographed(rig, sheet, rng)
        record.add("page", "-", severity(sheet))
        for name, restored in _restorations(seen, other):
            with record.attempt(f"null/{name}"), record.stage("pages"):
                record.add(f"null/{name}", "-", seen.figures(restored))
        with record.stage("depth"):
            for name, depth in _depths(seen, other):
                figures = metrics.depth_error(depth, seen.true_points, prefix="depth")
                record.add(f"null/{name}", "-", figures)
        with record.stage("meshes"):
            _judge_meshes(record, sheet)
        _judge_letters(record, rng)
        with record.stage("pictures"):
            _judge_pictures(record, rig, rng)
        return record.outcome()


@dataclass(frozen=True, slots=True)
class _Seen:
    """A checkered page photographed flat and bent, with its truth."""

    page: Checkerboard
    white: Array
    truth: Truth
    control: Floats

    @classmethod
    def photographed(cls, rig: Rig, sheet: TrueSheet, rng: np.random.Generator) -> _Seen:
        page = Checkerboard()
        flat, flat_truth = data_synth.render(rig, data_synth.flat_sheet(page.page_size_mm), page, rng)
        bent, truth = data_synth.render(rig, sheet, page, rng)
        view = restoration.view_camera(rig.camera)
        seeds = seen_corners(flat_truth, page.corners.reshape(-1, 2), rig.camera, view)
        control = DETECTORS[""](restoration.undistorted_view(flat.white, rig.camera), seeds)
        return cls(page, bent.white, truth, control)

    @property
    def camera(self) -> Pinhole:
        return self.truth.camera

    @property
    def true_points(self) -> Floats:
        """World points on the undistorted grid, (H, W, 3) [mm], NaN off the page."""
        return self.truth.points_at(restoration.undistortion_map(self.camera).astype(np.float64))

    def figures(self, restored: Restoration) -> dict[str, float]:
        """Judge a restoration as Experiment I does, by all its pixels and by its corners."""
        uv = self.truth.page_at(restored.backward_map.astype(np.float64))
        found = DETECTORS[""](restored.image, restored_corners(uv, self.page.corners.reshape(-1, 2)))
        return metrics.dense_error(restored, uv, self.page.page_size_mm) | metrics.corner_distance(
            found, self.control, restored.camera
        )


def _on_bed(sheet: TrueSheet) -> Floats:
    """Return where the sheet's vertices lie flat on the bed, (h, w, 3) [mm]."""
    width, height = sheet.page_size_mm
    flat = sheet.flat * (1.0, -1.0) + (-width / 2, height / 2)
    return np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1)


def _restorations(seen: _Seen, other: TrueSheet) -> Iterator[tuple[str, Restoration]]:
    """Yield the page restored by its true shape, spoilt, by another page's, and not at all."""

    def warped(shape: TrueSheet, flat: Floats) -> Restoration:
        return restoration.texture_quads(
            seen.white, seen.camera, Sheet(shape.vertices), Flattened(flat, Status.AT_REST)
        )

    sheet = seen.truth.sheet
    flat = _on_bed(sheet)
    yield "itself", warped(sheet, flat)
    yield "shifted", warped(sheet, flat + np.array([SHIFT_MM, 0.0, 0.0]))
    yield "stretched", warped(sheet, flat * np.array([STRETCH, 1.0, 1.0]))
    yield "another", warped(other, _on_bed(other))
    view, backward = restoration.view_camera(seen.camera), restoration.undistortion_map(seen.camera)
    yield "unflattened", Restoration(restoration.undistorted_view(seen.white, seen.camera), backward, view)


def _depths(seen: _Seen, other: TrueSheet) -> Iterator[tuple[str, DepthMap]]:
    """Yield the page's true depth, that moved along the line of sight, another page's, and that of the empty bed."""
    camera = projection.ideal(seen.camera)
    rays = projection.rays(camera, projection.pixel_grid(camera.size))

    def depth(z: Floats) -> DepthMap:
        return DepthMap(z, np.isnan(z).astype(np.uint8), camera)

    z = seen.true_points @ camera.R[2] + camera.t[2]
    yield "itself", depth(z)
    # A ray's camera z is 1: as long as it is, so much less is a millimetre along it in z.
    yield "shifted", depth(z + SHIFT_MM / np.linalg.norm(rays, axis=-1))
    there = data_synth.true_sheet_seen(other, seen.camera)
    points = there.points_at(restoration.undistortion_map(seen.camera).astype(np.float64))
    yield "another", depth(points @ camera.R[2] + camera.t[2])
    yield "bed", depth(-projection.centre(camera)[2] / rays[..., 2])


def _judge_meshes(record: Recorder, sheet: TrueSheet) -> None:
    """Score flattenings of the sheet as a mesh."""
    mesh = sheet_mesh(Sheet(sheet.vertices[::_THINNED, ::_THINNED]), sheet.flat[::_THINNED, ::_THINNED])
    assert mesh.texture is not None
    flat = mesh.texture * (1.0, -1.0)
    results = {
        "itself": flat,
        "shifted": flat + np.array([SHIFT_MM, 0.0]),
        "stretched": flat * np.array([STRETCH, 1.0]),
        "unflattened": mesh.vertices[:, :2],
    }
    for name, places in results.items():
        score = metrics.score_flattening(mesh.sheet, mesh.texture, places)
        lying = Flattened(np.column_stack([places, np.zeros(len(places))]), Status.AT_REST)
        record.add(f"null/{name}", "-", score | metrics.sheet_strain(mesh.sheet, lying))


def _judge_letters(record: Recorder, rng: np.random.Generator) -> None:
    """Count the misses of texts that no picture was read for."""
    words, others = data_synth.page_words(rng), data_synth.page_words(rng)
    true = " ".join(words)
    texts = {"itself": true, "another": " ".join(others), "shuffled": metrics.shuffled(true, rng), "nothing": ""}
    for name, text in texts.items():
        found = metrics.count_misses(text, true)
        figures = found.figures() | {"error_rate_percent": 100.0 * found.character_error_rate}
        record.add(f"null/{name}", "-", figures | metrics.match_words(text.split(), words))


def _judge_pictures(record: Recorder, rig: Rig, rng: np.random.Generator) -> None:
    """Compare pictures with that of a flat lettered page in soft light, cut as in Experiment II."""

    def flat_page() -> Array:
        page = Lettered(data_synth.page_words(rng), capital_mm=_CAPITAL_MM, margin_mm=_MARGIN_MM)
        capture = data_synth.photograph(rig, data_synth.flat_sheet(), page, rng, lights=(_SOFT,))
        seen = restoration.undistorted_view(capture.textures[_SOFT.name], rig.camera)
        return cut_to_page(seen, restoration.view_camera(rig.camera), page.page_size_mm)

    control, other = flat_page(), flat_page()
    pictures = {
        "itself": control,
        "shifted": metrics.shifted(control, SHIFT_PX),
        "another": other,
        "nothing": np.full_like(control, np.median(control)),
    }
    for name, picture in pictures.items():
        record.add(f"null/{name}", "-", metrics.image_figures(picture, control))
