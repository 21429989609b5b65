"""Line-sweep decoding: the projector coordinate that each camera pixel saw (section 2.3).

Two readings of the same frames, `temporal` and `spatial`, behind one function. Both stream: a sweep is never held.
"""

from __future__ import annotations

import numpy as np

from deskew.acquisition.frames import read_frames
from deskew.acquisition.projectorcheck import join_checks, light_to_judge
from deskew.acquisition.sweep import Scene, Sweep, SweepSettings, still_scene
from deskew.acquisition.sweep_spatial import decode_spatial
from deskew.acquisition.sweep_temporal import decode_temporal
from deskew.acquisition.sweepcheck import SweepWatch
from deskew.errors import StepError, require
from deskew.types import Capture, Correspondence, Frames, PatternKind, ProjectorCheck, Reason

__all__ = ["SweepSettings", "decode_sweep"]


def _decode(frames: Frames, name: str, scene: Scene, settings: SweepSettings) -> tuple[Sweep, ProjectorCheck]:
    n_frames = len(frames)
    require(n_frames >= settings.window, name, f"hold at least {settings.window} frames, one window", n_frames)
    along_rows = name == "columns"
    judged = light_to_judge(scene.white, scene.black, scene.saturated_level)
    watch = SweepWatch(judged, columns=along_rows)
    grey = map(watch.passing, read_frames(frames, scene.white, name))
    reading = decode_temporal if settings.mode == "temporal" else decode_spatial
    return reading(grey, n_frames, scene, settings, along_rows=along_rows), watch.check(name)


def decode_sweep(capture: Capture, settings: SweepSettings | None = None) -> Correspondence:
    """Decode both sweeps of a capture.

    Parameters
    ----------
    capture : Capture
        A `LINE_SWEEP` capture; `columns` and then `rows` are each iterated once, in order.
    settings : SweepSettings, optional
        How to read it; by default temporal Gaussian peaks.

    Returns
    -------
    Correspondence
        Projector column and row of each raw camera pixel [px], float32, and the reason where there is none: that of
        the columns if they failed, else that of the rows.

    Raises
    ------
    InputError
        The capture is no line sweep, a frame differs from `white` in shape or type, or too few or too many come.
    StepError
        Reading a frame failed, or no pixel saw a stripe.
    """
    settings = settings or SweepSettings()
    kind = capture.pattern
    require(kind is PatternKind.LINE_SWEEP, "pattern", f"be {PatternKind.LINE_SWEEP} for decode_sweep", kind)
    scene = still_scene(capture, settings)
    columns, columns_check = _decode(capture.columns, "columns", scene, settings)
    rows, rows_check = _decode(capture.rows, "rows", scene, settings)
    reason = np.where(columns.reason != Reason.OK, columns.reason, rows.reason).astype(np.uint8)
    ok = reason == Reason.OK
    if not ok.any():
        names = {
            Reason(value).name: int(count) for value, count in zip(*np.unique(reason, return_counts=True), strict=True)
        }
        raise StepError(
            f"decode_sweep found no stripe in any pixel ({names}): check that white, black and the frames show the "
            "same still scene, and that frame i lights projector line i."
        )
    missing = np.float32(np.nan)
    return Correspondence(
        np.where(ok, columns.position, missing),
        np.where(ok, rows.position, missing),
        reason,
        (columns.width, rows.width) if settings.mode == "spatial" else None,
        join_checks(columns_check, rows_check),
    )
