"""A step of one mode behind sliders side by side, of one case: of the fourth order between turns of the slide and
closings of its loops, each found inside its step.

Equation, in the angle of the drive: x'' + D x' + W x = P sin - f. Since the slide turned at FROM with the friction HELD
it is f = HELD + side m G(|x - FROM|/m), where m = 2 (Masing's rule), and m = 1 from the start, and where

    G(u) = K LENGTH g(u/LENGTH)

is the force of a first loading, g the `curve`: a power (`power_curve_kernels`, Segalman's Iwan law) or a table
(`table_curve_kernels`, a set of Jenkins elements). A loop that closes is forgotten. The place of a case is its
friction. Twin: many elements, from event to event (`dynamics.events`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from . import power_curve_kernels as curve
from .names_kernels import (
    CURVE,
    ENDS,
    GK,
    HALF,
    LANES,
    LENGTH,
    OWN,
    OWN_MOST,
    PAST,
    PLACE,
    STATES,
    SUMS,
    TOLD,
    WAY,
    WHERE,
    D,
    H,
    K,
    P,
    V,
    W,
    X,
)
from .rigid_kernels import PROVEN, folds, furthest, sticking

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

RESTS = False  # it never holds
TURNS_HELD = True  # an event may leave a stick as it is
# of its own state: sign of the motion; m; slide, friction, irreversible slide and energy at the last turn; slide at
# which something happens next; stiffness now, and in the step: at its begin, before and after its event, at its end;
# path of slip in the step; friction at the last turn that was; whether it ever slipped, whether the first loading is
# remembered, whether all sliders slip; largest gap of a loop that was dropped for want of room, over its size; number
# of points behind; share of the step up to its event in which it sticks; side over m times the length; whole of the
# sliders over their friction
(
    SIDE,
    M,
    FROM,
    HELD,
    SLIP_FROM,
    ENERGY_FROM,
    NEXT,
    STIFF,
    STIFF_0,
    STIFF_1,
    STIFF_2,
    STIFF_3,
    GONE,
    AT_TURN,
    EVER,
    VIRGIN,
    ALL,
    DROPPED,
    BEHIND,
    STUCK_IN,
    PER,
    WHOLE,
) = range(OWN, OWN + 22)
STACK, EACH = OWN + 22, 4  # those points: slide, friction, irreversible slide and energy of each
# those that move on as a motion settles: the first of these points
DEPTH, KEPT = (
    (CURVE - STACK) // EACH,
    OWN_MOST,
)
FORM = SIDE, M, VIRGIN, ALL, BEHIND  # numbers that stay as they are then
OWN_STATE = CURVE - OWN + curve.ROOM
LEAST = 1e-30  # of w
CLOSE = 1e-9  # of a step, by which Newton's last goes: what is left is of its square
MOST = 32  # events of a step
NOTHING, PASSES, TURNS, SLIPS = 0, 1, 2, 3  # what happens, what counts more last
FAR = 1e300


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin(workspace, i):
    """Set what follows from the numbers and the state of a lane that takes a case, or has begun a branch."""
    length = workspace[LENGTH * LANES + i]
    workspace[PER * LANES + i] = workspace[SIDE * LANES + i] / (workspace[M * LANES + i] * length)
    workspace[WHOLE * LANES + i] = workspace[K * LANES + i] * length / workspace[GK * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def settles(workspace, i):
    """Whether the same points have been behind at the ends of the last cycles, and all of them are kept."""
    same = STACK + EACH * workspace[BEHIND * LANES + i] <= OWN + KEPT
    for k in range(ENDS):
        for n in FORM:
            before = workspace[(PAST + k * TOLD + len(STATES) + len(SUMS) + n - OWN) * LANES + i]
            same = same and before == workspace[n * LANES + i]
    return same


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def resume(workspace, i):
    """Set what follows from a motion that moved on."""
    begin(workspace, i)
    curve.begin_at(within(workspace[X * LANES + i], workspace, i), workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def place_of(x, workspace, i):
    """Slide since the last turn at x, over that of all sliders there."""
    return workspace[PER * LANES + i] * (x - workspace[FROM * LANES + i])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def within(x, workspace, i):
    """The place of x on the curve; up to twice the slide at which all slip as if they did not yet, which tells a step
    beyond it where that is."""
    return min(max(place_of(x, workspace, i), LEAST), 2.0 - workspace[ALL * LANES + i])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction(x, workspace, i, when=curve.ASKED):
    """(f, its slope over the slide) at x; when: as of the curve."""
    m, side, stiff = workspace[M * LANES + i], workspace[SIDE * LANES + i], workspace[K * LANES + i]
    g, slope = curve.force(within(x, workspace, i), workspace, i, when)
    return workspace[HELD * LANES + i] + side * m * stiff * workspace[LENGTH * LANES + i] * g, (
        1.0 - workspace[ALL * LANES + i]
    ) * stiff * slope


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def irreversible_slide(x, place, workspace, i, when=curve.ASKED):
    """Irreversible part of the slide, the mean over the sliders by what each carries at most; when: as of the
    curve."""
    m, side, length = (
        workspace[M * LANES + i],
        workspace[SIDE * LANES + i],
        workspace[LENGTH * LANES + i],
    )
    whole = workspace[K * LANES + i] * length
    u = place_of(x, workspace, i)
    w = min(u, 1.0)
    slips = curve.slipped(
        w, side * (place - workspace[HELD * LANES + i]) / (m * whole), workspace, i, when
    )
    return workspace[SLIP_FROM * LANES + i] + side * m * length * (
        workspace[WHOLE * LANES + i] * slips + (u - w)
    )


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def energy(x, place, slip, workspace, i):
    """Elastic energy of the sliders [m^2]: what the friction took since the last turn without what slip lost, where the
    irreversible slide is `slip`."""
    m, side, length = (
        workspace[M * LANES + i],
        workspace[SIDE * LANES + i],
        workspace[LENGTH * LANES + i],
    )
    whole, far = workspace[K * LANES + i] * length, side * (x - workspace[FROM * LANES + i])
    held, most = side * workspace[HELD * LANES + i], workspace[GK * LANES + i]
    w = min(far / (m * length), 1.0)
    work = (
        m
        * m
        * (
            whole * length * curve.work(w, (side * place - held) / (m * whole), workspace, i)
            + most * (far / m - w * length)
        )
    )
    lost = most * side * (slip - workspace[SLIP_FROM * LANES + i])
    return workspace[ENERGY_FROM * LANES + i] + held * far + work - lost


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction_force(x, v, way, place, sine, workspace, i):
    """Friction as an acceleration in the drive's angle [m], > 0 against positive slip."""
    return place


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rise(v, a, way, place, workspace, i, when):
    """Rate of the friction at a speed v at the begin of the last step (0), before and after its event, at its end."""
    return v * workspace[(STIFF_0 + when) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_turn(x, way, place, turned, workspace, i):
    """Friction at the last turn of the slide."""
    return workspace[AT_TURN * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def held(begin, end, way, workspace, i, h):
    """(share of a part of a step in which less than half of the friction slips; 1 where a slip begins at its end
    without an event there, else 2; irreversible part of the slide at its end)."""
    within_slips = workspace[STUCK_IN * LANES + i] if way != 0.0 else 0.0
    workspace[STUCK_IN * LANES + i] = 0.0  # it is of the first part
    return (
        1.0 if way == 0.0 else within_slips,
        1.0 if within_slips > 0.0 else 2.0,
        irreversible_slide(end[0], end[3], workspace, i),
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def path(place, pe, place1, v1, workspace, i):
    """What the last step adds to the path of slip [m]."""
    return workspace[GONE * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rates(x, v, f, k, s0, c0, workspace, i):
    """The acceleration and its rate."""
    damp, square, push = (
        workspace[D * LANES + i],
        workspace[W * LANES + i],
        workspace[P * LANES + i],
    )
    a0 = push * s0 - damp * v - square * x - f
    return a0, push * c0 - damp * a0 - (square + k) * v


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def foretell(workspace, s0, c0):
    """Find the curves of all lanes where Taylor foretells their slides at the end of the next step."""
    if curve.FORETELLS:
        for i in range(LANES):
            x, v, h = workspace[X * LANES + i], workspace[V * LANES + i], workspace[H * LANES + i]
            a0, j0 = rates(
                x,
                v,
                workspace[PLACE * LANES + i],
                workspace[STIFF * LANES + i],
                s0,
                c0,
                workspace,
                i,
            )
            workspace[WHERE * LANES + i] = within(
                x + h * (v + h * (a0 / 2 + h * j0 / 6)), workspace, i
            )
        for i in range(LANES):
            curve.find(workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flow(x, v, f, k, s0, c0, s1, c1, h, workspace, i, when=curve.ASKED):
    """(x, x', f, its slope) after an angle h, by the rule of Hermite on the acceleration and its rate at both ends: its
    law is asked for at a place that Taylor foretells, and followed from there by its slope; when: as of the curve."""
    damp, square, push = (
        workspace[D * LANES + i],
        workspace[W * LANES + i],
        workspace[P * LANES + i],
    )
    a0, j0 = rates(x, v, f, k, s0, c0, workspace, i)
    ahead_x, v1 = x + h * (v + h * (a0 / 2 + h * j0 / 6)), v + h * (a0 + h * j0 / 2)
    ahead_f, k1 = friction(ahead_x, workspace, i, when)
    x1 = ahead_x
    for _ in range(2):
        a1 = push * s1 - damp * v1 - square * x1 - ahead_f - k1 * (x1 - ahead_x)
        j1 = push * c1 - damp * a1 - (square + k1) * v1
        x1 = x + h * (v + h * ((7 * a0 + 3 * a1) / 20 + h * (3 * j0 - 2 * j1) / 60))
        v1 = v + h * ((a0 + a1) / 2 + h * (j0 - j1) / 12)
    return x1, v1, ahead_f + k1 * (x1 - ahead_x), k1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ends_at(x, workspace, i):
    """Slide at which something happens next of a step that begins at x: as far as a step may go, at the latest."""
    side, next_one = workspace[SIDE * LANES + i], workspace[NEXT * LANES + i]
    far = x + side * workspace[M * LANES + i] * workspace[LENGTH * LANES + i] * (
        curve.PART + FAR * workspace[ALL * LANES + i]
    )
    return min(next_one, far) if side > 0.0 else max(next_one, far)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ahead(workspace, i, s0, c0, s1, c1, reads):
    """(x, x', friction after a step without a turn or a closing in it; whether there is one); reads: as of
    `rigid_kernels`."""
    x, v, f, k = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[PLACE * LANES + i],
        workspace[STIFF * LANES + i],
    )
    side = workspace[SIDE * LANES + i]
    x1, v1, f1, k1 = flow(
        x, v, f, k, s0, c0, s1, c1, workspace[H * LANES + i], workspace, i, curve.FOUND
    )
    event = side * v1 < 0.0 or side * (x1 - ends_at(x, workspace, i)) > 0.0 or (reads and v1 == 0.0)
    if reads:
        workspace[STIFF_0 * LANES + i], workspace[STIFF_3 * LANES + i] = k, k1
    workspace[STIFF * LANES + i] = k if event else k1
    workspace[GONE * LANES + i] = side * (
        irreversible_slide(x1, f1, workspace, i, curve.FOUND)
        - irreversible_slide(x, f, workspace, i, curve.HERE)
    )
    curve.go_on(workspace, i, event)
    return x1, v1, f1, event


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def first_event(x, v, a0, x1, v1, a1, h, workspace, i):
    """(share of a step at which something happens first, 1 where nothing does; what)."""
    side, next_one = workspace[SIDE * LANES + i], ends_at(x, workspace, i)
    # the speed as a cubic over the step, the slide as its integral
    m0, m1 = h * a0, h * a1
    c2, c3 = 3 * (v1 - v) - 2 * m0 - m1, m0 + m1 - 2 * (v1 - v)
    share, what, far = 1.0, NOTHING, x1
    if side * v1 < 0.0:
        u = v / (v - v1) if side * v > 0.0 else 1.0 if side * m0 > 0.0 else 0.0
        for _ in range(6):
            slope, before = m0 + u * (2 * c2 + 3 * c3 * u), u
            u = u - (v + u * (m0 + u * (c2 + u * c3))) / slope if slope != 0.0 else u
            u = min(max(u, 0.0), 1.0)
            if abs(u - before) < CLOSE:
                break
        share, what = u, TURNS
        far = x + h * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4)))
    if side * (far - next_one) > 0.0:
        u, most = share * min(max((next_one - x) / (far - x), 0.0), 1.0), share
        for _ in range(6):
            speed, before = side * (v + u * (m0 + u * (c2 + u * c3))), u
            gap = side * (x + h * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4))) - next_one)
            u = min(max(u - gap / (h * speed), 0.0), most) if speed > 0.0 else u
            if abs(u - before) < CLOSE:
                break
        share, what = u, PASSES
    return share, what


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def recall(k, workspace, i):
    """Go on from the point k behind, with all after it forgotten."""
    for n in range(EACH):
        workspace[(FROM + n) * LANES + i] = workspace[(STACK + EACH * k + n) * LANES + i]
    workspace[BEHIND * LANES + i] = k
    workspace[M * LANES + i] = 1.0 if k == 0 and workspace[VIRGIN * LANES + i] > 0.0 else 2.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def drop(workspace, i):
    """Forget the loop behind whose closing changes the least: the one beside a loop of nearly its size."""
    best, gap = 1, FAR
    for k in range(1, DEPTH - 2):
        apart = abs(
            workspace[(STACK + EACH * (k + 2)) * LANES + i]
            - workspace[(STACK + EACH * k) * LANES + i]
        )
        best, gap = (k, apart) if apart < gap else (best, gap)
    size = abs(
        workspace[(STACK + EACH * best) * LANES + i]
        - workspace[(STACK + EACH * (best + 1)) * LANES + i]
    )
    workspace[DROPPED * LANES + i] = max(workspace[DROPPED * LANES + i], gap / size)
    for k in range(best, DEPTH - 2):
        for n in range(EACH):
            workspace[(STACK + EACH * k + n) * LANES + i] = workspace[
                (STACK + EACH * (k + 2) + n) * LANES + i
            ]
    workspace[BEHIND * LANES + i] = DEPTH - 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def turn_round(x, f, slip, workspace, i):
    """Begin a branch where the slide turns."""
    side, stored = workspace[SIDE * LANES + i], energy(x, f, slip, workspace, i)
    if workspace[ALL * LANES + i] > 0.0:
        workspace[VIRGIN * LANES + i] = workspace[BEHIND * LANES + i] = 0.0
    else:
        if workspace[BEHIND * LANES + i] >= DEPTH:
            drop(workspace, i)
        k = int(workspace[BEHIND * LANES + i])
        for n in range(EACH):
            workspace[(STACK + EACH * k + n) * LANES + i] = workspace[(FROM + n) * LANES + i]
        workspace[BEHIND * LANES + i] = k + 1
    workspace[FROM * LANES + i], workspace[HELD * LANES + i] = x, f
    workspace[SLIP_FROM * LANES + i], workspace[ENERGY_FROM * LANES + i] = slip, stored
    workspace[AT_TURN * LANES + i], workspace[SIDE * LANES + i], workspace[M * LANES + i] = (
        f,
        -side,
        2.0,
    )
    workspace[ALL * LANES + i] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def close(x, slip, workspace, i):
    """Forget the loop that closes here, if one does; a slide that all sliders follow goes on from where it would have
    had to turn; slip: the irreversible slide."""
    k, side, length = (
        int(workspace[BEHIND * LANES + i]),
        workspace[SIDE * LANES + i],
        workspace[LENGTH * LANES + i],
    )
    if side * (x - closing(workspace, i)) < 0.0 or k == 0:
        return
    if k == 1 and workspace[VIRGIN * LANES + i] == 0.0:
        most, whole = workspace[GK * LANES + i], workspace[K * LANES + i] * length
        gone, work = (
            curve.slipped(1.0, most / whole, workspace, i, curve.ASKED),
            curve.work(1.0, most / whole, workspace, i),
        )
        workspace[BEHIND * LANES + i], workspace[M * LANES + i] = 0.0, 2.0
        workspace[FROM * LANES + i], workspace[HELD * LANES + i] = (
            x - side * 2 * length,
            -side * most,
        )
        workspace[SLIP_FROM * LANES + i] = slip - side * 2 * length * whole / most * gone
        workspace[ENERGY_FROM * LANES + i] = whole * length * (work - gone)
    else:
        recall(k - 1 if k == 1 else k - 2, workspace, i)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def closing(workspace, i):
    """Slide at which the loop closes, or all sliders slip."""
    k, side, start = (
        int(workspace[BEHIND * LANES + i]),
        workspace[SIDE * LANES + i],
        workspace[FROM * LANES + i],
    )
    if k == 0:
        return start + side * workspace[M * LANES + i] * workspace[LENGTH * LANES + i]
    before = workspace[(STACK + EACH * (k - 1)) * LANES + i]
    return 2 * before - start if k == 1 and workspace[VIRGIN * LANES + i] > 0.0 else before


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def look_ahead(x, workspace, i):
    """Note where something happens next, and whether half of the friction slips."""
    begin(workspace, i)
    side, size = (
        workspace[SIDE * LANES + i],
        workspace[M * LANES + i] * workspace[LENGTH * LANES + i],
    )
    far, end = side * (x - workspace[FROM * LANES + i]), closing(workspace, i)
    slips = far >= size * workspace[HALF * LANES + i] * (1 - 1e-9)
    half = workspace[FROM * LANES + i] + side * size * workspace[HALF * LANES + i]
    if far >= size * (1 - 1e-9) and workspace[BEHIND * LANES + i] == 0.0:
        end, workspace[ALL * LANES + i] = side * FAR, 1.0
    workspace[NEXT * LANES + i] = end if slips or side * (half - end) > 0.0 else half
    workspace[WAY * LANES + i] = side if slips else 0.0
    workspace[EVER * LANES + i] = 1.0 if slips else workspace[EVER * LANES + i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def advance(workspace, i, s0, c0, s1, c1, h):
    """(x, v, way, friction at the end of a step h; share u of the step up to the event that counts: where half of the
    friction slips from or no longer, else a turn; x, v and friction there; x where the slide turns, that of the end
    without a turn; kink: 0, as no acceleration jumps)."""
    x, v, f, k = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[PLACE * LANES + i],
        workspace[STIFF * LANES + i],
    )
    damp, square, push = (
        workspace[D * LANES + i],
        workspace[W * LANES + i],
        workspace[P * LANES + i],
    )
    s, c, left, gone, weight = s0, c0, h, 0.0, NOTHING
    workspace[STIFF_0 * LANES + i] = k
    u, xe, ve, fe, turn, turned, stuck = 1.0, x, v, f, x, False, 0.0
    workspace[STUCK_IN * LANES + i], slip = 0.0, irreversible_slide(x, f, workspace, i)
    for events in range(MOST + 1):
        x1, v1, f1, k1 = flow(x, v, f, k, s, c, s1, c1, left, workspace, i)
        share, what = first_event(
            x,
            v,
            push * s - damp * v - square * x - f,
            x1,
            v1,
            push * s1 - damp * v1 - square * x1 - f1,
            left,
            workspace,
            i,
        )
        if what == NOTHING or events == MOST or left <= 0.0:
            break
        t = share * left
        se, ce = (
            s * (1 - t * t / 2 + t**4 / 24) + c * t * (1 - t * t / 6 + t**4 / 120),
            c * (1 - t * t / 2 + t**4 / 24) - s * t * (1 - t * t / 6 + t**4 / 120),
        )
        begun, was = slip, workspace[WAY * LANES + i]
        x, v, f, k = flow(x, v, f, k, s, c, se, ce, t, workspace, i)
        f, before = friction(x, workspace, i)
        slip = irreversible_slide(x, f, workspace, i)
        gone += abs(slip - begun)
        s, c, left, stuck = se, ce, left - t, stuck + (t if was == 0.0 else 0.0)
        if what == TURNS:
            v, turn, turned = 0.0, x, True
            turn_round(x, f, slip, workspace, i)
        else:
            close(x, slip, workspace, i)
        look_ahead(x, workspace, i)
        f, k = friction(x, workspace, i)
        slip = irreversible_slide(x, f, workspace, i) if what == PASSES else slip
        now = SLIPS if workspace[WAY * LANES + i] != was else what
        if now >= weight:
            weight, u, xe, ve, fe = now, 1 - left / h, x, v, f
            workspace[STIFF_1 * LANES + i], workspace[STIFF_2 * LANES + i] = before, k
            workspace[STUCK_IN * LANES + i] = stuck / (h - left) if now == SLIPS else 0.0
    workspace[GONE * LANES + i] = gone + abs(irreversible_slide(x1, f1, workspace, i) - slip)
    workspace[STIFF * LANES + i] = workspace[STIFF_3 * LANES + i] = k1
    curve.begin_at(within(x1, workspace, i), workspace, i)
    if weight == NOTHING:
        xe, ve, fe = x1, v1, f1
        workspace[STIFF_1 * LANES + i] = workspace[STIFF_2 * LANES + i] = k1
    return x1, v1, workspace[WAY * LANES + i], f1, u, xe, ve, fe, turn if turned else x1, 0.0
