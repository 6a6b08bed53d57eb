"""Partial slip of the patch under one rigid slide q of the holders: two cheap forms of the pieces' shear compliance.

Point i feels the local slide q - sum_j C_ij f_j. Both forms hold for the contact set only:

* Points that yield at a fixed force D_i (Coulomb, or elastic-plastic at constant load and tilt) are together exactly a
set of parallel Jenkins elements. The inverse of C has off-diagonals <= 0 and row sums > 0, so slip zones only grow
within a stroke (Masing). Corner nodes of bilinear cells can have a small negative row sum; such a node holds on until
its neighbours have slipped. That costs 1e-9 of the friction limit at 201 nodes and 4e-8 at 401. Leaving such nodes out
would cost their load, 1.4 % for the six of that patch.

* Points with a memory law share the modes of D^1/2 C D^1/2, D = mu sigma_n weight. A few modes carry the resultant.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..contact.unilateral import INDEFINITE_MESSAGE
from ..core import PatchfemError, frozen_array
from ..elasticity.lapack import dpotrf, dpotrs, dtrsm, dtrtri, one_thread

SAME = 1e-11  # of a yield slide: nodes that yield at once, as mirrored ones do; round-off parts 801 of them by 7e-13
TRIES = 2  # times that yields are sorted anew before neighbours are exchanged, which finds a point that is far off
SWAPS = 20  # exchanges of neighbours per point before points are taken out one by one: patches ask for 1 at most
# modes a shear reduction starts from: of bare pieces they leave 1e-6 of the friction limit
SHEAR_MODES = 4
# modes that fewer are held against; share of a tolerance that they may miss these by
FEW, BEYOND = (
    16,
    0.8,
)
# points from which on the most compliant FEW modes are found without the others; products that they take, two vectors
# each; residual over the largest value that these leave: squared, it is what the values err by
LARGE, PRODUCTS, LEFT = 128, 24, 1e-6
GATHERED = 16, 32, 64  # points that may stand for all of a patch
BACK = 2.0  # bond lengths: exp(2) of the stiffness at rest


@dataclass(frozen=True, eq=False)
class JenkinsSet:
    """Parallel Jenkins elements: springs that slip at a yield slide.

    stiffness: (t,) [N/m]; yield_slide: (t,) [m]; sum stiffness * yield_slide = friction limit. points: (a,) nodes of
    the contact set; limit: (a,) their yield forces [N]. order: (a,) places in `points`, the last to yield first; low:
    lower Cholesky factor (a, a) of the compliance in that order, empty of one spring before rigid points; starts: (t,)
    yields after which that of an element comes first. reluctant: nodes that at first carry the wrong sign.
    """

    stiffness: np.ndarray
    yield_slide: np.ndarray
    points: np.ndarray
    limit: np.ndarray
    order: np.ndarray
    low: np.ndarray
    starts: np.ndarray
    reluctant: int

    @cached_property
    def point_yields(self) -> np.ndarray:
        """(a,) [m]: the slide at which each of `points` yields."""
        if not self.order.size:
            return np.full(self.limit.size, self.yield_slide[0])
        out = np.empty(self.limit.size)
        counts = np.diff(np.append(self.starts, self.order.size))
        out[self.order[::-1]] = np.repeat(self.yield_slide, counts)
        return frozen_array(out)

    @cached_property
    def share(self) -> np.ndarray:
        """(a, t) [N/m]: the force of a point is share @ stretch for any history."""
        if not self.low.size:
            return self.limit[:, None] / self.yield_slide
        inverse, _ = dtrtri(self.low, lower=1)
        out = np.empty((self.limit.size, self.starts.size))
        out[self.order] = np.add.reduceat(
            (inverse.sum(axis=1)[:, None] * inverse)[::-1], self.starts
        ).T
        return frozen_array(out)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """All modes of D^1/2 C D^1/2, the most compliant first, whose backbones say what a few of them leave out.

    points: (a,) indices of the contact set; limit: D (a,) [N]; shape: (a, n) slide of a point per unit mode coordinate;
    values: (n,) [m/N] of the coordinates; length [m]: of the bonds. tangential: C (m, m) [m/N] where these are the
    first of more modes, which are made when they are asked for.
    """

    points: np.ndarray
    limit: np.ndarray
    shape: np.ndarray
    values: np.ndarray
    length: float
    tangential: np.ndarray | None = None

    @cached_property
    def whole(self) -> "Spectrum":
        """The Spectrum of all modes."""
        return (
            self
            if self.tangential is None
            else _all_modes(self.tangential, self.points, self.limit, self.length)
        )

    @cached_property
    def slides(self) -> np.ndarray:
        """Slides (24,) [m] that backbones are compared on."""
        # six bond lengths: exp(-6) of the bonds' stretch is left; the square sets more slides where the backbone bends
        bends = (
            self.shape @ (self.values * (self.shape.T @ self.limit))
            if self.tangential is None
            else _between(self.tangential, self.points) @ self.limit
        )
        elastic = 2 * np.abs(bends).max()
        return (6 * self.length + elastic) * (np.arange(1, 25) / 24) ** 2

    def modes(self, count: int) -> "ShearModes":
        """The first `count` modes."""
        if count > self.values.size and self.tangential is not None:
            return self.whole.modes(count)
        return ShearModes(
            self.points,
            frozen_array(self.shape[:, :count]),
            frozen_array(1 / self.values[:count]),
            self,
        )

    @cached_property
    def known(self) -> dict:
        """Backbones (24,) [N] and the coordinates of their modes by how many these are, as they have been asked for."""
        return {}

    def backbone(self, count: int, shape=None, limit=None) -> np.ndarray:
        """Resultant [N] on `slides` with `count` modes, of these points or of others with a shape (k, count) and limits
        (k,) [N]; found from that of the most modes below `count` that is known."""
        if count > self.values.size and self.tangential is not None:
            return self.whole.backbone(count, shape, limit)
        count = min(count, self.values.size)
        if shape is None and count in self.known:
            return self.known[count][0]
        fewer = max((one for one in self.known if one <= count), default=0)
        start = np.zeros((self.slides.size, count))
        if fewer:
            start[:, :fewer] = self.known[fewer][1]
        given = (self.limit, self.shape[:, :count]) if shape is None else (limit, shape)
        with one_thread(), np.errstate(over="ignore", invalid="ignore"):
            found = _backbone(*given, self.values[:count], self.length, self.slides, start)
        if shape is None and np.isfinite(found[0]).all():
            self.known[count] = found
        return found[0]

    def share(self, one, other) -> float:
        """Largest difference of two backbones over the friction limit; inf of one that bonds are too short for."""
        error = float(np.abs(one - other).max() / self.limit.sum())
        return error if np.isfinite(error) else np.inf


@dataclass(frozen=True, eq=False)
class ShearModes:
    """The most compliant shear modes of the pieces.

    points: (a,) indices of the contact set; shape: (a, r) slide of a point per unit mode coordinate; stiffness: (r,)
    [N/m] of the coordinates; of: all modes.
    """

    points: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray
    of: Spectrum

    @cached_property
    def backbone_error(self) -> float:
        """Worst error of the resultant [1] against 64 modes, or four times as many as are kept."""
        count = self.stiffness.size
        return self.of.share(self.of.backbone(max(64, 4 * count)), self.of.backbone(count))


def jenkins_set(tangential: np.ndarray, limit: np.ndarray, local_length: float = 0.0) -> JenkinsSet:
    """Exact parallel elements of points that yield at `limit` (m,) [N] behind the compliance (m, m) [m/N].

    local_length [m]: bond length of the elastic-plastic law (3.12), a local stiffness limit/length in series; 0 for
    Coulomb points. PatchfemError when no point carries load.
    """
    limit = np.asarray(limit, float)
    if not (limit > 0).any():
        raise PatchfemError("contact.shear: the friction limit is 0 at every point of the contact")
    points = np.flatnonzero(limit > 0)
    force, none = limit[points], np.zeros(0, np.int64)
    # a spring before rigid points: they all slip at once
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
    with one_thread():  # more wait for each other: 5 ms of one are 270 ms of two beside other work
        c = _between(tangential, points)
        order, low, root, at, reluctant = _in_order(
            c + np.diag(local_length / force) if local_length else c, force
        )
    starts = np.flatnonzero(np.diff(at, prepend=-np.inf) > SAME * at)
    return JenkinsSet(
        frozen_array(np.add.reduceat(root[::-1] ** 2, starts)),
        frozen_array(at[starts]),
        frozen_array(points, np.int64),
        frozen_array(force),
        order,
        low,
        starts,
        reluctant,
    )


def _in_order(c: np.ndarray, force: np.ndarray) -> tuple:
    """(order (n,), L (n, n), L^-1 1 (n,), rising slides (n,) [m] of the yields, number of reluctant points) of points
    behind the compliance c = L L' in an order, the last that yields first, that yield at `force` (n,) [N].

    While the first m of them stick, their rates solve the leading block of c. So what the m-th carries less by its
    yield is the m-th row of L^-1 times (L^-1 1)_m, and slides at which all yield solve share @ slides = force: they are
    (L' force)/(L^-1 1). An order is right where these rise, as a rate only grows until its point yields. The first is
    that of no yields, a further one that of these slides. What then is still wrong is exchanged with its neighbour.
    """
    rate = dpotrs(_factor(c), np.ones(force.size), lower=1)[0]
    order, slides = (
        np.arange(force.size),
        np.divide(force, rate, out=np.full(force.size, np.inf), where=rate > 0),
    )
    for _ in range(TRIES + 1):
        order = order[np.argsort(-slides, kind="stable")]
        low, root, pull, slides = _yields(c, force, order)
        if _rises(slides):
            break
    else:
        if (found := _exchanged(order, low, root, pull)) is None:
            order = _one_by_one(c, force)
            low, root, _, slides = _yields(c, force, order)
        else:
            order, low, root, slides = found
    return order, low, root, np.maximum.accumulate(slides[::-1]), int((rate <= 0).sum())


def _yields(c: np.ndarray, force: np.ndarray, order: np.ndarray) -> tuple:
    """(L (n, n), L^-1 1 (n,), L' force (n,), slides (n,) [m] of the yields) in an order."""
    low = _factor(c[np.ix_(order, order)])
    root, pull = dtrsm(1.0, low, np.ones((force.size, 1)), lower=1)[:, 0], force[order] @ low
    return low, root, pull, np.divide(pull, root, out=np.full(force.size, np.inf), where=root > 0)


def _rises(slides: np.ndarray) -> bool:
    """Whether slides (n,) rise from the last on."""
    return bool((slides[1:] <= slides[:-1] * (1 + SAME)).all())


def _exchanged(
    order: np.ndarray, low: np.ndarray, root: np.ndarray, pull: np.ndarray
) -> tuple | None:
    """(order, L, L^-1 1, slides) with neighbours exchanged until the slides of their yields rise; None where that does
    not come to an end. Arguments as `_yields` has them.

    An exchange changes the yields of these two alone: L with two rows exchanged is lower again by a rotation of two of
    its columns, which turns L^-1 1 and L' force with them.
    """
    order, root, pull = order.tolist(), root.tolist(), pull.tolist()
    slides = [a / b if b > 0 else np.inf for a, b in zip(pull, root)]
    looked, left = list(range(len(order) - 1))[::-1], SWAPS * len(order)
    while looked:
        k = looked.pop()
        if not (0 <= k < len(order) - 1 and slides[k + 1] > slides[k] * (1 + SAME)):
            continue
        if (left := left - 1) < 0:
            return None
        both = slice(k, k + 2)
        low[both, : k + 2] = low[[k + 1, k], : k + 2]
        size = np.hypot(low[k, k], low[k, k + 1])
        c, s = float(low[k, k] / size), float(low[k, k + 1] / size)
        # low[k + 1, k] times s is what stays on the diagonal, above 0
        turn = np.array([[c, s], [s, -c]])
        low[k:, both] = low[k:, both] @ turn
        low[k, k + 1], order[both] = 0.0, order[both][::-1]
        for one in (root, pull):
            one[both] = c * one[k] + s * one[k + 1], s * one[k] - c * one[k + 1]
        slides[both] = [a / b if b > 0 else np.inf for a, b in zip(pull[both], root[both])]
        looked += [k + 1, k - 1]
    return np.array(order), low, np.array(root), np.array(slides)


def _factor(c: np.ndarray) -> np.ndarray:
    """Lower Cholesky factor (n, n); PatchfemError where c is not positive definite to working precision."""
    low, fault = dpotrf(c.T, lower=1)
    if fault:
        raise PatchfemError(INDEFINITE_MESSAGE)
    return low


def _one_by_one(c: np.ndarray, force: np.ndarray) -> np.ndarray:
    """`order` of `_in_order` by taking points out of the inverse of c after each yield: n^3 products."""
    inverse, left, out = np.linalg.inv(c), force.copy(), []
    rate = inverse.sum(axis=0)
    for _ in range(force.size):
        wait = np.divide(left, rate, out=np.full(force.size, np.inf), where=rate > 0)
        wait[out] = np.inf
        out.append(int(wait.argmin()))
        left -= rate * max(wait[out[-1]], 0.0)
        column, pivot = inverse[out[-1]].copy(), inverse[out[-1], out[-1]]
        rate = rate - column / pivot * rate[out[-1]]
        inverse -= np.outer(column, column / pivot)
    return np.array(out[::-1])


def scaled(group: JenkinsSet, factor: float) -> JenkinsSet:
    """The elements of points that yield at `factor` > 0 times the force: the same springs, each that much further."""
    return replace(
        group,
        yield_slide=frozen_array(factor * group.yield_slide),
        limit=frozen_array(factor * group.limit),
    )


def shear_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    count: int,
    weakening: float = 1.0,
) -> ShearModes:
    """The `count` most compliant modes of D^1/2 C D^1/2 for points whose bonds have the stiffness limit/bond_length.

    tangential: (m, m) [m/N]; limit: D (m,) [N]; bond_length [m]; weakening: static over kinetic friction. PatchfemError
    where a weakening contact could jump by itself: lambda_max(k C)(eps_0/eps_k - 1) >= 1.
    """
    return _spectrum(tangential, limit, bond_length, weakening).modes(count)


def _spectrum(
    tangential, limit, bond_length: float, weakening: float, first: bool = False
) -> Spectrum:
    """The Spectrum of points; arguments and refusals as of `shear_modes`. first: of many points that of FEW modes."""
    index = np.flatnonzero(limit > 0)
    found = (
        _first_modes(tangential, index, limit[index], bond_length)
        if first and index.size >= LARGE
        else None
    )
    found = found or _all_modes(tangential, index, limit[index], bond_length)
    jump = found.values[0] / bond_length * (weakening - 1)
    if jump >= 1:
        raise PatchfemError(
            "contact.shear with friction.kinetic below static: the patch may slip suddenly without a "
            f"change of the force on it (the stability number is {jump:.3g}, but must be below 1); "
            "raise friction.bond_length or friction.kinetic"
        )
    return found


def _all_modes(tangential, index, limit, length: float) -> Spectrum:
    """The Spectrum of the points `index` (a,) with limits (a,) [N], of all modes."""
    if np.ptp(tangential) == 0:  # a spring before points of one rigid piece: one mode is all of it
        return Spectrum(
            frozen_array(index, np.int64),
            limit,
            np.ones((index.size, 1)),
            tangential[:1, 0],
            length,
        )
    root = np.sqrt(limit)
    with one_thread():
        values, vectors = np.linalg.eigh(root[:, None] * tangential[np.ix_(index, index)] * root)
    return Spectrum(
        frozen_array(index, np.int64), limit, vectors[:, ::-1] / root[:, None], values[::-1], length
    )


def _first_modes(tangential, index, limit, length: float) -> Spectrum | None:
    """The Spectrum of the points `index` (a,) with limits (a,) [N], of the FEW most compliant modes; None where they
    are not found in PRODUCTS, as those of a soft skin, whose values lie close."""
    root, c = np.sqrt(limit)[:, None], _between(tangential, index)
    with one_thread():
        values, vectors, left = largest(
            lambda x: root * (c @ (root * x)), root[:, 0], FEW, PRODUCTS
        )
    if not left <= LEFT * values[0]:
        return None
    return Spectrum(
        frozen_array(index, np.int64), limit, vectors / root, values, length, tangential
    )


def _between(tangential, index) -> np.ndarray:
    """Compliance (a, a) of the points `index` (a,), of neighbours without a copy."""
    inside = slice(index[0], index[-1] + 1)
    return (
        tangential[inside, inside]
        if index[-1] - index[0] < index.size
        else tangential[np.ix_(index, index)]
    )


def largest(times: Callable, near: np.ndarray, count: int, products: int) -> tuple:
    """(the `count` largest eigenvalues (count,) of a symmetric matrix (n, n), falling; their vectors (n, count); the
    largest residual of these), by Lanczos' method on two vectors at once, each made orthogonal to all before it (Golub
    and Van Loan, Matrix Computations, 10.3.6).

    times(x (n, 2)) -> the matrix times x; near: (n,) of one sign, which the first vector is like; products: so many.
    """
    basis, images = np.empty((2, len(near), 2 * products))
    new = np.stack([near, near * np.linspace(-1, 1, len(near))], axis=1)
    for k in range(0, 2 * products, 2):
        for _ in range(2):  # once leaves the round-off of the first
            new = new - basis[:, :k] @ (basis[:, :k].T @ new)
            one = new[:, 0] / np.sqrt(new[:, 0] @ new[:, 0])
            other = new[:, 1] - one * (one @ new[:, 1])
            new = np.stack([one, other / np.sqrt(other @ other)], axis=1)
        basis[:, k : k + 2] = new
        images[:, k : k + 2] = new = times(new)
    inner = basis.T @ images
    values, parts = np.linalg.eigh((inner + inner.T) / 2)
    values, parts = values[: -count - 1 : -1], parts[:, : -count - 1 : -1]
    vectors = basis @ parts
    return (
        values,
        vectors,
        float(np.sqrt(((images @ parts - vectors * values) ** 2).sum(axis=0).max())),
    )


def enough_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    count: int,
    tolerance: float,
    weakening: float = 1.0,
    most: int = 64,
) -> ShearModes:
    """The fewest `shear_modes` whose backbone error meets `tolerance`, doubled from `count` up to `most`.

    A soft skin spreads the compliance over many modes; the pieces alone need four.
    """
    spectrum = _spectrum(tangential, limit, bond_length, weakening)
    found = spectrum.modes(count)
    while found.stiffness.size == count and count < most and found.backbone_error > tolerance:
        count = min(2 * count, most)
        found = spectrum.modes(count)
    return found


