"""Measures of a motion of `motion_reference`, each computed by its definition."""

from itertools import pairwise

import numpy as np
from motion_reference import Motion
from scipy.optimize import brentq, minimize_scalar

# Peaks within this relative distance of the largest node are refined; largest number of them.
NEAR, MOST = 1e-4, 12
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


class Window:
    """The last cycles of a motion: Gauss nodes and ends of every step, and values there."""

    def __init__(self, motion: Motion, stretches, begin: float, end: float, cycles: int):
        self.motion = motion
        self.begin = begin
        self.end = end
        borders = np.linspace(begin, end, cycles + 1)
        columns = {name: [] for name in ("t", "w", "y", "f", "split", "back", "a", "kind")}
        self.modes = []
        self.parts = []
        for one in stretches:
            if one.times[-1] <= begin or one.times[-1] <= one.times[0]:
                continue
            self.restore(one)
            inside = borders[(borders > one.times[0]) & (borders < one.times[-1])]
            cuts = np.unique(np.concatenate([np.clip(one.times, begin, end), inside]))
            for low, high in pairwise(cuts):
                t = (low + high) / 2 + (high - low) / 2 * np.concatenate([[-1.0], NODES, [1.0]])
                w = (high - low) / 2 * np.concatenate([[0.0], WEIGHTS, [0.0]])
                self._take(columns, one, t, w)
        self.t, self.w, self.y = (np.concatenate(columns[name]) for name in ("t", "w", "y"))
        self.f, self.split, self.back, self.a = (
            np.concatenate(columns[name]) for name in ("f", "split", "back", "a")
        )
        self.stuck = np.concatenate(columns["kind"])
        n = motion.n
        faces = motion.plant.faces
        self.q, self.v = self.y[:, :n] @ faces.T, self.y[:, n : 2 * n] @ faces.T
        self.out = self.y[:, :n] @ motion.plant.output

    def restore(self, one) -> None:
        """Set the laws to the modes and reversals of a smooth piece."""
        for k, law in enumerate(self.motion.laws):
            law.mode, law.side = one.modes[k]
            if one.turns:
                law.turns = one.turns[k]

    def _take(self, columns, one, t, w) -> None:
        """Append the values at times t with weights w of a smooth piece."""
        m = self.motion
        Y = one.solution(t).T
        self.parts.append((one, t))
        rates = Y[:, m.n : 2 * m.n] @ m.plant.faces.T
        columns["t"].append(t)
        columns["w"].append(w)
        columns["y"].append(Y)
        columns["f"].append(np.array([m.forces(a, y) for a, y in zip(t, Y)]))
        columns["a"].append(np.array([self.acceleration(a, y) for a, y in zip(t, Y)]))
        columns["split"].append(
            np.array(
                [
                    [law.split(y[part], v, a) for law, part, v in zip(m.laws, m.parts, row)]
                    for a, y, row in zip(t, Y, rates)
                ]
            )
        )
        columns["back"].append(
            np.array([[law.reversible(y[part]) for law, part in zip(m.laws, m.parts)] for y in Y])
        )
        columns["kind"].append(np.tile([law.mode == 0 for law in m.laws], (t.size, 1)))

    def acceleration(self, t, y) -> float:
        """Return the absolute acceleration of the output [m s-2]."""
        m = self.motion
        own = m.plant.output @ m.slope(t, y)[m.n : 2 * m.n]
        return own + m.drive(t) if m.moving else own

    def top(self, values, of, where=None) -> float:
        """Return the maximum over the window, refined in the steps in which it lies.

        Parameters
        ----------
        values : array
            Values at the nodes.
        of : callable
            of(t, y) -> value.
        where : array of bool, optional
            Nodes that count; by default all. A step lies completely inside or outside.
        """
        values = values if where is None else np.where(where, values, -np.inf)
        each = NODES.size + 2
        best = float(values.max())
        beside = np.concatenate([[-np.inf], values, [-np.inf]])
        peaks = np.flatnonzero(
            (values >= beside[:-2]) & (values >= beside[2:]) & (values >= best - NEAR * abs(best))
        )
        for k in peaks[np.argsort(-values[peaks])[:MOST]]:
            for part in {
                k // each,
                min((k + 1) // each, len(self.parts) - 1),
                max((k - 1) // each, 0),
            }:
                one, t = self.parts[part]
                if where is not None and not where[part * each + 1 : part * each + each - 1].all():
                    continue  # The next cycle begins in this step and may have a larger maximum.
                inside = min(max(k - part * each, 0), each - 1)
                self.restore(one)
                found = minimize_scalar(
                    lambda x, one=one: -of(x, one.solution(x)),
                    method="bounded",
                    bounds=(t[max(inside - 1, 0)], t[min(inside + 1, each - 1)]),
                    options={"xatol": 1e-7 * (t[-1] - t[0])},
                )
                best = max(best, float(-found.fun))
        return best


def measures(motion: Motion, stretches, period: float, cycles: float, window: int) -> dict:
    """Return the measures over the last `window` cycles; those of a second interface end in _2.

    Parameters
    ----------
    motion : Motion
    stretches : list
        From `Motion.run`.
    period : float
        [s]
    cycles : float
        Cycles of the run.
    window : int
    """
    s = motion.s
    p = motion.plant
    end = period * cycles
    w = Window(motion, stretches, end - window * period, end, window)
    n = motion.n
    out = {}
    high = w.top(w.out, lambda t, y: p.output @ y[:n])
    low = w.top(-w.out, lambda t, y: -p.output @ y[:n])
    last = _last_cycle(w, motion, period) if s["drive"] == "free" else None
    out["relative_displacement_amplitude"] = (high + low) / 2 if last is None else last
    out["absolute_acceleration_peak"] = w.top(np.abs(w.a), lambda t, y: abs(w.acceleration(t, y)))
    sine = s["drive"] in ("sine", "force", "levels")
    for k, law in enumerate(motion.laws):
        tail = f"_{k + 1}" if k else ""
        out[f"friction_force_peak{tail}"] = w.top(
            np.abs(w.f[:, k]), lambda t, y, k=k: abs(motion.forces(t, y)[k])
        )
        slip = w.q[:, k] - w.back[:, k]
        part = motion.parts[k]
        face = p.faces[k]
        ends = [
            w.top(
                sign * slip,
                lambda t, y, law=law, part=part, face=face, sign=sign: (
                    sign * (face @ y[:n] - law.reversible(y[part]))
                ),
            )
            for sign in (1, -1)
        ]
        if law.splits:
            out[f"slip_amplitude{tail}"] = sum(ends) / 2
        out[f"loop_area{tail}"] = float(np.sum(w.w * w.f[:, k] * w.v[:, k])) / window
        if not law.splits:
            continue
        out[f"stick_fraction{tail}"], starts = _stuck(w, law, k)
        if k == 0 and sine and starts.size:
            out["slip_start_phase"] = float(
                np.angle(np.mean(np.exp(2j * 2 * np.pi / period * starts))) / 2 % np.pi
            )
    if window > 1:
        means = [
            np.sum((w.w * w.q[:, 0])[(w.t > a) & (w.t < a + period)]) / period
            for a in (end - window * period, end - period)
        ]
        out["drift_per_cycle"] = (means[1] - means[0]) / (window - 1)
    else:
        out["drift_per_cycle"] = w.q[-1, 0] - w.q[0, 0]
    out |= works(motion, stretches, 0.0, end)
    if sine:
        out |= _periodic(w, motion, period, window)
    return out


def _last_cycle(w: Window, motion: Motion, period: float) -> float | None:
    """Return half the peak-to-peak output of the last whole cycle; None if there is none.

    Seen from the end, a position is a reversal if the output has returned from it by more than a
    quarter of its range in the last period.
    """
    n = motion.n
    row = motion.plant.output
    each = NODES.size + 2
    places = []
    rate = w.y[:, n : 2 * n] @ row
    way = np.where(np.abs(rate) <= 1e-9 * np.abs(rate).max(), 0.0, np.sign(rate))
    for a, b in pairwise(np.flatnonzero(way)):
        if way[a] == way[b]:
            continue
        one, t = w.parts[a // each]
        if b == a + 1 and b % each:
            w.restore(one)
            at = brentq(
                lambda x, one=one: row @ one.solution(x)[n : 2 * n],
                t[a % each],
                t[b % each],
                xtol=1e-16,
            )
            places.append(float(row @ one.solution(at)[:n]))
        else:  # The reversal coincides with an event.
            places.append(float(w.out[a : b + 1][np.argmin(np.abs(rate[a : b + 1]))]))
    least = 0.25 * np.ptp(w.out[w.t >= w.end - period])
    back = [float(w.out[-1]), *places[::-1]]
    if not least > 0:
        return least
    top = next((k for k, one in enumerate(back) if abs(one - back[0]) > least), len(back))
    turns = []
    while top < len(back) and len(turns) < 3:
        side = np.sign(back[top] - (turns[-1] if turns else back[0]))
        for k in range(top, len(back)):
            top = k if side * (back[k] - back[top]) > 0 else top
            if side * (back[top] - back[k]) > least:
                turns.append(back[top])
                top = k
                break
        else:
            break
    return None if len(turns) < 3 else max(abs(turns[0] - turns[1]), abs(turns[1] - turns[2])) / 2


def works(motion: Motion, stretches, begin: float, end: float) -> dict:
    """Return the work of a single interface between two times [s], and the dissipated part.

    The latter is left out if the law has no stored energy.
    """
    if len(motion.laws) > 1:
        return {}
    law, (first, last) = motion.laws[0], (at(stretches, t) for t in (begin, end))
    out = {"friction_work": float(last[-1] - first[-1])}
    if law.set_valued or motion.s["law"] == "tanh":
        return out | {"energy_dissipated": out["friction_work"]}
    stored = [law.energy(y[motion.parts[0]]) for y in (first, last)]
    return (
        out
        if None in stored
        else out | {"energy_dissipated": out["friction_work"] - stored[1] + stored[0]}
    )


def at(stretches, time: float) -> np.ndarray:
    """Return the state at a time [s]."""
    one = next((one for one in stretches if one.times[-1] >= time), stretches[-1])
    return one.solution(max(time, one.times[0]))


def _stuck(w: Window, law, k: int) -> tuple:
    """Return the fraction of time in which the interface sticks, and the starts of slip (j,) [s].

    It sticks while less than half of the displacement rate is irreversible.
    """
    if law.split_by_mode:
        stuck = w.stuck[:, k]
        share = float(np.sum(w.w * stuck)) / (w.end - w.begin)
        return share, w.t[1:][stuck[:-1] & ~stuck[1:]]
    if law.size == 0:
        return 0.0, np.empty(0)
    motion = w.motion
    part = w.motion.parts[k]
    face = w.motion.plant.faces[k]

    def above(t, y):
        """Return the irreversible fraction of the displacement rate minus one half."""
        v = face @ y[motion.n : 2 * motion.n]
        return abs(law.split(y[part], v, t) / v) - 0.5 if v else -0.5

    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.where(w.v[:, k] == 0, -0.5, np.abs(w.split[:, k] / w.v[:, k]) - 0.5)
    below = 0.0
    starts = []
    for number, (one, t) in enumerate(w.parts):
        row = values[number * t.size : (number + 1) * t.size]
        w.restore(one)
        turns = [
            brentq(lambda x, one=one: above(x, one.solution(x)), t[j], t[j + 1], xtol=1e-16)
            if row[j] and row[j + 1]
            else t[j + (row[j + 1] == 0)]
            for j in np.flatnonzero((row[:-1] < 0) != (row[1:] < 0))
        ]
        sides = np.array([t[0], *turns, t[-1]])
        below += float(np.diff(sides)[int(row[0] >= 0) :: 2].sum())
        starts += turns[int(row[0] >= 0) :: 2]
        if number and values[number * t.size - 1] < 0 <= row[0]:  # The slip starts at an event.
            starts.append(t[0])
    return below / (w.end - w.begin), np.array(starts)


def _secant(w: Window, motion: Motion, period: float, window: int) -> float | None:
    """Return the mean secant stiffness of the cycles, for laws whose force does not jump.

    It is the difference of the forces at the largest and smallest displacement over that of the
    displacements. None if a cycle ends before the displacement reverses.
    """
    out = []
    for c in range(window):
        mine = np.flatnonzero((w.t >= w.begin + c * period) & (w.t <= w.begin + (c + 1) * period))
        ends = [_turn(w, motion, mine[np.argmax(sign * w.q[mine, 0])]) for sign in (-1, 1)]
        if None in ends:
            return None
        low, high = ends
        out.append((high[1] - low[1]) / (high[0] - low[0]))
    return float(np.mean(out))


def _turn(w: Window, motion: Motion, k: int) -> tuple | None:
    """Return (displacement, force) at a reversal next to node k; None if there is none."""
    each = NODES.size + 2
    face = motion.plant.faces[0]
    if w.v[k, 0] == 0:
        return w.q[k, 0], w.f[k, 0]
    for low in (k - 1, k):
        if low < 0 or low // each != (low + 1) // each or w.v[low, 0] * w.v[low + 1, 0] >= 0:
            continue
        one, t = w.parts[low // each]
        w.restore(one)
        turn = brentq(
            lambda x, one=one: face @ one.solution(x)[motion.n : 2 * motion.n],
            t[low % each],
            t[low % each + 1],
            xtol=1e-16,
        )
        y = one.solution(turn)
        return face @ y[: motion.n], motion.forces(turn, y)[0]
    rest = 1e-9 * np.abs(w.v[:, 0]).max()  # The event of a reversal lies at a node.
    return (w.q[k, 0], w.f[k, 0]) if abs(w.v[k, 0]) <= rest else None


def _periodic(w: Window, motion: Motion, period: float, window: int) -> dict:
    """Return stiffness and damping of the first interface, and the distortion of the acceleration."""
    omega = 2 * np.pi / period
    q = w.q[:, 0]
    f = w.f[:, 0]

    def part(values, order=1):
        """Return the complex amplitude of a harmonic of the drive."""
        return 2 * np.sum(w.w * values * np.exp(-1j * order * omega * w.t)) / (w.end - w.begin)

    first, third = (abs(part(w.a, order)) for order in (1, 3))
    out = {
        "absolute_acceleration_fundamental": float(first),
        "acceleration_distortion": float(third / first),
    }
    first = part(q)
    if np.ptp(q) == 0:
        return out
    out["equivalent_stiffness"] = float((part(f) / first).real)
    if not motion.laws[0].set_valued:
        secant = _secant(w, motion, period, window)
        out |= {} if secant is None else {"secant_stiffness": secant}
    if motion.plant.first > 0:
        each = []
        face = motion.plant.faces[0]
        for c in range(window):
            mine = (w.t >= w.begin + c * period) & (w.t <= w.begin + (c + 1) * period)
            each += [
                w.top(sign * q, lambda t, y, sign=sign: sign * (face @ y[: motion.n]), mine)
                for sign in (1, -1)
            ]
        area = float(np.sum(w.w * f * w.v[:, 0])) / window
        half = sum(each) / (2 * window)
        out["equivalent_damping"] = area / (2 * np.pi * motion.plant.first * half**2)
    return out
