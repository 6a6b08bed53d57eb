"""What is kept of many phases of one mode, in arrays: `keep_kernels.keep` for a run too short for compiled code."""

import numpy as np

from .keep_kernels import BORDER, CLOSE, LEAST
from .sdof_samples import motions, panels, turn
from .slip_kernels import oscillator


def keep(rows, mode, segments, clock, phasors, events, memo) -> None:
    """Take in phases `rows`, as `keep_kernels.keep` does it, in arrays."""
    per, slide, rubs = clock
    number = rows[:, 9].astype(int)
    rate = segments[number, 4]
    for om in np.unique(rate):
        _keep_under(rows[rate == om], oscillator(*mode, float(om)), per, phasors, memo)
    rows = rows[rows[:, 2] > 0]
    if not len(rows):
        return
    way, segment = (np.concatenate([[first], rows[:, k]]) for first, k in zip(memo[1:3], (3, 9)))
    memo[1:3] = way[-1], segment[-1]
    old, new = np.sign(slide) * way[:-1], np.sign(slide) * way[1:]
    what = np.where(new == 0, 0.0, np.where(old == 0, 1.0, 2.0)) * new
    zero = np.zeros(len(rows))
    found = np.stack([rows[:, 0], rows[:, 1], zero, what, slide * rows[:, 4]], axis=1)
    border = np.stack([rows[:, 0], rows[:, 1], zero - 1, zero + BORDER, zero], axis=1)
    seen = np.stack([segment[1:] != segment[:-1], (old != new) & (rubs != 0)], axis=1)
    both = np.stack([border, found], axis=1)[seen]
    events[(int(memo[0]) + np.arange(len(both))) % len(events)] = both
    memo[0] += len(both)


def _keep_under(rows, o, per, phasors, memo) -> None:
    """The largest energy and the phasors of phases under one drive frequency, o of `oscillator`."""
    position, span, way, w = rows[:, 0] / per, rows[:, 2], rows[:, 3], 2 * np.pi / per
    y, v = _slips(0.5 * span, rows, o)
    memo[3] = max(memo[3], float((v * v + o[0] * (rows[:, 4] + way * y)**2).max()),
                  float((rows[:, 5]**2 + o[0] * rows[:, 4]**2).max()))
    first = (position + 1e-12).astype(int)
    last = np.maximum(first, (position + span / per - 1e-12).astype(int))
    owner = np.repeat(np.arange(len(rows)), last - first + 1)
    inside = np.arange(owner.size) - np.repeat(np.cumsum(last - first + 1) - (last - first + 1), last - first + 1)
    k = first[owner] + inside
    u0 = np.where(inside == 0, 0.0, (k - position[owner]) * per)
    u1 = np.where(k == last[owner], span[owner], (k + 1 - position[owner]) * per)
    flat = 1j * (turn(-w * u1) - turn(-w * u0)) / w
    part = rows[owner, 4] * flat
    slips = way[owner] != 0
    plain = (abs(complex(o[0] - w * w, w * o[1]))**2 > CLOSE * w**4) & ((u1 - u0) * o[6] > LEAST)
    for mine, rule in ((slips & plain, _by_parts), (slips & ~plain, _by_points)):
        if mine.any():
            part[mine] += way[owner[mine]] * rule(u0[mine], u1[mine], rows[owner[mine]], w, o)
    part *= turn(-w * per * (position - first))[owner] * (2 / per)
    kept = k < len(phasors)
    np.add.at(phasors, k[kept], np.stack([part.real, part.imag], axis=1)[kept])


def _slips(u, rows, o) -> tuple:
    """Shift and speed (k,) of the phases rows (k, 10) at times u (k,) of them, 0 in sticks."""
    out = np.zeros((2, len(rows)))
    mine = np.flatnonzero(rows[:, 3])
    if mine.size:
        out[:, mine] = motions(u[mine], *(rows[mine, c] for c in (5, 6, 7, 8)), o, 2)
    return out


def _by_parts(u0, u1, rows, w, o):
    """`keep_kernels.by_parts` of many slips."""
    (y0, v0), (y1, v1) = _slips(u0, rows, o), _slips(u1, rows, o)
    e0, e1, (g0, bc, bs) = turn(-w * u0), turn(-w * u1), rows[:, 6:9].T
    half, twice = 0.5 * (u1 - u0), 0.25j * (e1 * e1 - e0 * e0) / w
    if abs(o[5] - w) <= 1e-14 * w:
        even, odd = half + twice, -1j * (half - twice)
    else:
        near, far = ((u1 - u0) * np.sinc(rate * half / np.pi) * turn(0.5 * rate * (u0 + u1))
                     for rate in (o[5] - w, -o[5] - w))
        even, odd = 0.5 * (near + far), -0.5j * (near - far)
    force = (g0 - bs) * 1j * (e1 - e0) / w + bs * even + bc * odd
    return (force - (v1 * e1 - v0 * e0) - complex(o[1], w) * (y1 * e1 - y0 * e0)) / complex(o[0] - w * w, w * o[1])


def _by_points(u0, u1, rows, w, o):
    """`keep_kernels.by_points` of many slips."""
    owner, u, weight = panels(u0, u1, max(o[6], w))
    y = _slips(u, rows[owner], o)[0] * weight
    out = np.zeros(len(rows), complex)
    np.add.at(out, owner, y * turn(-w * u))
    return out
