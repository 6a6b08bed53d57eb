"""Unilateral contact of the nodes of a patch under one rigid holder: solution and independent check.

Find nodal forces f >= 0 and a motion q of the holder such that

    w = g - R q + C f >= 0,    f . w = 0,    R^T f + S q = t,

with the gap g, the closing R of the nodes per unit of each free motion, the compliance C, the springs S of the holder
and the prescribed load and moment t. Without free motions the approach is prescribed and contained in the gap.

`solve` finds the contact set on a table of contact sets (`press_cases`), and again with the gap measured from the motion
found, which loses no digits to large motions. Where the sets cycle, the search starts from the set of conjugate gradients
(`bounded`), which reach the minimum of the energy f . C f/2 + g . f. `compute_residuals` decides whether a solution counts.
It shares no intermediate result with the solver.
"""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged
from ..elasticity.lapack import dpotrf
from . import bounded
from .press_cases import MAX_RESIDUAL, OPENING_ROUND_OFF, Holders, press_on_table
from .set_table import SetTable

# Message about a compliance that is not positive definite
INDEFINITE_COMPLIANCE_MESSAGE = (
    "contact: the compliance of the pieces is not positive definite to working precision; raise "
    "contact.element_size, bring the stiffnesses of coating and substrate closer together, or check the "
    "cells of contact.mesh"
)


class ContactSolution(NamedTuple):
    """Solution of a contact problem: nodal forces and motion of the holder.

    - force (n,): Nodal forces [N], > 0 on the contact set and 0 elsewhere.
    - motion (r,): Approach [m] and rotation [rad] q; the rotation is -theta.
    """

    force: np.ndarray
    motion: np.ndarray


def make_problem(x, gap, holder: Holders) -> "bounded.BoundedProblem":
    """Return the contact problem of a patch, with an unknown motion for each load that the holder prescribes.

    Parameters
    ----------
    x, gap : (n,) ndarray
        Positions [m] along the interface and gap [m], which contains a prescribed approach.
    holder : Holders
        Loads and prescribed motions, as numbers.

    Returns
    -------
    BoundedProblem
        Its motions are the approach [m] and the rotation -theta [rad]; without them the approach is prescribed.
    """
    loads = [value for value in (holder.load, holder.moment) if not np.isnan(value)]
    motions = np.ones((len(loads), x.size))
    motions[1:] = x
    springs = np.array([0.0, holder.spring][: len(loads)])
    return bounded.BoundedProblem(gap, 0.0, np.inf, motions, np.array(loads, float), springs)


class _NodalCompliance:
    """Compliance (n, n) [m/N] of nodes as an operator of `bounded.solve_bounded`."""

    def __init__(self, compliance: np.ndarray):
        self.product = compliance.__matmul__
        self.self_compliance = float(compliance.diagonal().mean())

    def precondition(self, displacement: np.ndarray) -> np.ndarray:
        """Return the forces (n,) [N] of nodes without coupling for displacements (n,) [m]."""
        return displacement / self.self_compliance


def solve_by_gradients(compliance: np.ndarray, problem) -> ContactSolution:
    """Solve a contact problem by conjugate gradients, so that the forces show the contact set.

    `compliance` (n, n) [m/N] is that of the nodes, and `problem` a BoundedProblem.
    """
    solution = bounded.solve_bounded(_NodalCompliance(compliance), problem, tolerance=1e-11)
    return ContactSolution(solution.traction, solution.motion)


def _solve_on_one_node(compliance: np.ndarray, problem) -> ContactSolution | None:
    """Solve a patch under a free rotation that touches at a single node, or return None if no node qualifies.

    The node lies under the load line. Any rotation that leaves the other nodes open is a solution. It is 0 if the other
    nodes are open then, else the mean of the two limits. `compliance` (n, n) [m/N] is that of the nodes.
    """
    gap = problem.gap
    position = problem.motions[1]
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
    rotation = 0.0 if lower <= 0 <= upper else (lower + upper) / 2
    approach = gap[node] - rotation * position[node] + displacement[node]
    return ContactSolution(force, np.array([approach, rotation]))


def solve_on_table(
    compliance: np.ndarray, problem, near: ContactSolution
) -> ContactSolution | None:
    """Solve a contact problem as the only case of a table of contact sets, with the gap measured from a motion.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance [m/N] of the nodes.
    problem : BoundedProblem
        Gap [m], motions and loads of the nodes.
    near : ContactSolution
        Motion from which the gap is measured, and forces of the first contact set; without any the set is a guess.

    Returns
    -------
    ContactSolution or None
        None if the sets cycle, or if the compliance is not positive definite on one of them.
    """
    # A prescribed approach is contained in the gap. Under a rotation the positions are measured from the load line, near
    # which a small contact lies, so that approach and rotation are well determined.
    n_motions = near.motion.size
    gap = problem.gap - near.motion @ problem.motions
    load, moment = np.append(problem.target - problem.springs * near.motion, [np.nan, np.nan])[:2]
    columns = np.stack([np.ones(gap.size), np.zeros(gap.size), gap])
    approach = np.nan if n_motions else 0.0
    spring = 0.0
    if n_motions > 1:
        spring = problem.springs[1]
        load_line = moment / load
        columns[1] = problem.motions[1] - load_line
        moment = 0.0

    table = SetTable(compliance, columns, gap.size, has_ends=False)
    holder = Holders(*np.array([[load], [approach], [moment], [spring]]))
    pressed = press_on_table(table, holder, np.ones((1, 1)), near.force[None] > 0)
    if pressed.slot[0] < 0:
        return None
    unknown = table.combine(pressed.slot, pressed.closing)[0]
    force = np.where(table.active[pressed.slot[0]], unknown, 0.0)
    motion = pressed.closing[0, :n_motions]
    if n_motions > 1:
        motion[0] -= load_line * motion[1]
    return ContactSolution(force, near.motion + motion)


