"""Points of a contact on climbing flanks under a law with memory (compiled).

They carry the normal force of the flank and slide along it: one point for rigid pieces, or those
behind shear modes as in `interfaces.shear_solve_kernels`.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..interfaces.arrays import PointRow, PressedIndex, StepProblem, WorkRow
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
from .arrays import ClimbIndex, FlankIndex

# Tolerance of the friction force for pieces that deform in shear, relative to the friction limit.
SHEAR_GOAL = 1e-13


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_step(contact, v, dt):
    """Start a time step of the points: set the bond length at its middle.

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
    """Solve for the mean friction force of the points over a path along the flank.

    The loads of the points at the end of the step are written to contact.pressed.

    The normal force at the end is flat + f end, where f is the friction force there; it is found by the secant method.

    Parameters
    ----------
    ds : float
    flat, end : float
        Normal force in the absence of friction [N], and slope at the end [1].
    dt, contact

    Returns
    -------
    force : float
        Mean friction force along the flank [N].
    stiffness : float
        Derivative of the force by the path [N/m].
    """
    kind = int(contact.flank[FlankIndex.KIND])
    force = 0.0
    gain = 0.0
    climb = contact.climb
    deforms = contact.kappa.size > 0
    normal_tol = (1e-12 if deforms else 1e-14) * contact.flank[FlankIndex.LOAD]
    goal = SHEAR_GOAL * contact.force[PressedIndex.MU_STATIC] * contact.flank[FlankIndex.LOAD]
    last_normal = 0.0
    last_residual = 0.0
    for count in range(60):
        normal = climb[ClimbIndex.END_NORMAL]
        press_points(kind, contact)
        if deforms:
            contact.y[0, 0] = ds
            force, _ = minimise(StepProblem(ds, 0.0, kind, False), contact, goal)
        else:
            force, gain = find_friction_force(ds, kind, contact)
        bound = contact.force[PressedIndex.MU_STATIC] * normal
        after = min(max(2 * force - climb[ClimbIndex.START_FORCE], -bound), bound)
        new_normal = max(flat + after * end, 0.0)
        residual = new_normal - normal
        if (
            deforms
            and count > 0
            and abs(residual) > normal_tol
            and abs(last_residual - residual) > 0.1 * abs(normal - last_normal)
        ):
            # The secant method is used because every solution is expensive.
            set_normal_force(
                contact,
                max(normal - residual * (normal - last_normal) / (residual - last_residual), 0.0),
            )
        else:
            set_normal_force(contact, new_normal)
        last_normal = normal
        last_residual = residual
        if abs(residual) <= normal_tol:
            break
    return force, find_stiffness(contact) if deforms else gain


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def set_normal_force(contact, normal):
    """Distribute a normal force [N] over the points in proportion to their load."""
    contact.climb[ClimbIndex.END_NORMAL] = normal
    for j in range(contact.pressed.shape[1]):
        contact.pressed[1, j] = contact.share[j] * normal


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stiffness(contact):
    """Return the derivative [N/m] of the friction force with respect to the slide of the holder."""
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
    """Return the quadratic form p . hess^-1 p of the inverse of a factorised matrix.

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
    """Update the points after a converged step along the flank.

    Parameters
    ----------
    ds : float
        Path [m].
    along : float
        Mean friction force over the path [N].
    start : interfaces.arrays.StepStart
        Start of the step, with the velocity along the flank.
    end_velocity : float
        Velocity along the flank at the end [m/s].
    contact : ClimbingPoints

    Returns
    -------
    lost : float
        Energy dissipated [J].
    is_solved : bool
        Whether points and pieces reached equilibrium.
    """
    kind = int(contact.flank[FlankIndex.KIND])
    is_solved = True
    dissipated = commit_points(ds, along, start, end_velocity, kind, contact)
    if contact.kappa.size:
        relaxation_loss, count = relax_pieces(
            kind,
            contact,
            contact.force[PressedIndex.MU_STATIC] * contact.flank[FlankIndex.LOAD] * 1e-11,
        )
        dissipated = dissipated + relaxation_loss
        is_solved = count > 0
    for j in range(contact.pressed.shape[1]):
        contact.pressed[0, j] = contact.pressed[1, j]
    return dissipated, is_solved


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_friction(contact, q):
    """Return friction force along the flank [N], energy [J] and slip [m] of the points."""
    return read_points(int(contact.flank[FlankIndex.KIND]), contact, q)
