"""Samples, extremes and energies of an event-driven run: closed forms evaluated where they are wanted."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import numpy as np

from ..core import BaseSine, ModalBasis, Outcome, Response
from .events import PANEL, WEIGHT, Phase, Signal, combine, run

SAMPLES = 400  # per drive cycle in the kept window


@dataclass(frozen=True, eq=False, slots=True)
class EventRun:
    """An event-driven run. window: uniform samples of the last cycles and both sides of every event.

    amplitudes (c, 2): extremes of the output per cycle; phasors (c,): its drive-frequency part; ledger: energies [J];
    events: how many; loop: quadrature arrays (time, weight, slide, rate, force) over the window; stick: time stuck in
    the window [s]; starts: phases of release; acceleration: largest |absolute acceleration| at the output in the
    window, both sides of every jump.
    """

    response: Response
    window: Response
    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    events: int
    loop: tuple
    stick: float
    starts: np.ndarray
    acceleration: float
    cycles_done: float


def _states(phase: Phase, tau):
    return (np.stack([s.many(tau) for s in phase.modal], axis=1),
            np.stack([s.rate().many(tau) for s in phase.modal], axis=1))


def _panels(span: float, fastest: float) -> tuple:
    count = max(1, ceil(span * fastest / 1.5))
    edges = np.linspace(0, span, count + 1)
    half = np.diff(edges) / 2
    tau = (edges[:-1, None] + half[:, None] * (1 + PANEL)).ravel()
    return tau, (half[:, None] * WEIGHT).ravel()


def sample(phases, times, modes: ModalBasis, drive: BaseSine) -> Response:
    """Response at `times` (k,), ascending; a time on the border of two phases belongs to the later one."""
    starts = np.array([p.time for p in phases])
    owner = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(phases) - 1)
    n = modes.omega.size
    z, v, force = np.empty((times.size, n)), np.empty((times.size, n)), np.empty(times.size)
    for k in np.unique(owner):
        mine = owner == k
        tau = np.clip(times[mine] - phases[k].time, 0.0, phases[k].span)
        z[mine], v[mine] = _states(phases[k], tau)
        force[mine] = phases[k].force.many(tau)
        if phases[k].direction == 0 and n == 1:
            v[mine] = 0.0
    return _response(times, z, v, force, modes, drive)


def _response(times, z, v, force, modes, drive) -> Response:
    base = drive.acceleration * np.sin(drive.omega * times)
    accel = -np.outer(base, modes.base) - 2 * modes.zeta * modes.omega * v - modes.omega**2 * z \
        - np.outer(force, modes.slide) / modes.mass
    slide = z @ modes.slide
    return Response(times, z, v, slide, v @ modes.slide, z @ modes.output, v @ modes.output,
                    accel @ modes.output + base, base, force, slide)


def _energy(phase: Phase, modes: ModalBasis, drive: BaseSine, fastest: float) -> tuple:
    tau, weight = _panels(phase.span, fastest)
    _, v = _states(phase, tau)
    power = -modes.mass * drive.acceleration * np.sin(phase.theta + drive.omega * tau) * (v @ modes.base)
    loss = modes.mass * (v**2 @ (2 * modes.zeta * modes.omega))
    return weight @ power, weight @ loss, weight @ np.abs(power), weight @ (phase.force.many(tau) * (v @ modes.slide))


def simulate(modes: ModalBasis, drive: BaseSine, static: float, kinetic: float, cycles: float, window: int = 10,
             travel: float = np.inf, progress=None) -> EventRun:
    """Run `cycles` drive cycles from rest with friction forces [N]; keeps the last `window` cycles whole.

    The outcome is set only where the output passes `travel` [m]; the run ends there.
    """
    period, duration = drive.period, cycles * drive.period
    fastest = max(float(modes.omega.max()), drive.omega)
    recent, corners, extremes, ledger, count, peak = [], [], {}, np.zeros(4), 0, 0.0
    outcome, end, phasors = None, duration, np.zeros(int(np.ceil(cycles - 1e-9)), complex)
    for phase in run(modes, drive, static, kinetic, duration):
        out = combine(phase.modal, modes.output)
        crossing, turns = _phase_extremes(phase, out, period, fastest, travel, extremes, int(np.ceil(cycles - 1e-9)))
        if crossing is not None:
            outcome, end = Outcome.EXCEEDS_TRAVEL, phase.time + crossing
            phase = Phase(phase.time, phase.theta, crossing, phase.direction, phase.modal, phase.force)
        ledger += _energy(phase, modes, drive, fastest)
        _add_phasor(phase, out, period, phasors)
        peak = max(peak, _stored(phase, modes, 0.0), _stored(phase, modes, phase.span / 2))
        recent.append(phase)
        count += 1
        if len(corners) < 400_000:
            own = [0.0, *(turns if static == 0 or len(phase.modal) > 1 else [])]
            corners += [(phase.time + t, [s(t) for s in phase.modal], [s.rate()(t) for s in phase.modal],
                         phase.force(t)) for t in own if t <= phase.span]
        while len(recent) > 2 and recent[1].time < phase.time - (window + 1) * period:
            recent.pop(0)
        if progress is not None and count % 50 == 0:
            progress(phase.time / duration)
        if outcome is not None:
            break
    stored = _stored(recent[-1], modes, recent[-1].span)
    book = dict(zip(("work_in", "viscous", "power", "friction"), map(float, ledger)))
    book |= {"stored": stored, "peak_stored": max(peak, stored)}
    return _collect(modes, drive, recent, corners, extremes, phasors, book, outcome, count, window, end)


def _add_phasor(phase, out, period: float, phasors) -> None:
    """Add the samples of the output on a grid of 64 per cycle to the phasor of their cycle."""
    first = int(np.ceil(phase.time / period * 64 - 1e-9))
    number = np.arange(first, int(np.ceil((phase.time + phase.span) / period * 64 - 1e-9)))
    y = out.many(number * (period / 64) - phase.time)
    np.add.at(phasors, np.minimum(number // 64, len(phasors) - 1), y * np.exp(-2j * np.pi * number / 64) / 32)


def _stored(phase, modes, tau) -> float:
    z = np.array([s(tau) for s in phase.modal])
    v = np.array([s.rate()(tau) for s in phase.modal])
    return float(0.5 * modes.mass * np.sum(v**2 + (modes.omega * z)**2))


def _phase_extremes(phase, out, period, fastest, travel, extremes, cycles):
    """Book the extremes of the output over the phase per cycle. Returns (time in the phase at which |output| passes
    travel or None, times of the extremes)."""
    first = min(int(phase.time / period + 1e-12), cycles - 1)
    last = min(int((phase.time + phase.span) / period - 1e-12), cycles - 1)
    rate, turns = out.rate(), []
    for cycle in range(first, max(first, last) + 1):
        low = max(cycle * period - phase.time, 0.0) if cycle > first else 0.0
        high = min((cycle + 1) * period - phase.time, phase.span) if cycle < last else phase.span
        tau, y = _turning(out, rate, low, high, fastest)
        small, large = extremes.get(cycle, (np.inf, -np.inf))
        extremes[cycle] = (min(small, float(y.min())), max(large, float(y.max())))
        turns += sorted({float(tau[np.argmin(y)]), float(tau[np.argmax(y)])})
        beyond = np.flatnonzero(np.abs(y) > travel)
        if beyond.size:
            k = beyond[0]
            if k == 0:
                return float(tau[0]), turns
            from scipy.optimize import brentq

            return float(brentq(lambda t: abs(out(t)) - travel, tau[k - 1], tau[k])), turns
    return None, turns


def _turning(out, rate, low: float, high: float, fastest: float) -> tuple:
    """Times and values of the output on [low, high], the ends and every turning point among them."""
    if len(out.terms) == 1 and out.terms[0][0] == 0:
        tau = np.array([low, high])
        return tau, out.many(tau)
    return stationary(out, rate, np.linspace(low, high, max(3, ceil((high - low) * fastest * 6) + 1)))


def stationary(signal, rate, tau, share: float = 0.0) -> tuple:
    """Times and values of `signal` at tau (k,) and at the zeros of its rate between them (Newton from the secant,
    kept inside). share: only zeros beside a value of at least this share of the largest are looked for."""
    y, slope = signal.many(tau), rate.many(tau)
    size = np.abs(y)
    turn = np.flatnonzero((slope[:-1] * slope[1:] < 0) & (np.maximum(size[:-1], size[1:]) >= share * size.max()))
    extra, curve = [], rate.rate()
    for k in turn:
        a, b = tau[k], tau[k + 1]
        t = a - slope[k] * (b - a) / (slope[k + 1] - slope[k])
        for _ in range(6):
            bend = curve(t)
            t = min(max(t - rate(t) / bend, a), b) if bend != 0 else t
        extra.append(t)
    if not extra:
        return tau, y
    times = np.concatenate([tau, extra])
    order = np.argsort(times, kind="stable")
    return times[order], np.concatenate([y, signal.many(np.array(extra))])[order]


def _collect(modes, drive, recent, corners, extremes, phasors, book, outcome, count, window, end) -> EventRun:
    period = drive.period
    first = max(0.0, end - window * period)
    number = max(2, round((end - first) / period * SAMPLES) + 1)
    grid = np.linspace(first, end, number)
    events = np.array([p.time for p in recent if first < p.time < end])
    before = np.nextafter(events, -np.inf)
    times = np.unique(np.concatenate([grid, events, before]))
    wide = sample(recent, times, modes, drive)
    head = [c for c in corners if c[0] < first]
    if head:
        t, z, v, f = (np.array(column) for column in zip(*head))
        early = _response(t, z, v, f, modes, drive)
        full = Response(*(np.concatenate([getattr(early, k), getattr(wide, k)]) for k in (
            "time", "modal", "modal_rate", "slide", "slide_rate", "output", "output_rate", "acceleration",
            "base_acceleration", "force", "slip")))
    else:
        full = wide
    fastest = max(float(modes.omega.max()), drive.omega)
    pieces, stick, starts, top = [], 0.0, [], 0.0
    for p in recent:
        a, b = max(p.time, first), min(p.time + p.span, end)
        if b <= a:
            continue
        tau, weight = _panels(b - a, fastest)
        tau = tau + a - p.time
        z, v = _states(p, tau)
        pieces.append((p.time + tau, weight, z @ modes.slide, v @ modes.slide, p.force.many(tau)))
        stick += (b - a) if p.direction == 0 else 0.0
        if p.direction != 0 and a == p.time and a > first:
            starts.append((p.theta % np.pi, p.time))
        top = max(top, _peak_acceleration(p, modes, drive, a - p.time, b - p.time, fastest))
    stops = {b.time for a, b in pairwise(recent) if a.direction == 0 and a.span > 0}
    released = [theta for theta, time in starts if time in stops]
    loop = tuple(np.concatenate(column) for column in zip(*pieces))
    keys = sorted(extremes)
    return EventRun(full, wide, np.array([extremes[k] for k in keys]), phasors[:len(keys)], book, outcome, count, loop,
                    stick, np.array(released), top, end / period)


def _peak_acceleration(phase, modes, drive, low: float, high: float, fastest: float) -> float:
    """Largest |absolute acceleration| of the output between two times of a phase, both ends included."""
    out = combine(phase.modal, modes.output).rate().rate()
    lead = -1j * drive.acceleration * np.exp(1j * phase.theta)
    signal = Signal([*out.terms, (1j * drive.omega, complex(lead), 0.0, 0.0)])
    tau = np.linspace(low, high, max(5, ceil((high - low) * fastest * 8) + 1))
    return float(np.abs(stationary(signal, signal.rate(), tau, 0.9)[1]).max())
