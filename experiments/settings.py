"""Every configuration key, its type, its allowed range and its default; `conf/` only chooses among them.

Hydra checks names and types against these classes. Ranges are checked when the composed configuration becomes objects,
in `__post_init__`; each setting carries its range as text, so that a wrong type and a wrong value read alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from math import isfinite
from typing import Any, ClassVar

from omegaconf import MISSING, OmegaConf

from deskew.errors import InputError, require

BUDGETS = ("smoke", "paper", "full")
ENGINES = ("processes", "ray", "serial", "slurm")
# In conf/: `${at:${budget.name},A,B,C}` depends on the budget, as `trials` does; `${either:A,B}` is A unless it is
# empty: a sweep's folder cannot wait until `out` is resolved for each job.
OmegaConf.register_new_resolver("at", lambda budget, *values: values[BUDGETS.index(budget)], replace=True)
OmegaConf.register_new_resolver("either", lambda first, second: first or second, replace=True)
SURFACE_KINDS = ("cylinder", "cone", "folds", "mirror", "physical")


def setting(default: Any, allowed: str, holds: Callable[[Any], bool]) -> Any:
    """Declare a key with its range.

    Parameters
    ----------
    default : scalar, list or None
        Value unless the configuration gives one; a list is copied for each instance.
    allowed : str
        The range, continuing "`key` must ...", with its unit.
    holds : callable
        Whether a value lies in the range.
    """
    metadata = {"allowed": allowed, "holds": holds}
    if isinstance(default, list):
        return field(default_factory=lambda: list(default), metadata=metadata)
    return field(default=default, metadata=metadata)


def number(default: float, low: float, high: float, unit: str = "") -> Any:
    """Declare a float in [low, high]."""
    text = f"lie in [{low:g}, {high:g}]{unit and ' ' + unit}"
    return setting(default, text, lambda value: isfinite(value) and low <= value <= high)


def count(default: int, low: int, high: int) -> Any:
    """Declare a whole number in [low, high]."""
    return setting(default, f"be a whole number in [{low}, {high}]", lambda value: low <= value <= high)


def choice(default: str, *allowed: str) -> Any:
    """Declare one of a few names."""
    return setting(default, f"be one of {', '.join(allowed)}", lambda value: value in allowed)


@dataclass
class Checked:
    """A group of settings that checks its own ranges."""

    group: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for item in fields(self):
            if "holds" in item.metadata:
                value = getattr(self, item.name)
                require(item.metadata["holds"](value), self.group + item.name, item.metadata["allowed"], repr(value))


@dataclass
class BudgetSettings(Checked):
    """How much work a run may take: `smoke` proves that it runs, `paper` is the paper's scale, `full` is for claims."""

    group: ClassVar[str] = "budget."
    name: str = choice("paper", *BUDGETS)


@dataclass
class TrialsAt(Checked):
    """Trials of an experiment at each budget; an explicit `trials` overrides them."""

    group: ClassVar[str] = "trials_at."
    smoke: int = count(1, 1, 100_000)
    paper: int = count(5, 1, 100_000)
    full: int = count(50, 1, 100_000)


@dataclass
class SheetSettings(Checked):
    """The crumpled sheet.

    `kind`: mirror folds, drawn from the trial's seed; or physical crumples, of which eight are shipped.
    `drawn`: new physical sheets from the trial's seed instead of the shipped ones; some 90 s each.
    `slope_p90_deg`: of drawn sheets; the shipped ones have their own.
    `paths`: sheets with V (h, w, 3) and F (h, w, 2) in mm, used instead.
    """

    group: ClassVar[str] = "sheet."
    kind: str = choice("mirror", "mirror", "physical")
    drawn: bool = setting(False, "be true or false", lambda value: isinstance(value, bool))
    slope_p90_deg: float = number(20.0, 1.0, 45.0, "degrees")
    paths: list[str] = setting(
        [], "be a list of NPZ files, one a trial", lambda value: all(str(path).endswith(".npz") for path in value)
    )


@dataclass
class PageSettings(Checked):
    """What is printed on the sheet.

    `text`: of a lettered page in the experiment `ocr_misses`, always 176 letters: pseudo-words of the 22 capitals that
    readers tell apart best, of all 26, or plain English in lower case.
    """

    group: ClassVar[str] = "page."
    kind: str = choice("checkerboard", "checkerboard", "lettered", "vellum")
    text: str = choice("capitals", "capitals", "full", "prose")


