"""Events of one mode with one Coulomb interface: plain Python for a short scene, compiled by `event_kernels` for a long
one."""

from math import atan2, cos, floor, inf, pi, sin, sqrt

import numpy as np

from .slip_kernels import motion, oscillator, stop

TURN = 2 * pi
ROW = 10  # time, phase, span, direction, z, v, g0, bc, bs, segment
GAUSS_X, GAUSS_W = (tuple(map(float, part)) for part in np.polynomial.legendre.leggauss(10))
FULL, DONE, TRAVEL, LOST, PILED = 0, 1, 2, 3, 4


def need_slopes(size, push, static, up):
    """Drive (B sin, B cos) where the force that holds the interface reaches its limit, rising for up = 1.

    push: the constant part of that force; size: |B|. The cosine is 0 where the limit is never passed.
    """
    room = (size - static) + up * push
    sine = static - up * push
    if room <= 0.0 or size + sine <= 0.0:
        return up * sine, 0.0
    return up * sine, up * sqrt(room * (size + sine))


def release(push, b, theta, static):
    """Next release from a stuck state: (angle until the interface lets go, direction, B sin, B cos there).

    direction 0: never. push + b sin(theta) is the force that holds it, over the mass.
    """
    best, way, sine, cosine, size = inf, 0.0, 0.0, 0.0, abs(b)
    for up in (1.0, -1.0):
        bs, bc = need_slopes(size, push, static, up)
        if bc == 0.0:
            continue
        passed = theta - (atan2(bs, bc) if b > 0.0 else atan2(-bs, -bc))
        passed -= TURN * floor(passed / TURN)
        half = atan2(abs(bc), up * bs)  # the limit stays passed for twice this angle
        wait = 0.0 if passed <= half else TURN - passed
        if wait < best:
            best, way, sine, cosine = wait, up, bs, bc
    return best, way, sine, cosine


def crossing(z, limit, direction, v0, g0, bc, bs, span, o):
    """Time in a slip of `span` at which z reaches +-limit; its motion is monotonic, so halving finds it."""
    low, high = 0.0, span
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if abs(z + direction * motion(middle, v0, g0, bc, bs, o)[0]) > limit:
            high = middle
        else:
            low = middle
    return high


def closed_books(span, v0, a0, p0, q0, v1, a1, p1, q1, o):
    """Work of the alternating drive force and viscous loss between two states of a slip.

    They follow from the equation of motion of the speed times the force p, its quadrature q, the speed and the
    acceleration, each integrated by parts.
    """
    beta, alpha, om = o[0], o[1], o[5]
    x, y = beta - om * om, alpha * om
    vp, vq, vv = v1 * p1 - v0 * p0, v1 * q1 - v0 * q0, 0.5 * (v1 * v1 - v0 * v0)
    first = 0.5 * (p1 * p1 - p0 * p0) - (a1 * p1 - a0 * p0) + om * vq - alpha * vp
    second = 0.5 * (om * span * (p0 * p0 + q0 * q0) + p1 * q1 - p0 * q0) - (a1 * q1 - a0 * q0) - om * vp - alpha * vq
    size = x * x + y * y
    work, side = (x * first + y * second) / size, (x * second - y * first) / size
    loss = alpha * (om * side - (v1 * a1 - v0 * a0) - alpha * vv) + om * (vq + om * work) \
        - 0.5 * (a1 * a1 - a0 * a0) - beta * vv
    return work, loss / beta


def add(book, k, value):
    """Add to book[k]; book[6 + k] keeps what rounding drops (Kahan), so that a sum of millions keeps its digits."""
    rest = value - book[6 + k]
    total = book[k] + rest
    book[6 + k] = (total - book[k]) - rest
    book[k] = total


