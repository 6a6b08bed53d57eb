"""Periodic motion of one mode with one Coulomb interface under a sine, by Newton's method on its map over a period.

The map over a drive period or half of it carries its tangent through every event. Plain Python that `steady_kernels`
compiles.
"""

from math import atan2, inf, nan, pi, sqrt

from .sdof_kernels import TURN, begin, release
from .slip_kernels import REACH, motion, oscillator, series, step_answer, stop

OUT = 24  # of `flow`: z, v, direction, tangent (6), stuck angle, stops, slips, highest z (4), lowest z (4), releases
STUCK, STOPS, SLIDING, UNBOUNDED, UNSETTLED = 0, 1, 2, 3, 4
PHASES = 16  # releases kept per period
FOUND = 14  # numbers of a motion, as `point` has them


def impulse(u, o):
    """Answers of the free mode after u: (to a unit impulse h, its rate h', to a unit step); o: of `oscillator`."""
    if u * o[6] < REACH:
        h, h1, _ = series(u, 1.0, 0.0, 0.0, 0.0, o)
        return h, h1, step_answer(u, o, h, h1)
    h, h1, _ = motion(u, 1.0, 0.0, 0.0, 0.0, o)
    return h, h1, step_answer(u, o, h, h1)


def flow(theta, z, v, angle, b, static, kinetic, o, out, phases):
    """Motion from (z, v) at drive phase theta over an angle of the drive, into `out` (24).

    out: z, v, direction (0 stuck); d(z, v)/d(z0, v0, static) row by row, kinetic/static held; angle spent stuck,
    sticks begun, slips begun; highest z at a stop and its three derivatives, lowest likewise; releases, whose phases
    go to `phases`. Returns False where an event was lost or there were too many.
    """
    beta, om = o[0], o[5]
    share = kinetic / static if static > 0.0 else 0.0
    way, g0, bc, bs = begin(-beta * z, b, theta, v, static, kinetic)
    speed, left = abs(v), angle / om
    zz, zv, zf, vz, vv, vf = 1.0, 0.0, 0.0, 0.0, 1.0 if way != 0.0 else 0.0, 0.0
    for k in range(9, OUT):
        out[k] = 0.0
    out[11] = 1.0 if way != 0.0 else 0.0
    out[12], out[16], alive = -inf, inf, False
    for _ in range(1000):
        if way == 0.0:
            turn, up, sine, cosine = release(-beta * z, b, theta, static)
            span = turn / om
            if span >= left:
                out[9] += left * om
                speed, alive = 0.0, True
                break
            out[9] += turn
            out[11] += 1.0
            theta, left = theta + turn, left - span
            drop = -up * (static - kinetic) / (om * cosine)
            vz, vv, vf = drop * beta * zz, drop * beta * zv, drop * (up + beta * zf)
            way, speed, g0, bc, bs = up, 0.0, static - kinetic, up * cosine, up * sine
            count = int(out[20])
            if count < phases.shape[0]:
                phases[count] = theta % TURN
            out[20] += 1.0
            continue
        span, shift, gain = stop(speed, g0, bc, bs, o, left)
        if span == -2.0:
            return False
        ends = span >= 0.0
        if not ends:
            span = left
            shift, speed, gain = motion(span, speed, g0, bc, bs, o)
        h, h1, one = impulse(span, o)
        keep = 1.0 - beta * one
        zz, vz = keep * zz + h * vz, h1 * vz - beta * h * zz
        zv, vv = keep * zv + h * vv, h1 * vv - beta * h * zv
        zf, vf = keep * zf + h * vf - way * one * share, h1 * vf - beta * h * zf - way * h * share
        z, theta, left = z + way * shift, theta + om * span, left - span
        if not ends:
            alive = True
            break
        if z > out[12]:
            out[12], out[13], out[14], out[15] = z, zz, zv, zf
        if z < out[16]:
            out[16], out[17], out[18], out[19] = z, zz, zv, zf
        before = way * gain
        way, g0, bc, bs = begin(-beta * z, b, theta, 0.0, static, kinetic)
        speed = 0.0
        factor = 0.0
        if way == 0.0:
            out[10] += 1.0
        else:
            factor = way * g0 / before if before != 0.0 else 0.0
            out[11] += 1.0
        vz, vv, vf = factor * vz, factor * vv, factor * vf
    out[0], out[1], out[2] = z, way * speed, way
    out[3], out[4], out[5], out[6], out[7], out[8] = zz, zv, zf, vz, vv, vf
    return alive


