"""A motion of modes under a smooth law from its start to its result, with what the kernels leave behind."""

from copy import copy
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ...core import ModalBasis, Outcome, Response
from ...friction.laws.stretch import bonds_of
from ..march.march import MarchResult
from ..second_book import sampled_work
from .arrays import Kept, Moving
from .lanes import OF_KEPT, OF_MOVING, advance, loops_of, stacked
from .waves import fits, wave_of

SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # samples of a run that has no cycles
ROOM = 4096  # reversals kept in one call
MOST_KEPT = 400_000  # reversals kept outside the last cycles
CLOSER = 0.01  # of the tolerance, that of the last cycles, which are read between the ends of the steps
TAIL = 8  # windows whose phasors are kept: a steady amplitude takes five (`response.settling.steady_amplitudes`)
FIRST = 1e-3  # length of the first step over the shortest time of the rig
# of Moving.now
TIME, STEP, TURNED, PACE, STOOD, MASS, KIND, PIECE, MOVES, STIFF, STRIDE = 0, 1, 2, 7, *range(9, 16)
# of Kept.tally
ACCELERATION, FORCE, SLIP, SLIP_LEAST, OUTPUT, OUTPUT_LEAST = range(6)
WAVES, POWER, STORED, LOST, DONE, REFUSED, TURNS, SAMPLE, WANTED, PERIOD = 6, *range(10, 19)
HELD, START, STARTS, SIDE, OUTPUTS, MEANS, BEGIN, END = 19, 20, 22, 23, 24, 28, 30, 31
FINISHED, TRAVELLED, FULL, WILD, ENDLESS, PAUSED = range(6)  # how a call ends


@dataclass(frozen=True, eq=False, slots=True)
class Fine:
    """What the integrator knows of the last cycles better than their samples.

    acceleration: largest |absolute acceleration| [m s-2], force: largest |force| [N], slip and swing: half the range
    of the irreversible slip and of the output [m]; slide, pull: first Fourier coefficients of slide [m] and force [N];
    work: of friction [J]; held: time [s] for which the interface sticks; start: mean phase [rad] modulo pi at which
    slip starts after it, None where it never does; first, third: Fourier coefficients of the acceleration of the output
    relative to the base [m s-2] at the drive's frequency and three times it; drift: time mean of the slide in the last
    cycle less that in the first, per cycle between them [m], None of fewer than 1.5 cycles.
    """

    acceleration: float
    force: float
    slip: float
    swing: float
    slide: complex
    pull: complex
    work: float
    held: float
    start: float | None
    first: complex
    third: complex
    drift: float | None


@dataclass(frozen=True, eq=False, slots=True)
class SmoothResult(MarchResult):
    """A MarchResult, what the integrator knows besides, and the last cycles with the samples at reversals among the
    others (`turned`)."""

    fine: Fine | None = None
    turned: Response | None = None


def started(modes: ModalBasis, drive, wave, element, cycles: float, start=None) -> tuple:
    """(Moving, Kept) of a motion before it begins, without room for reversals; wave: that of the drive."""
    n, l = modes.omega.size, len(element.sizes)
    size, damping = 2 * n + l + 3, np.zeros((0, 0)) if modes.damping is None else modes.damping
    state = np.zeros(size)
    if start is not None:
        state[:n], state[n:2 * n] = start.z, start.v
    pace = max(float(np.max(modes.omega * np.maximum(1.0, 2 * modes.zeta), initial=0.0)), 2 * np.pi / drive.period)
    now, tally, work = np.zeros(16), np.zeros(32), np.zeros((26, size))
    now[[STEP, TURNED, STRIDE, PACE, MASS]] = FIRST / pace, FIRST / pace, FIRST / pace, pace, modes.mass
    now[STIFF] = element.limit / element.length if element.length else 0.0
    now[[KIND, MOVES]], tally[PERIOD] = (wave.kind, drive.moving), drive.period
    work[24, 2 * n:-3] = element.sizes
    rows = np.stack([modes.omega, 2 * modes.zeta * modes.omega, modes.slide, modes.base, modes.output])
    law = element.numbers[None], element.memory[None], [1.0, np.inf, 1.0]
    own = (rows, damping, wave.pieces, *law, state, work, now)
    moving = Moving(*(np.array(part, float, order="C") for part in own))
    cycles = np.zeros((4, max(1, ceil(cycles - 1e-9))))
    cycles[0], cycles[1], width = np.inf, -np.inf, 2 * n + 7
    return moving, Kept(cycles, np.zeros((0, width)), np.zeros((0, width)), tally, np.zeros((2, size)),
                        np.zeros((10, 6)))


