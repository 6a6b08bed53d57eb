"""Force and stored energy of straight strips of bonds (eq. 2.17), on a line or in a plane.

Along a strip the stretch is u = a + y e, y behind its end, and R = near + y. Strips are integrated

* stretch, p = 1: in closed form, any bond length history;
* report, constant bond length, u along the strip: in closed form, any p > -1, by the incomplete gamma function;
* otherwise: by eight Gauss points on pieces of at most a quarter bond length, none across a turn (u = 0) and none
  longer than its distance from where the integrand is not smooth; where it is steep at an end of a piece, as |u|^p or
  R^p, with that power as their weight; by three points on strips ten times shorter than that distance and than a bond
  length.

Not smooth are: |u|^p for a fractional p (reading="stretch"); the direction u/|u| off the line of the strip; and R^p for
a fractional p, whether the bonds grow or not (reading="report").
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.special import gammainc, gammaln, roots_jacobi

from .parameters import Bonds, grown_fraction

_THREE, _EIGHT = (np.polynomial.legendre.leggauss(count) for count in (3, 8))
PIECE = 0.25  # longest Gauss piece in bond lengths
SLIGHT = 0.1  # relative length and growth J of a strip below which three Gauss points are accurate enough
MOST_GROWN = 16  # largest number of pieces of a strip due to growth, one per e-fold
FULL_GROWN = 36.0  # growth J after which the starting length of a bond no longer matters
AT_PLACE = 1e-14  # displacement from a cohort / path since it formed; below it, the displacement counts as zero
COLUMNS = ("q", "path", "damage", "growth", "mature", "way", "length", "eps")


@dataclass(frozen=True, eq=False, slots=True)
class Strips:
    """Bonds along a path of d = 1 or 2 components, in k straight strips.

    - q (k, d): relative displacement at the end of a strip [m]
    - path, damage, growth, mature (k,): path [m], damage, growth J and mature length eps_p [m] at this end
    - way (k, d), length (k,): direction and length [m] of a strip
    - eps (k,): length scale of the bonds when they formed [m]
    - gain (2, k): growth J and mature length [m] gained while the strip formed
    - sigma (k, m): pressure at which the bonds formed [Pa]

    An entry of length 0 is a cohort: unstressed, full-grown bonds at q, of density sigma. The first one is that of the
    initial bonds, of density m_0 sigma.
    """

    q: np.ndarray
    path: np.ndarray
    damage: np.ndarray
    growth: np.ndarray
    mature: np.ndarray
    way: np.ndarray
    length: np.ndarray
    eps: np.ndarray
    gain: np.ndarray
    sigma: np.ndarray
    now: tuple  # present q (d,), path, damage, growth and mature length
    alive: np.ndarray  # index (m,) of the first strip that still acts at each point
    dropped: int = 0
    play: float = 0.0  # play of the play operator in `parameters.split_elastic`


def surviving_density(state: Strips) -> np.ndarray:
    """Return the surviving density (k,) / pressure at formation, for reading="stretch".

    A cohort keeps exp(-damage since it formed), a strip that times 1 - exp(-length/eps).
    """
    left = np.exp(-(state.now[2] - state.damage))
    return np.where(state.length == 0, left, left * -np.expm1(-state.length / state.eps))


def strip_weights(state: Strips, law: Bonds) -> np.ndarray:
    """Return force and stored energy of each entry per mu_s sigma (eq. 2.17), (k, d + 1).

    Columns: signed force [1] along each of the d directions, then stored energy [m]. It chooses the closed forms and
    the Gauss points that the head of the file lists.
    """
    out = np.empty((len(state.q), state.q.shape[1] + 1))
    cohorts = state.length == 0
    out[cohorts] = _cohorts(state, cohorts, law)
    rest = np.flatnonzero(~cohorts)
    if law.order == 1 and law.reading == "stretch":
        out[rest] = _stretch(state, rest, law)
        return out
    if law.reading == "report" and not law.has_growth:
        straight = _seen(state, rest)[1] == 0
        out[rest[straight]] = _sum_report_strips(state, rest[straight], law)
        rest = rest[~straight]
    if rest.size:
        out[rest] = _gauss(state, rest, law)
    return out


def _size(u) -> np.ndarray:
    """Return the lengths (...) of vectors (..., d)."""
    return np.abs(u[..., 0]) if u.shape[-1] == 1 else np.sqrt((u * u).sum(axis=-1))


def _seen(state: Strips, rest) -> tuple:
    """Return u along the strip at its end, and the distance of u = 0 from its line, (k,) [m]."""
    a = state.now[0] - state.q[rest]
    along = (a * state.way[rest]).sum(axis=1)
    return along, _size(a - state.way[rest] * along[:, None])


def _cohorts(state: Strips, which, law: Bonds) -> np.ndarray:
    """Return force and energy of cohorts: (|u|/eps)^p exp(-damage) or phi_p(R/eps_0), against u."""
    u, damage = state.now[0] - state.q[which], state.now[2] - state.damage[which]
    x, far = (state.now[1] - state.path[which]) / law.length, _size(u)
    stretched = law.reading == "stretch"
    size, harm = (far / law.length, damage) if stretched else (x, x)
    # at a jump, the mean of both sides is taken
    at_place = far <= AT_PLACE * (state.now[1] - state.path[which])
    force = np.where(
        at_place,
        0.0,
        np.exp(law.order * np.log(np.maximum(size, 1e-300)) - harm - gammaln(law.order + 1)),
    )
    unit = u / np.where(far > 0, far, 1.0)[:, None]
    return np.column_stack(
        [force[:, None] * unit, force * far / (law.order + 1 if stretched else 1.0)]
    )


def _stretch(state: Strips, rest, law: Bonds) -> np.ndarray:
    """Sum k u dL/eps and k |u|^2 dL/2 eps over a strip, over eps_0, in closed form (p = 1)."""
    a, e, eps = state.now[0] - state.q[rest], state.way[rest], state.eps[rest]
    x = state.length[rest] / eps
    d = np.exp(-x)
    zero, one, two = -np.expm1(-x), 1 - d * (1 + x), 2 - d * (x * x + 2 * x + 2)
    left = np.exp(-(state.now[2] - state.damage[rest]))
    along = (a * e).sum(axis=1)
    first = left[:, None] * (a * zero[:, None] + e * (eps * one)[:, None])
    second = left * ((a * a).sum(axis=1) * zero + 2 * along * eps * one + eps**2 * two)
    return np.column_stack([first / law.length, second / (2 * law.length)])


def _sum_report_strips(state: Strips, rest, law: Bonds) -> np.ndarray:
    """Sum strips of reading="report" with u along them at constant eps, exactly.

    The sums are differences of P(p + 1, R/eps) and P(p + 2, R/eps), split where u changes sign.
    """
    u, h = _seen(state, rest)[0], state.length[rest]
    near = state.now[1] - state.path[rest]
    turn = np.clip(-u, 0.0, h)
    ends = [np.maximum(near + y, 0) / law.length for y in (0.0, turn, h)]
    share = [gammainc(law.order + 1, x) for x in ends]
    reach = [law.length * (law.order + 1) * gammainc(law.order + 2, x) for x in ends]
    signed = share[0] - share[1] + (share[2] - share[1])  # integral of sgn(u) dL over both parts
    arm = reach[0] - reach[1] + (reach[2] - reach[1])
    return np.column_stack([state.way[rest] * signed[:, None], (u - near) * signed + arm])


def _gauss(state: Strips, rest, law: Bonds) -> np.ndarray:
    """Integrate over strips by Gauss points on pieces."""
    owner, begin, size, bent, slight = _pieces(state, rest, law)
    out = np.zeros((len(rest), state.q.shape[1] + 1))
    for few, (points, weight) in ((False, _EIGHT), (True, _THREE)):
        which = slight == few
        share, w = np.broadcast_to((1 + points) / 2, (which.sum(), len(points))), weight / 2
        if not few:
            share, w = _gauss_points_of_pieces(bent[which], law.order)
        found = _points(
            state,
            rest[owner[which]],
            begin[which, None] + size[which, None] * share,
            size[which, None] * w,
            law,
        )
        for c in range(out.shape[1]):
            out[:, c] += np.bincount(owner[which], found[:, c], len(rest))
    return out


def _points(state: Strips, at, back, weight, law: Bonds) -> np.ndarray:
    """Sum over points `back` (n, points) [m] behind the ends of strips `at` (n,); (n, d + 1)."""
    u = (state.now[0] - state.q[at])[:, None] + back[..., None] * state.way[at][:, None]
    far, stretched = _size(u), law.reading == "stretch"
    if stretched:
        x = far / state.eps[at][:, None]
        harm = state.now[2] - state.damage[at][:, None] + back / state.eps[at][:, None]
    else:
        x = harm = (state.now[1] - state.path[at][:, None] + back) / _own(state, at, back, law)
    with np.errstate(under="ignore"):
        f = (
            weight
            / law.length
            * np.exp(law.order * np.log(np.maximum(x, 1e-300)) - harm - gammaln(law.order + 1))
        )
    unit = u / np.maximum(far, 1e-300)[..., None]
    return np.column_stack(
        [
            (unit * f[..., None]).sum(axis=1),
            (far * f).sum(axis=1) / (law.order + 1 if stretched else 1.0),
        ]
    )


def _own(state: Strips, at, back, law: Bonds):
    """Return the bond lengths (n, points) for reading="report": constant, or grown from zero."""
    if not law.has_growth:
        return law.length
    part, (won, grown) = back / state.length[at][:, None], state.gain[:, at][..., None]
    age = state.now[3] - state.growth[at][:, None] + part * won
    born = state.mature[at][:, None] - (1 - grown_fraction(won, part)) * grown
    return np.maximum(state.now[4] - born * np.exp(-age), 1e-300)


def _pieces(state: Strips, rest, law: Bonds) -> tuple:
    """Divide the strips `rest` into pieces for the Gauss rule.

    Returns arrays (n,): index in `rest`, start [m] behind the end of the strip, length [m], end at which the integrand is
    steep as the power p of the distance (1 start, -1 far end, 0 neither), and whether three Gauss points suffice.
    """
    before, aside = _seen(state, rest)
    h, eps, straight = state.length[rest], state.eps[rest], aside == 0
    turn = np.where(straight, np.clip(-before, 0.0, h), 0.0)
    owner = np.tile(np.arange(len(rest)), 2)
    start, wide = np.concatenate([np.zeros_like(h), turn]), np.concatenate([turn, h - turn])
    owner, start, wide = owner[wide > 0], start[wide > 0], wide[wide > 0]
    # u = 0 lies at this cut, which may also be an end of the strip
    turns = straight & (np.abs(turn + before) <= 1e-9 * h)
    first = turns[owner] & (start == turn[owner])
    last = turns[owner] & (start + wide == turn[owner])
    turned = first | last
    away, near = _distances(
        state, rest[owner], law, (before[owner], aside[owner]), start, wide, turned
    )
    if law.reading == "report":  # at u = 0 the integrand only changes its sign
        first, last = first & False, last & False
    grown = np.zeros(owner.size)
    if law.reading == "report":
        left = FULL_GROWN - (state.now[3] - state.growth[rest][owner])
        grown = np.minimum(state.gain[0, rest][owner] * wide / h[owner], np.maximum(left, 0.0))
    slight = (wide <= SLIGHT * np.minimum(away, eps[owner])) & (grown <= SLIGHT) & ~first & ~last
    most = np.maximum(wide / (PIECE * eps[owner]), np.minimum(grown, MOST_GROWN))
    count = np.where(slight, 1, np.maximum(1, np.ceil(most))).astype(int)
    odd = (away < wide / count) & ~slight
    even = np.flatnonzero(~odd)
    part = np.repeat(even, count[even])
    number = np.arange(part.size) - np.repeat(np.cumsum(count[even]) - count[even], count[even])
    size = wide[part] / count[part]
    begin = start[part] + number * size
    bent = np.where(
        first[part] & (number == 0), 1, np.where(last[part] & (number == count[part] - 1), -1, 0)
    )
    for k in np.flatnonzero(odd):
        i = owner[k]
        poles = [complex(-before[i] - start[k], aside[i]), complex(-near[k] - start[k], 0.0)]
        poles = [pole for pole, smooth in zip(poles, (turned[k], np.isinf(near[k]))) if not smooth]
        cuts = start[k] + _graded(wide[k], PIECE * eps[i], poles)
        ends = np.zeros(cuts.size - 1, int)
        if first[k] or near[k] + start[k] == 0:
            ends[0] = 1
        elif last[k]:
            ends[-1] = -1
        part, begin, size = (
            np.append(part, np.full(ends.size, k)),
            np.append(begin, cuts[:-1]),
            np.append(size, np.diff(cuts)),
        )
        bent = np.append(bent, ends)
    return owner[part], begin, size, bent, slight[part]


def _distances(state: Strips, at, law: Bonds, seen: tuple, start, wide, touching) -> tuple:
    """Return distances (n,) [m] of parts of strips from points with a non-smooth integrand.

    The first is to the nearest point of any kind, the second is R at the end of the strip if R = 0 is such a point. Both
    are infinite if there is none. A reversal at an end of the part does not count.
    """
    (before, aside), fractional = seen, law.order != int(law.order)
    gap = np.maximum(np.maximum(-before - start - wide, start + before), 0.0)
    smooth = touching | ((aside == 0) & (law.reading == "report" or not fractional))
    away = np.where(smooth, np.inf, np.hypot(aside, gap))
    near = np.full(len(at), np.inf)
    if law.reading == "report" and fractional:
        near = state.now[1] - state.path[at]
    return np.minimum(away, near + start), near


@cache
def _weighted_points(order: float) -> tuple:
    """Return Gauss-Jacobi points (8,) in (0, 1) for the weight t^order, and weights / t^order."""
    x, w = roots_jacobi(8, 0.0, order)
    t = (1 + x) / 2
    return t, w / (2 ** (order + 1) * t**order)


def _gauss_points_of_pieces(bent, order: float) -> tuple:
    """Return Gauss points (n, 8) in (0, 1) and weights for pieces that may be steep at an end.

    There the integrand grows as a power of the distance from this end, which Gauss-Jacobi points take as their weight.
    """
    t, w = _weighted_points(order)
    bent = bent[:, None]
    share = np.where(bent == 1, t, np.where(bent == -1, 1 - t, (1 + _EIGHT[0]) / 2))
    return share, np.where(bent != 0, w, _EIGHT[1] / 2)


def _graded(h: float, most: float, poles) -> np.ndarray:
    """Cut [0, h] into pieces no longer than `most` or than their distance from the `poles`.

    The poles are complex. Returns the cuts (k,).
    """
    inner = [p.real for p in poles if 0 < p.real < h]
    least = 1e-15 * h
    todo = list(pairwise(sorted({0.0, h, *inner})))[::-1]
    cuts = [0.0]
    while todo:
        a, b = todo.pop()
        away = min(
            (abs(complex(max(a - p.real, p.real - b, 0.0), p.imag)) for p in poles), default=np.inf
        )
        if b - a > max(min(most, away), least):
            todo += [((a + b) / 2, b), (a, (a + b) / 2)]
        else:
            cuts.append(b)
    return np.array(cuts)
