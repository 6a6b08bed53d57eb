"""Long steps of a motion that creeps: one mode whose force turns so fast with the speed that a series must follow it.

Where a force that is all of the speed holds a motion back, as tanh does below its reference speed, the speed comes back
to what it was at the rate lambda, the slope of the force over the mass. A series of order 16 is stable for steps of
some 6/lambda alone, however slowly the motion goes on. Here the speed is a polynomial of degree NODES in time that
meets the equation of motion at the nodes of Radau, the end of the step among them: stable for all lambda h. Newton's
method finds it. Source: Hairer and Wanner, Solving Ordinary Differential Equations II (1996), IV.5 and IV.8.
"""

from math import log

import numpy as np

from ...compiled.inner import njit
from ...compiled.series_kernels import sine
from ...friction.flags_kernels import INNER
from ...friction.laws import stretch_kernels as law
from . import lane_step as at
from .aim_kernels import (
    ALLOWED,
    BOUND,
    CAP,
    CHANGE,
    DAMP,
    F0,
    GAIN,
    LONGEST,
    N0,
    N1,
    N2,
    PACE,
    PHASE,
    PUSH,
    SHORTER,
    SLIDE,
    STEADY,
    STIFF,
    STRIDE,
    UNIT,
    UNTIL,
    V1,
    H,
    T,
    V,
    Z,
)

NODES = 8  # of a step besides its start: more would cost digits in powers of time
STABLE = 2.5  # lambda h of a step of the series from which it is not the motion that bounds it
WORTH = 6.0  # steps of the series in place of which a long one is tried
FINEST = 5e-12  # tolerance of a step below which powers of time have too few digits
TURNS = 8  # of Newton's method
SOLVED = 0.01  # of the bound: what its last turn may change
NEARLY = 0.95  # of the limit, up to which the force that holds a motion at rest tells its speed beforehand
WIDE = 3.0  # bounds that the last term of a step may be: what it errs by at its end is far less
CALM = 30.0  # bounds of the error of a step: what may still die out
LESS, MORE, AGAIN = 0.25, 3.0, 1.25  # of the length: of a step that failed, of the next at most, while none is tried


def _matrices() -> tuple:
    """(places, slopes there, integrals to there, powers, last), of values at 0 and at the NODES of Radau in 0..1.

    powers: coefficients of the polynomial through the values over the share of the step; last: that of its Legendre
    polynomial of degree NODES.
    """
    legendre = np.polynomial.legendre
    ends = np.zeros(NODES + 1)
    ends[-2:] = -1.0, 1.0
    places = np.append(0.0, (1 + np.sort(legendre.legroots(ends).real)) / 2)
    places[-1] = 1.0
    values = legendre.legvander(2 * places - 1, NODES)
    inverse, unit = np.linalg.inv(values), np.eye(NODES + 1)
    slopes = np.stack([2 * legendre.legval(2 * places[1:] - 1, legendre.legder(one)) for one in unit], axis=1)
    areas = np.stack([legendre.legval(2 * places[1:] - 1, legendre.legint(one, lbnd=-1)) / 2 for one in unit], axis=1)
    shifted = [legendre.Legendre(one, domain=[0, 1]).convert(kind=np.polynomial.Polynomial).coef for one in unit]
    powers = np.stack([np.pad(one, (0, NODES + 1 - one.size)) for one in shifted], axis=1)
    return places, slopes @ inverse, areas @ inverse, powers @ inverse, inverse[-1]


PLACES, SLOPES, AREAS, POWERS, LAST = _matrices()
# of the values at the nodes alone, a row for each, so that a loop over the nodes is one of vectors
OF_SLOPES, OF_AREAS = (np.ascontiguousarray(one[:, 1:].T) for one in (SLOPES, AREAS))
FROM_START, WAY_THERE = SLOPES[:, 0].copy(), AREAS[:, 0].copy()
SPEED, FORCE, PULL, WRONG, STEEP = range(5)  # rows of room: at the nodes
MATRIX = 5  # rows from here on: of Newton's equations
ROOM = MATRIX + NODES


