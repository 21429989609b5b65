"""Parameters of springs, of the particle system and of the static solver, with their units and ranges."""

from __future__ import annotations

from dataclasses import dataclass, fields
from numbers import Real
from typing import TypeVar, cast

from deskew.errors import require, require_whole
from deskew.flattening.contact import READINGS
from deskew.types.pages import STIFFNESS_RANGE

# Beyond these the arithmetic overflows or the step vanishes, long before anything is physical.
SMALLEST, LARGEST = STIFFNESS_RANGE
MAX_STEPS, MAX_ITERATIONS = 1_000_000_000, 1_000_000
RESTS = ("chord", "section")
ENERGIES = ("springs", "arap")
AUTO = "auto"


@dataclass(frozen=True, slots=True)
class SpringSettings:
    """Which springs hold a grid together.

    Attributes
    ----------
    k_s : float
        Spring constant [kg/s^2], in [1e-9, 1e12]; only its ratio to other constants matters. A sheet's own `stiffness`
        wins.
    rest : str
        Rest lengths: "chord", the paper's, or "section", the arc that the sheet's `surface` takes between the ends of
        a spring; of a sheet without one these are its chords.
    bending, more : float
        Constants of the springs two structural and two shear springs long, in units of the weaker of the two; in
        [0, 1000], 0 for none.
    """

    k_s: float = 1.0
    rest: str = "chord"
    bending: float = 0.0
    more: float = 0.0

    def __post_init__(self) -> None:
        require_constant("k_s", self.k_s, "kg/s^2")
        named = isinstance(self.rest, str) and self.rest in RESTS
        require(named, "rest", f"be one of {', '.join(RESTS)}", repr(self.rest))
        for name in ("bending", "more"):
            value = getattr(self, name)
            require(_is_number(value) and 0 <= value <= 1000, name, "be a number in [0, 1000]", repr(value))


@dataclass(frozen=True, slots=True)
class StaticSettings:
    """How the springs' energy is minimised on the plane.

    Attributes
    ----------
    k_s, rest, bending, more
        As in `SpringSettings`, but `rest` is "section" unless asked for otherwise. Where triangles are flattened (a
        mesh, or a grid with noise or the other energy) `k_s` does not matter, and sections of what has no `surface` are
        the lengths around its creases, see :mod:`.lengths`.
    energy : str or None
        "springs", or "arap": as rigid as possible on the same lengths. None: springs on a grid, and on a triangle mesh,
        whose springs do not resist being turned over, the other.
    noise_mm : float or "auto"
        Standard deviation of the scanner's noise across the sheet [mm], in [0, 1000], which is removed before lengths
        are taken; "auto" estimates it from the mesh.
    tolerance : float
        Change of a coordinate in one iteration that counts as none, in units of the sheet's size, in [1e-12, 1e-2].
    max_iterations : int
        In [1, 1e6].
    through : int
        Flatten every n-th vertex of a grid alone, with the others as its `surface`, and lay those down between them; in
        [1, 1000].
    free_scale : bool
        Whether the softer of a grid's two materials may have another size than it was scanned with, which is then found
        too, see :mod:`.freescale`. Not with springs two steps long.
    """

    k_s: float = 1.0
    rest: str = "section"
    bending: float = 0.0
    more: float = 0.0
    energy: str | None = None
    noise_mm: float | str = 0.0
    tolerance: float = 2e-7
    max_iterations: int = 2000
    through: int = 1
    free_scale: bool = False

    def __post_init__(self) -> None:
        _ = self.springs
        named = self.energy is None or (isinstance(self.energy, str) and self.energy in ENERGIES)
        require(named, "energy", f"be one of {', '.join(ENERGIES)}, or None", repr(self.energy))
        auto = isinstance(self.noise_mm, str) and self.noise_mm == AUTO
        noise = auto or (_is_number(self.noise_mm) and 0 <= float(self.noise_mm) <= 1000)
        require(noise, "noise_mm", 'be "auto" or in [0, 1000] mm', repr(self.noise_mm))
        fine = _is_number(self.tolerance) and 1e-12 <= self.tolerance <= 1e-2
        require(fine, "tolerance", "be a number in [1e-12, 0.01]", repr(self.tolerance))
        require_whole("max_iterations", self.max_iterations, 1, MAX_ITERATIONS)
        require_whole("through", self.through, 1, 1000)
        require(isinstance(self.free_scale, bool), "free_scale", "be True or False", repr(self.free_scale))
        plain = not self.free_scale or self.bending == self.more == 0
        require(plain, "free_scale", "be False with `bending` or `more`", self.free_scale)

    @property
    def springs(self) -> SpringSettings:
        """The springs' own settings."""
        return SpringSettings(self.k_s, self.rest, self.bending, self.more)


