"""Compiled LuGre law. Twin: `lugre.LuGre`.

num: stiffness [N/m], kinetic and static force [N], v_s [m/s], micro-damping and viscous [N s/m]; mem: z [m]. At the
constant speed of a step z relaxes towards +-g/stiffness over that length of path.
"""

from math import inf, nan

from ...compiled.jit import njit
from ..bonds.point_kernels import shape
from ..flags_kernels import (
    BENDS,
    FASTMATH_FLAGS,
    FOLLOWS,
    LAYERS,
    NJIT_NO_REFCOUNT,
    SET_VALUED,
    after,
    closed,
    gives,
    layer,
    middle,
)
from .exponential_kernels import decay

__all__ = [
    "BENDS",
    "FOLLOWS",
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

UNITS = "N/m N N m/s N_s/m N_s/m"  # of the numbers k of the law in lanes

FADED = 6.0  # times v_s: beyond it the limit is the kinetic one to the last digit, e^-36
TRACE = 1e-9  # least limit over the static one: z relaxes over limit/stiffness, which must not be 0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def numbers(num, e):
    """Numbers of a contact as `flowing` takes them."""
    return num[e, 1], num[e, 2], num[e, 3], num[e, 4], num[e, 5], num[e, 6]


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def reach(k, v):
    """(length g/stiffness [m] over which z relaxes, its slope over v [s]) at a speed v [m/s]; where no friction is left
    at speed, a trace of the length at rest; k: numbers of the law."""
    ratio = v / k[3]
    more = (k[2] - k[1]) * decay(ratio * ratio)
    return max(k[1] + more, TRACE * k[2]) / k[0], -2 * ratio / k[3] * more / k[0]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flowing(k, z, v, way):
    """(force [N] at a stretch z [m] and a speed v [m/s], slope of the stretch over the slide in the direction `way`,
    slopes of the force over stretch [N/m] and speed [N s/m])."""
    length, bend = reach(k, v)
    gain = 1 - way * z / length
    return (
        k[0] * z + (k[4] * gain + k[5]) * v,
        gain,
        k[0] - k[4] * way * v / length,
        k[4] * (gain + way * z * v * bend / (length * length)) + k[5],
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relaxed(num, e, z, dq, dt):
    """(z after a slide dq in dt, its path mean, slopes of both over dq, slopes of the first over z and dt); a jump in
    no time has the kinetic length."""
    way, path = (1.0 if dq > 0 else -1.0), abs(dq)
    length, bend = max(num[e, 2], TRACE * num[e, 3]) / num[e, 1], 0.0
    if dt > 0:
        length, bend = reach(numbers(num, e), path / dt)
        bend /= dt
    x = path / length
    f1, f2, kept = shape(x)
    end, rest = way * length, z - way * length
    by_path = (1 - x * bend) / length  # of x
    after, mean = end + rest * kept, end + rest * f1
    slope_after = way * bend * (1 - kept) - rest * kept * by_path
    slope_mean = way * bend * (1 - f1) + rest * (f2 - f1) * by_path
    by_time = 0.0
    if dt > 0:
        later = -bend * path / dt  # of the length over the time
        by_time = way * later * (1 - kept) + rest * kept * x / length * later
    return after, mean, way * slope_after, way * slope_mean, kept, by_time


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of the LuGre law over an increment dq [m] in dt [s], and its slope over dq [N/m].

    q and eps are not used; with dt = 0 neither damping acts.
    """
    after, middle, by_after, by_middle, _, _ = relaxed(num, e, mem[e, 0], dq, dt)
    force, slope = num[e, 1] * middle, num[e, 1] * by_middle
    if dt > 0:
        force += (num[e, 5] * (after - mem[e, 0]) + num[e, 6] * dq) / dt
        slope += (num[e, 5] * by_after + num[e, 6]) / dt
    return force, slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move z over the increment dq [m] in dt [s]; returns the energy dissipated [J], force times dq less the gain in
    store."""
    z = mem[e, 0]
    mem[e, 0] = relaxed(num, e, z, dq, dt)[0]
    return force * dq - 0.5 * num[e, 1] * (mem[e, 0] * mem[e, 0] - z * z)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pull(num, e, z, v):
    """(force [N] at a stretch z [m] and a speed v [m/s], its slopes over z [N/m] and v [N s/m])."""
    force, _, by_stretch, by_speed = flowing(numbers(num, e), z, v, 1.0 if v > 0 else -1.0)
    return force, by_stretch, by_speed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force at the speed v [m/s] [N], stored energy [J], irreversible part q - z of the slide [m])."""
    z = mem[e, 0]
    return pull(num, e, z, v)[0], 0.5 * num[e, 1] * z * z, q - z


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flow(num, e, z, dq, dt):
    """(z [m] after a slide dq [m] in dt [s] from the stretch z [m], its slopes over z, dq [1] and dt [m/s])."""
    after, _, by_slide, _, kept, by_time = relaxed(num, e, z, dq, dt)
    return after, kept, by_slide, by_time


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def knee(num):
    """Speed [m/s] below which the limit rises: no step from beyond it sees the rise inside itself."""
    return FADED * num[0, 4] if num[0, 3] > num[0, 2] else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(num, mem, way, y):
    """Set the rate state z [m] of a motion that begins; the path [m] to the next kink is infinite."""
    y[0] = mem[0, 0]
    return inf


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rate(num, mem, turn, dq, v, y, out):
    """Force [N] at the speed v [m/s] in the direction turn[0]; writes z' [m/s] into out."""
    force, gain, _, _ = flowing(numbers(num, 0), y[0], v, turn[0])
    out[0] = gain * v
    return force


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(num, mem, turn, dq, q, v, y):
    """(force at the speed v [m/s] [N], stored energy [J], irreversible part q - z of the slide [m])."""
    return pull(num, 0, y[0], v)[0], 0.5 * num[0, 1] * y[0] * y[0], q - y[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def finish(num, mem, turn, dq, v, y):
    """Keep z; nan, as only the work tells what is dissipated."""
    mem[0, 0] = y[0]
    return nan
