"""Is the projector linear, and in step with the camera? The frames of every pattern can tell.

Light adds up: a pattern and its inverse make the white frame, all lines of a sweep make it too, and the steps of a
fringe are a sine. What is left over says what is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, lgamma, log

import numpy as np

from deskew.types import Array, Floats, Fringe, ProjectorCheck

STRAY_MAX = 0.02
"""Share of a frame's light, root mean square, that may seem to come from another frame: twice a noisy healthy rig's."""

FEWEST_PIXELS = 1000
"""Bright pixels that make a judgement."""

GAMMA_RANGE = (0.95, 1.05)
_FINE_PLANES = 3  # whose borders cover so much of the picture that a camera's own curve would look like stray light
_WRONG = 0.5  # of white minus black: a pattern and its inverse that miss it by more are not each other's inverse
_BRIGHT = 0.5  # of the 95th percentile of white minus black
_STEP_REMEDY = "trigger the camera by the projector, or wait longer after every pattern"


def join_checks(*checks: ProjectorCheck) -> ProjectorCheck:
    """Join what several sets of frames say: all faults, the gamma furthest from 1, the largest stray share."""
    gammas = [check.gamma for check in checks if check.gamma is not None]
    strays = [check.stray for check in checks if check.stray is not None]
    return ProjectorCheck(
        tuple(fault for check in checks for fault in check.faults),
        max(gammas, key=lambda gamma: abs(np.log(gamma)), default=None),
        max(strays, default=None),
    )


def light_to_judge(white: Floats, black: Floats, clipped_at: float) -> Floats:
    """White - black [grey levels], 0 where the white frame is clipped: such pixels say nothing of the projector."""
    return np.where(white >= clipped_at, 0.0, np.asarray(white, dtype=np.float64) - black)


def clipping_level(image: Array) -> float:
    """Largest grey level that the image's type holds; infinite for floats."""
    return float(np.iinfo(image.dtype).max) if image.dtype.kind == "u" else np.inf


def bright_pixels(lit: Floats) -> Array:
    """Mask (height, width) of the pixels bright enough to judge a projector by, from :func:`light_to_judge`."""
    return np.asarray(lit >= max(_BRIGHT * float(np.percentile(lit, 95)), 1.0))


def out_of_step(share: float, where: str) -> str:
    """Say that camera and projector are out of step by a share of the light, and what to do."""
    return (
        f"Projector and camera are out of step: {100 * share:.0f} % of the light in {where} comes from another frame; "
        f"{_STEP_REMEDY}."
    )


def pair_stray(residual: Floats, lit: Floats) -> tuple[float, float]:
    """Stray light of a bit plane and its inverse.

    Parameters
    ----------
    residual : (height, width) array
        Pattern + inverse - white - black [grey levels].
    lit : (height, width) array
        From :func:`light_to_judge` [grey levels].

    Returns
    -------
    stray, wrong : float
        Root mean square share of a frame's light that is not its own, noise taken off; and the share of the pixels that
        miss white altogether. NaN if hardly any pixel is bright.
    """
    bright = bright_pixels(lit)
    if bright.sum() < FEWEST_PIXELS:
        return np.nan, np.nan
    relative = residual / np.where(bright, lit, np.inf)
    # What the planes' wide stripes add is the same in neighbouring pixels; noise is not.
    pairs = bright[:, 1:] & bright[:, :-1]
    noise = (1.4826 * float(np.median(np.abs(np.diff(relative, axis=1)[pairs])))) ** 2 / 2
    power = float((relative[bright] ** 2).mean())
    return float(np.sqrt(max(power - noise, 0.0) / 2)), float((np.abs(relative[bright]) > _WRONG).mean())


def planes_check(stray: Floats, name: str) -> ProjectorCheck:
    """Judge bit planes by their :func:`pair_stray`, (bits, 2)."""
    if not np.isfinite(stray).all():
        return ProjectorCheck()
    coarse = stray[: max(len(stray) - _FINE_PLANES, 1), 0]
    # A frame in another's place is wrong by all of its light on half of the pixels, however fine its stripes.
    share = max(float(coarse.max()), float(np.sqrt(stray[:, 1].max() / 2)) if stray[:, 1].max() > 0.1 else 0.0)
    if share <= STRAY_MAX:
        return ProjectorCheck(stray=share)
    worst = int(np.argmax(np.maximum(stray[:, 0], stray[:, 1])))
    where = f"the Gray code of the {name}, worst in plane {worst}"
    return ProjectorCheck((out_of_step(share, where),), stray=share)


