"""A step of one mode behind one elastic-plastic element, of one case: exact between yields and stops, each found inside
its step.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f, f = K (x - place) in a stick, +-GK in a slip, which
begins at |x - place| = LENGTH. Twin: a run from event to event (`dynamics.events`).
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
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
    PAST,
    PATH,
    PLACE,
    QV,
    QX,
    RV,
    RX,
    STATES,
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
    irreversible_slide,
    path,
    resume,
    sticking,
)

__all__ = [
    "KEPT",
    "PROVEN",
    "RESTS",
    "TURNS_HELD",
    "advance",
    "ahead",
    "at_turn",
    "begin",
    "folds",
    "foretell",
    "friction_force",
    "furthest",
    "held",
    "irreversible_slide",
    "path",
    "resume",
    "rise",
    "settles",
    "sticking",
]

RESTS = False  # a stick moves its spring
TURNS_HELD = False
PROVEN = 1e-7  # as of `rigid_kernels`
LEAST = 1e-3  # of the length over which it yields: slip of a cycle that sets the stretch anew


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def settles(workspace, i):
    """Whether the last cycle slips, so that no earlier one tells its stretch: while a motion settles, a yield or a
    reversal may move across the end of a cycle, where the stretch is no longer what the map of the cycle before gives,
    and without a slip it is kept for good."""
    return (
        workspace[PATH * LANES + i] - workspace[(PAST + len(STATES)) * LANES + i]
        > LEAST * workspace[LENGTH * LANES + i]
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction_force(x, v, way, place, sine, workspace, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return workspace[K * LANES + i] * (x - place) if way == 0.0 else way * workspace[GK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rise(v, a, way, place, workspace, i, when):
    """Rate of the friction at a speed v and an acceleration a; what holds on after an event moves there in its slip."""
    return workspace[K * LANES + i] * v if way == 0.0 and when != 2 else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_turn(x, way, place, turned, workspace, i):
    """Friction at a turn of the slide, before which it may have slipped."""
    most = workspace[GK * LANES + i]
    return min(max(friction_force(x, 0.0, way, place, 0.0, workspace, i), -most), most)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def held(begin, end, way, workspace, i, h):
    """As of `rigid_kernels`; a stick whose place moves begins with a slip that turns, whose speed falls as a line."""
    slip, speed = abs(end[3] - begin[3]) if way == 0.0 else 0.0, abs(begin[1]) * h
    slips = min(2 * slip / speed, 1.0) if speed > 0.0 else 0.0
    return 1.0 - slips if way == 0.0 else 0.0, 0.0 if slips > 0.0 else 2.0, end[3]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def linear(workspace, i, s0, c0):
    """(x, x') after a step in the state in which it begins."""
    x, v, way, place = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    pull, hold = way * workspace[GK * LANES + i], workspace[K * LANES + i] * place
    xs = (
        workspace[A11 * LANES + i] * x
        + workspace[A12 * LANES + i] * v
        + workspace[SX * LANES + i] * s0
        + workspace[CX * LANES + i] * c0
        - pull * workspace[RX * LANES + i]
    )
    vs = (
        workspace[A21 * LANES + i] * x
        + workspace[A22 * LANES + i] * v
        + workspace[SV * LANES + i] * s0
        + workspace[CV * LANES + i] * c0
        - pull * workspace[RV * LANES + i]
    )
    xh = (
        workspace[B11 * LANES + i] * x
        + workspace[B12 * LANES + i] * v
        + workspace[TX * LANES + i] * s0
        + workspace[UX * LANES + i] * c0
        + hold * workspace[QX * LANES + i]
    )
    vh = (
        workspace[B21 * LANES + i] * x
        + workspace[B22 * LANES + i] * v
        + workspace[TV * LANES + i] * s0
        + workspace[UV * LANES + i] * c0
        + hold * workspace[QV * LANES + i]
    )
    return xh if way == 0.0 else xs, vh if way == 0.0 else vs


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ahead(workspace, i, s0, c0, s1, c1, reads):
    """(x, x', place after a step without a stop, a yield or a turn in it; whether there is one); reads: as of
    `rigid_kernels`."""
    v, way, place = (
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    x1, v1 = linear(workspace, i, s0, c0)
    length, held = workspace[LENGTH * LANES + i], way == 0.0
    yields = held and abs(x1 - place) > length
    return (
        x1,
        v1,
        place if held else x1 - way * length,
        yields or v * v1 < 0.0 or (reads and v1 == 0.0),
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bent(r, damp, stiff, one, two, three):
    """(Slide, speed) an angle r after rest of d'' + damp d' + stiff d = one r + two r^2 / 2 + three r^3 / 6."""
    r2, e2 = r * r, damp * damp - stiff
    of_one, of_one_v = (
        1.0 / 6 + r * (-damp / 24 + r * (e2 / 120 - r * damp * (e2 - stiff) / 720)),
        0.5 + r * (-damp / 6 + r * e2 / 24),
    )
    of_two, of_two_v = (
        1.0 / 24 + r * (-damp / 120 + r * e2 / 720),
        1.0 / 6 + r * (-damp / 24 + r * e2 / 120),
    )
    of_three, of_three_v = 1.0 / 120 - r * damp / 720, 1.0 / 24 - r * damp / 120
    return r2 * r * (one * of_one + r * (two * of_two + r * three * of_three)), r2 * (
        one * of_one_v + r * (two * of_two_v + r * three * of_three_v)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def last_slip(v, a, j, spring, most):
    """Angle of a slip that begins at a speed v and turns within `most`: the speed of the stick goes on as
    v + a r + j r^2 / 2, and the slip adds the spring's lack of pull."""
    square = a * a - 2 * v * j
    r = min(2 * abs(v) / (abs(a) + sqrt(square)) if square > 0.0 > a * v else most, most)
    for _ in range(4):
        speed = v + r * (a + r * (j / 2 + spring * (v / 2 + r * (a / 6 + r * j / 24))))
        slope = a + r * (j + spring * (v + r * (a / 2 + r * j / 6)))
        r = min(max(r - speed / slope, 0.0), most) if slope != 0.0 else r
    return r


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def held_on(d, dv, damp, stiff, hold, r):
    """(Slide, speed) an angle r after (d, dv) of d'' + damp d' + stiff d = hold."""
    a = hold - damp * dv - stiff * d
    j = -damp * a - stiff * dv
    k = -damp * j - stiff * a
    return d + r * (dv + r * (a / 2 + r * (j / 6 + r * k / 24))), dv + r * (
        a + r * (j / 2 + r * k / 6)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def advance(workspace, i, s0, c0, s1, c1, h):
    """(x, v, way, place at the end of a step h; share u of the step up to an event; x, v and place there; x where the
    slide turns, that of the end without a turn; kink: jump of the acceleration at the event, none here).

    way: sign of the slip, 0 in a stick; s0, c0, s1, c1: sine and cosine of the drive at both ends.
    """
    x, v, way, place = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    damp, square, push = (
        workspace[D * LANES + i],
        workspace[W * LANES + i],
        workspace[P * LANES + i],
    )
    spring, length = workspace[K * LANES + i], workspace[LENGTH * LANES + i]
    xs, vs = linear(workspace, i, s0, c0)
    a0 = push * s0 - damp * v - square * x - friction_force(x, v, way, place, s0, workspace, i)
    a1 = push * s1 - damp * vs - square * xs - friction_force(xs, vs, way, place, s1, workspace, i)
    # the speed as a cubic over the step, the slide as its integral
    m0, m1 = h * a0, h * a1
    c2, c3 = 3 * (vs - v) - 2 * m0 - m1, m0 + m1 - 2 * (vs - v)
    turns = v * vs < 0.0 or (way != 0.0 and way * v < 0.0)
    ut = crossing(v, m0, c2, c3, v / (v - vs)) if v * vs < 0.0 else 0.0 if turns else 1.0
    turn = x + h * ut * (v + ut * (m0 / 2 + ut * (c2 / 3 + ut * c3 / 4))) if turns else xs
    u, x1, v1, way1, xe, ve, pe, place1, grazes = 1.0, xs, vs, way, xs, vs, place, place, False
    if way != 0.0:
        pe = place1 = xs - way * length
        if turns:  # it stops, and holds on by its spring
            u, xe, ve, way1, pe = ut, turn, 0.0, 0.0, turn - way * length
            place1 = pe
            speed, rate, more = (
                0.0,
                (m0 + ut * (2 * c2 + 3 * c3 * ut)) / h,
                (2 * c2 + 6 * c3 * ut) / (h * h),
            )
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
            # a parabola from the turn, beside which the slope of a line is far from that of the
            # slide
            if top < 1.0:
                bow = h * max(abs(m0 + top * (2 * c2 + 3 * c3 * top)), 1e-300)
                u = max(top - sqrt(2 * (far - length) / bow), 0.0)
            for _ in range(4):
                now = x + h * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4))) - place
                speed = side * (v + u * (m0 + u * (c2 + u * c3)))
                u = (
                    min(max(u - (side * now - length) / (h * speed), 0.0), top)
                    if speed > 0.0
                    else u
                )
            ve = v + u * (m0 + u * (c2 + u * c3))
            xe = place + side * length
            way1, speed = side, ve
            rate, more = (m0 + u * (2 * c2 + 3 * c3 * u)) / h, (2 * c2 + 6 * c3 * u) / (h * h)
            part, grazes = spring, turns and side * (turn - place) > length
    if u < 1.0:
        r, stiff = h - u * h, square + (spring if way1 == 0.0 else 0.0)
        d, dv = bent(r, damp, stiff, part * speed, part * rate, part * more)
        x1, v1 = xs + d, vs + dv
        if way1 != 0.0:
            place1 = x1 - way1 * length
        if grazes:  # it turns in its slip, later than it would in a stick, or not in this step
            turns = side * v1 < 0.0
            if turns:
                r = last_slip(ve, rate, more, spring, r)
                d, dv = bent(r, damp, square, spring * speed, spring * rate, spring * more)
                w = u + r / h
                turn = x + h * w * (v + w * (m0 / 2 + w * (c2 / 3 + w * c3 / 4))) + d
                way1, place1 = 0.0, turn - side * length
                d, dv = held_on(
                    d, dv, damp, square + spring, spring * (place1 - place), h - u * h - r
                )
                x1, v1 = xs + d, vs + dv
    return x1, v1, way1, place1, u, xe, ve, pe, turn if turns else x1, 0.0
