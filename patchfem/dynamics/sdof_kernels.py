"""One mode and one Coulomb interface in closed form, from event to event: arithmetic that runs as plain Python for a
short scene and compiled (`event_kernels`) for long ones.

Between events z'' + alpha z' + beta z = g0 + bc sin(om u) - bs (1 - cos(om u)), u from the start of the phase. Its
solution is written in divided differences of exp at the two free rates and i om, so that resonance, no damping,
critical damping and a rigid mode are no special cases, and by its power series for short times, so that nothing cancels
at a grazing onset. The end of a slip is found by steps that a bound on the fourth derivative of the speed proves free
of roots.

`o` below: (beta, alpha, decay, own, kind, om, top) of `oscillator`.
"""

from math import atan2, cos, exp, expm1, floor, hypot, inf, pi, sin, sqrt

import numpy as np

TURN = 2 * pi
ROW = 10  # time, phase, span, direction, z, v, g0, bc, bs, segment
TERMS = 15  # of the power series: rounding at a reach of 0.3
REACH = 0.3
GAUSS_X, GAUSS_W = (tuple(map(float, part)) for part in np.polynomial.legendre.leggauss(10))
FULL, DONE, TRAVEL, LOST, PILED = 0, 1, 2, 3, 4


def oscillator(w, decay, om):
    """(beta, alpha, decay, own, kind, om, top) of a natural frequency w and decay = xi w, or half a rigid mode's
    damping [1/s]; kind 0 below critical damping, 1 above, 2 at it."""
    if decay == w:
        return w * w, 2 * decay, decay, 0.0, 2.0, om, max(w, om)
    own = sqrt(abs((w - decay) * (w + decay)))
    if decay < w:
        return w * w, 2 * decay, decay, own, 0.0, om, max(w, om)
    return w * w, 2 * decay, decay, own, 1.0, om, max(decay + own, om)


def series(u, v0, g0, bc, bs, o):
    """(shift, speed, acceleration) by the power series, for top u <= 0.3."""
    beta, alpha, om = o[0], o[1], o[5]
    if u <= 0.0:
        return 0.0, v0, g0 - alpha * v0
    au, bu, x = alpha * u, beta * u * u, om * u
    low, high = 0.0, v0 * u
    shift, speed, drive = high, high, g0
    power, push, sine, cosine = 1.0, g0, bc, -bs
    for k in range(TERMS):
        new = (push * u * u - au * (k + 1) * high - bu * low) / ((k + 1) * (k + 2))
        low, high = high, new
        shift += new
        speed += (k + 2) * new
        power *= x / (k + 1)
        push = power * sine
        drive += push
        sine, cosine = cosine, -sine
    return shift, speed / u, drive - alpha * speed / u - beta * shift


def step_answer(u, o, h, h1):
    """Shift after u under a unit constant push from rest, h the answer to a unit impulse and h1 its rate."""
    beta, alpha, decay, own, kind = o[0], o[1], o[2], o[3], o[4]
    fast = decay + own if kind != 0.0 else sqrt(beta)
    if fast * u < REACH:
        au, bu = alpha * u, beta * u * u
        low, high, out = 0.0, u * u / 2, u * u / 2
        for k in range(1, TERMS):
            low, high = high, -(au * (k + 1) * high + bu * low) / ((k + 1) * (k + 2))
            out += high
        return out
    if kind == 0.0:
        return (1.0 - h1 - alpha * h) / beta
    slow = -beta / fast
    return ((expm1(slow * u) / slow if slow != 0.0 else u) - h) / fast


def motion(u, v0, g0, bc, bs, o):
    """(shift, speed, acceleration) at u after the start of a phase with speed v0."""
    return moved(u, cos(o[5] * u), sin(o[5] * u), v0, g0, bc, bs, o)


def moved(u, co, so, v0, g0, bc, bs, o):
    """The same with the cosine and sine of om u at hand."""
    beta, alpha, decay, own, kind, om, top = o
    if u * top < REACH:
        return series(u, v0, g0, bc, bs, o)
    if kind == 0.0:
        e = exp(-decay * u)
        ec, es = e * cos(own * u), e * sin(own * u)
        h = es / own
        h1 = ec - decay * h
        p, q = om + own, om - own
        size = decay * decay + p * p
        yr = ((co - ec) * decay + (so + es) * p) / size
        yi = ((so + es) * decay - (co - ec) * p) / size
        size = decay * decay + q * q
        if size < own * own:
            a, b = decay * u, q * u
            if abs(a) + abs(b) < REACH:
                pr, pi_ = 1.0, 0.0
                for k in range(13, 1, -1):
                    pr, pi_ = 1.0 + (a * pr - b * pi_) / k, (a * pi_ + b * pr) / k
                xr, xi = u * (ec * pr - es * pi_), u * (ec * pi_ + es * pr)
            else:
                xr = ((co - ec) * decay + (so - es) * q) / size
                xi = ((so - es) * decay - (co - ec) * q) / size
            c, s = 0.5 * (xi - yi) / own, -0.5 * (xr - yr) / own
        else:
            c, s = -((h - yr) * decay - yi * q) / size, (yi * decay + (h - yr) * q) / size
    else:
        fast = -(decay + own)
        slow = beta / fast if kind == 1.0 else fast
        q = exp(fast * u)
        if kind == 1.0:
            p = exp(slow * u)
            h = -p * expm1(-2 * own * u) / (2 * own)
            h1 = 0.5 * (p + q) - decay * h if 2 * own < decay else (slow * p - fast * q) / (2 * own)
        else:
            h = q * u
            h1 = q - decay * h
        size = fast * fast + om * om
        yr, yi = (-(co - q) * fast + so * om) / size, (-so * fast - (co - q) * om) / size
        size = slow * slow + om * om
        c, s = ((h - yr) * slow + yi * om) / size, (-yi * slow + (h - yr) * om) / size
    one = step_answer(u, o, h, h1)
    return (v0 * h + g0 * one + bc * s - bs * (one - c),
            v0 * h1 + g0 * h + om * (bc * c - bs * s),
            g0 * h1 - v0 * (alpha * h1 + beta * h) + om * (bc * (h - om * s) - bs * om * c))


