"""One page on its way from the scan to the flat: the states of the paper's dynamics, its pictures and its error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

import data_synth
from data_synth import Truth
from deskew import flattening, metrics, pipeline, restoration
from deskew.errors import InputError, StepError, require
from deskew.io import read_arrays, write_arrays
from deskew.projection import project
from deskew.recipes import recipe_for
from deskew.types import WHITE, Array, Capture, Floats, Scan, Sheet, Status
from experiments.settings import Config
from experiments.studies.bench import calibrated_bench
from experiments.trials import fingerprint

PAPER, BEST = "paper_euler", "spring"
N_FRAMES = 24
"""States that are kept, the first and the last among them."""

_SLOPE_DEG = 25.0
_READOUT = data_synth.Format((1996, 1450), (3.0, 2.95), (40.0, 20.0))
# Pixels of a kept picture for each of the scan's, and the desk that is left around the page [scan px].
_PICTURE_SCALE, _MARGIN_PX = 2.4, 3.0
# Steps between states among which those to be kept are chosen.
_LOOKED_AT = 400
_ARRAYS = ("frames", "steps", "times_s", "picture_xy", "error_mm", "best_error_mm")
_PICTURE = "light_"


@dataclass(frozen=True, slots=True)
class FallingSheet:
    """A page that falls flat.

    Attributes
    ----------
    frames : (K, R, C, 3) array
        Vertices, from the scanned shape to the flat one [mm].
    steps : (K,) int array
        Steps of the integrator before each state.
    times_s : (K,) array
        Time of the simulation [s].
    picture_xy : (R, C, 2) array
        Where each vertex lies in the pictures, across and down, 0 to 1.
    error_mm : (R, C) array
        Distance of each flattened vertex from its true place after the best rotation and translation [mm]; NaN for one
        that lies beside the page.
    best_error_mm : (R, C) array
        The same by this project's best method, on its own mesh.
    pictures : mapping of light to (h, w) uint8 array
        The page as it lies under each, cut out.
    """

    frames: Floats
    steps: npt.NDArray[np.int64]
    times_s: Floats
    picture_xy: Floats
    error_mm: Floats
    best_error_mm: Floats
    pictures: Mapping[str, npt.NDArray[np.uint8]]


def record_falling_sheet(seed: int, calibrations: Path) -> FallingSheet:
    """Photograph a crumpled manuscript under five lights, scan it, let it fall, and measure it.

    Parameters
    ----------
    seed : int
        Of the sheet, the page, the noise and the calibration.
    calibrations : Path
        Folder of what calibrating the rig gave; made if it is missing.

    Raises
    ------
    StepError
        If the page does not come to rest flat.
    """
    bench = calibrated_bench(Config("textures", seed=seed, trials=1, calibrations=str(calibrations)), "temporal")
    rng = np.random.default_rng(np.random.SeedSequence([seed]))
    page = data_synth.hidden_manuscript(rng)
    sheet = data_synth.crumpled(rng, page.page_size_mm, _SLOPE_DEG)
    lights = data_synth.standard_lights(_READOUT)
    capture, truth = data_synth.render(bench.rig, sheet, page, rng, lights=lights)
    scans = {method: pipeline.scan_by(recipe_for(method), capture, bench.calibration) for method in (PAPER, BEST)}
    frames, steps, times = fallen(scans[PAPER].sheet)
    best = flattening.flatten(scans[BEST].sheet, method=BEST).vertices
    pictures, picture_xy = _cut_out(capture, project(bench.calibration.camera, scans[PAPER].sheet.vertices))
    return FallingSheet(
        frames,
        steps,
        times,
        picture_xy,
        vertex_error(frames[-1], _true_places(scans[PAPER], truth)),
        vertex_error(best, _true_places(scans[BEST], truth)),
        pictures,
    )


def fallen(sheet: Sheet, n_frames: int = N_FRAMES) -> tuple[Floats, npt.NDArray[np.int64], Floats]:
    """Return states of the paper's dynamics, from the sheet as it was scanned to the flat page.

    A run that is ended after n steps is in the very state that a longer one passes through there. Of all states those
    are kept between which the sheet moves alike, since it falls in a few hundredths of a second and settles for long.

    Parameters
    ----------
    sheet : Sheet
        Grid [mm].
    n_frames : int
        States to keep, fewer than the run has steps.

    Returns
    -------
    frames : (n_frames, R, C, 3) array
        Vertices [mm].
    steps : (n_frames,) int array
        Steps of explicit Euler before each.
    times_s : (n_frames,) array
        Simulated time [s].

    Raises
    ------
    StepError
        If the sheet does not come to rest flat.
    """
    end = flattening.flatten(sheet, method=PAPER)
    if end.status is not Status.AT_REST:
        raise StepError(f"The recorded sheet ended {end.status}, not flat: {end.remedy}")
    start = sheet.vertices - [0.0, 0.0, sheet.vertices[..., 2].min()]
    n_steps = int(end.counters["steps"])
    # It falls fast and settles slowly: every early step is looked at, and ever fewer later ones.
    looked_at = np.unique(np.geomspace(1, n_steps - 1, _LOOKED_AT).astype(int))
    between = [flattening.flatten(sheet, method=PAPER, max_steps=int(n)) for n in looked_at]
    states = [start, *(state.vertices for state in between), end.vertices]
    steps = np.array([0, *looked_at, n_steps])
    times = np.array([0.0, *(state.counters["time"] for state in between), end.counters["time"]])
    left = np.array([np.sqrt(((state - end.vertices) ** 2).sum(axis=-1).mean()) for state in states])
    # Never upwards, so that each share of the way has one first state that has gone it.
    way = 1 - np.minimum.accumulate(left) / left[0]
    kept = np.searchsorted(way, np.linspace(0.0, 1.0, n_frames))
    # No state twice: each comes after the one before it, and leaves as many for those after it.
    rank = np.arange(n_frames)
    kept = np.minimum(np.maximum.accumulate(kept - rank) + rank, len(states) - n_frames + rank)
    return np.stack([states[i] for i in kept]), steps[kept], times[kept]


def vertex_error(flat: Floats, truth: Floats) -> Floats:
    """Return how far flattened vertices lie from their true places after the best rotation and translation.

    Parameters
    ----------
    flat : (R, C, 3) array
        Flattened vertices [mm].
    truth : (R, C, 2) array
        (u, -v) of what each vertex shows [mm], NaN beside the page.

    Returns
    -------
    (R, C) array
        Distances [mm]; NaN where the truth is.
    """
    known = np.isfinite(truth).all(axis=-1)
    require(int(known.sum()) >= 3, "truth", "be known of 3 or more vertices", int(known.sum()))
    rigid = metrics.fit_rigid(flat[known][:, :2], truth[known])
    return np.asarray(np.linalg.norm(rigid.apply(flat[..., :2]) - truth, axis=-1))


def _true_places(scan: Scan, truth: Truth) -> Floats:
    """Return (u, -v) of what the camera sees at each vertex of a scanned grid."""
    return np.asarray(truth.page_at(project(scan.camera, scan.sheet.vertices)) * np.array([1.0, -1.0]))


def _cut_out(capture: Capture, pixels: Floats) -> tuple[dict[str, npt.NDArray[np.uint8]], Floats]:
    """Cut the page out of every image at one scale; return the pictures and where the vertices lie in them."""
    corner = np.floor(pixels.min(axis=(0, 1)) - _MARGIN_PX)
    extent = np.ceil(pixels.max(axis=(0, 1)) + _MARGIN_PX) - corner
    size = np.rint(extent * _PICTURE_SCALE).astype(int)
    # All images of one format share one map.
    found = restoration.register(capture.textures["above"], capture.white, "above")
    maps = dict.fromkeys(capture.textures, (found.scale, found.offset)) | {WHITE: (np.ones(2), np.zeros(2))}
    pictures = {}
    for name, image in {WHITE: capture.white, **capture.textures}.items():
        scale, offset = maps[name]
        # Of a picture's pixel (x, y) the scan's is corner + (x + 0.5, y + 0.5) / factor - 0.5.
        factor = size / extent
        linear, shift = scale / factor, scale * (corner + 0.5 / factor - 0.5) + offset
        matrix = np.array([[linear[0], 0.0, shift[0]], [0.0, linear[1], shift[1]]])
        how = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        cut: Array = cv2.warpAffine(image, matrix, (int(size[0]), int(size[1])), flags=how)
        pictures[name] = _to_full_range(cut)
    return pictures, np.asarray((pixels - corner + 0.5) / extent)


def _to_full_range(image: Array) -> npt.NDArray[np.uint8]:
    """Stretch grey levels to the whole range, as a viewer would: ultra-violet light is dim."""
    bright = float(np.percentile(image, 99.8))
    return np.clip(np.rint(image * (245.0 / max(bright, 1.0))), 0, 255).astype(np.uint8)


def kept_falling_sheet(seed: int, folder: Path, calibrations: Path) -> FallingSheet:
    """Read a recorded sheet from a folder, or record it and leave it there; other sources record another one.

    Parameters
    ----------
    seed, calibrations
        As of :func:`record_falling_sheet`.
    folder : Path
        Made if it is missing.

    Raises
    ------
    InputError
        If the folder cannot be made, or what it holds is damaged.
    StepError
        As of :func:`record_falling_sheet`.
    """
    path = folder / f"{fingerprint({'falling_sheet': seed})}.npz"
    if path.is_file():
        return _unpacked(read_arrays(path), path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"`{folder}` must be a folder that can be written, got {error.strerror}.") from error
    sheet = record_falling_sheet(seed, calibrations)
    arrays: dict[str, Array] = {name: getattr(sheet, name) for name in _ARRAYS}
    write_arrays(arrays | {f"{_PICTURE}{name}": image for name, image in sheet.pictures.items()}, path)
    return sheet


def _unpacked(arrays: Mapping[str, Array], path: Path) -> FallingSheet:
    require(set(_ARRAYS) <= set(arrays), str(path), f"hold the arrays {', '.join(_ARRAYS)}", ", ".join(arrays))
    pictures = {n.removeprefix(_PICTURE): image for n, image in arrays.items() if n.startswith(_PICTURE)}
    return FallingSheet(**{name: arrays[name] for name in _ARRAYS}, pictures=pictures)
