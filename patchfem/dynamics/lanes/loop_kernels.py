"""The march of many cases side by side: one step of all lanes, then the next; measures are folded as they come.

Cost: some 2 ns a step and case on a core with vectors of eight numbers.
"""

from math import nan, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from . import rigid_kernels as law
from .names_kernels import (
    ACCELERATION,
    ALONG,
    BASE,
    BEGUN,
    C1,
    C3,
    CASE,
    CLOSE,
    COS,
    CYCLE,
    ENDS,
    EVENT,
    F_FIRST,
    F_LAST,
    FIRST,
    FORCE,
    GROUP,
    HIGH,
    IN,
    LANES,
    LAST,
    LONGEST,
    LOST,
    LOW,
    MEAN,
    NEAR,
    NUMBER,
    NUMBERS,
    OUT,
    OWN,
    PASSED,
    PAST,
    PATH,
    PLACE,
    POWER,
    PULL,
    PULL_HIGH,
    PULL_LOW,
    RANGE,
    S1,
    S3,
    SECANT,
    SEEN,
    SHOW,
    SHOWN,
    SIN,
    SLIP_HIGH,
    SLIP_LOW,
    START_COS,
    START_SIN,
    STARTS,
    STATE,
    STATES,
    STICK,
    STUCK,
    SUMS,
    SURE,
    SURE_SUM,
    TOLD,
    TURNED,
    WAS_PLACE,
    WAS_V,
    WAS_X,
    WAY,
    D,
    P,
    V,
    W,
    X,
)
from .rigid_kernels import highest


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def step(workspace, i, s0, c0, s1, c1, h):
    """Move a lane over a step and add to its sums; what `advance` of its law gives."""
    x, v, way, place = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    done = law.advance(workspace, i, s0, c0, s1, c1, h)
    x1, v1, way1, place1, u, _, ve, pe, turn, kink = done
    workspace[X * LANES + i], workspace[V * LANES + i] = x1, v1
    workspace[WAY * LANES + i], workspace[PLACE * LANES + i] = way1, place1
    workspace[PATH * LANES + i] += law.path(place, pe, place1, v1, workspace, i)
    # what a jump of the acceleration inside the step leaves of the trapezoidal rule
    edge = kink * h * (u * (1 - u) / 2 - 1 / 12)
    workspace[IN * LANES + i] += s1 * v1 - (s0 + u * (s1 - s0)) * edge
    workspace[LOST * LANES + i] += v1 * v1 - 2 * ve * edge
    workspace[POWER * LANES + i] += abs(s1 * v1)
    workspace[HIGH * LANES + i] = max(workspace[HIGH * LANES + i], max(x1, turn))
    workspace[LOW * LANES + i] = min(workspace[LOW * LANES + i], min(x1, turn))
    workspace[COS * LANES + i] += x1 * c1
    workspace[SIN * LANES + i] += x1 * s1
    return x, v, way, place, done


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def glide(workspace, i, s0, c0, s1, c1, h):
    """Move a lane over a step in which nothing happens; in another one it is left where it is and marked."""
    x, v, place = workspace[X * LANES + i], workspace[V * LANES + i], workspace[PLACE * LANES + i]
    x1, v1, place1, event = law.ahead(workspace, i, s0, c0, s1, c1, False)
    far = law.furthest(x, v, x1, v1, h) if law.folds() else x1
    on = 0.0 if event else 1.0
    workspace[EVENT * LANES + i] = 1.0 - on
    workspace[X * LANES + i], workspace[V * LANES + i] = x if event else x1, v if event else v1
    workspace[PLACE * LANES + i] = place if event else place1
    power = on * (s1 * v1)
    workspace[PATH * LANES + i] += on * law.path(place, place1, place1, v1, workspace, i)
    workspace[IN * LANES + i] += power
    workspace[LOST * LANES + i] += on * (v1 * v1)
    workspace[POWER * LANES + i] += abs(power)
    high, low = workspace[HIGH * LANES + i], workspace[LOW * LANES + i]
    workspace[HIGH * LANES + i] = high if event else max(high, far)
    workspace[LOW * LANES + i] = low if event else min(low, far)
    workspace[COS * LANES + i] += on * (x1 * c1)
    workspace[SIN * LANES + i] += on * (x1 * s1)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def happens(workspace, marked, busy):
    """Number of the first lanes, `busy` of them, in which a step holds an event; writes which into `marked`
    (LANES + 1,)."""
    count = 0
    for i in range(busy):
        marked[count] = i
        count += 1 if workspace[EVENT * LANES + i] > 0.0 else 0
    return count


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cycle(workspace, marked, table, h, busy):
    """Move the first lanes, `busy` of them, over a cycle of the drive; table (2, n + 1): sine and cosine at the
    steps."""
    width = (busy + (1 << GROUP) - 1) >> GROUP << GROUP
    for k in range(table.shape[1] - 1):
        s0, c0, s1, c1 = table[0, k], table[1, k], table[0, k + 1], table[1, k + 1]
        law.foretell(workspace, s0, c0)
        for i in range(width):
            glide(workspace, i, s0, c0, s1, c1, h)
        for j in range(happens(workspace, marked, busy)):
            step(workspace, marked[j], s0, c0, s1, c1, h)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def watch(workspace, i, s0, c0, s1, c1, h):
    """Move a lane over a step of the last cycles in which nothing happens and fold what it shows, as `look` does; in
    another one it is left as it is and marked."""
    x, v, way, place = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    f0, stick = (
        law.friction_force(x, v, way, place, s0, workspace, i),
        law.sticking(v, way, place, workspace, i),
    )
    x1, v1, place1, event = law.ahead(workspace, i, s0, c0, s1, c1, True)
    f1, on = law.friction_force(x1, v1, way, place1, s1, workspace, i), 0.0 if event else 1.0
    slipped, friction_work = (
        law.irreversible_slide(x1, place1, workspace, i),
        law.path(place, place1, place1, v1, workspace, i),
    )
    out, base = workspace[OUT * LANES + i], workspace[BASE * LANES + i]
    damp, push, square = (
        workspace[D * LANES + i],
        workspace[P * LANES + i],
        workspace[W * LANES + i],
    )
    a0, a1 = push * s0 - damp * v - square * x - f0, push * s1 - damp * v1 - square * x1 - f1
    r0, r1 = (
        h * law.rise(v, a0, way, place, workspace, i, 0),
        h * law.rise(v1, a1, way, place1, workspace, i, 3),
    )
    moves = 0.0 if law.RESTS and way == 0.0 else out
    best = highest(
        out * a0 + base * s0,
        out * a1 + base * s1,
        h * (moves * (push * c0 - damp * a0 - square * v) + base * c0) - moves * r0,
        h * (moves * (push * c1 - damp * a1 - square * v1) + base * c1) - moves * r1,
    )
    peak, one = highest(f0, f1, r0, r1), on * 0.5 * (f0 + f1) * (x1 - x)
    power, run = on * (s1 * v1), workspace[STICK * LANES + i] + h * stick
    high, low, longest = (
        workspace[HIGH * LANES + i],
        workspace[LOW * LANES + i],
        workspace[LONGEST * LANES + i],
    )
    far, near = workspace[SLIP_HIGH * LANES + i], workspace[SLIP_LOW * LANES + i]
    pull_high, pull_low = workspace[PULL_HIGH * LANES + i], workspace[PULL_LOW * LANES + i]
    largest, force, stuck = (
        workspace[ACCELERATION * LANES + i],
        workspace[FORCE * LANES + i],
        workspace[STICK * LANES + i],
    )
    workspace[EVENT * LANES + i] = 1.0 - on
    workspace[X * LANES + i], workspace[V * LANES + i] = x if event else x1, v if event else v1
    workspace[PLACE * LANES + i] = place if event else place1
    workspace[PATH * LANES + i] += on * friction_work
    workspace[IN * LANES + i] += power
    workspace[LOST * LANES + i] += on * (v1 * v1)
    workspace[POWER * LANES + i] += abs(power)
    workspace[HIGH * LANES + i] = high if event else max(high, x1)
    workspace[LOW * LANES + i] = low if event else min(low, x1)
    workspace[COS * LANES + i] += on * (x1 * c1)
    workspace[SIN * LANES + i] += on * (x1 * s1)
    workspace[ACCELERATION * LANES + i] = largest if event else max(largest, best)
    workspace[STUCK * LANES + i] += on * h * stick
    workspace[LONGEST * LANES + i] = longest if event else max(longest, run)
    workspace[STICK * LANES + i] = stuck if event else stick * run
    workspace[FORCE * LANES + i] = force if event else max(force, peak)
    workspace[SLIP_HIGH * LANES + i] = far if event else max(far, slipped)
    workspace[SLIP_LOW * LANES + i] = near if event else min(near, slipped)
    workspace[TURNED * LANES + i] += one
    workspace[PASSED * LANES + i] += abs(one)
    workspace[C1 * LANES + i] += on * (x1 * c1)
    workspace[S1 * LANES + i] += on * (x1 * s1)
    workspace[C3 * LANES + i] += on * (x1 * (c1 * (4 * c1 * c1 - 3)))
    workspace[S3 * LANES + i] += on * (x1 * (s1 * (3 - 4 * s1 * s1)))
    workspace[MEAN * LANES + i] += on * x1
    workspace[PULL * LANES + i] += on * f1
    workspace[PULL_HIGH * LANES + i] = pull_high if event or not x1 > high else nan
    workspace[PULL_LOW * LANES + i] = pull_low if event or not x1 < low else nan


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def look(workspace, i, s0, c0, s1, c1, h):
    """Move a lane over a step of the last cycles in which something happens and fold what it shows."""
    high, low = workspace[HIGH * LANES + i], workspace[LOW * LANES + i]
    x, v, way, place, done = step(workspace, i, s0, c0, s1, c1, h)
    x1, v1, way1, place1, u, xe, ve, pe, turn, _ = done
    out, base = workspace[OUT * LANES + i], workspace[BASE * LANES + i]
    damp, push, square = (
        workspace[D * LANES + i],
        workspace[P * LANES + i],
        workspace[W * LANES + i],
    )
    f0, f1 = (
        law.friction_force(x, v, way, place, s0, workspace, i),
        law.friction_force(x1, v1, way1, place1, s1, workspace, i),
    )
    a0, a1 = push * s0 - damp * v - square * x - f0, push * s1 - damp * v1 - square * x1 - f1
    # the acceleration on both sides of an event, and at its vertices between it and the ends
    t = u * h
    se = s0 * (1 - t * t / 2 + t**4 / 24) + c0 * t * (1 - t * t / 6 + t**4 / 120)
    ce = c0 * (1 - t * t / 2 + t**4 / 24) - s0 * t * (1 - t * t / 6 + t**4 / 120)
    before, after = (
        law.friction_force(xe, ve, way, pe, se, workspace, i),
        law.friction_force(xe, ve, way1, pe, se, workspace, i),
    )
    rest = push * se - damp * ve - square * xe
    ae, af = rest - before, rest - after
    moves, moves1 = (
        0.0 if law.RESTS and way == 0.0 else out,
        0.0 if law.RESTS and way1 == 0.0 else out,
    )
    # slopes of the friction
    r0, re = (
        t * law.rise(v, a0, way, place, workspace, i, 0),
        t * law.rise(ve, ae, way, pe, workspace, i, 1),
    )
    rf, r1 = (
        (h - t) * law.rise(ve, af, way1, pe, workspace, i, 2),
        (h - t) * law.rise(v1, a1, way1, place1, workspace, i, 3),
    )
    best = max(
        highest(
            out * a0 + base * s0,
            out * ae + base * se,
            t * (moves * (push * c0 - damp * a0 - square * v) + base * c0) - moves * r0,
            t * (moves * (push * ce - damp * ae - square * ve) + base * ce) - moves * re,
        ),
        highest(
            out * af + base * se,
            out * a1 + base * s1,
            (h - t) * (moves1 * (push * ce - damp * af - square * ve) + base * ce) - moves1 * rf,
            (h - t) * (moves1 * (push * c1 - damp * a1 - square * v1) + base * c1) - moves1 * r1,
        ),
    )
    if not law.folds():
        workspace[ACCELERATION * LANES + i] = max(workspace[ACCELERATION * LANES + i], best)
    # sticks and releases
    stick, slips, furthest = law.held((x, v, a0, place), (xe, ve, ae, pe), way, workspace, i, t)
    stick1, slips1, furthest1 = law.held(
        (xe, ve, af, pe), (x1, v1, a1, place1), way1, workspace, i, h - t
    )
    stuck = u * stick, (1 - u) * stick1
    workspace[STUCK * LANES + i] += h * (stuck[0] + stuck[1])
    run = workspace[STICK * LANES + i] + h * stuck[0]
    longest = max(workspace[LONGEST * LANES + i], run)
    workspace[LONGEST * LANES + i] = longest
    run = run if stick > 0.0 and (u >= 1.0 or (law.TURNS_HELD and way1 == 0.0)) else 0.0
    workspace[STICK * LANES + i] = run + h * stuck[1]
    lets_go = way == 0.0 and way1 != 0.0
    start = t if lets_go else t * slips if slips <= 1.0 else t + (h - t) * slips1
    begins = 1.0 if lets_go or slips <= 1.0 or slips1 <= 1.0 else 0.0
    sb = s0 * (1 - start * start / 2 + start**4 / 24) + c0 * start * (
        1 - start * start / 6 + start**4 / 120
    )
    cb = c0 * (1 - start * start / 2 + start**4 / 24) - s0 * start * (
        1 - start * start / 6 + start**4 / 120
    )
    workspace[STARTS * LANES + i] += begins
    workspace[START_COS * LANES + i] += begins * (1 - 2 * sb * sb)
    workspace[START_SIN * LANES + i] += begins * 2 * sb * cb
    # the loop
    pull = law.at_turn(turn, way, place, pe, workspace, i)
    peak = max(highest(f0, before, r0, re), highest(after, f1, rf, r1))
    if not law.folds():
        workspace[FORCE * LANES + i] = max(
            workspace[FORCE * LANES + i], peak if turn == x1 else max(peak, abs(pull))
        )
    slipped, slipped1 = (
        law.irreversible_slide(xe, pe, workspace, i),
        law.irreversible_slide(x1, place1, workspace, i),
    )
    most, least = (
        max(max(slipped, slipped1), max(furthest, furthest1)),
        min(min(slipped, slipped1), min(furthest, furthest1)),
    )
    workspace[SLIP_HIGH * LANES + i] = max(workspace[SLIP_HIGH * LANES + i], most)
    workspace[SLIP_LOW * LANES + i] = min(workspace[SLIP_LOW * LANES + i], least)
    one, two = 0.5 * (f0 + before) * (xe - x), 0.5 * (after + f1) * (x1 - xe)
    if not law.folds():
        workspace[TURNED * LANES + i] += one + two
        workspace[PASSED * LANES + i] += abs(one) + abs(two)
    workspace[C1 * LANES + i] += x1 * c1
    workspace[S1 * LANES + i] += x1 * s1
    workspace[C3 * LANES + i] += x1 * c1 * (4 * c1 * c1 - 3)
    workspace[S3 * LANES + i] += x1 * s1 * (3 - 4 * s1 * s1)
    workspace[MEAN * LANES + i] += x1
    workspace[PULL * LANES + i] += f1
    turned = v != 0.0 and v * v1 <= 0.0
    higher, lower = max(x1, turn) > high, min(x1, turn) < low
    workspace[PULL_HIGH * LANES + i] = (
        (pull if turned else nan) if higher else workspace[PULL_HIGH * LANES + i]
    )
    workspace[PULL_LOW * LANES + i] = (
        (pull if turned else nan) if lower else workspace[PULL_LOW * LANES + i]
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def fetch(case, i, cases, motion, workspace):
    """Put a case in the lane i."""
    for n in range(NUMBERS):
        workspace[(NUMBER + n) * LANES + i] = cases[case, n]
    size = cases.shape[1] - NUMBERS
    table = len(workspace) - size * (LANES - i)
    for n in range(size):
        workspace[table + n] = cases[case, NUMBERS + n]
    for n in range(motion.shape[1]):
        workspace[(n if n < STATE else n - STATE + OWN) * LANES + i] = motion[case, n]
    workspace[CASE * LANES + i], workspace[CYCLE * LANES + i] = case, 0.0
    workspace[WAS_X * LANES + i], workspace[WAS_V * LANES + i] = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
    )
    workspace[WAS_PLACE * LANES + i] = workspace[PLACE * LANES + i]
    law.begin(workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move(i, other, workspace, size):
    """Put the case of another lane in the lane i; size: numbers of its table."""
    for n in range(len(workspace) // LANES - size):
        workspace[n * LANES + i] = workspace[n * LANES + other]
    table, from_there = len(workspace) - size * (LANES - i), len(workspace) - size * (LANES - other)
    for n in range(size):
        workspace[table + n] = workspace[from_there + n]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bring(case, i, workspace, motion):
    """Keep the motion of the lane i as that of a case."""
    for n in range(motion.shape[1]):
        motion[case, n] = workspace[(n if n < STATE else n - STATE + OWN) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turn_over(i, workspace, history, case, k, share):
    """Write the extremes and the phasor of the cycle k of a lane and begin the next one; share: 2 over the steps."""
    x, begun = workspace[X * LANES + i], workspace[WAS_X * LANES + i]
    history[case, k, 0], history[case, k, 1] = (
        workspace[LOW * LANES + i],
        workspace[HIGH * LANES + i],
    )
    history[case, k, 2] = share * (workspace[COS * LANES + i] + 0.5 * (begun - x))
    history[case, k, 3] = share * workspace[SIN * LANES + i]
    workspace[COS * LANES + i] = workspace[SIN * LANES + i] = 0.0
    open_at(i, workspace)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def open_at(i, workspace):
    """Note where a cycle of a lane begins."""
    x = workspace[X * LANES + i]
    workspace[HIGH * LANES + i] = workspace[LOW * LANES + i] = x
    workspace[WAS_X * LANES + i], workspace[WAS_V * LANES + i] = x, workspace[V * LANES + i]
    workspace[WAS_PLACE * LANES + i] = workspace[PLACE * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def repeats(i, workspace):
    """Whether the cycle of a lane ends where it began."""
    size = CLOSE * (workspace[HIGH * LANES + i] - workspace[LOW * LANES + i])
    return (
        abs(workspace[X * LANES + i] - workspace[WAS_X * LANES + i]) <= size
        and abs(workspace[V * LANES + i] - workspace[WAS_V * LANES + i]) <= size
        and abs(workspace[PLACE * LANES + i] - workspace[WAS_PLACE * LANES + i]) <= size
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def proven(i, workspace):
    """Whether the cycle after a leap ends where the map of the leap foretold."""
    size = law.PROVEN * (workspace[HIGH * LANES + i] - workspace[LOW * LANES + i])
    same = True
    for m in range(len(STATES) - 1):
        same = (
            same
            and abs(workspace[STATES[m] * LANES + i] - workspace[(PAST + m) * LANES + i]) <= size
        )
    return same


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def changes(number, n, workspace, i):
    """The last three changes of a number from cycle to cycle, the nth of those that are kept."""
    last, one, two = (
        workspace[number * LANES + i],
        workspace[(PAST + n) * LANES + i],
        workspace[(PAST + TOLD + n) * LANES + i],
    )
    return last - one, one - two, two - workspace[(PAST + 2 * TOLD + n) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def remember(i, workspace):
    """Keep how a cycle of a lane ends."""
    for k in range(ENDS - 1, 0, -1):
        for n in range(len(STATES) + len(SUMS) + law.KEPT):
            workspace[(PAST + k * TOLD + n) * LANES + i] = workspace[
                (PAST + (k - 1) * TOLD + n) * LANES + i
            ]
    for n in range(len(STATES)):
        workspace[(PAST + n) * LANES + i] = workspace[STATES[n] * LANES + i]
    for n in range(len(SUMS)):
        workspace[(PAST + len(STATES) + n) * LANES + i] = workspace[SUMS[n] * LANES + i]
    for n in range(law.KEPT):
        workspace[(PAST + len(STATES) + len(SUMS) + n) * LANES + i] = workspace[
            (OWN + n) * LANES + i
        ]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cut_short(i, workspace, low, high):
    """Whether an extreme of the last cycle of a lane, `low` or `high`, is where the cycle begins or ends while the
    slide goes on: not at its turn, which may be the extreme of later cycles."""
    x, begun = workspace[X * LANES + i], workspace[PAST * LANES + i]
    return (workspace[V * LANES + i] != 0.0 and (x == low or x == high)) or (
        workspace[(PAST + 1) * LANES + i] != 0.0 and (begun == low or begun == high)
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def map_of(i, workspace, history, case, k, size):
    """(a, b, whether they are sure) of the map of a cycle, by which each number changes in the next one: by a of its
    last change and b of that before; size: range of a cycle.

    Two numbers move on by a linear map near a motion that repeats. So a sequence of any number of theirs follows the
    equation of its eigenvalues, which the slide and the speed give; what place and extremes miss of it tells what is
    not linear, and falls as the square of what is left, unless an event moves across the end of the cycle. Of a law
    whose memory would keep that (`PROVEN`) a leap counts where the next cycle repeats.
    """
    (x, x1, x2), (v, v1, v2), (p, p1, p2) = (
        changes(X, 0, workspace, i),
        changes(V, 1, workspace, i),
        changes(PLACE, 2, workspace, i),
    )
    way = workspace[WAY * LANES + i]
    alike = (
        max(abs(x), abs(v)) < NEAR * size
        and law.settles(workspace, i)
        and not cut_short(i, workspace, history[case, k - 1, 0], history[case, k - 1, 1])
    )
    for n in range(ENDS):
        alike = alike and workspace[(PAST + n * TOLD + 3) * LANES + i] == way
    if not alike:
        return 0.0, 0.0, False
    cross, square = x1 * v2 - v1 * x2, x1 * x1 + v1 * v1
    if cross * cross > ALONG * square * (x2 * x2 + v2 * v2):
        a, b = (x * v2 - v * x2) / cross, (x1 * v - v1 * x) / cross
    else:
        a, b = (x * x1 + v * v1) / square, 0.0
    miss = max(abs(x - a * x1 - b * x2), max(abs(v - a * v1 - b * v2), abs(p - a * p1 - b * p2)))
    for n in range(4):
        last, one, two = history[case, k - 1, n], history[case, k - 2, n], history[case, k - 3, n]
        miss = max(miss, abs(last - one - a * (one - two) - b * (two - history[case, k - 4, n])))
    root = a * a + 4 * b
    slow = 0.5 * (abs(a) + sqrt(root)) if root > 0.0 else sqrt(-b)
    part = (1 - slow) * (1 - slow * slow)  # what it misses now over what it misses in all
    sure = slow < 1.0 and miss < SURE * size * part
    for n in range(len(SUMS)):
        last, one, two = changes(SUMS[n], len(STATES) + n, workspace, i)
        three = (
            workspace[(PAST + 2 * TOLD + len(STATES) + n) * LANES + i]
            - workspace[(PAST + 3 * TOLD + len(STATES) + n) * LANES + i]
        )
        miss = abs(last - one - a * (one - two) - b * (two - three))
        sure = sure and miss <= SURE_SUM * abs(workspace[SUMS[n] * LANES + i]) * part * (1 - slow)
    return a, b, sure


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def leap(i, workspace, history, case, k, until):
    """Cycles done, after k of them, of a lane whose motion goes on by the map of its cycle up to the cycle `until`, or
    to one that repeats, with the end of the next one foretold; k where it does not."""
    size = history[case, k - 1, 1] - history[case, k - 1, 0]
    if k <= ENDS:
        return k
    a, b, sure = map_of(i, workspace, history, case, k, size)
    if not sure:
        return k
    # the changes after n cycles are p and q of the last two, all of them c and d, and what sums miss of these e and f
    p, q, p1, q1, c, d, e, f, n = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0
    (x, x1, _), (v, v1, _) = changes(X, 0, workspace, i), changes(V, 1, workspace, i)
    begun, more = k - 1, True
    while more:
        p, q, p1, q1 = a * p + b * p1, a * q + b * q1, p, q
        c, d, n = c + p, d + q, n + 1
        e, f = e + c, f + d
        for m in range(4):
            last, one, two = (
                history[case, begun, m],
                history[case, begun - 1, m],
                history[case, begun - 2, m],
            )
            history[case, begun + n, m] = last + c * (last - one) + d * (one - two)
        left = max(abs(p * x + q * x1), abs(p * v + q * v1))
        more = begun + n + 1 < until and left > CLOSE * size
    for m in range(len(SUMS)):
        last, one, two = changes(SUMS[m], len(STATES) + m, workspace, i)
        workspace[SUMS[m] * LANES + i] += n * last + e * (last - one) + f * (one - two)
    # of the cycle after it, whose end is noted where the last one was
    p, q = (
        a * p + b * p1,
        a * q + b * q1,
    )
    for m in range(len(STATES) - 1):
        last, one, _ = changes(STATES[m], m, workspace, i)
        workspace[STATES[m] * LANES + i] += c * last + d * one
        workspace[(PAST + m) * LANES + i] = workspace[STATES[m] * LANES + i] + p * last + q * one
    workspace[(PAST + len(STATES)) * LANES + i] = workspace[SUMS[0] * LANES + i]
    for m in range(law.KEPT):
        last, one, _ = changes(OWN + m, len(STATES) + len(SUMS) + m, workspace, i)
        workspace[(OWN + m) * LANES + i] += c * last + d * one
    open_at(i, workspace)
    law.resume(workspace, i)
    return k + n


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march(cases, order, motion, table, until, history, ended, workspace, marked):
    """March cases up to the end of the cycle `until`, or of one that repeats; a case leaps on once the map of its cycle
    is known, and comes back where a law asks for a proof and the next cycle gives none. A lane that is done takes the
    next case, or that of the last lane.

    cases (n, NUMBERS and those of its table); order (m,): numbers of those that march; motion (n, STATE and more): at
    their begin, and end; table (3, s + 1): sine and cosine at the steps of a cycle, and the step; history (n, c, 4):
    least and largest slide of a cycle [m], and its phasor [m]; ended (n,): cycles done; workspace (numbers of a lane times
    LANES,), marked (LANES + 1,): of the lanes. Cost: 2 to 5 ns a step of a case.
    """
    share, given, proof = (
        2 / (table.shape[1] - 1),
        min(LANES, len(order)),
        1 if law.PROVEN > 0.0 else 0,
    )
    for i in range(LANES):
        fetch(order[min(i, given - 1)], i, cases, motion, workspace)
    busy = given
    while busy > 0:
        cycle(workspace, marked, table, table[2, 0], busy)
        i = 0
        while i < busy:
            case, k = int(workspace[CASE * LANES + i]), int(workspace[CYCLE * LANES + i])
            same = proven(i, workspace) if ended[case] > 0 else repeats(i, workspace)
            turn_over(i, workspace, history, case, k, share)
            done, on = k + 1, k + 1 < until and not same
            if ended[case] > 0:  # the cycle that proves a leap
                on = False
                if not (same and law.settles(workspace, i)):
                    fetch(case, i, cases, motion, workspace)
                    workspace[CYCLE * LANES + i], ended[case] = ended[case], -1
                    i += 1
                    continue
            elif on and ended[case] == 0 and k + 1 + proof < until:
                if proof:
                    bring(case, i, workspace, motion)
                done = leap(i, workspace, history, case, k + 1, until - proof)
                on = done == k + 1
                if proof and not on:
                    ended[case], on = k + 1, True
            workspace[CYCLE * LANES + i] = done
            if on:
                if ended[case] <= 0:
                    remember(i, workspace)
                i += 1
                continue
            ended[case] = done
            bring(case, i, workspace, motion)
            if given < len(order):
                fetch(order[given], i, cases, motion, workspace)
                given, i = given + 1, i + 1
            else:
                busy -= 1
                move(i, busy, workspace, cases.shape[1] - NUMBERS)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pulled(i, workspace, s):
    """Friction of a lane [m] where the sine is s."""
    x, v, way, place = (
        workspace[X * LANES + i],
        workspace[V * LANES + i],
        workspace[WAY * LANES + i],
        workspace[PLACE * LANES + i],
    )
    return law.friction_force(x, v, way, place, s, workspace, i)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def open_cycle(i, workspace):
    """Begin a cycle of what a lane shows."""
    workspace[BEGUN * LANES + i] = workspace[X * LANES + i]
    workspace[MEAN * LANES + i], workspace[PULL * LANES + i] = 0.0, 0.5 * pulled(i, workspace, 0.0)
    rests = law.RESTS and workspace[WAY * LANES + i] == 0.0
    workspace[PULL_HIGH * LANES + i] = workspace[PULL_LOW * LANES + i] = 0.0 if rests else nan


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def close_cycle(i, workspace, first, cycles, h):
    """Take the range, the secant and the means of a cycle of a lane, the first or not, into what it shows."""
    size, begun = (
        workspace[HIGH * LANES + i] - workspace[LOW * LANES + i],
        workspace[BEGUN * LANES + i],
    )
    high, low = workspace[PULL_HIGH * LANES + i], workspace[PULL_LOW * LANES + i]
    # an extreme at an end of the cycle turns beside it, with no force in the mean
    if law.RESTS and size > 0.0:
        high, low = high if high == high else 0.0, low if low == low else 0.0
    secant = (high - low) / size
    workspace[RANGE * LANES + i] += size / cycles
    if secant == secant and size > 0.0:
        workspace[SEEN * LANES + i] += 1.0
        workspace[SECANT * LANES + i] += secant
    mean = h * (workspace[MEAN * LANES + i] + 0.5 * (begun - workspace[X * LANES + i]))
    pull = h * (workspace[PULL * LANES + i] - 0.5 * pulled(i, workspace, 0.0))
    if first:
        workspace[FIRST * LANES + i], workspace[F_FIRST * LANES + i] = mean, pull
    workspace[LAST * LANES + i], workspace[F_LAST * LANES + i] = mean, pull


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def note(workspace, acceleration, k, s):
    """Write the acceleration of the output after k steps, where the sine is s, if it is asked for."""
    for i in range(LANES if acceleration.shape[1] > 0 else 0):
        if workspace[CASE * LANES + i] >= 0.0:
            x, v, pull = workspace[X * LANES + i], workspace[V * LANES + i], pulled(i, workspace, s)
            rate = (
                workspace[P * LANES + i] * s
                - workspace[D * LANES + i] * v
                - workspace[W * LANES + i] * x
                - pull
            )
            acceleration[int(workspace[CASE * LANES + i]), k] = (
                workspace[OUT * LANES + i] * rate + workspace[BASE * LANES + i] * s
            )


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def read(
    cases, order, motion, table, cycles, history, ended, shown, acceleration, workspace, marked
):
    """March cases over their last `cycles` and read what they show; arguments as of `march`.

    ended: the cycle at which a case goes on; shown (n, SHOWN): numbers by their places;
    acceleration (n, steps + 1): absolute acceleration of the output [m s-2] at all steps and at
    their begin, (n, 0) where it is not asked for.
    """
    steps = table.shape[1] - 1
    h = table[2, 0]
    for begin in range(0, len(order), LANES):
        busy = min(LANES, len(order) - begin)
        for i in range(LANES):
            fetch(order[min(begin + i, len(order) - 1)], i, cases, motion, workspace)
            for n in range(SHOW, SHOW + SHOWN):
                workspace[n * LANES + i] = 0.0
            workspace[SLIP_HIGH * LANES + i] = law.irreversible_slide(
                workspace[X * LANES + i], workspace[PLACE * LANES + i], workspace, i
            )
            workspace[SLIP_LOW * LANES + i] = workspace[SLIP_HIGH * LANES + i]
            if begin + i >= len(order):
                workspace[CASE * LANES + i] = -1.0
        note(workspace, acceleration, 0, table[0, 0])
        for k in range(cycles):
            for i in range(busy):
                open_cycle(i, workspace)
            for j in range(steps):
                s0, c0, s1, c1 = table[0, j], table[1, j], table[0, j + 1], table[1, j + 1]
                law.foretell(workspace, s0, c0)
                for i in range((busy + (1 << GROUP) - 1) >> GROUP << GROUP):
                    watch(workspace, i, s0, c0, s1, c1, h)
                for i in range(happens(workspace, marked, busy)):
                    look(workspace, marked[i], s0, c0, s1, c1, h)
                note(workspace, acceleration, k * steps + j + 1, s1)
            for i in range(busy):
                close_cycle(i, workspace, k == 0, cycles, h)
                case = int(workspace[CASE * LANES + i])
                turn_over(i, workspace, history, case, ended[case] + k, 2 / steps)
        for i in range(busy):
            for n in range(SHOWN):
                shown[order[begin + i], n] = workspace[(SHOW + n) * LANES + i]
            bring(order[begin + i], i, workspace, motion)
