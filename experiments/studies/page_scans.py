"""One photographed page scanned in several ways, without doing the same work twice."""

from __future__ import annotations

from deskew import pipeline
from deskew.acquisition import DenoiseSettings, InkSettings, SweepSettings
from deskew.recipes import Recipe
from deskew.types import Calibration, Capture, Correspondence, DepthMap, Scan
from experiments.trials import Recorder

Shape = tuple[int, int]


class PageScans:
    """Scans of a line sweep: it is decoded once a mode, its depth map made once a recipe, a mesh spanned once a shape.

    Parameters
    ----------
    record : Recorder
        Of the trial; the stages `decode` and `scan` are timed.
    capture : Capture
        The page.
    calibration : Calibration
        What its depth is triangulated with.
    """

    def __init__(self, record: Recorder, capture: Capture, calibration: Calibration) -> None:
        self._record, self._capture, self._calibration = record, capture, calibration
        self._decoded: dict[str, Correspondence] = {}
        self._depths: dict[Recipe, DepthMap] = {}
        self._scans: dict[tuple[Recipe, Shape], Scan] = {}

    def through(self, calibration: Calibration) -> PageScans:
        """Return scans of the same page by another calibration, which share what is decoded."""
        other = PageScans(self._record, self._capture, calibration)
        other._decoded = self._decoded
        return other

    def by(self, recipe: Recipe, shape: Shape) -> Scan:
        """Scan the page by a recipe, as `deskew.pipeline.scan_by` does.

        Parameters
        ----------
        recipe : Recipe
            How.
        shape : (rows, columns)
            Vertices of the mesh.
        """
        if (recipe, shape) not in self._scans:
            decoded = self._decode(recipe.mode)
            with self._record.stage("scan"):
                self._scans[recipe, shape] = self._scan(recipe, shape, decoded)
        return self._scans[recipe, shape]

    def _decode(self, mode: str) -> Correspondence:
        if mode not in self._decoded:
            # The sweeps are rendered while they are decoded: this stage holds both.
            with self._record.stage("decode"):
                self._decoded[mode] = pipeline.decode(self._capture, SweepSettings(mode=mode))
        return self._decoded[mode]

    def _scan(self, recipe: Recipe, shape: Shape, decoded: Correspondence) -> Scan:
        page = self._capture, self._calibration
        if recipe in self._depths:
            return pipeline.span(*page, self._depths[recipe], shape=shape)
        ink, denoise = InkSettings() if recipe.ink else None, DenoiseSettings() if recipe.denoise else None
        scan = pipeline.scan(*page, shape=shape, decoded=decoded, ink=ink, denoise=denoise)
        self._depths[recipe] = scan.depth
        return scan
