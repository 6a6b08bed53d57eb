"""Unilateral contact of the condensed interface: solution and independent check.

Find nodal forces f >= 0 with w = g + theta x - delta + C f >= 0 and f . w = 0. Either the approach delta is
prescribed, or the load sum f = N. Under a load the rotation theta is prescribed (it is part of g), free under a moment,
sum f x = M, or held by the spring of the holder, sum f x = M + K theta.

`solve` measures the gap from the rest position of a rigid piece and uses the primal-dual active-set method, for a patch
on a table of contact sets (`press_cases`); where that cycles, conjugate gradients and the primal active-set method
follow. `compute_residuals` checks every solution again and
shares no intermediate result with the solver.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core import NotConverged
from . import bounded
from .active_set import (
    OPENING_ROUND_OFF,
    ContactProblem,
    SetSolution,
    compute_relative_violation,
    find_rest_motion,
    guess_contact_set,
    solve_primal,
    solve_primal_dual,
)
from .press_cases import HolderCases, press_on_table
from .set_table import SetTable
from .strip_compliance import StripCompliance, factorise

# Largest relative residual of a solved contact; that of a wrong set is 1e-9 or more
CONTACT_RESIDUAL_TOL = 1e-12
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
    - motion (r,): Approach [m] and rotations [rad] q; the rotation about y is -theta.
    - n_iterations: Number of contact sets tried.
    """

    force: np.ndarray
    motion: np.ndarray
    n_iterations: int


def _solve_by_fallbacks(
    compliance, problem: ContactProblem, max_iterations: int
) -> tuple[SetSolution, int]:
    """Solve a contact problem by slower methods if the primal-dual method does not converge.

    The methods are, in turn: primal-dual from all nodes, primal-dual from the result of conjugate gradients, and primal,
    which always ends. The number of iterations is that of all methods.

    Parameters
    ----------
    compliance : StripCompliance
        Compliance [m/N] of the nodes.
    problem : ContactProblem
        Gap [m], motions and loads of the nodes.
    max_iterations : int
        Largest number of contact sets that the primal-dual method tries from each start.

    Returns
    -------
    solution : SetSolution
    n_iterations : int
        Number of contact sets and of gradient steps of all methods.
    """
    every_node = np.ones(problem.gap.size, bool)
    solution, n_first = solve_primal_dual(compliance, problem, every_node, max_iterations)
    if solution is not None and compute_relative_violation(solution) <= CONTACT_RESIDUAL_TOL:
        return solution, n_first

    force, _, _, n_second, _ = bounded.solve_nodal_forces(compliance, problem)
    # Smaller forces are remainders that the gradient steps have not yet removed.
    is_loaded = force > 1e-9 * force.max()
    solution, n_third = solve_primal_dual(compliance, problem, is_loaded, max_iterations)
    n_iterations = n_first + n_second + n_third
    if solution is not None and compute_relative_violation(solution) <= CONTACT_RESIDUAL_TOL:
        return solution, n_iterations
    solution, n_last = solve_primal(compliance, problem, force)
    return solution, n_iterations + n_last


def _solve_on_one_node(compliance, problem: ContactProblem, rest_rotation: float):
    """Solve a patch that touches at a single node, or return None if no node qualifies.

    The node lies under the load line. Any rotation that leaves the other nodes open is a solution. It is that without
    rotation of the holder if the other nodes are open then, else the mean of the two limits.

    Parameters
    ----------
    compliance
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
    displacement = compliance.product(force)
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


def _solve_as_one_case(
    compliance: StripCompliance, problem: ContactProblem, start: np.ndarray
) -> tuple[SetSolution | None, int]:
    """Solve a patch that is a single strip as the only case of a table of contact sets.

    Parameters
    ----------
    compliance : StripCompliance
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
    own = compliance.common
    if compliance.added is not None:
        own = own + np.diag(compliance.added[0])
    table = SetTable(own, columns, problem.gap.size, has_ends=False)

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
    scale = np.abs(pressed.closing[0]) @ np.abs(columns)
    return SetSolution(
        force=np.where(active, unknown, 0.0),
        opening=np.where(active, 0.0, unknown),
        scale=scale,
        motion=pressed.closing[0, :n_motions],
    ), table.n_sets


