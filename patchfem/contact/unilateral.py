"""Unilateral contact of the condensed interface: solution and independent check.

Find nodal forces f >= 0 with w = g + theta x - delta + C f >= 0 and f . w = 0. Either the approach delta is
prescribed, or the load sum f = N. Under a load the rotation theta is prescribed (it is part of g), free under a moment,
sum f x = M, or held by the spring of the holder, sum f x = M + K theta.

`solve` measures the gap from the rest position of a rigid piece and finds the contact set on a table of contact sets
(`press_cases`); where that cycles, conjugate gradients and the primal active-set method follow. `compute_residuals`
checks every solution again and shares no intermediate result with the solver.
"""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged
from . import bounded
from .active_set import (
    OPENING_ROUND_OFF,
    ContactProblem,
    SetSolution,
    compute_relative_violation,
    factorise,
    find_rest_motion,
    solve_primal,
)
from .press_cases import HolderCases, press_on_table
from .set_table import SetTable

# Largest relative residual of a solved contact; that of a wrong set is 1e-9 or more
CONTACT_RESIDUAL_TOL = 1e-12
# Largest residual of the conjugate gradients, from which the primal active-set method goes on
GRADIENT_RESIDUAL_TOL = 1e-11
# Message about a compliance that is not positive definite
INDEFINITE_COMPLIANCE_MESSAGE = (
    "contact: the compliance of the pieces is not positive definite to working precision; raise "
    "contact.element_size, bring the stiffnesses of coating and substrate closer together, or check the "
    "cells of contact.mesh"
)
# Smallest total force [N] in a divisor; it keeps residuals of open pieces finite
MIN_TOTAL_FORCE = 1e-200


class ContactSolution(NamedTuple):
    """Solution of a contact problem: nodal forces and motion of the holder.

    - force (n,): Nodal forces [N], > 0 on the contact set and 0 elsewhere.
    - motion (r,): Approach [m] and rotation [rad] q; the rotation is -theta.
    - n_iterations: Number of contact sets and of gradient steps tried.
    """

    force: np.ndarray
    motion: np.ndarray
    n_iterations: int


class _NodalCompliance:
    """Compliance (n, n) [m/N] of nodes as an operator of `bounded.solve_bounded`."""

    def __init__(self, compliance: np.ndarray):
        self.product = compliance.__matmul__
        self.self_compliance = float(compliance.diagonal().mean())

    def precondition(self, displacement: np.ndarray) -> np.ndarray:
        """Return the forces (n,) [N] of nodes without coupling for displacements (n,) [m]."""
        return displacement / self.self_compliance


def solve_by_gradients(
    compliance: np.ndarray, problem: ContactProblem
) -> "bounded.BoundedSolution":
    """Solve a contact problem by conjugate gradients, up to `GRADIENT_RESIDUAL_TOL`.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance [m/N] of the nodes.
    problem : ContactProblem
        Gap [m], motions, loads and springs.

    Returns
    -------
    BoundedSolution
        Forces (n,) [N] in place of tractions.
    """
    program = bounded.BoundedProblem(
        problem.gap, 0.0, np.inf, problem.motions.T, problem.target, problem.springs
    )
    operator = _NodalCompliance(compliance)
    return bounded.solve_bounded(operator, program, tolerance=GRADIENT_RESIDUAL_TOL)


def _solve_on_one_node(
    compliance, problem: ContactProblem, rest_rotation: float
) -> SetSolution | None:
    """Solve a patch that touches at a single node, or return None if no node qualifies.

    The node lies under the load line. Any rotation that leaves the other nodes open is a solution. It is that without
    rotation of the holder if the other nodes are open then, else the mean of the two limits.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance of the nodes [m/N].
    problem : ContactProblem
        Gap, motions of the holder and prescribed load and moment.
    rest_rotation : float
        Rotation q [rad] that is already contained in the gap.
    """
    gap = problem.gap
    position = problem.motions[:, 1]
    load, moment = problem.target
    node = int(np.argmin(np.abs(position - moment / load)))
    if abs(position[node] - moment / load) > 1e-15 * np.ptp(position):
        return None

    # Opening of the other nodes without rotation, and the rotation at which each of them would touch
    force = np.zeros(gap.size)
    force[node] = load
    displacement = compliance @ force
    arm = position - position[node]
    height = gap - gap[node] + displacement - displacement[node]
    noise = OPENING_ROUND_OFF * (np.abs(gap) + abs(displacement[node]))
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = (height + noise) / arm

    # The rotations that leave all other nodes open
    lower = bound[arm < 0].max(initial=-np.inf)
    upper = bound[arm > 0].min(initial=np.inf)
    if not lower <= upper:
        return None

    rotation = -rest_rotation if lower <= -rest_rotation <= upper else (lower + upper) / 2
    approach = gap[node] - rotation * position[node] + displacement[node]
    return SetSolution(
        force=force,
        opening=height - rotation * arm,
        scale=np.abs(height) + abs(displacement[node]) + np.abs(rotation * arm),
        motion=np.array([approach, rotation]),
    )


