"""A motion of modes under a smooth law from its start to its result, with what the kernels leave behind."""

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from math import ceil

import numpy as np

from ... import compiled
from ...core import IntegratedMeasures, ModalBasis, Outcome, Response
from ...friction.laws.stretch import unpack_bonds
from ...friction.path_work import sampled_work
from ...structure.drive_sizes import stored_samples_per_cycle
from ..events.modal_system import segments_of
from ..integrated import histories
from ..march.march import MarchResult
from ..periodicity import APART, ahead
from .arrays import (
    CREST,
    CREST_SPEED,
    DONE,
    DRIVEN,
    LEFT,
    LOST,
    MASS,
    MOVES,
    NODES,
    PACE,
    PARTS,
    PERIOD,
    PIECE,
    POWER,
    REFUSED,
    SAMPLE,
    STEP,
    STIFF,
    STORED,
    TIME,
    TURNED,
    TURNS,
    Kept,
    Moving,
)
from .reader import integrated

SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # samples of a run that has no cycles
ROOM = 4096  # reversals kept in one call
STEPS = 1024  # steps of the last cycles kept in one call
MOST_KEPT = 400_000  # reversals kept outside the last cycles
# of the tolerance, that of the last cycles, which are read between the ends of the steps
CLOSER = 0.01
TAIL = 8  # windows whose phasors are kept: a steady amplitude takes five (`response.settling.extrapolate_steady_amplitudes`)
FIRST = 1e-3  # length of the first step over the shortest time of the rig
REPEATS = 10.0  # tolerances of a step by which a motion that repeats may still change in all that is left of it
ALIKE = 10.0  # times as much, by which cycles differ whose steps stand elsewhere
FINISHED, TRAVELLED, FULL, WILD, ENDLESS, PAUSED, LIFTED = range(7)  # how a call ends
HERE = "dynamics.smooth"
# names of the numbers of a piece of the drive
of = compiled.kernels("dynamics.events.drive_kernels")


@cache
def loops_of(law: str, say=None):
    """The compiled loop for the law of a module of kernels; say: told before it is compiled."""
    law = compiled.load(law, say)
    steps = compiled.instance(f"{HERE}.step_kernels", {"law": law})
    watching = compiled.instance(f"{HERE}.watch_kernels", {"law": law, "steps": steps})
    return compiled.instance(
        f"{HERE}.loop_kernels", {"law": law, "steps": steps, "watching": watching}
    )


@dataclass(frozen=True, eq=False, slots=True)
class SmoothResult(MarchResult):
    """A MarchResult, what the integrator knows besides, the last cycles with the samples at reversals among the others
    (`turned`), and what the motion still changes by, over its size, where its last cycles stand for others
    (`unlike`); unsure: errors of peaks by measure; tolerance: of its steps."""

    fine: IntegratedMeasures | None = None
    unsure: dict = field(default_factory=dict)
    turned: Response | None = None
    unlike: float = 0.0
    tolerance: float = 0.0


def started(modes: ModalBasis, drive, element, cycles: float, start=None) -> tuple:
    """(Moving, Kept) of a motion before it begins: the arrays of the kernels, named in `arrays`.

    element: the law with its numbers and the sizes of its memory; start: core.InitialState, at rest without.
    The first step is FIRST over the fastest rate of modes and drive.
    """
    n = modes.omega.size
    l = len(element.state_scales)
    size = 2 * n + l + 3
    damping = np.zeros((0, 0)) if modes.damping is None else modes.damping
    state = np.zeros(size)
    if start is not None:
        state[:n] = start.z
        state[n : 2 * n] = start.v
    pace = max(
        float(np.max(modes.omega * np.maximum(1.0, 2 * modes.zeta), initial=0.0)),
        2 * np.pi / drive.period,
    )
    now = np.zeros(15)
    counters = np.zeros(10)
    work = np.zeros((26, size))
    now[[STEP, TURNED, PACE, MASS]] = FIRST / pace, FIRST / pace, pace, modes.mass
    now[STIFF] = element.limit / element.length if element.length else 0.0
    now[[DRIVEN, MOVES]] = (drive.period, drive.moving)
    counters[PERIOD] = drive.period
    work[24, 2 * n : -3] = element.state_scales
    rows = np.stack(
        [modes.omega, 2 * modes.zeta * modes.omega, modes.slide, modes.base, modes.output]
    )
    law = element.numbers[None], [element.memory] * 2, [1.0, np.inf, 1.0, *np.zeros(7)]
    own = (rows, damping, segments_of(drive), *law, state, work, now)
    moving = Moving(*(np.array(part, float, order="C") for part in own))
    cycles = np.zeros((4, max(1, ceil(cycles - 1e-9))))
    cycles[0] = np.inf
    cycles[1] = -np.inf
    width = 2 * n + 7
    return moving, Kept(
        cycles,
        np.zeros((0, width)),
        np.zeros((ROOM, width)),
        np.zeros((0, NODES, width)),
        counters,
        np.zeros(size),
    )