@dataclass
class RigSettings(Checked):
    """The synthetic rig; every key can be swept.

    `noise_draw`: which draw of all its noise; another one photographs the same pages and boards with other noise.
    `camera_blur_px`: standard deviation of the lens's blur.
    `baseline_mm`: distance of projector and camera along X; the projector moves on a circle about where it is aimed.
    `stripe_width_px`: neighbouring projector lines that a frame lights; the blur of the projector's lens stays.
    `gamma`: of the projector; as lines are lit below full code it also decides how bright they are.
    `ambient`: light of an even sky.
    """

    group: ClassVar[str] = "rig."
    noise_scale: float = number(1.0, 0.0, 10.0, "times the rig's own noise")
    noise_draw: int = count(0, 0, 2**32 - 1)
    camera_blur_px: float = number(0.75, 0.3, 3.0, "camera pixels")
    baseline_mm: float = number(426.0, 100.0, 700.0, "mm")
    stripe_width_px: int = setting(
        1, "be an odd whole number in [1, 15] of projector lines", lambda value: value in range(1, 16, 2)
    )
    gamma: float = number(2.2, 0.5, 4.0)
    ambient: float = number(0.03, 0.0, 1.0, "times the projector's full light")
    board_poses: int = count(9, 3, 12)


def values_of(key: str, default: list[Any]) -> Any:
    """Declare a list of values, each of which the key `rig.KEY` must allow."""
    one = {item.name: item for item in fields(RigSettings)}[key].metadata
    return setting(
        default,
        f"be a list of different values that each {one['allowed']}",
        lambda values: all(one["holds"](value) for value in values) and len(set(values)) == len(values),
    )


@dataclass
class AblationSettings(Checked):
    """What the experiment `ablations` sets the rig's keys to, one at a time; an empty list leaves a key alone."""

    group: ClassVar[str] = "ablations."
    noise_scale: list[float] = values_of("noise_scale", [0.5, 2.0, 4.0])
    camera_blur_px: list[float] = values_of("camera_blur_px", [0.5, 1.0, 1.5])
    baseline_mm: list[float] = values_of("baseline_mm", [213.0, 320.0, 600.0])
    stripe_width_px: list[int] = values_of("stripe_width_px", [3, 5])
    gamma: list[float] = values_of("gamma", [1.0, 3.0])
    ambient: list[float] = values_of("ambient", [0.1, 0.3])


def _address(value: str | None) -> bool:
    host, _, port = (value or "").rpartition(":")
    return value is None or (bool(host) and "/" not in host and port.isdecimal() and int(port) < 65536)


@dataclass
class EngineSettings(Checked):
    """What carries the trials out.

    `workers`: trials at once; of SLURM, jobs among which the trials are divided.
    `address`: of a Ray cluster that runs.
    `cluster`: where submitit runs its jobs, `local` for processes of this machine.
    `partition`: of SLURM, null for its own choice.
    `minutes`: after which SLURM may end a job; its longest trial must fit.
    `folder`: for the jobs' files, on a disk that all nodes share; null for `out`.
    """

    group: ClassVar[str] = "engine."
    name: str = choice("processes", *ENGINES)
    workers: int | None = setting(
        None,
        "be a whole number in [1, 256], or null for one a core",
        lambda value: value is None or 1 <= value <= 256,
    )
    address: str | None = setting(None, "be HOST:PORT of a Ray cluster, or null to start one here", _address)
    cluster: str = choice("slurm", "slurm", "local")
    partition: str | None = setting(
        None, "be a name, or null", lambda value: value is None or bool(value.strip() and value.isprintable())
    )
    minutes: int = count(60, 1, 100_000)
    folder: str | None = setting(
        None, "be the name of a folder, or null", lambda value: value is None or bool(value and value.isprintable())
    )


@dataclass
class MeshSettings(Checked):
    """The paper's finite element mesh of 45 x 45 samples (section 4.1)."""

    group: ClassVar[str] = "mesh."
    rows: int = count(45, 2, 1000)
    columns: int = count(45, 2, 1000)


