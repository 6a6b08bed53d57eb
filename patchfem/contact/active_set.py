"""Primal active-set method for the unilateral contact of a patch under a rigid holder.

Find nodal forces f >= 0 and a motion q of the holder such that

    w = g - R q + C f >= 0,    f . w = 0,    R^T f + S q = t,

with the gap g, the closing R of the nodes per unit of each free motion, the compliance C, the springs S of the holder
and the prescribed load and moment t. These are the optimality conditions of a strictly convex quadratic program with
the energy f . C f/2 + g . f (+ that of the springs).

`solve_on_set` solves the equations w = 0 on a set A of active nodes and f = 0 elsewhere, signs aside. `solve_primal`
exchanges one node of the set at a time; the energy decreases, so the method ends.
"""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged
from ..elasticity.lapack import dpotrf, dpotrs

# Rounding error of an opening, relative to the sum of the magnitudes of its terms
OPENING_ROUND_OFF = 1e-14
N_REFINEMENT_STEPS = 2  # number of steps of iterative refinement; a third step changes nothing


class ContactProblem(NamedTuple):
    """Contact of the n nodes of a patch that is pressed by a rigid holder with r free motions.

    - gap (n,): Gap [m] between the undeformed surfaces; negative where they overlap under a given approach.
    - motions (n, r): Closing of each node per unit of each free motion: ones for the approach [m], then the positions
      [m] for the rotation. No column: the approach is prescribed and already contained in the gap.
    - target (r,): Load [N], then the moment about x = 0 [N m] of a free rotation.
    - springs (r,): Stiffness of the holder against each motion: 0 for the approach, [N m/rad] for the rotation.
    """

    gap: np.ndarray
    motions: np.ndarray
    target: np.ndarray
    springs: np.ndarray

    @property
    def has_free_rotation(self) -> bool:
        """Whether the holder rotates and no spring restrains it."""
        return self.springs.size == 2 and self.springs[1] == 0

    @property
    def min_nodes(self) -> int:
        """Smallest number of nodes in contact that determines the motion of the holder."""
        return 2 if self.has_free_rotation else 1


def make_problem(x, gap, load=None, moment=None, spring: float = 0.0) -> ContactProblem:
    """Return the contact problem of a patch, with an unknown motion for each prescribed load.

    Parameters
    ----------
    x, gap : (n,) ndarray
        Positions [m] along the interface and gap [m].
    load : float, optional
        Load [N]; without it the approach is prescribed and contained in the gap.
    moment : float, optional
        Moment of the load about x = 0 [N m], the rotation being free; without it the rotation is prescribed.
    spring : float
        Stiffness [N m/rad] of the holder against the rotation.

    Returns
    -------
    ContactProblem
    """
    loads = [value for value in (load, moment) if value is not None]
    motions = np.ones((len(loads), x.size))
    motions[1:] = x
    springs = np.array([0.0, spring])[: len(loads)]
    return ContactProblem(gap, motions.T, np.array(loads, float), springs)


