"""Partial slip of a patch under a rigid displacement q of the holders, in two reduced forms.

Point i moves by the local slide q - sum_j C_ij f_j. Both forms hold for one contact set:

* Points that yield at a fixed force D_i (Coulomb's law, or the elastic-plastic law at constant load and tilt) are
  together exactly a set of parallel Jenkins elements (`jenkins_set`). The inverse of C has off-diagonals <= 0 and row
  sums > 0, so that slip zones only grow within a stroke (Masing). Corner nodes of bilinear cells can have a small
  negative row sum; such a node is reluctant: it sticks until its neighbours have slipped. That costs 1e-9 of the
  friction limit at 201 nodes and 4e-8 at 401, while leaving these nodes out would cost 1.4 %.

* Points with a memory law share the modes of D^1/2 C D^1/2, D = mu sigma_n weight (`shear_modes`). A few modes carry
  the resultant.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..contact.unilateral import INDEFINITE_MESSAGE
from ..core import PatchfemError, frozen_array
from ..elasticity.lapack import dpotrf, dpotrs, dtrsm, dtrtri, one_thread

# relative difference of yield displacements below which nodes yield together, as mirrored nodes do; the rounding
# errors of a patch with 801 nodes are 7e-13
SAME_YIELD_TOL = 1e-11
# number of sorts of the yields before neighbours are exchanged; sorting only moves points that are far off
MAX_SORTS = 2
# exchanges of neighbours per point, after which points are eliminated one by one; patches need at most 1
MAX_EXCHANGES = 20
# number of modes with which a reduction starts; without a layer of asperities its error is 1e-6 of the friction limit
N_SHEAR_MODES = 4
# smallest number of modes of the reference with which fewer modes are compared
N_REFERENCE_MODES = 16
# fraction of the tolerance by which few modes may differ from the reference; higher modes account for the rest
MODE_ERROR_FRACTION = 0.8
# number of points from which it is faster to compute the most compliant modes alone
MIN_LANCZOS_POINTS = 128
# matrix products of Lanczos' method, with two vectors each; it fails to converge only for a soft layer of asperities
MAX_PRODUCTS = 24
# residual of a mode / largest eigenvalue; the error of an eigenvalue is the square of this ratio
MODE_TOL = 1e-6
# numbers of Gauss points that may represent a patch
GAUSS_COUNTS = (16, 32, 64)
# bond lengths by which a Newton step may move a point back; the law there is exp(2) times as steep as at rest
MAX_BACKWARD_LENGTHS = 2.0
# number of relative displacements at which backbones are compared
N_DISPLACEMENTS = 24
# bond lengths in the largest of these displacements, at which the force is within exp(-6) of its limit
MAX_BACKBONE_LENGTHS = 6


@dataclass(frozen=True, eq=False)
class JenkinsSet:
    """Parallel Jenkins elements: springs in series with sliders.

    - stiffness, yield_displacement (t,): [N/m] and [m]; the sum of their products is the friction limit.
    - points (a,): Nodes of the contact set.
    - limit (a,): Yield forces of the points [N].
    - order (a,): Indices into `points`, the last point to yield first.
    - low (a, a): Lower Cholesky factor of the compliance in that order; empty for one spring in series with
      rigid points.
    - starts (t,): Index of the first yield of each element.
    - n_reluctant: Number of points whose force at first has the wrong sign.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    points: np.ndarray
    limit: np.ndarray
    order: np.ndarray
    low: np.ndarray
    starts: np.ndarray
    n_reluctant: int

    @cached_property
    def point_yields(self) -> np.ndarray:
        """Relative displacement (a,) [m] at which each point yields."""
        if not self.order.size:
            return np.full(self.limit.size, self.yield_displacement[0])
        out = np.empty(self.limit.size)
        counts = np.diff(np.append(self.starts, self.order.size))
        out[self.order[::-1]] = np.repeat(self.yield_displacement, counts)
        return frozen_array(out)

    @cached_property
    def force_matrix(self) -> np.ndarray:
        """Matrix (a, t) [N/m] that gives the point forces from the stretches of the elements.

        It holds for any history.
        """
        if not self.low.size:
            return self.limit[:, None] / self.yield_displacement
        inverse, _ = dtrtri(self.low, lower=1)
        out = np.empty((self.limit.size, self.starts.size))
        out[self.order] = np.add.reduceat(
            (inverse.sum(axis=1)[:, None] * inverse)[::-1], self.starts
        ).T
        return frozen_array(out)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Modes of D^1/2 C D^1/2, most compliant first, and backbones of any number of them.

    - points (a,): Indices of the contact set.
    - limit (a,): Friction limits D [N].
    - shape (a, n): Slide of a point per unit of a modal coordinate.
    - values (n,): Compliance of the coordinates [m/N].
    - length: Bond length [m].
    - tangential (m, m): Compliance C [m/N] if these are the first modes only; the others are computed on
      demand.
    """

    points: np.ndarray
    limit: np.ndarray
    shape: np.ndarray
    values: np.ndarray
    length: float
    tangential: np.ndarray | None = None

    @cached_property
    def complete(self) -> "Spectrum":
        """The Spectrum with all modes."""
        if self.tangential is None:
            return self
        return _all_modes(self.tangential, self.points, self.limit, self.length)

    @cached_property
    def displacements(self) -> np.ndarray:
        """Relative displacements [m] at which backbones are compared, denser at small values."""
        if self.tangential is None:
            displacement = self.shape @ (self.values * (self.shape.T @ self.limit))
        else:
            displacement = _block(self.tangential, self.points) @ self.limit
        largest = MAX_BACKBONE_LENGTHS * self.length + 2 * np.abs(displacement).max()
        return largest * (np.arange(1, N_DISPLACEMENTS + 1) / N_DISPLACEMENTS) ** 2

    def modes(self, count: int) -> "ShearModes":
        """Return the first `count` modes."""
        if count > self.values.size and self.tangential is not None:
            return self.complete.modes(count)
        return ShearModes(
            self.points,
            frozen_array(self.shape[:, :count]),
            frozen_array(1 / self.values[:count]),
            self,
        )

    @cached_property
    def cache(self) -> dict:
        """Computed backbones by number of modes."""
        return {}

    def backbone(self, count: int, shape=None, limit=None) -> np.ndarray:
        """Return the friction force [N] of `count` modes at `displacements`.

        Newton's method starts from the cached backbone of the most modes below `count`.

        Parameters
        ----------
        count : int
        shape : (k, count) ndarray, optional
            Shapes at other points than those of the modes.
        limit : (k,) ndarray, optional
            Friction limits of these points [N].
        """
        if count > self.values.size and self.tangential is not None:
            return self.complete.backbone(count, shape, limit)
        count = min(count, self.values.size)
        if shape is None and count in self.cache:
            return self.cache[count].force
        n_cached = max((number for number in self.cache if number <= count), default=0)
        start = np.zeros((self.displacements.size, count))
        if n_cached:
            start[:, :n_cached] = self.cache[n_cached].coordinates
        is_own = shape is None
        if is_own:
            shape, limit = self.shape[:, :count], self.limit
        with one_thread(), np.errstate(over="ignore", invalid="ignore"):
            backbone = _solve_backbone(
                limit, shape, self.values[:count], self.length, self.displacements, start
            )
        if is_own and np.isfinite(backbone.force).all():
            self.cache[count] = backbone
        return backbone.force

    def relative_difference(self, backbone, other) -> float:
        """Return the largest difference of two backbones over the friction limit.

        It is infinite if the bonds are too short for a backbone to be computed.
        """
        error = float(np.abs(backbone - other).max() / self.limit.sum())
        return error if np.isfinite(error) else np.inf


@dataclass(frozen=True, eq=False)
class ShearModes:
    """The most compliant shear modes of the pieces.

    - points (a,): Indices of the contact set.
    - shape (a, r): Slide of a point per unit of a modal coordinate.
    - stiffness (r,): Stiffness of the coordinates [N/m].
    - spectrum: All modes.
    """

    points: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray
    spectrum: Spectrum

    @cached_property
    def backbone_error(self) -> float:
        """Largest error of the force / friction limit, compared with 64 or four times as many modes."""
        count = self.stiffness.size
        return self.spectrum.relative_difference(
            self.spectrum.backbone(max(64, 4 * count)), self.spectrum.backbone(count)
        )


def jenkins_set(tangential: np.ndarray, limit: np.ndarray, local_length: float = 0.0) -> JenkinsSet:
    """Return parallel elements equivalent to points that yield in series with a compliance.

    Parameters
    ----------
    tangential : (m, m) ndarray
        Compliance [m/N].
    limit : (m,) ndarray
        Yield forces of the points [N].
    local_length : float
        Bond length [m] of the elastic-plastic law (3.12), a local stiffness limit/length in series; 0 for Coulomb's law.

    Returns
    -------
    JenkinsSet

    Raises
    ------
    PatchfemError
        If no point carries load.
    """
    limit = np.asarray(limit, float)
    if not (limit > 0).any():
        raise PatchfemError("contact.shear: the friction limit is 0 at every point of the contact")
    points = np.flatnonzero(limit > 0)
    force, none = limit[points], np.zeros(0, np.int64)
    # rigid points in series with one spring all slip together
    if local_length == 0 and np.ptp(tangential) == 0:
        stiffness = 1 / tangential[0, 0]
        return JenkinsSet(
            frozen_array([stiffness]),
            frozen_array([force.sum() / stiffness]),
            frozen_array(points, np.int64),
            frozen_array(force),
            none,
            np.zeros((0, 0)),
            none,
            0,
        )
    # one thread: under load from other processes, waiting for a second one turns 5 ms into 270 ms
    with one_thread():
        c = _block(tangential, points)
        if local_length:
            c = c + np.diag(local_length / force)
        sequence, yield_displacements, n_reluctant = _find_order(c, force)
    starts = np.flatnonzero(
        np.diff(yield_displacements, prepend=-np.inf) > SAME_YIELD_TOL * yield_displacements
    )
    return JenkinsSet(
        frozen_array(np.add.reduceat(sequence.root[::-1] ** 2, starts)),
        frozen_array(yield_displacements[starts]),
        frozen_array(points, np.int64),
        frozen_array(force),
        sequence.order,
        sequence.low,
        starts,
        n_reluctant,
    )


class _Sequence(NamedTuple):
    """Yields of n points in a given order, the last point to yield first.

    - order (n,): Indices of the points.
    - low (n, n): Lower Cholesky factor L of the compliance in that order.
    - root, pull (n,): L^-1 1 and L' force.
    - displacements (n,): Slides of the yields [m], pull/root.
    """

    order: np.ndarray
    low: np.ndarray
    root: np.ndarray
    pull: np.ndarray
    displacements: np.ndarray

    @property
    def is_sorted(self) -> bool:
        """Whether the yield displacements increase from the last point to the first.

        This is the condition that the order of the points is right.
        """
        return bool(
            (self.displacements[1:] <= self.displacements[:-1] * (1 + SAME_YIELD_TOL)).all()
        )


def _find_order(c: np.ndarray, force: np.ndarray) -> tuple:
    """Find the order in which the points yield.

    Returns the `_Sequence` of this order, its increasing yield displacements, and the number of points whose force at
    first has the wrong sign.

    While the first m points of an order stick, their rates solve the leading block of c = L L'. Thus the force that all
    points lose by the m-th yield is the m-th row of L^-1 times (L^-1 1)_m, and the displacements of the yields are
    (L' force)/(L^-1 1). An order is right if these increase, as a rate only grows until its point yields. The first
    order is that of the rates without yields, the next ones are those of the displacements. Remaining errors are mended by
    exchanging neighbours, and at last by eliminating the points one by one.
    """
    rate = dpotrs(_factorise(c), np.ones(force.size), lower=1)[0]
    order, displacements = np.arange(force.size), _divide_or_inf(force, rate)
    for _ in range(MAX_SORTS + 1):
        order = order[np.argsort(-displacements, kind="stable")]
        sequence = _yield_sequence(c, force, order)
        displacements = sequence.displacements
        if sequence.is_sorted:
            break
    else:
        exchanged = _exchange_neighbours(sequence)
        if exchanged is None:
            exchanged = _yield_sequence(c, force, _eliminate_points(c, force))
        sequence = exchanged
    increasing = np.maximum.accumulate(sequence.displacements[::-1])
    return sequence, increasing, int((rate <= 0).sum())


def _divide_or_inf(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Return the quotients; they are infinite where the denominator is not positive."""
    infinite = np.full(numerator.size, np.inf)
    return np.divide(numerator, denominator, out=infinite, where=denominator > 0)


def _yield_sequence(c: np.ndarray, force: np.ndarray, order: np.ndarray) -> _Sequence:
    """Return the yields of points with the compliance c (n, n) [m/N] in a given order."""
    low = _factorise(c[np.ix_(order, order)])
    root = dtrsm(1.0, low, np.ones((force.size, 1)), lower=1)[:, 0]
    pull = force[order] @ low
    return _Sequence(order, low, root, pull, _divide_or_inf(pull, root))


def _exchange_neighbours(sequence: _Sequence) -> _Sequence | None:
    """Exchange neighbours until the yield displacements are sorted; None if this takes too long.

    An exchange changes the yields of these two points alone: L with two rows exchanged becomes lower triangular again by
    a rotation of two of its columns, which rotates L^-1 1 and L' force with them.
    """
    low = sequence.low
    order, root, pull = (part.tolist() for part in (sequence.order, sequence.root, sequence.pull))
    displacements = sequence.displacements.tolist()
    pending, remaining = list(range(len(order) - 1))[::-1], MAX_EXCHANGES * len(order)
    while pending:
        k = pending.pop()
        is_neighbour = 0 <= k < len(order) - 1
        if not (is_neighbour and displacements[k + 1] > displacements[k] * (1 + SAME_YIELD_TOL)):
            continue
        remaining -= 1
        if remaining < 0:
            return None
        both = slice(k, k + 2)
        low[both, : k + 2] = low[[k + 1, k], : k + 2]
        size = np.hypot(low[k, k], low[k, k + 1])
        c, s = float(low[k, k] / size), float(low[k, k + 1] / size)
        # this sign keeps the diagonal positive
        rotation = np.array([[c, s], [s, -c]])
        low[k:, both] = low[k:, both] @ rotation
        low[k, k + 1] = 0.0
        order[both] = order[both][::-1]
        for part in (root, pull):
            part[both] = c * part[k] + s * part[k + 1], s * part[k] - c * part[k + 1]
        displacements[both] = [a / b if b > 0 else np.inf for a, b in zip(pull[both], root[both])]
        pending += [k + 1, k - 1]
    return _Sequence(*map(np.array, (order, low, root, pull, displacements)))


def _factorise(c: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor of c (n, n).

    PatchfemError if c is not positive definite to working precision.
    """
    low, fault = dpotrf(c.T, lower=1)
    if fault:
        raise PatchfemError(INDEFINITE_MESSAGE)
    return low


def _eliminate_points(c: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the order of `_Sequence` by eliminating one point after each yield.

    The point is eliminated from the inverse of c, which takes n^3 products in all.
    """
    inverse, remaining, yielded = np.linalg.inv(c), force.copy(), []
    rate = inverse.sum(axis=0)
    for _ in range(force.size):
        wait = _divide_or_inf(remaining, rate)
        wait[yielded] = np.inf
        point = int(wait.argmin())
        yielded.append(point)
        remaining -= rate * max(wait[point], 0.0)
        column, pivot = inverse[point].copy(), inverse[point, point]
        rate = rate - column / pivot * rate[point]
        inverse -= np.outer(column, column / pivot)
    return np.array(yielded[::-1])


def scale_limits(elements: JenkinsSet, factor: float) -> JenkinsSet:
    """Return elements with `factor` > 0 times the yield forces and the same springs."""
    return replace(
        elements,
        yield_displacement=frozen_array(factor * elements.yield_displacement),
        limit=frozen_array(factor * elements.limit),
    )


def shear_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    count: int,
    weakening: float = 1.0,
) -> ShearModes:
    """Return the `count` most compliant modes of D^1/2 C D^1/2 for points with bonds.

    Parameters
    ----------
    tangential : (m, m) ndarray
        Compliance C [m/N].
    limit : (m,) ndarray
        Friction limits D [N]; the bonds of a point have the stiffness limit/bond_length.
    bond_length : float
        [m]
    count : int
    weakening : float
        Static over kinetic friction.

    Raises
    ------
    PatchfemError
        If a weakening contact could jump by itself: lambda_max(k C)(eps_0/eps_k - 1) >= 1.
    """
    return _make_spectrum(tangential, limit, bond_length, weakening).modes(count)


def _make_spectrum(
    tangential, limit, bond_length: float, weakening: float, *, first_modes_only: bool = False
) -> Spectrum:
    """Return the Spectrum of the points that carry load, as `shear_modes` describes it.

    first_modes_only: of many points the N_REFERENCE_MODES most compliant modes are enough.
    """
    index, spectrum = np.flatnonzero(limit > 0), None
    if first_modes_only and index.size >= MIN_LANCZOS_POINTS:
        spectrum = _first_modes(tangential, index, limit[index], bond_length)
    if spectrum is None:
        spectrum = _all_modes(tangential, index, limit[index], bond_length)
    stability = spectrum.values[0] / bond_length * (weakening - 1)
    if stability >= 1:
        raise PatchfemError(
            "contact.shear with friction.kinetic below static: the patch may slip suddenly without a "
            f"change of the force on it (the stability number is {stability:.3g}, but must be below 1); "
            "raise friction.bond_length or friction.kinetic"
        )
    return spectrum


def _all_modes(tangential, index, limit, length: float) -> Spectrum:
    """Return the Spectrum with all modes of the points `index` (a,) with limits (a,) [N]."""
    points = frozen_array(index, np.int64)
    if np.ptp(tangential) == 0:
        # rigid points in series with one spring have only one mode
        return Spectrum(points, limit, np.ones((index.size, 1)), tangential[:1, 0], length)
    root = np.sqrt(limit)
    with one_thread():
        values, vectors = np.linalg.eigh(root[:, None] * tangential[np.ix_(index, index)] * root)
    return Spectrum(points, limit, vectors[:, ::-1] / root[:, None], values[::-1], length)


def _first_modes(tangential, index, limit, length: float) -> Spectrum | None:
    """Return the Spectrum with the N_REFERENCE_MODES most compliant modes.

    It is None where Lanczos' method does not find them, as for a soft skin, whose eigenvalues lie close together.
    """
    root, c = np.sqrt(limit)[:, None], _block(tangential, index)

    def product(vectors: np.ndarray) -> np.ndarray:
        return root * (c @ (root * vectors))

    with one_thread():
        values, vectors, residual = largest_eigenpairs(
            product, root[:, 0], N_REFERENCE_MODES, MAX_PRODUCTS
        )
    if not residual <= MODE_TOL * values[0]:
        return None
    points = frozen_array(index, np.int64)
    return Spectrum(points, limit, vectors / root, values, length, tangential)


def _block(tangential, index) -> np.ndarray:
    """Return the compliance (a, a) between the points `index` (a,), a view if they are adjacent."""
    if index[-1] - index[0] >= index.size:
        return tangential[np.ix_(index, index)]
    span = slice(index[0], index[-1] + 1)
    return tangential[span, span]


class EigenPairs(NamedTuple):
    """Largest eigenvalues (count,), eigenvectors (n, count), and the largest residual."""

    values: np.ndarray
    vectors: np.ndarray
    residual: float


def largest_eigenpairs(
    product: Callable, start: np.ndarray, count: int, n_products: int
) -> EigenPairs:
    """Find the largest eigenvalues of a symmetric matrix by block Lanczos with two vectors.

    Each vector is made orthogonal to all before it (Golub, Van Loan, Matrix Computations, section 10.3.6).

    Parameters
    ----------
    product : callable
        Function (n, 2) -> (n, 2) that multiplies by the matrix.
    start : (n,) ndarray
        First vector, of one sign.
    count, n_products : int
        Number of eigenvalues, and of products.
    """
    basis, images = np.empty((2, len(start), 2 * n_products))
    new = np.stack([start, start * np.linspace(-1, 1, len(start))], axis=1)
    for k in range(0, 2 * n_products, 2):
        # The orthogonalization is repeated because rounding errors of the first pass remain.
        for _ in range(2):
            new = new - basis[:, :k] @ (basis[:, :k].T @ new)
            first = new[:, 0] / np.sqrt(new[:, 0] @ new[:, 0])
            second = new[:, 1] - first * (first @ new[:, 1])
            new = np.stack([first, second / np.sqrt(second @ second)], axis=1)
        basis[:, k : k + 2] = new
        new = product(new)
        images[:, k : k + 2] = new
    projected = basis.T @ images
    values, parts = np.linalg.eigh((projected + projected.T) / 2)
    values, parts = values[: -count - 1 : -1], parts[:, : -count - 1 : -1]
    vectors = basis @ parts
    residuals = ((images @ parts - vectors * values) ** 2).sum(axis=0)
    return EigenPairs(values, vectors, float(np.sqrt(residuals.max())))


def enough_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    count: int,
    tolerance: float,
    weakening: float = 1.0,
    max_modes: int = 64,
) -> ShearModes:
    """Return modes whose backbone error meets a tolerance, their number doubled from `count` on.

    A soft skin spreads the compliance over many modes; the pieces alone need four.

    Parameters
    ----------
    tangential, limit, bond_length, weakening
        As in `shear_modes`.
    count, max_modes : int
        First and largest number of modes.
    tolerance : float
        Error of the resultant over the friction limit.
    """
    spectrum = _make_spectrum(tangential, limit, bond_length, weakening)
    modes = spectrum.modes(count)
    while modes.stiffness.size == count and count < max_modes and modes.backbone_error > tolerance:
        count = min(2 * count, max_modes)
        modes = spectrum.modes(count)
    return modes


