"""MS-SSIM under the names of its two formulas, which give different figures for one pair of pictures.

Both rest on SSIM's maps at five scales, k = 0 (the pictures) to 4. With means m, variances s^2 and covariance under a
Gaussian window of 11 x 11 and sigma 1.5, borders replicated, C1 = (.01 255)^2 and C2 = (.03 255)^2,

    l = (2 m_x m_y + C1) / (m_x^2 + m_y^2 + C1),    cs = (2 s_xy + C2) / (s_x^2 + s_y^2 + C2),    SSIM = l cs,

each averaged over the whole map, as Matlab's `ssim` does; the weights are w = (.0448, .2856, .3001, .2363, .1333),
divided by their sum of 1.0001, so that equal pictures have 1.

`ms_ssim_docunet`, what the document-unwarping field calls MS-SSIM, is a weighted SUM:

    sum_k w_k mean(SSIM_k),

each scale made from the finer one by Matlab's `impyramid`: Burt and Adelson's (1 4 6 4 1) / 16, rounded to 8 bits.

`ms_ssim_wang`, as defined in 2003, is a PRODUCT, the luminance compared at the coarsest scale alone:

    mean(SSIM_4)^w_4  prod_(k < 4) mean(cs_k)^w_k,

each scale the means of 2 x 2 pixels of the finer one. A mean below 0, which has no such power, counts 0: pictures whose
structures are opposed at any scale are not alike.

Readings
--------
Neither formula says what happens at the border. Wang's own program leaves out 5 pixels all round at each scale. On the
pair known to give .325 and .241 whole maps with replicated borders give .325 and .240, maps without their borders .312
and .205: so whole maps are meant. Halving by 2 x 2 means instead of `impyramid` turns the sum into .234; `impyramid`
instead of 2 x 2 means turns the product into .322. How a scale is made matters more than whether sum or product is
taken.

References
----------
Z. Wang, E. P. Simoncelli, A. C. Bovik, Multiscale Structural Similarity for Image Quality Assessment, Asilomar 2003,
equations 5 to 7.

Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, Image Quality Assessment: From Error Visibility to Structural
Similarity, IEEE Trans. Image Processing 13 (2004), equations 6, 9, 13.

K. Ma, Z. Shu, X. Bai, J. Wang, D. Samaras, DocUNet: Document Image Unwarping via a Stacked U-Net, CVPR 2018.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from deskew.metrics.docunet import compared
from deskew.types import Array, Floats

WEIGHTS = np.array([0.0448, 0.2856, 0.3001, 0.2363, 0.1333]) / 1.0001
"""Of the scales, finest first."""

_C1, _C2 = (0.01 * 255.0) ** 2, (0.03 * 255.0) ** 2


def ms_ssim(restored: Array, scan: Array) -> dict[str, float]:
    """Multi-scale structural similarity by either formula.

    Parameters
    ----------
    restored, scan : (height, width[, 3]) arrays
        Grey or RGB, uint8 or uint16; both are brought to one size (see :func:`deskew.metrics.docunet.compared`).

    Returns
    -------
    dict
        `ms_ssim_docunet`, in [-1, 1], and `ms_ssim_wang`, in [0, 1]; both 1 for equal pictures. Exchanging two
        pictures of one size changes nothing.

    Raises
    ------
    InputError
        If either is no picture, or the scan is too narrow.
    """
    x, y = compared(restored, scan)
    whole, _ = _by_scale(x, y, _impyramid)
    ends, structure = _by_scale(x.astype(np.float64), y.astype(np.float64), _means)
    factors = np.append(structure[:-1], ends[-1])
    return {
        "ms_ssim_docunet": float(WEIGHTS @ whole),
        "ms_ssim_wang": float(np.prod(np.maximum(factors, 0.0) ** WEIGHTS)),
    }


def _by_scale(x: Array, y: Array, halved: Callable[[Array], Array]) -> tuple[Floats, Floats]:
    """Return the mean of SSIM and that of its contrast and structure at each scale, finest first."""
    means = []
    for _ in WEIGHTS:
        means.append(_ssim(x.astype(np.float64), y.astype(np.float64)))
        x, y = halved(x), halved(y)
    both = np.array(means)
    return both[:, 0], both[:, 1]


def _ssim(x: Floats, y: Floats) -> tuple[float, float]:
    """Return the means of SSIM and of its contrast and structure over one scale."""
    mean_x, mean_y = _windowed(x), _windowed(y)
    variances = _windowed(x * x) - mean_x**2 + _windowed(y * y) - mean_y**2
    covariance = _windowed(x * y) - mean_x * mean_y
    structure = (2.0 * covariance + _C2) / (variances + _C2)
    luminance = (2.0 * mean_x * mean_y + _C1) / (mean_x**2 + mean_y**2 + _C1)
    return float((luminance * structure).mean()), float(structure.mean())


def _windowed(values: Floats) -> Floats:
    return np.asarray(cv2.GaussianBlur(values, (11, 11), 1.5, borderType=cv2.BORDER_REPLICATE))


def _impyramid(image: Array) -> Array:
    return np.asarray(cv2.pyrDown(image, borderType=cv2.BORDER_REFLECT))


def _means(image: Array) -> Array:
    """Average 2 x 2 pixels; an odd last row or column counts twice."""
    height, width = image.shape
    even = np.pad(image, ((0, height % 2), (0, width % 2)), mode="symmetric")
    return np.asarray(even.reshape((height + 1) // 2, 2, (width + 1) // 2, 2).mean(axis=(1, 3)))