def solve_on_table(
    compliance: np.ndarray, problem: ContactProblem, start: np.ndarray
) -> tuple[SetSolution | None, int]:
    """Solve a contact problem as the only case of a table of contact sets.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance [m/N] of the nodes.
    problem : ContactProblem
        Gap [m], motions and loads of the nodes.
    start : (n,) bool ndarray
        First contact set.

    Returns
    -------
    solution : SetSolution or None
        None if no set meets the contact conditions to round-off.
    n_iterations : int
        Number of contact sets tried.
    """
    n_motions = problem.target.size
    columns = np.zeros((3, problem.gap.size))
    columns[0] = 1.0
    columns[1:n_motions] = problem.motions.T[1:]
    columns[2] = problem.gap
    table = SetTable(compliance, columns, problem.gap.size, has_ends=False)

    # A prescribed approach is contained in the gap
    load, moment = np.append(problem.target, [np.nan, np.nan])[:2]
    spring = problem.springs[1] if n_motions > 1 else 0.0
    approach = np.nan if n_motions else 0.0
    holder = HolderCases(*np.array([[load], [approach], [moment], [spring]]))
    pressed = press_on_table(table, holder, np.ones((1, 1)), start[None])
    if not pressed.is_solved[0]:
        return None, table.n_sets

    unknown = table.combine(pressed.slot, pressed.closing)[0]
    active = table.active[pressed.slot[0]]
    solution = SetSolution(
        force=np.where(active, unknown, 0.0),
        opening=np.where(active, 0.0, unknown),
        scale=np.abs(pressed.closing[0]) @ np.abs(columns),
        motion=pressed.closing[0, :n_motions],
    )
    if not compute_relative_violation(solution) <= CONTACT_RESIDUAL_TOL:
        return None, table.n_sets
    return solution, table.n_sets


def _guess_contact_set(compliance: np.ndarray, problem: ContactProblem) -> np.ndarray:
    """Guess the nodes in contact (n,) of a problem from the gap between rigid pieces in equilibrium.

    The closing is estimated as the geometric mean of the deflections under a point load and under a uniform load.
    Under a prescribed approach these are the nodes that overlap. `compliance` (n, n) [m/N] is that of the nodes.
    """
    gap = problem.gap
    if not problem.target.size:
        return gap < 0
    unit_depth = np.sqrt(np.abs(compliance.diagonal().mean() * compliance.mean()))
    return gap <= gap.min() + problem.target[0] * unit_depth


def solve(
    compliance: np.ndarray, problem: ContactProblem, start: np.ndarray | None = None
) -> ContactSolution:
    """Solve the contact problem of a patch.

    The forces are those of a strictly convex quadratic program, so that neither the set from which the search starts
    nor the method that finds them changes them. The residuals of every pressed patch are computed anew
    (`compute_residuals`).

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N], positive definite.
    problem : ContactProblem
        Without a free rotation, its gap [m] is measured from a point near the contact: an offset costs digits.
    start : (n,) bool ndarray, optional
        Contact set of a similar problem, which saves iterations.

    Returns
    -------
    ContactSolution

    Raises
    ------
    NotConverged
        If all methods fail.
    LinAlgError
        If the compliance is not positive definite.
    """
    # The gap is measured from the rest position of a rigid piece, which may close it by far more than the pieces deform
    rest_motion = np.zeros(problem.target.size)
    if rest_motion.size > 1:
        rest_motion = find_rest_motion(problem)
        problem = problem._replace(
            gap=problem.gap - problem.motions @ rest_motion,
            target=problem.target - problem.springs * rest_motion,
        )

    # A patch that may rotate freely can rest on a single node, whose set does not determine the rotation
    solution = None
    n_iterations = 0
    if problem.has_free_rotation:
        solution = _solve_on_one_node(compliance, problem, rest_motion[1])
    if solution is None:
        if start is None or np.count_nonzero(start) < problem.min_nodes:
            start = _guess_contact_set(compliance, problem)
        solution, n_iterations = solve_on_table(compliance, problem, start)

    # The primal method always ends; from the forces of the gradients it takes few steps
    if solution is None:
        by_gradients = solve_by_gradients(compliance, problem)
        solution, n_sets = solve_primal(compliance, problem, by_gradients.traction)
        n_iterations += by_gradients.n_iterations + n_sets
    return ContactSolution(solution.force, solution.motion + rest_motion, n_iterations)