def fewest_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    tolerance: float,
    weakening: float = 1.0,
    max_modes: int = 64,
) -> ShearModes:
    """Return the fewest modes (at least two) that agree with four times as many.

    Their backbones are compared.

    They may differ by MAX_MODE_ERROR of the tolerance; the remainder is left to the modes beyond.

    Parameters
    ----------
    tangential, limit, bond_length, weakening
        As in `shear_modes`.
    tolerance : float
        Error of the resultant over the friction limit.
    max_modes : int
    """
    spectrum = _make_spectrum(tangential, limit, bond_length, weakening, first_modes_only=True)
    for count in range(2, max_modes):
        # few modes come first, because their backbone is the starting point for many modes
        backbone = spectrum.backbone(count)
        reference = spectrum.backbone(max(N_REFERENCE_MODES, 4 * count))
        error = spectrum.relative_difference(reference, backbone)
        if error <= MODE_ERROR_FRACTION * tolerance:
            return spectrum.modes(count)
    return spectrum.modes(max_modes)


def comparison_mode_count(count: int) -> int:
    """Return how many modes a second run needs to show the error of `count` modes.

    It is half as many. Of two or three modes of a symmetric patch only the first acts: there it is four times as many.
    """
    return count // 2 if count >= N_SHEAR_MODES else 4 * count


