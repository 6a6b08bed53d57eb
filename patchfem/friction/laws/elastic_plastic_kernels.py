"""Compiled elastic-plastic elements side by side (3.12 with its reversal). Twin: `elastic_plastic.ElasticPlastic`.

A point under a load that changes has a traction over mu and springs of that density (twin: `ElasticPlastic.press` and
`step`); it stretches and slips as one of the elements does.

num: number t of elements, their stiffness (t,) [N/m], their yield slide (t,) [m]; mem: force [N], stored energy [J] and
stretch [m] averaged with stiffness * yield slide, then the stretch (t,) of every element [m].
"""

from math import exp, sqrt

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT, middle

__all__ = [
    "at_end",
    "closed",
    "commit",
    "mean",
    "middle",
    "press_springs",
    "pulled",
    "spring_end",
    "spring_mean",
    "spring_step",
    "state",
]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pulled(start, move, most):
    """(end, integral of the stretch over the move, elastic part of the move) of a spring that slips at +-most; all [m].

    What it cannot stretch is exactly zero where it only stretches: no difference of large numbers.
    """
    free = start + move
    end = min(max(free, -most), most)
    rest = free - end
    elastic = move - rest
    return end, elastic * (start + end) * 0.5 + rest * end, elastic


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of elastic-plastic elements over an increment dq [m], and its slope over dq [N/m].

    q, eps and dt are not used. Cost: 0.4 ns per element.
    """
    row, past, t = num[e], mem[e], int(num[e, 1])
    force, slope = 0.0, 0.0
    # no division by a step that small: the force as it stands and the slope of a pure stretch
    if abs(dq) < 1e-290:
        for j in range(t):
            force += row[2 + j] * past[3 + j]
            slope += 0.5 * row[2 + j]
        return force, slope
    for j in range(t):
        _, area, elastic = pulled(past[3 + j], dq, row[2 + t + j])
        force += row[2 + j] * area
        slope += row[2 + j] * elastic * elastic
    return force / dq, 0.5 * slope / dq / dq


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def closed(num, mem, e, free, beta):
    """(dq [m], path-mean force [N], whether it is) of a step dq = free - beta force of one element alone: no iteration.

    free [m]: slide without friction; beta [m/N]. An element of stiffness k and stretch s that only stretches by dq
    pulls with k (s + dq/2) on the mean. One that slips at its end +-m pulls with +-k m less what it lacked before:
    dq^2 - (free -+ beta k m) dq = beta k (m -+ s)^2/2, of which the root of the sign of the slip is meant.
    """
    if num[e, 1] != 1:
        return 0.0, 0.0, False
    stiffness, most, start = num[e, 2], num[e, 3], mem[e, 3]
    soft = beta * stiffness
    dq = (free - soft * start) / (1 + 0.5 * soft)
    if abs(start + dq) <= most:
        return dq, stiffness * (start + 0.5 * dq), True
    way = 1.0 if dq > 0 else -1.0
    slides, left = way * free - soft * most, most - way * start  # along the slip
    root = sqrt(slides * slides + 2 * soft * left * left)
    # of two roots of opposite signs the one whose terms do not cancel, the other by their product
    dq = 0.5 * (slides + root) if slides > 0 else soft * left * left / (root - slides)
    return way * dq, way * stiffness * (most - 0.5 * left * left / dq), True


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move the elements over the increment dq [m]; returns the energy that they dissipate [J], limit times slip of
    each."""
    row, past, t = num[e], mem[e], int(num[e, 1])
    lost, pull, energy, shared, total = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(t):
        stiffness, most = row[2 + j], row[2 + t + j]
        end, _, elastic = pulled(past[3 + j], dq, most)
        now = stiffness * end
        lost += now * (dq - elastic)
        pull += now
        energy += now * end
        shared += most * now
        total += most * stiffness
        past[3 + j] = end
    past[0], past[1], past[2] = pull, 0.5 * energy, shared / total if total > 0 else 0.0
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def at_end(num, e, before, speed, travel):
    """(force [N], its slope over the speed [N s/m], over the travel [N/m]) of a single element after a slide `travel`
    [m] from the force `before` [N]."""
    end, _, elastic = pulled(before / num[e, 2], travel, num[e, 3])
    return num[e, 2] * end, 0.0, num[e, 2] if elastic == travel else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) of a contact as it stands at the slide q
    [m]."""
    return mem[e, 0], mem[e, 1], q - mem[e, 2]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_springs(y, springs, sigma):
    """(traction/mu, springs) of one point under another load (twin: `ElasticPlastic.press`)."""
    return min(max(y, -sigma), sigma), max(springs, sigma) if sigma > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_mean(y, springs, sigma, dq, length):
    """(path-mean traction/mu [N], its slope [N/m]) of one point under the load `sigma` over a slide dq [m]."""
    rate = springs / length
    if abs(rate * dq) < 1e-290:
        return y, 0.5 * rate
    _, area, elastic = pulled(y, rate * dq, sigma)
    part = elastic / (rate * dq)
    return area / (rate * dq), 0.5 * rate * part * part


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_end(y, springs, sigma, dq, length):
    """(traction/mu [N], slope [N/m]) of one point at the end of the slide dq [m]."""
    end, _, elastic = pulled(y, springs / length * dq, sigma)
    return end, springs / length if elastic == springs / length * dq else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_step(y, springs, sigma, dq, length):
    """(traction/mu, springs) of one point after the slide dq [m] under the load `sigma`: those beyond it break."""
    move = springs * dq / length
    end, _, elastic = pulled(y, move, sigma)
    part = elastic / move if move != 0 else 1.0
    left = min(sigma, springs)
    return end, left + (springs - left) * exp(-(1 - part) * abs(dq) / length)