def response_of(modes, drive, rows, stored: float) -> Response:
    """Histories of sample rows (k, 2 n + 7) of a motion; stored: its largest stored energy [J]."""
    n = modes.omega.size
    time = rows[:, 0]
    z = rows[:, 1 : 1 + n]
    rate = rows[:, 1 + n : 1 + 2 * n]
    held, work = rows[:, 5 + 2 * n :].T
    lost = np.diff(work - held, prepend=0.0)
    noise = 1e-8 * max(stored, float(np.abs(work).max(initial=0.0)))
    ledger = np.stack(
        [
            work,
            held,
            np.cumsum(np.maximum(lost, 0.0)),
            np.cumsum(np.where(lost < -noise, -lost, 0.0)),
        ]
    )
    return histories(
        modes, drive, time, (z, rate), rows[:, 1 + 2 * n : 5 + 2 * n].T, {"ledger": ledger}
    )


def asked(count: int, window: int) -> np.ndarray:
    """Whether the phasor of each of `count` cycles is asked for: of the last one and of the TAIL windows before."""
    back = np.arange(count)[::-1]
    return (back % window == 0) & (back < TAIL * window)


class Motion:
    """A motion as it stands: the arrays that its loops move, and what was read off it.

    unlike: what it still changed by, over its size, where cycles were left out as it repeats.
    """

    def __init__(
        self,
        modes: ModalBasis,
        drive,
        element,
        cycles: float,
        tolerance: float,
        travel: float = np.inf,
        start=None,
    ):
        self.modes = modes
        self.drive = drive
        self.element = element
        self.tolerance = tolerance
        self.travel = travel
        self.cycles = cycles
        self.loops = loops_of(element.kernels)
        self.moving, self.kept = started(modes, drive, element, cycles, start)
        self.turns = []
        self.parts = []
        self.begun = 0.0
        self.unlike = 0.0
        self.outcome = None
        self.message = ""
        self.progress = None
        self.until(0.0)
        self.first = self.settled()[0]
        self.begun = float(self.kept.counters[STORED])

    def fork(self, drive):
        """A copy of the motion as it stands that goes on by itself, under another drive."""
        twin = copy(self)
        twin.progress = None
        twin.moving = type(self.moving)(*(array.copy() for array in self.moving))
        twin.kept = type(self.kept)(*(array.copy() for array in self.kept))
        twin.turns = list(self.turns)
        if drive is not self.drive:
            twin.moving = twin.moving._replace(pieces=segments_of(drive))
            twin.drive = drive
            twin._enter(int(np.searchsorted(twin._starts(), twin.time, side="right")) - 1)
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

    def _starts(self) -> np.ndarray:
        """Times (p,) [s] at which the pieces of the drive begin."""
        return self.moving.pieces[:, [of.CYCLE, of.OFFSET]] @ [self.drive.period, 1.0]

    def _enter(self, piece: int) -> None:
        self.moving.now[PIECE] = piece

    def until(self, time: float, times=(), whole: bool = False) -> np.ndarray:
        """Move on to a time [s]; rows (s, 2 n + 7) of the samples at `times` (s,) on the way, fewer where it ends
        before.

        whole: all steps are kept in `parts`.
        """
        times = np.asarray(times, float)
        width = self.kept.turns.shape[1]
        samples = np.zeros((times.size, width))
        parts = np.zeros((STEPS if whole else 0, NODES, width))
        samples[:, 0] = times
        self.kept = self.kept._replace(samples=samples, parts=parts)
        self.kept.counters[SAMPLE] = 0
        ends = np.append(self._starts()[1:], np.inf)
        while self.outcome is None:
            end = float(ends[int(self.moving.now[PIECE])])
            if self.time >= end:
                self._enter(int(self.moving.now[PIECE]) + 1)
                continue
            status = self.loops.advance(
                self.moving, self.kept, float(time), end, self.tolerance, float(self.travel)
            )
            self._judge(status)
            # here alone, for a step cut for its sake would change the motion
            if self.progress is not None:
                self.progress(min(self.time / (self.cycles * self.drive.period), 1.0))
            if status == FINISHED and self.time >= time:
                break
        return self.kept.samples[: int(self.kept.counters[SAMPLE])]

    def onward(self, time: float) -> None:
        """Move on to a time [s], where the motion repeats under a sine without an end by many cycles at once.

        `repeats` says when it is looked at, and what it will change by yet. Its books go on as in the last quarter of
        these cycles, so that change itself has to be as small. The last cycle has to be as the one before it.
        """
        period = self.drive.period
        far = 2 * APART
        before = None
        first = ceil(max(self.time, self._starts()[-1]) / period - 1e-9)
        if not self._swings() or (first + far) * period >= time:
            self.until(time)
            return
        self.until((first + APART) * period)
        last = self.moving.y.copy()
        while self.outcome is None and (first + far) * period < time:
            self.kept.cycles[2:, first + far - 1] = 0.0  # its phasor is asked for
            self.until((first + far - far // 4) * period)
            books = self._sums()
            self.until((first + far) * period)
            change = self._changed(last)
            left = int(time / period + 1e-9) - first - far
            if before is not None and self.outcome is None and left > 0:
                unlike = ahead(change, before, left, far)
                if unlike <= REPEATS * self.tolerance and self._alike(first + far):
                    self._leave_out(left, (self._sums() - books) / (far // 4))
                    self.unlike = unlike
                    break
            last = self.moving.y.copy()
            before = change
            far = 2 * far
        self.until(time)

    def _swings(self) -> bool:
        """Whether the drive ends in a sine of its own period."""
        last = self.moving.pieces[-1]
        own = abs(last[of.OMEGA] * self.drive.period / (2 * np.pi) - 1) < 1e-12
        return last[of.KIND] == of.SINE and last[of.AMPLITUDE] != 0 and own

    def _changed(self, last) -> float:
        """Largest change [1] since the state `last` (N,): of coordinates and rates over the largest of late, of states
        of the law over their sizes; the tolerance at least, as more is round-off."""
        now = self.moving.now
        n = self.modes.omega.size
        sizes = self.moving.work[24]
        scale = np.concatenate([np.repeat(now[[CREST, CREST_SPEED]], n), sizes[2 * n : -3]])
        return max(
            float(np.max(np.abs(self.moving.y - last)[:-3] / np.maximum(scale, 1e-300))),
            self.tolerance,
        )

    def _alike(self, count: int) -> bool:
        """Whether the last two of `count` cycles have the same extremes, but for what the steps in them may miss."""
        before, last = self.kept.cycles[:2, count - 2 : count].T
        return np.abs(last - before).max() <= ALIKE * REPEATS * self.tolerance * np.ptp(last)

    def _sums(self) -> np.ndarray:
        """Work of the drive less what is stored, viscous loss, friction work, |work| of the drive and energy lost to
        friction [J]."""
        return np.append(
            self.moving.y[-3:] - [self.settled()[3], 0.0, 0.0], self.kept.counters[[POWER, LOST]]
        )

    def _leave_out(self, count: int, sums) -> None:
        """Go on by `count` cycles that are as the last one; sums (5,): what `_sums` grows by in one."""
        period = self.drive.period
        at = round(self.time / period)
        turns = np.concatenate([self.kept.turns[:0], *self.turns[-2:]])
        self.moving.y[-3:] += count * sums[:3]
        self.moving.now[LEFT] += count * sums[2]
        self.kept.counters[[POWER, LOST]] += count * sums[3:]
        self.kept.cycles[:, at : at + count] = self.kept.cycles[:, at - 1 : at]
        turns = turns[turns[:, 0] > self.time - period * (1 - 1e-9)]
        shown = min(count, max(0, MOST_KEPT - sum(map(len, self.turns))) // max(1, len(turns)))
        later = np.zeros((shown, 1, turns.shape[1]))
        later[:, 0, 0] = period * np.arange(1, shown + 1)
        later[:, 0, -1] = sums[2] * np.arange(1, shown + 1)
        self.turns.append((turns + later).reshape(-1, turns.shape[1]))
        self.moving.now[TIME] = (at + count) * period

    def _judge(self, status: int) -> None:
        count = int(self.kept.counters[TURNS])
        if count and sum(map(len, self.turns)) < MOST_KEPT:
            self.turns.append(self.kept.turns[:count].copy())
        if self.kept.counters[PARTS]:
            self.parts.append(self.kept.parts[: int(self.kept.counters[PARTS])].copy())
        self.kept.counters[[TURNS, PARTS]] = 0
        if status == TRAVELLED:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        elif status == LIFTED:
            self.outcome = Outcome.LEAVES_GROOVES
        elif status in (WILD, ENDLESS):
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at {self.time:.6g} s no time step, however small, meets the tolerance; use "
                'accuracy.method = "march"'
            )

    def book(self) -> dict:
        """The energy ledger [J] as the motion stands, and the steps taken."""
        _, own, _, stored = self.settled()
        energies = self.moving.y[-3:]
        return {
            "work_in": float(energies[0]) + self.begun,
            "viscous": float(energies[1]),
            "power": float(own[POWER]) + self.begun,
            "friction": float(own[LOST]),
            "peak_stored": float(own[STORED]),
            "stored": stored,
            "iterations": float(own[DONE] + own[REFUSED]),
            "worst_iterations": 1.0,
            "steps": float(own[DONE]),
        }

    def settled(self) -> tuple:
        """As the motion stands: sample (2 n + 7,), Kept.counters, memory of the law, energy of modes and interface [J]."""
        kept = self.kept._replace(counters=self.kept.counters.copy())
        twin = self.moving._replace(mem=self.moving.mem.copy(), now=self.moving.now.copy())
        row = np.zeros(kept.turns.shape[1])
        stored = float(self.loops.settled(twin, kept, row))
        return row, kept.counters, twin.mem[0], stored

    def response(self, rows) -> Response:
        """Histories of sample rows (k, 2 n + 7). No force passes the limit of its law; the extension of a step may."""
        if self.element.is_bounded:
            rows = rows.copy()
            force = 2 * self.modes.omega.size + 3
            np.clip(rows[:, force], -self.element.limit, self.element.limit, out=rows[:, force])
        return response_of(self.modes, self.drive, rows, float(self.kept.counters[STORED]))

    def ends(self) -> np.ndarray:
        """Where the motion stands: time [s], output [m], its rate [m/s], friction work [J]."""
        n = self.modes.omega.size
        y = self.moving.y
        output = self.modes.output
        return np.array([self.time, y[:n] @ output, y[n : 2 * n] @ output, y[-1]])

    def last(self, end: float, window: float, shots=(), seen: list | None = None) -> tuple:
        """Move on to the time `end` [s] and keep the last `window` [s]: (rows, what `reader.integrated` gives).

        shots: times [s] of snapshots of the interface, which are added to `seen`.
        """
        begin = max(end - window, self.time)
        self.onward(begin)
        since = self.ends()
        tolerance = self.tolerance
        self.parts = []
        self.tolerance *= CLOSER  # the extension of a step errs more than the step does
        self.moving.now[STEP] *= CLOSER**0.125
        count = max(LEAST, round((end - begin) / self.drive.period * SAMPLES) + 1)
        times = np.linspace(begin, end, count)
        rows = []
        after = -np.inf
        for shot in [*[t for t in shots if begin <= t < end], end]:
            rows.append(self.until(shot, times[(times > after) & (times <= shot)], True))
            after = shot
            if seen is not None and shot in shots:
                seen.append(self._snapshot())
            if self.outcome is not None:
                break
        self.tolerance = tolerance
        rows = np.concatenate(rows)
        if not self.parts:
            return rows, (None, {})
        places = np.concatenate(self.parts)
        return rows, integrated(
            self.response(places.reshape(-1, places.shape[2])),
            self.drive,
            np.array([since, self.ends()]),
        )

    def _snapshot(self) -> dict:
        row, _, memory, _ = self.settled()
        slide, rate, force, slip = row[-6:-2]
        out = {"time": self.time, "slide": slide, "rate": rate, "force": force, "slip": slip}
        points = self.element.form == "points"
        return out | ({"bonds": unpack_bonds(self.element, memory).copy()} if points else {})


def simulate(
    modes: ModalBasis,
    drive,
    element,
    cycles: float,
    tolerance: float,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    start=None,
    progress=None,
    *,
    even: bool = False,
) -> SmoothResult:
    """Run `cycles` drive cycles from rest or from `start` (core.InitialState) with steps that meet a relative tolerance.

    element: a law with its rate form (`friction.protocol.Element`) on the one interface of the modes; window: whole
    cycles kept at the end; travel [m]: of the output, where the run ends; frames: snapshots of the interface in the
    last cycle; progress(share): called where the run comes back for other reasons, so it changes nothing; even: as
    `wanted` of `stored_samples_per_cycle`. The outcome is set for travel and where no step meets the
    tolerance (not_converged, `message` says where).
    """
    run = Motion(modes, drive, element, cycles, tolerance, travel, start)
    period = drive.period
    run.ends_only(window)
    end = cycles * period
    kept = []
    shots = []
    run.progress = progress
    whole = min(2.0, cycles) * period
    even = stored_samples_per_cycle(drive, cycles, wanted=even)
    if even:
        begin = end - max(whole, window * period)
        kept.append(run.until(begin, np.arange(0, begin, period / even)))
    if window * period < whole:
        run.onward(end - whole)
        count = max(2, round((whole - window * period) / period * SAMPLES) + 1)
        kept.append(
            run.until(
                end - window * period, np.linspace(end - whole, end - window * period, count)
            )[:-1]
        )
    at = end - np.linspace(min(1.0, cycles), 0.0, frames + 1)[1:] * period if frames else []
    rows, (fine, unsure) = run.last(end, window * period, [float(min(t, end)) for t in at], shots)
    # its last cycles were not known before: once more to where it ended
    if run.outcome is not None and run.time > 0:
        done = simulate(
            modes,
            drive,
            element,
            run.time / period,
            tolerance,
            window,
            np.inf,
            frames,
            start,
            even=bool(even),
        )
        return replace(done, outcome=run.outcome, message=run.message)
    last = run.response(rows)
    turned = run.response(_merged(rows, run, rows[0, 0]))
    rows = np.concatenate(
        [*_early(run, kept[0][0, 0] if kept and not even else rows[0, 0]), *kept, rows]
    )
    if even:
        rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
    done = max(1, ceil(run.time / period - 1e-9))
    phasors = np.array([1, 1j]) @ run.kept.cycles[2:, :done]
    book = run.book() | _work_check(turned)
    return SmoothResult(
        run.response(rows),
        last,
        np.zeros(0),
        run.extremes(done),
        phasors,
        book,
        run.outcome,
        shots,
        fine.loops[0].work,
        run.time / period,
        run.message,
        (),
        fine,
        unsure,
        turned,
        run.unlike,
        tolerance,
    )


def _work_check(turned) -> dict:
    """Friction work [J] off samples, that of the ledger between them, and the sum of its sizes."""
    parts = np.diff(turned.extra["ledger"][0])
    return {
        "sampled": float(sampled_work(turned.slide, turned.force).sum()),
        "booked": float(parts.sum()),
        "passed": float(np.abs(parts).sum()),
    }


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
