"""A step of one mode under a law of one stretch, of one case: Runge and Kutta's of order 4, each side of a reversal and
of a kink of the law by itself.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f(z, x'), z' = g(z, x') x', z the stretch of the contact
[m], the place of a case. f and g are those of `friction`, whose numbers have lengths in m and angles for times, so that
a force is one over the mass [m]. Twin: a run by high order (`dynamics.smooth`).
"""

from math import cos, sin

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ...friction.laws import tanh_kernels as friction
from .names_kernels import FIRST_OF_LAW, LANES, MIDDLE, OWN, PLACE, WAY, D, H, P, V, W, X
from .rigid_kernels import crossing
from .rigid_kernels import foretell as foretell

RESTS = TURNS_HELD = False  # it never holds
# of its own state: friction, mean square of the stretches, friction work of the last step
FELT, SQUARE, WORK = range(OWN, OWN + 3)
OWN_STATE = 3
PARTS = 4  # of a step: a reversal and a kink on either side of it
SHARE, HALVINGS = 0.5, 24  # irreversible share of the slide from which it slips; of the part of a step where it begins


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def numbers(room, i):
    """Numbers of the law (6,), as its own `flowing` takes them."""
    at = FIRST_OF_LAW
    return (room[at * LANES + i], room[(at + 1) * LANES + i], room[(at + 2) * LANES + i], room[(at + 3) * LANES + i],
            room[(at + 4) * LANES + i], room[(at + 5) * LANES + i])


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def felt(x, v, way, place, sine, room, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return friction.flowing(numbers(room, i), place, v, way)[0]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rise(v, a, way, place, room, i, when):
    """Rate of the friction at a speed v and an acceleration a."""
    _, gain, by_stretch, by_speed = friction.flowing(numbers(room, i), place, v, way)
    return by_stretch * gain * v + by_speed * a


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def at_turn(x, way, place, turned, room, i):
    """Friction at a turn of the slide, of the place there."""
    return felt(x, 0.0, way, turned, 0.0, room, i)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def slid(x, place, room, i):
    """Irreversible part of the slide."""
    return x - place


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def path(place, pe, place1, v1, room, i):
    """Friction work of a step over the mass [m^2]."""
    return room[WORK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def run(room, i, state, way, drive, h):
    """(x, x', friction, place, mean square of the stretches; friction work) after an angle h in the direction `way`
    from the first five; drive: its sine at the start, in the middle and at the end."""
    x, v, f, z, q = state
    k, push = numbers(room, i), room[P * LANES + i]
    damp, square, half = room[D * LANES + i], room[W * LANES + i], h / 2
    g = friction.flowing(k, z, v, way)[1] * v
    a, m = push * drive[0] - damp * v - square * x - f, friction.spreading(k, z, q, v, way)
    v1, z1, q1 = v + half * a, z + half * g, q + half * m
    f1, gain, _, _ = friction.flowing(k, z1, v1, way)
    g1, m1 = gain * v1, friction.spreading(k, z1, q1, v1, way)
    a1 = push * drive[1] - damp * v1 - square * (x + half * v) - f1
    v2, z2, q2 = v + half * a1, z + half * g1, q + half * m1
    f2, gain, _, _ = friction.flowing(k, z2, v2, way)
    g2, m2 = gain * v2, friction.spreading(k, z2, q2, v2, way)
    a2 = push * drive[1] - damp * v2 - square * (x + half * v1) - f2
    v3, z3, q3 = v + h * a2, z + h * g2, q + h * m2
    f3, gain, _, _ = friction.flowing(k, z3, v3, way)
    g3, m3 = gain * v3, friction.spreading(k, z3, q3, v3, way)
    a3 = push * drive[2] - damp * v3 - square * (x + h * v2) - f3
    part = h / 6
    ve, ze = v + part * (a + 2 * (a1 + a2) + a3), z + part * (g + 2 * (g1 + g2) + g3)
    qe = q + part * (m + 2 * (m1 + m2) + m3) if friction.SPREADS else ze * ze
    fe = friction.flowing(k, ze, ve, way)[0]
    work = part * (f * v + 2 * (f1 * v1 + f2 * v2) + f3 * v3)
    return (x + part * (v + 2 * (v1 + v2) + v3), ve, fe, ze, qe), work


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def begin(room, i):
    """Set the friction of a lane that takes a case."""
    room[FELT * LANES + i] = felt(room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i],
                                  room[PLACE * LANES + i], 0.0, room, i)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def begun(room, i):
    """State of a lane as `run` takes it."""
    return room[X * LANES + i], room[V * LANES + i], room[FELT * LANES + i], room[PLACE * LANES + i], \
        room[SQUARE * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def sticking(v, way, place, room, i):
    """1 where less than SHARE of the slide is irreversible, 0 where it is not."""
    return 1.0 if abs(1 - friction.flowing(numbers(room, i), place, v, way)[1]) < SHARE else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def ahead(room, i, s0, c0, s1, c1, reads):
    """(x, x', place after a step; whether the slide turns or the law has a kink in it); reads: whether what the step
    shows is read, so that the begin or end of a stick and a stretch that turns over count too."""
    way, state = room[WAY * LANES + i], begun(room, i)
    (x1, v1, f1, z1, q1), work = run(room, i, state, way, (s0, room[MIDDLE * LANES + i] * (s0 + s1), s1),
                                     room[H * LANES + i])
    event = way * v1 < 0.0 or ((reads or friction.BENDS) and state[3] * z1 < 0.0) or (reads and (
        v1 == 0.0 or sticking(state[1], way, state[3], room, i) != sticking(v1, way, z1, room, i)))
    room[FELT * LANES + i], room[SQUARE * LANES + i] = state[2] if event else f1, state[4] if event else q1
    room[WORK * LANES + i] = work
    return x1, v1, z1, event


@njit(error_model="numpy", **LEAN)
def zero(y0, y1, m0, m1):
    """u of [0, 1] at which the cubic with these values and slopes at its ends is 0, from the secant on."""
    return crossing(y0, m0, 3 * (y1 - y0) - 2 * m0 - m1, m0 + m1 - 2 * (y1 - y0), y0 / (y0 - y1))


@njit(error_model="numpy", **LEAN)
def first_event(room, i, state, after, way, drive, h):
    """(share of a run of the angle h up to its first event, whether the slide turns there); 1, False without one."""
    k, push = numbers(room, i), room[P * LANES + i]
    damp, square = room[D * LANES + i], room[W * LANES + i]
    (x, v, f, z, _), (x1, v1, f1, z1, _) = state, after
    u, turns = 1.0, False
    if way * v1 < 0.0:
        u = zero(v, v1, h * (push * drive[0] - damp * v - square * x - f),
                 h * (push * drive[2] - damp * v1 - square * x1 - f1)) if way * v > 0.0 else 0.0
        turns = True
    if friction.BENDS and z * z1 < 0.0:
        bend = zero(z, z1, h * v * friction.flowing(k, z, v, way)[1], h * v1 * friction.flowing(k, z1, v1, way)[1])
        u, turns = (bend, False) if bend < u else (u, turns)
    return u, turns


@njit(error_model="numpy", **LEAN)
def advance(room, i, s0, c0, s1, c1, h):
    """(x, v, way, place at the end of a step h; share u of the step up to a turn; x, v and place there; x where the
    slide turns, that of the end without a turn; kink: 0, as no acceleration jumps).

    The step ends and begins anew where the slide turns, and where the law has a kink at no stretch.
    """
    state, way, at, work, u = begun(room, i), room[WAY * LANES + i], 0.0, 0.0, 1.0
    xe = ve = ze = 0.0
    for part in range(PARTS):
        rest = h - at
        middle, sine = at + rest / 2, s0 * cos(at) + c0 * sin(at)
        drive = (sine, s0 * cos(middle) + c0 * sin(middle), s1)
        after, done = run(room, i, state, way, drive, rest)
        share, turns = first_event(room, i, state, after, way, drive, rest)
        if part == PARTS - 1 or not (turns or share < 1.0):
            break
        if share > 0.0:
            end, middle = at + share * rest, at + share * rest / 2
            drive = (sine, s0 * cos(middle) + c0 * sin(middle), s0 * cos(end) + c0 * sin(end))
            (x, v, _, z, q), done = run(room, i, state, way, drive, share * rest)
            work, at = work + done, end
            v, z = 0.0 if turns else v, z if turns else 0.0
            state = x, v, friction.flowing(numbers(room, i), z, v, way)[0], z, q
        if turns:
            way, u, xe, ve, ze = -way, at / h, state[0], state[1], state[3]
    x1, v1, f1, z1, q1 = after
    room[FELT * LANES + i], room[SQUARE * LANES + i], room[WORK * LANES + i] = f1, q1, work + done
    turned = way != room[WAY * LANES + i]
    xe, ve, ze = (xe, ve, ze) if turned else (x1, v1, z1)
    return x1, v1, way, z1, u if turned else 1.0, xe, ve, ze, xe, 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def cubic(y, y1, m, m1, u):
    """A cubic with these values and slopes at the ends of [0, 1], at u."""
    w = 1 - u
    return w * w * ((1 + 2 * u) * y + u * m) + u * u * ((1 + 2 * w) * y1 - w * m1)


@njit(error_model="numpy", **LEAN)
def sticks(begin, end, way, k, h, u):
    """Whether less than SHARE of the slide is irreversible at the share u of a part of a step; arguments as of
    `held`."""
    (_, v, a, z), (_, v1, a1, z1) = begin, end
    speed = cubic(v, v1, h * a, h * a1, u)
    place = cubic(z, z1, h * v * friction.flowing(k, z, v, way)[1], h * v1 * friction.flowing(k, z1, v1, way)[1], u)
    return abs(1 - friction.flowing(k, place, speed, way)[1]) < SHARE


@njit(error_model="numpy", **LEAN)
def held(begin, end, way, room, i, h):
    """(share of a part of a step in which the contact sticks; share inside it at which it begins to slip, 2: nowhere;
    irreversible part of the slide where that turns inside it, that of its end without).

    begin, end: x, x', x'' and place at the ends of the part, of an angle h; in between they are cubics. The
    irreversible part turns where there is no stretch.
    """
    k, (x, v, _, z), (x1, v1, _, z1) = numbers(room, i), begin, end
    furthest, low, high = slid(x1, z1, room, i), 0.0, 1.0
    if z * z1 < 0.0:
        u = zero(z, z1, h * v * friction.flowing(k, z, v, way)[1], h * v1 * friction.flowing(k, z1, v1, way)[1])
        furthest = cubic(x, x1, h * v, h * v1, u)
    first = sticks(begin, end, way, k, h, 0.0)
    if first == sticks(begin, end, way, k, h, 1.0):
        return 1.0 if first else 0.0, 2.0, furthest
    for _ in range(HALVINGS):
        u = 0.5 * (low + high)
        if sticks(begin, end, way, k, h, u) == first:
            low = u
        else:
            high = u
    return low if first else 1 - low, low if first else 2.0, furthest