@njit(error_model="numpy", **INNER)
def slope_of(w):
    """Slope of the law's `share` w."""
    return law.GROWS[0] + w * (law.GROWS[1] + w * law.GROWS[2])


@njit(error_model="numpy", **INNER)
def rate_of(rows, lane):
    """Rate lambda [1/s] at which the speed of a motion in a lane comes back to where the force holds it."""
    w = (rows[F0 + lane] - rows[N1 + lane]) / rows[N2 + lane]
    return rows[GAIN + lane] * rows[N2 + lane] * rows[N0 + lane] * rows[SLIDE + lane] * slope_of(w)


@njit(error_model="numpy", **INNER)
def held_by(rows, lane, pull, z):
    """Speed [m/s] at which the force would hold the pull [m s-2] at a coordinate [m], within NEARLY of its limit."""
    held = (pull - rows[STIFF + lane] * z - rows[GAIN + lane] * rows[N1 + lane]) / (rows[GAIN + lane] * rows[N2 + lane])
    held = min(max(held, -NEARLY), NEARLY)
    return 0.5 / (rows[N0 + lane] * rows[SLIDE + lane]) * log((1 + held) / (1 - held))


@njit(error_model="numpy", fastmath={"contract"}, **INNER)
def guessed(rows, lane, h, room):
    """Write the pull of the drive at the nodes of a step of h [s] into room, and the speeds at which force and pull
    would be in balance, moved to meet the speed at its start."""
    z, v, push, pace = rows[Z + lane], rows[V + lane], rows[PUSH + lane], rows[PACE + lane]
    turn = pace * rows[T + lane] + rows[PHASE + lane]
    for i in range(NODES):
        room[PULL, i] = -rows[STEADY + lane] - push * sine(turn + pace * h * PLACES[i + 1])
    first = v - held_by(rows, lane, -rows[STEADY + lane] - push * sine(turn), z)
    for i in range(NODES):
        room[SPEED, i] = first + held_by(rows, lane, room[PULL, i], z + h * PLACES[i + 1] * v)


@njit(error_model="numpy", fastmath={"contract"}, **INNER)
def shares(rows, lane, room):
    """Write the forces at the speeds of the nodes into room[FORCE], and their slopes [1/s] over the mass into
    room[STEEP]."""
    n0, n1, n2, gain, slide = (rows[N0 + lane], rows[N1 + lane], rows[N2 + lane], rows[GAIN + lane], rows[SLIDE + lane])
    for i in range(NODES):
        w = law.share(n0 * slide * room[SPEED, i])
        room[FORCE, i] = n1 + n2 * w
        room[STEEP, i] = gain * n2 * n0 * slide * slope_of(w)


@njit(error_model="numpy", fastmath={"contract"}, **INNER)
def residual(rows, lane, h, room):
    """Write what the equation of motion lacks at the nodes into room[WRONG], and Newton's matrix below."""
    stiff, damp, gain, over = rows[STIFF + lane], rows[DAMP + lane], rows[GAIN + lane], 1 / h
    v, z, turn = rows[V + lane], rows[Z + lane], stiff * h
    for i in range(NODES):
        room[WRONG, i] = (damp * room[SPEED, i] + stiff * z + gain * room[FORCE, i] - room[PULL, i]
                          + v * (FROM_START[i] * over + turn * WAY_THERE[i]))
    for j in range(NODES):
        speed = room[SPEED, j]
        for i in range(NODES):
            room[MATRIX + j, i] = OF_SLOPES[j, i] * over + turn * OF_AREAS[j, i]
        for i in range(NODES):
            room[WRONG, i] += speed * room[MATRIX + j, i]
        room[MATRIX + j, j] += damp + room[STEEP, j]


