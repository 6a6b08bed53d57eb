"""Compiled run from event to event of modes behind rigid and elastic-plastic elements.

An event is a yield, the release of a slide that a rigid element holds, a turning point of a slide or of the output
(`search_kernels`), or a border of the drive.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import KIND, SINE, drive_series, phase_of, rate_of, value_now
from .memory_kernels import carried, give_way, holds, pulled, tangent, threshold, turn
from .repeat_kernels import come_back, forget
from .search_kernels import (
    NOTHING,
    OUTPUT_TURNS,
    RELEASES,
    STOPS,
    TURNS,
    YIELDS,
    crossing,
    moved,
    next_event,
    speed_series,
)
from .series_kernels import EPS, NONE, REACH, fastest, motion_series, powers, value
from .slow_kernels import followed, shortened
from .stick_kernels import LAST, at_rest, keep, settle
from .sum_kernels import sums

# how `march` returns; OPEN: no choice of what holds obeys the law
DONE = 0
FULL = 1
TRAVEL = 2
PILED = 3
OPEN = 4
REPEATS = 5
# columns of a row: of the piece, then of every interface behind z and v
HEAD = 8
EACH = 9
# what begins a row: nothing, a yield, a turning point, a change of stick and slip, a border of the drive
ON = 0
YIELDED = 1
TURNED = 2
SWITCHED = 3
BORDERED = 4
AT_ONCE = 1e-12  # share of a piece in which what stood still stands still: two turning points at one place
MOST_IDLE = 1000.0  # events in a row without progress


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def left_of(time_state, stop):
    """Time [s] to the next border: of the drive's segments, of the cycle, or `stop` (cycle, offset)."""
    now = time_state.now
    period = time_state.period[0]
    left = period - now[1]
    if stop[0] == now[0]:
        left = min(left, stop[1] - now[1])
    k = int(now[2]) + 1
    if k < time_state.segments.shape[0] and time_state.segments[k, 0] == now[0]:
        left = min(left, time_state.segments[k, 1] - now[1])
    return max(left, 0.0)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def arrive(time_state, stop, left):
    """Step onto the border `left` [s] away; whether the drive changes there: to another sine, or by a jump."""
    before = int(time_state.now[2])
    cycle = time_state.now[0]
    offset = time_state.now[1] + left
    changes = False
    now = time_state.now
    period = time_state.period[0]
    k = int(now[2]) + 1
    after = (
        k < time_state.segments.shape[0]
        and time_state.segments[k, 0] == now[0]
        and time_state.segments[k, 1] - now[1] <= left
    )
    if after:
        now[1] = time_state.segments[k, 1]
        now[2] = k
    elif stop[0] == now[0] and stop[1] - now[1] <= left:
        now[1] = stop[1]
    else:
        now[0] = now[0] + 1
        now[1] = 0.0
    if now[1] >= period:
        now[0] = now[0] + 1
        now[1] = 0.0
    k = int(now[2]) + 1
    if (
        k < time_state.segments.shape[0]
        and time_state.segments[k, 0] == now[0]
        and time_state.segments[k, 1] <= now[1]
    ):
        now[2] = k
    if int(now[2]) != before:
        segment = time_state.segments[int(now[2])]
        old = value_now(time_state.segments[before], cycle, offset, period)
        new = value_now(segment, now[0], now[1], period)
        changes = (segment[KIND] == SINE and time_state.segments[before, KIND] == SINE) or abs(
            new - old
        ) > 1e-12 * max(abs(old), abs(new))
    if changes:
        now[4] = 0.0
    return changes


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write(row, motion, span, theta, first, modal_system, table, memory, time_state):
    """A row of a piece as it begins: time, span, phase, segment, what begins it, cycle, offset, then z, v, then of
    every interface force, springs, share that slips, its limit, slip, work, loss, direction, slide."""
    n = len(modal_system.square)
    row[0] = time_state.now[0] * time_state.period[0] + time_state.now[1]
    row[1] = span
    row[2] = theta
    row[3] = time_state.now[2]
    row[4] = first
    row[5] = time_state.now[0]
    row[6] = time_state.now[1]
    for i in range(n):
        row[HEAD + i] = motion[0, i]
        row[HEAD + n + i] = motion[1, i]
    for f in range(len(modal_system.reach)):
        at = HEAD + 2 * n + EACH * f
        row[at] = memory.force[f]
        row[at + 1], row[at + 2], row[at + 3] = tangent(f, table, memory)
        row[at + 4] = memory.slip[f]
        row[at + 5] = memory.worked[f]
        row[at + 6] = memory.lost[f]
        row[at + 7] = (
            memory.way[f]
            if table.static[f] == 0.0
            else memory.head[f]
            if abs(memory.head[f]) < 2.0
            else 0.0
        )
        row[at + 8] = memory.place[f]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def advance(u, h, top, motion, modal_system, table, memory, time_state, books, workspace):
    """Move coordinates, slides and elements to u, with the energies that the elements take; whether the output passes
    the travel."""
    n = len(modal_system.square)
    coefs = workspace.coefs
    ledger = books.ledger
    for f in range(len(modal_system.reach)):
        if holds(f, table, memory):
            memory.force[f] = value(workspace.reactions[f], 0, top - 2, u)
            continue
        stiff, share, limit = tangent(f, table, memory)
        step = moved(workspace.polys[f], top, u)
        work = (memory.force[f] + 0.5 * stiff * step) * step
        memory.worked[f] += work
        memory.lost[f] += limit * abs(step)
        memory.slip[f] += share * step
        memory.force[f] += stiff * step
        ledger[3] += work
        ledger[4] += limit * abs(step)
        if share >= 0.5:
            ledger[7] = 1.0
    out = 0.0
    for i in range(n):
        place = coefs[top, i]
        rate = top * coefs[top, i]
        for k in range(top - 1, 0, -1):
            place = place * u + coefs[k, i]
            rate = rate * u + k * coefs[k, i]
        motion[0, i] += u * place
        motion[1, i] = rate / h
        out += modal_system.output[i] * motion[0, i]
    for f in range(len(modal_system.reach)):
        if holds(f, table, memory):
            continue
        place = 0.0
        for i in range(n):
            place += modal_system.faces[f, i] * motion[0, i]
        memory.place[f] = place
    keep(motion, modal_system, memory, workspace)
    widen(out, time_state, books)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def widen(out, time_state, books):
    """Take an output [m] into the extremes of its cycle."""
    cycle = int(time_state.now[0])
    books.extremes[cycle, 0] = min(books.extremes[cycle, 0], out)
    books.extremes[cycle, 1] = max(books.extremes[cycle, 1], out)