def solve(
    compliance: StripCompliance,
    problem: ContactProblem,
    start: np.ndarray | None = None,
    max_iterations: int = 100,
) -> ContactSolution:
    """Solve a contact problem of a patch or of several strips.

    The forces are those of a strictly convex quadratic program, so that neither the set from which the search starts
    nor the method that finds them changes them. The residuals of every pressed patch are computed anew
    (`compute_residuals`).

    Parameters
    ----------
    compliance : StripCompliance
        C, positive definite.
    problem : ContactProblem
        Without a free rotation, its gap [m] is measured from a point near the contact: an offset costs digits.
    start : (n,) bool ndarray, optional
        Contact set of a similar problem, which saves iterations.
    max_iterations : int
        Number of sets that the primal-dual method may try each time.

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
    is_patch = problem.gap.size == len(compliance.common)
    if is_patch and problem.min_nodes == 2:
        solution = _solve_on_one_node(compliance, problem, rest_motion[1])

    if solution is None:
        if start is None or np.count_nonzero(start) < problem.min_nodes:
            start = guess_contact_set(compliance, problem)
        if is_patch:
            solution, n_iterations = _solve_as_one_case(compliance, problem, start)
        else:
            solution, n_iterations = solve_primal_dual(compliance, problem, start, max_iterations)
        if solution is None or not compute_relative_violation(solution) <= CONTACT_RESIDUAL_TOL:
            solution, n_more = _solve_by_fallbacks(compliance, problem, max_iterations)
            n_iterations += n_more
    return ContactSolution(solution.force, solution.motion + rest_motion, n_iterations)


def compute_residuals(
    compliance: StripCompliance, problem: ContactProblem, solution: ContactSolution
) -> dict[str, float]:
    """Compute the relative residuals of the contact conditions for a solution.

    An opening is relative to the sum of the magnitudes of its terms at the same node, so a spike of the gap elsewhere
    hides no error.

    Parameters
    ----------
    compliance : StripCompliance
        C of the problem.
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
    magnitudes = replace(compliance, common=np.abs(compliance.common))
    opening = problem.gap - problem.motions @ solution.motion + compliance.product(force)
    scale = np.abs(problem.gap) + np.abs(problem.motions) @ np.abs(solution.motion)
    scale += magnitudes.product(np.abs(force))
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
    """Compute the relative residuals of the balance of load and moments.

    A moment is relative to the load times the length over which its axis varies, plus the moment of the spring.

    Parameters
    ----------
    problem : ContactProblem
        Motions, loads and springs.
    solution : ContactSolution or AsperitySolution
        Forces and motion that are checked.

    Returns
    -------
    dict of float
        force_balance, moment_balance of a rotation about y and roll_balance of a roll, as far as they are free.
    """
    out = {}
    for k, (target, spring) in enumerate(zip(problem.target, problem.springs)):
        arm = problem.motions[:, k]
        spring_moment = spring * solution.motion[k]
        error = abs(target - arm @ solution.force - spring_moment)
        if k == 0:
            out["force_balance"] = float(error / target)
            continue
        # The arm of a roll is the same at neighbouring nodes of a strip.
        name = "moment_balance" if arm[0] != arm[1] else "roll_balance"
        scale = problem.target[0] * np.ptp(arm) + abs(spring_moment)
        out[name] = float(error / scale)
    return out


def explain_singular_set(c: np.ndarray, problem: ContactProblem) -> str:
    """Return the error message for a contact set whose equations are singular.

    A prescribed rotation is determined by any node in contact, so only the compliance itself can be at fault.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance of the pieces [m/N].
    problem : ContactProblem
        Problem whose equations are singular.
    """
    try:
        factorise(np.array(c, order="C"))
    except np.linalg.LinAlgError:
        return INDEFINITE_COMPLIANCE_MESSAGE
    if problem.target.size < 2:
        return (
            "contact: numbers in the contact equations became too large to compute; check the units and magnitudes "
            "of load, gap and stiffnesses"
        )
    holder = "name" if problem.free_rotations else "raise"
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