def factorise(matrix: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor (n, n) of a symmetric matrix (n, n), which is overwritten.

    Raises LinAlgError if the matrix is not positive definite.
    """
    lower_factor, info = dpotrf(matrix.T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("not positive definite")
    return lower_factor


class SetSolution(NamedTuple):
    """Solution of the contact equations for a given active set; the forces may have either sign.

    - force, opening (n,): Forces [N] and gap under load [m].
    - scale (n,): Sum of the magnitudes of the terms of each opening [m], to which its rounding error is
      compared.
    - motion (r,): Approach [m] and rotation [rad] q.
    """

    force: np.ndarray
    opening: np.ndarray
    scale: np.ndarray
    motion: np.ndarray


def solve_on_set(
    compliance, problem: ContactProblem, active: np.ndarray, n_refinements: int = 0
) -> SetSolution:
    """Solve for the forces and the holder motion for given nodes in contact; forces may have either sign.

    The motions R T are orthogonal in the norm of C^-1 on the set plus the springs (modified Gram-Schmidt), so each
    motion is found from a single division. Two neighbouring nodes at the far end of the interface then lose no digits.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N], positive definite on the active nodes.
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    active : (n,) bool ndarray
        Nodes with opening 0; the others carry no force.
    n_refinements : int
        Number of steps of iterative refinement.

    Returns
    -------
    SetSolution

    Raises
    ------
    LinAlgError
        If the set does not determine the motion, or the compliance is not positive definite on it.
    """
    index = active.nonzero()[0]
    nodes = slice(index.size)
    n_motions = problem.target.size
    gap = problem.gap[index]

    # The smallest gap is subtracted first, because the approach may be far smaller than the gaps.
    offset = gap.min() if n_motions else 0.0
    # There is one right-hand side for the gap and one for each motion. The first columns are the gap
    # or the displacement of the nodes; the last columns of the motions begin as the identity and
    # become T, transposed.
    right_sides = np.zeros((1 + n_motions, index.size + n_motions))
    right_sides[0, nodes] = gap - offset
    rows = right_sides[1:]
    rows[:, nodes] = problem.motions.T[:, index]
    rows[:, index.size :] = np.eye(n_motions)
    rows[1:] -= (rows[1:, :1] + rows[1:, index.size - 1 : index.size]) / 2 * rows[:1]
    factor = factorise(compliance[index[:, None], index])

    # The solution holds the forces that these motions cause in the nodes, then in the springs.
    solution = right_sides.copy()
    solution[:, nodes] = dpotrs(factor, right_sides[:, nodes].T, lower=1)[0].T
    solution[:, index.size :] *= problem.springs

    # Modified Gram-Schmidt: the motions are made orthogonal, in the scalar product of C^-1. Forces of one motion then do
    # no work in another.
    forces = solution[1:]
    stiffness = np.empty(n_motions)
    for k in range(n_motions):
        for j in range(k):
            shift = (rows[j] @ forces[k]) / stiffness[j]
            rows[k] -= shift * rows[j]
            forces[k] -= shift * forces[j]
        stiffness[k] = rows[k] @ forces[k]
        if not stiffness[k] > 0:
            raise np.linalg.LinAlgError("the nodes in contact do not determine the motion")
    transform = rows[:, index.size :].T
    motions = transform.T @ problem.motions.T
    target = transform.T @ problem.target

    def close_gap(gap_force: np.ndarray, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodal forces (k,) [N] and orthogonalized motions (r,) that close a gap.

        `gap_force` (k,) [N] are the forces that close the gap without any motion, and `loads` (r,) the loads on the
        motions.
        """
        motion = (loads + rows[:, nodes] @ gap_force) / stiffness
        return motion @ forces[:, nodes] - gap_force, motion

    # Iterative refinement: the openings that a solution leaves in the contact are closed by a further solution
    nodal_force, motion = close_gap(solution[0, nodes], target)
    motion[:1] += offset
    force = np.zeros(problem.gap.size)
    for step in range(n_refinements + 1):
        force[index] = nodal_force
        displacement = compliance @ force
        opening = problem.gap - motion @ motions + displacement
        if step < n_refinements:
            spring_load = transform.T @ (motion @ forces[:, index.size :])
            force_change, motion_change = close_gap(
                gap_force=dpotrs(factor, opening[index], lower=1)[0],
                loads=target - rows[:, nodes] @ nodal_force - spring_load,
            )
            nodal_force = nodal_force + force_change
            motion = motion + motion_change

    return SetSolution(
        force=force,
        opening=opening,
        scale=np.abs(problem.gap) + np.abs(motion) @ np.abs(motions) + np.abs(displacement).max(),
        motion=transform @ motion,
    )


def _refine_solution(
    compliance, problem: ContactProblem, solution: SetSolution, active
) -> SetSolution:
    """Return the solution on a set, improved by iterative refinement where rounding errors show in its openings.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N].
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    solution : SetSolution
        Solution on the set; it is kept if the refinement does not reduce its violation.
    active : (n,) bool ndarray
        Nodes in contact.

    Returns
    -------
    SetSolution
    """
    # The solution is refined only if an opening exceeds a tenth of the overlap at which a node
    # enters the set.
    error = np.abs(solution.opening[active])
    if not (error > OPENING_ROUND_OFF / 10 * solution.scale[active]).any():
        return solution
    refined = solve_on_set(compliance, problem, active, N_REFINEMENT_STEPS)
    return min(solution, refined, key=compute_relative_violation)


def compute_relative_violation(solution: SetSolution) -> float:
    """Return the largest relative violation of the contact conditions [1] by a `SetSolution`.

    Openings in contact and overlaps are relative to the terms of the opening, tensile forces to the load.
    """
    opening = solution.opening / np.where(solution.scale > 0, solution.scale, 1.0)
    in_contact = np.abs(opening[solution.force != 0]).max(initial=0.0)
    tension = -solution.force.min() / max(solution.force.sum(), 1e-300)
    return float(max(in_contact, -opening.min(), tension))


def _complete_set(problem: ContactProblem, active: np.ndarray) -> np.ndarray:
    """Return a contact set (n,) of bool with the nodes added without which it cannot carry the load.

    An empty set gets the nodes of the smallest gap. Where a set does not reach to both sides of the load line of a free
    rotation, the node of the smallest gap on each side is added.

    Parameters
    ----------
    problem : ContactProblem
        Gap, motions and loads of the n nodes.
    active : (n,) bool ndarray
        Contact set, which is not changed.
    """
    if not problem.has_free_rotation:
        return active if active.any() else problem.gap <= problem.gap.min()
    position = problem.motions[:, 1]
    load_line = problem.target[1] / problem.target[0]
    own = position[active]
    if own.size > 1 and own.min() <= load_line <= own.max():
        return active
    completed = active.copy()
    for is_side in (position <= load_line, position > load_line):
        completed[np.argmin(np.where(is_side, problem.gap, np.inf))] = True
    return completed