@dataclass(frozen=True, slots=True)
class ParticleSettings:
    """The paper's constants. It prints k_r alone; the others default to what its 45x45 meshes need.

    None means "chosen from the stiffness, the mass and the mesh", so that a stiffer spring, a heavier particle or a
    finer mesh still flattens in about as many steps. The chosen values are among the result's counters. Positive ones
    lie in [1e-9, 1e12], the others in [0, 1e12].

    Attributes
    ----------
    k_s : float
        Spring constant [kg/s^2], > 0; only its ratio to the other constants matters. A sheet's own `stiffness` wins.
    k_d : float or None
        Spring damping [kg/s], >= 0, of the stiffest spring; softer ones have the same k_d / k_s. None: `damping_ratio`
        of what damps the stiffest mode critically.
    damping_ratio : float
        Where k_d is None, in [0, 100]; at the default explicit Euler may take nearly its longest step.
    mass : float
        Of one particle [kg], > 0; the default is 80 g/m^2 paper shared out over 45x45 particles.
    gravity : float or None
        Downward acceleration [mm/s^2], >= 0. None: m g = `push` k r for the mean structural spring, of length r and the
        largest constant k.
    push : float
        Where gravity is None, in [0, 1000]. A hundredth of the default leaves half of all pages locked in small
        buckles.
    weak_gravity : float or None
        The same once the whole sheet lies within eps of the plane [mm/s^2], >= 0: a strong push flattens, a weak one
        lets the sheet settle. None: what makes a particle sink eps / 4 in a step, but no more than `gravity`. One
        that sinks every resting particle below -eps in a step of RK4 would have its steps halved for ever.
    drag : float or None
        Viscous drag mu_d [kg/s], >= 0. None: 3 sqrt(k m) / n for n particles along the longer side, which damps the
        sheet's slowest stretching mode about critically.
    k_r : float
        Coefficient of restitution, in [0, 1].
    dt : float or None
        Step [s], > 0. None: 0.9 of the largest stable one.
    eps_mm : float
        Height under which a particle touches the plane [mm], > 0.
    max_steps : int
        Steps after which the sheet counts as locked, in [1, 1e9].
    halving : str
        Reading of the paper's step halving, "working" or "literal", or "none" at all (see `contact`).
    tolerance_mm : float
        Error that an embedded pair may estimate for a step of any coordinate [mm], > 0; it chooses its steps by that,
        up to `dt`. Other integrators make equal steps.
    stride : int or None
        Steps after which the run's `history` gets an entry, in [1, 1e9]. None: as often as the sheet is looked at for
        rest, every 200 steps, and 50 of implicit Euler.
    rest, bending, more
        As in `SpringSettings`.
    """

    k_s: float = 1.0
    k_d: float | None = None
    damping_ratio: float = 0.8
    mass: float = 2.4e-6
    gravity: float | None = None
    push: float = 0.5
    weak_gravity: float | None = None
    drag: float | None = None
    k_r: float = 0.1
    dt: float | None = None
    eps_mm: float = 0.05
    max_steps: int = 40_000
    halving: str = "working"
    tolerance_mm: float = 1e-3
    stride: int | None = None
    rest: str = "chord"
    bending: float = 0.0
    more: float = 0.0

    def __post_init__(self) -> None:
        _ = self.springs
        for name, unit in (("mass", "kg"), ("eps_mm", "mm"), ("tolerance_mm", "mm"), ("dt", "s")):
            value = getattr(self, name)
            if name != "dt" or value is not None:
                require_constant(name, value, unit)
        for name, unit in (("k_d", "kg/s"), ("gravity", "mm/s^2"), ("weak_gravity", "mm/s^2"), ("drag", "kg/s")):
            value = getattr(self, name)
            if value is not None:
                allowed = _is_number(value) and 0 <= value <= LARGEST
                require(allowed, name, f"be a number in [0, {LARGEST:g}] [{unit}]", repr(value))
        for name, most in (("k_r", 1), ("damping_ratio", 100), ("push", 1000)):
            value = getattr(self, name)
            require(_is_number(value) and 0 <= value <= most, name, f"be in [0, {most}]", repr(value))
        require_whole("max_steps", self.max_steps, 1, MAX_STEPS)
        if self.stride is not None:
            require_whole("stride", self.stride, 1, MAX_STEPS)
        require(self.halving in READINGS, "halving", f"be one of {', '.join(READINGS)}", repr(self.halving))

    @property
    def springs(self) -> SpringSettings:
        """The springs' own settings."""
        return SpringSettings(self.k_s, self.rest, self.bending, self.more)


def require_constant(name: str, value: object, unit: str) -> None:
    """Raise an InputError unless `value` is a number in [1e-9, 1e12], in `unit`."""
    allowed = _is_number(value) and SMALLEST <= cast(float, value) <= LARGEST
    require(allowed, name, f"be a number in [{SMALLEST:g}, {LARGEST:g}] [{unit}]", repr(value))


def _is_number(value: object) -> bool:
    """Whether `value` is a number at all; its range is asked for where it is known, which NaN is outside of."""
    return isinstance(value, Real) and not isinstance(value, bool)


Settings = TypeVar("Settings", ParticleSettings, StaticSettings)


def settings_of(kind: type[Settings], what: str, values: dict[str, object]) -> Settings:
    """Check keyword arguments into settings of a kind; `what` is what they set.

    Raises
    ------
    InputError
        On a name that is not a setting, or a value out of its range.
    """
    known = [field.name for field in fields(kind)]
    for name in values:
        require(name in known, name, f"be a setting of {what} ({', '.join(known)})", "an unknown name")
    return kind(**values)  # type: ignore[arg-type]
