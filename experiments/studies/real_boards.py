"""Real captures: each calibration board scanned as if it were a page, with the devices calibrated on the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np

from deskew import acquisition, io, metrics, pipeline, projection, restoration
from deskew.acquisition import BoardView, DenoiseSettings, DepthSettings, InkSettings, Outline
from deskew.errors import InputError, require
from deskew.plugins import Kind
from deskew.recipes import Recipe
from deskew.types import Array, Board, Calibration, Capture, Floats, Pinhole, Restoration, Scan, Sheet
from experiments.reporting import Column, Layout, Montage
from experiments.settings import Config
from experiments.studies.bench import calibration_figures
from experiments.studies.flattened import flattening_figures
from experiments.studies.methods import method_of, require_methods
from experiments.studies.recipes import methods_by_recipe
from experiments.studies.study import AbsentError, Study
from experiments.studies.trial_sheets import refuse_sheets
from experiments.trials import Outcome, Recorder, TrialKey, content_digest, trial_keys

# The captures' own README: 9 x 7 inner corners, 75 units a square, five poses.
BOARD = Board((9, 7), 75.0, "units")
N_BOARDS = 5
CAPTURES = "kamino410/procam-calibration at 09e58d5, sample_data"
CAPTURES_SHA256 = "be29c9292c2df151e1f1b02b169df48c26c58a08e71a2af4751feab7878664e1"
# Shortest length that counts; the board's inner corners span 600 x 450 units.
_LENGTH_MIN = 400.0
# Within this distance of a corner depth is averaged by a plane [px]; a square is 60 to 90 px wide.
_RADIUS_PX = 28
# Ink is too dark to be decoded: depth is carried over a black square, up to this far from its edge [px].
_INK_PX = 100.0
# The gates are meant for millimetres at 800 mm; these boards lean far and stand at 3000 to 3600 units.
_DEPTH = DepthSettings(z_min_mm=-1500.0, z_max_mm=1500.0, neighbour_mm=6.0, jump_mm=15.0)


@dataclass(frozen=True, slots=True)
class _Boards:
    """All poses as both devices see them; frames stay on disk."""

    captures: tuple[Capture, ...]
    views: tuple[BoardView, ...]


class RealBoards(Study):
    """A board is left out, the devices are calibrated on the other four, and the board is scanned and flattened.

    Conditions
    ----------
    `calibration`
        All five boards.
    `left_out`
        The scan of the board that the calibration has not seen: lengths over 400 units, deviation from a plane, and the
        share of its pixels that have depth, ink included.
    `restored`
        The restored board's corners against exact squares, a row of figures for each method.
    """

    layout: ClassVar[Layout] = Layout(
        "Real boards, each scanned through the calibration on the others",
        "Lengths in units of the board (a square has 75). The restored corners are compared with exact squares after a "
        "rotation and a translation alone.",
        (
            Column("calib_camera_rms_px", "camera RMS [px]", 3, headline=True),
            Column("calib_projector_rms_px", "projector RMS [px]", 3, headline=True),
            Column("calib_stereo_rms_px", "stereo RMS [px]", 3, headline=True),
            Column("length_error_units", "length error, RMS [units]", 3, headline=True, rms=True),
            Column("plane_mean_abs_units", "mean deviation from a plane [units]", 3, headline=True),
            Column("depth_coverage", "coverage", 4, headline=True),
            Column("corner_rigid_mean_units", "restored corners, mean [units]", 3, headline=True),
            Column("corner_rigid_max_units", "restored corners, max [units]", 3, headline=True),
            Column("corners_missing", "missing", 0, headline=True),
            Column("corners_expected", "expected", 0),
            Column("at_rest", "at rest", headline=True, share=True),
        ),
        montages=(
            Montage(
                "boards",
                (("as the camera sees it", "board_{trial}_seen"), ("restored, from above", "board_{trial}_restored")),
                item="board",
            ),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a board left out, and one for all boards."""
        # A picture alone has no units to be compared in.
        require_methods(config, (Kind.FLATTENER, Kind.RESTORER))
        require(config.trials <= N_BOARDS, "trials", f"be at most {N_BOARDS}, one a board", config.trials)
        refuse_sheets(config, "this experiment scans boards")
        path = config.real_boards.path
        if path is None:
            raise AbsentError("real_boards.path names no folder; README says where the captures are to be had")
        if not Path(path).is_dir():
            raise InputError(f"`real_boards.path` must be a folder, got {path}.")
        found = content_digest(sorted(Path(path).glob("capture_*/graycode_*.png")), Path(path))
        require(found == CAPTURES_SHA256, "real_boards.path", f"hold the frames of {CAPTURES}", f"SHA-256 {found[:12]}")
        return [TrialKey(config.experiment, "calibration", "-", 0, config.seed), *trial_keys(config)]

    def inputs(self, config: Config) -> Mapping[str, Path]:
        """Name the captures."""
        return {"real_boards.path": Path(str(config.real_boards.path))}

    def prepare(self, config: Config) -> _Boards:
        """Find the board in every pose."""
        captures = tuple(io.read_procam_graycode(Path(str(config.real_boards.path))))
        require(len(captures) == N_BOARDS, "real_boards.path", f"hold {N_BOARDS} captures", len(captures))
        views = tuple(acquisition.view_board(BOARD, capture, pipeline.decode(capture)) for capture in captures)
        return _Boards(captures, views)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Calibrate, scan the board that was left out, flatten it, measure."""
        boards: _Boards = shared
        record = Recorder(key)
        with record.stage("calibrate"):
            kept = [v for i, v in enumerate(boards.views) if key.condition == "calibration" or i != key.trial]
            calibration = acquisition.calibrate(BOARD, kept)
        residuals = calibration_figures(calibration, "units")
        if key.condition == "calibration":
            record.add("calibration", "-", residuals)
            return record.outcome()
        record.add("left_out", "-", residuals)
        _measure_board(record, config, boards.captures[key.trial], boards.views[key.trial], calibration)
        return record.outcome()


def _measure_board(
    record: Recorder, config: Config, capture: Capture, view: BoardView, calibration: Calibration
) -> None:
    with record.stage("scan"):
        decoded = pipeline.decode(capture)
        depth = acquisition.depth_map(calibration, decoded, _DEPTH)
    found = acquisition.board_accuracy(BOARD, view.corners, calibration.camera, depth, _LENGTH_MIN, _RADIUS_PX)
    figures = {"length_error_units": found.length_rms_mm, "plane_mean_abs_units": found.plane.mean_abs_mm}
    record.add("left_out", "-", figures | {"depth_coverage": found.coverage})
    seen = acquisition.corners_in_view(calibration.camera, depth.camera, view.corners)
    points = acquisition.scanned_points(depth, seen, _RADIUS_PX)
    R, t = _onto_bed(calibration.camera, points)
    record.add("left_out", "-", _as_rows(R, t))
    on_bed = replace(
        calibration, camera=_in_world(calibration.camera, R, t), projector=_in_world(calibration.projector, R, t)
    )
    outline = acquisition.straight_outline(acquisition.board_border(BOARD, seen))
    for recipe, methods in methods_by_recipe(config, capture.pattern).items():
        with record.stage("mesh"):
            scan = _meshed(config, recipe, capture, on_bed, outline)
        for method in methods:
            with record.attempt("restored", method):
                with record.stage("restore", "restored", method):
                    restored = pipeline.restore(scan, method=method_of(config, method))
                _measure_restored(record, method, scan.sheet, restored, seen)
                if method == config.methods[0]:
                    name = f"board_{record.key.trial}"
                    record.picture(f"{name}_seen", restoration.undistorted_view(capture.white, calibration.camera))
                    record.picture(f"{name}_restored", _from_above(restored))


def _meshed(config: Config, recipe: Recipe, capture: Capture, on_bed: Calibration, outline: Outline) -> Scan:
    """Scan the board as its method asks."""
    return pipeline.scan(
        capture,
        on_bed,
        shape=(config.mesh.rows, config.mesh.columns),
        outline=outline,
        settings=pipeline.decoder_for(recipe, capture.pattern),
        ink=InkSettings() if recipe.ink else None,
        depth=_DEPTH,
        denoise=DenoiseSettings() if recipe.denoise else None,
        max_hole_px=_INK_PX,
    )


def _measure_restored(record: Recorder, method: str, sheet: Sheet, restored: Restoration, seeds: Floats) -> None:
    """Compare restored corners with exact squares; the board is flat, so they lie within pixels of where they were."""
    found = acquisition.refine_saddle(restored.image, seeds, search_px=8.0)
    here = np.isfinite(found).all(axis=1)
    figures = {"corners_missing": float((~here).sum()), "corners_expected": float(len(found))}
    places = projection.onto_bed(restored.camera, found[here])[:, :2]
    exact = acquisition.board_points(BOARD)[here, :2]
    distance = np.linalg.norm(metrics.fit_rigid(places, exact).apply(places) - exact, axis=1)
    figures |= {"corner_rigid_mean_units": float(distance.mean()), "corner_rigid_max_units": float(distance.max())}
    if restored.flattened is not None:
        figures |= flattening_figures(sheet, restored.flattened)
    record.add("restored", method, figures)


def _onto_bed(camera: Pinhole, points: Floats) -> tuple[Floats, Floats]:
    """Return the movement ``X' = R X + t`` that lays the board's best-fit plane onto Z = 0, X along its rows."""
    known = points[np.isfinite(points).all(axis=1)]
    normal, offset = acquisition.fit_plane(known)
    # Z points towards the camera.
    if normal @ projection.centre(camera) < offset:
        normal, offset = -normal, -offset
    grid = points.reshape(BOARD.shape[1], BOARD.shape[0], 3)
    along = np.nanmean(grid[:, -1] - grid[:, 0], axis=0)
    x = along - (along @ normal) * normal
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(normal, x), normal])
    middle = known.mean(axis=0)
    return R, -R @ (middle - (middle @ normal - offset) * normal)


def _as_rows(R: Floats, t: Floats) -> dict[str, float]:
    """Name the movement onto the bed: a rotation vector and a translation."""
    turn = cv2.Rodrigues(R)[0].ravel()
    named = {f"onto_bed_r{axis}_rad": float(value) for axis, value in zip("xyz", turn, strict=True)}
    return named | {f"onto_bed_t{axis}_units": float(value) for axis, value in zip("xyz", t, strict=True)}


def _in_world(device: Pinhole, R: Floats, t: Floats) -> Pinhole:
    """Return the device after the world was moved by ``X' = R X + t``."""
    return Pinhole(device.size, device.K, device.distortion, device.R @ R.T, device.t - device.R @ R.T @ t)


def _from_above(restored: Restoration, unit_px: float = 1.0) -> Array:
    """Return the flattened board as seen straight from above, `unit_px` pixels a unit: a view that shows any bend."""
    nx, ny = BOARD.shape
    half_x, half_y = (BOARD.square * (n + 1) / 2 for n in (nx, ny))
    x, y = np.meshgrid(np.arange(-half_x, half_x, 1 / unit_px), np.arange(half_y, -half_y, -1 / unit_px))
    pixels = projection.project(restored.camera, np.stack([x, y, 0 * x], axis=-1)).astype(np.float32)
    return np.asarray(cv2.remap(restored.image, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR))
