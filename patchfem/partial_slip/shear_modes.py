"""Partial slip of a patch under a rigid relative displacement q of the holders, in two reduced forms.

Node i has the relative displacement q - sum_j C_ij f_j, with C the shear compliance of the pieces and f_j the friction
force of node j. Both forms hold while the contact set does not change:

* Nodes that yield at a fixed force D_i (Coulomb's law, or the elastic-plastic law at constant load and tilt) are
  together exactly equivalent to parallel Jenkins elements (`make_jenkins_set`), springs in series with sliders. The inverse
  of C has off-diagonal entries <= 0 and row sums > 0, so slip zones only grow within a stroke, and Masing's rule holds.
  Corner nodes of bilinear cells may have a small negative row sum; such a node sticks until its neighbours have slipped.
  This costs 1e-9 of the friction limit at 201 nodes and 4e-8 at 401; leaving these nodes out would cost 1.4 %.

* Nodes with a memory law share the modes of D^1/2 C D^1/2, D = mu sigma_n weight (`shear_modes`). A few of the most
  compliant modes determine the resultant.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..contact import cells
from ..contact.unilateral import INDEFINITE_COMPLIANCE_MESSAGE
from ..core import PatchfemError, frozen_array
from ..elasticity.lapack import dpotrf, dpotrs, dtrsm, dtrtri, use_one_blas_thread

# Largest relative difference of yield displacements of nodes that yield together, such as mirrored
# nodes; the rounding errors of a patch with 801 nodes are 7e-13
EQUAL_YIELD_TOL = 1e-11
# Largest number of sorts of the nodes before they are eliminated one by one
MAX_SORTING_PASSES = 2
# Smallest compliance of modes left out, relative to that of the most compliant one. Pieces that are rigid in series with one
# spring have a single mode, which then gives a part of its compliance to the nodes.
MIN_REST = 1e-9
# Number of modes with which a reduction starts; without an asperity layer its error is 1e-6 of the
# friction limit
N_SHEAR_MODES = 4


@dataclass(frozen=True, eq=False)
class JenkinsSet:
    """Parallel Jenkins elements that are equivalent to coupled nodes which yield at given forces.

    - stiffness, yield_displacement (t,): [N/m] and [m]; the sum of their products is the friction limit
    - points (a,): nodes of the contact set
    - limit (a,): yield forces [N] of these nodes
    - order (a,): indices into `points` in reverse order of yielding
    - cholesky_factor (a, a): lower Cholesky factor of the compliance in that order; empty for rigid pieces in series
      with one spring
    - starts (t,): position of the first node of each element, in the order of yielding
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    points: np.ndarray
    limit: np.ndarray
    order: np.ndarray
    cholesky_factor: np.ndarray
    starts: np.ndarray

    @cached_property
    def point_yields(self) -> np.ndarray:
        """Relative displacement (a,) [m] of the holders at which each node yields."""
        if not self.order.size:
            return np.full(self.limit.size, self.yield_displacement[0])
        out = np.empty(self.limit.size)
        counts = np.diff(np.append(self.starts, self.order.size))
        out[self.order[::-1]] = np.repeat(self.yield_displacement, counts)
        return frozen_array(out)

    @cached_property
    def force_matrix(self) -> np.ndarray:
        """Matrix (a, t) [N/m] that maps the stretches of the elements to the forces of the nodes.

        It holds for any history.
        """
        if not self.cholesky_factor.size:
            return self.limit[:, None] / self.yield_displacement
        inverse, _ = dtrtri(self.cholesky_factor, lower=1)
        out = np.empty((self.limit.size, self.starts.size))
        out[self.order] = np.add.reduceat(
            (inverse.sum(axis=1)[:, None] * inverse)[::-1], self.starts
        ).T
        return frozen_array(out)