def fine_of(tally, begin, end) -> dict:
    """The fields of Fine of n motions as columns (n,), NaN where there is none.

    tally (n, 32): of Kept; begin, end (n, 4): time [s], output [m], its rate [m/s] and friction work [J] where the last
    cycles begin and end. Accelerations are those of the motion by parts, so its jumps cost nothing.
    """
    span, omega = np.maximum(end[:, 0] - begin[:, 0], 1e-300), 2 * np.pi / tally[:, PERIOD]
    slide, pull, *outputs = ((tally[:, k] + 1j * tally[:, k + 1]) * 2 / span for k in (
        WAVES, WAVES + 2, OUTPUTS, OUTPUTS + 2))
    gains = []
    for n, output in zip((1j, 3j), outputs):
        after, before = ((one[:, 2] + n * omega * one[:, 1]) * np.exp(-n * omega * one[:, 0]) for one in (end, begin))
        gains.append(2 / span * (after - before) + (n * omega)**2 * output)
    cycles, (before, after) = span / tally[:, PERIOD], tally[:, MEANS:MEANS + 2].T / tally[:, PERIOD]
    drift = np.where(cycles < 1.5, np.nan, (after - before) / np.where(cycles < 1.5, 1.0, cycles - 1))
    start = np.arctan2(tally[:, START + 1], tally[:, START]) / 2 % np.pi
    return {"acceleration": tally[:, ACCELERATION], "force": tally[:, FORCE],
            "slip": (tally[:, SLIP] + tally[:, SLIP_LEAST]) / 2,
            "swing": (tally[:, OUTPUT] + tally[:, OUTPUT_LEAST]) / 2, "slide": slide, "pull": pull,
            "work": end[:, 3] - begin[:, 3], "held": tally[:, HELD],
            "start": np.where(tally[:, STARTS] > 0, start, np.nan), "first": gains[0], "third": gains[1],
            "drift": drift}


def response_of(modes, drive, rows, stored: float) -> Response:
    """Histories of sample rows (k, 2 n + 7) of a motion; stored: its largest stored energy [J]."""
    n = modes.omega.size
    time, z, rate = rows[:, 0], rows[:, 1:1 + n], rows[:, 1 + n:1 + 2 * n]
    slide, speed, force, slip, held, work = rows[:, 1 + 2 * n:].T
    push = drive.values(time)
    base = push if drive.moving else np.zeros_like(push)
    damped = rate * (2 * modes.zeta * modes.omega) if modes.damping is None else rate @ modes.damping.T
    accel = -np.outer(push, modes.base) - damped - z * modes.omega**2 - np.outer(force, modes.slide) / modes.mass
    lost = np.diff(work - held, prepend=0.0)
    noise = 1e-8 * max(stored, float(np.abs(work).max(initial=0.0)))
    ledger = np.stack([work, held, np.cumsum(np.maximum(lost, 0.0)),
                       np.cumsum(np.where(lost < -noise, -lost, 0.0))])
    return Response(time, z, rate, slide, speed, z @ modes.output, rate @ modes.output,
                    accel @ modes.output + base, base, force, slip, {"ledger": ledger})


def asked(count: int, window: int) -> np.ndarray:
    """Whether the phasor of each of `count` cycles is asked for: of the last one and of the TAIL windows before."""
    back = np.arange(count)[::-1]
    return (back % window == 0) & (back < TAIL * window)


