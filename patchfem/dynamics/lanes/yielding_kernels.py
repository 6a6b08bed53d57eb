"""A step of one mode behind one elastic-plastic element, of one case: exact between yields and stops, each found inside
its step.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f, f = K (x - place) in a stick, +-GK in a slip, which
begins at |x - place| = LENGTH. Twin: a run from event to event (`dynamics.events`).
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from .names_kernels import (
    A11,
    A12,
    A21,
    A22,
    B11,
    B12,
    B21,
    B22,
    CV,
    CX,
    GK,
    LANES,
    LENGTH,
    PLACE,
    QV,
    QX,
    RV,
    RX,
    SV,
    SX,
    TV,
    TX,
    UV,
    UX,
    WAY,
    D,
    K,
    P,
    V,
    W,
    X,
)
from .rigid_kernels import (
    KEPT,
    begin,
    crossing,
    folds,
    foretell,
    furthest,
    held,
    path,
    resume,
    slid,
    sticking,
)

__all__ = ["KEPT", "RESTS", "TURNS_HELD", "advance", "ahead", "at_turn", "begin", "felt", "folds", "foretell",
           "furthest", "held", "path", "resume", "rise", "settles", "slid", "sticking"]


@njit(error_model="numpy", forceinline=True, **LEAN)
def settles(room, i):
    """Never: while a motion settles, a yield or a reversal may move across the end of a cycle, where the stretch is no
    longer what the map of the cycle before gives, and the stretch is kept for good."""
    return False

RESTS = False  # a stick moves its spring
TURNS_HELD = False


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def felt(x, v, way, place, sine, room, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return room[K * LANES + i] * (x - place) if way == 0.0 else way * room[GK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rise(v, a, way, place, room, i, when):
    """Rate of the friction at a speed v and an acceleration a."""
    return room[K * LANES + i] * v if way == 0.0 else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def at_turn(x, way, place, turned, room, i):
    """Friction at a turn of the slide."""
    return felt(x, 0.0, way, place, 0.0, room, i)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def linear(room, i, s0, c0):
    """(x, x') after a step in the state in which it begins."""
    x, v, way, place = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    pull, hold = way * room[GK * LANES + i], room[K * LANES + i] * place
    xs = room[A11 * LANES + i] * x + room[A12 * LANES + i] * v + room[SX * LANES + i] * s0 + room[CX * LANES + i] * c0 \
        - pull * room[RX * LANES + i]
    vs = room[A21 * LANES + i] * x + room[A22 * LANES + i] * v + room[SV * LANES + i] * s0 + room[CV * LANES + i] * c0 \
        - pull * room[RV * LANES + i]
    xh = room[B11 * LANES + i] * x + room[B12 * LANES + i] * v + room[TX * LANES + i] * s0 + room[UX * LANES + i] * c0 \
        + hold * room[QX * LANES + i]
    vh = room[B21 * LANES + i] * x + room[B22 * LANES + i] * v + room[TV * LANES + i] * s0 + room[UV * LANES + i] * c0 \
        + hold * room[QV * LANES + i]
    return xh if way == 0.0 else xs, vh if way == 0.0 else vs


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def ahead(room, i, s0, c0, s1, c1, reads):
    """(x, x', place after a step without a stop, a yield or a turn in it; whether there is one); reads: as of
    `rigid_kernels`."""
    v, way, place = room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    x1, v1 = linear(room, i, s0, c0)
    length, held = room[LENGTH * LANES + i], way == 0.0
    yields = held and abs(x1 - place) > length
    return x1, v1, place if held else x1 - way * length, yields or v * v1 < 0.0 or (reads and v1 == 0.0)


@njit(error_model="numpy", **LEAN)
def advance(room, i, s0, c0, s1, c1, h):
    """(x, v, way, place at the end of a step h; share u of the step up to an event; x, v and place there; x where the
    slide turns, that of the end without a turn; kink: jump of the acceleration at the event, none here).

    way: sign of the slip, 0 in a stick; s0, c0, s1, c1: sine and cosine of the drive at both ends.
    """
    x, v, way, place = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    damp, square, push = room[D * LANES + i], room[W * LANES + i], room[P * LANES + i]
    spring, length = room[K * LANES + i], room[LENGTH * LANES + i]
    xs, vs = linear(room, i, s0, c0)
    a0 = push * s0 - damp * v - square * x - felt(x, v, way, place, s0, room, i)
    a1 = push * s1 - damp * vs - square * xs - felt(xs, vs, way, place, s1, room, i)
    # the speed as a cubic over the step, the slide as its integral
    m0, m1 = h * a0, h * a1
    c2, c3 = 3 * (vs - v) - 2 * m0 - m1, m0 + m1 - 2 * (vs - v)
    turns = v * vs < 0.0 or (way != 0.0 and way * v < 0.0)
    ut = crossing(v, m0, c2, c3, v / (v - vs)) if v * vs < 0.0 else 0.0 if turns else 1.0
    turn = x + h * ut * (v + ut * (m0 / 2 + ut * (c2 / 3 + ut * c3 / 4))) if turns else xs
    u, x1, v1, way1, xe, ve, pe, place1 = 1.0, xs, vs, way, xs, vs, place, place
    if way != 0.0:
        pe = place1 = xs - way * length
        if turns:  # it stops, and holds on by its spring
            u, xe, ve, way1, pe = ut, turn, 0.0, 0.0, turn - way * length
            place1 = pe
            speed, rate, more = 0.0, (m0 + ut * (2 * c2 + 3 * c3 * ut)) / h, (2 * c2 + 6 * c3 * ut) / (h * h)
            part = -spring
    else:
        side = 1.0 if turn > place else -1.0
        if not turns or abs(turn - place) <= abs(xs - place):
            side = 1.0 if xs > place else -1.0
        far = max(side * (turn - place), side * (xs - place))
        if far > length:
            top = ut if turns and side * (turn - place) > length else 1.0
            y0 = side * (x - place) - length
            u = top * min(max(-y0 / (far - length - y0), 0.0), 1.0)
            for _ in range(4):
                now = x + h * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4))) - place
                speed = side * (v + u * (m0 + u * (c2 + u * c3)))
                u = min(max(u - (side * now - length) / (h * speed), 0.0), top) if speed > 0.0 else u
            ve = v + u * (m0 + u * (c2 + u * c3))
            xe = place + side * length
            way1, speed = side, ve
            rate, more = (m0 + u * (2 * c2 + 3 * c3 * u)) / h, (2 * c2 + 6 * c3 * u) / (h * h)
            part = spring
            if turns and side * (turn - place) > length:  # it yields by a last bit before it turns
                way1, place1, part = 0.0, turn - side * length, 0.0
    if u < 1.0:
        r = h - u * h
        r2, e2 = r * r, damp * damp - square - (spring if way1 == 0.0 else 0.0)
        one = r2 * r * (1.0 / 6 + r * (-damp / 24 + r * (e2 / 120 - r * damp * (e2 - square) / 720)))
        two, three = r2 * r2 * (1.0 / 24 + r * (-damp / 120 + r * e2 / 720)), r2 * r2 * r * (1.0 / 120 - r * damp / 720)
        one_v = r2 * (0.5 + r * (-damp / 6 + r * e2 / 24))
        two_v, three_v = r2 * r * (1.0 / 6 + r * (-damp / 24 + r * e2 / 120)), r2 * r2 * (1.0 / 24 - r * damp / 120)
        x1 = xs + part * (speed * one + rate * two + more * three)
        v1 = vs + part * (speed * one_v + rate * two_v + more * three_v)
        if way1 != 0.0:
            place1 = x1 - way1 * length
    return x1, v1, way1, place1, u, xe, ve, pe, turn if turns else x1, 0.0
