"""What is kept of many phases of one mode, in one pass over the rows of `sdof_kernels.march`: the part of every cycle
at the drive's frequency, the largest energy, the list of events.

Plain Python that `event_kernels` compiles; in arrays, for a short run: `sdof_keep`.
"""

from math import cos, pi, sin

import numpy as np

from .slip_kernels import motion, oscillator

X, W = (tuple(map(float, part)) for part in np.polynomial.legendre.leggauss(10))
BORDER = 9.0
LEAST = 0.7  # angle of the fastest motion below which too little is left of what is subtracted by parts
CLOSE = 1e-6  # |beta - w^2 + i w alpha|^2 over w^4 below which parts would divide by almost nothing


def by_parts(u0, u1, e0, e1, y0, y1, v0, v1, g0, bc, bs, w, o):
    """Integral of y exp(-i w u) over [u0, u1] of a slip, y(u0), y(u1) = y0, y1, its speeds v0, v1 and exponentials e0,
    e1.

    The equation of motion times exp(-i w u), integrated by parts, leaves (beta - w^2 + i w alpha) times it.
    """
    beta, alpha, om = o[0], o[1], o[5]
    half, turn = 0.5 * (u1 - u0), complex(0.0, 0.25 / w) * (e1 * e1 - e0 * e0)
    if abs(om - w) <= 1e-14 * w:
        even, odd = half + turn, complex(0.0, -1.0) * (half - turn)
    else:
        near, far = wave(om - w, u0, u1), wave(-om - w, u0, u1)
        even, odd = 0.5 * (near + far), complex(0.0, -0.5) * (near - far)
    force = complex(0.0, (g0 - bs) / w) * (e1 - e0) + bs * even + bc * odd
    return (force - (v1 * e1 - v0 * e0) - complex(alpha, w) * (y1 * e1 - y0 * e0)) / complex(beta - w * w, w * alpha)


def wave(rate, u0, u1):
    """Integral of exp(i rate u) over [u0, u1]."""
    x, middle = 0.5 * rate * (u1 - u0), 0.5 * rate * (u0 + u1)
    size = (u1 - u0) * (sin(x) / x if x != 0.0 else 1.0)
    return complex(size * cos(middle), size * sin(middle))


def by_points(u0, u1, v, g0, bc, bs, w, o):
    """Integral of y exp(-i w u) over [u0, u1] of a slip that starts with speed v, by Gauss points."""
    count = int((u1 - u0) * max(o[6], w) / 2.2) + 1
    out, half = complex(0.0, 0.0), 0.5 * (u1 - u0) / count
    for k in range(count):
        for x, weight in zip(X, W):
            u = u0 + half * (2 * k + 1 + x)
            y = half * weight * motion(u, v, g0, bc, bs, o)[0]
            out += complex(y * cos(w * u), -y * sin(w * u))
    return out


def add_phasors(phasors, position, per, z, direction, v, g0, bc, bs, span, shift, speed, o):
    """Add 2/per times the integral of z exp(-i w t) over a phase to its cycles of phasors (c, 2); position: its start
    [cycles], z there; shift and speed at its end."""
    w, first = 2 * pi / per, int(position + 1e-12)
    last = max(first, int(position + span / per - 1e-12))
    turn = w * per * (position - first)
    start = complex(cos(turn), -sin(turn)) * (2 / per)
    plain = (o[0] - w * w)**2 + (o[1] * w)**2 > CLOSE * w**4
    u0, y0, v0, e0 = 0.0, 0.0, v, complex(1.0, 0.0)
    for k in range(first, min(last + 1, phasors.shape[0])):
        u1 = span if k == last else (k + 1 - position) * per
        e1 = complex(cos(w * u1), -sin(w * u1))
        part = complex(0.0, z / w) * (e1 - e0)
        y1, v1 = shift, speed
        if direction != 0.0 and k < last:
            y1, v1, _ = motion(u1, v, g0, bc, bs, o)
        if direction != 0.0 and plain and (u1 - u0) * o[6] > LEAST:
            part += direction * by_parts(u0, u1, e0, e1, y0, y1, v0, v1, g0, bc, bs, w, o)
        elif direction != 0.0:
            part += direction * by_points(u0, u1, v, g0, bc, bs, w, o)
        part *= start
        phasors[k, 0] += part.real
        phasors[k, 1] += part.imag
        u0, e0, y0, v0 = u1, e1, y1, v1


def listed_event(events, memo, time, theta, interface, what, slide):
    """Write an event over the oldest one of `events`; memo[0] counts them."""
    row = events[int(memo[0]) % events.shape[0]]
    row[0], row[1], row[2], row[3], row[4] = time, theta, interface, what, slide
    memo[0] += 1.0


def keep(rows, mode, segments, clock, phasors, events, memo):
    """Take in consecutive phases `rows` (r, 10) of `sdof_kernels.march`.

    mode: (w, decay); clock: (cycle's length, slide per coordinate, 1 where there is friction). Adds to phasors (c, 2),
    per cycle; writes changes of direction and of segment to events (e, 5): time, phase, interface, what, slide; memo
    (4): their number, direction and segment before, largest z'^2 + w^2 z^2.
    """
    per, slide, rubs = clock[0], clock[1], clock[2]
    o = oscillator(mode[0], mode[1], float(segments[int(memo[2]), 4]))
    for k in range(rows.shape[0]):
        time, theta, span, direction = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        z, v, g0, bc, bs, s = rows[k, 4], rows[k, 5], rows[k, 6], rows[k, 7], rows[k, 8], rows[k, 9]
        if s != memo[2]:
            o = oscillator(mode[0], mode[1], float(segments[int(s), 4]))
        beta, shift, speed = o[0], 0.0, 0.0
        if direction != 0.0:
            shift, speed, _ = motion(0.5 * span, v, g0, bc, bs, o)
        memo[3] = max(memo[3], v * v + beta * z * z, speed * speed + beta * (z + direction * shift)**2)
        if k + 1 < rows.shape[0]:  # the next phase begins where this one ends
            shift, speed = direction * (rows[k + 1, 4] - z), rows[k + 1, 5]
        elif direction != 0.0:
            shift, speed, _ = motion(span, v, g0, bc, bs, o)
        add_phasors(phasors, time / per, per, z, direction, v, g0, bc, bs, span, shift, speed, o)
        if span > 0.0:
            if s != memo[2]:
                listed_event(events, memo, time, theta, -1.0, BORDER, 0.0)
            if direction != memo[1] and rubs != 0.0:
                way = direction if slide > 0.0 else -direction
                what = 0.0 if direction == 0.0 else way if memo[1] == 0.0 else 2 * way
                listed_event(events, memo, time, theta, 0.0, what, slide * z)
            memo[1], memo[2] = direction, s