def solve_primal(
    compliance, problem: ContactProblem, force: np.ndarray, max_iterations: int | None = None
) -> tuple[SetSolution, int]:
    """Solve by the primal active-set method, which terminates after finitely many steps.

    Each step moves the forces towards the minimum of the energy on the active set. If a force becomes zero on the way
    (ratio test), the step ends there and its node leaves the set. Otherwise the step reaches the minimum, and the node
    of the largest overlap enters the set; without overlap the problem is solved.

    The method ends (Nocedal, Wright, Numerical Optimization, section 16.5):

    * The forces stay admissible, and the energy never rises, as it is convex along each step.
    * At most n nodes can leave one after the other, so a minimum on a set is reached after at most n steps.
    * There the gradient of the energy vanishes on the set. The node that enters has an overlap, a negative gradient, so
      its force rises in every following step until one of positive length lowers the energy.
    * Thus the energies at these minima decrease strictly, no set of them occurs twice, and there are finitely many.

    Parameters
    ----------
    compliance : (n, n) ndarray
        C [m/N], positive definite.
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    force : (n,) ndarray
        Forces [N] >= 0 whose resultants are the prescribed load and moment.
    max_iterations : int, optional
        Number of steps after which the method gives up, 20 n by default.

    Returns
    -------
    solution : SetSolution
    n_iterations : int

    Raises
    ------
    NotConverged
        If the steps are exceeded, which rounding errors alone can cause.
    """
    force = force.copy()
    active = force > 0
    max_iterations = max_iterations or 20 * force.size
    for iteration in range(1, max_iterations + 1):
        active = _complete_set(problem, active)
        solution = solve_on_set(compliance, problem, active)

        # Ratio test: the step towards the minimum ends where the first force becomes zero
        is_tensile = active & (solution.force < 0)
        if is_tensile.any():
            decrease = np.where(is_tensile, force - solution.force, 1.0)
            step = np.where(is_tensile, force / decrease, np.inf)
            leaving = int(np.argmin(step))
            force = np.maximum(force + step[leaving] * (solution.force - force), 0.0)
            force[leaving] = 0.0
            active[leaving] = False
            continue

        # The minimum on the set is reached; the node of the largest overlap enters, if there is any
        force = solution.force
        overlap = np.where(active, np.inf, solution.opening / solution.scale)
        entering = int(np.argmin(overlap))
        if overlap[entering] >= -OPENING_ROUND_OFF:
            return _refine_solution(compliance, problem, solution, active), iteration
        active[entering] = True
    raise NotConverged(
        "contact: the active-set iteration did not converge; refine contact.element_size or change the "
        "load"
    )


def find_rest_rotation(x, gap, load: float, moment: float, spring: float) -> float:
    """Return the rotation [rad] at which a rigid piece is in equilibrium under load and moment.

    The piece rests on the edge of the lower convex hull of the gap below the load line; against a spring it may rest
    on one corner.

    Parameters
    ----------
    x, gap : (m,) ndarray
        Increasing positions and gap [m].
    load, moment, spring : float
        Load [N], moment about x = 0 [N m] and stiffness of the holder [N m/rad].

    Returns
    -------
    float
        Rotation that opens the gap at positive x [rad].
    """
    left_index = 0
    right = x.size - 1
    while left_index < right:
        # Rotation at which the piece would rest on both nodes
        theta = -(gap[right] - gap[left_index]) / (x[right] - x[left_index])
        height = gap + theta * x
        lowest = int(np.argmin(height))

        # A node between them touches first. The side of it that the load line is on keeps the support.
        if left_index < lowest < right and height[lowest] < min(height[left_index], height[right]):
            imbalance = load * x[lowest] - moment - spring * theta
            if imbalance == 0:
                return float(theta)
            if imbalance > 0:
                right = lowest
            else:
                left_index = lowest
        # Both nodes touch. Against a spring the moment may lift the piece off one of them.
        elif spring > 0 and load * x[left_index] - moment - spring * theta > 0:
            right = left_index
        elif spring > 0 and load * x[right] - moment - spring * theta < 0:
            left_index = right
        else:
            return float(theta)

    # The piece rests on one node, and the spring balances the moment
    return float((load * x[left_index] - moment) / spring)


def find_rest_motion(problem: ContactProblem) -> np.ndarray:
    """Return approach [m] and rotation [rad] q (r,) at which a rigid piece rests on the other one.

    `problem` has the gap of the nodes and the loads; without a load r is 0.
    """
    motion = np.zeros(problem.target.size)
    gap = problem.gap
    if motion.size > 1:
        load, moment = problem.target
        position = problem.motions[:, 1]
        motion[1] = -find_rest_rotation(position, gap, load, moment, problem.springs[1])
        gap = gap - motion[1] * position
    motion[:1] = gap.min()
    return motion
