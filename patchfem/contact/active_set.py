"""Active-set methods for the unilateral contact of nodes under one rigid holder.

Find nodal forces f >= 0 and a motion q of the holder such that

    w = g - R q + C f >= 0,    f . w = 0,    R^T f + S q = t,

with the gap g, the closing R of the nodes per unit of each free motion, the compliance C, the springs S of the holder
and the prescribed load and moments t. These are the optimality conditions of a strictly convex quadratic program with
the energy f . C f/2 + g . f (+ that of the springs).

Both methods solve the equations w = 0 on a set A of active nodes and f = 0 elsewhere, signs aside (`solve_on_set`).
`solve_primal_dual` exchanges all nodes of a wrong sign at once; it takes few steps, but may return to a set.
`solve_primal` exchanges one node at a time; the energy decreases, so the method ends. A patch and several
strips differ in their compliance only (`strip_compliance`).
"""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged

# Rounding error of an opening, relative to the sum of the magnitudes of its terms
OPENING_ROUND_OFF = 1e-14
N_REFINEMENT_STEPS = 2  # number of steps of iterative refinement; a third step changes nothing


class ContactProblem(NamedTuple):
    """Contact of n nodes of a body that is pressed by a rigid holder with r unconstrained motions.

    - gap (n,): Gap [m] between the undeformed surfaces; negative where they overlap under a given approach.
    - motions (n, r): Closing of each node per unit of each free motion. The first one is the approach [m],
      a column of ones; the others are rotations. No column: the approach is prescribed and already
      contained in the gap.
    - target (r,): Load [N], then the moments about the axes of the free rotations [N m].
    - springs (r,): Stiffness [N m/rad] of the holder against each motion, 0 for the approach.
    """

    gap: np.ndarray
    motions: np.ndarray
    target: np.ndarray
    springs: np.ndarray

    @property
    def free_rotations(self) -> list[int]:
        """Indices of the rotations that no spring restrains."""
        return [k for k in range(1, self.springs.size) if self.springs[k] == 0]

    @property
    def min_nodes(self) -> int:
        """Smallest number of nodes in contact that determines the motion of the holder."""
        return 1 + len(self.free_rotations)


def make_patch_problem(x, gap, load=None, moment=None, spring: float = 0.0) -> ContactProblem:
    """Return the contact problem of a patch that consists of a single strip.

    Parameters
    ----------
    x, gap : (m,) ndarray
        Positions [m] along the interface and gap [m].
    load : float, optional
        Load [N]; without it the approach is prescribed and contained in the gap.
    moment : float, optional
        Moment of the load about x = 0 [N m], the rotation being free; without it the rotation is prescribed.
    spring : float
        Stiffness [N m/rad] of the holder against the rotation.
    """
    loads = [value for value in (load, moment) if value is not None]
    motions = np.ones((len(loads), x.size))
    motions[1:] = x
    springs = np.array([0.0, spring])[: len(loads)]
    return ContactProblem(gap, motions.T, np.array(loads, float), springs)


class SetSolution(NamedTuple):
    """Solution of the contact equations for a given active set; the forces may have either sign.

    - force, opening (n,): Forces [N] and gap under load [m].
    - scale (n,): Sum of the magnitudes of the terms of each opening [m], to which its rounding error is
      compared.
    - motion (r,): Approach [m] and rotations [rad] q.
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
    compliance : StripCompliance
        C, positive definite on the active nodes.
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
    solve_block = compliance.solver(active)

    # The solution holds the forces that these motions cause in the nodes, then in the springs.
    solution = right_sides.copy()
    solution[:, nodes] = solve_block(right_sides[:, nodes].T).T
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
        displacement = compliance.product(force)
        opening = problem.gap - motion @ motions + displacement
        if step < n_refinements:
            spring_load = transform.T @ (motion @ forces[:, index.size :])
            force_change, motion_change = close_gap(
                gap_force=solve_block(opening[index, None])[:, 0],
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


def refine_solution(compliance, problem, solution: SetSolution, active) -> SetSolution:
    """Improve a solution by iterative refinement on its active set if this reduces its violation.

    Parameters
    ----------
    compliance : StripCompliance
        Compliance with which it was found.
    problem : ContactProblem
        Problem that it solves.
    solution : SetSolution
        Solution on the set `active`; it is returned unless its openings show rounding errors.
    active : (n,) bool ndarray
        Nodes in contact.
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