def compute_residuals(
    compliance: np.ndarray, problem: ContactProblem, solution: ContactSolution
) -> dict[str, float]:
    """Compute the relative residuals of the contact conditions for a solution.

    An opening is relative to the sum of the magnitudes of its terms at the same node, so a spike of the gap elsewhere
    hides no error.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N] of the problem.
    problem : ContactProblem
        Gap [m], motions and loads as they were given.
    solution : ContactSolution
        Forces and motion that are checked.

    Returns
    -------
    dict of float
        penetration, tension, complementarity, and the balances of `compute_balances`.
    """
    force = solution.force
    opening = problem.gap - problem.motions @ solution.motion + compliance @ force
    scale = np.abs(problem.gap) + np.abs(problem.motions) @ np.abs(solution.motion)
    scale += np.abs(compliance) @ np.abs(force)
    relative_opening = opening / np.where(scale > 0, scale, 1.0)
    load = max(force.sum(), MIN_TOTAL_FORCE)
    residuals = {
        "penetration": max(0.0, -relative_opening.min()),
        "tension": max(0.0, -force.min()) / load,
        "complementarity": np.abs(force * relative_opening).sum() / load,
    }
    return {key: float(value) for key, value in residuals.items()} | compute_balances(
        problem, solution
    )


def compute_balances(problem: ContactProblem, solution) -> dict[str, float]:
    """Compute the relative residuals of the balance of load and moment, as far as they are prescribed.

    A moment is relative to the load times the length of the interface, plus the moment of the spring.

    Parameters
    ----------
    problem : ContactProblem
        Motions, loads and springs.
    solution : ContactSolution or AsperitySolution
        Forces and motion that are checked.

    Returns
    -------
    dict of float
        force_balance and moment_balance.
    """
    if not problem.target.size:
        return {}
    spring_load = problem.springs * solution.motion
    error = np.abs(problem.target - problem.motions.T @ solution.force - spring_load)
    scale = problem.target[0] * np.ptp(problem.motions, axis=0) + np.abs(spring_load)
    scale[0] = problem.target[0]
    return dict(zip(("force_balance", "moment_balance"), (error / scale).tolist()))


def explain_singular_set(compliance: np.ndarray, problem: ContactProblem) -> str:
    """Return the error message for a contact set whose equations are singular.

    A prescribed rotation is determined by any node in contact, so only the compliance itself can be at fault.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance of the pieces [m/N].
    problem : ContactProblem
        Problem whose equations are singular.
    """
    try:
        factorise(np.array(compliance, order="C"))
    except np.linalg.LinAlgError:
        return INDEFINITE_COMPLIANCE_MESSAGE
    if problem.target.size < 2:
        return (
            "contact: numbers in the contact equations became too large to compute; check the units and magnitudes "
            "of load, gap and stiffnesses"
        )
    holder = "name" if problem.has_free_rotation else "raise"
    return (
        "contact: the nodes that touch do not determine the rotation; lower contact.load_line.offset (with "
        f"contact.load_line.moment: raise contact.load) or {holder} contact.holder.rotational_stiffness"
    )


def refuse_residuals(residuals, tolerance: float, place: str = "contact", remedy: str = "") -> None:
    """Raise NotConverged if a residual exceeds its tolerance or is NaN.

    Parameters
    ----------
    residuals : mapping
        Relative residuals by name.
    tolerance : float
        Largest residual that is accepted.
    place : str
        Beginning of the message.
    remedy : str
        End of the message.
    """
    if all(value <= tolerance for value in residuals.values()):
        return
    largest_name = max(residuals, key=lambda name: (np.isnan(residuals[name]), residuals[name]))
    raise NotConverged(
        f"{place}: the residual {largest_name} = {residuals[largest_name]:.2e} exceeds {tolerance:.0e}{remedy}"
    )
