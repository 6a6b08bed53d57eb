"""A contact, `arrays.Element`, of set-valued Coulomb friction: it holds or slides, without a slope.

The functions are those that `march.loop_kernels` asks of every contact. eps[0] is 1 while it holds, last[0] the force
at the end of a step that slides there [N].
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import coulomb_kernels as law
from .stop_kernels import through

SET_VALUED = True


@njit(error_model="numpy", **LEAN)
def solve(free, beta, q, v, dt, c, goal):
    """(dq [m], path-mean force [N], iterations) of a step of Coulomb's law by the mean force alone.

    free [m]: slide without friction; beta [m/N]: slide that a newton takes away; the other arguments are those of
    `element_kernels.solve`. The loops ask `passed` instead, which knows the speed.
    """
    dq, force = law.stick(free, beta, c.num[0, 1], c.num[0, 2])
    return dq, force, 1


@njit(error_model="numpy", **LEAN)
def passed(free, rate, beta, gamma, share, v, dt, c, top):
    """(slide dq [m], speed at the end [m/s]) of a step, with what stops and lets go inside it: `stop_kernels.through`,
    whose arguments these are."""
    static, kinetic = c.num[0, 1], c.num[0, 2]
    dq, speed, rests = through(free, rate, beta, gamma, share, v, dt, static, static, kinetic, kinetic,
                               v == 0.0 or c.eps[0] == 1.0, top)
    c.eps[0] = 1.0 if rests else 0.0
    c.last[0] = kinetic if speed > 0 else -kinetic
    return dq, speed


@njit(error_model="numpy", **LEAN)
def given(dq, q, v, dt, c, goal):
    """(path-mean force [N], True) of Coulomb's law over a slide increment dq [m] that is prescribed."""
    return law.mean(c.num, c.mem, 0, q, dq, 0.0, dt)[0], True


@njit(error_model="numpy", **LEAN)
def commit(dq, force, q, v0, v1, dt, c):
    """Keep the force [N] of the solved step; (energy dissipated [J], True)."""
    return law.commit(c.num, c.mem, 0, dq, force, v0, v1, dt, 0.0), True


@njit(error_model="numpy", **LEAN)
def state(c, q, v):
    """(force of the last step [N], stored energy 0 [J], irreversible slip [m]) at the slide q [m]."""
    return law.state(c.num, c.mem, 0, q, v)


@njit(error_model="numpy", **LEAN)
def hold(c, force):
    """Set the force at the end of a step: of a contact that holds the one it needs [N], no more than its static one."""
    c.mem[0, 0] = min(max(force, -c.num[0, 1]), c.num[0, 1]) if c.eps[0] == 1.0 else c.last[0]
