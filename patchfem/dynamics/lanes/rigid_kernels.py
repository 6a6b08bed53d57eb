"""A step of one mode under Coulomb friction, of one case: exact between stops and releases, each found inside its step.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f, f = +-GK in a slip and at most GS in a stick. Twin: a
run from event to event (`dynamics.events`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .names_kernels import (
    A11,
    A12,
    A21,
    A22,
    CV,
    CX,
    GK,
    GS,
    LANES,
    RV,
    RX,
    SV,
    SX,
    WAY,
    D,
    P,
    V,
    W,
    X,
)

RESTS = True  # nothing moves in a stick
TURNS_HELD = False  # an event may leave a stick as it is
PROVEN = 0.0  # of its range: by how much the end of a cycle after a leap may miss what this foretold; 0: no proof
KEPT = 0  # of the first numbers of its own state, those that move on as a motion settles


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def root(y0, y1, m0, m1, least):
    """(u, value, slope and integral up to u) of the cubic over [0, 1] with values y0, y1 and slopes m0, m1 where it
    crosses 0, u from `least` to 1: three Newton steps from the secant."""
    c2, c3 = 3 * (y1 - y0) - 2 * m0 - m1, m0 + m1 - 2 * (y1 - y0)
    u = y0 / (y0 - y1)
    for _ in range(3):
        u = u - (y0 + u * (m0 + u * (c2 + u * c3))) / (m0 + u * (2 * c2 + 3 * c3 * u))
        u = u if u > least else least
        u = u if u < 1.0 else 1.0
    return (
        u,
        y0 + u * (m0 + u * (c2 + u * c3)),
        m0 + u * (2 * c2 + 3 * c3 * u),
        u * (y0 + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4))),
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def highest(g0, g1, m0, m1):
    """Largest size of a cubic over [0, 1] with these values and slopes at its ends, its vertex by the secant of the
    slopes."""
    ends = max(abs(g0), abs(g1))
    w = m0 / (m0 - m1)
    rise = g1 - g0
    vertex = g0 + w * (m0 + w * (3 * rise - 2 * m0 - m1 + w * (m0 + m1 - 2 * rise)))
    return max(ends, abs(vertex)) if m0 * m1 < 0.0 else ends


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction_force(x, v, way, place, sine, workspace, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    held, most = (
        workspace[P * LANES + i] * sine - workspace[W * LANES + i] * x,
        workspace[GS * LANES + i],
    )
    return min(max(held, -most), most) if way == 0.0 else way * workspace[GK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rise(v, a, way, place, workspace, i, when):
    """Rate of the friction at a speed v and an acceleration a; 0 for a rigid contact, whose stick has no motion."""
    return 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def foretell(workspace, s0, c0):
    """Find nothing ahead of a step."""


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def folds():
    """Whether `advance` folds what a step shows of itself."""
    return False


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def furthest(x, v, x1, v1, h):
    """Slide at the turn in a step that no event marks, of which there is none."""
    return x1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def irreversible_slide(x, place, workspace, i):
    """Irreversible part of the slide."""
    return place


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def path(place, pe, place1, v1, workspace, i):
    """What a step adds to the path of slip [m]."""
    return abs(pe - place) + abs(place1 - pe)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_turn(x, way, place, turned, workspace, i):
    """Friction at a turn of the slide, the mean of what it is before and after it."""
    return 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sticking(v, way, place, workspace, i):
    """1 where the contact sticks, 0 where it does not."""
    return 1.0 if way == 0.0 else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def held(begin, end, way, workspace, i, h):
    """(share of a part of a step in which the contact sticks; share inside it at which it begins to slip, 2: nowhere;
    irreversible part of the slide where that turns inside it, that of its end without)."""
    return 1.0 if way == 0.0 else 0.0, 2.0, irreversible_slide(end[0], end[3], workspace, i)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def begin(workspace, i):
    """Set what a law has of its own state by the common one when a lane takes a case: nothing."""


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def settles(workspace, i):
    """Whether the memory of a lane has had the same form at the ends of the last cycles, so that its numbers can move
    on as the motion does."""
    return True


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def resume(workspace, i):
    """Set what follows from the common state and from the numbers that moved on with it: nothing."""


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def crossing(y0, m0, c2, c3, u):
    """u of [0, 1] at which y0 + m0 u + c2 u^2 + c3 u^3 is 0, by Newton's method from u."""
    for _ in range(4):
        slope = m0 + u * (2 * c2 + 3 * c3 * u)
        u = u - (y0 + u * (m0 + u * (c2 + u * c3))) / slope if slope != 0.0 else u
        u = min(max(u, 0.0), 1.0)
    return u


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def linear(workspace, i, s0, c0):
    """(x, x') after a step in a slip."""
    x, v = workspace[X * LANES + i], workspace[V * LANES + i]
    pull = workspace[WAY * LANES + i] * workspace[GK * LANES + i]
    x1 = (
        workspace[A11 * LANES + i] * x
        + workspace[A12 * LANES + i] * v
        + workspace[SX * LANES + i] * s0
        + workspace[CX * LANES + i] * c0
        - pull * workspace[RX * LANES + i]
    )
    v1 = (
        workspace[A21 * LANES + i] * x
        + workspace[A22 * LANES + i] * v
        + workspace[SV * LANES + i] * s0
        + workspace[CV * LANES + i] * c0
        - pull * workspace[RV * LANES + i]
    )
    return x1, v1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ahead(workspace, i, s0, c0, s1, c1, reads):
    """(x, x', place after a step without a stop, a release or a turn in it; whether there is one); reads: whether what
    the step shows is read, so that a speed that ends at 0 counts as a turn."""
    x, way = workspace[X * LANES + i], workspace[WAY * LANES + i]
    xs, vs = linear(workspace, i, s0, c0)
    held = way == 0.0
    n1 = workspace[P * LANES + i] * s1 - workspace[W * LANES + i] * x
    event = abs(n1) > workspace[GS * LANES + i] if held else way * vs < 0.0 or (reads and vs == 0.0)
    x1, v1 = x if held else xs, 0.0 if held else vs
    return x1, v1, x1, event


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def advance(workspace, i, s0, c0, s1, c1, h):
    """(x, v, way, place at the end of a step h; share u of the step up to an event; x, v and place there; x where the
    slide turns, that of the end without a turn; kink: jump of the acceleration at the event).

    way: sign of the slip, 0 stuck; s0, c0, s1, c1: sine and cosine of the drive at both ends.
    """
    x, v, way = workspace[X * LANES + i], workspace[V * LANES + i], workspace[WAY * LANES + i]
    damp, square, push = (
        workspace[D * LANES + i],
        workspace[W * LANES + i],
        workspace[P * LANES + i],
    )
    gk, gs = workspace[GK * LANES + i], workspace[GS * LANES + i]
    pull = way * gk
    xs, vs = linear(workspace, i, s0, c0)
    n0, n1 = push * s0 - square * x, push * s1 - square * x
    held = way == 0.0
    side = way if not held else 1.0 if n1 > 0.0 else -1.0
    y0 = gs - side * n0 if held else way * v
    y1 = gs - side * n1 if held else way * vs
    m0 = -side * push * c0 if held else way * (n0 - damp * v - pull)
    m1 = -side * push * c1 if held else way * (push * s1 - square * xs - damp * vs - pull)
    # a stop that does not hold to the end of its step is a release before the next one
    u, miss, slope, area = root(y0, y1, h * m0, h * m1, -1.0 if held and y0 < 0.0 else 0.0)
    event = y1 < 0.0
    r = h - u * h
    xe = x if held else x + way * h * area
    n = side * (gs - miss) if held else slope * way / h + pull
    sticks = (n if n > 0.0 else -n) <= gs
    # what a constant force, and one that rises with the angle, moves in the rest r of the step
    r2 = r * r
    e2 = damp * damp - square
    one = r2 * (0.5 + r * (-damp / 6 + r * (e2 / 24 - r * damp * (e2 - square) / 120)))
    one_v = r * (1.0 + r * (-damp / 2 + r * (e2 / 6 - r * damp * (e2 - square) / 24)))
    two = r2 * r * (1.0 / 6 + r * (-damp / 24 + r * e2 / 120))
    two_v = r2 * (0.5 + r * (-damp / 6 + r * e2 / 24))
    three = r2 * r2 * (1.0 / 24 - r * damp / 120)
    three_v = r2 * r * (1.0 / 6 - r * damp / 24)
    rise, bend = -side * slope / h, -(n + square * x)
    free = n - side * gk
    xr = x + free * one + rise * two + bend * three
    vr = free * one_v + rise * two_v + bend * three_v
    xf, vf = xs + 2 * pull * one, vs + 2 * pull * one_v
    x1 = (xr if held else xe if sticks else xf) if event else x if held else xs
    v1 = (vr if held else 0.0 if sticks else vf) if event else 0.0 if held else vs
    way1 = (side if held else 0.0 if sticks else -way) if event else way
    kink = (free if held else -slope * way / h if sticks else 2 * pull) if event else 0.0
    u = u if event else 1.0
    xe = xe if event else x1
    turn = x1 if held or not event else xe
    return x1, v1, way1, x1, u, xe, 0.0 if event else v1, xe, turn, kink
