"""Constrained conjugate gradients for contact, the fallback of the active-set methods.

The method is that of Polonsky and Keer (Wear 231, 1999, 206). It needs products with the compliance only, so it also
serves rows of thousands of points. After each step the load, or load and moments, are restored by the nearest
admissible forces. The energy is monitored: where it rises, a projected gradient step follows, which cannot fail.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .active_set import OPENING_ROUND_OFF, ContactProblem

# Rounding error of the energy, relative to the sum of the magnitudes of its terms
ENERGY_ROUND_OFF = 1e-13
# Largest error of a resultant, relative to the load, for which the forces are not projected again
RESULTANT_TOL = 1e-12


class _QuadraticProgram(NamedTuple):
    """Quadratic program: minimise f . C f/2 + g . f for f >= 0 and rigid^T f = target.

    - product: Function f -> C f.
    - gap (n,): The gap g [m].
    - rigid (n, r): Rigid motions, scaled to a largest closing of 1.
    - target (r,): Prescribed load and moments.
    """

    product: Callable[[np.ndarray], np.ndarray]
    gap: np.ndarray
    rigid: np.ndarray
    target: np.ndarray


def _quadratic_program(compliance, problem: ContactProblem) -> _QuadraticProgram:
    """Formulate the contact problem as a quadratic program.

    A spring becomes two more forces >= 0 that turn the piece either way, each with the compliance of a node. The program
    then has n + 2 forces.

    Parameters
    ----------
    compliance : StripCompliance
        Compliance [m/N] of the n nodes.
    problem : ContactProblem
        Gap [m], motions, loads and springs. At most one spring is not 0.

    Returns
    -------
    _QuadraticProgram
    """
    # Rotations about the middle, scaled to a largest closing of 1: the columns are then comparable
    rigid = problem.motions.astype(float)
    target = problem.target.copy()
    half_length = np.ones(target.size)
    for k in range(1, target.size):
        middle = rigid[:, k].mean()
        half_length[k] = np.ptp(rigid[:, k]) / 2
        rigid[:, k] = (rigid[:, k] - middle) / half_length[k]
        target[k] = (target[k] - target[0] * middle) / half_length[k]

    # Without a spring these are all forces. A spring adds two, which turn the piece in opposite directions.
    spring_indices = np.flatnonzero(problem.springs)
    if not spring_indices.size:
        return _QuadraticProgram(compliance.product, problem.gap, rigid, target)
    k = spring_indices[0]
    node_compliance = compliance.node_compliance
    arms = np.zeros((2, target.size))
    arms[:, k] = np.sqrt(problem.springs[k] * node_compliance) / half_length[k]
    arms[1] *= -1

    def product(force: np.ndarray) -> np.ndarray:
        """Return the displacements of nodes and springs under forces (n + 2,)."""
        return np.concatenate([compliance.product(force[:-2]), node_compliance * force[-2:]])

    gap = np.append(problem.gap, np.zeros(2))
    return _QuadraticProgram(product, gap, np.vstack([rigid, arms]), target)


def project_forces(
    force: np.ndarray, rigid: np.ndarray, target: np.ndarray, max_iterations: int = 100
) -> np.ndarray:
    """Project forces onto the nonnegative forces that have prescribed resultants.

    They are max(0, force + rigid q), where q maximises a concave, piecewise quadratic function. Newton's method with an
    exact line search finds it after finitely many pieces.

    Parameters
    ----------
    force : (n,) ndarray
        Forces [N] of either sign.
    rigid : (n, r) ndarray
        Rigid motions.
    target : (r,) ndarray
        Prescribed resultants rigid^T f.
    max_iterations : int
        Number of Newton steps.

    Returns
    -------
    (n,) ndarray
        Nearest such forces [N].
    """
    if not target.size:
        return np.maximum(force, 0.0)
    # This term keeps the Newton matrix regular where the nodes in contact do not determine all
    # motions.
    regularisation = rigid.T @ rigid
    regularisation += 1e-3 * np.trace(regularisation) * np.eye(target.size)

    # Newton's method for q: the derivative of the resultants is that of the forces above zero
    shifted = force
    for _ in range(max_iterations):
        projected_force = np.maximum(shifted, 0.0)
        resultant_error = target - rigid.T @ projected_force
        if np.abs(resultant_error).max() <= 1e-14 * target[0]:
            break
        in_contact = rigid[projected_force > 0]
        direction = np.linalg.solve(
            in_contact.T @ in_contact + 1e-10 * regularisation, resultant_error
        )
        change = rigid @ direction
        shifted = shifted + _line_search(shifted, change, target @ direction) * change
    return np.maximum(shifted, 0.0)


def _line_search(start: np.ndarray, change: np.ndarray, target_value: float) -> float:
    """Find the step t > 0 at which change . max(0, start + t change) has the value `target_value`.

    The left-hand side is piecewise linear in t. All entries have the unit that the caller gives them.

    Parameters
    ----------
    start, change : (k,) ndarray
        Values at t = 0, and their change per unit of t.
    target_value : float
        Prescribed value of the sum.

    Returns
    -------
    float
        Step t, or 0 if the sum stays below the value.
    """
    # Terms that are positive just after t = 0, and the steps at which a term appears or vanishes
    is_positive = (start > 0) | ((start == 0) & (change > 0))
    crossing = np.flatnonzero(start * change < 0)
    t = -start[crossing] / change[crossing]
    order = np.argsort(t)
    crossing = crossing[order]
    t = t[order]
    sign = np.sign(change[crossing])

    # Value at t = 0 and slope of every linear piece; the first piece that reaches the value holds the step
    first_value = start[is_positive] @ change[is_positive]
    first_slope = change[is_positive] @ change[is_positive]
    value = np.cumsum(np.append(first_value, sign * start[crossing] * change[crossing]))
    slope = np.cumsum(np.append(first_slope, sign * change[crossing] ** 2))
    crossing_pieces = np.flatnonzero(value[:-1] + t * slope[:-1] >= target_value)
    piece = crossing_pieces[0] if crossing_pieces.size else -1
    return (target_value - value[piece]) / slope[piece] if slope[piece] > 0 else 0.0


def solve_by_gradients(
    compliance,
    problem: ContactProblem,
    tolerance: float = 1e-11,
    max_iterations: int = 1000,
    start: np.ndarray | None = None,
) -> tuple[np.ndarray, int]:
    """Solve the contact problem approximately by constrained conjugate gradients.

    Parameters
    ----------
    compliance : StripCompliance or PointCompliance
        Has `product`, `node_compliance` and `eigenvalue_bound`.
    problem : ContactProblem
        Gap [m], motions and loads of the n nodes.
    tolerance : float
        Largest slope of the energy over the largest displacement.
    max_iterations : int
        Number of steps after which the forces are returned as they are.
    start : (n,) ndarray, optional
        Forces [N] to start from, uniform ones by default.

    Returns
    -------
    force : (n,) ndarray
        Forces [N], >= 0 and with the prescribed resultants.
    n_iterations : int
    """
    program = _quadratic_program(compliance, problem)
    product, gap, rigid, target = program
    n_nodes = problem.gap.size
    eigenvalue_bound = compliance.eigenvalue_bound
    descent_step = 1 / max(eigenvalue_bound, compliance.node_compliance)
    guess = _guess_forces(program, start, n_nodes, eigenvalue_bound)
    force = project_forces(guess, rigid, target)

    direction = np.zeros(gap.size)
    last_square = 1.0
    is_conjugate = 0.0
    best_force = force
    min_energy = np.inf
    for iteration in range(1, max_iterations + 1):
        # The energy f . C f/2 + g . f must fall; conjugate steps after a change of the set do not guarantee it
        displacement = product(force)
        energy = force @ (gap + displacement / 2)
        noise = ENERGY_ROUND_OFF * (np.abs(force * gap).sum() + force @ displacement)
        if energy > min_energy + noise:
            # A projected gradient step of this length always lowers the energy.
            gradient_force = best_force - descent_step * (gap + product(best_force))
            force = project_forces(gradient_force, rigid, target)
            is_conjugate = 0.0
            min_energy = np.inf
            continue
        best_force = force
        min_energy = energy

        # Optimality: the slope of the energy vanishes in contact and is >= 0 elsewhere
        in_contact = force > 0
        slope = _energy_slope(program, in_contact, displacement)
        square = slope[in_contact] @ slope[in_contact]
        residual = max(np.abs(slope[in_contact]).max(initial=0.0), -slope.min())
        noise = OPENING_ROUND_OFF * np.abs(gap[in_contact]).max(initial=0.0)
        if residual <= tolerance * np.abs(displacement).max() + noise:
            return force[:n_nodes], iteration

        # Conjugate direction (Fletcher and Reeves) with an exact step, cut at forces of zero
        previous = is_conjugate * square / last_square * direction
        direction = np.where(in_contact, slope + previous, 0.0)
        curvature = direction @ product(direction)
        step = (slope @ direction) / curvature if curvature > 0 else descent_step
        new_force = np.maximum(force - step * direction, 0.0)

        # Open nodes that overlap enter the contact with a gradient step.
        is_entering = (new_force == 0) & (slope < 0)
        is_conjugate = 0.0 if is_entering.any() else 1.0
        last_square = max(square, 1e-300)
        new_force[is_entering] -= step * slope[is_entering]
        force = _restore_resultants(new_force, rigid, target)
    return force[:n_nodes], max_iterations


def _guess_forces(program: _QuadraticProgram, start, n_nodes: int, eigenvalue_bound: float):
    """Return nodal forces [N] as an initial guess.

    They need not balance the prescribed load and moment.

    Parameters
    ----------
    program : _QuadraticProgram
        Contact problem.
    start : (n_nodes,) array or None
        Forces of the nodes [N] from which the solution starts. The springs of the holder then begin without force.
    n_nodes : int
        Number of nodes. The other forces are those of the springs of the holder.
    eigenvalue_bound : float
        Upper bound of the eigenvalues of the compliance [m/N].
    """
    n_forces = program.gap.size
    if start is not None:
        return np.append(start, np.zeros(n_forces - n_nodes))
    if program.target.size:
        return np.full(n_forces, program.target[0] / n_forces)
    return np.maximum(-program.gap, 0.0) / eigenvalue_bound


def _energy_slope(program: _QuadraticProgram, in_contact, displacement) -> np.ndarray:
    """Return the gradient (n,) [m] of the energy, from which the least-squares rigid motion is subtracted.

    `displacement` (n,) [m] is C f under the present forces. The rigid motion is fitted to the gradient at the nodes
    `in_contact` (n,), where the gradient of the solution of `program` vanishes.
    """
    slope = program.gap + displacement
    motion = fit_motion(program.rigid[in_contact], slope[in_contact])
    return slope - program.rigid @ motion


def _restore_resultants(force: np.ndarray, rigid: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Correct nonnegative nodal forces so that their resultants are the prescribed load and moments.

    Nodes without force stay unloaded, unless the loaded nodes alone cannot carry the resultants.

    Parameters
    ----------
    force : (n,) array
        Nodal forces [N].
    rigid : (n, r) array
        Displacements of the nodes per unit of each rigid motion.
    target : (r,) array
        Prescribed resultants: load and moments.
    """
    is_loaded = force > 0
    restored = np.zeros(force.size)
    if np.count_nonzero(is_loaded) >= target.size:
        restored[is_loaded] = project_forces(force[is_loaded], rigid[is_loaded], target)
    if target.size and not np.abs(target - rigid.T @ restored).max() <= RESULTANT_TOL * target[0]:
        restored = project_forces(force, rigid, target)
    return restored


def fit_motion(rigid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Fit a rigid motion (r,) to nodal values (k,) by least squares.

    `rigid` (k, r) holds the displacements of the nodes per unit of each motion.
    """
    if not rigid.shape[1]:
        return np.zeros(0)
    return np.linalg.lstsq(rigid, values, rcond=1e-13)[0]