@dataclass(frozen=True, slots=True)
class FringeFit:
    """What the steps of a fringe hold beyond a sine.

    Attributes
    ----------
    explained : (bins, pixels) complex array
        What harmonics make of each pixel's bins 2, 3, ...
    second : float
        Amplitude of the second harmonic over that of the first.
    stray : float
        Share of a frame's light that comes from another frame, root mean square.
    """

    explained: Array
    second: float
    stray: float


def fit_overtones(bins: Array, first: Array, chosen: Array, n_steps: int) -> FringeFit:
    """Explain the bins beyond the sine by harmonics, and what correlates with the sine itself by stray light.

    With N steps, bin k holds the harmonics k, N - k, N + k, ... only. A frame that is partly another one puts the first
    harmonic, its mirror image and the mean into it.

    Parameters
    ----------
    bins : (n, pixels) complex array
        Amplitudes of bins 2 to N // 2 [grey levels].
    first : (pixels,) complex array
        ``B exp(-i phase)`` of the first.
    chosen : (pixels,) bool array
        Bright pixels, to fit.
    n_steps : int
        N.
    """
    size = np.maximum(np.abs(first), 1e-9)
    unit = first / size
    explained = np.zeros_like(bins)
    second, strange = 0.0, 0.0
    if not chosen.any():
        return FringeFit(explained, second, strange)
    for i, k in enumerate(range(2, n_steps // 2 + 1)):
        overtones = np.stack([size * unit**k, size * np.conj(unit) ** (n_steps - k)], axis=-1)
        others = np.stack([first, np.conj(first), size.astype(first.dtype)], axis=-1)
        design = np.concatenate([overtones, others], axis=-1)[chosen]
        solution = np.linalg.lstsq(design, bins[i][chosen], rcond=None)[0]
        explained[i] = overtones @ solution[:2]
        middle = 2 * k == n_steps
        if k == 2:
            second = float((solution[0] + (solution[1] if middle else 0.0)).real)
        weight = 1.0 if middle else 0.5
        strange += weight * float((np.abs(design[:, 2:] @ solution[2:]) ** 2).mean())
    sine = float((size[chosen] ** 2).mean()) / 2
    return FringeFit(explained, second, float(np.sqrt(strange / max(sine, 1e-9))))


def gamma_of(second: float, contrast: float) -> float:
    """Exponent g of light ``((1 + cos) / 2) ** g`` whose blurred fringes show these figures.

    Its harmonics are ``a_k / a_(k-1) = (g - k + 1) / (g + k)``; a Gaussian blur that passes M of the first passes M^4
    of the second, and M shows in the contrast.

    Parameters
    ----------
    second : float
        Second harmonic over the first, as seen.
    contrast : float
        Twice the first harmonic's amplitude over white minus black, as seen; M for g = 1.
    """
    gamma = 1.0
    for _ in range(20):
        ratio = second / min(max(contrast / _first_harmonic(gamma), 0.05), 1.0) ** 3
        ratio = min(max(ratio, -0.3), 0.6)
        gamma = (1 + 2 * ratio) / (1 - ratio)
    return gamma


def _first_harmonic(gamma: float) -> float:
    """Twice the first harmonic's amplitude of light in [0, 1]: a_1 = a_0 g / (g + 1), a_0 = (2 g)! / (4^g g!^2)."""
    mean = exp(lgamma(2 * gamma + 1) - 2 * lgamma(gamma + 1) - 2 * gamma * log(2.0))
    return 4 * mean * gamma / (gamma + 1)


def fringes_check(gamma: float, strays: Sequence[float], fringes: Sequence[Fringe], name: str) -> ProjectorCheck:
    """Judge the fringes of one axis."""
    faults = []
    if not GAMMA_RANGE[0] <= gamma <= GAMMA_RANGE[1]:
        faults.append(
            f"The fringes of the {name} are no sines: brightness grows with the light asked for to the power "
            f"{gamma:.2f}; correct the projector's gamma and set the camera to a linear response. "
            f"{fringes[-1].n_steps} steps cancel harmonics up to the {_cancelled(fringes[-1].n_steps)}."
        )
    worst = int(np.argmax(strays))
    if strays[worst] > STRAY_MAX:
        where = f"the fringes of {fringes[worst].period_px:.4g} px of the {name}"
        faults.append(out_of_step(strays[worst], where))
    return ProjectorCheck(tuple(faults), gamma, float(strays[worst]))


def _cancelled(n_steps: int) -> str:
    last = n_steps - 2
    return f"{last}{'nd' if last == 2 else 'rd' if last == 3 else 'th'}"