class GaussModes(NamedTuple):
    """Modes on Gauss points that represent all points.

    - modes: The indices of their points count from 0.
    - limit (k,): Friction limits of the Gauss points [N].
    - error: Largest error of the backbone over the friction limit.
    """

    modes: ShearModes
    limit: np.ndarray
    error: float


def fewest_gauss_points(modes: ShearModes, x: np.ndarray, tolerance: float) -> GaussModes:
    """Return the modes on as few Gauss points as the tolerance allows, if no fields are needed.

    All points are kept where more than half of them would be needed.

    Parameters
    ----------
    modes : ShearModes
    x : (a,) ndarray
        Positions of the points [m].
    tolerance : float
        Error of the backbone over the friction limit.
    """
    for count in GAUSS_COUNTS:
        if 2 * count > x.size:
            break
        on_gauss = modes_on_gauss(modes, x, count)
        if on_gauss.error <= tolerance:
            return on_gauss
    every_point = frozen_array(np.arange(x.size), np.int64)
    return GaussModes(replace(modes, points=every_point), modes.spectrum.limit, 0.0)


def modes_on_gauss(modes: ShearModes, x: np.ndarray, count: int) -> GaussModes:
    """Return the modes on `count` Gauss points of the friction limit along the patch.

    Parameters
    ----------
    modes : ShearModes
    x : (a,) ndarray
        Positions of the points [m].
    count : int
    """
    spectrum, n_modes = modes.spectrum, modes.stiffness.size
    positions, limit = gauss_rule(x, spectrum.limit, count)
    shape = np.stack([np.interp(positions, x, mode) for mode in modes.shape.T], axis=1)
    error = spectrum.relative_difference(
        spectrum.backbone(n_modes), spectrum.backbone(n_modes, shape, limit)
    )
    points = frozen_array(np.arange(count), np.int64)
    return GaussModes(replace(modes, points=points, shape=frozen_array(shape)), limit, error)


