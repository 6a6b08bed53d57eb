"""The points of a contact that climbs flanks under a law with memory, loaded by the normal force of the flank.

The points are those of `contacts.arrays.Climbing`: one of rigid pieces, or those behind shear modes, which share the
normal force and slide along the flank, as in `contacts.shear_solve_kernels`. `contact_kernels` asks for begun, drag,
commit and state.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..dense_kernels import factor
from ..dense_kernels import solve as solve_factored
from ..interfaces.pressed_points_kernels import (
    press_all,
    rub_commit,
    rub_force,
    rub_state,
    spring_back,
)
from ..interfaces.shear_points_kernels import SLOPE
from ..interfaces.shear_solve_kernels import GRADIENT, STEP, descend, halfway, hessian
from ..interfaces.shear_solve_kernels import pulled as drawn

# of contacts.arrays.Climbing.flank, as in `contact_kernels`
LOAD = 0
KIND = 5
# of now_at
PLACE = 11
NORMAL = 13
TINY = 1e-13  # of the friction limit, to which pieces that give way are solved


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begun(c, v, dt):
    """Begin a step of dt [s] at the speed v [m/s] along the flank."""
    halfway(v, dt, c)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def drag(ds, flat, end, dt, c):
    """(mean force [N] along the flank over the path ds [m] in dt [s], its slope [N/m]); c.pressed become shares of the
    normal force flat + f end at the end, on a slope `end`, where f is the force there."""
    kind = int(c.flank[KIND])
    pulled = 0.0
    gain = 0.0
    at = c.now_at
    gives = c.kappa.size > 0
    close = (1e-12 if gives else 1e-14) * c.flank[LOAD]
    tried = 0.0
    missed = 0.0
    for count in range(60):
        before = at[NORMAL]
        press_all(kind, c)
        if gives:
            c.y[0, 0] = ds
            pulled = descend(ds, 0.0, kind, False, c, TINY * c.force[0] * c.flank[LOAD])[0]
        else:
            pulled, gain = rub_force(ds, kind, c)
        bound = c.force[0] * before
        after = min(max(2 * pulled - at[PLACE], -bound), bound)
        now = max(flat + after * end, 0.0)
        miss = now - before
        if (
            gives
            and count > 0
            and abs(miss) > close
            and abs(missed - miss) > 0.1 * abs(before - tried)
        ):
            # secant: a solve is dear
            load(c, max(before - miss * (before - tried) / (miss - missed), 0.0))
        else:
            load(c, now)
        tried = before
        missed = miss
        if abs(miss) <= close:
            break
    return pulled, stiff(c) if gives else gain


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def load(c, normal):
    """Put the normal force [N] on the points."""
    c.now_at[NORMAL] = normal
    for j in range(c.pressed.shape[1]):
        c.pressed[1, j] = c.share[j] * normal


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stiff(c):
    """Slope [N/m] of the force over the slide of the holder, of points behind shear modes that have been solved for."""
    hess = c.hess[0]
    p = c.workspace[STEP]
    total = 0.0
    for j in range(int(c.count[0])):
        total += c.points[SLOPE, j]
    if c.ready[0] == 0.0:
        hessian(0.0, False, c, hess)
        if not factor(hess):
            return total
        c.ready[0] = 1.0
    drawn(SLOPE, c.psi, c.points, int(c.count[0]), p)
    p[0] = 0.0
    return max(total - bent(hess, p, c.workspace[GRADIENT]), 0.01 * total)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def bent(hess, p, workspace):
    """p . hess^-1 p (n,) of a factor."""
    for k in range(p.size):
        workspace[k] = p[k]
    return solve_factored(hess, workspace)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(ds, along, v0, v1, dt, c):
    """Keep the step over the path ds [m] under the mean force `along` [N] between the speeds v0, v1 [m/s] along the
    flank; (energy dissipated [J], whether points and pieces agree)."""
    kind = int(c.flank[KIND])
    fine = True
    lost = rub_commit(ds, along, v0, v1, dt, kind, c)
    if c.kappa.size:
        more, count = spring_back(kind, c, c.force[0] * c.flank[LOAD] * 1e-11)
        lost = lost + more
        fine = count > 0
    for j in range(c.pressed.shape[1]):
        c.pressed[0, j] = c.pressed[1, j]
    return lost, fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q):
    """(force along the flank [N], energy stored in the law [J], irreversible slip [m]) at the slide q [m]."""
    return rub_state(int(c.flank[KIND]), c, q)
