"""The experiments by name. A study is imported only when it is asked for: some need much to be imported."""

from __future__ import annotations

from importlib import import_module

from experiments.studies.own_sources import about_own
from experiments.studies.study import AbsentError, Study

# name of the experiment: module and class; `conf/experiment/NAME.yaml` goes with each.
STUDIES = {
    "plane_accuracy": "experiments.studies.plane_accuracy:PlaneAccuracy",
    "ablations": "experiments.studies.ablations:Ablations",
    "corner_distance": "experiments.studies.corner_distance:CornerDistance",
    "ocr_misses": "experiments.studies.ocr_misses:OcrMisses",
    "attribution": "experiments.studies.attribution:Attribution",
    "sensitivity": "experiments.studies.sensitivity:Sensitivity",
    "decoders": "experiments.studies.decoders:Decoders",
    "textures": "experiments.studies.textures:TexturesStudy",
    "stiffness": "experiments.studies.stiffness:Stiffness",
    "real_boards": "experiments.studies.real_boards:RealBoards",
    "surfaces": "experiments.studies.surfaces:Surfaces",
    "integrators": "experiments.studies.integrators:Integrators",
    "settling": "experiments.studies.settling:Settling",
    "culling": "experiments.studies.culling:Culling",
    "null_controls": "experiments.studies.null_controls:NullControls",
    "speed": "experiments.studies.speed:Speed",
}


def find_study(name: str) -> Study:
    """Return the study of a name in `STUDIES`."""
    module, _, attribute = STUDIES[name].partition(":")
    study: Study = getattr(import_module(module), attribute)()
    return study


__all__ = ["STUDIES", "AbsentError", "Study", "about_own", "find_study"]
