"""Local, aligned and line distortion (LD, AD, Li-D): how far a dense flow moves the pixels of a scan.

With v(p) the flow from the scan to the restored picture, where the scan's pixel p is found at p + v(p), over N pixels:

    LD = 1/N sum_p |v(p)|

    AD = 1/N sum_p g(p) |s (p + v(p)) + t - p|,

g the magnitude of the scan's gradient over its largest, s and t a scale and a shift along each axis that bring the
restored picture onto the scan best where g > .5;

    Li-D = half of the mean standard deviation of v_y along rows, and half of that of v_x along columns:

what bends a line that is straight in the scan. A pixel is one that the field's flow is computed on, twice as large
either way as one of the 598,400: a restored picture that lies two of those off has an LD of 1. AD is weighted by g, so
it has no length's unit.

The flow
--------
The field's is SIFT flow in Matlab. Here it is DIS, and the figures say so in their names, for they are not comparable
with those of another flow. DIS compares grey levels, so both pictures are first reduced to ink: the share by which a
pixel is darker than the paper near it, a tenth of it taken off as noise. Where there is no ink there is nothing to see
moving: bare paper takes the flow of the ink round it, which is where it goes on a sheet. DIS starts from the shift of
the whole, if there is one, lest a page that lies a line's distance off be matched line by wrong line.

On a full page waves of 16 pixels are read right within 3 %; from 40 on one line of text is taken for the next, and LD
is a sixth too small. On sparse pages bare paper decides, and LD may be half off; AD asks for edges alone.

References
----------
C. Liu, J. Yuen, A. Torralba, SIFT Flow: Dense Correspondence across Scenes and Its Applications, PAMI 33 (2011).

K. Ma, Z. Shu, X. Bai, J. Wang, D. Samaras, DocUNet: Document Image Unwarping via a Stacked U-Net, CVPR 2018: LD.

K. Ma, S. Das, Z. Shu, D. Samaras, Learning From Documents in the Wild to Improve Document Unwarping, SIGGRAPH 2022: AD.

H. Feng, W. Zhou, J. Deng, Q. Tian, H. Li, DocScanner: Robust Document Image Rectification with Progressive Learning,
arXiv:2110.14968: Li-D.

T. Kroeger, R. Timofte, D. Dai, L. Van Gool, Fast Optical Flow Using Dense Inverse Search, ECCV 2016.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from deskew.errors import require
from deskew.metrics.docunet import compared, resized
from deskew.metrics.inkshare import ink_share
from deskew.types import Array, Floats

_REACH_PX = 12
_NOISE = 0.1  # share of ink
# From far to near: how far round a pixel the ink speaks for it [px], and the weight, beside the 1 of the strongest
# ink's, of what was said from farther off.
_SPREAD = ((32.0, 1e-12), (8.0, 1e-3), (0.0, 1e-2))
_STEEP = 0.5  # of the steepest gradient
_AGREED = 0.5


def flow_distortion(restored: Array, scan: Array) -> dict[str, float]:
    """Distortion of a restored picture by the DIS flow from its scan.

    Parameters
    ----------
    restored, scan : (height, width[, 3]) arrays
        Grey or RGB, uint8 or uint16; both are brought to one size (see :func:`deskew.metrics.docunet.compared`).

    Returns
    -------
    dict
        `ld_dis_px`, `lid_dis_px` [px of the halved pictures], `ad_dis`; none below 0, and 0 for equal pictures.

    Raises
    ------
    InputError
        If either is no picture, the scan is too narrow or of one grey level throughout.
    """
    moved, fixed = compared(restored, scan)
    flow = dis_flow(_halved(fixed), _halved(moved))
    gradient = _gradient(fixed, flow.shape[:2])
    rows, columns = flow[..., 1].std(axis=1).mean(), flow[..., 0].std(axis=0).mean()
    return {
        "ld_dis_px": float(np.hypot(flow[..., 0], flow[..., 1]).mean()),
        "ad_dis": float((gradient * _aligned(flow, gradient > _STEEP)).mean()),
        "lid_dis_px": float(rows + columns) / 2.0,
    }


def dis_flow(first: Array, second: Array) -> Floats:
    """Dense flow of ink from one picture to another.

    Parameters
    ----------
    first, second : (H, W) uint8 arrays
        Grey, of one size.

    Returns
    -------
    (H, W, 2) array
        (x, y) by which what `first` shows at a pixel lies farther in `second` [px].
    """
    from_ink, to_ink = _ink(first), _ink(second)
    dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    dis.setFinestScale(0)
    flow = np.asarray(dis.calc(from_ink, to_ink, _shift(from_ink, to_ink)), np.float64)
    return _spread(flow, _slope(from_ink) ** 2)


def _shift(first: Array, second: Array) -> Array:
    """Return a flow to start from: the one shift of all, by phase correlation, or none if not half of it agrees."""
    window = cv2.createHanningWindow(first.shape[::-1], cv2.CV_32F)
    shift, agreed = cv2.phaseCorrelate(first.astype(np.float32), second.astype(np.float32), window)
    return np.full((*first.shape, 2), shift if agreed > _AGREED else 0.0, np.float32)


def _halved(grey: Array) -> Array:
    """Half the pixels either way, smoothed as before SIFT flow."""
    smooth = cv2.GaussianBlur(grey, (7, 7), 1.0, borderType=cv2.BORDER_REPLICATE)
    height, width = grey.shape
    half = resized(smooth, (math.ceil(height / 2), math.ceil(width / 2)))
    return np.asarray(np.rint(half).clip(0, 255).astype(np.uint8))


def _ink(grey: Array) -> Array:
    ink = (ink_share(grey, _REACH_PX) - _NOISE) / (1.0 - _NOISE)
    return np.asarray(np.rint(255.0 * ink.clip(0.0, 1.0)).astype(np.uint8))


def _slope(picture: Array) -> Floats:
    """Magnitude of Sobel's gradient."""
    values = picture.astype(np.float64)
    along, down = (cv2.Sobel(values, -1, *axis, borderType=cv2.BORDER_REPLICATE) for axis in ((1, 0), (0, 1)))
    return np.asarray(np.hypot(along, down))