def first_leap(a, j, k, m, h):
    """A time in (0, h] up to which a u + j u^2/2 + k u^3/6 - m u^4/24 stays positive; 0 where it starts downwards."""
    if a < 0.0 or (a == 0.0 and j <= 0.0):
        return 0.0
    out = 0.0
    if j > 0.0:
        root = sqrt(k * k / 36 + m * j / 12) - k / 6
        out = h if root * h <= j else j / root
    if a > 0.0:
        loss = h * (max(-j, 0.0) / 2 + h * (max(-k, 0.0) / 6 + h * m / 24))
        out = max(out, h if loss <= a else h * a / loss)
    return min(0.9 * out, h)


def leap(v, a, j, k, m, h):
    """Largest time up to h up to which v + a u + j u^2/2 + k u^3/6 - m u^4/24 is sure to stay positive, v > 0."""
    low = -0.25 * m * h + (k if k < 0.0 else 0.0)
    low = low * h / 3 + (j if j < 0.0 else 0.0)
    if v + h * (low * h / 2 + (a if a < 0.0 else 0.0)) > 0.0:
        return h
    s, value, slope, window = 0.0, v, a, h
    for _ in range(60):
        end = s + window if s + window < h else h
        x = _free(value, slope, j, k, m, s, end)
        if x < 0.25 * (end - s):
            end = s + 2 * x
            x = _free(value, slope, j, k, m, s, end)
        window = 2 * (end - s)
        s += x
        if s >= h:
            return h
        value = v + s * (a + s / 2 * (j + s / 3 * (k - m * s / 4)))
        slope = a + s * (j + s / 2 * (k - m * s / 3))
        if value <= 0.01 * m * s * s * s * s or value <= 1e-9 * v or x <= 1e-3 * s:
            return s
    return s


def _free(value, slope, j, k, m, s, end):
    """Time without a root from s on, at most end - s, from the least curvature on [s, end]."""
    if value <= 0.0:
        return 0.0
    curve, other = j + s * (k - m * s / 2), j + end * (k - m * end / 2)
    if other < curve:
        curve = other
    inside = slope * slope - 2 * curve * value
    if curve >= 0.0 and (slope >= 0.0 or inside <= 0.0):
        return end - s
    root = sqrt(inside)
    x = 2 * value / (root - slope) if slope < 0.0 else (slope + root) / -curve
    return x if x < end - s else end - s


def bend(v, a, size, h, o):
    """Bound of the fourth derivative of the speed over the next h, from the equation of motion; size: of the drive."""
    beta, alpha, om = o[0], o[1], o[5]
    rest = 1.0 - alpha * h - 0.5 * beta * h * h
    if rest < 0.1:
        return inf
    second = (om * size + alpha * abs(a) + beta * (abs(v) + h * abs(a))) / rest
    third = om * om * size + alpha * second + beta * (abs(a) + h * second)
    return om * om * om * size + alpha * third + beta * second


def over_bend(v, a, co, so, bc, bs, size, o):
    """The same from the three terms of an overdamped motion: it falls as the fast one dies."""
    beta, alpha, decay, own, om = o[0], o[1], o[2], o[3], o[5]
    fast = -(decay + own)
    slow = beta / fast
    x, y = beta - om * om, alpha * om
    weight = x * x + y * y
    gr, gi = om * (bc * co - bs * so), om * (bc * so + bs * co)
    vp, turned = (gr * x + gi * y) / weight, (gi * x - gr * y) / weight
    va, aa = v - vp, a + om * turned
    quick, late = (aa - slow * va) / (fast - slow), (aa - fast * va) / (slow - fast)
    return abs(quick) * fast**4 + abs(late) * slow**4 + om**4 * size * om / sqrt(weight)