def newton(theta, z, v, angle, sign, b, static, kinetic, o, out, phases, tries):
    """State that the map over `angle` turns into sign times itself. Returns (z, v, residual over the size or inf)."""
    best, last, size = inf, inf, 0.0
    for _ in range(tries):
        if not flow(theta, z, v, angle, b, static, kinetic, o, out, phases):
            return z, v, inf
        size = max(abs(z), abs(out[0]), out[12], -out[16]) if out[12] > -inf else max(abs(z), abs(out[0]))
        rz, rv = out[0] - sign * z, out[1] - sign * v
        last = max(abs(rz), abs(rv) / o[5]) / size if size > 0.0 else 0.0
        if not last < 1e6:
            return z, v, inf
        if last <= 2e-14 or (last <= 1e-12 and last >= 0.1 * best):  # round-off, or no gain any more
            return z, v, last
        best = min(best, last)
        a, c, d, e = out[3] - sign, out[4], out[6], out[7] - sign
        if v == 0.0 and out[1] == 0.0:
            if a == 0.0:
                return z, v, inf
            z -= rz / a
            continue
        det = a * e - c * d
        if det == 0.0:
            return z, v, inf
        z, v = z - (e * rz - c * rv) / det, v - (a * rv - d * rz) / det
    return z, v, last if last <= 1e-12 else inf


def sliding_guess(b, kinetic, o):
    """Guess of a motion that slides without a stop, if there is one: Den Hartog's, with damping.

    Returns (theta, z, v, found) in the middle of an upward slide. Nothing is checked on the way.
    """
    beta, om = o[0], o[5]
    half = pi / om
    one, h, _ = motion(half, 0.0, 1.0, 0.0, 0.0, o)
    sz, sv, _ = motion(half, 0.0, 0.0, 1.0, 0.0, o)
    cz, cv, _ = motion(half, 0.0, 0.0, 0.0, 1.0, o)
    cz, cv = cz + one, cv + h
    det = sz * cv - sv * cz
    if det == 0.0:
        return 0.0, 0.0, 0.0, False
    c0, s0 = kinetic * (one * cv - h * cz) / det, kinetic * (h * sz - one * sv) / det
    x = beta * one - 2.0
    c1, s1 = (x * cv - beta * h * cz) / det, (beta * h * sz - x * sv) / det
    p, q, r = c1 * c1 + s1 * s1, c0 * c1 + s0 * s1, c0 * c0 + s0 * s0 - b * b
    inside = q * q - p * r
    if inside < 0.0 or p == 0.0:
        return 0.0, 0.0, 0.0, False
    z = -(q + sqrt(inside)) / p
    bc, bs = c0 + c1 * z, s0 + s1 * z
    shift, speed, _ = motion(0.5 * half, 0.0, bs - beta * z - kinetic, bc, bs, o)
    theta = atan2(bs, bc) if b > 0.0 else atan2(-bs, -bc)
    return theta + 0.5 * pi, z + shift, speed, z < 0.0 and speed > 0.0


def settle(theta, z, v, halves, b, static, kinetic, o, out, phases):
    """State after half turns of the drive: (theta, z, v, ok), turned over after each half turn.

    It ends in the middle of the stick or slip that is then under way.
    """
    for _ in range(halves):
        if not flow(theta, z, v, pi, b, static, kinetic, o, out, phases):
            return theta, z, v, False
        z, v = -out[0], -out[1]
    beta, om = o[0], o[5]
    way, g0, bc, bs = begin(-beta * z, b, theta, v, static, kinetic)
    if way == 0.0:
        turn, _, _, _ = release(-beta * z, b, theta, static)
        ahead = 0.5 * min(turn, pi)
    else:
        ahead = 0.5 * om * stop(abs(v), g0, bc, bs, o, pi / om)[0]
        if ahead <= 0.0:
            ahead = 0.25 * pi
    alive = flow(theta, z, v, ahead, b, static, kinetic, o, out, phases)
    return (theta + ahead) % TURN, out[0], out[1], alive


def recurrence(theta, z, v, b, static, kinetic, o, out, phases):
    """Number of periods, at most 64, after which a state comes back to 1e-6 of the motion's size.

    It is 0 if it does not, or if it comes back turned over after half a period. theta: phase of the state (z, v).
    """
    now, speed, top = z, v, 0.0
    for k in range(129):
        if not flow(theta, now, speed, pi, b, static, kinetic, o, out, phases):
            return 0
        now, speed, theta = out[0], out[1], theta + pi
        top = max(top, abs(now), abs(speed) / o[5], out[12], -out[16])
        way = -1.0 if k == 0 else 1.0
        if (k == 0 or k % 2 == 1) and max(abs(now - way * z), abs(speed - way * v) / o[5]) <= 1e-6 * top:
            return (k + 1) // 2
    return 0


