"""Compiled series of a motion that merely follows a drive far below the modes, over pieces as long as the drive allows.

After an event the modes ring; once that has died out, what is left varies as slowly as the drive. Its series solves
K c_k = -base a_k - D (k + 1) c_(k+1)/h - (k + 1) (k + 2) c_(k+2)/h^2 from the highest power down, K of the modes and
of the springs between. h is many radians of every mode there, so what the higher powers add is small.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..dense_kernels import factor, solve
from .drive_kernels import drive_series, rate_of
from .memory_kernels import RIGID
from .series_kernels import EPS, REACH, powers

DEAD = 64 * EPS  # of the motion that follows: less that rings is round-off
LATER = 16.0  # short pieces before it is looked again whether what rings has died out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def compliances(springs, modal_system, workspace):
    """Factor slide w^-2 slide^T/mass + 1/spring of the interfaces into workspace.gram (i, i), 1 for one without force.

    The rows workspace.turned stand for the slides: of those that are held as `constrain` leaves them, 0 without force.
    """
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    for f in range(faces):
        size = 0.0
        for i in range(n):
            if springs[f] < RIGID:
                workspace.turned[f, i] = modal_system.faces[f, i] if springs[f] > 0.0 else 0.0
            size += workspace.turned[f, i] ** 2
        for g in range(f + 1):
            part = 0.0
            for i in range(n):
                part += workspace.turned[f, i] * workspace.turned[g, i] / modal_system.square[i]
            workspace.gram[f, g] = part / modal_system.mass
        workspace.gram[f, f] = workspace.gram[f, f] + 1 / springs[f] if size > 0.0 else 1.0
    factor(workspace.gram)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def unbalanced(force, place, springs, modal_system, left):
    """Fill left (n,) [m s-2] with force (n,) less what modes and springs of the places (n,) [m] pull."""
    for i in range(len(modal_system.square)):
        left[i] = force[i] - modal_system.square[i] * place[i]
    for f in range(len(modal_system.reach)):
        pull = 0.0
        for i in range(len(modal_system.square)):
            pull += modal_system.faces[f, i] * place[i]
        pull = pull * springs[f] / modal_system.mass if springs[f] < RIGID else 0.0
        for i in range(len(modal_system.square)):
            left[i] -= modal_system.faces[f, i] * pull


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def balance(force, place, springs, modal_system, left, workspace):
    """Fill place (n,) [m] with K^-1 force (n,) [m s-2] among the motions that leave the held slides alone, left (n,)
    with what those hold."""
    for i in range(len(modal_system.square)):
        place[i] = 0.0
    for _ in range(2):  # the second time for the round-off of the first
        unbalanced(force, place, springs, modal_system, left)
        for f in range(len(modal_system.reach)):
            workspace.row[1, f] = 0.0
            for i in range(len(modal_system.square)):
                off = place[i] if springs[f] == RIGID else 0.0
                workspace.row[1, f] += workspace.turned[f, i] * (
                    left[i] / modal_system.square[i] + off
                )
        solve(workspace.gram, workspace.row[1])
        for i in range(len(modal_system.square)):
            for f in range(len(modal_system.reach)):
                left[i] -= workspace.turned[f, i] * workspace.row[1, f] / modal_system.mass
            place[i] += left[i] / modal_system.square[i]
    unbalanced(force, place, springs, modal_system, left)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def slow_series(place, rate, force, springs, modal_system, h, top, workspace):
    """Fill workspace.coefs, and workspace.reactions of slides that are held, as `motion_series`
    does but with the motion that
    follows the drive alone; what rings besides, as a share of it. place, rate (n,): the motion at first; the others as
    there; workspace.waves[0]: series of the drive over h [s]."""
    n = len(modal_system.square)
    faces = len(modal_system.reach)
    coefs = workspace.coefs
    wave = workspace.waves[0]
    pull = workspace.scales[0]
    compliances(springs, modal_system, workspace)
    for i in range(n):
        coefs[top + 1, i] = 0.0
        coefs[top + 2, i] = 0.0
    for k in range(top, -1, -1):
        for i in range(n):
            pull[i] = -modal_system.base[i] * wave[k] - (k + 1) * (k + 2) * coefs[k + 2, i] / (
                h * h
            )
            for j in range(n):
                pull[i] -= modal_system.damping[i, j] * (k + 1) * coefs[k + 1, j] / h
            if k == 0:
                pull[i] -= modal_system.square[i] * place[i]
                for f in range(faces):
                    pull[i] -= (
                        modal_system.faces[f, i] * force[f] / modal_system.mass
                        if springs[f] < RIGID
                        else 0.0
                    )
        balance(pull, coefs[k], springs, modal_system, workspace.scales[1], workspace)
        for f in range(faces):
            workspace.reactions[f, k] = 0.0
            for i in range(n):
                workspace.reactions[f, k] += (
                    modal_system.mass * workspace.react[f, i] * workspace.scales[1, i]
                )
    rings = 0.0
    follows = 0.0
    for i in range(n):
        size = abs(place[i]) + abs(modal_system.base[i] * wave[0]) / modal_system.square[i]
        for k in range(1, top + 1):
            size += abs(coefs[k, i])
        for f in range(faces):
            size += (
                abs(modal_system.faces[f, i] * force[f])
                / modal_system.mass
                / modal_system.square[i]
                if springs[f] < RIGID
                else 0.0
            )
        rings += modal_system.square[i] * coefs[0, i] ** 2 + (coefs[1, i] / h - rate[i]) ** 2
        follows += modal_system.square[i] * size**2
        coefs[0, i] = place[i]
    return sqrt(rings / max(follows, 1e-300))


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_reach(segment, cycle, offset, period, place, rate, force, modal_system, workspace):
    """Share of the motion that rings, of a piece as long as the drive allows, whose `slow_series` is left in the workspace.

    Kept for itself and called: it is rare, and compiled once for all that read pieces.
    """
    h = REACH / rate_of(segment, period)
    top = powers(REACH)
    drive_series(segment, cycle, offset, period, h, top, workspace.waves)
    return slow_series(place, rate, force, workspace.springs, modal_system, h, top, workspace)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def followed(motion, force, modal_system, time_state, workspace):
    """Rate [1/s] of the drive where the motion merely follows it, its series in the workspace as `at_reach` leaves it; 0
    elsewhere. now[4]: pieces since the last event or look."""
    now = time_state.now
    segment = time_state.segments[int(time_state.now[2])]
    period = time_state.period[0]
    if rate_of(segment, period) > modal_system.slow:
        return 0.0
    now[4] += 1
    if now[4] < LATER:
        return 0.0
    if (
        at_reach(
            segment, now[0], now[1], period, motion[0], motion[1], force, modal_system, workspace
        )
        <= DEAD
    ):
        return rate_of(segment, period)
    now[4] = 0.0
    return 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def shortened(share, top, faces, workspace):
    """Turn the series of a piece in the workspace into those over a share of it."""
    power = 1.0
    for k in range(top + 1):
        for i in range(workspace.coefs.shape[1]):
            workspace.coefs[k, i] *= power
        workspace.waves[0, k] *= power
        for f in range(faces):
            workspace.reactions[f, k] *= power
        power *= share
