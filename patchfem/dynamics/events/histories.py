"""Samples, extremes and energies of an event-driven run: its series evaluated where they are wanted."""

from dataclasses import dataclass
from math import ceil, comb

import numpy as np

from ...core import ModalBasis, Outcome, PatchfemError, Response, Start
from . import batches
from .engine import Engine
from .event_list import RELEASE, EventLog
from .signals import ORDER

SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # of a run that has no cycles
_TOGETHER = 512  # pieces


@dataclass(frozen=True, eq=False, slots=True)
class EventRun:
    """An event-driven run. window: uniform samples of the last cycles and both sides of every event.

    amplitudes (c, 2): extremes of the output per cycle; phasors (c,): its drive-frequency part; ledger: energies [J]
    over all interfaces; events: how many stretches between events; loop: quadrature arrays (time, weight, slide, rate,
    force) over the window; stick: time stuck in the window [s]; starts: phases of release, mod pi; acceleration:
    largest |absolute acceleration| at the output in the window, both sides of every jump; log: the events;
    force_peaks (i,): largest friction force [N] of each interface in the window; waves (2,): first and third harmonic
    of the absolute acceleration at the output over the window; means (2,): time means [m] of the first slide in the
    window's first and last cycle, None where it holds none or ends inside one. loop, stick and starts are the first
    interface's; those of all are in Response.extra.
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
    log: EventLog | None = None
    force_peaks: np.ndarray | None = None
    waves: np.ndarray | None = None
    means: tuple | None = None


def simulate(modes: ModalBasis, drive, static, kinetic, cycles: float, window: int = 10, travel: float = np.inf,
             progress=None, start: Start | None = None) -> EventRun:
    """Run `cycles` drive cycles from rest or `start` with friction forces [N]; keeps the last `window` cycles whole.

    static, kinetic: one for every interface or (i,). The outcome is set only where the output passes `travel` [m]; the
    run ends there.
    """
    if start is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError("structure.travel: the start lies beyond it; raise travel or start nearer to the middle")
    kept = _Kept(modes, drive, cycles, window, travel)
    engine, waiting = Engine(modes, drive, static, kinetic, cycles, start, True), []
    kept.live = engine.live
    for piece in engine.pieces():
        waiting.append(piece)
        if len(waiting) == _TOGETHER:
            kept.add(batches.gather(waiting))
            waiting = []
            if kept.outcome is not None:
                break
            if progress is not None:
                progress(piece.time / kept.end)
    if waiting and kept.outcome is None:
        kept.add(batches.gather(waiting))
    return kept.close(engine.recorder.log())


class _Kept:
    """Samples, sums and extremes that are kept while a run goes on."""

    def __init__(self, modes, drive, cycles, window, travel):
        self.modes, self.drive, self.window, self.travel, self.live = modes, drive, window, travel, ()
        self.end, self.cycles = cycles * drive.period, max(1, ceil(cycles - 1e-9))
        self.low, self.high = np.full(self.cycles, np.inf), np.full(self.cycles, -np.inf)
        self.phasors = np.zeros(self.cycles, complex)
        self.ledger, self.peak, self.events, self.corners = np.zeros(4), 0.0, 0, 0
        self.early, self.recent, self.outcome, self.begun = [], [], None, None

    def add(self, batch) -> None:
        """Take in the next pieces."""
        series, share = batch.coefs @ self.modes.output, batch.share
        piece, u = batches.turning_points(series, share)
        begin, last = series[:, 0], batches.values_at(series, np.arange(len(batch)), share)
        turn = batches.values_at(series, piece, u)
        if max(np.abs(x).max(initial=0.0) for x in (begin, last, turn)) > self.travel:
            batch, piece, u, turn, begin, last = self._stop(batch, series, piece, u, turn)
            series = series[:len(batch)]
        cycle = np.minimum(batch.cycle, self.cycles - 1)
        for where, value in ((cycle, begin), (cycle, last), (cycle[piece], turn)):
            np.minimum.at(self.low, where, value)
            np.maximum.at(self.high, where, value)
        if self.begun is None:
            self.begun = float(batches.stored(batch.cut(slice(0, 1)), self.modes, 0.0)[0])
        self.ledger += batches.energies(batch, self.modes, self.live)
        self.peak = max(self.peak, *(float(batches.stored(batch, self.modes, s).max()) for s in (0.0, 0.5)))
        self.events += int(np.count_nonzero(batch.first))
        self._add_phasor(batch, series, cycle)
        if self.corners < 400_000:
            self._corners(batch, piece, u)
        self.recent.append(batch)
        while len(self.recent) > 1 and self.recent[1].time[0] < batch.time[-1] - (self.window + 1) * self.drive.period:
            self.recent.pop(0)

    def _stop(self, batch, series, piece, u, turn) -> tuple:
        """Cut the pieces where the output first passes the travel."""
        every = np.arange(len(batch))
        order = np.concatenate([every, every, piece])
        where = np.concatenate([np.zeros(len(batch)), batch.share, u])
        value = np.concatenate([series[:, 0], batches.values_at(series, every, batch.share), turn])
        k = order[np.abs(value) > self.travel].min()
        beyond = np.sort(where[(order == k) & (np.abs(value) > self.travel)])[0]
        inside = np.sort(where[(order == k) & (np.abs(value) <= self.travel) & (where < beyond)])
        at = beyond
        if inside.size:
            from scipy.optimize import brentq

            one = series[k:k + 1]
            at = brentq(lambda x: abs(batches.values_at(one, [0], np.array([x]))[0]) - self.travel, inside[-1], beyond,
                        xtol=1e-15)
        span = at * batch.unit[k]
        self.outcome, self.end = Outcome.EXCEEDS_TRAVEL, float(batch.time[k] + span)
        batch = batch.cut(slice(0, k + 1)).ending(span)
        kept = (piece < k) | ((piece == k) & (u <= at))
        series = series[:k + 1]
        return (batch, piece[kept], u[kept], turn[kept], series[:, 0],
                batches.values_at(series, np.arange(k + 1), batch.share))

    def _add_phasor(self, batch, series, cycle) -> None:
        """Add the pieces' parts of 2/period int y exp(-i omega t) dt to the phasors of their cycles, by Gauss points.
        """
        tau, turn = batch.span[:, None] * batches.NODES, 2 * np.pi / self.drive.period
        y = np.einsum("kjp,kp->kj", batches.powers(tau / batch.unit[:, None]), series)
        angle = turn * (batch.time - cycle * self.drive.period)[:, None] + turn * tau
        part = batch.span * ((y * np.exp(-1j * angle)) @ batches.WEIGHTS)
        np.add.at(self.phasors, cycle, part * (2 / self.drive.period))

    def _corners(self, batch, piece, u) -> None:
        """States kept before the window: where events stand, and turning points unless every one of them is an
        event."""
        owner, tau = np.flatnonzero(batch.first), np.zeros(np.count_nonzero(batch.first))
        if len(self.live) == 0 or len(self.modes.omega) > 1:
            owner = np.concatenate([owner, piece])
            tau = np.concatenate([tau, u * batch.unit[piece]])
            order = np.lexsort((tau, owner))
            owner, tau = owner[order], tau[order]
        kept = batch.time[owner] + tau < self.end - self.window * self.drive.period
        owner, tau = owner[kept], tau[kept]
        if owner.size:
            self.corners += owner.size
            self.early.append(batches.at(batch, owner, tau, batch.time[owner] + tau, self.modes, self.drive, self.live))

    def close(self, log: EventLog) -> EventRun:
        """Everything kept, as an EventRun."""
        recent, period = batches.join(self.recent), self.drive.period
        last = recent.cut(slice(len(recent) - 1, len(recent)))
        stored = float(batches.stored(last, self.modes, 1.0)[0])
        book = dict(zip(("work_in", "viscous", "power", "friction"), map(float, self.ledger)))
        book |= {"stored": stored - self.begun, "peak_stored": max(self.peak, stored)}
        first = max(0.0, self.end - self.window * period)
        begin = min(first, max(0.0, self.end - 2 * period))  # two cycles are kept whole
        wide, early = self._wide(recent, first, self.end), [_part(r, r.time < begin) for r in self.early]
        if begin < first:
            before = self._wide(recent, begin, first)
            early.append(_part(before, before.time < first))
        full = _chain([*[r for r in early if r.time.size], wide])
        held = self._inside(recent, first)
        loop, mine = batches.loop_of(held, self.modes, self.live), bool(len(self.live) and self.live[0] == 0)
        stick = float(held.span[held.signs[:, 0] == 0].sum()) if mine else 0.0
        log = log.until(self.end)
        starts = log.phase[(log.interface == 0) & (np.abs(log.what) == RELEASE) & (log.time > first)] % np.pi
        done = slice(0, max(1, ceil(self.end / period - 1e-9)))
        return EventRun(full, wide, np.stack([self.low, self.high], axis=1)[done], self.phasors[done], book,
                        self.outcome, self.events, loop, stick, starts, self._peak_acceleration(held),
                        self.end / period, log, self._peak_forces(held), self._waves(held), self._means(held, first))

    def _wide(self, recent, first: float, end: float) -> Response:
        """Uniform samples from `first` to `end` and both sides of every event."""
        number = max(LEAST, round((end - first) / self.drive.period * SAMPLES) + 1)
        events = recent.time[recent.first & (recent.time > first) & (recent.time < end)]
        times = np.unique(np.concatenate([np.linspace(first, end, number), events, np.nextafter(events, -np.inf)]))
        return batches.sample(recent, times, self.modes, self.drive, self.live)

    def _inside(self, recent, first: float):
        """The pieces of the window, the first one cut at its border."""
        held = recent.cut((recent.time + recent.span > first) & (recent.time < self.end) & (recent.span > 0))
        if held.time[0] >= first:
            return held
        gone = first - held.time[0]
        return held if gone < 1e-9 * self.drive.period else _shift(held, gone)

    def _peak_acceleration(self, held) -> float:
        return _largest(batches.absolute(held, self.modes, self.drive.moving), held.share)

    def _waves(self, held) -> np.ndarray:
        """First and third harmonic (2,) of the absolute acceleration over the pieces, by Gauss points."""
        series, turn, out = batches.absolute(held, self.modes, self.drive.moving), 2 * np.pi / self.drive.period, 0.0
        for k in range(0, len(held), batches.TOGETHER):
            part = slice(k, k + batches.TOGETHER)
            u = held.share[part, None] * batches.NODES
            a = np.einsum("kjp,kp->kj", batches.powers(u), series[part]) * held.span[part, None] * batches.WEIGHTS
            angle = turn * (held.time[part, None] + held.unit[part, None] * u)
            out = out + np.array([np.sum(a * np.exp(-1j * n * angle)) for n in (1, 3)])
        return out * (2 / held.span.sum())

    def _means(self, held, first: float) -> tuple | None:
        """Means of the first slide over the first and the last cycle of the pieces, which end with the cycles."""
        period = self.drive.period
        turns = self.end / period
        if abs(turns - round(turns)) > 1e-9 or self.end - first < period * (1 - 1e-9):
            return None
        slide = held.coefs @ np.asarray(self.modes.interfaces, float)[0]
        if len(self.live) and self.live[0] == 0:
            slide[held.signs[:, 0] == 0] *= ORDER == 0
            slide[held.signs[:, 0] == 0, 0] = held.held[held.signs[:, 0] == 0, 0]
        area = held.span * np.einsum("kp,kp->k", batches.powers(held.share), slide / (ORDER + 1))
        middle = held.time + held.span / 2
        return tuple(float(area[part].sum() / period) for part in (middle < first + period, middle > self.end - period))

    def _peak_forces(self, held) -> np.ndarray:
        peaks = np.zeros(len(self.modes.interfaces))
        for k, face in enumerate(self.live):
            peaks[face] = _largest(batches.pushing(held, self.modes, k), held.share)
        return peaks


def _largest(series, share) -> float:
    """Largest size of series (k, TERMS) over shares (k,) of their units."""
    top = 0.0
    for k in range(0, len(series), batches.TOGETHER):
        part, ends = series[k:k + batches.TOGETHER], share[k:k + batches.TOGETHER]
        piece, u = batches.turning_points(part, ends)
        values = [part[:, 0], batches.values_at(part, np.arange(len(part)), ends), batches.values_at(part, piece, u)]
        top = max(top, *(float(np.abs(x).max(initial=0.0)) for x in values))
    return top


def _shift(batch, gone: float):
    """The first piece of a batch begun `gone` [s] later."""
    coefs, base, time, span = (getattr(batch, n).copy() for n in ("coefs", "base", "time", "span"))
    x, size = gone / batch.unit[0], batch.coefs.shape[1]
    move = np.array([[comb(k, j) * x**(k - j) if k >= j else 0.0 for k in range(size)] for j in range(size)])
    coefs[0], base[0] = move @ coefs[0], move @ base[0]
    time[0], span[0] = time[0] + gone, span[0] - gone
    new = {"coefs": coefs, "base": base, "time": time, "span": span}
    return type(batch)(*(new.get(name, getattr(batch, name)) for name in type(batch).__slots__))


_COLUMNS = ("time", "modal", "modal_rate", "slide", "slide_rate", "output", "output_rate", "acceleration",
            "base_acceleration", "force", "slip")


def _part(response: Response, which) -> Response:
    return Response(*(getattr(response, name)[which] for name in _COLUMNS),
                    {name: values[which] for name, values in response.extra.items()})


def _chain(parts) -> Response:
    if len(parts) == 1:
        return parts[0]
    return Response(*(np.concatenate([getattr(r, name) for r in parts]) for name in _COLUMNS),
                    {name: np.concatenate([r.extra[name] for r in parts]) for name in parts[0].extra})
