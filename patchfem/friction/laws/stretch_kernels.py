"""Compiled bonds of eq. 2.17 in the stretch reading with p = 1, at points that all slide alike.

Every point moves in proportion to its pressure, so one point under 1 Pa stands for all of them. Twin:
`friction.bonds.recursion.Recursion`. num: 1, the growth (6,) of eq. 2.10 and of the breakaway share, the sum of
mu_s area pressure/eps_0 over the points [N/m], the pressures [Pa]; mem: bond length [m], then m, z, s2, local slide and
play. The rate form between two reversals has no states of its own at a constant bond length, where the bonds are
exponentials of the slide, and (eps, m, z, s2) where it grows.
"""

from math import exp, expm1, inf, nan

from ...compiled.jit import njit
from ..bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from ..flags_kernels import (
    BENDS,
    FASTMATH_FLAGS,
    LAYERS,
    NJIT_NO_REFCOUNT,
    SET_VALUED,
    closed,
    gives,
    layer,
)
from .exponential_kernels import decay

__all__ = [
    "BENDS",
    "LAYERS",
    "SET_VALUED",
    "after",
    "begin",
    "closed",
    "commit",
    "finish",
    "flow",
    "flowing",
    "gives",
    "knee",
    "layer",
    "mean",
    "middle",
    "pull",
    "rate",
    "shown",
    "state",
]