@dataclass(frozen=True, eq=False)
class ShearModes:
    """Modes of D^1/2 C D^1/2, the most compliant first, for nodes with the friction limits D.

    - points (a,): nodes of the contact set
    - limit (a,): friction limits D [N]
    - shape (a, r): relative displacement of a node per unit of a modal coordinate [N^-1/2]; shape^T diag(D) shape = 1
    - stiffness (r,): stiffness [1/m] of the coordinates, the inverse of the eigenvalues
    """

    points: np.ndarray
    limit: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray

    def select(self, count: int) -> "ShearModes":
        """Return the first `count` modes."""
        return replace(
            self,
            shape=frozen_array(self.shape[:, :count]),
            stiffness=frozen_array(self.stiffness[:count]),
        )


def make_jenkins_set(
    tangential: np.ndarray, yield_force: np.ndarray, local_length: float = 0.0
) -> JenkinsSet:
    """Return Jenkins elements that are equivalent to elastically coupled nodes with given yield forces.

    Parameters
    ----------
    tangential : (m, m) ndarray
        Compliance [m/N].
    yield_force : (m,) ndarray
        Yield forces [N] of the nodes.
    local_length : float
        Length [m] of the elastic-plastic law (eq. 3.12), a spring yield_force/local_length in series at each node; 0 for
        Coulomb's law.

    Returns
    -------
    JenkinsSet

    Raises
    ------
    PatchfemError
        If no node carries load.
    """
    yield_force = np.asarray(yield_force, float)
    if not (yield_force > 0).any():
        raise PatchfemError(
            "contact.shear: the friction limit is 0 at every point of the contact; "
            "raise friction.static or the load, or leave out [contact.shear]"
        )
    points = np.flatnonzero(yield_force > 0)
    force = yield_force[points]
    if local_length == 0 and np.ptp(tangential) == 0:
        return _make_single_element(1 / tangential[0, 0], points, force)

    # One thread is used because, on a loaded machine, waiting for a second one turns 5 ms into 270
    # ms.
    with use_one_blas_thread():
        c = tangential[np.ix_(points, points)]
        if local_length:
            c = c + np.diag(local_length / force)
        sequence, yield_displacements = _find_order(c, force)

    # Nodes that yield together form one element, whose stiffness is the force rate that all nodes lose by its yield
    starts = np.flatnonzero(
        np.diff(yield_displacements, prepend=-np.inf) > EQUAL_YIELD_TOL * yield_displacements
    )
    return JenkinsSet(
        frozen_array(np.add.reduceat(sequence.inverse_ones[::-1] ** 2, starts)),
        frozen_array(yield_displacements[starts]),
        frozen_array(points, np.int64),
        frozen_array(force),
        sequence.order,
        sequence.cholesky_factor,
        starts,
    )


def _make_single_element(stiffness: float, points, force) -> JenkinsSet:
    """Return one element in series with one spring [N/m], for rigid pieces that slip as a whole.

    `points` (a,) are the nodes of the contact set, and `force` (a,) [N] their yield forces.
    """
    no_nodes = np.zeros(0, np.int64)
    return JenkinsSet(
        frozen_array([stiffness]),
        frozen_array([force.sum() / stiffness]),
        frozen_array(points, np.int64),
        frozen_array(force),
        no_nodes,
        np.zeros((0, 0)),
        no_nodes,
    )


class _YieldSequence(NamedTuple):
    """Yield displacements of n nodes that yield in a given order.

    - order (n,): indices of the nodes in reverse order of yielding
    - cholesky_factor (n, n): lower Cholesky factor L of the compliance in that order
    - inverse_ones, factored_force (n,): L^-1 1 and L^T f, with the yield forces f (n,) [N] in that order
    - displacements (n,): yield displacements [m], factored_force/inverse_ones
    """

    order: np.ndarray
    cholesky_factor: np.ndarray
    inverse_ones: np.ndarray
    factored_force: np.ndarray
    displacements: np.ndarray

    @property
    def is_sorted(self) -> bool:
        """Whether the yield displacements increase from the last node to the first, so that the order is right."""
        return bool(
            (self.displacements[1:] <= self.displacements[:-1] * (1 + EQUAL_YIELD_TOL)).all()
        )


class _YieldOrder(NamedTuple):
    """Order in which nodes yield.

    - sequence: yields in this order
    - displacements (n,): increasing yield displacements [m]
    """

    sequence: _YieldSequence
    displacements: np.ndarray