@dataclass
class ScanSettings(Checked):
    """How a page is scanned.

    `mode`: how a line sweep is read (section 2.3), `spatial`, the paper's, per frame; or `temporal`, per pixel.
    `ink`: whether what ink does to the decoded coordinates is taken out; the paper does not.
    `denoise`: whether the depth map is filtered before it is meshed; the paper's is not.
    What is null is as each flattening method has it: the paper's methods scan as the paper does, all others temporally,
    with both corrections. An experiment without methods scans as the paper does.
    """

    group: ClassVar[str] = "scan."
    mode: str | None = setting(
        None, "be spatial, temporal or null", lambda value: value in (None, "spatial", "temporal")
    )
    ink: bool | None = setting(None, "be true, false or null", lambda value: value is None or isinstance(value, bool))
    denoise: bool | None = setting(
        None, "be true, false or null", lambda value: value is None or isinstance(value, bool)
    )


@dataclass
class RealBoardsSettings(Checked):
    """The real captures; they are not part of the project."""

    group: ClassVar[str] = "real_boards."
    path: str | None = None


@dataclass
class ReadingSettings(Checked):
    """How pages are read, and which.

    `engine`: never replaced by the other one. `psm`: page segmentation mode; 6 is one block of text.
    `severities`: further 90th percentiles of slope at which pages are read.
    `restore`: false reads unrestored pages alone and scans none, which is how a severity is chosen.
    `real_path`: folder of photographed documents with their words; they are not part of the project.
    """

    group: ClassVar[str] = "ocr."
    engine: str = choice("tesserocr", "tesserocr", "pytesseract")
    psm: int = count(6, 3, 13)
    severities: list[float] = setting(
        [],
        "be a list of different numbers in [1, 45] degrees",
        lambda values: len(set(values)) == len(values) and all(1.0 <= value <= 45.0 for value in values),
    )
    restore: bool = setting(True, "be true or false", lambda value: isinstance(value, bool))
    real_path: str | None = None


@dataclass
class SurfacesSettings(Checked):
    """The flattening of meshes that store their flat sheet.

    `paths`: meshes whose texture coordinates are the true flat places [mm], one a trial; none for generated ones.
    `kinds`: of the generated ones, see `data_synth.surfaces`; a physical one takes minutes.
    `noise_mm`: standard deviation of the noise that is added to their z.
    """

    group: ClassVar[str] = "surfaces."
    paths: list[str] = setting(
        [],
        "be a list of OBJ or PLY files, one a trial",
        lambda value: all(str(path).lower().endswith((".obj", ".ply")) for path in value),
    )
    kinds: list[str] = setting(
        ["cylinder", "cone", "folds", "mirror"],
        f"be a list of different ones of {', '.join(SURFACE_KINDS)}",
        lambda value: len(set(value)) == len(value) > 0 and set(value) <= set(SURFACE_KINDS),
    )
    noise_mm: float = number(0.0, 0.0, 10.0, "mm")


def _numbers(values: list[Any], low: float, high: float) -> bool:
    return len(set(values)) == len(values) > 0 and all(low <= value <= high for value in values)


@dataclass
class IntegratorsSettings(Checked):
    """The comparison of integrators, which `method` names here.

    `damping_ratios`: of the springs' stiffest mode, for stable steps and flattening.
    `stiffness`: k_s [kg/s^2] at which sheets of the same mass are flattened under the same weight.
    `pushes`: weight of a vertex over k_s times a spring's length, for the map of outcomes.
    `mapped`: integrators in that map.
    """

    group: ClassVar[str] = "integrators."
    damping_ratios: list[float] = setting(
        [0.1, 0.2, 0.5, 0.8, 1.0],
        "be a list of different numbers in [0.01, 10]",
        lambda values: _numbers(values, 0.01, 10.0),
    )
    stiffness: list[float] = setting(
        [0.1, 1.0, 10.0, 100.0],
        "be a list of different numbers in [0.001, 100000] kg/s^2",
        lambda values: _numbers(values, 1e-3, 1e5),
    )
    pushes: list[float] = setting(
        [0.002, 0.005, 0.015, 0.05, 0.15, 0.5, 1.5, 5.0],
        "be a list of different numbers in [0.00001, 100]",
        lambda values: _numbers(values, 1e-5, 100.0),
    )
    mapped: list[str] = setting(
        ["euler", "rk4"],
        "be a list of different integrators",
        lambda values: len(set(values)) == len(values) and all(isinstance(value, str) and value for value in values),
    )


