"""What happens where particles meet the plane Z = 0 (section 3.3.2, eqs. 3 and 4).

The velocity is split into its normal and tangential parts, v_n = (N . v) N and v_t = v - v_n with N = (0, 0, 1), and
becomes v_t - k_r v_n. The paper prints the range of the restitution k_r as [0, -1]; it is [0, 1].

The paper also halves the step until no particle is below the plane, and never doubles it again. Taken literally that
rule collapses: a particle that rests on the plane is pushed below it by any step, however small. Both readings:

working
    A step is rejected and halved only if a particle sank below -eps. One that ends under eps moving down is lifted to
    the plane, if below it, and reflected; if it is slower than gravity makes it in 5 steps, it is at rest. After 4
    good steps the step doubles again, up to the stable one.
literal
    A step is rejected while any particle is below 0, and the step never grows. Kept as a demonstrated failure.

A third way, "none", halves nothing and lifts and reflects as `working` does: it shows what halving is for.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit, uintp

READINGS = ("working", "literal", "none")
# Slower than gravity makes a particle in this many steps, it is taken to rest on the plane.
RESTING_STEPS = 5.0
# Good steps after which a halved step doubles again.
GOOD_STEPS = 4


class Plane(NamedTuple):
    """How the plane answers.

    Attributes
    ----------
    eps : float
        Distance under which a particle counts as touching [mm]; negative where there is no plane at all.
    k_r : float
        Coefficient of restitution, in [0, 1].
    literal : bool
        Whether halving is taken at the paper's word.
    """

    eps: float
    k_r: float
    literal: bool


NOWHERE = Plane(-1.0, 0.0, False)
"""No plane: free flight."""


@njit(cache=True, error_model="numpy")
def sunk(z, plane):  # type: ignore[no-untyped-def]
    """Count the particles whose height z : (V,) [mm] makes the step one to be halved."""
    count = 0
    if plane.eps < 0.0:
        return count
    lowest = 0.0 if plane.literal else -plane.eps
    for i in range(uintp(z.shape[0])):
        count += z[i] < lowest
    return count


@njit(cache=True, error_model="numpy")
def deepest(z, so_far):  # type: ignore[no-untyped-def]
    """Return the lowest of the heights z : (V,) and of `so_far` [mm], however many are no number."""
    for i in range(uintp(z.shape[0])):
        if z[i] < so_far:
            so_far = z[i]
    return so_far


@njit(cache=True, error_model="numpy")
def collide(z, v_normal, plane, gravity, dt):  # type: ignore[no-untyped-def]
    """Reflect the particles that touch the plane, in place; return how many struck it (rather than lay on it).

    Parameters
    ----------
    z, v_normal : (V,) arrays
        Heights [mm] and normal velocities [mm/s].
    plane : Plane
        Its eps, restitution and reading.
    gravity : float
        Downward acceleration [mm/s^2].
    dt : float
        The step just made [s].
    """
    strikes = 0
    if plane.eps < 0.0:
        return strikes
    resting = 0.0 if plane.literal else RESTING_STEPS * gravity * dt
    for i in range(uintp(z.shape[0])):
        if z[i] < plane.eps and v_normal[i] < 0.0:
            if v_normal[i] > -resting:
                v_normal[i] = 0.0
            else:
                v_normal[i] *= -plane.k_r
                strikes += 1
            if not plane.literal:
                z[i] = max(z[i], 0.0)
    return strikes