def fewest_modes(
    tangential: np.ndarray,
    limit: np.ndarray,
    bond_length: float,
    tolerance: float,
    weakening: float = 1.0,
    most: int = 64,
) -> ShearModes:
    """The fewest `shear_modes`, two at least, whose backbone misses one of four times as many, FEW at least, by less
    than BEYOND of `tolerance`: the rest is left to what more modes than these would add."""
    spectrum = _spectrum(tangential, limit, bond_length, weakening, first=True)
    for count in range(2, most):
        spectrum.backbone(count)  # the first: that of more is found from it
        more = max(FEW, 4 * count)
        if spectrum.share(spectrum.backbone(more), spectrum.backbone(count)) <= BEYOND * tolerance:
            return spectrum.modes(count)
    return spectrum.modes(most)


def beside(count: int) -> int:
    """How many modes a run beside one of `count` has, whose change tells what they leave out: half as many. Of two or
    three in a symmetric patch none but the first acts: four times as many."""
    return count // 2 if count >= SHEAR_MODES else 4 * count


def gathered(found: ShearModes, x: np.ndarray, tolerance: float) -> tuple:
    """(modes of few points in place of all, limits (k,) of these [N]): for a motion whose fields nobody asks for.

    x: (a,) [m] places of the points. The few are the Gauss points of the friction limit along the patch, at which the
    shapes are read between the nodes; as many of GATHERED as leave the backbone within `tolerance` of the limit, all
    points where that is more than half of them. Their numbers count from 0.
    """
    for count in GATHERED:
        if 2 * count > x.size:
            break
        few, share, error = on_gauss(found, x, count)
        if error <= tolerance:
            return few, share
    return replace(found, points=frozen_array(np.arange(x.size), np.int64)), found.of.limit


