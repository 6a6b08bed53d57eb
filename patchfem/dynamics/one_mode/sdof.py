"""One mode with one Coulomb interface in closed form: the fast way of `piecewise.histories`, for any drive in segments.

Short blocks run as plain Python, so no compiled code is loaded; long ones run compiled.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi

import numpy as np

from ...core import ModalBasis, NotConverged, Outcome, PatchfemError, Response, Start, frozen_array
from ..piecewise.event_list import ROOM, EventLog
from . import sdof_kernels, window_kernels
from .sdof_keep import keep
from .sdof_samples import (
    OneMode,
    base_part,
    force,
    panels,
    peak_acceleration,
    peak_force,
    position,
    response,
    starts,
    states,
    stretches,
)

COMPILED_FROM = 2000  # cycles: loading the compiled code takes 0.07 s, plain Python 0.12 ms more a cycle
CHUNK = 4096  # events held at once beside those of the window
CORNERS = 400_000  # corners kept from before the window
ENDS = 5  # last windows whose phasors tell a steady motion (response.settling)
SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # of a run that has no cycles


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


def scene_of(modes: ModalBasis, drive, static: float, kinetic: float, duration: float) -> OneMode:
    """The mode, its friction [N] and its drive, over the mass.

    PatchfemError where they are not one mode with one interface, the drive has no closed form, or kinetic friction
    exceeds static.
    """
    if modes.omega.size != 1 or modes.interfaces.shape[0] != 1:
        raise PatchfemError("structure: the fast event engine is of one mode and one interface; use the general one")
    if not drive.segments:
        raise PatchfemError("drive.waveform: the event engine needs a drive in closed form (sine, step, levels, "
                            "release); use method = \"march\"")
    if static < 0 or kinetic < 0 or (static > 0 and kinetic > static):
        raise PatchfemError("friction.kinetic: friction must be >= 0 and kinetic friction at most static friction; "
                            "lower friction.kinetic or raise friction.static")
    slide, w = float(modes.interfaces[0, 0]), float(modes.omega[0])
    if slide == 0 and static > 0:
        raise PatchfemError("structure.mode.slide: no mode moves the interface, so friction cannot act")
    base, share = float(modes.base[0]), abs(slide) / modes.mass
    table, clock = [], 2 * pi / drive.period
    for part, after in pairwise([*drive.segments, None]):
        end = duration if after is None else min(after.start, duration)
        if end <= part.start:
            continue
        if part.amplitude == 0 or part.omega == 0:
            held = part.constant + part.amplitude * np.sin(part.phase)
            table.append((part.start, end, -base * held, 0.0, clock, 0.0))
        else:
            table.append((part.start, end, -base * part.constant, -base * part.amplitude, part.omega,
                          part.phase % (2 * pi)))
    return OneMode(modes, w, float(modes.dampers[0, 0]) / 2, (static * share, kinetic * share if static > 0 else 0.0),
                 np.array(table, float), slide, float(modes.output[0]), drive)


def kernels(compiled: bool, say=None):
    """The event loop as Python, or compiled; `say` is told where it has to be compiled first."""
    if not compiled:
        return sdof_kernels
    from ...compiled import load

    return load("dynamics.one_mode.event_kernels", say)


def simulate(modes: ModalBasis, drive, static: float, kinetic: float, cycles: float, window: int = 10,
             travel: float = inf, progress=None, start: Start | None = None, compiled: bool = False) -> EventRun:
    """Run `cycles` drive periods with friction forces [N] from rest or `start`; keeps the last `window` cycles whole.

    The ledger's `stored` is what has been added since the start.
    """
    block = scene_of(modes, drive, static, kinetic, cycles * drive.period)
    engine = kernels(compiled)
    z, v = (float(start.z[0]), float(start.v[0])) if start is not None else (0.0, 0.0)
    far = travel / abs(block.output) if block.output else inf
    if abs(z) > far:
        raise PatchfemError("structure.start: the motion starts beyond structure.travel; start inside it")
    run = _Run(block, drive.period, cycles, window)
    run.go(engine, z, v, far, progress)
    return run.collect()


def events(modes: ModalBasis, drive, static: float, kinetic: float, cycles: float, start: Start | None = None,
           compiled: bool = False, most: int = 100_000) -> np.ndarray:
    """The first `most` events of a run, (k, 5): time [s], drive phase [rad], z [m], z' [m/s] and what begins there.

    +-1 is a slip, 0 a stick; the first row is the start. Errors as `simulate`.
    """
    block = scene_of(modes, drive, static, kinetic, cycles * drive.period)
    engine = kernels(compiled)
    z, v = (float(start.z[0]), float(start.v[0])) if start is not None else (0.0, 0.0)
    rows, state, book = np.zeros((most, sdof_kernels.ROW)), np.zeros(9), np.zeros(10)
    engine.enter(state, block.segments, 0, 0.0, 0.0, z, v, 1.0, *block.friction, block.w**2)
    code, used = engine.march((block.w, block.decay), block.friction, block.segments, (drive.period, inf, 0.0, 0.0),
                              state, rows, np.empty((0, 2)), book)
    _check(code, rows[max(used - 1, 0), 0])
    rows = rows[:used]
    return np.column_stack([rows[:, :2], rows[:, 4], rows[:, 3] * rows[:, 5], rows[:, 3]])


def _check(code: int, time: float) -> None:
    if code == sdof_kernels.LOST:
        raise NotConverged(f"dynamics: an event could not be located near t = {time:.9g} s")
    if code == sdof_kernels.PILED:
        raise NotConverged(f"dynamics: events pile up at t = {time:.9g} s; lower the drive, "
                           "or use method = \"march\"", "accuracy.method")


class _Run:
    """Events as they come, a chunk at a time: what is summed is summed, the rest is forgotten before the window."""

    def __init__(self, block: OneMode, period: float, cycles: float, window: int):
        self.block, self.period, self.duration, self.window = block, period, cycles * period, window
        number = int(np.ceil(cycles - 1e-9))
        self.extremes = np.tile([inf, -inf], (number, 1))
        self.parts = np.zeros((number, 2))  # phasors of z
        self.book, self.begun, self.end = np.zeros(10), 0.0, self.duration
        self.recent, self.corners, self.outcome, self.kept = np.empty((0, sdof_kernels.ROW)), [], None, 0
        self.events, self.memo, self.keep = np.empty((ROOM, 5)), np.zeros(4), None

    def go(self, engine, z: float, v: float, far: float, progress) -> None:
        """All events from state (z, v)."""
        block, rows, code = self.block, np.zeros((CHUNK, sdof_kernels.ROW)), sdof_kernels.FULL
        self.state, clock = np.zeros(9), (self.period, far, 0.0, 1.0)
        self.begun = 0.5 * block.modes.mass * (v * v + block.w**2 * z * z)
        engine.enter(self.state, block.segments, 0, 0.0, 0.0, z, v, 1.0, *block.friction, block.w**2)
        self.memo[1] = np.sign(v)
        self.keep = getattr(engine, "keep", keep)
        while code == sdof_kernels.FULL:
            code, used = engine.march((block.w, block.decay), block.friction, block.segments, clock, self.state, rows,
                                      self.extremes, self.book)
            _check(code, rows[max(used - 1, 0), 0])
            if used:
                self.take(rows[:used].copy())
                if progress is not None and code == sdof_kernels.FULL:
                    progress(min(self.recent[-1, 0] / self.duration, 1.0))
        if code == sdof_kernels.TRAVEL:
            self.outcome = Outcome.EXCEEDS_TRAVEL
            self.end = self.recent[-1, 0] + self.recent[-1, 2]

    def take(self, rows) -> None:
        """Sum what a chunk of phases adds."""
        block = self.block
        self.keep(rows, (block.w, block.decay), block.segments, (self.period, block.slide, block.friction[0]),
                  self.parts, self.events, self.memo)
        if self.kept < CORNERS:
            self.corners.append(rows)
            self.kept += len(rows)
        self.recent = np.concatenate([self.recent, rows])
        old = np.searchsorted(self.recent[:, 0], self.recent[-1, 0] - (ENDS * self.window + 1) * self.period)
        self.recent = self.recent[max(old - 1, 0):]

    def log(self) -> EventLog:
        """The last events."""
        count = int(self.memo[0])
        rows = self.events[np.arange(max(0, count - ROOM), count) % ROOM]
        time, phase, interface, what, slide = rows.T
        return EventLog(frozen_array(time), frozen_array(phase), frozen_array(interface, np.int64),
                        frozen_array(what, np.int64), frozen_array(slide), count).until(self.end)

    def collect(self) -> EventRun:
        """Everything that is kept."""
        block, mass, end = self.block, self.block.modes.mass, self.end
        first = max(0.0, end - self.window * self.period)
        wide = self.sample(first, end)
        full = self._with_corners(self._with_cycle(wide, first), max(0.0, end - max(2, self.window) * self.period))
        rows = self.recent[(self.recent[:, 0] < end) & (self.recent[:, 0] + self.recent[:, 2] > first)]
        low, high = np.maximum(rows[:, 0], first) - rows[:, 0], np.minimum(rows[:, 0] + rows[:, 2], end) - rows[:, 0]
        part, *ends = stretches(low, high, rows, block)
        owner, tau, weight = panels(*ends)
        owner = part[owner]
        z, v, gain = states(tau, rows, owner, block)
        loop = (rows[owner, 0] + tau, weight, block.slide * z, block.slide * v, force(tau, rows, owner, block))
        stored = 0.5 * mass * (self.state[4]**2 + block.w**2 * self.state[3]**2)
        book = dict(zip(("work_in", "viscous", "power", "friction"), (mass * self.book[:4]).tolist()))
        book |= {"stored": float(stored) - self.begun, "peak_stored": max(0.5 * mass * self.memo[3], float(stored))}
        seen = np.isfinite(self.extremes[:, 0])
        amplitudes = np.sort(block.output * self.extremes[seen], axis=1)
        count = 1 if block.friction[0] == 0 else int(self.book[4])
        stuck = float((high - low)[rows[:, 3] == 0].sum())
        self._ends()
        phasors = block.output * (self.parts[:, 0] + 1j * self.parts[:, 1])
        return EventRun(full, wide, amplitudes, phasors[:len(amplitudes)], book, self.outcome, count, loop, stuck,
                        self._starts(first), peak_acceleration(low, high, rows, block), end / self.period, self.log(),
                        force_peaks=np.array([peak_force(low, high, rows, block)]),
                        waves=self._waves(loop[0], weight, block.output * gain + base_part(tau, rows, owner, block)),
                        means=self._means(first, end))

    def _ends(self) -> None:
        """Phasors of the last cycle of the last windows of a run under one sine, to the bits of a run in a batch."""
        block, last = self.block, len(self.parts) - 1
        if len(block.segments) > 1 or self.outcome is not None or self.period != 2 * pi / block.segments[0, 4]:
            return
        least = max(last % self.window, last - (ENDS - 1) * self.window)
        mode = (block.w, block.decay, *block.friction, *block.segments[0, 3:5].tolist())
        ends = np.zeros_like(self.parts)
        window_kernels.cycle_parts(self.recent, len(self.recent), (last, self.window, least), mode, ends)
        self.parts[least::self.window] = ends[least::self.window]

    def _means(self, first: float, end: float) -> tuple | None:
        """Means of the slide over the first and the last cycle of the window, None where it holds none."""
        if end - first < self.period * (1 - 1e-9):
            return None
        return tuple(self._mean(ahead) for ahead in (end - first, self.period))

    def _mean(self, ahead: float) -> float:
        """Mean of the slide over the cycle that begins `ahead` [s] before the end.

        The phases are placed by their lengths: in their times, 2e-16 of a long run, two means would differ.
        """
        rows, block = self.recent, self.block
        left = np.cumsum(rows[::-1, 2])[::-1]  # from the start of each phase to the end
        low, high = np.maximum(left - ahead, 0.0), np.minimum(left - ahead + self.period, rows[:, 2])
        met = high > low
        rows = rows[met]
        part, *ends = stretches(low[met], high[met], rows, block)
        owner, tau, weight = panels(*ends)
        return block.slide * float(weight @ position(tau, rows, part[owner], block)) / self.period

    def _waves(self, time, weight, acceleration) -> np.ndarray:
        """First and third harmonic (2,) of the absolute acceleration, by the quadrature of the loop."""
        angle = 2 * pi / self.period * time
        return np.array([np.sum(weight * acceleration * np.exp(-1j * n * angle)) for n in (1, 3)]) * (2 / weight.sum())

    def _starts(self, first: float):
        rows = self.recent
        let_go = (rows[1:, 3] != 0) & (rows[:-1, 3] == 0) & (rows[:-1, 2] > 0) & (rows[1:, 0] > first)
        return rows[1:][let_go & (rows[1:, 0] < self.end), 1] % pi

    def sample(self, first: float, end: float) -> Response:
        """Uniform samples on [first, end] and both sides of every event."""
        rows, block = self.recent, self.block
        grid = np.linspace(first, end, max(LEAST, round((end - first) / self.period * SAMPLES) + 1))
        events = rows[(rows[:, 0] > first) & (rows[:, 0] < end), 0] if block.friction[0] > 0 else np.empty(0)
        time = np.sort(np.concatenate([grid, events, np.nextafter(events, -np.inf)]))
        time = time[np.concatenate([[True], np.diff(time) > 0])]
        owner = np.clip(np.searchsorted(rows[:, 0], time, side="right") - 1, 0, len(rows) - 1)
        tau = np.clip(time - rows[owner, 0], 0.0, rows[owner, 2])
        return response(time, *states(tau, rows, owner, block), force(tau, rows, owner, block), block)

    def _with_cycle(self, wide: Response, first: float) -> Response:
        """The cycle before a window of one, so that two are kept whole."""
        if self.window > 1 or first <= 0:
            return wide
        return _chained(self.sample(max(0.0, first - self.period), first), wide)

    def _with_corners(self, wide: Response, first: float) -> Response:
        rows = np.concatenate(self.corners)[:CORNERS]
        rows = rows[rows[:, 0] < first]
        if not len(rows):
            return wide
        tau, owner = np.zeros(len(rows)), np.arange(len(rows))
        early = response(rows[:, 0].copy(), *starts(rows, self.block),
                         force(tau, rows, owner, self.block), self.block)
        return _chained(early, wide)


def _chained(early: Response, late: Response) -> Response:
    """Two parts of a run, the samples of the first that the second begins with left out."""
    names = ("time", "modal", "modal_rate", "slide", "slide_rate", "output", "output_rate", "acceleration",
             "base_acceleration", "force", "slip")
    kept = early.time < late.time[0]
    return Response(*(np.concatenate([getattr(early, k)[kept], getattr(late, k)]) for k in names))