@njit(
    error_model="numpy", cache=True, forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT
)
def stored(motion, modal_system, table, memory):
    """Energy of the modes and of the elements [J]."""
    out = 0.0
    for i in range(len(modal_system.square)):
        out += motion[1, i] ** 2 + modal_system.square[i] * motion[0, i] ** 2
    out *= 0.5 * modal_system.mass
    for f in range(len(modal_system.reach)):
        out += carried(f, table, memory)[1]
    return out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def enter(motion, modal_system, table, memory, time_state, workspace):
    """`settle` from here on, the guess and what rests being noted; whether a choice was found."""
    segment = time_state.segments[int(time_state.now[2])]
    now = time_state.now
    for f in range(len(modal_system.reach)):
        stiff = tangent(f, table, memory)[0]
        workspace.springs[f] = (
            0.0 if table.static[f] > 0.0 and workspace.resting[f] == 1.0 else stiff
        )
    h = REACH / max(
        fastest(modal_system, workspace.springs), rate_of(segment, time_state.period[0])
    )
    drive_series(segment, now[0], now[1], time_state.period[0], h, LAST + 1, workspace.waves)
    return settle(motion, modal_system, table, memory, h, workspace)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin(motion, modal_system, table, memory, time_state, workspace):
    """Choose what holds at the start of a run, where a rigid element holds if its slide rests; whether a choice was
    found."""
    rigid = False
    for f in range(len(modal_system.reach)):
        speed = 0.0
        size = 0.0
        for i in range(len(modal_system.square)):
            part = modal_system.faces[f, i] * motion[1, i]
            speed += part
            size += abs(part)
        moves = abs(speed) > 64 * EPS * size
        workspace.signs[f] = (
            0.0 if table.static[f] == 0.0 or not moves else 1.0 if speed > 0 else -1.0
        )
        workspace.resting[f] = 1.0 if table.static[f] > 0.0 and not moves else 0.0
        rigid = rigid or table.static[f] > 0.0
        workspace.orders[f, 0] = 0.0
        workspace.orders[f, 1] = 0.0
        if table.static[f] > 0.0:
            memory.head[f] = workspace.signs[f]
    return enter(motion, modal_system, table, memory, time_state, workspace) if rigid else True


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def wait(motion, modal_system, table, memory):
    """A little longer [s] than until the next element yields, by the speeds of the slides."""
    out = 1e300
    for f in range(len(modal_system.reach)):
        speed = 0.0
        for i in range(len(modal_system.square)):
            speed += modal_system.faces[f, i] * motion[1, i]
        gap = threshold(f, 1.0 if speed > 0 else -1.0, table, memory) - memory.place[f]
        if speed * gap > 0:
            out = min(out, gap / speed)
    return 1.3 / REACH * out


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def output_of(motion, modal_system):
    """Motion of the output [m]."""
    out = 0.0
    for i in range(len(modal_system.square)):
        out += modal_system.output[i] * motion[0, i]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def happen(what, face, sign, modal_system, table, memory, time_state):
    """Change the elements, and note what stands still, as the event asks."""
    if what != NOTHING and what != OUTPUT_TURNS:
        time_state.now[4] = 0.0
    if what == YIELDS:
        give_way(face, sign, table, memory)
    elif what == TURNS:
        turn(face, memory)
        time_state.rest[face] = 1.0
        if modal_system.along == face:
            time_state.rest[len(modal_system.reach)] = 1.0
    elif what == OUTPUT_TURNS:
        time_state.rest[face] = 1.0
    if (what == YIELDS or what == TURNS) and table.static[face] == 0.0:
        memory.force[face] = carried(face, table, memory)[0]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def piece_series(h, rate, slow, motion, force, modal_system, time_state, workspace):
    """Fill the workspace with the series of a piece of h [s] from here on; its highest power. rate: the fastest [1/s]; slow:
    as of `followed`, whose series the workspace has where it is not 0."""
    top = powers(rate * h)
    now = time_state.now
    segment = time_state.segments[int(time_state.now[2])]
    if slow > 0.0:
        shortened(slow * h / REACH, top, len(modal_system.reach), workspace)
    else:
        drive_series(segment, now[0], now[1], time_state.period[0], h, top, workspace.waves)
        motion_series(
            motion[0],
            motion[1],
            force,
            workspace.springs,
            modal_system,
            workspace.waves[0],
            h,
            top,
            workspace.coefs,
            workspace,
        )
    return top


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def passed(top, modal_system, motion, workspace, travel, u):
    """u at which the output, monotone up to `u`, passes +-travel [m]; NONE if it does not."""
    faces = len(modal_system.reach)
    poly = workspace.polys[faces + 1]
    speed_series(modal_system.output, len(modal_system.square), workspace.coefs, top, poly)
    here = output_of(motion, modal_system)
    step = moved(poly, top, u)
    if abs(here + step) <= travel or step == 0.0:
        return NONE
    return crossing(poly, top, (travel if step > 0 else -travel) - here, u, workspace.polys[faces])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin_piece(left, motion, modal_system, table, memory, time_state, workspace):
    """The next piece of the motion as series, and the forces of what holds: (its length [s], `left` [s] at most; the
    rate [1/s] that it was chosen by; the order of the series)."""
    segment = time_state.segments[int(time_state.now[2])]
    for f in range(len(modal_system.reach)):
        workspace.springs[f] = tangent(f, table, memory)[0]
    own = fastest(modal_system, workspace.springs) if workspace.held[1] == 0.0 else 0.0
    slow = followed(motion, memory.force, modal_system, time_state, workspace) if own > 0.0 else 0.0
    rate = slow if slow > 0.0 else max(own, rate_of(segment, time_state.period[0]))
    h = min(
        REACH / rate * min(1.0, max(rate * wait(motion, modal_system, table, memory), 0.02)), left
    )
    top = piece_series(h, rate, slow, motion, memory.force, modal_system, time_state, workspace)
    for f in range(len(modal_system.reach)):
        if holds(f, table, memory):
            memory.force[f] = workspace.reactions[f, 0]
    return h, rate, top


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cross_border(what, left, stop, motion, modal_system, table, memory, past, time_state):
    """Pass the end of a cycle or of a part of the drive: (whether the drive changes, whether the motion repeats)."""
    changes = arrive(time_state, stop, left)
    came = False
    if time_state.now[1] == 0.0 and what == NOTHING:
        came = come_back(motion, modal_system, memory, time_state, past)
    elif time_state.now[1] == 0.0:
        forget(past)
    for f in range(len(modal_system.reach)):  # at every border, so that a run in parts is the run
        memory.force[f] = pulled(f, table, memory)
    return changes, came


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march(stop, motion, modal_system, table, memory, past, time_state, books, workspace, rows):
    """Run from the clock's time to `stop` (cycle, offset [s]).

    motion (2, n), memory, time_state and books move along; past: the state a cycle before, as `repeat_kernels` notes it;
    rows (r, HEAD + 2 n + EACH i): one per piece, none are written where r = 0. Returns (DONE, FULL, TRAVEL, PILED,
    OPEN, or REPEATS at the first border from where on every cycle is the last one bit by bit, rows used). Where it goes
    on does not change a bit. Cost: 0.2 to 0.5 us a piece of one mode.
    """
    used = 0
    now = time_state.now
    came = False
    faces = len(modal_system.reach)
    first = max(now[3], float(YIELDED))
    now[3] = 0.0
    if workspace.orders[0, 0] < 0.0 and not begin(
        motion, modal_system, table, memory, time_state, workspace
    ):
        return OPEN, used
    if now[5] == 0.0:
        for f in range(faces):
            memory.force[f] = pulled(f, table, memory)
    now[5] = 0.0
    while now[0] < stop[0] or (now[0] == stop[0] and now[1] < stop[1]):
        if used == rows.shape[0] and used > 0:
            # the forces go on as they are
            now[3] = first
            now[5] = 1.0
            return FULL, used
        left = left_of(time_state, stop)
        theta = phase_of(time_state.segments[int(now[2])], now[0], now[1], time_state.period[0])
        h, rate, top = begin_piece(left, motion, modal_system, table, memory, time_state, workspace)
        whole = h == left
        u, what, face, sign = next_event(top, modal_system, table, memory, time_state, workspace)
        if books.limits[0] < 1e300 and u > 0:
            root = passed(top, modal_system, motion, workspace, books.limits[0], u)
            if root <= u:
                u = root
                what = STOPS
        switches = (what == TURNS or what == RELEASES) and table.static[face] > 0.0
        changes = False
        if switches or whole:
            at_rest(u, h, top, modal_system, table, memory, workspace)
        if u > 0:
            if now[1] == 0.0:
                widen(output_of(motion, modal_system), time_state, books)
            if rows.shape[0] > 0:
                write(
                    rows[used], motion, u * h, theta, first, modal_system, table, memory, time_state
                )
                used += 1
            sums(rate * h, u, h, top, modal_system, time_state, books, workspace)
            if u > AT_ONCE:
                for f in range(faces + 1):
                    time_state.rest[f] = 0.0
            for f in range(faces):
                workspace.orders[f, 0] = 0.0
                workspace.orders[f, 1] = 0.0
            advance(u, h, top, motion, modal_system, table, memory, time_state, books, workspace)
            # an event on the border, to the last digit
            if whole and (u == 1.0 or now[1] + u * h >= now[1] + left):
                changes, came = cross_border(
                    what, left, stop, motion, modal_system, table, memory, past, time_state
                )
            else:
                now[1] += u * h
            books.ledger[5] = max(books.ledger[5], stored(motion, modal_system, table, memory))
            books.ledger[6] += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * time_state.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return PILED, used
        first = float(
            SWITCHED
            if switches
            else BORDERED
            if changes
            else YIELDED
            if what == YIELDS
            else TURNED
            if what == TURNS or what == OUTPUT_TURNS
            else ON
        )
        happen(what, face, sign, modal_system, table, memory, time_state)
        if switches:
            workspace.resting[face] = 1.0
            workspace.signs[face] = sign if what == RELEASES else 0.0
        if (switches or changes) and not enter(
            motion, modal_system, table, memory, time_state, workspace
        ):
            return OPEN, used
        if what == STOPS or came:
            now[3] = first if came and what != STOPS else 0.0
            return TRAVEL if what == STOPS else REPEATS, used
    now[3] = first
    return DONE, used


__all__ = [
    "BORDERED",
    "DONE",
    "EACH",
    "EPS",
    "FULL",
    "HEAD",
    "ON",
    "OPEN",
    "PILED",
    "REPEATS",
    "SWITCHED",
    "TRAVEL",
    "TURNED",
    "YIELDED",
    "march",
]