def solve(compliance: np.ndarray, problem) -> ContactSolution:
    """Solve the contact problem of a patch.

    The forces are those of a strictly convex quadratic program, so that neither the set from which the search starts nor
    the method that finds them changes them.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N], positive definite.
    problem : BoundedProblem
        Gap [m], motions and loads of the nodes.

    Returns
    -------
    ContactSolution

    Raises
    ------
    NotConverged
        With a remedy, if no contact set can be solved for, or if the residuals of the solution are too large.
    """
    # A patch that may rotate freely can rest on a single node, whose set does not determine the rotation
    springs = problem.springs
    if springs.size == 2 and springs[1] == 0:
        solution = _solve_on_one_node(compliance, problem)
        if solution is not None:
            return solution

    # A gap that is measured from the motion found loses no digits; where the sets cycle, the gradients show the set
    near = ContactSolution(np.zeros(problem.gap.size), np.zeros(springs.size))
    residuals = {}
    # Number of tables on which a contact problem is solved, of which the last two start from the
    # gradients
    for attempt in range(4):
        solution = solve_on_table(compliance, problem, near)
        if solution is not None:
            residuals = compute_residuals(compliance, problem, solution)
            if all(value <= MAX_RESIDUAL for value in residuals.values()):
                return solution
        near = solution
        if solution is None or attempt == 1:
            near = solve_by_gradients(compliance, problem)
    if not residuals:
        raise NotConverged(explain_singular_set(compliance, problem))
    raise NotConverged(describe_residuals(residuals, MAX_RESIDUAL))


def compute_residuals(
    compliance: np.ndarray, problem, solution: ContactSolution
) -> dict[str, float]:
    """Compute the relative residuals of the contact conditions for a solution.

    An opening is relative to the sum of the magnitudes of its terms at the same node, so a spike of the gap elsewhere
    hides no error.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N] of the problem.
    problem : BoundedProblem
        Gap [m], motions and loads as they were given.
    solution : ContactSolution
        Forces and motion that are checked.

    Returns
    -------
    dict of float
        penetration, tension, complementarity, and the balances of `compute_balances`.
    """
    force = solution.force
    opening = problem.gap - solution.motion @ problem.motions + compliance @ force
    scale = np.abs(problem.gap) + np.abs(solution.motion) @ np.abs(problem.motions)
    scale += np.abs(compliance) @ np.abs(force)
    relative_opening = opening / np.where(scale > 0, scale, 1.0)
    # Smallest total force [N] in a divisor; it keeps residuals of open pieces finite
    load = max(force.sum(), 1e-200)
    residuals = {
        "penetration": max(0.0, -relative_opening.min()),
        "tension": max(0.0, -force.min()) / load,
        "complementarity": np.abs(force * relative_opening).sum() / load,
    }
    return {key: float(value) for key, value in residuals.items()} | compute_balances(
        problem, solution
    )


def compute_balances(problem, solution) -> dict[str, float]:
    """Compute the relative residuals of the balance of load and moment, as far as they are prescribed.

    A moment is relative to the load times the length of the interface, plus the moment of the spring.

    Parameters
    ----------
    problem : BoundedProblem
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
    error = np.abs(problem.target - problem.motions @ solution.force - spring_load)
    scale = problem.target[0] * np.ptp(problem.motions, axis=1) + np.abs(spring_load)
    scale[0] = problem.target[0]
    return dict(zip(("force_balance", "moment_balance"), (error / scale).tolist()))


def explain_singular_set(compliance: np.ndarray, problem) -> str:
    """Return the error message for a contact set whose equations are singular.

    A prescribed rotation is determined by any node in contact, so only the compliance itself can be at fault.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance of the pieces [m/N].
    problem : BoundedProblem
        Problem whose equations are singular.
    """
    if dpotrf(compliance.T, lower=1)[1]:
        return INDEFINITE_COMPLIANCE_MESSAGE
    if problem.target.size < 2:
        return (
            "contact: numbers in the contact equations became too large to compute; check the units and magnitudes "
            "of load, gap and stiffnesses"
        )
    holder = "name" if problem.springs[1] == 0 else "raise"
    return (
        "contact: the nodes that touch do not determine the rotation; lower contact.load_line.offset (with "
        f"contact.load_line.moment: raise contact.load) or {holder} contact.holder.rotational_stiffness"
    )


def describe_residuals(
    residuals, tolerance: float, place: str = "contact", remedy: str = ""
) -> str:
    """Return the error message for residuals of which one exceeds a tolerance or is NaN.

    Parameters
    ----------
    residuals : dict
        Relative residuals by name.
    tolerance : float
        Largest residual that is accepted.
    place, remedy : str
        Beginning and end of the message.
    """
    name = max(residuals, key=lambda name: (np.isnan(residuals[name]), residuals[name]))
    return f"{place}: the residual {name} = {residuals[name]:.2e} exceeds {tolerance:.0e}{remedy}"
