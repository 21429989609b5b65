"""A restored picture beside the flat page's: the figures of the document-unwarping field, from pictures alone."""

from __future__ import annotations

from deskew.metrics.distortion import flow_distortion
from deskew.metrics.similarity import ms_ssim
from deskew.metrics.straightness import line_straightness
from deskew.types import Array


def image_figures(restored: Array, control: Array) -> dict[str, float]:
    """Compare a restored picture with one of the same page flat.

    Light, sharpness and where the page lies in the picture count as well as its shape: these are figures for methods
    that give nothing but a picture. Where the true place of each pixel is known `dense_*` says more.

    Parameters
    ----------
    restored, control : (height, width[, 3]) arrays
        Grey or RGB, uint8 or uint16, cut alike; of a flat-bed scan or a photograph of the flat page.

    Returns
    -------
    dict
        `ms_ssim_docunet`, `ms_ssim_wang` (:func:`deskew.metrics.ms_ssim`); `ld_dis_px`, `ad_dis`, `lid_dis_px`
        (:func:`deskew.metrics.flow_distortion`); of `restored` by itself `text_lines` and, if there are any,
        `line_straightness_px`, `line_spread_deg` (:func:`deskew.metrics.line_straightness`).

    Raises
    ------
    InputError
        If either is no picture, or the control is too narrow or shows nothing.
    """
    return ms_ssim(restored, control) | flow_distortion(restored, control) | line_straightness(restored)
