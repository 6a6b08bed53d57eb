"""Contact of a patch through an asperity layer of a smooth law under a rigid holder.

With the pressure law P of this layer, the nodal areas A and the notation of `unilateral` the equations are

    f = A P(s),    s = g - R q + C f,    R^T f + S q = t.

Newton's method solves for the separations s and the motion q together, in the symmetric form I + D^1/2 C D^1/2 with
D = -A P'. A node that gains force moves along log P, one that loses force along s, and a node of negligible force may
rise to 1 % of the mean pressure at once: each step uses the side of the tangent that cannot overshoot.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import NotConverged, PatchfemError
from .asperity_laws import SmoothAsperities
from .bounded import BoundedProblem
from .unilateral import compute_balances, describe_residuals, solve

# Largest relative residual of a solution; rounding errors of steep laws stay below it
SMOOTH_LAW_RESIDUAL_TOL = 1e-9
# Largest logarithm of a pressure [Pa] at which the asperity layer counts as untouched
MAX_UNTOUCHED_LOG_PRESSURE = -300.0
# Largest logarithm of a force [N] for which products with the exponential function do not overflow
MAX_LOG_FORCE = 600.0


class AsperityProblem(NamedTuple):
    """Contact of a patch through a compliant asperity layer whose pressure law is smooth.

    - asperities: Pressure law of the layer.
    - compliance (n, n): Compliance [m/N] of the pieces; that of rigid pieces is 0.
    - area (n,): Nodal areas [m2].
    - contact: Gap, motions and loads.
    """

    asperities: SmoothAsperities
    compliance: np.ndarray
    area: np.ndarray
    contact: BoundedProblem

    @property
    def mean_pressure(self) -> float:
        """Load divided by area [Pa]."""
        return self.contact.target[0] / self.area.sum()

    def separation(self, force: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Return the separations (n,) [m] of the mean planes for given forces [N] and a given motion."""
        return self.contact.gap - motion @ self.contact.motions + self.compliance @ force

    def imbalance(self, force: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Return load [N] and moment [N m] (r,) that forces (n,) [N] and spring do not balance at a given motion (r,)."""
        contact = self.contact
        return contact.target - contact.motions @ force - contact.springs * motion


class AsperitySolution(NamedTuple):
    """Solution of a contact through asperities.

    - force (n,): Nodal forces [N].
    - separation (n,): Separations [m] of the mean planes.
    - motion (r,): Approach [m] and rotation [rad] of the holder.
    """

    force: np.ndarray
    separation: np.ndarray
    motion: np.ndarray


class _NewtonStep(NamedTuple):
    """Changes of forces (n,) [N], motion (r,) and separations (n,) [m] in a Newton step."""

    force: np.ndarray
    motion: np.ndarray
    separation: np.ndarray


def _newton_step(problem: AsperityProblem, slope, mismatch, imbalance) -> _NewtonStep:
    """Return the Newton step of the contact equations: forces, motion and separations.

    Parameters
    ----------
    problem : AsperityProblem
        Compliance, contact and asperity layer.
    slope : (n,) array
        Stiffness D of the asperity layer [N/m].
    mismatch : (n,) array
        Separation of the geometry less that of the law [m].
    imbalance : (r,) array
        Missing load [N] and moment [N m].
    """
    contact = problem.contact
    columns = np.column_stack([*contact.motions, mismatch])
    forces = np.zeros(columns.shape)

    # Forces D^1/2 (I + D^1/2 C D^1/2)^-1 D^1/2 of the nodes that the layer loads, for each column; this matrix is well
    # conditioned at every slope D
    # Smallest slope, relative to the largest slope, for which a Newton step changes the force
    nodes = np.flatnonzero(slope > 1e-18 * slope.max())
    if nodes.size:
        root = np.sqrt(slope[nodes])[:, None]
        matrix = root * problem.compliance[nodes[:, None], nodes] * root.T
        matrix[np.diag_indices_from(matrix)] += 1.0
        factor = cho_factor(matrix, lower=True, overwrite_a=True)
        forces[nodes] = root * cho_solve(factor, root * columns[nodes])

    # The motion balances load and moment
    by_motions = forces[:, :-1]
    by_mismatch = forces[:, -1]
    motion = imbalance + contact.motions @ by_mismatch
    if motion.size:
        tangent = contact.motions @ by_motions + np.diag(contact.springs)
        motion = np.linalg.lstsq(tangent, motion, rcond=1e-14)[0]
    force = by_motions @ motion - by_mismatch
    displacement = problem.compliance @ force
    return _NewtonStep(force, motion, mismatch - motion @ contact.motions + displacement)


def _solve_newton(problem: AsperityProblem, separation, motion) -> AsperitySolution:
    """Solve a scaled problem by Newton's method from separations (n,) [m] and a motion (r,).

    `_newton_step` returns the changes of forces [N], motion and separations [m] that remove the errors of both
    equations to first order.

    Raises
    ------
    NotConverged
        After 60 steps, or if a step cannot be computed.
    """
    contact = problem.contact
    asperities = problem.asperities
    for _ in range(60):  # thin layers on rough gaps need up to 40 Newton steps
        # Forces of the law at the separations, and what they leave of the two equations
        log_pressure, decay = asperities.log_pressure(separation)
        log_force = log_pressure + np.log(problem.area)
        force = np.exp(np.minimum(log_force, MAX_LOG_FORCE))
        imbalance = problem.imbalance(force, motion)
        mismatch = problem.separation(force, motion) - separation
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                force_change, motion_change, change = _newton_step(
                    problem, force * decay, mismatch, imbalance
                )
            except (np.linalg.LinAlgError, ValueError):
                break
        motion = motion + motion_change

        # Relative changes of the pressures. That of a nearly unloaded node counts in proportion to its force.
        log_change = -change * decay
        new_log_force = np.maximum(log_force, log_force + log_change)
        fraction = np.exp(np.minimum(0.0, new_log_force - log_force.max()))

        # The iteration has converged if the changes are below the tolerance or below rounding errors
        depth = np.ptp(contact.gap) + np.abs(problem.compliance @ force).max()
        depth += 2 * np.abs(motion[1:]).sum()
        # Round-off of a separation changes the pressure of the loaded nodes by this fraction.
        # Relative imbalance and relative change of pressure at which Newton's method has converged
        noise = 1e-12 + 1e-15 * depth * decay[force > 1e-6 * force.max()].max()
        relative_imbalance = np.abs(imbalance).max() / contact.target[0] if imbalance.size else 0.0
        if max(relative_imbalance, np.max(fraction * np.abs(log_change))) <= noise:
            # The force of a nearly unloaded node is computed from the pressure law of the asperity layer, because the Newton
            # step gives that force only to rounding errors of the largest force.
            law_force = np.exp(np.minimum(log_force + log_change, MAX_LOG_FORCE))
            new_force = np.maximum(force + force_change, 0.0)
            new_force = np.where(fraction < 1e-15, law_force, new_force)
            return AsperitySolution(new_force, separation + change, motion)

        # Where the pressure rises, the law is steep, and the step is limited to one that is linear in the pressure; an
        # unloaded node may rise to a small pressure at once
        along_log = -np.log1p(np.maximum(log_change, 0.0)) / decay
        limited_change = np.where(log_change > 0, along_log, change)
        load = contact.target[0] if imbalance.size else force.sum()
        # Largest pressure that an unloaded node may reach in one step, relative to the mean pressure
        risen = asperities.separation(np.array(0.01 * load / problem.area.sum()))
        separation = separation + np.maximum(change, np.minimum(limited_change, risen - separation))
    raise NotConverged(
        "contact.asperities: the iteration of the rough layer did not converge; raise the decay length or the height "
        'deviation, or set law = "linear"'
    )


def _solve_at_approach(problem: AsperityProblem) -> AsperitySolution:
    """Solve a patch under a prescribed approach, which the gap of the problem already contains.

    No node carries force if nothing touches. The law of the layer gives ln p [p in Pa] and its decay rate [1/m] by
    `log_pressure`, and the separation [m] at a pressure by `separation`.
    """
    asperities = problem.asperities
    gap = problem.contact.gap
    no_motion = np.zeros(0)
    if asperities.log_pressure(gap)[0].max() <= MAX_UNTOUCHED_LOG_PRESSURE:
        return AsperitySolution(np.zeros(gap.size), gap, no_motion)

    # No node can carry more force than the one that flattens its overlap
    separation = gap
    diagonal = problem.compliance.diagonal()
    if (diagonal > 0).all():
        overlap = np.maximum(-gap, np.abs(gap).max() * 1e-3)
        max_pressure = overlap / (diagonal * problem.area)
        separation = np.maximum(gap, asperities.separation(max_pressure))
    if asperities.log_pressure(separation)[0].max() > -MAX_UNTOUCHED_LOG_PRESSURE:
        raise PatchfemError(
            "contact.approach: the pressure of the rough layer is too large to compute; give a smaller "
            "distance"
        )
    return _solve_newton(problem, separation, no_motion)


def _linearised_start(problem: AsperityProblem) -> tuple[np.ndarray, np.ndarray]:
    """Return initial separations (n,) [m] and an initial motion (r,) of a problem for Newton's method.

    They solve the contact with a law that is linearized at the mean pressure, so that the layer is a row of equal
    springs between bare pieces. Nodes above the mean pressure get the separation of the law itself.
    """
    contact = problem.contact
    mean_pressure = problem.mean_pressure
    mean_separation = problem.asperities.separation(np.array([mean_pressure]))
    stiffness = mean_pressure * problem.asperities.log_pressure(mean_separation)[1][0]
    # The tangent of the pressure law is zero at this separation.
    first_touch = mean_separation[0] + mean_pressure / stiffness
    compliance = problem.compliance + np.diag(1 / (stiffness * problem.area))
    try:
        linear = solve(compliance, contact._replace(gap=contact.gap - first_touch))
    except NotConverged:
        # The start has uniform separations where the linear problem has no solution.
        approach = contact.gap.mean() - mean_separation[0]
        uniform = np.full(contact.gap.size, mean_separation[0])
        return uniform, approach * np.eye(1, contact.target.size)[0]
    pressure = linear.force / problem.area
    outside = problem.separation(linear.force, linear.motion)
    on_tangent = np.where(linear.force > 0, first_touch - pressure / stiffness, outside)
    on_law = problem.asperities.separation(np.maximum(pressure, mean_pressure))
    return np.where(pressure > mean_pressure, on_law, on_tangent), linear.motion


def compute_law_residuals(layer: AsperityProblem, solution: AsperitySolution) -> dict[str, float]:
    """Compute the relative residuals of the contact conditions for a patch with a smooth asperity layer.

    The mismatch of the law is relative to the largest force and to 1e-5 of what the law gains over the depth of the gap;
    pressures that count as none are left out. The check takes the separations of the geometry, a solution those of the
    law.

    Parameters
    ----------
    layer : AsperityProblem
        Problem as it was given.
    solution : AsperitySolution
        Forces and motion that are checked.

    Returns
    -------
    dict of float
        tension, law, and the balances of `unilateral.compute_balances`.
    """
    asperities, _, area, problem = layer
    force = solution.force
    opening = layer.separation(force, solution.motion)
    # Smallest depth [m] in a divisor; it keeps the residual of a flat gap finite
    depth = np.ptp(problem.gap) + np.abs(opening - problem.gap).max() + 1e-150
    largest = max(force.max(), np.exp(MAX_UNTOUCHED_LOG_PRESSURE))
    mismatch = np.abs(force - area * asperities.pressure(opening))
    mismatch -= area * np.exp(MAX_UNTOUCHED_LOG_PRESSURE)
    gain = 1e-5 * depth * (area * asperities.stiffness(opening)).max()
    return {
        "tension": float(max(0.0, -force.min()) / largest),
        "law": float(max(0.0, mismatch.max()) / (largest + gain)),
        **compute_balances(problem, solution),
    }


def press_with_asperities(layer: AsperityProblem) -> AsperitySolution:
    """Solve the contact of a patch through an asperity layer of a smooth pressure law.

    Parameters
    ----------
    layer : AsperityProblem
        Law, pieces, gap and loads.

    Returns
    -------
    AsperitySolution

    Raises
    ------
    NotConverged
        If Newton's method fails, or if a residual exceeds `SMOOTH_LAW_RESIDUAL_TOL`.
    PatchfemError
        If the pressure under a prescribed approach is too large to compute.
    """
    problem = layer.contact
    if problem.target.size:
        # The largest closing of a node per unit of motion becomes 1, so that load and moment become comparable
        scale = 1 / np.abs(problem.motions).max(axis=1)
        scaled = problem._replace(
            motions=problem.motions * scale[:, None],
            target=problem.target * scale,
            springs=problem.springs * scale**2,
        )
        scaled_layer = layer._replace(contact=scaled)
        solution = _solve_newton(scaled_layer, *_linearised_start(scaled_layer))
        solution = solution._replace(motion=solution.motion * scale)
    else:
        solution = _solve_at_approach(layer)

    residuals = compute_law_residuals(layer, solution)
    if not all(value <= SMOOTH_LAW_RESIDUAL_TOL for value in residuals.values()):
        raise NotConverged(
            describe_residuals(
                residuals,
                SMOOTH_LAW_RESIDUAL_TOL,
                "contact.asperities",
                "; make the rough layer softer (raise the decay length or the height deviation), or leave the layer out",
            )
        )
    return solution