def _spread(flow: Floats, weights: Floats) -> Floats:
    """Let what has little weight follow what has more of it near by, and that what lies farther off."""
    weights = (weights / max(float(weights.max()), 1.0))[..., None]
    mean = np.zeros_like(flow)
    for sigma_px, faint in _SPREAD:
        sums = np.dstack([weights * flow, weights])
        if sigma_px > 0:
            sums = cv2.GaussianBlur(sums, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
        mean = (sums[..., :2] + faint * mean) / (sums[..., 2:] + faint)
    return np.asarray(mean)


def _gradient(scan: Array, shape: tuple[int, ...]) -> Floats:
    """Magnitude of the scan's gradient over its largest, in [0, 1], brought to the flow's size."""
    slope = _slope(scan)
    steepest = float(slope.max())
    require(steepest > 0.0, "scan", "show something", "one grey level throughout")
    return resized(slope / steepest, (shape[0], shape[1])).clip(0.0, 1.0)


def _aligned(flow: Floats, steep: Array) -> Floats:
    """Length of what a scale and a shift along each axis leave of a flow, fitted over the steep pixels."""
    height, width = steep.shape
    places = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    left = []
    for axis, place in enumerate(places):
        found = place + flow[..., axis]
        there, here = found[steep], place[steep]
        spread = float(there.var()) if there.size else 0.0
        scale = float(((there - there.mean()) * (here - here.mean())).mean()) / spread if spread > 0.0 else 1.0
        shift = float(here.mean() - scale * there.mean()) if there.size else 0.0
        left.append(scale * found + shift - place)
    return np.asarray(np.hypot(*left))