class Run:
    """A motion as it stands: the arrays that its loops move, and what was read off it."""

    def __init__(self, modes: ModalBasis, drive, element, cycles: float, tolerance: float, travel: float = np.inf,
                 start=None):
        self.modes, self.drive, self.element, self.tolerance, self.travel = modes, drive, element, tolerance, travel
        self.cycles, self.loops, self.wave = cycles, loops_of(element.kernels), wave_of(drive)
        self.moving, self.kept = started(modes, drive, self.wave, element, cycles, start)
        self.kept = self.kept._replace(turns=np.zeros((ROOM, self.kept.turns.shape[1])))
        self.turns, self.begun, self.outcome, self.message, self.progress = [], 0.0, None, "", None
        self.swift = fits(modes, element, self.wave, travel)
        self.until(0.0)
        self.first, self.begun = self.settled()[0], float(self.kept.tally[STORED])

    def fork(self, drive):
        """A copy of the motion as it stands that goes on by itself, under another drive."""
        twin = copy(self)
        twin.progress = None
        twin.moving = type(self.moving)(*(array.copy() for array in self.moving))
        twin.kept, twin.turns = type(self.kept)(*(array.copy() for array in self.kept)), list(self.turns)
        if drive is not self.drive:
            twin.drive, twin.wave = drive, wave_of(drive)
            twin.swift = fits(twin.modes, twin.element, twin.wave, twin.travel)
            twin.moving = twin.moving._replace(pieces=twin.wave.pieces)
            twin._enter(int(np.searchsorted(twin.wave.ends, twin.time, side="right")))
        return twin

    def ends_only(self, window: int) -> None:
        """Ask for the phasors of the last cycle and of the TAIL windows of `window` cycles before alone, at the start
        of a run."""
        self.kept.cycles[2:, ~asked(self.kept.cycles.shape[1], window)] = np.nan

    def extremes(self, count: int) -> np.ndarray:
        """Smallest and largest output (c, 2) [m] of the first `count` cycles."""
        return self.kept.cycles[:2, :count].T.copy()

    @property
    def time(self) -> float:
        """Time [s] that is reached."""
        return float(self.moving.now[TIME])

    def _enter(self, piece: int) -> None:
        self.moving.now[PIECE] = piece

    def until(self, time: float, times=(), peaks: bool = False) -> np.ndarray:
        """Move on to a time [s]; rows (s, 2 n + 7) of the samples at `times` (s,) on the way, fewer where it ends
        before.

        peaks: peaks and harmonics are gathered.
        """
        times = np.asarray(times, float)
        samples = np.zeros((times.size, self.kept.turns.shape[1]))
        samples[:, 0], self.kept = times, self.kept._replace(samples=samples)
        self.kept.tally[SAMPLE], self.kept.tally[WANTED] = 0, peaks
        swift = self.swift and self.time < time
        while self.outcome is None:
            end = float(self.wave.ends[int(self.moving.now[PIECE])])
            if self.time >= end:
                self._enter(int(self.moving.now[PIECE]) + 1)
                continue
            status = self._beside(float(time)) if swift else \
                self.loops.advance(self.moving, self.kept, float(time), end, self.tolerance, float(self.travel))
            self._judge(status)
            if self.progress is not None:  # here alone, for a step cut for its sake would change the motion
                self.progress(min(self.time / (self.cycles * self.drive.period), 1.0))
            if status == FINISHED and self.time >= time:
                break
        return self.kept.samples[:int(self.kept.tally[SAMPLE])]

    def _beside(self, time: float) -> int:
        """Move on to a time [s] in one of the lanes of `lanes`."""
        many, kept = stacked(self.moving, OF_MOVING), stacked(self.kept, OF_KEPT)
        return int(advance(self.element.kernels, many, kept, np.array([time]), np.array([self.tolerance]))[0])

    def _judge(self, status: int) -> None:
        count = int(self.kept.tally[TURNS])
        if len(self.turns) * ROOM < MOST_KEPT:
            self.turns.append(self.kept.turns[:count].copy())
        self.kept.tally[TURNS] = 0
        if status == TRAVELLED:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        elif status in (WILD, ENDLESS):
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (f"no step meets the tolerance at {self.time:.6g} s; use accuracy.method = \"march\"")

    def book(self) -> dict:
        """The energy ledger [J] as the motion stands, and the steps taken."""
        _, own, _, stored = self.settled()
        energies = self.moving.y[-3:]
        return {"work_in": float(energies[0]) + self.begun, "viscous": float(energies[1]),
                "power": float(own[POWER]) + self.begun, "friction": float(own[LOST]),
                "peak_stored": float(own[STORED]), "stored": stored, "iterations": float(own[DONE] + own[REFUSED]),
                "worst_iterations": 1.0, "steps": float(own[DONE])}

    def settled(self) -> tuple:
        """As the motion stands: sample (2 n + 7,), Kept.tally, memory of the law, energy of modes and interface [J]."""
        kept = self.kept._replace(tally=self.kept.tally.copy())
        twin = self.moving._replace(mem=self.moving.mem.copy(), now=self.moving.now.copy())
        row = np.zeros(kept.turns.shape[1])
        stored = float(self.loops.settled(twin, kept, row))
        return row, kept.tally, twin.mem[0], stored

    def response(self, rows) -> Response:
        """Histories of sample rows (k, 2 n + 7)."""
        return response_of(self.modes, self.drive, rows, float(self.kept.tally[STORED]))

    def ends(self) -> np.ndarray:
        """Where the motion stands: time [s], output [m], its rate [m/s], friction work [J]."""
        n, y, output = self.modes.omega.size, self.moving.y, self.modes.output
        return np.array([self.time, y[:n] @ output, y[n:2 * n] @ output, y[-1]])

    def fine(self, begin) -> Fine:
        """The last cycles since `begin`, as `ends` gave it."""
        found = {name: column[0].item() for name, column in fine_of(
            self.kept.tally[None], begin[None], self.ends()[None]).items()}
        return Fine(**found | {name: None for name in ("start", "drift") if np.isnan(found[name])})

    def last(self, end: float, window: float, shots=(), seen: list | None = None) -> tuple:
        """Move on to the time `end` [s] and keep the last `window` [s]: (rows, Fine).

        shots: times [s] of snapshots of the interface, which are added to `seen`.
        """
        begin = max(end - window, self.time)
        self.until(begin)
        tally, since = self.kept.tally, self.ends()
        tally[:WAVES], tally[WAVES:POWER], tally[HELD:], tolerance = -np.inf, 0.0, 0.0, self.tolerance
        tally[BEGIN], tally[END] = begin, end
        if not self.swift:  # the extension of a step errs more than the step does
            self.tolerance *= CLOSER
            self.moving.now[STEP] *= CLOSER**0.125
        count = max(LEAST, round((end - begin) / self.drive.period * SAMPLES) + 1)
        times, rows, after = np.linspace(begin, end, count), [], -np.inf
        for shot in [*[t for t in shots if begin <= t < end], end]:
            rows.append(self.until(shot, times[(times > after) & (times <= shot)], True))
            after = shot
            if seen is not None and shot in shots:
                seen.append(self._snapshot())
            if self.outcome is not None:
                break
        tally[WANTED], self.tolerance = 0, tolerance
        return np.concatenate(rows), self.fine(since)

    def _snapshot(self) -> dict:
        row, _, memory, _ = self.settled()
        slide, rate, force, slip = row[-6:-2]
        out = {"time": self.time, "slide": slide, "rate": rate, "force": force, "slip": slip}
        points = self.element.form == "points"
        return out | ({"bonds": bonds_of(self.element, memory).copy()} if points else {})