def gauss_rule(x: np.ndarray, weight: np.ndarray, count: int) -> tuple:
    """Return positions and weights (count,) of the Gauss rule for a weighted sum over points.

    The rule is exact for polynomials up to the order 2 count - 1. It is found by Lanczos' method, each vector being
    made orthogonal to all before it.

    Parameters
    ----------
    x, weight : (a,) ndarray
        Positions and weights > 0 of the points.
    count : int
    """
    scaled, total = 2 * (x - x.mean()) / np.ptp(x), weight.sum()
    basis, diagonal, off_diagonal = [np.sqrt(weight / total)], [], []
    for _ in range(count):
        new = scaled * basis[-1]
        diagonal.append(new @ basis[-1])
        # The orthogonalization is repeated because rounding errors of the first pass remain.
        for _ in range(2):
            new = new - np.array(basis).T @ (np.array(basis) @ new)
        off_diagonal.append(np.linalg.norm(new))
        basis.append(new / off_diagonal[-1])
    sides = np.diag(off_diagonal[:-1], 1)
    positions, vectors = np.linalg.eigh(np.diag(diagonal) + sides + sides.T)
    return x.mean() + positions * np.ptp(x) / 2, total * vectors[0] ** 2


class _Backbone(NamedTuple):
    """Force (k,) [N] at k displacements, NaN if not converged, and modal coordinates (k, r)."""

    force: np.ndarray
    coordinates: np.ndarray


