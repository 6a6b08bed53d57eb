"""The march of many cases side by side: one step of all lanes, then the next; measures are folded as they come.

Cost: some 2 ns a step and case on a core with vectors of eight numbers.
"""

from math import nan, sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
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


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def step(room, i, s0, c0, s1, c1, h):
    """Move a lane over a step and add to its sums; what `advance` of its law gives."""
    x, v, way, place = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    done = law.advance(room, i, s0, c0, s1, c1, h)
    x1, v1, way1, place1, u, _, ve, pe, turn, kink = done
    room[X * LANES + i], room[V * LANES + i] = x1, v1
    room[WAY * LANES + i], room[PLACE * LANES + i] = way1, place1
    room[PATH * LANES + i] += law.path(place, pe, place1, v1, room, i)
    # what a jump of the acceleration inside the step leaves of the trapezoidal rule
    edge = kink * h * (u * (1 - u) / 2 - 1 / 12)
    room[IN * LANES + i] += s1 * v1 - (s0 + u * (s1 - s0)) * edge
    room[LOST * LANES + i] += v1 * v1 - 2 * ve * edge
    room[POWER * LANES + i] += abs(s1 * v1)
    room[HIGH * LANES + i] = max(room[HIGH * LANES + i], max(x1, turn))
    room[LOW * LANES + i] = min(room[LOW * LANES + i], min(x1, turn))
    room[COS * LANES + i] += x1 * c1
    room[SIN * LANES + i] += x1 * s1
    return x, v, way, place, done


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def glide(room, i, s0, c0, s1, c1, h):
    """Move a lane over a step in which nothing happens; in another one it is left where it is and marked."""
    x, v, place = room[X * LANES + i], room[V * LANES + i], room[PLACE * LANES + i]
    x1, v1, place1, event = law.ahead(room, i, s0, c0, s1, c1, False)
    far = law.furthest(x, v, x1, v1, h) if law.folds() else x1
    on = 0.0 if event else 1.0
    room[EVENT * LANES + i] = 1.0 - on
    room[X * LANES + i], room[V * LANES + i] = x if event else x1, v if event else v1
    room[PLACE * LANES + i] = place if event else place1
    power = on * (s1 * v1)
    room[PATH * LANES + i] += on * law.path(place, place1, place1, v1, room, i)
    room[IN * LANES + i] += power
    room[LOST * LANES + i] += on * (v1 * v1)
    room[POWER * LANES + i] += abs(power)
    high, low = room[HIGH * LANES + i], room[LOW * LANES + i]
    room[HIGH * LANES + i] = high if event else max(high, far)
    room[LOW * LANES + i] = low if event else min(low, far)
    room[COS * LANES + i] += on * (x1 * c1)
    room[SIN * LANES + i] += on * (x1 * s1)