GROWTH, WEIGHT = 2, 8  # of num: where the growth and the weights begin
FREE = 7  # of num: share of the bond length that stretches without damage
UNITS, FOLLOWS = "N/m m", True  # of the numbers k of the law in lanes; as of `flags_kernels`


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def middle(num, mem, e, v, dt):
    """Bond length [m] in the middle of a step of dt [s] at the speed v [m/s] (eq. 2.10), which the solve of the step
    uses."""
    return grow(mem[e, 0], v, v, abs(v) * dt / 2, dt / 2, num[e, GROWTH:WEIGHT])[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of eq. 2.17 (stretch, p = 1) over an increment dq [m], and its slope over dq [N/m]; 10 ns.

    eps: bond length of the step [m].
    """
    if num[e, FREE] > 0:
        force, slope = loose_mean(mem[e, 1], mem[e, 2], mem[e, 5], num[e, FREE] * eps, dq, 1.0, eps)
    else:
        force, slope = bond_mean(mem[e, 1], mem[e, 2], dq, 1.0, eps)
    return num[e, WEIGHT] * force, num[e, WEIGHT] * slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move the bonds over the increment dq [m] and let them grow; returns the energy that they dissipate [J].

    v0, v1: speeds [m/s] at the ends of the step of dt [s]; eps: bond length of its middle [m].
    """
    if num[e, FREE] > 0:
        mem[e, 1], mem[e, 2], mem[e, 3], mem[e, 5], lost = loose_step(
            mem[e, 1], mem[e, 2], mem[e, 3], mem[e, 5], num[e, FREE] * eps, dq, 1.0, eps
        )
    else:
        mem[e, 1], mem[e, 2], mem[e, 3], lost = bond_step(
            mem[e, 1], mem[e, 2], mem[e, 3], dq, 1.0, eps
        )
    mem[e, 4] += dq
    mem[e, 0] = grow(mem[e, 0], v0, v1, abs(dq), dt, num[e, GROWTH:WEIGHT])[0]
    return num[e, WEIGHT] * lost / 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flow(num, e, z, dq, dt):
    """(stretch z [m] of full-grown bonds after a slide dq [m], its slopes over z, dq [1] and dt [m/s]), for harmonic
    balance.

    Holds at constant bond length eps: z relaxes towards eps sgn dq over the path eps. The law knows no time.
    """
    length = num[e, GROWTH + 3]
    end = length if dq > 0 else -length
    kept = exp(-abs(dq) / length)
    # no difference of lengths: stretches far below them are as exact
    return z * kept - end * expm1(-abs(dq) / length), kept, (1 - z / end) * kept, 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flowing(k, z, v, way):
    """(force [N] of full-grown bonds of a constant length stretched by z [m], slope of the stretch over the slide in
    the direction `way`, slopes of the force over stretch [N/m] and speed, 0); k: mu_s N/eps [N/m] and eps [m]."""
    return k[0] * z, 1 - way * z / k[1], k[0], 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def after(k, z, square, dx, way):
    """(stretch [m], mean square of the stretches [m2] of these bonds, work of their force [J]) after a slide dx [m] in
    the direction `way`: they relax towards way eps over the path eps."""
    end, far = way * k[1], way * dx / k[1]
    rest, kept = z - end, decay(far)
    return (
        end + rest * kept,
        square * kept + 2 * end * (end * (1 - kept) + rest * far * kept),
        k[0] * end * (dx + rest * (1 - kept)),
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pull(num, e, z, v):
    """(force [N] of full-grown bonds stretched by z [m], its slopes over z [N/m] and over the speed, 0)."""
    return num[e, WEIGHT] * z, num[e, WEIGHT], 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) of a contact as it stands at the slide q [m].

    The irreversible part is local slide less mean stretch of the bonds.
    """
    weight, m, z = num[e, WEIGHT], mem[e, 1], mem[e, 2]
    return weight * z, 0.5 * weight * mem[e, 3], mem[e, 4] - z / m if weight * m > 0 else q


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def knee(num):
    """Speed [m/s] at which the rates of eq. 2.10 have a kink, the floor v_h; 0 where bonds do not grow."""
    return num[0, GROWTH + 2] if num[0, GROWTH] >= 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(num, mem, way, y):
    """Set the rate states y of a motion that begins in the direction `way`; returns the path [m] to the next kink.

    That is the end of the elastic range of a law with breakaway, infinite where none lies ahead.
    """
    for k in range(y.size):
        y[k] = mem[0, k]
    if num[0, FREE] <= 0:
        return inf
    ahead = num[0, FREE] * mem[0, 0] * (1 - way * mem[0, 5])
    return ahead if ahead > 0 else inf


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(num, mem, turn, dq):
    """(m, z [m]) after a slide dq [m] in one direction at a constant bond length, from the memory; turn as in
    `rate`."""
    m, z, way, eps = mem[0, 1], mem[0, 2], turn[0], mem[0, 0]
    if turn[1] < inf:
        return m, z + m * dq
    x = way * dq / eps
    broken = -expm1(-x)  # exact for slides far below the bond length, too
    kept = 1 - broken
    return m + (1 - m) * broken, z * kept + way * eps * (broken - (1 - m) * x * kept)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rate(num, mem, turn, dq, v, y, out):
    """Force [N] after a slide dq [m] since `begin`, at the speed v [m/s]; writes the rates of y into out (eq. 2.10).

    turn: direction of the slide, path to the kink [m], 1 above the speed of `knee` and 0 below.
    """
    weight = num[0, WEIGHT]
    if y.size == 0:
        return weight * update_memory(num, mem, turn, dq)[1]
    eps, m, z, s2 = y[0], y[1], y[2], y[3]
    speed = turn[0] * v
    floor = num[0, GROWTH + 2]
    # half: a stage may overshoot
    heals = num[0, GROWTH] / (max(speed, 0.5 * floor) if turn[2] > 0 else floor)
    breaks = speed / eps
    out[0] = heals * (num[0, GROWTH + 3] - eps) + speed / num[0, GROWTH + 1] * (
        num[0, GROWTH + 4] - eps
    )
    out[1] = breaks * (1 - m)
    out[2] = m * v - breaks * z
    out[3] = 2 * z * v - breaks * s2
    return weight * z


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(num, mem, turn, dq, q, v, y):
    """(force [N], stored energy [J], irreversible part of the slide q [m]) after a slide dq [m] since `begin`."""
    weight = num[0, WEIGHT]
    if y.size > 0:
        m, z, s2 = y[1], y[2], y[3]
    elif turn[1] < inf:
        m, z = update_memory(num, mem, turn, dq)
        s2 = mem[0, 3] + dq * (mem[0, 2] + z)
    else:
        m, z, s2, _ = bond_step(mem[0, 1], mem[0, 2], mem[0, 3], dq, 1.0, mem[0, 0])
    return weight * z, 0.5 * weight * s2, q - z / m if weight * m > 0 else q


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def finish(num, mem, turn, dq, v, y):
    """Move the memory over the slide dq [m] since `begin`; returns the energy dissipated [J], or nan where only the
    work tells."""
    mem[0, 4] += dq
    if y.size > 0:
        for k in range(y.size):
            mem[0, k] = y[k]
        return nan
    if turn[1] < inf:
        z, m, half = mem[0, 2], mem[0, 1], num[0, FREE] * mem[0, 0]
        mem[0, 2] = z + m * dq
        mem[0, 3] += dq * (2 * z + m * dq)
        at_end = turn[0] * dq >= turn[1] * (1 - 1e-12)
        mem[0, 5] = turn[0] if at_end else min(max(mem[0, 5] + dq / half, -1.0), 1.0)
        return 0.0
    mem[0, 1], mem[0, 2], mem[0, 3], lost = bond_step(
        mem[0, 1], mem[0, 2], mem[0, 3], dq, 1.0, mem[0, 0]
    )
    if num[0, FREE] > 0 and dq != 0:
        mem[0, 5] = turn[0]
    return 0.5 * num[0, WEIGHT] * lost
