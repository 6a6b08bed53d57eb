"""The force of a first loading of parallel Jenkins elements, over their stiffness and the slide LENGTH of all of them:
straight between their yields,

    g(w) = F + S w,  F = sum k y and S = sum k of those that have, and have not, yielded.

A case has its table behind its numbers (`run.tables_of`): of each yield its place, F, S and B = sum k y^2, one beside
the other in the workspace of a lane. In a step it is walked through once, from where the last one ended, after an event from
where the part of the way from the first yield to the last begins that holds it; what is found lies side by side with
that of other lanes, as a compiler takes several at once only where it knows the distance of any two numbers. Twin: many
elements, from event to event (`dynamics.events`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .names_kernels import CURVE, LANES, WHERE

YIELDS = 512  # of a case, the first of which is none and the last beyond all slides
YIELD, FORCE, SLOPE, MOMENT, COLUMNS = range(5)
# number of the yield; F, S and B at WHERE, F and B where the step begins
AT, FOUND_F, FOUND_S, FOUND_B, HERE_F, HERE_B = range(WHERE + 1, WHERE + 7)
# behind the yields: how many of them are below the begin of each equal part of the way from the first to the last; the
# first, and parts over that way
PARTS, BEGINS = 128, COLUMNS * YIELDS
LOWEST, PER_PART = range(BEGINS + PARTS, BEGINS + PARTS + 2)
# where the tables begin, and the numbers of one
TABLE, SIZE = (
    (WHERE + 7) * LANES,
    BEGINS + PARTS + 2,
)
ROOM = WHERE + 7 - CURVE  # numbers that it has in the state of a case
PART = 0.25  # of LENGTH, over which a step may go at most
FORETELLS = True
# where the numbers of a curve are: in its table, found ahead of a step, at its begin
ASKED, FOUND, HERE = range(3)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def walk(at, w, workspace, i):
    """Note the number of the last yield up to w, which is not far from the number `at`."""
    first = TABLE + SIZE * i
    while w >= workspace[first + COLUMNS * (at + 1)]:
        at += 1
    while w < workspace[first + COLUMNS * at]:
        at -= 1
    workspace[AT * LANES + i] = at


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def last(w, workspace, i):
    """Place in the workspace of the last yield up to w: that of the last time, or from the begin of its part on."""
    k, first = int(workspace[AT * LANES + i]), TABLE + SIZE * i
    if w < workspace[first + COLUMNS * k] or w >= workspace[first + COLUMNS * (k + 1)]:
        part = (w - workspace[first + LOWEST]) * workspace[first + PER_PART]
        k = int(workspace[first + BEGINS + int(min(part, PARTS - 1.0))]) if part > 0.0 else 0
        walk(k, w, workspace, i)
    return first + COLUMNS * int(workspace[AT * LANES + i])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find(workspace, i):
    """Find the curve of a lane at WHERE."""
    walk(int(workspace[AT * LANES + i]), workspace[WHERE * LANES + i], workspace, i)
    place = TABLE + SIZE * i + COLUMNS * int(workspace[AT * LANES + i])
    workspace[FOUND_F * LANES + i], workspace[FOUND_S * LANES + i] = (
        workspace[place + FORCE],
        workspace[place + SLOPE],
    )
    workspace[FOUND_B * LANES + i] = workspace[place + MOMENT]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def go_on(workspace, i, event):
    """Begin the next step where this one ended, unless it holds an event."""
    f, b = workspace[HERE_F * LANES + i], workspace[HERE_B * LANES + i]
    workspace[HERE_F * LANES + i] = f if event else workspace[FOUND_F * LANES + i]
    workspace[HERE_B * LANES + i] = b if event else workspace[FOUND_B * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin_at(w, workspace, i):
    """Begin the next step at w."""
    at = last(w, workspace, i)
    workspace[HERE_F * LANES + i], workspace[HERE_B * LANES + i] = (
        workspace[at + FORCE],
        workspace[at + MOMENT],
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def force(w, workspace, i, when):
    """(g, its slope) at w > 0."""
    if when == FOUND:
        return workspace[FOUND_F * LANES + i] + workspace[FOUND_S * LANES + i] * w, workspace[
            FOUND_S * LANES + i
        ]
    at = last(w, workspace, i)
    return workspace[at + FORCE] + workspace[at + SLOPE] * w, workspace[at + SLOPE]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def slipped(w, g, workspace, i, when):
    """Mean slip of the sliders, each by what it carries at most, times that of all."""
    if when == FOUND:
        return workspace[FOUND_F * LANES + i] * w - workspace[FOUND_B * LANES + i]
    if when == HERE:
        return workspace[HERE_F * LANES + i] * w - workspace[HERE_B * LANES + i]
    at = last(w, workspace, i)
    return workspace[at + FORCE] * w - workspace[at + MOMENT]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def work(w, g, workspace, i):
    """Integral of the force up to w, where it is g."""
    at = last(w, workspace, i)
    return (w * (g + workspace[at + FORCE]) - workspace[at + MOMENT]) / 2