def book_slip(span, direction, theta, push, b, v0, g0, bc, bs, shift, v1, a1, o, book):
    """Add a slip's work in, viscous loss and |power in|, all over the mass, to book[0:3]; v1, a1: at its end.
    push + b sin: force of the drive over the mass. By parts, or by Gauss panels where too little would be left of what
    is subtracted there."""
    beta, alpha, om = o[0], o[1], o[5]
    closed = (beta > 1e-3 * om * om and (beta - om * om)**2 + (alpha * om)**2 > 1e-6 * om**4
              and alpha * alpha < 16 * beta and span * o[6] > 0.7)
    reach, fast = 2.2 / max(om, sqrt(beta)), o[2] + o[3] if o[4] == 1.0 else 0.0
    slow = beta / fast if fast > 0.0 else 0.0
    turns = abs(push) < abs(b)
    at, v, a, y, sine, cosine = 0.0, v0, g0 - alpha * v0, 0.0, bs, bc
    while at < span:
        end = span
        if not closed:
            if fast > 0.0:  # both decays of an overdamped mode die out, the fast one first
                reach = 2.2 / max(om, fast if at * fast < 40.0 else slow if at * slow < 40.0 else om)
            end = min(span, at + reach)
        if turns:
            end = min(end, at + _turn(theta + om * at, push, b) / om)
        if end <= at:
            break
        if closed:
            vend, aend, yend = v1, a1, shift
            if end < span:
                yend, vend, aend = motion(end, v0, g0, bc, bs, o)
            turn, other = cos(om * end), sin(om * end)
            s1, c1 = bs * turn + bc * other, bc * turn - bs * other
            work, loss = closed_books(end - at, v, a, sine, cosine, vend, aend, s1, c1, o)
            work += direction * push * (yend - y)
            v, a, y, sine, cosine = vend, aend, yend, s1, c1
        else:
            half, work, loss = 0.5 * (end - at), 0.0, 0.0
            for x, w in zip(GAUSS_X, GAUSS_W):
                u = at + half * (1.0 + x)
                v = motion(u, v0, g0, bc, bs, o)[1]
                work += half * w * (direction * push + bs * cos(om * u) + bc * sin(om * u)) * v
                loss += half * w * v * v * alpha
        add(book, 0, work)
        add(book, 1, loss)
        add(book, 2, abs(work))
        at = end


def _turn(theta, push, b):
    """Angle to the next zero of push + b sin, more than 1e-9 ahead."""
    if push == 0.0:
        ahead = pi - theta % pi
        return ahead if ahead > 1e-9 else pi
    first = -atan2(push / b, sqrt(max(1.0 - (push / b)**2, 0.0)))
    best = TURN
    for zero in (first, pi - first):
        ahead = zero - theta
        ahead -= TURN * floor(ahead / TURN)
        if ahead > 1e-9:
            best = min(best, ahead)
    return best


def note(extremes, k, low, high):
    """Widen the extremes of cycle k to hold low and high."""
    if 0 <= k < extremes.shape[0]:
        if low < extremes[k, 0]:
            extremes[k, 0] = low
        if high > extremes[k, 1]:
            extremes[k, 1] = high


def note_stick(extremes, position, cycles, z):
    """Widen the extremes of the cycles that a stick at z takes; position: its start [cycles], cycles: its length."""
    first = int(position + 1e-12)
    last = max(first, int(position + cycles - 1e-12))
    for k in range(first, min(last, extremes.shape[0] - 1) + 1):
        note(extremes, k, z, z)


def note_slip(extremes, position, per, z, direction, v0, g0, bc, bs, span, shift, o):
    """Widen the extremes of z of the cycles that a slip takes; position [cycles] of its start, per [s] of a cycle."""
    first, last, z0 = int(position + 1e-12), int(position + span / per - 1e-12), z
    for k in range(first, last):
        z1 = z + direction * motion((k + 1 - position) * per, v0, g0, bc, bs, o)[0]
        note(extremes, k, min(z0, z1), max(z0, z1))
        z0 = z1
    z1 = z + direction * shift
    if direction > 0.0:
        note(extremes, max(first, last), z0, z1)
    else:
        note(extremes, max(first, last), z1, z0)


