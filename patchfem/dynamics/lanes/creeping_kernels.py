"""A step of one mode under the rate law of eq. 2.4, of one case: Runge and Kutta's of order 4.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f, f = GK tanh(x' / LENGTH). The place of a case is its
friction. Twin: a run by high order (`dynamics.smooth`).
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from .names_kernels import A11, A12, GK, LANES, LENGTH, PLACE, WAY, D, P, V, W, X

RESTS = False  # it never holds
TURNS_HELD = False
MOST = 18.0  # argument from which tanh is 1 to the last bit
H, MIDDLE = A11, A12  # of the numbers of a case: the step, and half of one over the cosine of half of it


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def hyperbolic(y):
    """tanh(y) to 2e-13, by exp(-2 |y|) as the 64th power of seven terms of its series; no branch, so that a compiler
    takes several lanes at once."""
    size = min(abs(y), MOST)
    z = size * (-2.0 / 64)
    e = 1 + z * (1 + z * (1 / 2 + z * (1 / 6 + z * (1 / 24 + z * (1 / 120 + z * (1 / 720 + z / 5040))))))
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    part = (1 - e) / (1 + e)
    return part if y > 0.0 else -part


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def felt(x, way, place, sine, room, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return place


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rise(v, a, way, place, room, i, when):
    """Rate of the friction at a speed v and an acceleration a."""
    most = room[GK * LANES + i]
    share = place / most
    return most / room[LENGTH * LANES + i] * (1 - share) * (1 + share) * a


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def at_turn(x, way, place, room, i):
    """Friction at a turn of the slide."""
    return 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def slid(x, place, room, i):
    """Irreversible part of the slide: all of it."""
    return x


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def path(place, pe, place1, v1, room, i):
    """What a step adds to the path of slip [m], at its end: the power of the friction over its limit."""
    return place1 * v1 * room[H * LANES + i] / room[GK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def ahead(room, i, s0, c0, s1, c1):
    """(x, x', friction after a step; whether the slide turns in it)."""
    x, v, f = room[X * LANES + i], room[V * LANES + i], room[PLACE * LANES + i]
    damp, square, push = room[D * LANES + i], room[W * LANES + i], room[P * LANES + i]
    most, share, h = room[GK * LANES + i], 1 / room[LENGTH * LANES + i], room[H * LANES + i]
    half, middle = h / 2, push * room[MIDDLE * LANES + i] * (s0 + s1)
    a0 = push * s0 - damp * v - square * x - f
    v1 = v + half * a0
    a1 = middle - damp * v1 - square * (x + half * v) - most * hyperbolic(share * v1)
    v2 = v + half * a1
    a2 = middle - damp * v2 - square * (x + half * v1) - most * hyperbolic(share * v2)
    v3 = v + h * a2
    a3 = push * s1 - damp * v3 - square * (x + h * v2) - most * hyperbolic(share * v3)
    ve = v + h / 6 * (a0 + 2 * (a1 + a2) + a3)
    return x + h / 6 * (v + 2 * (v1 + v2) + v3), ve, most * hyperbolic(share * ve), v * ve < 0.0


@njit(error_model="numpy", **LEAN)
def advance(room, i, s0, c0, s1, c1, h):
    """(x, v, way, friction at the end of a step h; share u of the step up to a turn; x, v and friction there; x where
    the slide turns, that of the end without a turn; kink: 0, as no acceleration jumps)."""
    x, v, way, f = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    x1, v1, f1, turns = ahead(room, i, s0, c0, s1, c1)
    if not turns:
        return x1, v1, way, f1, 1.0, x1, v1, f1, x1, 0.0
    damp, square, push = room[D * LANES + i], room[W * LANES + i], room[P * LANES + i]
    # the speed as a cubic over the step, the slide as its integral
    m0, m1 = h * (push * s0 - damp * v - square * x - f), h * (push * s1 - damp * v1 - square * x1 - f1)
    c2, c3 = 3 * (v1 - v) - 2 * m0 - m1, m0 + m1 - 2 * (v1 - v)
    u = v / (v - v1)
    for _ in range(4):
        slope = m0 + u * (2 * c2 + 3 * c3 * u)
        u = u - (v + u * (m0 + u * (c2 + u * c3))) / slope if slope != 0.0 else u
        u = min(max(u, 0.0), 1.0)
    turn = x + h * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4)))
    return x1, v1, way, f1, u, turn, 0.0, 0.0, turn, 0.0
