"""Points of a contact that climbs flanks, under a law with memory (compiled).

They carry the normal force of the flank and slide along it: one point for rigid pieces, or those
behind shear modes as in `interfaces.shear_solve_kernels`.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..interfaces.arrays import PointRow, PressedPlace, StepProblem, WorkRow
from ..interfaces.pressed_points_kernels import (
    commit_points,
    find_friction_force,
    press_points,
    read_points,
    relax_pieces,
)
from ..interfaces.shear_solve_kernels import (
    minimise,
    project_onto_modes,
    set_middle_length,
    write_hessian,
)
from .arrays import ClimbPlace, FlankPlace

# residual over the friction limit, to which pieces that deform in shear are solved
SHEAR_GOAL = 1e-13


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_step(contact, v, dt):
    """Start a step.

    Parameters
    ----------
    contact : ClimbingPoints
    v : float
        Velocity along the flank [m/s].
    dt : float
        Duration of the step [s].
    """
    set_middle_length(v, dt, contact)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_friction(ds, flat, end, dt, contact):
    """Solve for the friction over the path ds [m] in dt [s].

    contact.pressed become the loads at the end of the step.

    The normal force at the end is flat + f end, where f is the force there; secant steps find it.

    Parameters
    ----------
    ds : float
    flat, end : float
        Normal force without friction [N], and slope at the end [1].
    dt, contact

    Returns
    -------
    force : float
        Mean along the flank [N].
    stiffness : float
        Its derivative [N/m].
    """
    kind = int(contact.flank[FlankPlace.KIND])
    force = 0.0
    gain = 0.0
    at = contact.climb
    gives = contact.kappa.size > 0
    close = (1e-12 if gives else 1e-14) * contact.flank[FlankPlace.LOAD]
    goal = SHEAR_GOAL * contact.force[PressedPlace.MU_STATIC] * contact.flank[FlankPlace.LOAD]
    tried = 0.0
    missed = 0.0
    for count in range(60):
        before = at[ClimbPlace.END_NORMAL]
        press_points(kind, contact)
        if gives:
            contact.y[0, 0] = ds
            force, _ = minimise(StepProblem(ds, 0.0, kind, False), contact, goal)
        else:
            force, gain = find_friction_force(ds, kind, contact)
        bound = contact.force[PressedPlace.MU_STATIC] * before
        after = min(max(2 * force - at[ClimbPlace.START_FORCE], -bound), bound)
        now = max(flat + after * end, 0.0)
        miss = now - before
        if (
            gives
            and count > 0
            and abs(miss) > close
            and abs(missed - miss) > 0.1 * abs(before - tried)
        ):
            # secant method, because every solution is expensive
            set_normal_force(contact, max(before - miss * (before - tried) / (miss - missed), 0.0))
        else:
            set_normal_force(contact, now)
        tried = before
        missed = miss
        if abs(miss) <= close:
            break
    return force, find_stiffness(contact) if gives else gain


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def set_normal_force(contact, normal):
    """Distribute a normal force [N] over the points."""
    contact.climb[ClimbPlace.END_NORMAL] = normal
    for j in range(contact.pressed.shape[1]):
        contact.pressed[1, j] = contact.share[j] * normal


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stiffness(contact):
    """Return the derivative [N/m] of the force over the slide of the holder."""
    hess = contact.hess[0]
    p = contact.workspace[WorkRow.STEP]
    total = 0.0
    for j in range(int(contact.count[0])):
        total += contact.points[PointRow.SLOPE, j]
    if contact.ready[0] == 0.0:
        write_hessian(StepProblem(0.0, 0.0, 0, False), contact, hess)
        if not factorise(hess):
            return total
        contact.ready[0] = 1.0
    project_onto_modes(PointRow.SLOPE, contact.psi, contact.points, int(contact.count[0]), p)
    p[0] = 0.0
    return max(
        total - find_inverse_form(hess, p, contact.workspace[WorkRow.GRADIENT]), 0.01 * total
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_inverse_form(hess, p, workspace):
    """Return the quadratic form p . hess^-1 p of the inverse of a matrix.

    Parameters
    ----------
    hess : ndarray
        (n, n) factorised matrix.
    p : ndarray
        (n,).
    workspace : ndarray
        (n,).

    Returns
    -------
    float
    """
    for k in range(p.size):
        workspace[k] = p[k]
    return solve_factorised(hess, workspace)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_friction(ds, along, start, end_velocity, contact):
    """Keep a step over a path along the flank.

    Parameters
    ----------
    ds : float
        Path [m].
    along : float
        Mean force over it [N].
    start : interfaces.arrays.StepStart
        With the velocity along the flank.
    end_velocity : float
        Velocity along the flank at the end [m/s].
    contact : ClimbingPoints

    Returns
    -------
    lost : float
        Energy dissipated [J].
    is_solved : bool
        Whether points and pieces agree.
    """
    kind = int(contact.flank[FlankPlace.KIND])
    fine = True
    lost = commit_points(ds, along, start, end_velocity, kind, contact)
    if contact.kappa.size:
        more, count = relax_pieces(
            kind,
            contact,
            contact.force[PressedPlace.MU_STATIC] * contact.flank[FlankPlace.LOAD] * 1e-11,
        )
        lost = lost + more
        fine = count > 0
    for j in range(contact.pressed.shape[1]):
        contact.pressed[0, j] = contact.pressed[1, j]
    return lost, fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_friction(contact, q):
    """Return force along the flank [N], energy of the law [J] and slip [m] at q [m]."""
    return read_points(int(contact.flank[FlankPlace.KIND]), contact, q)