@njit(error_model="numpy", fastmath={"contract"}, **INNER)
def eliminated(room):
    """Solve Newton's equations in place: what is to be taken off the speeds stands in room[WRONG].

    Row j of the matrix is its column j: what is made zero there is what stands behind the diagonal in a row of room.
    """
    for k in range(NODES):
        over = 1 / room[MATRIX + k, k]
        for i in range(NODES):
            room[STEEP, i] = room[MATRIX + k, i] * over if i > k else 0.0
        part = room[WRONG, k]
        for i in range(NODES):
            room[WRONG, i] -= part * room[STEEP, i]
        for j in range(k + 1, NODES):
            part = room[MATRIX + j, k]
            for i in range(NODES):
                room[MATRIX + j, i] -= part * room[STEEP, i]
    for k in range(NODES - 1, -1, -1):
        part = room[WRONG, k] / room[MATRIX + k, k]
        for i in range(k):
            room[WRONG, i] -= part * room[MATRIX + k, i]
        room[WRONG, k] = part


@njit(error_model="numpy", **INNER)
def solved(rows, lane, h, room):
    """Find the speeds at the nodes of a step of h [s]: whether Newton's method does."""
    guessed(rows, lane, h, room)
    before = np.inf
    for _ in range(TURNS):
        shares(rows, lane, room)
        residual(rows, lane, h, room)
        eliminated(room)
        most = 0.0
        for i in range(NODES):
            room[SPEED, i] -= room[WRONG, i]
            most = max(most, abs(room[WRONG, i]))
        if not most < 2 * before:
            return False
        if most <= SOLVED * rows[BOUND + lane]:
            shares(rows, lane, room)
            return True
        before = most
    return False


@njit(error_model="numpy", **INNER)
def calm(rows, lane, rate):
    """Whether nothing of the speed dies out at `rate` [1/s] any more that the bound would see, by the eighth derivative
    of the series."""
    share = 1 / (rows[UNIT + lane] * rate)
    share *= share
    share *= share
    return 40320.0 * share * share * abs(rows[V1 + 7 * at.LANES + lane]) < CALM * rows[BOUND + lane]


@njit(error_model="numpy", **INNER)
def written(rows, lane, room):
    """Write the polynomials of speed and force through start and nodes where the series stood."""
    speed, force = rows[V + lane], rows[F0 + lane]
    for k in range(NODES + 1, at.ORDER):
        rows[V1 + at.LANES * (k - 1) + lane] = rows[F0 + at.LANES * k + lane] = 0.0
    rows[V1 + at.LANES * (at.ORDER - 1) + lane] = 0.0
    for k in range(1, NODES + 1):
        rise, more = 0.0, 0.0
        for i in range(NODES):
            rise += POWERS[k, i + 1] * (room[SPEED, i] - speed)
            more += POWERS[k, i + 1] * (room[FORCE, i] - force)
        rows[V1 + at.LANES * (k - 1) + lane], rows[F0 + at.LANES * k + lane] = rise, more


@njit(error_model="numpy", **INNER)
def crept(rows, own, lane, room):
    """Replace the series in a lane by the polynomial of a longer step, where the motion creeps: whether it does.

    The polynomial stands where the series stood, in shares of the step, which is `unit` now. own[STRIDE]: the length to
    try [s].
    """
    change, rate = rows[CHANGE + lane], rate_of(rows, lane)
    h = rows[UNIT + lane] * min(SHORTER * change, 8.0)
    long = min(own[STRIDE], own[CAP], own[LONGEST], own[UNTIL] - rows[T + lane])
    if not (rate * h > STABLE and rows[ALLOWED + lane] >= FINEST):
        return False
    if long < WORTH * h or not calm(rows, lane, rate):
        own[STRIDE] = max(AGAIN * own[STRIDE], h)
        return False
    if not solved(rows, lane, long, room):
        own[STRIDE] = LESS * long
        return False
    error = LAST[0] * rows[V + lane]
    for i in range(NODES):
        error += LAST[i + 1] * room[SPEED, i]
    error = abs(error) / (WIDE * rows[BOUND + lane])
    grow = MORE if error == 0 else min(0.8 * error**(-1 / NODES), MORE)
    if error > 1:
        own[STRIDE] = max(grow, LESS) * long
        return False
    own[STRIDE] = max(grow * long, own[STRIDE] if long < own[STRIDE] else 0.0)
    written(rows, lane, room)
    rows[UNIT + lane] = rows[H + lane] = long
    return True
