"""What noise alone does to each accuracy figure: the least that any reading of the same frames can reach.

Everything here is computed from the rig and the true surface, so it belongs to a study and to no stage. A stripe that
passes a pixel draws a Gaussian of standard deviation s [frames] and height A [grey levels] over the frames; its place
is known no better than the Cramer-Rao bound, with even noise ``sigma_c = (noise / A) sqrt(2 s / sqrt(pi))``. Depth
along the line of sight follows from how far the stripe moves a millimetre; for devices side by side that is the usual
``sigma_Z = (Z^2 / b) sigma_c / f``.

Each pixel is taken by itself. A reading of whole curves (`scan.mode=spatial`) shares frames between neighbours and may
come out below 1 where a surface is even.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import erfc

import data_synth
from data_synth import Page, Rig, RigConfig, Truth
from deskew import projection, restoration
from deskew.acquisition import Sphere
from deskew.types import Floats, Pinhole

_ROUNDING_VARIANCE = 1.0 / 12.0
# Of a pixel's sub-samples, a quarter of a pixel off its centre.
_PIXEL_VARIANCE = 1.0 / 16.0
_STEP_MM = 0.5


@dataclass(frozen=True, slots=True)
class SightNoise:
    """Standard deviation of depth along the line of sight on the undistorted grid, NaN off the surface.

    Attributes
    ----------
    point : (H, W) array
        Of a pixel by itself [mm]: interpolating between four raw pixels averages some noise away.
    averaged : (H, W) array
        What a pixel counts in an average over many [mm]: neighbours share raw pixels, so there nothing is gained.
    """

    point: Floats
    averaged: Floats


def stripe_sigma(amplitude: Floats, level: Floats, width: Floats, config: RigConfig) -> Floats:
    """Cramer-Rao bound of the place of a Gaussian that is sampled once a frame, under the sensor's noise.

    Parameters
    ----------
    amplitude, level : arrays
        Height of the Gaussian and the light without it [grey levels].
    width : array
        Its standard deviation [frames].
    config : RigConfig
        Of the sensor: variance = read + shot * signal, and the rounding to grey levels.

    Returns
    -------
    array
        Frames, that is projector pixels.
    """
    read, shot = config.noise_variance
    dark = read + _ROUNDING_VARIANCE + shot * level
    nodes, step = np.linspace(0.0, 5.0, 41, retstep=True)
    # Twice the half of an even integrand; it is 0 at both ends.
    total = sum(2 * step * t**2 * np.exp(-(t**2)) / (dark + shot * amplitude * np.exp(-(t**2) / 2)) for t in nodes)
    return np.asarray(np.sqrt(width / total) / amplitude)


def sight_noise(rig: Rig, truth: Truth, page: Page, camera: Pinhole) -> SightNoise:
    """Bound of every pixel's depth on a target.

    Parameters
    ----------
    rig : Rig
        The bench.
    truth : Truth
        Of the target.
    page : Page
        What is printed on it: dark ink leaves little amplitude.
    camera : Pinhole
        The calibrated camera, which the undistorted grid belongs to.
    """
    quiet = replace(rig, config=replace(rig.config, noise_scale=0.0))
    capture = data_synth.photograph(quiet, truth.sheet, page, 0)
    points = truth.points_at(projection.pixel_grid(rig.camera.size).astype(np.float64))
    sights = points - projection.centre(rig.camera)
    sights = sights / np.linalg.norm(sights, axis=-1, keepdims=True)
    here = projection.project(rig.projector, points)
    ahead, behind = (projection.project(rig.projector, points + sign * _STEP_MM * sights) for sign in (1, -1))
    moved = (ahead - behind) / (2 * _STEP_MM)
    contrast = np.maximum(capture.white.astype(np.float64) - capture.black, 0.5)
    information = np.zeros(contrast.shape)
    for k in range(2):
        down, right = np.gradient(here[..., k])
        config = rig.config
        footprint = (config.camera_psf_sigma_px**2 + _PIXEL_VARIANCE) * (down**2 + right**2)
        lines = config.stripe_width_px
        width = np.sqrt(footprint + config.projector_blur_sigma_px**2 + lines**2 / 12)
        # All single lines together are the white frame, so the area under the Gaussian is known.
        amplitude = lines * contrast / (np.sqrt(2 * np.pi) * width)
        information += (moved[..., k] / stripe_sigma(amplitude, capture.black.astype(np.float64), width, config)) ** 2
    return _on_grid(1 / information, restoration.undistortion_map(camera).astype(np.float64))


def _on_grid(variance: Floats, at: Floats) -> SightNoise:
    """Carry the variance (h, w) of raw pixels through bilinear interpolation at raw pixels `at` (H, W, 2)."""
    height, width = variance.shape
    inside = (at >= 0).all(axis=-1) & (at[..., 0] < width - 1) & (at[..., 1] < height - 1)
    x, y = np.where(inside[..., None], at, 0.0).transpose(2, 0, 1)
    column, row = x.astype(np.intp), y.astype(np.intp)
    fx, fy = x - column, y - row
    point, averaged = np.zeros(x.shape), np.zeros(x.shape)
    for dy, dx in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = (fy if dy else 1 - fy) * (fx if dx else 1 - fx)
        point += weight**2 * variance[row + dy, column + dx]
        averaged += weight * variance[row + dy, column + dx]
    return SightNoise(*(np.where(inside, np.sqrt(values), np.nan) for values in (point, averaged)))


def root_mean_square(sigma: Floats) -> float:
    """Root mean square of standard deviations; NaN is left out."""
    return float(np.sqrt(np.nanmean(sigma**2)))


def trimmed_range(sigma: Floats, share: float) -> float:
    """Range that many independent normal deviations (N,) fill once the `share` of the largest is discarded [mm]."""
    known = sigma[np.isfinite(sigma)]
    scale = float(known.max())
    return 2 * scale * float(brentq(lambda q: float(erfc(q * scale / (np.sqrt(2) * known)).mean()) - share, 0.0, 8.0))


def sphere_covariance(points: Floats, sigma: Floats, sphere: Sphere) -> Floats:
    """Covariance of a fitted sphere's centre and radius under noise of its points.

    Parameters
    ----------
    points : (N, 3) array
        On the sphere [mm].
    sigma : (N,) array
        Standard deviation of each one's radial distance [mm], independent.
    sphere : Sphere
        True one.

    Returns
    -------
    (4, 4) array
        Of centre and radius [mm^2], to first order.
    """
    away = points - sphere.centre
    design = np.column_stack([away / np.linalg.norm(away, axis=1, keepdims=True), np.ones(len(points))])
    gain = np.linalg.pinv(design)
    return np.asarray((gain * sigma**2) @ gain.T)


def corner_sigma_px(contrast: float, level: float, edge_px: float, config: RigConfig) -> float:
    """Cramer-Rao bound of a checkerboard corner along one axis, seen in one frame [camera px].

    An edge of contrast C, blurred by s, holds ``C^2 / (2 sqrt(pi) s noise^2)`` of information a pixel of its length.

    Parameters
    ----------
    contrast, level : float
        White minus ink and ink [grey levels].
    edge_px : float
        Length of edge that belongs to the corner: half a square to either side.
    config : RigConfig
        Blur and noise.
    """
    read, shot = config.noise_variance
    noise = read + shot * (level + contrast / 2) + _ROUNDING_VARIANCE
    blur = np.sqrt(config.camera_psf_sigma_px**2 + _PIXEL_VARIANCE)
    return float(np.sqrt(2 * np.sqrt(np.pi) * blur * noise / edge_px) / contrast)