@njit(error_model="numpy", forceinline=True, **LEAN)
def happens(room, marked, busy):
    """Number of the first lanes, `busy` of them, in which a step holds an event; writes which into `marked`
    (LANES + 1,)."""
    count = 0
    for i in range(busy):
        marked[count] = i
        count += 1 if room[EVENT * LANES + i] > 0.0 else 0
    return count


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def cycle(room, marked, table, h, busy):
    """Move the first lanes, `busy` of them, over a cycle of the drive; table (2, n + 1): sine and cosine at the
    steps."""
    width = (busy + (1 << GROUP) - 1) >> GROUP << GROUP
    for k in range(table.shape[1] - 1):
        s0, c0, s1, c1 = table[0, k], table[1, k], table[0, k + 1], table[1, k + 1]
        law.foretell(room, s0, c0)
        for i in range(width):
            glide(room, i, s0, c0, s1, c1, h)
        for j in range(happens(room, marked, busy)):
            step(room, marked[j], s0, c0, s1, c1, h)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def watch(room, i, s0, c0, s1, c1, h):
    """Move a lane over a step of the last cycles in which nothing happens and fold what it shows, as `look` does; in
    another one it is left as it is and marked."""
    x, v, way, place = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    f0, stick = law.felt(x, v, way, place, s0, room, i), law.sticking(v, way, place, room, i)
    x1, v1, place1, event = law.ahead(room, i, s0, c0, s1, c1, True)
    f1, on = law.felt(x1, v1, way, place1, s1, room, i), 0.0 if event else 1.0
    slipped, friction_work = law.slid(x1, place1, room, i), law.path(place, place1, place1, v1, room, i)
    out, base = room[OUT * LANES + i], room[BASE * LANES + i]
    damp, push, square = room[D * LANES + i], room[P * LANES + i], room[W * LANES + i]
    a0, a1 = push * s0 - damp * v - square * x - f0, push * s1 - damp * v1 - square * x1 - f1
    r0, r1 = h * law.rise(v, a0, way, place, room, i, 0), h * law.rise(v1, a1, way, place1, room, i, 3)
    moves = 0.0 if law.RESTS and way == 0.0 else out
    best = highest(out * a0 + base * s0, out * a1 + base * s1,
                   h * (moves * (push * c0 - damp * a0 - square * v) + base * c0) - moves * r0,
                   h * (moves * (push * c1 - damp * a1 - square * v1) + base * c1) - moves * r1)
    peak, one = highest(f0, f1, r0, r1), on * 0.5 * (f0 + f1) * (x1 - x)
    power, run = on * (s1 * v1), room[STICK * LANES + i] + h * stick
    high, low, longest = room[HIGH * LANES + i], room[LOW * LANES + i], room[LONGEST * LANES + i]
    far, near = room[SLIP_HIGH * LANES + i], room[SLIP_LOW * LANES + i]
    pull_high, pull_low = room[PULL_HIGH * LANES + i], room[PULL_LOW * LANES + i]
    largest, force, stuck = room[ACCELERATION * LANES + i], room[FORCE * LANES + i], room[STICK * LANES + i]
    room[EVENT * LANES + i] = 1.0 - on
    room[X * LANES + i], room[V * LANES + i] = x if event else x1, v if event else v1
    room[PLACE * LANES + i] = place if event else place1
    room[PATH * LANES + i] += on * friction_work
    room[IN * LANES + i] += power
    room[LOST * LANES + i] += on * (v1 * v1)
    room[POWER * LANES + i] += abs(power)
    room[HIGH * LANES + i] = high if event else max(high, x1)
    room[LOW * LANES + i] = low if event else min(low, x1)
    room[COS * LANES + i] += on * (x1 * c1)
    room[SIN * LANES + i] += on * (x1 * s1)
    room[ACCELERATION * LANES + i] = largest if event else max(largest, best)
    room[STUCK * LANES + i] += on * h * stick
    room[LONGEST * LANES + i] = longest if event else max(longest, run)
    room[STICK * LANES + i] = stuck if event else stick * run
    room[FORCE * LANES + i] = force if event else max(force, peak)
    room[SLIP_HIGH * LANES + i] = far if event else max(far, slipped)
    room[SLIP_LOW * LANES + i] = near if event else min(near, slipped)
    room[TURNED * LANES + i] += one
    room[PASSED * LANES + i] += abs(one)
    room[C1 * LANES + i] += on * (x1 * c1)
    room[S1 * LANES + i] += on * (x1 * s1)
    room[C3 * LANES + i] += on * (x1 * (c1 * (4 * c1 * c1 - 3)))
    room[S3 * LANES + i] += on * (x1 * (s1 * (3 - 4 * s1 * s1)))
    room[MEAN * LANES + i] += on * x1
    room[PULL * LANES + i] += on * f1
    room[PULL_HIGH * LANES + i] = pull_high if event or not x1 > high else nan
    room[PULL_LOW * LANES + i] = pull_low if event or not x1 < low else nan


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def look(room, i, s0, c0, s1, c1, h):
    """Move a lane over a step of the last cycles in which something happens and fold what it shows."""
    high, low = room[HIGH * LANES + i], room[LOW * LANES + i]
    x, v, way, place, done = step(room, i, s0, c0, s1, c1, h)
    x1, v1, way1, place1, u, xe, ve, pe, turn, _ = done
    out, base = room[OUT * LANES + i], room[BASE * LANES + i]
    damp, push, square = room[D * LANES + i], room[P * LANES + i], room[W * LANES + i]
    f0, f1 = law.felt(x, v, way, place, s0, room, i), law.felt(x1, v1, way1, place1, s1, room, i)
    a0, a1 = push * s0 - damp * v - square * x - f0, push * s1 - damp * v1 - square * x1 - f1
    # the acceleration on both sides of an event, and at its vertices between it and the ends
    t = u * h
    se = s0 * (1 - t * t / 2 + t**4 / 24) + c0 * t * (1 - t * t / 6 + t**4 / 120)
    ce = c0 * (1 - t * t / 2 + t**4 / 24) - s0 * t * (1 - t * t / 6 + t**4 / 120)
    before, after = law.felt(xe, ve, way, pe, se, room, i), law.felt(xe, ve, way1, pe, se, room, i)
    rest = push * se - damp * ve - square * xe
    ae, af = rest - before, rest - after
    moves, moves1 = 0.0 if law.RESTS and way == 0.0 else out, 0.0 if law.RESTS and way1 == 0.0 else out
    # slopes of the friction
    r0, re = t * law.rise(v, a0, way, place, room, i, 0), t * law.rise(ve, ae, way, pe, room, i, 1)
    rf, r1 = (h - t) * law.rise(ve, af, way1, pe, room, i, 2), (h - t) * law.rise(v1, a1, way1, place1, room, i, 3)
    best = max(highest(out * a0 + base * s0, out * ae + base * se,
                       t * (moves * (push * c0 - damp * a0 - square * v) + base * c0) - moves * r0,
                       t * (moves * (push * ce - damp * ae - square * ve) + base * ce) - moves * re),
               highest(out * af + base * se, out * a1 + base * s1,
                       (h - t) * (moves1 * (push * ce - damp * af - square * ve) + base * ce) - moves1 * rf,
                       (h - t) * (moves1 * (push * c1 - damp * a1 - square * v1) + base * c1) - moves1 * r1))
    if not law.folds():
        room[ACCELERATION * LANES + i] = max(room[ACCELERATION * LANES + i], best)
    # sticks and releases
    stick, slips, furthest = law.held((x, v, a0, place), (xe, ve, ae, pe), way, room, i, t)
    stick1, slips1, furthest1 = law.held((xe, ve, af, pe), (x1, v1, a1, place1), way1, room, i, h - t)
    stuck = u * stick, (1 - u) * stick1
    room[STUCK * LANES + i] += h * (stuck[0] + stuck[1])
    run = room[STICK * LANES + i] + h * stuck[0]
    longest = max(room[LONGEST * LANES + i], run)
    room[LONGEST * LANES + i] = longest
    run = run if stick > 0.0 and (u >= 1.0 or (law.TURNS_HELD and way1 == 0.0)) else 0.0
    room[STICK * LANES + i] = run + h * stuck[1]
    lets_go = way == 0.0 and way1 != 0.0
    start = t if lets_go else t * slips if slips <= 1.0 else t + (h - t) * slips1
    begins = 1.0 if lets_go or slips <= 1.0 or slips1 <= 1.0 else 0.0
    sb = s0 * (1 - start * start / 2 + start**4 / 24) + c0 * start * (1 - start * start / 6 + start**4 / 120)
    cb = c0 * (1 - start * start / 2 + start**4 / 24) - s0 * start * (1 - start * start / 6 + start**4 / 120)
    room[STARTS * LANES + i] += begins
    room[START_COS * LANES + i] += begins * (1 - 2 * sb * sb)
    room[START_SIN * LANES + i] += begins * 2 * sb * cb
    # the loop
    pull = law.at_turn(turn, way, place, pe, room, i)
    peak = max(highest(f0, before, r0, re), highest(after, f1, rf, r1))
    if not law.folds():
        room[FORCE * LANES + i] = max(room[FORCE * LANES + i], peak if turn == x1 else max(peak, abs(pull)))
    slipped, slipped1 = law.slid(xe, pe, room, i), law.slid(x1, place1, room, i)
    most, least = max(max(slipped, slipped1), max(furthest, furthest1)), \
        min(min(slipped, slipped1), min(furthest, furthest1))
    room[SLIP_HIGH * LANES + i] = max(room[SLIP_HIGH * LANES + i], most)
    room[SLIP_LOW * LANES + i] = min(room[SLIP_LOW * LANES + i], least)
    one, two = 0.5 * (f0 + before) * (xe - x), 0.5 * (after + f1) * (x1 - xe)
    if not law.folds():
        room[TURNED * LANES + i] += one + two
        room[PASSED * LANES + i] += abs(one) + abs(two)
    room[C1 * LANES + i] += x1 * c1
    room[S1 * LANES + i] += x1 * s1
    room[C3 * LANES + i] += x1 * c1 * (4 * c1 * c1 - 3)
    room[S3 * LANES + i] += x1 * s1 * (3 - 4 * s1 * s1)
    room[MEAN * LANES + i] += x1
    room[PULL * LANES + i] += f1
    turned = v != 0.0 and v * v1 <= 0.0
    higher, lower = max(x1, turn) > high, min(x1, turn) < low
    room[PULL_HIGH * LANES + i] = (pull if turned else nan) if higher else room[PULL_HIGH * LANES + i]
    room[PULL_LOW * LANES + i] = (pull if turned else nan) if lower else room[PULL_LOW * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def fetch(case, i, cases, motion, room):
    """Put a case in the lane i."""
    for n in range(NUMBERS):
        room[(NUMBER + n) * LANES + i] = cases[case, n]
    size = cases.shape[1] - NUMBERS
    table = len(room) - size * (LANES - i)
    for n in range(size):
        room[table + n] = cases[case, NUMBERS + n]
    for n in range(motion.shape[1]):
        room[(n if n < STATE else n - STATE + OWN) * LANES + i] = motion[case, n]
    room[CASE * LANES + i], room[CYCLE * LANES + i] = case, 0.0
    room[WAS_X * LANES + i], room[WAS_V * LANES + i] = room[X * LANES + i], room[V * LANES + i]
    room[WAS_PLACE * LANES + i] = room[PLACE * LANES + i]
    law.begin(room, i)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def move(i, other, room, size):
    """Put the case of another lane in the lane i; size: numbers of its table."""
    for n in range(len(room) // LANES - size):
        room[n * LANES + i] = room[n * LANES + other]
    table, from_there = len(room) - size * (LANES - i), len(room) - size * (LANES - other)
    for n in range(size):
        room[table + n] = room[from_there + n]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def bring(case, i, room, motion):
    """Keep the motion of the lane i as that of a case."""
    for n in range(motion.shape[1]):
        motion[case, n] = room[(n if n < STATE else n - STATE + OWN) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def turn_over(i, room, history, case, k, share):
    """Write the extremes and the phasor of the cycle k of a lane and begin the next one; share: 2 over the steps."""
    x, begun = room[X * LANES + i], room[WAS_X * LANES + i]
    history[case, k, 0], history[case, k, 1] = room[LOW * LANES + i], room[HIGH * LANES + i]
    history[case, k, 2] = share * (room[COS * LANES + i] + 0.5 * (begun - x))
    history[case, k, 3] = share * room[SIN * LANES + i]
    room[COS * LANES + i] = room[SIN * LANES + i] = 0.0
    open_at(i, room)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def open_at(i, room):
    """Note where a cycle of a lane begins."""
    x = room[X * LANES + i]
    room[HIGH * LANES + i] = room[LOW * LANES + i] = x
    room[WAS_X * LANES + i], room[WAS_V * LANES + i] = x, room[V * LANES + i]
    room[WAS_PLACE * LANES + i] = room[PLACE * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def repeats(i, room):
    """Whether the cycle of a lane ends where it began."""
    size = CLOSE * (room[HIGH * LANES + i] - room[LOW * LANES + i])
    return abs(room[X * LANES + i] - room[WAS_X * LANES + i]) <= size \
        and abs(room[V * LANES + i] - room[WAS_V * LANES + i]) <= size \
        and abs(room[PLACE * LANES + i] - room[WAS_PLACE * LANES + i]) <= size


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def proven(i, room):
    """Whether the cycle after a leap ends where the map of the leap foretold."""
    size = law.PROVEN * (room[HIGH * LANES + i] - room[LOW * LANES + i])
    same = True
    for m in range(len(STATES) - 1):
        same = same and abs(room[STATES[m] * LANES + i] - room[(PAST + m) * LANES + i]) <= size
    return same


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def changes(number, n, room, i):
    """The last three changes of a number from cycle to cycle, the nth of those that are kept."""
    last, one, two = room[number * LANES + i], room[(PAST + n) * LANES + i], room[(PAST + TOLD + n) * LANES + i]
    return last - one, one - two, two - room[(PAST + 2 * TOLD + n) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def remember(i, room):
    """Keep how a cycle of a lane ends."""
    for k in range(ENDS - 1, 0, -1):
        for n in range(len(STATES) + len(SUMS) + law.KEPT):
            room[(PAST + k * TOLD + n) * LANES + i] = room[(PAST + (k - 1) * TOLD + n) * LANES + i]
    for n in range(len(STATES)):
        room[(PAST + n) * LANES + i] = room[STATES[n] * LANES + i]
    for n in range(len(SUMS)):
        room[(PAST + len(STATES) + n) * LANES + i] = room[SUMS[n] * LANES + i]
    for n in range(law.KEPT):
        room[(PAST + len(STATES) + len(SUMS) + n) * LANES + i] = room[(OWN + n) * LANES + i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def cut_short(i, room, low, high):
    """Whether an extreme of the last cycle of a lane, `low` or `high`, is where the cycle begins or ends while the
    slide goes on: not at its turn, which may be the extreme of later cycles."""
    x, begun = room[X * LANES + i], room[PAST * LANES + i]
    return (room[V * LANES + i] != 0.0 and (x == low or x == high)) \
        or (room[(PAST + 1) * LANES + i] != 0.0 and (begun == low or begun == high))


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def map_of(i, room, history, case, k, size):
    """(a, b, whether they are sure) of the map of a cycle, by which each number changes in the next one: by a of its
    last change and b of that before; size: range of a cycle.

    Two numbers move on by a linear map near a motion that repeats. So a sequence of any number of theirs follows the
    equation of its eigenvalues, which the slide and the speed give; what place and extremes miss of it tells what is
    not linear, and falls as the square of what is left, unless an event moves across the end of the cycle. Of a law
    whose memory would keep that (`PROVEN`) a leap counts where the next cycle repeats.
    """
    (x, x1, x2), (v, v1, v2), (p, p1, p2) = changes(X, 0, room, i), changes(V, 1, room, i), changes(PLACE, 2, room, i)
    way = room[WAY * LANES + i]
    alike = max(abs(x), abs(v)) < NEAR * size and law.settles(room, i) \
        and not cut_short(i, room, history[case, k - 1, 0], history[case, k - 1, 1])
    for n in range(ENDS):
        alike = alike and room[(PAST + n * TOLD + 3) * LANES + i] == way
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
        last, one, two = changes(SUMS[n], len(STATES) + n, room, i)
        three = room[(PAST + 2 * TOLD + len(STATES) + n) * LANES + i] \
            - room[(PAST + 3 * TOLD + len(STATES) + n) * LANES + i]
        miss = abs(last - one - a * (one - two) - b * (two - three))
        sure = sure and miss <= SURE_SUM * abs(room[SUMS[n] * LANES + i]) * part * (1 - slow)
    return a, b, sure


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def leap(i, room, history, case, k, until):
    """Cycles done, after k of them, of a lane whose motion goes on by the map of its cycle up to the cycle `until`, or
    to one that repeats, with the end of the next one foretold; k where it does not."""
    size = history[case, k - 1, 1] - history[case, k - 1, 0]
    if k <= ENDS:
        return k
    a, b, sure = map_of(i, room, history, case, k, size)
    if not sure:
        return k
    # the changes after n cycles are p and q of the last two, all of them c and d, and what sums miss of these e and f
    p, q, p1, q1, c, d, e, f, n = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0
    (x, x1, _), (v, v1, _) = changes(X, 0, room, i), changes(V, 1, room, i)
    begun, more = k - 1, True
    while more:
        p, q, p1, q1 = a * p + b * p1, a * q + b * q1, p, q
        c, d, n = c + p, d + q, n + 1
        e, f = e + c, f + d
        for m in range(4):
            last, one, two = history[case, begun, m], history[case, begun - 1, m], history[case, begun - 2, m]
            history[case, begun + n, m] = last + c * (last - one) + d * (one - two)
        left = max(abs(p * x + q * x1), abs(p * v + q * v1))
        more = begun + n + 1 < until and left > CLOSE * size
    for m in range(len(SUMS)):
        last, one, two = changes(SUMS[m], len(STATES) + m, room, i)
        room[SUMS[m] * LANES + i] += n * last + e * (last - one) + f * (one - two)
    p, q = a * p + b * p1, a * q + b * q1  # of the cycle after it, whose end is noted where the last one was
    for m in range(len(STATES) - 1):
        last, one, _ = changes(STATES[m], m, room, i)
        room[STATES[m] * LANES + i] += c * last + d * one
        room[(PAST + m) * LANES + i] = room[STATES[m] * LANES + i] + p * last + q * one
    room[(PAST + len(STATES)) * LANES + i] = room[SUMS[0] * LANES + i]
    for m in range(law.KEPT):
        last, one, _ = changes(OWN + m, len(STATES) + len(SUMS) + m, room, i)
        room[(OWN + m) * LANES + i] += c * last + d * one
    open_at(i, room)
    law.resume(room, i)
    return k + n


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FAST, **LEAN)
def march(cases, order, motion, table, until, history, ended, room, marked):
    """March cases up to the end of the cycle `until`, or of one that repeats; a case leaps on once the map of its cycle
    is known, and comes back where a law asks for a proof and the next cycle gives none. A lane that is done takes the
    next case, or that of the last lane.

    cases (n, NUMBERS and those of its table); order (m,): numbers of those that march; motion (n, STATE and more): at
    their begin, and end; table (3, s + 1): sine and cosine at the steps of a cycle, and the step; history (n, c, 4):
    least and largest slide of a cycle [m], and its phasor [m]; ended (n,): cycles done; room (numbers of a lane times
    LANES,), marked (LANES + 1,): of the lanes. Cost: 2 to 5 ns a step of a case.
    """
    share, given, proof = 2 / (table.shape[1] - 1), min(LANES, len(order)), 1 if law.PROVEN > 0.0 else 0
    for i in range(LANES):
        fetch(order[min(i, given - 1)], i, cases, motion, room)
    busy = given
    while busy > 0:
        cycle(room, marked, table, table[2, 0], busy)
        i = 0
        while i < busy:
            case, k = int(room[CASE * LANES + i]), int(room[CYCLE * LANES + i])
            same = proven(i, room) if ended[case] > 0 else repeats(i, room)
            turn_over(i, room, history, case, k, share)
            done, on = k + 1, k + 1 < until and not same
            if ended[case] > 0:  # the cycle that proves a leap
                on = False
                if not (same and law.settles(room, i)):
                    fetch(case, i, cases, motion, room)
                    room[CYCLE * LANES + i], ended[case] = ended[case], -1
                    i += 1
                    continue
            elif on and ended[case] == 0 and k + 1 + proof < until:
                if proof:
                    bring(case, i, room, motion)
                done = leap(i, room, history, case, k + 1, until - proof)
                on = done == k + 1
                if proof and not on:
                    ended[case], on = k + 1, True
            room[CYCLE * LANES + i] = done
            if on:
                if ended[case] <= 0:
                    remember(i, room)
                i += 1
                continue
            ended[case] = done
            bring(case, i, room, motion)
            if given < len(order):
                fetch(order[given], i, cases, motion, room)
                given, i = given + 1, i + 1
            else:
                busy -= 1
                move(i, busy, room, cases.shape[1] - NUMBERS)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def pulled(i, room, s):
    """Friction of a lane [m] where the sine is s."""
    x, v, way, place = room[X * LANES + i], room[V * LANES + i], room[WAY * LANES + i], room[PLACE * LANES + i]
    return law.felt(x, v, way, place, s, room, i)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def open_cycle(i, room):
    """Begin a cycle of what a lane shows."""
    room[BEGUN * LANES + i] = room[X * LANES + i]
    room[MEAN * LANES + i], room[PULL * LANES + i] = 0.0, 0.5 * pulled(i, room, 0.0)
    rests = law.RESTS and room[WAY * LANES + i] == 0.0
    room[PULL_HIGH * LANES + i] = room[PULL_LOW * LANES + i] = 0.0 if rests else nan


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def close_cycle(i, room, first, cycles, h):
    """Take the range, the secant and the means of a cycle of a lane, the first or not, into what it shows."""
    size, begun = room[HIGH * LANES + i] - room[LOW * LANES + i], room[BEGUN * LANES + i]
    high, low = room[PULL_HIGH * LANES + i], room[PULL_LOW * LANES + i]
    if law.RESTS and size > 0.0:  # an extreme at an end of the cycle turns beside it, with no force in the mean
        high, low = high if high == high else 0.0, low if low == low else 0.0
    secant = (high - low) / size
    room[RANGE * LANES + i] += size / cycles
    if secant == secant and size > 0.0:
        room[SEEN * LANES + i] += 1.0
        room[SECANT * LANES + i] += secant
    mean = h * (room[MEAN * LANES + i] + 0.5 * (begun - room[X * LANES + i]))
    pull = h * (room[PULL * LANES + i] - 0.5 * pulled(i, room, 0.0))
    if first:
        room[FIRST * LANES + i], room[F_FIRST * LANES + i] = mean, pull
    room[LAST * LANES + i], room[F_LAST * LANES + i] = mean, pull


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def note(room, felt, k, s):
    """Write the acceleration of the output after k steps, where the sine is s, if it is asked for."""
    for i in range(LANES if felt.shape[1] > 0 else 0):
        if room[CASE * LANES + i] >= 0.0:
            x, v, pull = room[X * LANES + i], room[V * LANES + i], pulled(i, room, s)
            rate = room[P * LANES + i] * s - room[D * LANES + i] * v - room[W * LANES + i] * x - pull
            felt[int(room[CASE * LANES + i]), k] = room[OUT * LANES + i] * rate + room[BASE * LANES + i] * s


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FAST, **LEAN)
def read(cases, order, motion, table, cycles, history, ended, shown, felt, room, marked):
    """March cases over their last `cycles` and read what they show; arguments as of `march`.

    ended: the cycle at which a case goes on; shown (n, SHOWN): numbers by their places; felt (n, steps + 1): absolute
    acceleration of the output [m s-2] at all steps and at their begin, (n, 0) where it is not asked for.
    """
    steps = table.shape[1] - 1
    h = table[2, 0]
    for begin in range(0, len(order), LANES):
        busy = min(LANES, len(order) - begin)
        for i in range(LANES):
            fetch(order[min(begin + i, len(order) - 1)], i, cases, motion, room)
            for n in range(SHOW, SHOW + SHOWN):
                room[n * LANES + i] = 0.0
            room[SLIP_HIGH * LANES + i] = law.slid(room[X * LANES + i], room[PLACE * LANES + i], room, i)
            room[SLIP_LOW * LANES + i] = room[SLIP_HIGH * LANES + i]
            if begin + i >= len(order):
                room[CASE * LANES + i] = -1.0
        note(room, felt, 0, table[0, 0])
        for k in range(cycles):
            for i in range(busy):
                open_cycle(i, room)
            for j in range(steps):
                s0, c0, s1, c1 = table[0, j], table[1, j], table[0, j + 1], table[1, j + 1]
                law.foretell(room, s0, c0)
                for i in range((busy + (1 << GROUP) - 1) >> GROUP << GROUP):
                    watch(room, i, s0, c0, s1, c1, h)
                for i in range(happens(room, marked, busy)):
                    look(room, marked[i], s0, c0, s1, c1, h)
                note(room, felt, k * steps + j + 1, s1)
            for i in range(busy):
                close_cycle(i, room, k == 0, cycles, h)
                case = int(room[CASE * LANES + i])
                turn_over(i, room, history, case, ended[case] + k, 2 / steps)
        for i in range(busy):
            for n in range(SHOWN):
                shown[order[begin + i], n] = room[(SHOW + n) * LANES + i]
            bring(order[begin + i], i, room, motion)