def on_gauss(found: ShearModes, x: np.ndarray, count: int) -> tuple:
    """(modes on `count` Gauss points, their limits [N], share of the limit by which their backbone misses that of all);
    arguments as of `gathered`."""
    of, r = found.of, found.stiffness.size
    place, share = gauss(x, of.limit, count)
    shape = np.stack([np.interp(place, x, one) for one in found.shape.T], axis=1)
    error = of.share(of.backbone(r), of.backbone(r, shape, share))
    return (
        replace(found, points=frozen_array(np.arange(count), np.int64), shape=frozen_array(shape)),
        share,
        error,
    )


def gauss(x: np.ndarray, weight: np.ndarray, count: int) -> tuple:
    """Places (count,) and weights of the Gauss rule of a sum over points x (a,) with `weight` (a,) > 0: exact of
    polynomials to the order 2 count - 1. By Lanczos' method, each vector made orthogonal to all before it."""
    at, total = 2 * (x - x.mean()) / np.ptp(x), weight.sum()
    basis, diagonal, beside = [np.sqrt(weight / total)], [], []
    for _ in range(count):
        new = at * basis[-1]
        diagonal.append(new @ basis[-1])
        for _ in range(2):  # once leaves the round-off of the first
            new = new - np.array(basis).T @ (np.array(basis) @ new)
        beside.append(np.linalg.norm(new))
        basis.append(new / beside[-1])
    places, vectors = np.linalg.eigh(
        np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    )
    return x.mean() + places * np.ptp(x) / 2, total * vectors[0] ** 2


