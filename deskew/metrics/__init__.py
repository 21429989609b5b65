"""How well a page was restored: figures against the control or against truth, named as in the result tables."""

from deskew.metrics.alignment import Alignment, fit_affine, fit_rigid, fit_similar, require_not_mirrored
from deskew.metrics.corners import corner_distance
from deskew.metrics.coverage import page_coverage
from deskew.metrics.dense import dense_error
from deskew.metrics.depth import depth_error
from deskew.metrics.difference import image_difference, laid_onto
from deskew.metrics.distortion import flow_distortion
from deskew.metrics.images import image_figures
from deskew.metrics.misses import Misses, count_misses, match_words
from deskew.metrics.nulls import shifted, shuffled
from deskew.metrics.ocr import OcrEngine, OcrSettings, ocr_engine
from deskew.metrics.quadstrain import quad_strain
from deskew.metrics.regions import region_error
from deskew.metrics.score import score_flattening
from deskew.metrics.similarity import ms_ssim
from deskew.metrics.straightness import line_straightness
from deskew.metrics.strain import flat_error, sheet_strain
from deskew.metrics.stretch import sheet_stretch
from deskew.metrics.unscaled import similar_corner_distance, similar_dense_error

__all__ = [
    "Alignment",
    "Misses",
    "OcrEngine",
    "OcrSettings",
    "corner_distance",
    "count_misses",
    "dense_error",
    "depth_error",
    "fit_affine",
    "fit_rigid",
    "fit_similar",
    "flat_error",
    "flow_distortion",
    "image_difference",
    "image_figures",
    "laid_onto",
    "line_straightness",
    "match_words",
    "ms_ssim",
    "ocr_engine",
    "page_coverage",
    "quad_strain",
    "region_error",
    "require_not_mirrored",
    "score_flattening",
    "sheet_strain",
    "sheet_stretch",
    "shifted",
    "shuffled",
    "similar_corner_distance",
    "similar_dense_error",
]