def simulate(modes: ModalBasis, drive, element, cycles: float, tolerance: float, window: int = 10,
             travel: float = np.inf, frames: int = 0, start=None, progress=None) -> SmoothResult:
    """Run `cycles` drive cycles from rest or from `start` (core.Start) with steps that meet a relative tolerance.

    element: a law with its rate form (`friction.protocol.Element`) on the one interface of the modes; window: whole
    cycles kept at the end; travel [m]: of the output, where the run ends; frames: snapshots of the interface in the
    last cycle; progress(share): called where the run comes back for other reasons, so it changes nothing. The outcome
    is set for travel and where no step meets the tolerance (not_converged, `message` says where).
    """
    run, period = Run(modes, drive, element, cycles, tolerance, travel, start), drive.period
    run.ends_only(window)
    end, kept, shots = cycles * period, [], []
    run.progress = progress
    whole = min(2.0, cycles) * period
    if window * period < whole:
        run.until(end - whole)
        count = max(2, round((whole - window * period) / period * SAMPLES) + 1)
        kept = [run.until(end - window * period, np.linspace(end - whole, end - window * period, count))[:-1]]
    at = end - np.linspace(min(1.0, cycles), 0.0, frames + 1)[1:] * period if frames else []
    rows, fine = run.last(end, window * period, [float(min(t, end)) for t in at], shots)
    if run.outcome is not None and run.time > 0:  # its last cycles were not known before: once more to where it ended
        done = simulate(modes, drive, element, run.time / period, tolerance, window, np.inf, frames, start)
        return replace(done, outcome=run.outcome, message=run.message)
    last, turned = run.response(rows), run.response(_merged(rows, run, rows[0, 0]))
    rows = np.concatenate([*_early(run, kept[0][0, 0] if kept else rows[0, 0]), *kept, rows])
    done = max(1, ceil(run.time / period - 1e-9))
    phasors = np.array([1, 1j]) @ run.kept.cycles[2:, :done]
    book = run.book() | _second(turned)
    return SmoothResult(run.response(rows), last, np.zeros(0), run.extremes(done), phasors, book, run.outcome,
                        shots, fine.work, run.time / period, run.message, (), fine, turned)


def _second(turned) -> dict:
    """The second book of energy: friction work [J] off samples, that of the ledger between them, and its sizes."""
    parts = np.diff(turned.extra["ledger"][0])
    return {"sampled": float(sampled_work(turned.slide, turned.force).sum()), "booked": float(parts.sum()),
            "passed": float(np.abs(parts).sum())}


def _merged(rows, run, begin: float) -> np.ndarray:
    """Sample rows and those at the reversals since a time [s], in order."""
    turns = np.concatenate(run.turns) if run.turns else rows[:0]
    every = np.concatenate([rows, turns[(turns[:, 0] > begin) & (turns[:, 0] < rows[-1, 0])]])
    every = every[np.argsort(every[:, 0], kind="stable")]
    return every[np.append(True, np.diff(every[:, 0]) > 1e-9 * run.drive.period)]


def _early(run, begin: float) -> list:
    """Sample rows at the start and at the reversals before a time [s]."""
    if run.first[0] >= begin:
        return []
    turns = np.concatenate(run.turns) if run.turns else np.zeros((0, run.first.size))
    return [run.first[None], turns[(turns[:, 0] > run.first[0]) & (turns[:, 0] < begin)]]
