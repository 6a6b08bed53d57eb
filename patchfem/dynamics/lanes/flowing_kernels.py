"""A step of one mode under a law of one stretch, of one case: Runge and Kutta's of order 4, each side of a reversal and
of a kink of the law by itself, in parts where the speed passes a layer in which the force changes.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f(z, x'), z' = g(z, x') x', z the stretch of the contact
[m], the place of a case. f and g are those of `friction`, whose numbers have lengths in m and angles for times, so that
a force is one over the mass [m]. Twin: a run by high order (`dynamics.smooth`).
"""

from math import cos, nan, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...friction.laws import tanh_kernels as friction
from .names_kernels import (
    ACCELERATION,
    BASE,
    FIRST_OF_LAW,
    FORCE,
    IN,
    LANES,
    LOST,
    MIDDLE,
    OUT,
    OWN,
    PASSED,
    PLACE,
    SLIP_HIGH,
    SLIP_LOW,
    TURNED,
    WAY,
    D,
    H,
    P,
    V,
    W,
    X,
)
from .rigid_kernels import PROVEN as PROVEN
from .rigid_kernels import crossing, highest
from .rigid_kernels import foretell as foretell
from .rigid_kernels import settles as settles

RESTS = TURNS_HELD = False  # it never holds
# of its own state: friction, mean square of the stretches, friction work of the last step, whether that is read
FELT, SQUARE, WORK, READS = range(OWN, OWN + 4)
OWN_STATE, KEPT = 4, 2  # the friction and the mean square move on as a motion settles
PARTS = 4  # of a step: a reversal and a kink on either side of it
CORRECTED = 2  # times, by Newton, is the place of an event, which a cubic over a kink misses by the second order
FINEST = 64  # parts of a step through a layer
LAYER_EDGE = 5.0  # speed over that of the layer beyond which its force is taken as constant
LAYER_STEP = 20.0  # change of the speed over that of the layer in a part of a step h, over h
MIN_LAYER_STEP = 0.25  # the same of the finest steps, over the speed of the layer alone
CLEAR = 2.0  # times the friction, by which the other forces exceed it where the speed of a step goes one way
# irreversible share of the slide from which it slips; of the part of a step where it begins
SHARE, HALVINGS = (
    0.5,
    24,
)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def numbers(workspace, i):
    """Return the numbers of the law (7,), the first one free, as its `rate_equation` takes them."""
    at = FIRST_OF_LAW
    return (
        0.0,
        workspace[at * LANES + i],
        workspace[(at + 1) * LANES + i],
        workspace[(at + 2) * LANES + i],
        workspace[(at + 3) * LANES + i],
        workspace[(at + 4) * LANES + i],
        workspace[(at + 5) * LANES + i],
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def layer_of_speeds(k, h):
    """Return the speed at the edge of the layer, and the change of the speed in a part of a step h through it.

    The numbers of a law with such a layer begin with its limit and 1 over the speed of the layer.
    """
    return LAYER_EDGE / k[2], max(LAYER_STEP * h, MIN_LAYER_STEP) / k[2]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction_force(x, v, way, place, sine, workspace, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return friction.rate_equation(numbers(workspace, i), place, v, way)[0]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rise(v, a, way, place, workspace, i, when):
    """Rate of the friction at a speed v and an acceleration a."""
    _, gain, by_stretch, by_speed = friction.rate_equation(numbers(workspace, i), place, v, way)
    return by_stretch * gain * v + by_speed * a


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_turn(x, way, place, turned, workspace, i):
    """Friction at a turn of the slide, of the place there."""
    return friction_force(x, 0.0, way, turned, 0.0, workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def irreversible_slide(x, place, workspace, i):
    """Irreversible part of the slide."""
    return x - place


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def path(place, pe, place1, v1, workspace, i):
    """Friction work of a step over the mass [m^2]."""
    return workspace[WORK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def followed(k, z, far, rises, way):
    """Stretch after a slide `far` that raises it by `rises`, by the law itself where the slide alone tells."""
    if friction.IS_RATE_INDEPENDENT:
        return friction.integrate_stretch(k, z, 0.0, far, way)[0]
    return z + rises


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def run(workspace, i, state, way, drive, h):
    """(x, x', friction, place, mean square of the stretches; friction work) after an angle h in the direction `way`
    from the first five; drive: its sine at the start, in the middle and at the end."""
    x, v, f, z, q = state
    k, push = numbers(workspace, i), workspace[P * LANES + i]
    damp, square, half = workspace[D * LANES + i], workspace[W * LANES + i], h / 2
    g = friction.rate_equation(k, z, v, way)[1] * v
    a = push * drive[0] - damp * v - square * x - f
    v1, z1 = v + half * a, followed(k, z, half * v, half * g, way)
    f1, gain, _, _ = friction.rate_equation(k, z1, v1, way)
    g1, a1 = gain * v1, push * drive[1] - damp * v1 - square * (x + half * v) - f1
    v2, z2 = v + half * a1, followed(k, z, half * v1, half * g1, way)
    f2, gain, _, _ = friction.rate_equation(k, z2, v2, way)
    g2, a2 = gain * v2, push * drive[1] - damp * v2 - square * (x + half * v1) - f2
    v3, z3 = v + h * a2, followed(k, z, h * v2, h * g2, way)
    f3, gain, _, _ = friction.rate_equation(k, z3, v3, way)
    g3, a3 = gain * v3, push * drive[2] - damp * v3 - square * (x + h * v2) - f3
    part = h / 6
    far, ve = part * (v + 2 * (v1 + v2) + v3), v + part * (a + 2 * (a1 + a2) + a3)
    work = part * (f * v + 2 * (f1 * v1 + f2 * v2) + f3 * v3)
    ze = z + part * (g + 2 * (g1 + g2) + g3)
    qe = ze * ze
    if friction.IS_RATE_INDEPENDENT:
        ze, qe, work = friction.integrate_stretch(k, z, q, far, way)
    return (x + far, ve, friction.rate_equation(k, ze, ve, way)[0], ze, qe), work


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin(workspace, i):
    """Set the friction of a lane that takes a case."""
    workspace[FELT * LANES + i] = friction_force(
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
        0.0,
        workspace,
        i,
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def resume(workspace, i):
    """Set what follows from a motion that moved on."""
    begin(workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begun(workspace, i):
    """State of a lane as `run` takes it."""
    return (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[FELT * LANES + i],
        workspace[PLACE * LANES + i],
        workspace[SQUARE * LANES + i],
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sticking(v, way, place, workspace, i):
    """1 where less than SHARE of the slide is irreversible, 0 where it is not."""
    gain = friction.rate_equation(numbers(workspace, i), place, v, way)[1]
    return 1.0 if abs(1 - gain) < SHARE else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ahead(workspace, i, s0, c0, s1, c1, reads):
    """(x, x', place after a step; whether the slide turns or the law has a kink in it); reads: whether what the step
    shows is read, so that the begin or end of a stick and a stretch that turns over count too."""
    way, state = workspace[WAY * LANES + i], begun(workspace, i)
    (x1, v1, f1, z1, q1), work = run(
        workspace,
        i,
        state,
        way,
        (s0, workspace[MIDDLE * LANES + i] * (s0 + s1), s1),
        workspace[H * LANES + i],
    )
    if friction.HAS_SPEED_LAYER:
        edge, width = layer_of_speeds(numbers(workspace, i), workspace[H * LANES + i])
        near = 0.0 if state[1] * v1 < 0.0 else min(abs(state[1]), abs(v1))
        event = (near < edge and abs(v1 - state[1]) > width) or (reads and state[1] * v1 <= 0.0)
    else:
        event = (
            way * v1 < 0.0
            or ((reads or friction.HAS_ZERO_KINK) and state[3] * z1 < 0.0)
            or (
                reads
                and (
                    v1 == 0.0
                    or sticking(state[1], way, state[3], workspace, i)
                    != sticking(v1, way, z1, workspace, i)
                )
            )
        )
    workspace[FELT * LANES + i], workspace[SQUARE * LANES + i] = (
        state[2] if event else f1,
        state[4] if event else q1,
    )
    workspace[WORK * LANES + i], workspace[READS * LANES + i] = work, 1.0 if reads else 0.0
    return x1, v1, z1, event


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def zero(y0, y1, m0, m1):
    """u of [0, 1] at which the cubic with these values and slopes at its ends is 0, from the secant on."""
    return crossing(y0, m0, 3 * (y1 - y0) - 2 * m0 - m1, m0 + m1 - 2 * (y1 - y0), y0 / (y0 - y1))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def first_event(workspace, i, state, after, way, drive, h):
    """(share of a run of the angle h up to its first event, whether the slide turns there); 1, False without one."""
    k, push = numbers(workspace, i), workspace[P * LANES + i]
    damp, square = workspace[D * LANES + i], workspace[W * LANES + i]
    (x, v, f, z, _), (x1, v1, f1, z1, _) = state, after
    u, turns = 1.0, False
    if way * v1 < 0.0:
        u = (
            zero(
                v,
                v1,
                h * (push * drive[0] - damp * v - square * x - f),
                h * (push * drive[2] - damp * v1 - square * x1 - f1),
            )
            if way * v > 0.0
            else 0.0
        )
        turns = True
    if friction.HAS_ZERO_KINK and z * z1 < 0.0:
        bend = zero(
            z,
            z1,
            h * v * friction.rate_equation(k, z, v, way)[1],
            h * v1 * friction.rate_equation(k, z1, v1, way)[1],
        )
        u, turns = (bend, False) if bend < u else (u, turns)
    return u, turns


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cubic(y, y1, m, m1, u):
    """A cubic with these values and slopes at the ends of [0, 1], at u."""
    w = 1 - u
    return w * w * ((1 + 2 * u) * y + u * m) + u * u * ((1 + 2 * w) * y1 - w * m1)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def folds():
    """Whether `advance` folds what a step shows of itself."""
    return friction.HAS_SPEED_LAYER


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def furthest(x, v, x1, v1, h):
    """Slide at the turn in a step that no event marks, that of its end without one."""
    u = v / (v - v1)
    return cubic(x, x1, h * v, h * v1, u) if friction.HAS_SPEED_LAYER and v * v1 < 0.0 else x1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def onward(s, c, t):
    """(sine, cosine) an angle t of up to a fifth after these, to 1e-9."""
    t2 = t * t
    cosine = 1 + t2 * (-1 / 2 + t2 * (1 / 24 - t2 * (1 / 720)))
    sine = t * (1 + t2 * (-1 / 6 + t2 * (1 / 120 - t2 * (1 / 5040))))
    return s * cosine + c * sine, c * cosine - s * sine


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def by_speed(workspace, i, state, s, c, end):
    """(angle, state at its end as of `run`, friction work) until the speed is `end`, by Runge and Kutta's rule over the
    speed, in which the force of a layer is known beforehand; s, c: sine and cosine of the drive at the begin."""
    x, v, f, z, q = state
    k, push, damp, square = (
        numbers(workspace, i),
        workspace[P * LANES + i],
        workspace[D * LANES + i],
        workspace[W * LANES + i],
    )
    half = (end - v) / 2
    middle, part = v + half, half / 3
    fm, fe = friction.rate_equation(k, z, middle, 1.0)[0], friction.rate_equation(k, z, end, 1.0)[0]
    r = 1 / (push * s - damp * v - square * x - f)
    r1 = 1 / (push * onward(s, c, half * r)[0] - damp * middle - square * (x + half * v * r) - fm)
    r2 = 1 / (
        push * onward(s, c, half * r1)[0] - damp * middle - square * (x + half * middle * r1) - fm
    )
    r3 = 1 / (
        push * onward(s, c, 2 * half * r2)[0]
        - damp * end
        - square * (x + 2 * half * middle * r2)
        - fe
    )
    mean = 2 * (r1 + r2)
    return (
        part * (r + mean + r3),
        (x + part * (v * r + middle * mean + end * r3), end, fe, z, q),
        part * (f * v * r + fm * middle * mean + fe * end * r3),
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def through(workspace, i, s0, c0, s1, c1, h):
    """`advance` of a law with a layer of speeds, in parts that follow it: of the speed, where this goes one way however
    large the friction is, else like parts of the step. Adds to the sums of the step what the trapezoidal rule leaves
    of them beside its ends, and folds the peaks and the loop of the parts."""
    k, state, work, u, at = numbers(workspace, i), begun(workspace, i), 0.0, 1.0, 0.0
    push, out, base = (
        workspace[P * LANES + i],
        workspace[OUT * LANES + i],
        workspace[BASE * LANES + i],
    )
    damp, square = workspace[D * LANES + i], workspace[W * LANES + i]
    most = k[1]
    edge, width = layer_of_speeds(k, h)
    begin = state[1]
    free = push * s0 - damp * begin - square * state[0]
    begins, side = free - state[2], 1.0 if free > 0.0 else -1.0
    flies = side * free > CLEAR * most + h * abs(push * c0 - damp * begins - square * begin)
    count = FINEST
    if not flies:
        (_, v1, _, _, _), _ = run(
            workspace, i, state, 1.0, (s0, workspace[MIDDLE * LANES + i] * (s0 + s1), s1), h
        )
        near = 0.0 if begin * v1 < 0.0 else min(abs(begin), abs(v1))
        count = int(min(abs(v1 - begin) / width, FINEST - 1.0)) + 1 if near < edge else 1
    s, c, a = s0, c0, begins
    xe, powers, squares = nan, 0.0, 0.0
    for n in range(count):
        v, rest, last = state[1], h - at, n == count - 1
        part, follows, after, done = 0.0, flies and not last and side * v < edge, state, 0.0
        if follows:
            end = -side * edge if side * v < -edge else v + side * width
            part, after, done = by_speed(workspace, i, state, s, c, end)
            follows = 0.0 < part < rest
        if not follows:
            part, last = rest if flies or last else h / count, flies or last
            drive = (s, onward(s, c, part / 2)[0], s1 if last else onward(s, c, part)[0])
            after, done = run(workspace, i, state, 1.0, drive, part)
        s2, c2 = (s1, c1) if last else onward(s, c, part)
        (x, v, f, _, _), (x1, v1, f1, _, _) = state, after
        a1 = push * s2 - damp * v1 - square * x1 - f1
        if workspace[READS * LANES + i] > 0.0:
            r, r1 = (
                part * rise(v, a, 1.0, 0.0, workspace, i, 0),
                part * rise(v1, a1, 1.0, 0.0, workspace, i, 3),
            )
            best = highest(
                out * a + base * s,
                out * a1 + base * s2,
                part * (out * (push * c - damp * a - square * v) + base * c) - out * r,
                part * (out * (push * c2 - damp * a1 - square * v1) + base * c2) - out * r1,
            )
            workspace[ACCELERATION * LANES + i] = max(workspace[ACCELERATION * LANES + i], best)
            workspace[FORCE * LANES + i] = max(workspace[FORCE * LANES + i], highest(f, f1, r, r1))
            area = 0.5 * (f + f1) * (x1 - x)
            workspace[TURNED * LANES + i] += area
            workspace[PASSED * LANES + i] += abs(area)
        if v * v1 <= 0.0 and v != 0.0:
            share = zero(v, v1, part * a, part * a1)
            u, xe = (at + share * part) / h, cubic(x, x1, part * v, part * v1, share)
        # Hermite's rule of the integral of a part
        powers += part * (s * v + s2 * v1 + part / 6 * (c * v + s * a - c2 * v1 - s2 * a1)) / 2
        squares += part * (v * v + v1 * v1 + part / 3 * (v * a - v1 * a1)) / 2
        work, at, state, s, c, a = work + done, at + part, after, s2, c2, a1
        if last:
            break
    v, (x1, v1, f1, z1, q1) = begin, state
    # the ends of the trapezoidal rule are those of the whole run
    workspace[IN * LANES + i] += (
        powers / h + h / 12 * (c1 * v1 + s1 * a - c0 * v - s0 * begins) - (s0 * v + s1 * v1) / 2
    )
    workspace[LOST * LANES + i] += (
        squares / h + h / 6 * (v1 * a - v * begins) - (v * v + v1 * v1) / 2
    )
    workspace[FELT * LANES + i], workspace[SQUARE * LANES + i], workspace[WORK * LANES + i] = (
        f1,
        q1,
        work,
    )
    turned = xe == xe
    way = 1.0 if v1 > 0.0 else -1.0 if v1 < 0.0 else -workspace[WAY * LANES + i]
    return (
        x1,
        v1,
        way,
        z1,
        u,
        xe if turned else x1,
        0.0 if turned else v1,
        0.0,
        xe if turned else x1,
        0.0,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def advance(workspace, i, s0, c0, s1, c1, h):
    """(x, v, way, place at the end of a step h; share u of the step up to a turn; x, v and place there; x where the
    slide turns, that of the end without a turn; kink: 0, as no acceleration jumps).

    The step ends and begins anew where the slide turns, and where the law has a kink at no stretch. There the
    irreversible part of the slide turns, so its range is told here.
    """
    if friction.HAS_SPEED_LAYER:
        return through(workspace, i, s0, c0, s1, c1, h)
    state, way, at, work, u = begun(workspace, i), workspace[WAY * LANES + i], 0.0, 0.0, 1.0
    k, push, damp, square = (
        numbers(workspace, i),
        workspace[P * LANES + i],
        workspace[D * LANES + i],
        workspace[W * LANES + i],
    )
    xe = ve = ze = 0.0
    for part in range(PARTS):
        rest = h - at
        middle, sine = at + rest / 2, s0 * cos(at) + c0 * sin(at)
        drive = (sine, s0 * cos(middle) + c0 * sin(middle), s1)
        after, done = run(workspace, i, state, way, drive, rest)
        share, turns = first_event(workspace, i, state, after, way, drive, rest)
        if part == PARTS - 1 or not (turns or share < 1.0):
            break
        if share > 0.0:
            for _ in range(1 + CORRECTED):
                end, middle = at + share * rest, at + share * rest / 2
                drive = (sine, s0 * cos(middle) + c0 * sin(middle), s0 * cos(end) + c0 * sin(end))
                (x, v, f, z, q), done = run(workspace, i, state, way, drive, share * rest)
                gain = friction.rate_equation(k, z, v, way)[1] * v
                miss, pace = (
                    (v, push * drive[2] - damp * v - square * x - f) if turns else (z, gain)
                )
                if abs(miss) < rest * abs(pace):
                    share = min(max(share - miss / (rest * pace), 0.0), 1.0)
            work, at = work + done, end
            v, z = 0.0 if turns else v, z if turns else 0.0
            state = x, v, friction.rate_equation(k, z, v, way)[0], z, q
            if not turns and workspace[READS * LANES + i] > 0.0:
                workspace[SLIP_HIGH * LANES + i] = max(workspace[SLIP_HIGH * LANES + i], x)
                workspace[SLIP_LOW * LANES + i] = min(workspace[SLIP_LOW * LANES + i], x)
        if turns:
            way, u, xe, ve, ze = -way, at / h, state[0], state[1], state[3]
    x1, v1, f1, z1, q1 = after
    workspace[FELT * LANES + i], workspace[SQUARE * LANES + i], workspace[WORK * LANES + i] = (
        f1,
        q1,
        work + done,
    )
    turned = way != workspace[WAY * LANES + i]
    xe, ve, ze = (xe, ve, ze) if turned else (x1, v1, z1)
    return x1, v1, way, z1, u if turned else 1.0, xe, ve, ze, xe, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def between(begin, end, way, k, h, u):
    """Place at the share u of a part of a step, by the law itself where the slide alone tells; arguments as of
    `held`."""
    (x, v, _, z), (x1, v1, _, z1) = begin, end
    if friction.IS_RATE_INDEPENDENT:
        return friction.integrate_stretch(k, z, 0.0, cubic(x, x1, h * v, h * v1, u) - x, way)[0]
    return cubic(
        z,
        z1,
        h * v * friction.rate_equation(k, z, v, way)[1],
        h * v1 * friction.rate_equation(k, z1, v1, way)[1],
        u,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sticks(begin, end, way, k, h, u):
    """Whether less than SHARE of the slide is irreversible at the share u of a part of a step; arguments as of
    `held`."""
    (_, v, a, _), (_, v1, a1, _) = begin, end
    speed = cubic(v, v1, h * a, h * a1, u)
    return (
        abs(1 - friction.rate_equation(k, between(begin, end, way, k, h, u), speed, way)[1]) < SHARE
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def edge(begin, end, way, k, h, low, high, turns):
    """Share of a part of a step, in [low, high], at which a stick begins or ends, or where it `turns` the stretch over;
    arguments as of `held`."""
    below, first = begin[3] < 0.0, sticks(begin, end, way, k, h, low)
    for _ in range(HALVINGS):
        u = 0.5 * (low + high)
        if (
            (between(begin, end, way, k, h, u) < 0.0) == below
            if turns
            else sticks(begin, end, way, k, h, u) == first
        ):
            low = u
        else:
            high = u
    return low


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def held(begin, end, way, workspace, i, h):
    """(share of a part of a step in which the contact sticks; share inside it at which it begins to slip, 2: nowhere;
    irreversible part of the slide where that turns inside it, that of its end without).

    begin, end: x, x', x'' and place at the ends of the part, of an angle h; in between, x, x' and, unless the law tells
    it, the place are cubics. The irreversible part turns where there is no stretch; at a kink `advance` tells where.
    """
    k, (x, v, _, z), (x1, v1, _, z1) = numbers(workspace, i), begin, end
    furthest, middle = irreversible_slide(x1, z1, workspace, i), 1.0
    if z * z1 < 0.0:
        middle = edge(begin, end, way, k, h, 0.0, 1.0, True)
        furthest = furthest if friction.HAS_ZERO_KINK else cubic(x, x1, h * v, h * v1, middle)
    first, last = sticks(begin, end, way, k, h, 0.0), sticks(begin, end, way, k, h, 1.0)
    if first != last:
        u = edge(begin, end, way, k, h, 0.0, 1.0, False)
        return u if first else 1 - u, u if first else 2.0, furthest
    if first or not sticks(begin, end, way, k, h, middle):
        return 1.0 if first else 0.0, 2.0, furthest
    # it slips at both ends, by stretches of opposite sign
    u = edge(begin, end, way, k, h, middle, 1.0, False)
    return u - edge(begin, end, way, k, h, 0.0, middle, False), u, furthest