def point(w, decay, static, kinetic, b, om, z, v, patience, out, phases, found):
    """Steady motion under the force b sin(om t) over the mass, from the state (z, v) at phase 0.

    found (14): regime, sticks per period, half peak to peak, its derivative by static (kinetic/static held), share of
    time stuck, two multipliers over its period (real and imaginary part of the larger, real and imaginary of the
    smaller), periods it takes to repeat, 1 if not symmetric, residual, z and v at phase 0. patience: most cycles of
    marching.
    """
    o = oscillator(w, decay, om)
    for k in range(found.shape[0]):
        found[k] = 0.0
    found[7] = 1.0
    if abs(b) <= static and z == 0.0 and v == 0.0:
        found[4], found[5] = 1.0, 1.0
        return
    # at resonance without damping friction below pi/4 of the input does not bound the motion
    if decay == 0.0 and abs(om - w) <= 1e-12 * w and kinetic < 0.25 * pi * abs(b):
        found[0] = UNBOUNDED
        found[2] = inf
        return
    if kinetic == static:
        theta, z1, v1, ok = sliding_guess(b, kinetic, o)
        if ok:
            z1, v1, miss = newton(theta, z1, v1, pi, -1.0, b, static, kinetic, o, out, phases, 6)
            if miss <= 1e-12 and out[10] == 0.0 and report(1, -1.0, out, phases, found, miss):
                at_phase_0(theta, z1, v1, b, static, kinetic, o, out, phases, found)
                return
    theta, done, halves = 0.0, 0, 1 if kinetic == static else 40
    while done < patience:
        theta, z, v, ok = settle(theta, z, v, halves, b, static, kinetic, o, out, phases)
        if not ok:
            break
        done += (halves + 1) // 2
        periods = 0 if kinetic == static or done <= 100 else recurrence(theta, z, v, b, static, kinetic, o, out, phases)
        sign, angle = (-1.0, pi) if periods == 0 else (1.0, TURN * periods)
        z1, v1, miss = newton(theta, z, v, angle, sign, b, static, kinetic, o, out, phases, 10)
        near = kinetic == static or max(abs(z1 - z), abs(v1 - v) / om) <= 0.02 * max(out[12], -out[16])
        if near and miss <= 1e-12 and report(max(periods, 1), sign, out, phases, found, miss):
            at_phase_0(theta, z1, v1, b, static, kinetic, o, out, phases, found)
            return
        halves = 2 * max(4, done)
    found[2] = nan
    found[0] = UNSETTLED


def at_phase_0(theta, z, v, b, static, kinetic, o, out, phases, found):
    """State of the motion through (z, v) at phase theta when the phase is 0 next, to the end of `found`."""
    flow(theta, z, v, TURN - theta % TURN, b, static, kinetic, o, out, phases[:0])
    found[12], found[13] = out[0], out[1]


def report(periods, sign, out, phases, found, miss):
    """Fill `found` from the last map of Newton's method, over `periods` or, with sign -1, half a period; False if the
    motion is unstable."""
    a, c, d, e = out[3], out[4], out[6], out[7]
    half, det = 0.5 * (a + e), a * e - c * d
    inside = half * half - det
    if inside >= 0.0:
        big = half + sqrt(inside) if half >= 0.0 else half - sqrt(inside)
        found[5], found[6] = big, 0.0
        found[10], found[11] = det / big if big != 0.0 else 0.0, 0.0
    else:
        found[5], found[6], found[10], found[11] = half, sqrt(-inside), half, -sqrt(-inside)
    if found[5]**2 + found[6]**2 > 1.0 + 1e-9:  # round-off of a multiplier of 1
        return False
    turn = TURN * periods
    if sign < 0.0:
        turn = pi
        for k in (5, 10):
            found[k], found[k + 1] = found[k]**2 - found[k + 1]**2, 2 * found[k] * found[k + 1]
        count = min(int(out[20]), phases.shape[0] // 2)
        for k in range(count):
            phases[count + k] = (phases[k] + pi) % TURN
    a, e = a - sign, e - sign
    zf, vf = 0.0, 0.0
    if out[2] == 0.0:
        zf = -out[5] / a if a != 0.0 else 0.0
    elif a * e != c * d:
        det = a * e - c * d
        zf, vf = -(e * out[5] - c * out[8]) / det, -(a * out[8] - d * out[5]) / det
    high = out[13] * zf + out[14] * vf + out[15]
    low = out[17] * zf + out[18] * vf + out[19]
    found[0] = STOPS if out[10] > 0.0 else SLIDING
    found[1] = out[10] * TURN / turn
    found[4] = out[9] / turn
    found[7], found[9] = float(periods), miss
    if sign < 0.0 and out[12] >= -out[16]:
        found[2], found[3] = out[12], high
    elif sign < 0.0:
        found[2], found[3] = -out[16], -low
    else:
        found[2], found[3] = 0.5 * (out[12] - out[16]), 0.5 * (high - low)
        found[8] = 1.0 if abs(out[12] + out[16]) > 1e-9 * found[2] else 0.0
    return True
