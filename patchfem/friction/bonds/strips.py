"""Force and stored energy of straight strips of bonds (eq. 2.17).

The bonds that form in a step of the path are a strip. At a distance y from the end of a strip with the direction
e = +-1, a bond has the stretch u = a + y e and the path R = R_end + y since it formed; a and R_end are those of a bond at
the end of the strip. Per mu_s sigma_n the strip carries the sum over y of

    (|u|/eps)^p exp(-D) u/|u| dy/(eps_0 Gamma(p + 1))        reading="stretch", D the damage since the bond formed
    (R/eps)^p exp(-R/eps) u/|u| dy/(eps_0 Gamma(p + 1))      reading="report", eq. 2.14

with the path element dy > 0 in place of the signed dX1 of the report. These integrals are evaluated

- in closed form for reading="stretch" and p = 1, for any history of the bond length;
- in closed form, by the incomplete gamma function, for reading="report" at a constant bond length;
- otherwise by Gauss points on pieces of the strip.

A piece is at most a quarter of a bond length long, and not longer than its distance from any point at which the
integrand is not smooth: |u|^p for a fractional p (reading="stretch"), and R^p for a fractional p (reading="report"). No
piece contains u = 0. Where the integrand grows as |u|^p or R^p from an end of a piece, this power is the weight of the
Gauss rule.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import gammainc, gammaln, roots_jacobi

from .parameters import Bonds, grown_fraction

N_GAUSS_POINTS = 8  # number of Gauss points on each piece of a strip
MAX_PIECE_LENGTH = 0.25  # largest length of a piece in bond lengths
# Largest number of pieces of a strip due to growth, with one piece per unit of J
MAX_GROWTH_PIECES = 16
FULL_GROWTH = 36.0  # growth J from which the starting length of a bond does not matter
# Largest displacement of an unstressed cohort since it formed, relative to the path since then
UNSTRESSED_TOL = 1e-14
# A cut that is closer to u = 0 than this fraction of the strip length is treated as lying at u = 0
REVERSAL_TOL = 1e-9
# Smallest length of a piece, relative to the length of the part that is divided
MIN_PIECE_FRACTION = 1e-15
MIN_POSITIVE = 1e-300  # smallest argument of a logarithm and smallest divisor


class PathState(NamedTuple):
    """State of the path at one point (scalars) or at k points (arrays (k,)).

    - displacement: relative displacement [m]
    - path: total path [m]
    - damage: damage D, the integral of dR/eps along the path
    - growth: growth J, the exponent by which bonds approach their target length (eq. 2.10)
    - mature_length: length eps [m] of bonds that have grown all along
    """

    displacement: np.ndarray
    path: np.ndarray
    damage: np.ndarray
    growth: np.ndarray
    mature_length: np.ndarray


class Strip(NamedTuple):
    """Strip of bonds, or k strips as arrays (k,).

    - end: state of the path at the end of the strip
    - direction, length: sign of its direction, and length [m]
    - bond_length: bond length eps [m] when the bonds formed
    - growth, mature_gain: growth J, and change [m] of the mature length, while the strip formed

    A strip of length 0 is a cohort: unstressed, fully grown bonds that formed at one point.
    """

    end: PathState
    direction: np.ndarray
    length: np.ndarray
    bond_length: np.ndarray
    growth: np.ndarray
    mature_gain: np.ndarray

    def select(self, index) -> "Strip":
        """Return the strips that an index, mask or slice selects."""
        end = PathState(*(column[index] for column in self.end))
        return Strip(end, *(column[index] for column in self[1:]))

    def append(self, strip: "Strip") -> "Strip":
        """Return the strips with one more strip at the end."""
        pairs = zip((*self.end, *self[1:]), (*strip.end, *strip[1:]))
        columns = [np.concatenate([old, np.asarray(new, float)[None]]) for old, new in pairs]
        n_end = len(PathState._fields)
        return Strip(PathState(*columns[:n_end]), *columns[n_end:])


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """Bonds along a path, grouped into k strips.

    - strips: columns of the strips; the first strip is the cohort of the initial bonds
    - pressure (k, m): pressure [Pa] at which the bonds of each point formed; of a cohort its density times this pressure
    - now: present state of the path
    - first_active (m,): index of the first strip that still acts at each point
    - n_dropped: number of strips that the cut-off has removed
    - play: play of the elastic range, as in `parameters.split_elastic`
    """

    strips: Strip
    pressure: np.ndarray
    now: PathState
    first_active: np.ndarray
    n_dropped: int = 0
    play: float = 0.0


class _StripParts(NamedTuple):
    """Parts of strips in each of which the stretch has a constant sign.

    - strip: index of the strip
    - start, length: distance of the part from the end of the strip, and length [m]
    - is_zero_at_start, is_zero_at_end: whether u = 0 at the start of the part, and at its far end
    """

    strip: np.ndarray
    start: np.ndarray
    length: np.ndarray
    is_zero_at_start: np.ndarray
    is_zero_at_end: np.ndarray


class _SingularityDistances(NamedTuple):
    """Distances (n,) [m] from parts to points where the integrand is not smooth, or inf if there are none.

    - nearest: distance of the part from the nearest point of any kind
    - origin: distance of R = 0 from the end of the strip
    """

    nearest: np.ndarray
    origin: np.ndarray


class _IntegrationPieces(NamedTuple):
    """Pieces of strips, each integrated by one Gauss rule (n,).

    - strip: index of the strip
    - start, length: distance of the piece from the end of the strip, and length [m]
    - steep_end: 1 if the integrand grows as a power from the start of the piece, -1 from its far end, 0 otherwise
    """

    strip: np.ndarray
    start: np.ndarray
    length: np.ndarray
    steep_end: np.ndarray


class _GaussRule(NamedTuple):
    """Gauss points in (0, 1) and their weights, (points,) or (n, points)."""

    points: np.ndarray
    weights: np.ndarray


def surviving_density(state: Strips) -> np.ndarray:
    """Return the density of surviving bonds / pressure at formation (k,) for friction.reading = "stretch".

    A cohort keeps exp(-D), and a strip this times 1 - exp(-length/eps), with D the damage since its end.
    """
    strips = state.strips
    remaining = np.exp(-(state.now.damage - strips.end.damage))
    formed_fraction = -np.expm1(-strips.length / strips.bond_length)
    return np.where(strips.length == 0, remaining, remaining * formed_fraction)


def strip_weights(state: Strips, law: Bonds) -> np.ndarray:
    """Return the force and the stored energy of each strip, divided by mu_s sigma_n (eq. 2.17).

    Parameters
    ----------
    state : Strips
    law : Bonds

    Returns
    -------
    (k, 2) array
        Signed force [1], then stored energy [m].
    """
    strips = state.strips
    weights = np.empty((len(strips.length), 2))
    is_cohort = strips.length == 0
    weights[is_cohort] = _cohort_weights(strips.select(is_cohort), state.now, law)
    index = np.flatnonzero(~is_cohort)
    if law.order == 1 and law.reading == "stretch":
        weights[index] = _linear_weights(strips.select(index), state.now, law)
        return weights
    if law.reading == "report" and not law.has_growth:
        weights[index] = _report_weights(strips.select(index), state.now, law)
    elif index.size:
        weights[index] = _gauss_weights(strips.select(index), state.now, law)
    return weights


def _stretch_along(strips: Strip, path_state: PathState) -> np.ndarray:
    """Return the stretch (k,) [m] of the bonds at the end of strips, positive along the strip."""
    return (path_state.displacement - strips.end.displacement) * strips.direction


def _weight_function(law: Bonds, x, damage) -> np.ndarray:
    """Return x^p exp(-damage)/Gamma(p + 1), which is the weight phi in eq. 2.14 if damage = x."""
    log_x = np.log(np.maximum(x, MIN_POSITIVE))
    return np.exp(law.order * log_x - damage - gammaln(law.order + 1))


def _work_to_energy_ratio(law: Bonds) -> float:
    """Return the ratio of force times stretch to stored energy for one bond."""
    return law.order + 1 if law.reading == "stretch" else 1.0


def _cohort_weights(cohorts: Strip, path_state: PathState, law: Bonds) -> np.ndarray:
    """Return force and energy of bonds formed together: (|u|/eps_0)^p exp(-D) or phi(R/eps_0), along u."""
    stretch = path_state.displacement - cohorts.end.displacement
    size = np.abs(stretch)
    path = path_state.path - cohorts.end.path
    if law.reading == "stretch":
        force = _weight_function(law, size / law.length, path_state.damage - cohorts.end.damage)
    else:
        force = _weight_function(law, path / law.length, path / law.length)
    # The force jumps where the stretch changes sign; the mean of both sides is 0.
    force = np.where(size <= UNSTRESSED_TOL * path, 0.0, force)
    return np.column_stack([force * np.sign(stretch), force * size / _work_to_energy_ratio(law)])


def _linear_weights(strips: Strip, path_state: PathState, law: Bonds) -> np.ndarray:
    """Integrate u and |u|^2/2 over strips in closed form, for friction.reading = "stretch" and p = 1."""
    stretch = path_state.displacement - strips.end.displacement
    eps = strips.bond_length
    x = strips.length / eps
    decay = np.exp(-x)
    # These are the integrals of exp(-y), y exp(-y) and y^2 exp(-y) from 0 to x.
    zeroth = -np.expm1(-x)
    first = 1 - decay * (1 + x)
    second = 2 - decay * (x * x + 2 * x + 2)
    remaining = np.exp(-(path_state.damage - strips.end.damage))
    force = stretch * zeroth + strips.direction * eps * first
    energy = stretch**2 * zeroth + 2 * stretch * strips.direction * eps * first + eps**2 * second
    return np.column_stack([remaining * force / law.length, remaining * energy / (2 * law.length)])


def _report_weights(strips: Strip, path_state: PathState, law: Bonds) -> np.ndarray:
    """Integrate over strips in closed form for friction.reading = "report" and a constant bond length.

    The integrals are differences of P(p + 1, R/eps) and P(p + 2, R/eps), the
    regularised lower incomplete gamma function, on both sides of u = 0.
    """
    along = _stretch_along(strips, path_state)
    path = path_state.path - strips.end.path
    cut = np.clip(-along, 0.0, strips.length)
    borders = [np.maximum(path + y, 0) / law.length for y in (0.0, cut, strips.length)]
    p_end, p_cut, p_start = (gammainc(law.order + 1, x) for x in borders)
    scale = law.length * (law.order + 1)
    q_end, q_cut, q_start = (scale * gammainc(law.order + 2, x) for x in borders)
    # These are the integrals of phi sgn(u) dR/eps and of phi R sgn(u) dR/eps.
    signed = p_end - p_cut + (p_start - p_cut)
    moment = q_end - q_cut + (q_start - q_cut)
    energy = (along - path) * signed + moment
    return np.column_stack([strips.direction * signed, energy])


def _gauss_weights(strips: Strip, path_state: PathState, law: Bonds) -> np.ndarray:
    """Integrate over strips by Gauss rules on the pieces from `_divide_strips`."""
    pieces = _divide_strips(strips, path_state, law)
    n_strips = len(strips.length)
    rule = _rules_of_pieces(pieces.steep_end, law.order)
    start = pieces.start[:, None]
    length = pieces.length[:, None]
    distance = start + length * rule.points
    sums = _sum_points(
        strips.select(pieces.strip), path_state, distance, length * rule.weights, law
    )
    weights = [np.bincount(pieces.strip, column, n_strips) for column in sums.T]
    return np.stack(weights, axis=1)


def _sum_points(strips: Strip, path_state: PathState, distance, weight, law: Bonds) -> np.ndarray:
    """Sum force and energy over the weighted points in each strip.

    distance: distance (n, points) [m] of the points from the end of their strip; weight (n, points) [m].
    """
    at_end = (path_state.displacement - strips.end.displacement)[:, None]
    stretch = at_end + distance * strips.direction[:, None]
    size = np.abs(stretch)
    if law.reading == "stretch":
        eps = strips.bond_length[:, None]
        x = size / eps
        damage = path_state.damage - strips.end.damage[:, None] + distance / eps
    else:
        path = path_state.path - strips.end.path[:, None] + distance
        x = path / _bond_lengths(strips, path_state, distance, law)
        damage = x
    with np.errstate(under="ignore"):
        force = weight / law.length * _weight_function(law, x, damage)
    energy = (size * force).sum(axis=1) / _work_to_energy_ratio(law)
    return np.column_stack([(np.sign(stretch) * force).sum(axis=1), energy])


def _bond_lengths(strips: Strip, path_state: PathState, distance, law: Bonds):
    """Return the bond lengths (n, points) [m] for friction.reading = "report", which grow from zero (eq. 2.10)."""
    if not law.has_growth:
        return law.length
    fraction = distance / strips.length[:, None]
    growth = strips.growth[:, None]
    age = path_state.growth - strips.end.growth[:, None] + fraction * growth
    later_growth = (1 - grown_fraction(growth, fraction)) * strips.mature_gain[:, None]
    mature_at_start = strips.end.mature_length[:, None] - later_growth
    return np.maximum(path_state.mature_length - mature_at_start * np.exp(-age), MIN_POSITIVE)


def _divide_strips(strips: Strip, path_state: PathState, law: Bonds) -> _IntegrationPieces:
    """Divide strips into pieces on which a Gauss rule is accurate, by the rules of the module."""
    along = _stretch_along(strips, path_state)
    parts = _split_at_zero_stretch(strips, along)
    distances = _singularity_distances(strips, path_state, law, along, parts)
    eps = strips.bond_length[parts.strip]
    growth = _active_growth(strips, path_state, law, parts)
    # For reading="report" the integrand only changes sign at u = 0.
    is_steep = law.reading == "stretch"
    starts_steep = parts.is_zero_at_start & is_steep
    ends_steep = parts.is_zero_at_end & is_steep
    count = np.maximum(
        parts.length / (MAX_PIECE_LENGTH * eps), np.minimum(growth, MAX_GROWTH_PIECES)
    )
    count = np.maximum(1, np.ceil(count)).astype(int)
    is_near_singular = distances.nearest < parts.length / count

    even = np.flatnonzero(~is_near_singular)
    part = np.repeat(even, count[even])
    number = np.arange(part.size) - np.repeat(np.cumsum(count[even]) - count[even], count[even])
    length = parts.length[part] / count[part]
    steep_end = np.where(ends_steep[part] & (number == count[part] - 1), -1, 0)
    steep_end = np.where(starts_steep[part] & (number == 0), 1, steep_end)
    columns = [[part], [parts.start[part] + number * length], [length], [steep_end]]
    for k in np.flatnonzero(is_near_singular):
        strip = parts.strip[k]
        origin = distances.origin[k]
        singular_points = []
        if not (parts.is_zero_at_start[k] or parts.is_zero_at_end[k]):
            singular_points.append(-along[strip] - parts.start[k])
        if np.isfinite(origin):
            singular_points.append(-origin - parts.start[k])
        cuts = _subdivide_near_singularities(
            parts.length[k], MAX_PIECE_LENGTH * eps[k], singular_points
        )
        steep = np.zeros(cuts.size - 1, int)
        if starts_steep[k] or origin + parts.start[k] == 0:
            steep[0] = 1
        elif ends_steep[k]:
            steep[-1] = -1
        new = (np.full(steep.size, k), parts.start[k] + cuts[:-1], np.diff(cuts), steep)
        for column, values in zip(columns, new):
            column.append(values)
    part, start, length, steep_end = (np.concatenate(column) for column in columns)
    return _IntegrationPieces(parts.strip[part], start, length, steep_end)


def _split_at_zero_stretch(strips: Strip, along) -> _StripParts:
    """Split strips of bonds at the position where the stretch is zero; along: stretch (k,) [m] at their ends."""
    cut = np.clip(-along, 0.0, strips.length)
    strip = np.tile(np.arange(cut.size), 2)
    start = np.concatenate([np.zeros_like(cut), cut])
    length = np.concatenate([cut, strips.length - cut])
    has_length = length > 0
    strip = strip[has_length]
    start = start[has_length]
    length = length[has_length]
    # The cut of these strips is at u = 0; it may also be an end of the strip.
    has_zero = np.abs(cut + along) <= REVERSAL_TOL * strips.length
    return _StripParts(
        strip,
        start,
        length,
        has_zero[strip] & (start == cut[strip]),
        has_zero[strip] & (start + length == cut[strip]),
    )


def _active_growth(
    strips: Strip, path_state: PathState, law: Bonds, parts: _StripParts
) -> np.ndarray:
    """Return the growth J (n,) in parts of strips, excluding the growth of fully grown bonds."""
    if law.reading != "report":
        return np.zeros(parts.strip.size)
    remaining = FULL_GROWTH - (path_state.growth - strips.end.growth[parts.strip])
    growth = strips.growth[parts.strip] * parts.length / strips.length[parts.strip]
    return np.minimum(growth, np.maximum(remaining, 0.0))


def _singularity_distances(
    strips: Strip,
    path_state: PathState,
    law: Bonds,
    along,
    parts: _StripParts,
) -> _SingularityDistances:
    """Return the distances from parts of strips to points where the integrand is not smooth.

    The point u = 0 at an end of a part does not count.
    """
    is_fractional = law.order != int(law.order)
    along = along[parts.strip]
    gap = np.maximum(np.maximum(-along - parts.start - parts.length, parts.start + along), 0.0)
    is_smooth = parts.is_zero_at_start | parts.is_zero_at_end
    is_smooth |= law.reading == "report" or not is_fractional
    nearest = np.where(is_smooth, np.inf, gap)
    origin = np.full(parts.strip.size, np.inf)
    if law.reading == "report" and is_fractional:
        origin = path_state.path - strips.end.path[parts.strip]
    return _SingularityDistances(np.minimum(nearest, origin + parts.start), origin)


@cache
def _legendre_rule() -> _GaussRule:
    """Return the Gauss-Legendre rule on (0, 1)."""
    x, weights = np.polynomial.legendre.leggauss(N_GAUSS_POINTS)
    return _GaussRule((1 + x) / 2, weights / 2)


@cache
def _jacobi_rule(order: float) -> _GaussRule:
    """Return the Gauss-Jacobi rule on (0, 1) for the weight t^order, with weights divided by t^order."""
    x, weights = roots_jacobi(N_GAUSS_POINTS, 0.0, order)
    t = (1 + x) / 2
    return _GaussRule(t, weights / (2 ** (order + 1) * t**order))


def _rules_of_pieces(steep_end, order: float) -> _GaussRule:
    """Return the Gauss rules for the pieces into which strips are divided."""
    legendre = _legendre_rule()
    jacobi = _jacobi_rule(order)
    steep_end = steep_end[:, None]
    points = np.where(steep_end == -1, 1 - jacobi.points, legendre.points)
    points = np.where(steep_end == 1, jacobi.points, points)
    return _GaussRule(points, np.where(steep_end != 0, jacobi.weights, legendre.weights))


def _subdivide_near_singularities(
    length: float, max_length: float, singular_points: list[float]
) -> np.ndarray:
    """Divide [0, length] into pieces that are not longer than their distance from any singular point.

    No piece is longer than `max_length`. Returns the ends (k,) of the pieces in increasing order.
    """
    inside = [point for point in singular_points if 0 < point < length]
    intervals = list(pairwise(sorted({0.0, length, *inside})))[::-1]
    cuts = [0.0]
    while intervals:
        low, high = intervals.pop()
        gaps = (max(low - point, point - high, 0.0) for point in singular_points)
        if high - low > max(
            min(max_length, min(gaps, default=np.inf)), MIN_PIECE_FRACTION * length
        ):
            middle = (low + high) / 2
            intervals += [(middle, high), (low, middle)]
        else:
            cuts.append(high)
    return np.array(cuts)