def stop(v0, g0, bc, bs, o, limit):
    """First time in (0, limit] at which the speed, positive just after 0, is back at zero; -1 if none, -2 if lost."""
    beta, alpha, om = o[0], o[1], o[5]
    size = hypot(bc, bs)
    free = alpha if o[4] != 1.0 else 0.0
    stride = 1.1 / (free + sqrt(free * free + 1.1 * beta)) if beta + free > 0.0 else inf
    if size > 0.0:
        stride = min(stride, 1.0 / om)
    u, v, a, co, so, peak = 0.0, v0, g0 - alpha * v0, 1.0, 0.0, 0.0
    for _ in range(200000):
        j = om * (bc * co - bs * so) - alpha * a - beta * v
        if u > 0.0 and v <= 1e-6 * peak:
            x = -v / a if a < 0.0 else inf
            if abs(j) * x <= -1e-5 * a:
                return min(u + x * (1.0 - 0.5 * j * x / a), limit)
            if v <= 1e-14 * peak:
                return u
        peak = max(peak, v)
        h = min(stride, limit - u)
        k = -om * om * (bc * so + bs * co) - alpha * j - beta * a
        m = bend(v, a, size, h, o)
        if o[4] == 1.0:
            m = min(m, over_bend(v, a, co, so, bc, bs, size, o))
        s = leap(v, a, j, k, m, h) if v > 0.0 else first_leap(a, j, k, m, h)
        if s >= limit - u:
            return -1.0
        if u + s == u:
            return u
        u += s
        co, so = cos(om * u), sin(om * u)
        _, v, a = moved(u, co, so, v0, g0, bc, bs, o)
    return -2.0


def need_slopes(size, push, static, up):
    """(B sin, B cos) of the drive where the force that holds the interface reaches its limit, rising for up = 1.

    push: the constant part of that force; size: |B|. The cosine is 0 where the limit is never passed.
    """
    room = (size - static) + up * push
    sine = static - up * push
    if room <= 0.0 or size + sine <= 0.0:
        return up * sine, 0.0
    return up * sine, up * sqrt(room * (size + sine))


def release(push, b, theta, static):
    """(angle until the interface lets go, direction, B sin, B cos there) from a stuck state; direction 0: never.

    push + b sin(theta) is the force that holds it, over the mass.
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
    """Time in a slip at which z reaches +-limit; its motion is monotonic."""
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
    """(work of the alternating drive force, viscous loss) between two states of a slip: the equation of motion of the
    speed times the force p, its quadrature q, the speed and the acceleration, each integrated by parts."""
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


def book_slip(span, direction, theta, push, b, v0, g0, bc, bs, shift, v1, a1, o, book):
    """Add a slip's work in, viscous loss and |power in|, all over the mass, to book[0:3]; v1, a1: at its end.
    push + b sin: force of the drive over the mass. By parts; by Gauss panels without spring or damping to divide by."""
    beta, alpha, om = o[0], o[1], o[5]
    closed = beta > 1e-3 * om * om and (beta - om * om)**2 + (alpha * om)**2 > 1e-6 * om**4
    reach = 2.2 / (o[6] if o[4] != 1.0 else max(om, 4 * alpha))
    turns = abs(push) < abs(b)
    at, v, a, y, sine, cosine = 0.0, v0, g0 - alpha * v0, 0.0, bs, bc
    while at < span:
        end = span if closed else min(span, at + reach)
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
        book[0] += work
        book[1] += loss
        book[2] += abs(work)
        at = end


def _turn(theta, push, b):
    """Angle to the next zero of push + b sin, more than 1e-9 ahead."""
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
    """Extremes of a stick of some cycles that starts at a position [cycles]."""
    first = int(position + 1e-12)
    last = max(first, int(position + cycles - 1e-12))
    for k in range(first, min(last, extremes.shape[0] - 1) + 1):
        note(extremes, k, z, z)


def note_slip(extremes, position, per, z, direction, v0, g0, bc, bs, span, shift, o):
    """Extremes of z per cycle over a slip; position [cycles] of its start, per [s] of a cycle."""
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
    |z|, 3 an event was lost, 4 events pile up. rows (r, 10), extremes (c, 2) of z per cycle, book (6) over the mass:
    work in, viscous loss, |power in|, friction work; events; phases of no length in a row.
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
                found = stop(v, g0, bc, bs, o, left)
                if found == -2.0:
                    return LOST, count
                ready = found >= 0.0
                if ready:
                    span = found
                shift, speed, gain = motion(span, v, g0, bc, bs, o)
                if abs(z + direction * shift) > far:
                    span, code = crossing(z, far, direction, v, g0, bc, bs, span, o), TRAVEL
                    shift, speed, gain = motion(span, v, g0, bc, bs, o)
                book[3] += kinetic * shift
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
    """(direction, g0, bc, bs) of the phase that follows a state: push + b sin(theta) is the force that would hold z."""
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
    """State (v as it is, not turned) at the start of segment s; after the last one what is there at the end."""
    v = direction * v
    if s >= segments.shape[0]:
        _keep(state, s, turns, theta, z, v, direction, 0.0, 0.0, 0.0)
        return
    theta = float(segments[s, 5])
    direction, g0, bc, bs = begin(float(segments[s, 2]) - beta * z, float(segments[s, 3]), theta, v, static, kinetic)
    _keep(state, s, 0.0, theta, z, abs(v), direction, g0, bc, bs)
