"""A checkered page photographed flat and bent, and what is measured on restored pictures of it (section 4.1)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from data_synth import Checkerboard, Truth
from deskew import metrics, restoration
from deskew.types import Array, Capture, DepthMap, Dewarped, Floats, Pinhole, Restoration, Scan
from experiments.studies.flattened import flattening_figures
from experiments.studies.placed import Placed, board_corners
from experiments.studies.views import DETECTORS, Detector, map_error_mm, restored_corners, seen_corners
from experiments.trials import Recorder, reason_of

PAPER_PX, PAPER_MM = 0.5, 0.25
"""The paper's result for the mean distance of corners, in words: within half a pixel and within 0.25 mm."""


class CheckeredPage:
    """One bent page's figures, recorded against its flat control.

    Each detector has its own condition, and what breaks before the detectors come to it fails all of them: a page that
    cannot be scanned or restored is a failed row of each, not a missing one.

    Parameters
    ----------
    record : Recorder
        Of the trial.
    page : Checkerboard
        What is printed.
    truth : Truth
        Of the bent page's capture.
    camera : Pinhole
        As calibrated; control and restored pictures are its undistorted views.
    detectors : mapping of suffix to Detector
        The conditions' names go on with the suffix.
    """

    def __init__(
        self,
        record: Recorder,
        page: Checkerboard,
        truth: Truth,
        camera: Pinhole,
        detectors: Mapping[str, Detector] = DETECTORS,
    ) -> None:
        self.record, self.page, self.truth, self.camera, self.detectors = record, page, truth, camera, detectors
        self.view: Pinhole = restoration.view_camera(camera)
        self.corners_mm: Floats = page.corners.reshape(-1, 2)
        self.control: dict[str, Floats] = {}

    def find_control(self, flat: Capture, truth: Truth) -> Floats:
        """Find the control's corners by each detector; return where they really are [px of the view]."""
        image = restoration.undistorted_view(flat.white, self.camera)
        true = seen_corners(truth, self.corners_mm, self.camera, self.view)
        self.control = {name: detect(image, true) for name, detect in self.detectors.items()}
        return true

    def measure_control(self, flat: Capture, truth: Truth) -> None:
        """Find the control's corners and record each detector's error against the truth."""
        true = self.find_control(flat, truth)
        for name, found in self.control.items():
            distance = metrics.corner_distance(found, true, self.view)
            # Without any alignment, which would hide a shift of all corners alike.
            error = np.nansum((found - true) ** 2, axis=1)[np.isfinite(found[:, 0])]
            self.record.add(f"control{name}", "-", distance | {"detector_rms_px": float(np.sqrt(error.mean()))})

    def measure_unrestored(self, capture: Capture, condition: str = "unrestored") -> Array:
        """Measure the bent page as it is; return its undistorted view."""
        image = restoration.undistorted_view(capture.white, self.camera)
        seeds = seen_corners(self.truth, self.corners_mm, self.camera, self.view)
        for name, detect in self.detectors.items():
            with self.record.attempt(f"{condition}{name}", "-"):
                self._compare(f"{condition}{name}", "-", detect(image, seeds), self.control[name])
        return image

    def measure_restored(self, condition: str, method: str, scan: Scan, restored: Restoration) -> None:
        """Record what is measured on a restoration, whether its sheet came to rest or not."""
        try:
            uv = self.truth.page_at(restored.backward_map.astype(np.float64))
            figures = metrics.dense_error(restored, uv, self.page.page_size_mm)
            if restored.flattened is not None:
                figures |= flattening_figures(scan.sheet, restored.flattened)
        except Exception as error:
            self.fail(condition, method, error)
            return
        self.record.add(condition, method, figures)
        seeds = restored_corners(uv, self.corners_mm)
        for name, detect in self.detectors.items():
            with self.record.attempt(f"{condition}{name}", method):
                found = detect(restored.image, seeds)
                self._compare(f"{condition}{name}", method, found, self.control[name])
                apart = map_error_mm(uv, found, self.corners_mm)
                self.record.add(f"{condition}{name}", method, {"picture_to_map_rms_mm": apart})

    def measure_dewarped(self, condition: str, method: str, dewarped: Dewarped) -> Array | None:
        """Record what is measured on a picture that was flattened by itself; return it in the control's frame.

        It has a size of its own, so it is laid onto the control by the corners that are found in it: by its backward
        map and the truth, or as a board like any other if it has none. There are no rigid figures, since it has no
        scale.
        """
        control = next(iter(self.control.values()))
        try:
            if dewarped.backward_map is None:
                figures, seeds = {}, board_corners(dewarped.image, self.page.squares, self.view.size)
            else:
                uv = self.truth.page_at(dewarped.backward_map.astype(np.float64))
                figures = metrics.similar_dense_error(dewarped, uv, self.page.page_size_mm)
                seeds = restored_corners(uv, self.corners_mm)
            placed = Placed.onto(self.view, dewarped.image, seeds, control)
        except Exception as error:
            self.fail(condition, method, error)
            return None
        self.record.add(condition, method, figures)
        for name, detect in self.detectors.items():
            with self.record.attempt(f"{condition}{name}", method):
                found = detect(placed.image, placed.to_view.apply(seeds))
                distance = metrics.corner_distance(found, self.control[name], self.view)
                figures = {metric: value for metric, value in distance.items() if "rigid" not in metric}
                figures |= metrics.similar_corner_distance(placed.to_own.apply(found), self.control[name], self.view)
                self.record.add(f"{condition}{name}", method, figures | _kept(distance))
        return placed.image

    def depth_figures(self, depth: DepthMap, prefix: str = "depth_raw") -> dict[str, float]:
        """Measure a depth map against the truth."""
        true_points = self.truth.points_at(restoration.undistortion_map(self.camera).astype(np.float64))
        return metrics.depth_error(depth, true_points, prefix=prefix)

    def fail(self, condition: str, method: str, error: Exception) -> None:
        """Record why a condition has no figures, for every detector."""
        for name in self.detectors:
            self.record.fail(f"{condition}{name}", method, reason_of(error))

    def _compare(self, condition: str, method: str, found: Floats, control: Floats) -> None:
        distance = metrics.corner_distance(found, control, self.view)
        self.record.add(condition, method, distance | _kept(distance))


def _kept(distance: Mapping[str, float]) -> dict[str, float]:
    """Say whether a page keeps the paper's limits, which are of affine figures."""
    kept = distance["corner_mean_px"] <= PAPER_PX and distance["corner_mean_mm"] <= PAPER_MM
    return {"meets_paper": float(kept)}