def complete_set(problem: ContactProblem, active: np.ndarray) -> np.ndarray:
    """Add nodes to an active set until it can carry the load.

    An empty set gets the nodes of the smallest gap. Where a set does not reach to both sides of the load line of a free
    rotation, the node of the smallest gap on each side is added.

    `problem` gives the gap and the load lines. The array `active` (n,) of bool itself is not changed.
    """
    if not problem.free_rotations:
        return problem.gap <= problem.gap.min()
    for k in problem.free_rotations:
        position = problem.motions[:, k]
        load_line = problem.target[k] / problem.target[0]
        active_positions = position[active]
        if (
            active_positions.size > 1
            and active_positions.min() <= load_line <= active_positions.max()
        ):
            continue
        active = active.copy()
        for is_side in (position <= load_line, position > load_line):
            active[np.argmin(np.where(is_side, problem.gap, np.inf))] = True
    return active


def solve_primal_dual(
    compliance, problem: ContactProblem, active: np.ndarray, max_iterations: int = 100
) -> tuple[SetSolution | None, int]:
    """Solve by the primal-dual active-set method (Hintermüller, Ito, Kunisch 2003).

    Nodes of tensile force leave the set and nodes that overlap enter it, all at once, until the set repeats itself. The
    method usually takes 3 to 20 steps, but it may cycle.

    Parameters
    ----------
    compliance : StripCompliance
        C, positive definite.
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    active : (n,) bool ndarray
        Set to start from.
    max_iterations : int
        Number of sets after which the method gives up.

    Returns
    -------
    solution : SetSolution or None
        None if a set came back, a set was singular, or the number of iterations was exceeded.
    n_iterations : int
    """
    visited = set()
    for iteration in range(1, max_iterations + 1):
        if problem.free_rotations or not active.any():
            active = complete_set(problem, active)
        key = active.tobytes()
        if key in visited:
            return None, iteration
        visited.add(key)
        try:
            solution = solve_on_set(compliance, problem, active)
        except np.linalg.LinAlgError:
            return None, iteration
        overlaps = solution.opening < -OPENING_ROUND_OFF * solution.scale
        next_active = np.where(active, solution.force > 0, overlaps)
        if next_active.tobytes() == key:
            return refine_solution(compliance, problem, solution, active), iteration
        active = next_active
    return None, max_iterations


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
    compliance : StripCompliance
        C, positive definite.
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    force : (n,) ndarray
        Forces [N] >= 0 whose resultants are the prescribed load and moments.
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
        if problem.free_rotations or not active.any():
            active = complete_set(problem, active)
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
            return refine_solution(compliance, problem, solution, active), iteration
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
    """Return the motion q (r,) of a contact problem at which a rigid piece is in equilibrium.

    The rotations are found about one axis after the other.

    The motion is the approach [m], then the rotations [rad] that the problem leaves free.
    """
    motion = np.zeros(problem.target.size)
    gap = problem.gap
    for k in range(1, motion.size):
        position = problem.motions[:, k]
        lowest = gap
        # Several strips have nodes at the same position.
        if (position[1:] <= position[:-1]).any():
            position, group = np.unique(position, return_inverse=True)
            lowest = np.full(position.size, np.inf)
            np.minimum.at(lowest, group, gap)
        load = problem.target[0]
        motion[k] = -find_rest_rotation(
            position, lowest, load, moment=problem.target[k], spring=problem.springs[k]
        )
        gap = gap - motion[k] * problem.motions[:, k]
    motion[:1] = gap.min()
    return motion


def guess_contact_set(compliance, problem: ContactProblem) -> np.ndarray:
    """Guess the nodes in contact (n,) of a problem from the gap between rigid pieces in equilibrium.

    The closing is estimated as the geometric mean of the deflections under a point load and under a uniform load.
    Under a prescribed approach these are the nodes that overlap.

    `compliance` [m/N] is that of the n nodes: a `StripCompliance`, or an object with its `product` and
    `node_compliance`.
    """
    gap = problem.gap
    if not problem.target.size:
        return gap < 0
    uniform = compliance.product(np.full(gap.size, 1 / gap.size)).mean()
    depth = problem.target[0] * np.sqrt(abs(compliance.node_compliance * uniform))
    return gap <= gap.min() + depth
