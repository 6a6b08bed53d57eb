"""Compiled series of a linear motion over a short piece, its roots proved and found.

Over u = t/h in [0, 1] every coordinate is sum c_k u^k. With h at most REACH over the fastest rate of the system the
terms fall as REACH^k/k!, so a few dozen are exact to round-off, whatever the rates are: rigid, overdamped, coupled,
equal. All coefficients of the Bernstein form above zero prove that there is no root; one change of their sign proves
that there is exactly one (Descartes).
"""

from math import comb, factorial, sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .memory_kernels import RIGID

REACH = 2.0  # longest piece times the fastest rate
MOST = 28  # highest power of a series
EPS = 2.0**-52
NONE = 2.0  # a root beyond the piece
DEEP = 52  # halvings of a piece
WIDE = MOST + 5  # columns of the room for them; the last one tells a second half
# largest piece times rate for which powers up to k suffice: rate^k/k! of the last one below a quarter of EPS
_ROOM = np.array([0.0, 0.0] + [(EPS / 4 * factorial(k)) ** (1 / k) for k in range(2, MOST + 1)])
# of two integrations
TWICE = np.array([0.0, 0.0] + [1 / (k * (k - 1)) for k in range(2, MOST + 2)])
OVER = np.array([0.0] + [1 / k for k in range(1, MOST + 3)])  # of one integration
FEW = 9  # highest power of a first look
# Bernstein coefficient i of u^k at the degree d
_HULL = np.array(
    [
        [
            [comb(i, k) / comb(d, k) if k <= i <= d else 0.0 for i in range(MOST + 4)]
            for k in range(MOST + 1)
        ]
        for d in range(MOST + 1)
    ]
)
_NODES = 16
# largest piece times rate for which g Gauss points integrate a square of the motion to 1e-13
_GAUSS = np.array(
    [0.0]
    + [
        0.5 * (1e-13 * (2 * g + 1) * factorial(2 * g) ** 3 / factorial(g) ** 4) ** (1 / (2 * g))
        for g in range(1, _NODES + 1)
    ]
)
_PLACE, _WEIGHT = np.zeros((2, _NODES + 1, _NODES))
for _g in range(1, _NODES + 1):
    _x, _w = np.polynomial.legendre.leggauss(_g)
    _PLACE[_g, :_g] = (1 + _x) / 2
    _WEIGHT[_g, :_g] = _w / 2


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def powers(x):
    """Highest power that a piece of x times the fastest rate needs."""
    k = 4
    while k < MOST and _ROOM[k] < x:
        k += 1
    return k


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def points(x):
    """Gauss points that integrate squares of the motion over a piece of x times the fastest rate."""
    g = 2
    while g < _NODES and _GAUSS[g] < x:
        g += 1
    return g


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def fastest(modal_system, springs):
    """Bound [1/s] of the rates of the modes with springs (i,) [N/m] between the interfaces; those that hold a
    slide only take motions away."""
    square = modal_system.square_most
    for f in range(len(modal_system.reach)):
        if springs[f] < RIGID:
            square += springs[f] * modal_system.reach[f]
    return 0.5 * modal_system.damping_most + sqrt(0.25 * modal_system.damping_most**2 + square)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def single_series(place, rate, force, spring, modal_system, wave, h, top, coefs):
    """`motion_series` of one mode with one interface, three times as fast."""
    face = modal_system.faces[0, 0] / modal_system.mass
    squared = h * h
    base = modal_system.base[0]
    stiff = squared * (modal_system.square[0] + spring * modal_system.reach[0])
    damp = h * modal_system.damping[0, 0]
    here = place[0]
    after = h * rate[0]
    coefs[0, 0] = here
    coefs[1, 0] = after
    here, after = (
        after,
        -0.5
        * (
            squared * (modal_system.square[0] * here + base * wave[0] + face * force) + damp * after
        ),
    )
    coefs[2, 0] = after
    for k in range(1, top - 1):
        here, after = (
            after,
            -TWICE[k + 2] * (stiff * here + squared * base * wave[k] + damp * (k + 1) * after),
        )
        coefs[k + 2, 0] = after


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def double_series(place, rate, force, spring, modal_system, wave, h, top, coefs):
    """`motion_series` of two modes with one interface and dampers of their own, all in registers."""
    squared = h * h
    face_1 = modal_system.faces[0, 0]
    face_2 = modal_system.faces[0, 1]
    base_1 = modal_system.base[0]
    base_2 = modal_system.base[1]
    # no constant: of one mode, where nothing comes here, it would not compile
    second = len(modal_system.square) - 1
    stiff_1 = squared * modal_system.square[0]
    stiff_2 = squared * modal_system.square[second]
    stiff = squared * spring / modal_system.mass
    damp_1 = h * modal_system.damping[0, 0]
    damp_2 = h * modal_system.damping[1, 1]
    pull = squared * force / modal_system.mass
    here_1 = place[0]
    here_2 = place[1]
    after_1 = h * rate[0]
    after_2 = h * rate[1]
    coefs[0, 0] = here_1
    coefs[0, 1] = here_2
    coefs[1, 0] = after_1
    coefs[1, 1] = after_2
    for k in range(top - 1):
        push = squared * wave[k]
        count = k + 1
        new_1 = -TWICE[k + 2] * (
            stiff_1 * here_1 + base_1 * push + face_1 * pull + damp_1 * count * after_1
        )
        new_2 = -TWICE[k + 2] * (
            stiff_2 * here_2 + base_2 * push + face_2 * pull + damp_2 * count * after_2
        )
        pull = stiff * (face_1 * after_1 + face_2 * after_2)
        here_1 = after_1
        here_2 = after_2
        after_1 = new_1
        after_2 = new_2
        coefs[k + 2, 0] = new_1
        coefs[k + 2, 1] = new_2


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def still_series(place, force, modal_system, wave, top, coefs, workspace):
    """`motion_series` where what is held lets nothing move: the reactions alone."""
    n = len(modal_system.square)
    for k in range(top + 1):
        for i in range(n):
            coefs[k, i] = place[i] if k == 0 else 0.0
    for f in range(len(modal_system.reach)):
        level = 0.0
        share = 0.0
        for i in range(n):
            part = modal_system.square[i] * place[i]
            for g in range(len(modal_system.reach)):
                if workspace.springs[g] < RIGID:
                    part += modal_system.faces[g, i] * force[g] / modal_system.mass
            level -= workspace.react[f, i] * part
            share -= workspace.react[f, i] * modal_system.base[i]
        for k in range(top - 1):
            workspace.reactions[f, k] = modal_system.mass * share * wave[k]
        workspace.reactions[f, 0] += modal_system.mass * level


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def constrained(k, scale, modal_system, coefs, workspace):
    """Take from the coefficients k + 2 what moves a slide that is held, and note the reaction [N] that does:
    a - slide^T r/mass with r = mass (slide slide^T)^+ slide a."""
    for f in range(len(modal_system.reach)):
        part = 0.0
        for i in range(len(modal_system.square)):
            part += workspace.react[f, i] * coefs[k + 2, i]
        workspace.reactions[f, k] = part
    for f in range(len(modal_system.reach)):
        for i in range(len(modal_system.square)):
            coefs[k + 2, i] -= modal_system.faces[f, i] * workspace.reactions[f, k]
        workspace.reactions[f, k] *= modal_system.mass / scale


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def motion_series(place, rate, force, springs, modal_system, wave, h, top, coefs, workspace):
    """Fill coefs (>= top + 1, n) with the series of z'' = -D z' - w^2 z - base a - slide^T (force + springs
    slide)/mass; slides of infinite springs are held, and workspace.reactions (i, >= top - 1) are the forces [N] that do it.

    place, rate (n,): coordinates [m] and rates [m/s] at first; force (i,) [N] there; springs (i,) [N/m]; wave: series
    of a; workspace: with react and held as `stick_kernels.constrain` leaves them.
    """
    n = len(modal_system.square)
    faces = modal_system.faces
    squared = h * h
    pull = workspace.pull
    held = workspace.held[0] > 0.0
    if workspace.held[1] == 1.0:
        still_series(place, force, modal_system, wave, top, coefs, workspace)
        return
    if n == 1 and len(modal_system.reach) == 1:
        single_series(place, rate, force[0], springs[0], modal_system, wave, h, top, coefs)
        return
    if n == 2 and len(modal_system.reach) == 1 and not modal_system.coupled and not held:
        double_series(place, rate, force[0], springs[0], modal_system, wave, h, top, coefs)
        return
    for i in range(n):
        coefs[0, i] = place[i]
        coefs[1, i] = h * rate[i]
    for f in range(len(modal_system.reach)):
        pull[f] = force[f] / modal_system.mass if springs[f] < RIGID else 0.0
    for k in range(top - 1):
        scale = TWICE[k + 2] * squared
        damp = TWICE[k + 2] * h * (k + 1)
        if k > 0:
            for f in range(len(modal_system.reach)):
                part = 0.0
                for i in range(n):
                    part += faces[f, i] * coefs[k, i]
                pull[f] = part * springs[f] / modal_system.mass if springs[f] < RIGID else 0.0
        for i in range(n):
            part = -modal_system.square[i] * coefs[k, i] - modal_system.base[i] * wave[k]
            for f in range(len(modal_system.reach)):
                part -= faces[f, i] * pull[f]
            lost = 0.0
            if modal_system.coupled:
                for j in range(n):
                    lost += modal_system.damping[i, j] * coefs[k + 1, j]
            else:
                lost = modal_system.damping[i, i] * coefs[k + 1, i]
            coefs[k + 2, i] = scale * part - damp * lost
        if held:
            constrained(k, scale, modal_system, coefs, workspace)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def value(poly, low, top, u):
    """Sum of poly[k] u^(k - low) for k from low to top."""
    # two chains of half the length
    square = u * u
    even = poly[top]
    odd = 0.0
    k = top - 1
    while k > low:
        odd = odd * square + poly[k]
        even = even * square + poly[k - 1]
        k -= 2
    return even + u * odd if k < low else even * u + odd * square + poly[low]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def value_and_slope(poly, low, top, u):
    """The sum of `value` and its derivative over u."""
    square = u * u
    k = top - 1
    # slopes over u^2
    even = poly[top]
    odd = 0.0
    even_slope = 0.0
    odd_slope = 0.0
    while k > low:
        odd_slope = odd_slope * square + odd
        odd = odd * square + poly[k]
        even_slope = even_slope * square + even
        even = even * square + poly[k - 1]
        k -= 2
    if k < low:
        return even + u * odd, odd + 2 * u * (even_slope + u * odd_slope)
    odd_slope = odd_slope * square + odd
    odd = odd * square + poly[low]
    return odd + u * even, even + 2 * u * (odd_slope + u * even_slope)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def polish(poly, low, top, left, right, u):
    """The root in [left, right] of a polynomial that falls there from above zero to below, by guarded Newton from u."""
    last = right - left
    for _ in range(100):
        here, slope = value_and_slope(poly, low, top, u)
        if here > 0:
            left = u
        elif here < 0:
            right = u
        else:
            return u
        new = u - here / slope if slope < 0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
        step = abs(new - u)
        # steps shrink with their squares, so the next one would be step (step/last)^2
        if step <= 2 * EPS * u or (
            step < 0.01 * last and step * (step / last) ** 2 <= 0.1 * EPS * u
        ):
            return new
        u = new
        last = step
    return u


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bernstein(poly, low, top, hull):
    """Fill hull (top - low + 1,) with the Bernstein coefficients of poly[low] ... poly[top] on [0, 1]."""
    # whole registers
    degree = top - low
    wide = (top - low) // 4 * 4 + 4
    for i in range(wide):
        hull[i] = poly[low]
    for k in range(1, degree + 1):
        part = poly[low + k]
        for i in range(wide):
            hull[i] += part * _HULL[degree, k, i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def first_look(poly, low, top, hull):
    """u near which the Bernstein coefficients of the first FEW + 1 terms, in hull, come down to what all others can
    add; NONE where they stay above it, so that there is no root."""
    rest = 0.0
    wide = FEW // 4 * 4 + 4
    for k in range(low + FEW + 1, top + 1):
        rest += abs(poly[k])
    for i in range(wide):
        hull[i] = poly[low]
    for k in range(1, FEW + 1):
        part = poly[low + k]
        for i in range(wide):
            hull[i] += part * _HULL[FEW, k, i]
    for i in range(FEW + 1):
        if hull[i] <= rest:
            return (
                i - hull[i] / (hull[i] - hull[i - 1]) if 0 < i and hull[i] < hull[i - 1] else i
            ) / FEW
    return NONE


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def lone_root(poly, low, top, u, workspace):
    """The root that Newton's method finds from u, in (0, 1], where it is proved to be the first one; NONE where not.

    p(r s) with p(r) = 0 is (1 - s) q(s), where the coefficients of q are sums of the last ones of p(r s): as long as q
    has no root in [0, 1], p has none before r. workspace: two rows.
    """
    last = 1.0
    for _ in range(9):
        here, slope = value_and_slope(poly, low, top, u)
        if not slope < 0.0:
            return NONE
        step = here / slope
        u -= step
        step = abs(step)
        if not 0.0 < u <= 1.0:
            return NONE
        # as `polish`
        done = step <= 2 * EPS * u or (
            step < 0.01 * last and step * (step / last) ** 2 <= 0.1 * EPS * u
        )
        last = step
        if done:
            power = 1.0
            rows = workspace[0]
            total = 0.0
            for k in range(low, top + 1):
                rows[k - low] = power * poly[k]
                power *= u
            for k in range(top - low, 0, -1):
                total -= rows[k]
                rows[k] = total
            for k in range(top - low):
                rows[k] = rows[k + 1]
            return u if first_look(rows, 0, top - low - 1, workspace[1]) == NONE else NONE
    return NONE


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def first_root(poly, low, top, hulls):
    """First u in (0, 1] at which sum poly[k] u^(k - low), positive just after 0, is no longer so; NONE if none.

    A dip of round-off below zero is passed over. hulls: workspace (DEEP + 2, WIDE).
    """
    # as they are: the compiler then knows that no index is negative
    rest = 0.0
    low = low & 31
    top = top & 31
    for k in range(low + 1, top + 1):
        rest += abs(poly[k])
    if poly[low] > rest:
        return NONE
    if top - low > FEW + 2:
        u = first_look(poly, low, top, hulls[0])
        if u < NONE:
            u = lone_root(poly, low, top, u, hulls)
        else:
            return NONE
        if u < NONE:
            return u
    noise = 4 * EPS * (rest + abs(poly[low]))
    degree = top - low
    bernstein(poly, low, top, hulls[0])
    left = 0.0
    width = 1.0
    depth = 0
    while True:
        hull = hulls[depth]
        least = 0.0
        changes = 0
        at = 0
        for k in range(degree + 1):
            least = min(least, hull[k])
            if k > 0 and (hull[k] < 0) != (hull[k - 1] < 0):
                changes += 1
                at = k
        # free of roots: on with the part to the right, which an outer halving left
        if least >= -noise:
            left += width
            depth, width = _to_the_right(hulls, depth, width, degree)
            if depth == 0:
                return NONE
            continue
        if hull[0] > 0 and changes == 1:
            share = (at - 1 + hull[at - 1] / (hull[at - 1] - hull[at])) / degree
            return polish(poly, low, top, left, left + width, left + width * share)
        if depth == DEEP:
            return left
        _halve(hull, hulls[depth + 1], degree, True)
        depth = depth + 1
        width = width / 2
        hulls[depth, WIDE - 1] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _halve(hull, half, degree, first):
    """Bernstein coefficients of the first or the second half of an interval (de Casteljau)."""
    for k in range(degree + 1):
        half[k] = hull[k]
    if first:
        for j in range(1, degree + 1):
            for k in range(degree, j - 1, -1):
                half[k] = 0.5 * (half[k] + half[k - 1])
    else:
        for j in range(1, degree + 1):
            for k in range(degree - j + 1):
                half[k] = 0.5 * (half[k] + half[k + 1])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _to_the_right(hulls, depth, width, degree):
    """Go on with the part to the right that an outer halving left: its depth and width; depth 0 where none is left."""
    while depth > 0 and hulls[depth, WIDE - 1] == 1.0:
        depth -= 1
        width *= 2
    if depth > 0:
        _halve(hulls[depth - 1], hulls[depth], degree, False)
        hulls[depth, WIDE - 1] = 1.0
    return depth, width


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def largest(poly, top, best, hulls):
    """The larger of `best` and max |sum poly[k] u^k| over [0, 1], to 1e-14 of it: halves whose hull cannot pass it are
    left out, and of one that turns once that turn is what counts."""
    best = max(best, abs(poly[0]), abs(value(poly, 0, top, 1.0)))
    bernstein(poly, 0, top, hulls[0])
    depth = 0
    left = 0.0
    width = 1.0
    rate = hulls[DEEP + 1]
    while True:
        hull = hulls[depth]
        most = abs(hulls[depth, 0])
        turns = 0
        at = 0
        for k in range(1, top + 1):
            most = max(most, abs(hull[k]))
            if k > 1 and (hull[k] < hull[k - 1]) != (hull[k - 1] < hull[k - 2]):
                turns += 1
                at = k
        known = most <= best * (1 + 1e-14) or depth == DEEP
        if not known and turns < 2:  # Descartes: one turn at most; the ends have been looked at
            if turns == 1:
                sense = 1.0 if hull[1] > hull[0] else -1.0
                before = hull[at - 1] - hull[at - 2]
                after = hull[at] - hull[at - 1]
                for k in range(top):
                    rate[k] = sense * (k + 1) * poly[k + 1]
                share = (at - 2 + before / (before - after)) / (top - 1)
                u = polish(rate, 0, top - 1, left, left + width, left + width * share)
                best = max(best, abs(value(poly, 0, top, u)))
            known = True
        if known:
            left += width
            depth, width = _to_the_right(hulls, depth, width, top)
            if depth == 0:
                return best
            continue
        _halve(hull, hulls[depth + 1], top, True)
        depth = depth + 1
        width = width / 2
        hulls[depth, WIDE - 1] = 0.0
        best = max(best, abs(hulls[depth, top]))