def several(default: list[Any], low: float, high: float, unit: str = "") -> Any:
    """Declare a list of different numbers in [low, high]; an empty one is allowed."""
    text = f"be a list of different numbers in [{low:g}, {high:g}]{unit and ' ' + unit}"
    return setting(default, text, lambda values: not values or _numbers(values, low, high))


@dataclass
class SensitivitySettings(Checked):
    """What the experiment `sensitivity` changes, one at a time; an empty list leaves a key alone.

    `slope_p90_deg`: of drawn sheets. `noise_scale`: of the rig, which is calibrated anew. `mesh`: vertices a side.
    `projector_yaw_deg`, `baseline_percent`, `focal_percent`: error of the calibration that the pages are scanned with.
    """

    group: ClassVar[str] = "sensitivity."
    slope_p90_deg: list[float] = several([10.0, 15.0, 25.0, 30.0], 1.0, 45.0, "degrees")
    noise_scale: list[float] = several([0.5, 2.0, 3.0, 4.0], 0.0, 10.0, "times the rig's own noise")
    mesh: list[int] = several([12, 23, 90, 180], 4, 400)
    projector_yaw_deg: list[float] = several([0.02, 0.05, 0.1], -1.0, 1.0, "degrees")
    baseline_percent: list[float] = several([0.25, 0.5, 1.0], -5.0, 5.0, "%")
    focal_percent: list[float] = several([0.1, 0.25, 0.5], -5.0, 5.0, "%")


@dataclass
class SettlingSettings(Checked):
    """The paper's particle system on crumpled pages, one of its constants changed at a time.

    `restitutions`: coefficients k_r. `stiffer`: what k_s is multiplied by.
    `pushes`: weight of a vertex over k_s times a spring's length.
    `max_steps`: after which a page counts as unfinished; the usual one needs a tenth of them.
    """

    group: ClassVar[str] = "settling."
    restitutions: list[float] = setting(
        [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0],
        "be a list of different numbers in [0, 1]",
        lambda values: _numbers(values, 0.0, 1.0),
    )
    stiffer: list[float] = setting(
        [2.0, 20.0, 200.0], "be a list of different numbers in [1, 10000]", lambda values: _numbers(values, 1.0, 1e4)
    )
    pushes: list[float] = setting(
        [0.002, 0.005, 0.015, 0.05, 0.15, 0.5, 1.5, 5.0],
        "be a list of different numbers in [0.00001, 100]",
        lambda values: _numbers(values, 1e-5, 100.0),
    )
    max_steps: int = count(10_000, 200, 1_000_000)


@dataclass
class CullingSettings(Checked):
    """Epipolar culling of pages at several noise levels, through one calibration made at `rig.noise_scale`.

    `noise_scales`: values of `rig.noise_scale` for the pages.
    `tolerances_px`: distances from the epipolar line at which points are culled.
    `outlier_mm`: depth error from which a point is an outlier; 3 mm are some three projector lines.
    """

    group: ClassVar[str] = "culling."
    noise_scales: list[float] = values_of("noise_scale", [1.0, 2.0, 4.0])
    tolerances_px: list[float] = setting(
        [1.0, 2.0, 4.0],
        "be a list of different numbers in [0.1, 100] projector px",
        lambda values: _numbers(values, 0.1, 100.0),
    )
    outlier_mm: float = number(3.0, 0.1, 100.0, "mm")


@dataclass
class OwnSettings(Checked):
    """What one call of a method that is not built in may take: it runs in a process of its own (docs/own-method.md).

    `seconds`: wall clock, the start of its interpreter included. `memory_mb`: address space.
    """

    group: ClassVar[str] = "own."
    seconds: float = number(120.0, 0.1, 86400.0, "s")
    memory_mb: int = count(4096, 256, 1 << 20)


@dataclass
class DecodersSettings(Checked):
    """The comparison of decoders. `frames`: numbers of frames at which the patterns are compared."""

    group: ClassVar[str] = "decoders."
    frames: list[int] = setting(
        [40, 160, 1792],
        "be a list of different whole numbers in [40, 10000]",
        lambda value: len(set(value)) == len(value) > 0 and all(40 <= n <= 10_000 for n in value),
    )


def _ratios_to_both_sides(values: list[float]) -> bool:
    allowed = all(isfinite(value) and 1e-4 <= value <= 1e4 for value in values)
    return allowed and len(set(values)) == len(values) and min(values, default=1.0) < 1.0 < max(values, default=1.0)


