"""Compiled rate law of eq. 2.4. Twin: `tanh.Rate`.

num: limit [N], v_0 [m/s]; no memory. `flowing` is the law as lanes of many cases take it (`dynamics.lanes`), k:
limit and 1/v_0.
"""

from math import inf, nan, tanh

from ...compiled.jit import njit
from ..flags_kernels import (
    BENDS,
    FASTMATH_FLAGS,
    FOLLOWS,
    NJIT_NO_REFCOUNT,
    SET_VALUED,
    after,
    closed,
    gives,
    knee,
    middle,
)

__all__ = [
    "BENDS",
    "FOLLOWS",
    "LAYERS",
    "SET_VALUED",
    "after",
    "at_end",
    "begin",
    "closed",
    "commit",
    "finish",
    "flowing",
    "gives",
    "knee",
    "layer",
    "mean",
    "middle",
    "rate",
    "shown",
    "state",
]

UNITS, LAYERS = "N s/m", True  # of the numbers k of the law in lanes; as of `flags_kernels`
SATURATED = 15.0  # argument from which tanh is 1 to 2e-13
REACH = 5.0  # times v_0, to which the layer of the speed is taken
# times v_0 and the step, by which the speed may change in one within the layer; times v_0
SHARP, FINE = (
    20.0,
    0.25,
)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def hyperbolic(y):
    """tanh(y) to 2e-13, beyond SATURATED its value there: y times a ratio of polynomials of y^2, fitted for the least
    largest error, its terms in pairs, so that few wait for each other: half as long as by an exponential. No branch,
    so that a compiler takes several lanes at once."""
    w = min(max(y, -SATURATED), SATURATED)
    t = w * w
    t2 = t * t
    t4 = t2 * t2
    over = (
        (0.99999999999983938 + 0.14765069666848572 * t)
        + t2 * (5.3617127395154138e-3 + 7.1381616734550472e-5 * t)
        + t4
        * (
            (3.8743037097684462e-7 + 8.1917070824978973e-10 * t)
            + t2 * (5.336448026556409e-13 + 4.6032156550180916e-17 * t)
        )
    )
    under = (
        (1.0 + 0.48098402999999239 * t)
        + t2 * (3.235638940960437e-2 + 6.9389471871154182e-4 * t)
        + t4
        * (
            (5.8801663929329921e-6 + 2.021903780186637e-8 * t)
            + t2 * (2.4883560503357008e-11 + 7.2047408725043925e-15 * t)
        )
    )
    return w * over / under


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flowing(k, z, v, way):
    """(force, slope 0 of a stretch, that there is not, over the slide, slopes of the force over stretch and speed)."""
    part = hyperbolic(v * k[1])
    return k[0] * part, 0.0, 0.0, k[0] * k[1] * (1 - part) * (1 + part)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def layer(k, h):
    """(force beyond the layer of speeds in which tanh is not +-1, the speed to which it is taken, the change of the
    speed in a part of a step h that follows it: the finer the step, the less)."""
    return k[0], REACH / k[1], max(SHARP * h, FINE) / k[1]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def creep(speed, limit, reference):
    """(force [N], slope over the speed [N s/m]) of eq. 2.4 at a speed [m/s]; limit [N], reference: v_0 [m/s]."""
    part = tanh(speed / reference)
    return limit * part, limit * (1 - part) * (1 + part) / reference


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of eq. 2.4 at the mean speed of a step dq [m] in dt > 0 [s], and its slope over dq [N/m]."""
    force, slope = creep(dq / dt, num[e, 1], num[e, 2])
    return force, slope / dt


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Energy dissipated [J] over the increment dq [m]: all work of the force [N]; there is no memory to move."""
    return force * dq


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def at_end(num, e, before, speed, travel):
    """(force [N], its slope over the speed [N s/m], over the travel [N/m]) at a speed [m/s]."""
    force, slope = creep(speed, num[e, 1], num[e, 2])
    return force, slope, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force at the speed v [m/s] [N], stored energy 0 [J], irreversible part of the slide [m], all of q)."""
    return creep(v, num[e, 1], num[e, 2])[0], 0.0, q


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(num, mem, way, y):
    """Nothing to set; the path [m] to the next kink is infinite."""
    return inf


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rate(num, mem, turn, dq, v, y, out):
    """Force [N] of eq. 2.4 at the speed v [m/s]; there are no states."""
    return creep(v, num[0, 1], num[0, 2])[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(num, mem, turn, dq, q, v, y):
    """(force at the speed v [m/s] [N], stored energy 0 [J], irreversible part of the slide [m], all of q)."""
    return creep(v, num[0, 1], num[0, 2])[0], 0.0, q


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def finish(num, mem, turn, dq, v, y):
    """There is no memory; nan, as only the work tells what is dissipated."""
    return nan