def _solve_backbone(limit, shape, values, length, displacements, start) -> _Backbone:
    """Solve for first loading at all relative displacements (k,) by Newton's method.

    The law D (1 - exp(-xi/length)) saturates.

    The coordinates `start` (k, r) are overwritten. No step moves a point back by more than MAX_BACK_STEP lengths,
    because the law is so steep there that Newton's method does not return.
    """
    coordinates, pending, n_modes = start, np.arange(displacements.size), values.size
    first, second = np.tril_indices(n_modes)
    products = (shape.T[first] * shape.T[second]).T
    entries = np.empty((n_modes, n_modes), np.int64)
    entries[first, second] = entries[second, first] = np.arange(first.size)
    for _ in range(400):
        xi = displacements[pending, None] - coordinates[pending] @ shape.T
        decay = np.exp(np.minimum(-xi / length, 700.0))
        residual = coordinates[pending] / values - (limit * (1 - decay)) @ shape
        tangent = ((limit * decay / length) @ products)[:, entries] + np.diag(1 / values)
        try:
            step = np.linalg.solve(tangent, residual[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            return _Backbone(np.full(displacements.size, np.nan), coordinates)
        change = step @ shape.T
        backward = np.where(change < 0, -change, 1.0)
        part = np.where(change < 0, (xi + MAX_BACKWARD_LENGTHS * length) / backward, 1.0).min(
            axis=1
        )
        part = np.where((part > 0) & (part < 1), part, 1.0)
        coordinates[pending] -= part[:, None] * step
        size = np.abs(coordinates[pending]).max(axis=1) + 1e-300
        # Newton's method converges quadratically, so the omitted step is a rounding error
        is_converged = (part == 1.0) & (np.abs(step).max(axis=1) <= 1e-11 * size)
        pending = pending[~is_converged]
        if not pending.size:
            break
    xi = displacements[:, None] - coordinates @ shape.T
    force = -np.expm1(np.minimum(-xi / length, 700.0)) @ limit
    force[pending] = np.nan
    return _Backbone(force, coordinates)
