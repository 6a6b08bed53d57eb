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
        for piece in stretches:
            if piece.times[-1] <= begin or piece.times[-1] <= piece.times[0]:
                continue
            self.restore_laws(piece)
            inner_borders = borders[(borders > piece.times[0]) & (borders < piece.times[-1])]
            cuts = np.unique(np.concatenate([np.clip(piece.times, begin, end), inner_borders]))
            for low, high in pairwise(cuts):
                t = (low + high) / 2 + (high - low) / 2 * np.concatenate([[-1.0], NODES, [1.0]])
                w = (high - low) / 2 * np.concatenate([[0.0], WEIGHTS, [0.0]])
                self._append_values(columns, piece, t, w)
        self.t, self.w, self.y = (np.concatenate(columns[name]) for name in ("t", "w", "y"))
        self.f, self.split, self.back, self.a = (
            np.concatenate(columns[name]) for name in ("f", "split", "back", "a")
        )
        self.stuck = np.concatenate(columns["kind"])
        n = motion.n
        faces = motion.plant.faces
        self.q, self.v = self.y[:, :n] @ faces.T, self.y[:, n : 2 * n] @ faces.T
        self.out = self.y[:, :n] @ motion.plant.output

    def restore_laws(self, piece) -> None:
        """Set the laws to the modes and reversals of a smooth piece."""
        for k, law in enumerate(self.motion.laws):
            law.mode, law.side = piece.modes[k]
            law.turns = piece.turns[k]

    def _append_values(self, columns, piece, t, w) -> None:
        """Append the values at times t with weights w of a smooth piece."""
        m = self.motion
        Y = piece.solution(t).T
        self.parts.append((piece, t))
        rates = Y[:, m.n : 2 * m.n] @ m.plant.faces.T
        columns["t"].append(t)
        columns["w"].append(w)
        columns["y"].append(Y)
        columns["f"].append(np.array([m.friction_forces(a, y) for a, y in zip(t, Y)]))
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
        relative = m.plant.output @ m.derivative(t, y)[m.n : 2 * m.n]
        return relative + m.drive(t) if m.moving else relative

    def find_maximum(self, values, function, mask=None) -> float:
        """Return the maximum over the window, refined in the steps in which it lies.

        Parameters
        ----------
        values : array
            Values at the nodes.
        function : callable
            of(t, y) -> value.
        mask : array of bool, optional
            Nodes that count; by default all. A step lies completely inside or outside.
        """
        values = values if mask is None else np.where(mask, values, -np.inf)
        nodes_per_step = NODES.size + 2
        maximum = float(values.max())
        padded = np.concatenate([[-np.inf], values, [-np.inf]])
        peaks = np.flatnonzero(
            (values >= padded[:-2])
            & (values >= padded[2:])
            & (values >= maximum - NEAR * abs(maximum))
        )
        for k in peaks[np.argsort(-values[peaks])[:MOST]]:
            for part in {
                k // nodes_per_step,
                min((k + 1) // nodes_per_step, len(self.parts) - 1),
                max((k - 1) // nodes_per_step, 0),
            }:
                piece, t = self.parts[part]
                if (
                    mask is not None
                    and not mask[
                        part * nodes_per_step + 1 : part * nodes_per_step + nodes_per_step - 1
                    ].all()
                ):
                    continue  # The next cycle begins in this step and may have a larger maximum.
                node = min(max(k - part * nodes_per_step, 0), nodes_per_step - 1)
                self.restore_laws(piece)
                optimum = minimize_scalar(
                    lambda x, one=piece: -function(x, one.solution(x)),
                    method="bounded",
                    bounds=(t[max(node - 1, 0)], t[min(node + 1, nodes_per_step - 1)]),
                    options={"xatol": 1e-7 * (t[-1] - t[0])},
                )
                maximum = max(maximum, float(-optimum.fun))
        return maximum


def compute_measures(motion: Motion, stretches, period: float, cycles: float, window: int) -> dict:
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
    high = w.find_maximum(w.out, lambda t, y: p.output @ y[:n])
    low = w.find_maximum(-w.out, lambda t, y: -p.output @ y[:n])
    last = _last_cycle_amplitude(w, motion, period) if s["drive"] == "free" else None
    out["relative_displacement_amplitude"] = (high + low) / 2 if last is None else last
    out["absolute_acceleration_peak"] = w.find_maximum(
        np.abs(w.a), lambda t, y: abs(w.acceleration(t, y))
    )
    sine = s["drive"] in ("sine", "force", "levels")
    for k, law in enumerate(motion.laws):
        suffix = f"_{k + 1}" if k else ""
        out[f"friction_force_peak{suffix}"] = w.find_maximum(
            np.abs(w.f[:, k]), lambda t, y, k=k: abs(motion.friction_forces(t, y)[k])
        )
        slip = w.q[:, k] - w.back[:, k]
        part = motion.parts[k]
        face = p.faces[k]
        extremes = [
            w.find_maximum(
                sign * slip,
                lambda t, y, law=law, part=part, face=face, sign=sign: (
                    sign * (face @ y[:n] - law.reversible(y[part]))
                ),
            )
            for sign in (1, -1)
        ]
        if law.splits:
            out[f"slip_amplitude{suffix}"] = sum(extremes) / 2
        out[f"loop_area{suffix}"] = float(np.sum(w.w * w.f[:, k] * w.v[:, k])) / window
        if not law.splits:
            continue
        out[f"stick_fraction{suffix}"], starts = _stick_fraction(w, law, k)
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
    out |= compute_works(motion, stretches, 0.0, end)
    if sine:
        out |= _harmonic_measures(w, motion, period, window)
    return out


def _last_cycle_amplitude(w: Window, motion: Motion, period: float) -> float | None:
    """Return half the peak-to-peak output of the last whole cycle; None if there is none.

    Seen from the end, a position is a reversal if the output has returned from it by more than a
    quarter of its range in the last period.
    """
    n = motion.n
    row = motion.plant.output
    nodes_per_step = NODES.size + 2
    extremes = []
    rate = w.y[:, n : 2 * n] @ row
    direction = np.where(np.abs(rate) <= 1e-9 * np.abs(rate).max(), 0.0, np.sign(rate))
    for a, b in pairwise(np.flatnonzero(direction)):
        if direction[a] == direction[b]:
            continue
        piece, t = w.parts[a // nodes_per_step]
        if b == a + 1 and b % nodes_per_step:
            w.restore_laws(piece)
            zero = brentq(
                lambda x, one=piece: row @ one.solution(x)[n : 2 * n],
                t[a % nodes_per_step],
                t[b % nodes_per_step],
                xtol=1e-16,
            )
            extremes.append(float(row @ piece.solution(zero)[:n]))
        else:  # The reversal coincides with an event.
            extremes.append(float(w.out[a : b + 1][np.argmin(np.abs(rate[a : b + 1]))]))
    min_range = 0.25 * np.ptp(w.out[w.t >= w.end - period])
    positions = [float(w.out[-1]), *extremes[::-1]]
    if not min_range > 0:
        return min_range
    extreme = next(
        (k for k, piece in enumerate(positions) if abs(piece - positions[0]) > min_range),
        len(positions),
    )
    reversals = []
    while extreme < len(positions) and len(reversals) < 3:
        side = np.sign(positions[extreme] - (reversals[-1] if reversals else positions[0]))
        for k in range(extreme, len(positions)):
            extreme = k if side * (positions[k] - positions[extreme]) > 0 else extreme
            if side * (positions[extreme] - positions[k]) > min_range:
                reversals.append(positions[extreme])
                extreme = k
                break
        else:
            break
    return (
        None
        if len(reversals) < 3
        else max(abs(reversals[0] - reversals[1]), abs(reversals[1] - reversals[2])) / 2
    )


def compute_works(motion: Motion, stretches, begin: float, end: float) -> dict:
    """Return the work of a single interface between two times [s], and the dissipated part.

    The latter is left out if the law has no stored energy.
    """
    if len(motion.laws) > 1:
        return {}
    law, (first, last) = motion.laws[0], (evaluate_state(stretches, t) for t in (begin, end))
    out = {"friction_work": float(last[-1] - first[-1])}
    if law.set_valued or motion.s["law"] == "tanh":
        return out | {"energy_dissipated": out["friction_work"]}
    stored = [law.energy(y[motion.parts[0]]) for y in (first, last)]
    return (
        out
        if None in stored
        else out | {"energy_dissipated": out["friction_work"] - stored[1] + stored[0]}
    )


def evaluate_state(stretches, time: float) -> np.ndarray:
    """Return the state at a time [s]."""
    piece = next((piece for piece in stretches if piece.times[-1] >= time), stretches[-1])
    return piece.solution(max(time, piece.times[0]))


def _stick_fraction(w: Window, law, k: int) -> tuple:
    """Return the fraction of time in which the interface sticks, and the starts of slip (j,) [s].

    It sticks while less than half of the displacement rate is irreversible.
    """
    if law.split_by_mode:
        stuck = w.stuck[:, k]
        stick_fraction = float(np.sum(w.w * stuck)) / (w.end - w.begin)
        return stick_fraction, w.t[1:][stuck[:-1] & ~stuck[1:]]
    if law.size == 0:
        return 0.0, np.empty(0)
    motion = w.motion
    part = w.motion.parts[k]
    face = w.motion.plant.faces[k]

    def slip_margin(t, y):
        """Return the irreversible fraction of the displacement rate minus one half."""
        v = face @ y[motion.n : 2 * motion.n]
        return abs(law.split(y[part], v, t) / v) - 0.5 if v else -0.5

    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.where(w.v[:, k] == 0, -0.5, np.abs(w.split[:, k] / w.v[:, k]) - 0.5)
    stick_time = 0.0
    starts = []
    for number, (piece, t) in enumerate(w.parts):
        row = values[number * t.size : (number + 1) * t.size]
        w.restore_laws(piece)
        crossings = [
            brentq(lambda x, one=piece: slip_margin(x, one.solution(x)), t[j], t[j + 1], xtol=1e-16)
            if row[j] and row[j + 1]
            else t[j + (row[j + 1] == 0)]
            for j in np.flatnonzero((row[:-1] < 0) != (row[1:] < 0))
        ]
        times = np.array([t[0], *crossings, t[-1]])
        stick_time += float(np.diff(times)[int(row[0] >= 0) :: 2].sum())
        starts += crossings[int(row[0] >= 0) :: 2]
        if number and values[number * t.size - 1] < 0 <= row[0]:  # The slip starts at an event.
            starts.append(t[0])
    return stick_time / (w.end - w.begin), np.array(starts)


def _mean_secant_stiffness(w: Window, motion: Motion, period: float, window: int) -> float | None:
    """Return the mean secant stiffness of the cycles, for laws whose force does not jump.

    It is the difference of the forces at the largest and smallest displacement over that of the
    displacements. None if a cycle ends before the displacement reverses.
    """
    out = []
    for c in range(window):
        in_cycle = np.flatnonzero(
            (w.t >= w.begin + c * period) & (w.t <= w.begin + (c + 1) * period)
        )
        extremes = [
            _find_reversal(w, motion, in_cycle[np.argmax(sign * w.q[in_cycle, 0])])
            for sign in (-1, 1)
        ]
        if None in extremes:
            return None
        low, high = extremes
        out.append((high[1] - low[1]) / (high[0] - low[0]))
    return float(np.mean(out))


def _find_reversal(w: Window, motion: Motion, k: int) -> tuple | None:
    """Return (displacement, force) at a reversal next to node k; None if there is none."""
    nodes_per_step = NODES.size + 2
    face = motion.plant.faces[0]
    if w.v[k, 0] == 0:
        return w.q[k, 0], w.f[k, 0]
    for low in (k - 1, k):
        if (
            low < 0
            or low // nodes_per_step != (low + 1) // nodes_per_step
            or w.v[low, 0] * w.v[low + 1, 0] >= 0
        ):
            continue
        piece, t = w.parts[low // nodes_per_step]
        w.restore_laws(piece)
        time = brentq(
            lambda x, one=piece: face @ one.solution(x)[motion.n : 2 * motion.n],
            t[low % nodes_per_step],
            t[low % nodes_per_step + 1],
            xtol=1e-16,
        )
        y = piece.solution(time)
        return face @ y[: motion.n], motion.friction_forces(time, y)[0]
    zero_speed = 1e-9 * np.abs(w.v[:, 0]).max()  # The event of a reversal lies at a node.
    return (w.q[k, 0], w.f[k, 0]) if abs(w.v[k, 0]) <= zero_speed else None


def _harmonic_measures(w: Window, motion: Motion, period: float, window: int) -> dict:
    """Return stiffness and damping of the first interface, and the distortion of the acceleration."""
    omega = 2 * np.pi / period
    q = w.q[:, 0]
    f = w.f[:, 0]

    def harmonic(values, order=1):
        """Return the complex amplitude of a harmonic of the drive."""
        return 2 * np.sum(w.w * values * np.exp(-1j * order * omega * w.t)) / (w.end - w.begin)

    first, third = (abs(harmonic(w.a, order)) for order in (1, 3))
    out = {
        "absolute_acceleration_fundamental": float(first),
        "acceleration_distortion": float(third / first),
    }
    first = harmonic(q)
    if np.ptp(q) == 0:
        return out
    out["equivalent_stiffness"] = float((harmonic(f) / first).real)
    if not motion.laws[0].set_valued:
        secant = _mean_secant_stiffness(w, motion, period, window)
        out |= {} if secant is None else {"secant_stiffness": secant}
    if motion.plant.first > 0:
        extremes = []
        face = motion.plant.faces[0]
        for c in range(window):
            in_cycle = (w.t >= w.begin + c * period) & (w.t <= w.begin + (c + 1) * period)
            extremes += [
                w.find_maximum(
                    sign * q, lambda t, y, sign=sign: sign * (face @ y[: motion.n]), in_cycle
                )
                for sign in (1, -1)
            ]
        area = float(np.sum(w.w * f * w.v[:, 0])) / window
        half = sum(extremes) / (2 * window)
        out["equivalent_damping"] = area / (2 * np.pi * motion.plant.first * half**2)
    return out