def march(mode, friction, segments, clock, state, rows, extremes, book):
    """Run from event to event until the end, or until `rows` are full. Returns (code, rows used).

    mode: (w, decay); friction: (static, kinetic) over the mass. segments (s, 6): start, end, push, B, om, phase of the
    drive's force over the mass, push + B sin(om (t - start) + phase). clock: (cycle's length, largest |z|, 1: write
    over the rows from the first on when they are full, 0: without work in, viscous loss and |power in|). state (9):
    segment, turns, phase, z, v, direction, g0, bc, bs at the next phase. Codes: 0 full, 1 done, 2 beyond the largest
    |z|, 3 an event was lost, 4 events pile up. rows (r, 10), extremes (c, 2) of z per cycle, book (10) over the mass:
    work in, viscous loss, |power in|, friction work; events; phases of no length in a row; rounding of the first four.
    """
    static, kinetic = friction[0], friction[1]
    per, far, ring = clock[0], clock[1], clock[2]
    count, size = 0, rows.shape[0]
    while state[0] < segments.shape[0]:
        s = int(state[0])
        start, end, push = float(segments[s, 0]), float(segments[s, 1]), float(segments[s, 2])
        b, om, phase = float(segments[s, 3]), float(segments[s, 4]), float(segments[s, 5])
        o = oscillator(mode[0], mode[1], om)
        turns, theta, z, v, direction = (float(state[1]), float(state[2]), float(state[3]), float(state[4]),
                                         float(state[5]))
        g0, bc, bs = float(state[6]), float(state[7]), float(state[8])
        whole = (end - start) * om + phase
        while True:
            if count == size and ring == 0.0:
                _keep(state, s, turns, theta, z, v, direction, g0, bc, bs)
                return FULL, count
            left = ((whole - turns * TURN) - theta) / om
            if left <= 0.0:
                break
            time = start + (turns * TURN + (theta - phase)) / om
            span, code, way = left, DONE, 0.0
            if direction == 0.0:
                angle, way, sine, cosine = release(push - o[0] * z, b, theta, static)
                ready = angle / om < left
                if ready:
                    span = angle / om
                shift, speed, gain = 0.0, 0.0, 0.0
            else:
                found, shift, gain = stop(v, g0, bc, bs, o, left)
                if found == -2.0:
                    return LOST, count
                ready = found >= 0.0
                if ready:
                    span, speed = found, 0.0
                else:
                    shift, speed, gain = motion(span, v, g0, bc, bs, o)
                if abs(z + direction * shift) > far:
                    span, code = crossing(z, far, direction, v, g0, bc, bs, span, o), TRAVEL
                    shift, speed, gain = motion(span, v, g0, bc, bs, o)
                add(book, 3, kinetic * shift)
                if clock[3] != 0.0:
                    book_slip(span, direction, theta, push, b, v, g0, bc, bs, shift, speed, gain, o, book)
            if size:
                row = rows[count % size]
                row[0], row[1], row[2], row[3], row[4] = time, theta, span, direction, z
                row[5], row[6], row[7], row[8], row[9] = v, g0, bc, bs, s
            if extremes.shape[0]:
                if direction == 0.0:
                    note_stick(extremes, time / per, span / per, z)
                else:
                    note_slip(extremes, time / per, per, z, direction, v, g0, bc, bs, span, shift, o)
            count += 1
            book[4] += 1.0
            book[5] = book[5] + 1.0 if span < 1e-12 * per else 0.0
            z += direction * shift
            turned = theta + om * span
            whole_turns = float(int(turned / TURN))
            turns, theta = turns + whole_turns, turned - whole_turns * TURN
            if code == TRAVEL:
                _keep(state, s, turns, theta, z, speed, direction, g0, bc, bs)
                return TRAVEL, count
            if book[5] > 1000.0:
                return PILED, count
            if not ready:
                v = speed
                break
            if direction == 0.0:
                direction, v, g0, bc, bs = way, 0.0, static - kinetic, way * cosine, way * sine
            else:
                v = 0.0
                direction, g0, bc, bs = begin(push - o[0] * z, b, theta, 0.0, static, kinetic)
        enter(state, segments, s + 1, turns, theta, z, v, direction, static, kinetic, o[0])
    return DONE, count


def _keep(state, s, turns, theta, z, v, direction, g0, bc, bs):
    state[0], state[1], state[2], state[3], state[4] = s, turns, theta, z, v
    state[5], state[6], state[7], state[8] = direction, g0, bc, bs


def begin(push, b, theta, v, static, kinetic):
    """Phase that follows a state: (direction, g0, bc, bs) as `slip_kernels` takes them, direction 0 for a stick.

    push + b sin(theta) is the force over the mass that would hold z; v: velocity, of either sign; static, kinetic: over
    the mass.
    """
    sine, cosine = b * sin(theta), b * cos(theta)
    need = push + sine
    if v != 0.0:
        way = 1.0 if v > 0.0 else -1.0
    elif abs(need) <= static and static > 0.0:
        return 0.0, 0.0, 0.0, 0.0
    elif need == 0.0:
        way = 1.0 if cosine >= 0.0 else -1.0
    else:
        way = 1.0 if need > 0.0 else -1.0
    return way, way * need - kinetic, way * cosine, way * sine


def enter(state, segments, s, turns, theta, z, v, direction, static, kinetic, beta):
    """Write the state at the start of segment s; after the last segment what is there at the end.

    v >= 0: speed, direction: its sign; beta [1/s2]: stiffness over the mass.
    """
    v = direction * v
    if s >= segments.shape[0]:
        _keep(state, s, turns, theta, z, v, direction, 0.0, 0.0, 0.0)
        return
    theta = float(segments[s, 5])
    direction, g0, bc, bs = begin(float(segments[s, 2]) - beta * z, float(segments[s, 3]), theta, v, static, kinetic)
    _keep(state, s, 0.0, theta, z, abs(v), direction, g0, bc, bs)
