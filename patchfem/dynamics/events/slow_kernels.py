"""Compiled series of a motion that merely follows a drive far below the modes, over pieces as long as the drive allows.

After an event the modes ring; once that has died out, what is left varies as slowly as the drive. Its series solves
K c_k = -base a_k - D (k + 1) c_(k+1)/h - (k + 1) (k + 2) c_(k+2)/h^2 from the highest power down, K of the modes and
of the springs between. h is many radians of every mode there, so what the higher powers add is small.
"""

from math import sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..dense_kernels import factor, solve
from .drive_kernels import drive_series, rate_of
from .memory_kernels import RIGID
from .series_kernels import EPS, REACH, powers

DEAD = 64 * EPS  # of the motion that follows: less that rings is round-off
LATER = 16.0  # short pieces before it is looked again whether what rings has died out


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def compliances(springs, plant, room):
    """Factor slide w^-2 slide^T/mass + 1/spring of the interfaces into room.gram (i, i), 1 for one without force.

    The rows room.turned stand for the slides: of those that are held as `constrain` leaves them, 0 without force.
    """
    n, faces = len(plant.square), len(plant.reach)
    for f in range(faces):
        size = 0.0
        for i in range(n):
            if springs[f] < RIGID:
                room.turned[f, i] = plant.faces[f, i] if springs[f] > 0.0 else 0.0
            size += room.turned[f, i]**2
        for g in range(f + 1):
            part = 0.0
            for i in range(n):
                part += room.turned[f, i] * room.turned[g, i] / plant.square[i]
            room.gram[f, g] = part / plant.mass
        room.gram[f, f] = room.gram[f, f] + 1 / springs[f] if size > 0.0 else 1.0
    factor(room.gram)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def unbalanced(force, place, springs, plant, left):
    """Fill left (n,) [m s-2] with force (n,) less what modes and springs of the places (n,) [m] pull."""
    for i in range(len(plant.square)):
        left[i] = force[i] - plant.square[i] * place[i]
    for f in range(len(plant.reach)):
        pull = 0.0
        for i in range(len(plant.square)):
            pull += plant.faces[f, i] * place[i]
        pull = pull * springs[f] / plant.mass if springs[f] < RIGID else 0.0
        for i in range(len(plant.square)):
            left[i] -= plant.faces[f, i] * pull


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def balance(force, place, springs, plant, left, room):
    """Fill place (n,) [m] with K^-1 force (n,) [m s-2] among the motions that leave the held slides alone, left (n,)
    with what those hold."""
    for i in range(len(plant.square)):
        place[i] = 0.0
    for _ in range(2):  # the second time for the round-off of the first
        unbalanced(force, place, springs, plant, left)
        for f in range(len(plant.reach)):
            room.row[1, f] = 0.0
            for i in range(len(plant.square)):
                off = place[i] if springs[f] == RIGID else 0.0
                room.row[1, f] += room.turned[f, i] * (left[i] / plant.square[i] + off)
        solve(room.gram, room.row[1])
        for i in range(len(plant.square)):
            for f in range(len(plant.reach)):
                left[i] -= room.turned[f, i] * room.row[1, f] / plant.mass
            place[i] += left[i] / plant.square[i]
    unbalanced(force, place, springs, plant, left)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def slow_series(place, rate, force, springs, plant, h, top, room):
    """Fill room.coefs, and room.reactions of slides that are held, as `motion_series` does but with the motion that
    follows the drive alone; what rings besides, as a share of it. place, rate (n,): the motion at first; the others as
    there; room.waves[0]: series of the drive over h [s]."""
    n, faces, coefs, wave, pull = len(plant.square), len(plant.reach), room.coefs, room.waves[0], room.scales[0]
    compliances(springs, plant, room)
    for i in range(n):
        coefs[top + 1, i], coefs[top + 2, i] = 0.0, 0.0
    for k in range(top, -1, -1):
        for i in range(n):
            pull[i] = -plant.base[i] * wave[k] - (k + 1) * (k + 2) * coefs[k + 2, i] / (h * h)
            for j in range(n):
                pull[i] -= plant.damping[i, j] * (k + 1) * coefs[k + 1, j] / h
            if k == 0:
                pull[i] -= plant.square[i] * place[i]
                for f in range(faces):
                    pull[i] -= plant.faces[f, i] * force[f] / plant.mass if springs[f] < RIGID else 0.0
        balance(pull, coefs[k], springs, plant, room.scales[1], room)
        for f in range(faces):
            room.reactions[f, k] = 0.0
            for i in range(n):
                room.reactions[f, k] += plant.mass * room.react[f, i] * room.scales[1, i]
    rings, follows = 0.0, 0.0
    for i in range(n):
        size = abs(place[i]) + abs(plant.base[i] * wave[0]) / plant.square[i]
        for k in range(1, top + 1):
            size += abs(coefs[k, i])
        for f in range(faces):
            size += abs(plant.faces[f, i] * force[f]) / plant.mass / plant.square[i] if springs[f] < RIGID else 0.0
        rings += plant.square[i] * coefs[0, i]**2 + (coefs[1, i] / h - rate[i])**2
        follows += plant.square[i] * size**2
        coefs[0, i] = place[i]
    return sqrt(rings / max(follows, 1e-300))


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def at_reach(segment, cycle, offset, period, place, rate, force, plant, room):
    """Share of the motion that rings, of a piece as long as the drive allows, whose `slow_series` is left in the room.

    Kept for itself and called: it is rare, and compiled once for all that read pieces.
    """
    h, top = REACH / rate_of(segment, period), powers(REACH)
    drive_series(segment, cycle, offset, period, h, top, room.waves)
    return slow_series(place, rate, force, room.springs, plant, h, top, room)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def followed(motion, force, plant, clock, room):
    """Rate [1/s] of the drive where the motion merely follows it, its series in the room as `at_reach` leaves it; 0
    elsewhere. now[4]: pieces since the last event or look."""
    now, segment, period = clock.now, clock.segments[int(clock.now[2])], clock.period[0]
    if rate_of(segment, period) > plant.slow:
        return 0.0
    now[4] += 1
    if now[4] < LATER:
        return 0.0
    if at_reach(segment, now[0], now[1], period, motion[0], motion[1], force, plant, room) <= DEAD:
        return rate_of(segment, period)
    now[4] = 0.0
    return 0.0


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def shortened(share, top, faces, room):
    """Turn the series of a piece in the room into those over a share of it."""
    power = 1.0
    for k in range(top + 1):
        for i in range(room.coefs.shape[1]):
            room.coefs[k, i] *= power
        room.waves[0, k] *= power
        for f in range(faces):
            room.reactions[f, k] *= power
        power *= share