def _backbone(limit, shape, values, length, slides, start) -> tuple:
    """(resultant [N], coordinates (k, r) of the modes) on the virgin slides (k,) for the saturating law
    D (1 - exp(-xi/length)), by Newton on all of them from the coordinates `start`.

    No step takes a point further back than BACK lengths, where the law is so steep that Newton does not come back. NaN
    where it does not come to an end.
    """
    b, unconverged, r = start, np.arange(slides.size), values.size
    first, second = np.tril_indices(r)
    products, upper = (shape.T[first] * shape.T[second]).T, np.empty((r, r), np.int64)
    upper[first, second] = upper[second, first] = np.arange(first.size)
    for _ in range(400):
        xi = slides[unconverged, None] - b[unconverged] @ shape.T
        decay = np.exp(np.minimum(-xi / length, 700.0))
        missing = b[unconverged] / values - (limit * (1 - decay)) @ shape
        tangent = ((limit * decay / length) @ products)[:, upper] + np.diag(1 / values)
        try:
            step = np.linalg.solve(tangent, missing[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:  # a law too steep for numbers
            return np.full(slides.size, np.nan), b
        change = step @ shape.T  # of xi
        part = np.where(
            change < 0, (xi + BACK * length) / np.where(change < 0, -change, 1.0), 1.0
        ).min(axis=1)
        part = np.where((part > 0) & (part < 1), part, 1.0)
        b[unconverged] -= part[:, None] * step
        size = np.abs(b[unconverged]).max(axis=1) + 1e-300
        # quadratic: the next is round-off
        unconverged = unconverged[~((part == 1.0) & (np.abs(step).max(axis=1) <= 1e-11 * size))]
        if not unconverged.size:
            break
    out = -np.expm1(np.minimum(-(slides[:, None] - b @ shape.T) / length, 700.0)) @ limit
    out[unconverged] = np.nan
    return out, b