def _find_order(compliance: np.ndarray, force: np.ndarray) -> _YieldOrder:
    """Find the order in which nodes with a `compliance` C (n, n) [m/N] yield at given forces `force` (n,) [N].

    While the first m nodes of an order stick, the rates of their forces solve the leading block of C = L L'. The force
    rates that all nodes lose by the yield of the m-th node are thus the m-th row of L^-1 times (L^-1 1)_m, and the yield
    displacements are (L' force)/(L^-1 1). An order is right if these increase, because the force rate of a node only
    grows until it yields. The first order is that of the force rates without yields, the next orders are those of the
    displacements. If none of them is right, the nodes are eliminated one by one.
    """
    rate = dpotrs(_factorise(compliance), np.ones(force.size), lower=1)[0]
    order = np.arange(force.size)
    displacements = _divide_or_inf(force, rate)
    for _ in range(MAX_SORTING_PASSES + 1):
        order = order[np.argsort(-displacements, kind="stable")]
        sequence = _yield_sequence(compliance, force, order)
        displacements = sequence.displacements
        if sequence.is_sorted:
            break
    else:
        sequence = _yield_sequence(compliance, force, _find_order_by_elimination(compliance, force))
    increasing = np.maximum.accumulate(sequence.displacements[::-1])
    return _YieldOrder(sequence, increasing)