@dataclass
class StiffnessSettings(Checked):
    """The restoration of a page of two materials, a vellum leaf in a paper sleeve.

    `vellum_over_paper`: ratios of stiffness under test; the least and the greatest are compared with each other.
    `materials`: how the two are told apart, by the page's `texture`, or by a picture of the camera's size that is not
    black where the vellum is.
    """

    group: ClassVar[str] = "stiffness."
    vellum_over_paper: list[float] = setting(
        [0.01, 0.1, 1.0, 10.0, 100.0],
        "be a list of different numbers in [0.0001, 10000], some below and some above 1",
        _ratios_to_both_sides,
    )
    materials: str = setting(
        "texture", "be texture or a PNG file", lambda value: value == "texture" or value.lower().endswith(".png")
    )


@dataclass
class Config(Checked):
    """The whole configuration of one run."""

    experiment: str = MISSING
    seed: int = count(1, 0, 2**32 - 1)
    trials: int = setting(MISSING, "be a whole number in [1, 100000]", lambda value: 1 <= value <= 100_000)
    trials_at: TrialsAt = field(default_factory=TrialsAt)
    # One name or a list of names: Hydra has no type for that, so it is checked and made a list here.
    method: Any = setting(["spring"], "be a method's name or a list of different names", bool)
    out: str | None = setting(
        None, "be the name of a folder, without line breaks", lambda value: value is None or value.isprintable()
    )
    # Experiments on one rig need not calibrate it again and again.
    calibrations: str | None = setting(
        None,
        "be the name of a folder for calibrations that other runs may use, or null",
        lambda value: value is None or (value.isprintable() and value != ""),
    )
    budget: BudgetSettings = field(default_factory=BudgetSettings)
    engine: EngineSettings = field(default_factory=EngineSettings)
    sheet: SheetSettings = field(default_factory=SheetSettings)
    page: PageSettings = field(default_factory=PageSettings)
    rig: RigSettings = field(default_factory=RigSettings)
    scan: ScanSettings = field(default_factory=ScanSettings)
    mesh: MeshSettings = field(default_factory=MeshSettings)
    own: OwnSettings = field(default_factory=OwnSettings)
    integrators: IntegratorsSettings = field(default_factory=IntegratorsSettings)
    settling: SettlingSettings = field(default_factory=SettlingSettings)
    culling: CullingSettings = field(default_factory=CullingSettings)
    decoders: DecodersSettings = field(default_factory=DecodersSettings)
    real_boards: RealBoardsSettings = field(default_factory=RealBoardsSettings)
    ocr: ReadingSettings = field(default_factory=ReadingSettings)
    ablations: AblationSettings = field(default_factory=AblationSettings)
    sensitivity: SensitivitySettings = field(default_factory=SensitivitySettings)
    surfaces: SurfacesSettings = field(default_factory=SurfacesSettings)
    stiffness: StiffnessSettings = field(default_factory=StiffnessSettings)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        names = [self.method] if isinstance(self.method, str) else self.method
        listed = isinstance(names, list) and all(isinstance(name, str) and name for name in names)
        if not listed or len(set(names)) != len(names):
            raise InputError(f"`method` must be a method's name or a list of different names, got {self.method!r}.")
        self.method = list(names)

    @property
    def methods(self) -> list[str]:
        """The methods under test, in the order asked for."""
        return list(self.method)


def allowed_text(key: str) -> str | None:
    """Return the range of a dotted key as text, or None where the key has none or does not exist."""
    node: Any = Config
    *groups, last = key.split(".")
    for name in groups:
        item = {item.name: item for item in fields(node)}.get(name)
        node = item.default_factory if item is not None else None
        if not (isinstance(node, type) and is_dataclass(node)):
            return None
    item = {item.name: item for item in fields(node)}.get(last.split("[")[0])
    return None if item is None else item.metadata.get("allowed")


def known_keys(group: str) -> list[str]:
    """Return the keys of a group ("" for the top level), sorted; empty where there is no such group."""
    node: Any = Config
    for name in filter(None, group.split(".")):
        item = {item.name: item for item in fields(node)}.get(name)
        node = item.default_factory if item is not None else None
        if not (isinstance(node, type) and is_dataclass(node)):
            return []
    return sorted(item.name for item in fields(node))
