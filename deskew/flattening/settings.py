"""Parameters of the particle system, with their units and ranges."""

from __future__ import annotations

from dataclasses import dataclass, fields

from deskew.errors import require, require_whole
from deskew.flattening.contact import READINGS

# Beyond these the arithmetic overflows or the step vanishes, long before anything is physical.
SMALLEST, LARGEST = 1e-9, 1e12
MAX_STEPS = 1_000_000_000


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
        Spring damping [kg/s], >= 0, of the stiffest spring; softer ones have the same k_d / k_s. None: 0.8 of what
        damps the stiffest mode critically, where explicit Euler may take nearly its longest step.
    mass : float
        Of one particle [kg], > 0; the default is 80 g/m^2 paper shared out over 45x45 particles.
    gravity : float or None
        Downward acceleration [mm/s^2], >= 0. None: m g = 0.5 k r for the mean structural spring, of length r and the
        largest constant k. A hundredth of it leaves half of all pages locked in small buckles.
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
        Reading of the paper's step halving, "working" or "literal" (see `contact`).
    """

    k_s: float = 1.0
    k_d: float | None = None
    mass: float = 2.4e-6
    gravity: float | None = None
    weak_gravity: float | None = None
    drag: float | None = None
    k_r: float = 0.1
    dt: float | None = None
    eps_mm: float = 0.05
    max_steps: int = 40_000
    halving: str = "working"

    def __post_init__(self) -> None:
        for name, unit in (("k_s", "kg/s^2"), ("mass", "kg"), ("eps_mm", "mm"), ("dt", "s")):
            value = getattr(self, name)
            if name == "dt" and value is None:
                continue
            allowed = _is_number(value) and SMALLEST <= value <= LARGEST
            require(allowed, name, f"be a number in [{SMALLEST:g}, {LARGEST:g}] [{unit}]", repr(value))
        for name, unit in (("k_d", "kg/s"), ("gravity", "mm/s^2"), ("weak_gravity", "mm/s^2"), ("drag", "kg/s")):
            value = getattr(self, name)
            if value is not None:
                allowed = _is_number(value) and 0 <= value <= LARGEST
                require(allowed, name, f"be a number in [0, {LARGEST:g}] [{unit}]", repr(value))
        require(_is_number(self.k_r) and 0 <= self.k_r <= 1, "k_r", "be in [0, 1]", repr(self.k_r))
        require_whole("max_steps", self.max_steps, 1, MAX_STEPS)
        require(self.halving in READINGS, "halving", f"be one of {', '.join(READINGS)}", repr(self.halving))


def _is_number(value: object) -> bool:
    """Whether `value` is a number at all; its range is asked for where it is known, which NaN is outside of."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def particle_settings(**values: object) -> ParticleSettings:
    """Check keyword arguments into settings.

    Raises
    ------
    InputError
        On a name that is not a setting, or a value out of its range.
    """
    known = [field.name for field in fields(ParticleSettings)]
    for name in values:
        require(name in known, name, f"be a setting of the particle system ({', '.join(known)})", "an unknown name")
    return ParticleSettings(**values)  # type: ignore[arg-type]