def _divide_or_inf(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Return numerator / denominator (n,), or inf where the denominator is not positive."""
    infinite = np.full(numerator.size, np.inf)
    return np.divide(numerator, denominator, out=infinite, where=denominator > 0)


def _yield_sequence(compliance: np.ndarray, force: np.ndarray, order: np.ndarray) -> _YieldSequence:
    """Return the yield displacements of nodes for an assumed order of yielding.

    Parameters
    ----------
    compliance : (n, n) array
        Compliance [m/N].
    force : (n,) array
        Yield forces of the nodes [N].
    order : (n,) array of int
        Nodes in the assumed order of yielding.
    """
    cholesky_factor = _factorise(compliance[np.ix_(order, order)])
    inverse_ones = dtrsm(1.0, cholesky_factor, np.ones((force.size, 1)), lower=1)[:, 0]
    factored_force = force[order] @ cholesky_factor
    return _YieldSequence(
        order,
        cholesky_factor,
        inverse_ones,
        factored_force,
        _divide_or_inf(factored_force, inverse_ones),
    )


def _factorise(compliance: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor of a compliance (n, n).

    PatchfemError is raised if it is not positive definite.
    """
    factor, fault = dpotrf(compliance.T, lower=1)
    if fault:
        raise PatchfemError(INDEFINITE_COMPLIANCE_MESSAGE)
    return factor


def _find_order_by_elimination(compliance: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the indices (a,) of nodes in reverse order of yielding.

    The stiffness C^-1 of the sticking nodes gives the rates of their forces per displacement. The node that reaches its
    yield force first is eliminated from it (Schur complement), as often as there are nodes: a^3 products in all.

    `compliance` (a, a) [m/N] is the shear compliance C of the nodes, and `force` (a,) [N] their yield forces.
    """
    inverse = np.linalg.inv(compliance)
    remaining = force.copy()
    yielded = []
    rate = inverse.sum(axis=0)
    for _ in range(force.size):
        change_to_yield = _divide_or_inf(remaining, rate)
        change_to_yield[yielded] = np.inf
        point = int(change_to_yield.argmin())
        yielded.append(point)
        remaining -= rate * max(change_to_yield[point], 0.0)
        column = inverse[point].copy()
        pivot = inverse[point, point]
        rate = rate - column / pivot * rate[point]
        inverse -= np.outer(column, column / pivot)
    return np.array(yielded[::-1])


def shear_modes(
    compliance: "np.ndarray | cells.CellCompliance",
    friction_limit: np.ndarray,
    count: int,
    steepest_fall: float = 0.0,
) -> ShearModes:
    """Return the `count` most compliant modes of D^1/2 C D^1/2 for nodes or cells with bonds.

    A contact is stable if the stiffness of the pieces and the holder in shear exceeds the steepest fall of the friction
    forces.

    Parameters
    ----------
    compliance : (m, m) ndarray or CellCompliance
        Compliance C [m/N] of m nodes, or of the cells of a face.
    friction_limit : (m,) ndarray
        Friction limits D [N], 0 outside the contact.
    count : int
        Number of modes; fewer are found if fewer nodes are in contact or the pieces are rigid.
    steepest_fall : float
        Steepest fall of the friction force of a node over its slip, relative to its friction limit [1/m].

    Raises
    ------
    PatchfemError
        If a weakening contact could jump without a change of the displacement: steepest_fall lambda_max(D C) >= 1.
    """
    points = frozen_array(np.flatnonzero(friction_limit > 0), np.int64)
    friction_limit = friction_limit[points]
    root = np.sqrt(friction_limit)
    solve = _solve_matrix if isinstance(compliance, np.ndarray) else _solve_operator
    values, vectors = solve(compliance, points, root, count)
    shape = vectors[:, ::-1] / root[:, None]
    modes = ShearModes(points, friction_limit, shape, 1 / values[::-1]).select(count)

    stability = steepest_fall / modes.stiffness[0]
    if stability >= 1:
        raise PatchfemError(
            "friction.kinetic below static: the patch may slip suddenly without a change of the force on it, because the "
            f"friction force falls over the slip {stability:.3g} times as steeply as the pieces and the holder relax (the "
            "limit is 1); raise friction.bond_length or friction.kinetic, or make the holder stiffer"
        )
    return modes


def _solve_matrix(compliance: np.ndarray, points, root, _) -> tuple[np.ndarray, np.ndarray]:
    """Return all eigenvalues (r,), increasing, and eigenvectors (a, r) of D^1/2 C D^1/2 at points (a,); root is D^1/2."""
    # Rigid pieces in series with one spring have only one mode: D^1/2 C D^1/2 has the eigenvector D^1/2.
    if np.ptp(compliance) == 0:
        total = root @ root
        return compliance[:1, 0] * total, root[:, None] / np.sqrt(total)
    with use_one_blas_thread():
        return np.linalg.eigh(root[:, None] * compliance[np.ix_(points, points)] * root)


def _solve_operator(compliance, points, root, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `count` largest eigenvalues, increasing, and eigenvectors as `_solve_matrix` does, for a CellCompliance."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    count = 1 if compliance.is_rigid else count
    force = np.zeros(compliance.waves.size)

    def apply(vector: np.ndarray) -> np.ndarray:
        """Return D^1/2 C D^1/2 times a vector of the cells in contact."""
        force[points] = root * vector.ravel()
        return root * (compliance @ force)[points]

    # The method of Lanczos needs more cells than modes; a few cells give the whole matrix
    if points.size <= 2 * count + 1:
        matrix = np.array([apply(column) for column in np.eye(points.size)])
        values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
        return values[-count:], vectors[:, -count:]
    operator = LinearOperator((points.size, points.size), apply, dtype=float)
    values, vectors = eigsh(operator, count, which="LA", v0=root)
    order = np.argsort(values)
    return values[order], vectors[:, order]


class SharedModes(NamedTuple):
    """Shear modes, and the compliance (a,) [m/N] that each node has in series with them."""

    modes: ShearModes
    own: np.ndarray


def share_rest(modes: ShearModes, diagonal: np.ndarray) -> SharedModes:
    """Return shear modes and own compliances of the nodes that together stand for all modes of the pieces.

    The modes s_k obey sum s_k s_k^T = D^-1 with the friction limits D. The eigenvalues of the modes left out are replaced
    by their mean r, so that each node has the compliance r/D of its own, and those of the modes that are kept are less
    by r. With all modes but one this is exact. A node with rigid friction needs an own compliance in a march in time.

    Parameters
    ----------
    modes : ShearModes
        Most compliant modes of a nodes.
    diagonal : (a,) array
        Displacement of each node per force on it [m/N], by all modes.
    """
    modes = modes.select(max(min(modes.stiffness.size, modes.limit.size - 1), 1))
    values = 1 / modes.stiffness
    n_left = max(modes.limit.size - values.size, 1)
    rest = (float(modes.limit @ diagonal) - values.sum()) / n_left
    rest = max(rest, MIN_REST * values[0])

    # Modes as stiff as the mean are a part of it.
    is_softer = values - rest > MIN_REST * values[0]
    modes = modes.select(max(int(is_softer.sum()), 1))
    values = values[: modes.stiffness.size]
    return SharedModes(replace(modes, stiffness=1 / (values - rest)), rest / modes.limit)


def estimate_force_errors(modes: ShearModes, bond_length: float) -> np.ndarray:
    """Estimate the error of the friction force on first loading if only the first modes are kept.

    A node with the local displacement xi carries D (1 - e) with e = exp(-xi/length). A mode of compliance c and shape
    phi that is left out moves it by phi c (phi . D (1 - e)), which changes the sum of all forces by
    c (phi . D e)(phi . D (1 - e))/length at first order. Two states are examined: e = 1/2 everywhere, where the law alone
    determines the forces, and the forces of linear springs D/length in series with the pieces, where the edges slip first.

    Parameters
    ----------
    modes : ShearModes
        All n modes.
    bond_length : float
        Bond length [m].

    Returns
    -------
    (n + 1,) ndarray
        Error over the friction limit [1] if the first 0, 1, ..., n modes are kept.
    """
    compliance = 1 / modes.stiffness
    total = modes.limit.sum()
    # Forces of the springs over the friction limits, for a mean of one half
    springs = modes.shape @ ((modes.shape.T @ modes.limit) / (compliance + bond_length))
    springs = np.clip(springs * (total / 2 / (modes.limit @ springs)), 0.0, 1.0)

    errors = np.zeros(compliance.size + 1)
    for force_fraction in (np.full(modes.limit.size, 0.5), springs):
        carried = modes.shape.T @ (modes.limit * force_fraction)
        remaining = modes.shape.T @ (modes.limit * (1 - force_fraction))
        terms = compliance * np.abs(carried * remaining) / (bond_length * total)
        errors[:-1] = np.maximum(errors[:-1], np.cumsum(terms[::-1])[::-1])
    return errors


def find_sufficient_modes(
    compliance: "np.ndarray | cells.CellCompliance",
    friction_limit: np.ndarray,
    bond_length: float,
    count: int,
    tolerance: float,
    steepest_fall: float = 0.0,
    max_modes: int = 64,
) -> ShearModes:
    """Return as many of the most compliant modes as the friction force needs to meet a tolerance.

    The number of modes is doubled until it suffices. The pieces alone need four modes, a soft layer of asperities many.
    A run does not rely on this choice: a comparison run with another number of modes gives the part "modes" of the error
    of each measure (`comparison_mode_count`).

    Parameters
    ----------
    compliance : (m, m) ndarray or CellCompliance
        Compliance C [m/N].
    friction_limit : (m,) ndarray
        Friction limits D [N]; the bonds of a node have the stiffness friction_limit/bond_length.
    bond_length : float
        Bond length [m].
    steepest_fall : float
        Steepest fall of the friction force of a node over its slip, relative to its friction limit [1/m].
    count, max_modes : int
        First and largest number of modes.
    tolerance : float
        Largest error of the friction force on first loading / friction limit.

    Returns
    -------
    ShearModes
    """
    # All modes of a matrix are computed at once, and twice as many of cells as are kept; the others show the error
    n_computed = friction_limit.size if isinstance(compliance, np.ndarray) else 2 * count
    while True:
        modes = shear_modes(compliance, friction_limit, n_computed, steepest_fall)
        errors = estimate_force_errors(modes, bond_length)
        while count < min(max_modes, modes.stiffness.size) and errors[count] > tolerance:
            count = min(2 * count, max_modes)
        if 2 * count <= n_computed:
            return modes.select(count)
        n_computed = 2 * count


def comparison_mode_count(count: int) -> int:
    """Return the number of modes for a second run, which is compared to estimate the error of `count` modes.

    It is half as many. Of two or three modes of a symmetric patch only the first acts, so it is then four times as many.
    """
    return count // 2 if count >= N_SHEAR_MODES else 4 * count
