"""Compiled reading of the last cycles of a run off its pieces: ranges, loops, harmonics, peaks, releases.

Everything is an integral or an extreme of the series of the pieces themselves; nothing is sampled.
"""

from math import cos, inf, nan, pi, sin, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .dense_kernels import unfold
from .drive_kernels import AMPLITUDE, CONSTANT, OMEGA, RATE
from .march_kernels import EACH, HEAD
from .memory_kernels import RIGID
from .names_kernels import (
    A3_COS,
    A3_SIN,
    A_COS,
    A_SIN,
    ACCELERATION,
    BEGIN,
    END,
    F_COS,
    F_FIRST,
    F_LAST,
    F_SIN,
    FIRST,
    FORCE,
    HIGH,
    LAST,
    LOW,
    OUT_HIGH,
    OUT_LOW,
    PASSED,
    Q_COS,
    Q_SIN,
    RANGE,
    REACH,
    RING,
    SECANT,
    SLIP_HIGH,
    SLIP_LOW,
    START_COS,
    START_SIN,
    STARTS,
    STUCK,
    SWING,
    TURNED,
    WORK,
)
from .search_kernels import moved
from .series_kernels import _PLACE, _WEIGHT, fastest, largest, points, value

SLIPS = 0.5  # share of the slide that is irreversible from which an interface slips
LASTS = 1e-9  # of a period: a shorter slip is none
RESTS = 1e-9  # of the largest rate: slower is at rest
MOVES = 1e-13  # of the range: a piece with less motion is a rest
NEAR = 0.003  # of a period, in which a turn beyond the border of a cycle counts for it
# columns of an interface in a row, behind its force
SPRING = 1
SHARE = 2
SLIP = 4
WORKED = 5
WAY = 7
PLACE = 8


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def first_of(face, modal_system):
    """Column of the force of an interface in a row."""
    return HEAD + 2 * len(modal_system.square) + EACH * face


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def slide_of(row, face, modal_system):
    """Slide [m] of an interface where a row begins."""
    return row[first_of(face, modal_system) + PLACE]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_of(row, face, modal_system):
    """Rate [m/s] of an interface where a row begins."""
    out = 0.0
    for i in range(len(modal_system.square)):
        out += modal_system.faces[face, i] * row[HEAD + len(modal_system.square) + i]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def closing_force(rows, j, face, modal_system):
    """Force [N] of an interface at the end of the row j, in which no rigid element holds it."""
    at = first_of(face, modal_system)
    step = slide_of(rows[j + 1], face, modal_system) - slide_of(rows[j], face, modal_system)
    return rows[j, at] + rows[j, at + SPRING] * step


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def acceleration(top, h, modal_system, moving, workspace, best):
    """The larger of `best` and the largest |acceleration| [m s-2] of the output over the piece in the workspace, whose
    series is left in the last row but one of workspace.polys; moving: 1 where the base moves."""
    poly = workspace.polys[len(modal_system.reach) + 1]
    whole = 0.0
    for k in range(top - 1):
        part = 0.0
        for i in range(len(modal_system.square)):
            part += modal_system.output[i] * workspace.coefs[k + 2, i]
        poly[k] = part * (k + 1) * (k + 2) / (h * h) + moving * workspace.waves[0, k]
        whole += abs(poly[k])
    return best if whole <= best else largest(poly, top - 2, best, workspace.hulls)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def integrals(row, h, top, border, modal_system, time_state, workspace, run, faces):
    """Add the integrals over the piece of a row, in the workspace, to the numbers; border: (whether it lies in the first
    cycle, in the last)."""
    omega = 2 * pi / time_state.period[0]
    own = fastest(modal_system, workspace.springs) if workspace.held[1] == 0.0 else 0.0
    count = points(0.5 * h * (max(own, time_state.segments[int(row[3]), RATE]) + 3 * omega))
    friction_force = workspace.polys[len(modal_system.reach) + 1]
    for g in range(count):
        u = _PLACE[count, g]
        w = h * _WEIGHT[count, g]
        angle = omega * (row[6] + h * u)
        cosine = cos(angle)
        sine = sin(angle)
        gain = w * value(friction_force, 0, top - 2, u)
        run[A_COS] += gain * cosine
        run[A_SIN] += gain * sine
        run[A3_COS] += gain * cosine * (4 * cosine * cosine - 3)
        run[A3_SIN] += gain * sine * (3 - 4 * sine * sine)
        for f in range(len(modal_system.reach)):
            at = first_of(f, modal_system)
            out = faces[f]
            slide = w * slide_of(row, f, modal_system)
            pull = 0.0
            if workspace.springs[f] == RIGID:
                pull = w * value(workspace.reactions[f], 0, top - 2, u)
            else:
                step = moved(workspace.polys[f], top, u)
                slide = slide + w * step
                pull = w * (row[at] + row[at + SPRING] * step)
                out[PASSED] += abs(pull * value(workspace.polys[f], 0, top - 1, u)) / h
            out[Q_COS] += slide * cosine
            out[Q_SIN] += slide * sine
            out[F_COS] += pull * cosine
            out[F_SIN] += pull * sine
            if border[0]:
                out[FIRST] += slide
                out[F_FIRST] += pull
            if border[1]:
                out[LAST] += slide
                out[F_LAST] += pull


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def ends(row, modal_system, run, faces):
    """Take the state where a row begins, or the run ends, into the ranges."""
    out = 0.0
    for i in range(len(modal_system.square)):
        out += modal_system.output[i] * row[HEAD + i]
        run[REACH] = max(run[REACH], abs(row[HEAD + i]))
    run[OUT_LOW], run[OUT_HIGH] = min(run[OUT_LOW], out), max(run[OUT_HIGH], out)
    for f in range(len(modal_system.reach)):
        one = faces[f]
        at = first_of(f, modal_system)
        slide = slide_of(row, f, modal_system)
        one[LOW], one[HIGH] = min(one[LOW], slide), max(one[HIGH], slide)
        one[SLIP_LOW], one[SLIP_HIGH] = (
            min(one[SLIP_LOW], row[at + SLIP]),
            max(one[SLIP_HIGH], row[at + SLIP]),
        )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def forces(rows, j, top, modal_system, workspace, faces):
    """Take the forces over the row j, whose piece is in the workspace, and the work by its ends."""
    for f in range(len(modal_system.reach)):
        one = faces[f]
        at = first_of(f, modal_system)
        if rows[j, at + SHARE] < SLIPS:
            one[STUCK] += rows[j, 1]
        if workspace.springs[f] == RIGID:
            one[FORCE] = largest(workspace.reactions[f], top - 2, one[FORCE], workspace.hulls)
            continue
        force = rows[j, at]
        last = closing_force(rows, j, f, modal_system)
        one[FORCE] = max(one[FORCE], abs(force), abs(last))
        one[TURNED] += (
            0.5
            * (force + last)
            * (slide_of(rows[j + 1], f, modal_system) - slide_of(rows[j], f, modal_system))
        )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def force_at(rows, j, used, face, modal_system, least):
    """Force [N] of an interface at a turn where the row j begins: the mean of what it is before and after the slide
    rests there, NaN where it jumps and one of both is not known; least [m]: less is no motion."""
    back = j - 1
    on = j
    while (
        back >= 0
        and abs(
            slide_of(rows[back + 1], face, modal_system) - slide_of(rows[back], face, modal_system)
        )
        <= least
    ):
        back -= 1
    while (
        on < used
        and abs(slide_of(rows[on + 1], face, modal_system) - slide_of(rows[on], face, modal_system))
        <= least
    ):
        on += 1
    at = first_of(face, modal_system)
    if back >= 0 and on < used:
        return 0.5 * (closing_force(rows, back, face, modal_system) + rows[on, at])
    here = rows[on if on < used else back if back >= 0 else j, at + SPRING]
    if here == 0.0 or here == RIGID or (back < 0 and on == used):
        return nan
    return rows[on, at] if on < used else closing_force(rows, back, face, modal_system)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turn_near(rows, j, used, forward, face, modal_system, period, slow):
    """Number of the row at whose begin a slide turns, next to the border of a cycle where the row j begins, in which it
    does not; -1 where there is none near."""
    k = j
    while 0 <= k <= used and abs(rows[k, 0] - rows[j, 0]) <= NEAR * period:
        if abs(rate_of(rows[k], face, modal_system)) <= slow:
            return k
        k += 1 if forward else -1
    return -1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turns(rows, used, cycles, face, modal_system, period, out):
    """Mean range [m] and secant stiffness [N/m] of the cycles of an interface."""
    fast = 0.0
    seen = 0
    low = 0
    begun = rows[0, 0]
    for j in range(used + 1):
        fast = max(fast, abs(rate_of(rows[j], face, modal_system)))
    least = MOVES * (out[HIGH] - out[LOW])
    for k in range(cycles):
        top = low
        bottom = low
        high = low
        while high < used and rows[high, 0] + 0.5 * rows[high, 1] < begun + (k + 1) * period:
            high += 1
            slide = slide_of(rows[high], face, modal_system)
            top = high if slide > slide_of(rows[top], face, modal_system) else top
            bottom = high if slide < slide_of(rows[bottom], face, modal_system) else bottom
        size = slide_of(rows[top], face, modal_system) - slide_of(rows[bottom], face, modal_system)
        out[RANGE] += size / cycles
        if top == low or top == high:
            top = turn_near(rows, top, used, top == high, face, modal_system, period, RESTS * fast)
        if bottom == low or bottom == high:
            bottom = turn_near(
                rows, bottom, used, bottom == high, face, modal_system, period, RESTS * fast
            )
        if size > 0.0 and top >= 0 and bottom >= 0:
            secant = (
                force_at(rows, top, used, face, modal_system, least)
                - force_at(rows, bottom, used, face, modal_system, least)
            ) / size
            if secant == secant:
                seen += 1
                out[SECANT] += secant
        low = high
    out[SECANT] = out[SECANT] / seen if seen > 0 else nan


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rung(rows, first, last, modal_system, segment, out):
    """Note what rings over the rows first to last - 1, a stick of one mode behind one interface: the angle by which
    free motion turns, and by the rule of `response.ringing` its largest acceleration."""
    swing = 0.0
    row = rows[first]
    damp = modal_system.damping[0, 0]
    spring = first_of(0, modal_system) + SPRING
    for j in range(first, last):
        swing += (
            sqrt(
                max(
                    modal_system.square[0]
                    + rows[j, spring] * modal_system.reach[0]
                    - 0.25 * damp * damp,
                    0.0,
                )
            )
            * rows[j, 1]
        )
    out[SWING] = max(out[SWING], swing)
    beta = modal_system.square[0] + row[spring] * modal_system.reach[0]
    omega = segment[OMEGA]
    own = beta - 0.25 * damp * damp
    far = beta - omega * omega
    side = damp * omega
    whole = far * far + side * side
    if own <= 0.0 or whole <= 1e-18 * beta * beta:
        return
    own = sqrt(own)
    push = modal_system.base[0] * segment[AMPLITUDE]
    pull = modal_system.faces[0, 0] * row[spring - 1] / modal_system.mass
    sine = -push * sin(row[2])
    cosine = -push * cos(row[2])
    rest = -modal_system.base[0] * segment[CONSTANT] - modal_system.square[0] * row[HEAD] - pull
    z = -rest / beta - (far * sine - side * cosine) / whole
    v = row[HEAD + 1] - omega * (far * cosine + side * sine) / whole
    other = (v + 0.5 * damp * z) / own
    ratio = own / omega
    span = rows[last, 0] - row[0]
    damping = 0.5 * damp / sqrt(beta)
    forced = span * omega > 3 * pi and damping < 1e-3 and abs(ratio - round(ratio)) < 1e-2
    if span * own >= 3 * pi and damping < 0.5 and not forced:
        out[RING] = max(out[RING], abs(modal_system.output[0]) * beta * sqrt(z * z + other * other))


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def changes(rows, used, modal_system, time_state, out):
    """Releases and sticks of the first interface."""
    begun = rows[0, 0]
    period = time_state.period[0]
    at = first_of(0, modal_system)
    alone = len(modal_system.square) == 1 and len(modal_system.reach) == 1
    waits = False
    phase = 0.0
    begun_at = begun
    segment = time_state.segments[int(rows[0, 3])]
    last = rows[0, at + WAY] if rows[0, at + SHARE] >= SLIPS else 0.0
    held = 0 if last == 0.0 else -1
    for j in range(used + 1):
        way = last if j == used else rows[j, at + WAY] if rows[j, at + SHARE] >= SLIPS else 0.0
        if way == last and j < used:
            continue
        if waits and (j == used or rows[j, 0] - begun_at > LASTS * period):
            out[STARTS] += 1.0
            out[START_COS] += cos(2 * phase)
            out[START_SIN] += sin(2 * phase)
        waits = last == 0.0 and way != 0.0 and rows[j, 0] > begun
        phase = rows[j, 2]
        begun_at = rows[j, 0]
        if held >= 0 and (way != 0.0 or j == used):
            if alone and rows[held, at + SPRING] < RIGID:
                rung(rows, held, j, modal_system, segment, out)
            held = -1
        elif way == 0.0 and held < 0:
            held = j
        last = way


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def read(rows, cycles, modal_system, time_state, moving, workspace, run, faces):
    """Numbers of the last cycles by the places of `names_kernels`: run (OF_RUN,) and faces (i, OF_FACE).

    rows (k + 1, w): as `march_kernels.march` writes them, and one of no length for the end; cycles: whole ones among
    them, each of which ends with a piece; moving: 1 where the base moves. Cost: 1 us a piece of one mode.
    """
    used = rows.shape[0] - 1
    period = time_state.period[0]
    run[:] = 0.0
    faces[:] = 0.0
    workspace.held[0] = -1.0
    run[OUT_LOW] = inf
    run[OUT_HIGH] = -inf
    for f in range(len(modal_system.reach)):
        one = faces[f]
        at = first_of(f, modal_system)
        one[LOW] = inf
        one[HIGH] = -inf
        one[SLIP_LOW] = inf
        one[SLIP_HIGH] = -inf
        one[BEGIN] = slide_of(rows[0], f, modal_system)
        one[END] = slide_of(rows[used], f, modal_system)
        one[WORK] = rows[used, at + WORKED] - rows[0, at + WORKED]
    for j in range(used + 1):
        ends(rows[j], modal_system, run, faces)
        h = rows[j, 1]
        if j == used or h <= 0.0:
            continue
        top = unfold(rows[j], h, modal_system, time_state, workspace)
        run[ACCELERATION] = acceleration(top, h, modal_system, moving, workspace, run[ACCELERATION])
        forces(rows, j, top, modal_system, workspace, faces)
        middle = rows[j, 0] + 0.5 * h
        border = middle < rows[0, 0] + period, middle > rows[used, 0] - period
        integrals(rows[j], h, top, border, modal_system, time_state, workspace, run, faces)
    for f in range(len(modal_system.reach)):
        turns(rows, used, cycles, f, modal_system, period, faces[f])
    changes(rows, used, modal_system, time_state, run)
