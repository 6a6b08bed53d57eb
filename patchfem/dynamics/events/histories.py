"""Samples, extremes, energies and events of a run of rigid and piecewise-linear elements."""

from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from ...compiled import kernels, load, when_compiling
from ...core import (
    InitialState,
    ModalBasis,
    NotConverged,
    Outcome,
    PatchfemError,
    Response,
    frozen_array,
)
from ...cost_model import PYTHON_READ_FRACTION
from ...structure.drive_sizes import stored_samples_per_cycle
from .cost import python_seconds, sample_seconds
from .elements import coulomb, stretches, table_of, virgin
from .event_list import BORDER, RELEASE, REVERSAL, ROOM, STOP, EventLog
from .modal_system import books_of, cleared, clock_of, into, past_of, place, plant_of, room_of
from .names_kernels import OF_FACE, OF_RUN
from .reading import Reading, ring_of

HERE = "dynamics.events"
SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # of a run that has no cycles
CHUNK = 4096  # rows held at once
CORNERS = 400_000  # turning points kept from before the window
SHOWN = 1000  # cycles among those that repeat whose turning points are kept
NOISE = 64 * 2.0**-52  # of what a speed is added from, below which it rests
REPEATS = 2  # of `Past.about`
# of the ledger, no sums
LARGEST = 5
SLIPPED = 7
SLIPS = 0.5  # share of the slide that is irreversible from which an interface slips
WHOLE = 3  # cycles of a motion that repeats, which hold every stick of one of them whole


@dataclass(frozen=True, eq=False, slots=True)
class PieceRun:
    """A run of piecewise-linear elements.

    amplitudes (c, 2): extremes of the output per cycle; phasors (c,): its drive-frequency part in the last cycle of
    every window, 0 in the others; ledger: energies [J]; outcome: None where the run came to its end; reading: what the
    window shows; events: how many pieces; end: (Start, memory) to go on from; slips: whether an interface slipped as a
    whole at some time; ring: as `reading.ring_of`, None also of other rigs; repeats: whether every cycle of the window
    is the same to the last bit. response, window: histories, None of a run without; their `extra` has "ledger" (4, k)
    [J] of all interfaces, and of several interfaces slides, slide_rates, forces, slips (k, i). log: events; snapshots:
    of the elements in the last cycle.
    """

    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    reading: Reading
    events: int
    cycles_done: float
    end: tuple
    slips: bool
    ring: tuple | None
    repeats: bool
    response: Response | None = None
    window: Response | None = None
    log: EventLog | None = None
    snapshots: list = field(default_factory=list)

    @property
    def loops(self) -> tuple:
        """A Loop of the window per interface."""
        return self.reading.loops

    @property
    def swing(self) -> float:
        """Half the range of the output in the window [m]."""
        return float(self.reading.swing)

    @property
    def acceleration(self) -> float:
        """Largest absolute acceleration of the output in the window [m s-2]."""
        return float(self.reading.acceleration)


def warm_up(say=None) -> tuple:
    """The compiled loop and what reads its rows; `say` is told where they have to be compiled."""
    when_compiling(say)
    return tuple(load(f"{HERE}.{name}_kernels") for name in ("march", "dense", "read"))


def expect(modes: ModalBasis, drive, groups, cycles: float, window: int, runs: int = 1) -> None:
    """Tell the functions of the loop that as many runs like this one are to come: what is over soon is not compiled.

    groups: Elements of every interface; cycles: of the drive in a run; window: of them kept whole.
    """
    march, dense, read = warm_up()
    stiff = max((float(one.stiffness.sum()) for one in groups), default=0.0)
    shown = min(cycles, window)
    each = python_seconds(modes, drive, stiff, sum(one.stiffness.size for one in groups))
    march.march.expect(runs * cycles * each)
    march.stored.expect(runs * each)
    dense.evaluate.expect(runs * shown * SAMPLES * sample_seconds(modes))
    read.read.expect(PYTHON_READ_FRACTION * runs * shown * each)


def is_loop_kept(modes: ModalBasis, drive) -> bool:
    """Return whether machine code of the loop from event to event is kept for these modes.

    The loop for one mode, whose frequency is a number, and that for several, whose frequencies are an array, are
    compiled apart.
    """
    modal_system = plant_of(modes)
    table = table_of([coulomb(1.0)] * len(modal_system.faces))
    motion = np.zeros((2, modes.omega.size))
    rows = np.zeros((1, 1))
    memory = virgin(table, np.zeros(len(modal_system.faces)))
    march = kernels(f"{HERE}.march_kernels").march
    return march.is_kept(
        (0.0, 0.0),
        motion,
        modal_system,
        table,
        memory,
        past_of(modal_system, table),
        clock_of(drive, len(modal_system.faces)),
        books_of(1, np.zeros(1)),
        room_of(modal_system),
        rows,
    )


def started(
    modes: ModalBasis,
    drive,
    groups,
    cycles: float,
    window: int = 1,
    travel: float = np.inf,
    start: InitialState | None = None,
    memory=None,
) -> "_Run":
    """A run of its own before its first piece; arguments as of `simulate`.

    Its `go` runs it to the end, its `until` for some periods at a time, as a map over a period wants.
    """
    expect(modes, drive, groups, cycles, window)
    return _Run(modes, drive, groups, cycles, window, travel, start, memory)


def simulate(
    modes: ModalBasis,
    drive,
    groups,
    cycles: float,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    progress=None,
    start: InitialState | None = None,
    memory=None,
    *,
    even: bool = False,
) -> PieceRun:
    """Run `cycles` drive cycles from rest or `start`; keeps the last `window` cycles whole.

    groups: Elements of every interface; frames: snapshots of the elements in the last cycle; memory: of the
    elements at the start, unstretched without; even: as `wanted` of `stored_samples_per_cycle`. The outcome
    is set only where the output passes `travel` [m]; the run ends there. NotConverged where events pile up.
    """
    if start is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError(
            "structure.travel: the displacement at the start is larger than this travel; raise the "
            "travel, or start nearer to the middle"
        )
    run = started(modes, drive, groups, cycles, window, travel, start, memory)
    done = run.go(frames, progress, even=even)
    # the travel ends the run: the same again to there, for the last cycles before it
    if done is None:
        again = started(modes, drive, groups, run.now / drive.period, window, np.inf, start, memory)
        again.outcome = Outcome.EXCEEDS_TRAVEL
        done = again.go(frames, None, even=even)
    return done


def briefly(cases, cycles: int, window: int) -> list:
    """What `simulate` gives of many runs, without histories and events, in a tenth of the time.

    cases: (modes, drive, groups, start) of each. NotConverged where events pile up in one.
    """
    out = []
    run = None
    for modes, drive, groups, start in cases:
        run = _Run(modes, drive, groups, cycles, window, np.inf, start, None, run)
        out.append(run.brief())
    return out


def motion_at(
    modes: ModalBasis, drive, groups, cycles: float, times, start: InitialState | None = None
) -> Response:
    """Return the motion at times (k,) [s] of `cycles` drive cycles from rest or `start`, by the series of pieces."""
    times = np.asarray(times, float)
    rows = []
    run = started(modes, drive, groups, cycles, start=start)
    run.until(cycles, run._into(rows))
    rows = np.concatenate(rows)
    owner = np.clip(np.searchsorted(rows[:, 0], times, side="right") - 1, 0, len(rows) - 1)
    return run._rows_as(rows, owner, np.clip(times - rows[owner, 0], 0.0, rows[owner, 1]), times)


class _Run:
    """Rows as they come: what is summed is summed, all but turning points and slips is forgotten before the window.

    like: a run that has ended, whose arrays may be taken.
    """

    def __init__(self, modes, drive, groups, cycles, window, travel, start, memory, like=None):
        self.modes = modes
        self.drive = drive
        self.groups = tuple(groups)
        self.window = window
        self.kernels, self.dense, self.reader = warm_up()
        self.modal_system = plant_of(modes)
        old = like.arrays if like is not None else (None,) * 5
        n = modes.omega.size
        count = max(1, ceil(cycles - 1e-9))
        table = table_of(self.groups)
        if np.any(~self.modal_system.faces.any(axis=1) & (table.static > 0)):
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so friction cannot act"
            )
        motion = np.zeros((2, n)) if start is None else np.array([start.z, start.v], float)
        fresh = virgin(table, self.modal_system.faces @ motion[0])
        memory = fresh if memory is None else type(fresh)(*(part.copy() for part in memory))
        wanted = np.zeros(count)
        # the last whole cycle of every window
        wanted[max(0, int(cycles + 1e-9)) - 1 :: -window] = 1.0
        new = (
            table,
            memory,
            past_of(self.modal_system, table),
            clock_of(drive, len(self.groups)),
            books_of(count, wanted, travel),
        )
        self.arrays = tuple(map(into, old, new))
        self.table, self.memory, self.past, self.time_state, self.books = self.arrays
        if like is not None and like.modal_system.faces.shape == self.modal_system.faces.shape:
            self.workspace = cleared(like.workspace)
            self.scratch = like.scratch
        else:
            self.workspace = room_of(self.modal_system)
            self.scratch = room_of(self.modal_system)
        self.motion = motion
        self.cycles = cycles
        self.period = drive.period
        self.width = self.kernels.HEAD + 2 * n + self.kernels.EACH * len(self.groups)
        self.early = []
        self.even = []
        self.kept = 0
        self.events = []
        self.count = 0
        self.rigid = bool(self.table.static.any())
        self.outcome = None
        self.snapshots = []
        self.before = self._ways(
            self.modal_system.faces @ self.motion[1],
            np.abs(self.modal_system.faces) @ np.abs(self.motion[1]),
        )
        self.passed = False
        self.repeats = False
        self.marked = np.zeros(0, bool)
        self.begun = self.kernels.stored(self.motion, self.modal_system, self.table, self.memory)
        still = self.kernels.stored(
            np.zeros_like(self.motion), self.modal_system, self.table, self.memory
        )
        # [J] before the books began
        self.stretched = still - float(np.sum(self.memory.worked - self.memory.lost))
        self.rows = (
            np.empty((CHUNK, self.width)) if like is None or like.width != self.width else like.rows
        )

    def until(self, cycles: float, keep=None, progress=None) -> None:
        """Run up to a time in cycles; keep: called with the rows as they come, None where no row is wanted.

        Where the motion repeats and rows are not wanted one by one, the cycles left are the last one.
        """
        stop = place(cycles * self.period, self.period)
        rows = self.rows[:0] if keep is None else self.rows
        while not self.passed:
            code, done = self._march(stop, rows)
            if keep is not None:
                keep(done)
            if progress is not None:
                progress(min(self.now / (self.cycles * self.period), 1.0))
            if code == self.kernels.REPEATS and keep in (None, self._keep):
                self._count_on(int(stop[0]), rows)
            elif code == self.kernels.DONE:
                break

    def _ways(self, speeds, sizes) -> np.ndarray:
        """Signs (i,) of the slip of rigid elements at speeds (i,) [m/s] that are added from sizes (i,)."""
        return np.where(
            (self.table.static > 0) & (np.abs(speeds) > NOISE * sizes), np.sign(speeds), 0.0
        )

    def _march(self, stop, rows) -> tuple:
        """(code, rows done (k, w)) of the compiled loop. What it sums is added as a whole: a million cycles of four
        pieces, added one by one, left the energies 6e-11 apart."""
        sums = self.books.ledger[:LARGEST]
        before = sums.copy()
        sums[:] = 0.0
        code, used = self.kernels.march(
            stop,
            self.motion,
            self.modal_system,
            self.table,
            self.memory,
            self.past,
            self.time_state,
            self.books,
            self.workspace,
            rows,
        )
        sums += before
        if code == self.kernels.PILED:
            raise NotConverged(
                f"dynamics: at t = {rows[max(used - 1, 0), 0]:.9g} s the contact changes between stick "
                "and slip again and again without time passing"
            )
        if code == self.kernels.OPEN:
            nearer = (
                "bring friction.kinetic nearer to friction.static, or "
                if np.any(self.table.kinetic < self.table.static)
                else ""
            )
            raise NotConverged(
                "dynamics: after a change between stick and slip no state was found that satisfies the "
                f'friction law; {nearer}use accuracy.method = "march"'
            )
        self.passed = code == self.kernels.TRAVEL
        return code, rows[: 0 if self.passed else used]

    def _into(self, out: list):
        """What takes rows into a list, their events noted."""

        def keep(rows) -> None:
            self._note(rows)
            out.append(rows.copy())

        return keep

    def _keep(self, rows) -> None:
        """Keep the turning points and slips of rows from before the window."""
        self.marked = self._note(rows) | (rows[:, 4] == self.kernels.TURNED)
        if not self.kept and len(rows):
            self.marked[0] = True  # the start
        if self.kept < CORNERS:
            self.early.append(rows[self.marked])
            self.kept += int(self.marked.sum())

    def _evenly(self, step: float):
        """What keeps, of rows as they come, samples at all multiples of a step [s] and those of `sample` besides."""
        last = np.empty((0, self.width))

        def keep(rows) -> None:
            nonlocal last
            self._note(rows)
            if len(rows):
                rows = np.concatenate([last, rows])
                last = rows[-1:].copy()
                grid = step * np.arange(
                    ceil(rows[0, 0] / step), ceil((rows[-1, 0] + rows[-1, 1]) / step)
                )
                self.even.append(self.sample(rows, grid if grid.size else rows[:1, 0]))

        return keep

    def _count_on(self, end: int, rows) -> None:
        """Count the cycles up to the last one before the number `end`, or before the next segment of the drive, as the
        next one, bit by bit, of a motion that repeats; rows: room, where that cycle wants more all are run."""
        books = self.books
        begin = int(self.time_state.now[0])
        k = int(self.time_state.now[2]) + 1
        if k < len(self.time_state.segments):
            end = min(end, int(self.time_state.segments[k, 0]))
        end -= 1  # the last one is run: it crosses the border
        many = end - begin - 1
        if many < 1:
            return
        sums = books.ledger, self.memory.worked, self.memory.lost
        before = [part.copy() for part in sums]
        noted = (len(self.events), self.count)
        asked = books.wanted[begin]
        books.wanted[begin] = 1.0
        code, done = self._march((begin + 1.0, 0.0), rows)
        books.wanted[begin] = asked
        if len(rows):
            self._keep(done)
        if code != self.kernels.DONE:
            return
        before[0][[LARGEST, SLIPPED]] = books.ledger[[LARGEST, SLIPPED]]
        for part, was in zip(sums, before):
            part += many * (part - was)
        for part in (books.extremes, books.phasors):
            part[begin + 1 : end] = part[begin]
        books.phasors[begin:end] *= books.wanted[begin:end, None]
        self.time_state.now[0] = end
        if len(rows):
            gained = self.memory.worked - before[1], self.memory.lost - before[2]
            self._again(done, many, *noted, [part / (many + 1) for part in gained])

    def _again(self, rows, many: int, first: int, count: int, gained) -> None:
        """Keep the rows (k, w) of a cycle, of at most SHOWN of them, and its events from the list's number `first` on
        for `many` cycles more; gained: work and loss (i,) [J] of the elements in a cycle."""
        turned = rows[self.marked]
        cycles = np.unique(np.linspace(1, many, min(many, SHOWN)).round())
        again = _later(turned, self.period * cycles)
        for column, each in zip((5, 6), gained):
            for f, part in enumerate(each):
                again[:, self._at(f, column)] += np.repeat(cycles * part, len(turned))
        self.early.append(again)
        self.kept += len(again)
        found = np.concatenate([np.empty((0, 5)), *self.events[first:]])
        few = min(many, -(-ROOM // max(len(found), 1)))
        self.events.append(_later(found, self.period * np.arange(many - few + 1, many + 1)))
        self.count += many * (self.count - count)

    def _note(self, rows) -> np.ndarray:
        """Note stops, releases and reversals of all interfaces and borders of the drive; which rows (k,) begin with a
        change of the first."""
        marked = np.zeros(len(rows), bool)
        if not len(rows):
            return marked
        shares = rows[:, self.width - self.kernels.EACH * len(self.groups) + 2 :: self.kernels.EACH]
        for f, share in enumerate(shares.T):
            way = np.where(share >= SLIPS, rows[:, self._at(f, 7)], 0.0)
            old = np.concatenate([self.before[f : f + 1], way[:-1]])
            self.before[f] = way[-1]
            turned = np.flatnonzero(old != way)
            what = np.where(
                way[turned] == 0, STOP, np.where(old[turned] == 0, RELEASE, REVERSAL) * way[turned]
            )
            z = rows[turned, self.kernels.HEAD : self.kernels.HEAD + self.modes.omega.size]
            place = rows[turned, self._at(f, 8)] if self.rigid else z @ self.modal_system.faces[f]
            self.events.append(
                np.stack(
                    [rows[turned, 0], rows[turned, 2] % (2 * np.pi), 0 * place + f, what, place],
                    axis=1,
                )
            )
            self.count += turned.size
            marked[turned] = True
        borders = np.flatnonzero(rows[:, 4] == self.kernels.BORDERED) if self.rigid else ()
        if len(borders):
            some = rows[borders]
            self.events.append(
                np.stack(
                    [
                        some[:, 0],
                        some[:, 2] % (2 * np.pi),
                        0 * some[:, 0] - 1,
                        0 * some[:, 0] + BORDER,
                        0 * some[:, 0],
                    ],
                    axis=1,
                )
            )
            self.count += len(borders)
            marked[borders] = True
        return marked

    def _at(self, face: int, column: int) -> int:
        return self.kernels.HEAD + 2 * self.modes.omega.size + self.kernels.EACH * face + column

    def go(self, frames: int, progress, *, even: bool = False) -> PieceRun | None:
        """The whole run; None where its output passed the travel. even: as of `simulate`."""
        end = self.cycles
        wide = []
        late = []
        even = stored_samples_per_cycle(self.drive, self.cycles, wanted=even)
        first = max(0.0, end - self.window)
        last = max(0.0, end - 1)
        begin = max(0.0, min(first, end - 2))
        if begin > 0:
            self.until(begin, self._evenly(self.period / even) if even else self._keep, progress)
        if first > begin:
            self.until(first, self._into(wide), progress)
        self.repeats = bool(self.past.about[REPEATS])
        for stop in self._stops(first, last):
            self.until(stop, self._into(late), progress)
        for k in range(frames):
            self.until(last + (end - last) * (k + 1) / frames, self._into(late))
            self.snapshots.append(self._snapshot())
        self.until(end, self._into(late), progress)
        return None if self.passed else self._close(wide, self._ended(late))

    def brief(self) -> PieceRun:
        """The run without histories and events; of a motion that repeats few cycles are read."""
        end = self.cycles
        late = []
        self.until(end - self.window)
        self.repeats = bool(self.past.about[REPEATS])
        if self.repeats:
            self.until(end - min(WHOLE, self.window))
        self.until(end, lambda rows: late.append(rows.copy()))
        return self._found(self._ended(late))

    def _stops(self, first: float, last: float) -> list:
        """Times in cycles at which every cycle of the window ends but the last, of a run that ends within one."""
        whole = abs(self.cycles - round(self.cycles)) < 1e-9
        return (
            []
            if whole
            else [
                stop for stop in self.cycles - np.arange(self.window, 0, -1) if first < stop <= last
            ]
        )

    def _ended(self, late) -> np.ndarray:
        """Rows (k + 1, w) of the window, and one of no length for its end."""
        head = self.kernels.HEAD
        each = self.kernels.EACH
        n = self.modes.omega.size
        memory = self.memory
        row = np.zeros((1, self.width))
        row[0, 0] = self.now
        row[0, 3] = self.time_state.now[2]
        row[0, 5:7] = self.time_state.now[:2]
        row[0, head : head + n], row[0, head + n : head + 2 * n] = self.motion
        for k, part in (
            (0, memory.force),
            (4, memory.slip),
            (5, memory.worked),
            (6, memory.lost),
            (8, memory.place),
        ):
            row[0, head + 2 * n + k :: each] = part
        rows = np.concatenate([*late, row])
        if self.rigid:  # an event at the beginning of the window, to the last digits, is before it
            rows = rows[min(int(np.argmax(rows[:, 1] > 1e-12 * self.period)), len(rows) - 2) :]
        return rows

    @property
    def now(self) -> float:
        """Time [s] of the run."""
        return float(self.time_state.now[0] * self.period + self.time_state.now[1])

    def _snapshot(self) -> dict:
        return {
            "time": self.now,
            "slide": float(self.memory.place[0]),
            "force": float(self.memory.force[0]),
            "rate": float(self.modal_system.faces[0] @ self.motion[1]),
            "slip": float(self.memory.slip[0]),
            "stretch": stretches(self.groups[0], self.memory, 0),
            "faces": [
                (float(self.memory.place[k]), stretches(group, self.memory, k))
                for k, group in enumerate(self.groups)
            ],
        }

    def _found(self, rows) -> PieceRun:
        """What the run shows without histories, off the rows of its window."""
        begun = rows[0, 0]
        stop = rows[-1, 0]
        faces = len(self.groups)
        span = stop - begun
        numbers = np.zeros(OF_RUN), np.zeros((faces, OF_FACE))
        cycles = max(1, round(span / self.period))
        self.reader.read(
            rows,
            cycles,
            self.modal_system,
            self.time_state,
            float(self.drive.moving),
            self.scratch,
            *numbers,
        )
        reading = Reading(*numbers, float(span), self.period)
        done = slice(0, max(1, ceil(stop / self.period - 1e-9)))
        names = ("work_in", "viscous", "power")
        book = dict(zip(names, map(float, self.books.ledger[:3]))) | {
            "friction": float(self.books.ledger[4])
        }
        now = self.kernels.stored(self.motion, self.modal_system, self.table, self.memory)
        book |= {
            "stored": now - self.begun,
            "peak_stored": max(float(self.books.ledger[LARGEST]), self.begun),
        }
        alone = (
            len(self.drive.segments) == 1
            and self.modal_system.faces.shape == (1, 1)
            and self.modal_system.faces[0, 0] != 0
            and not self.rigid
        )
        ring = ring_of(self.modal_system, self.table, reading) if alone else None
        end = (
            InitialState(*self.motion.copy()),
            type(self.memory)(*(part.copy() for part in self.memory)),
        )
        ledger = self.books.ledger
        phasors = self.books.phasors[done] @ [1, 1j]
        return PieceRun(
            self.books.extremes[done].copy(),
            phasors,
            book,
            self.outcome,
            reading,
            int(ledger[6]),
            stop / self.period,
            end,
            bool(ledger[SLIPPED]),
            ring,
            self.repeats,
        )

    def _close(self, wide, rows) -> PieceRun:
        """Everything kept, as a PieceRun."""
        none = np.empty((0, self.width))
        late = rows[:-1]
        begun = rows[0, 0]
        stop = rows[-1, 0]
        early = np.concatenate([none, *self.early])
        wide = np.concatenate([none, *wide])
        number = max(LEAST, round((stop - begun) / self.period * SAMPLES) + 1)
        window = self.sample(late, np.linspace(begun, stop, number))
        parts = (
            [self._rows_as(early, np.arange(len(early)), np.zeros(len(early)), early[:, 0])]
            if len(early)
            else [_part(one, one.time < (wide if len(wide) else rows)[0, 0]) for one in self.even]
        )
        if len(wide):
            span = begun - wide[0, 0]
            more = self.sample(
                wide, np.linspace(wide[0, 0], begun, round(span / self.period * SAMPLES) + 1)
            )
            parts.append(_part(more, more.time < begun))
        return replace(
            self._found(rows),
            response=_chain([*parts, window]),
            window=window,
            log=self.log(),
            snapshots=self.snapshots,
        )

    def log(self) -> EventLog:
        """The last stops and releases."""
        rows = np.concatenate([np.empty((0, 5)), *self.events])
        rows = rows[np.argsort(rows[:, 0], kind="stable")][-ROOM:]
        time, phase, interface, what, slide = rows.T
        return EventLog(
            frozen_array(time),
            frozen_array(phase),
            frozen_array(interface, np.int64),
            frozen_array(what, np.int64),
            frozen_array(slide),
            self.count,
        )

    def sample(self, rows, grid) -> Response:
        """Histories at the times of a grid (k,) [s] and wherever a row begins with a turning point, a stop or a
        release; of rigid elements, whose force jumps, on both sides of it."""
        shares = rows[:, self._at(0, 2) :: self.kernels.EACH] >= SLIPS
        jumps = (rows[:, 4] > self.kernels.TURNED) & self.rigid
        turns = rows[:, 4] == self.kernels.TURNED
        events = jumps | turns | np.any(np.diff(shares, axis=0, prepend=shares[:1]), axis=1)
        if np.count_nonzero(rows[:, 4]) <= 2 * grid.size:
            # the force bends at a yield, so both books close
            events |= rows[:, 4] == self.kernels.YIELDED
        jumps = rows[jumps & (rows[:, 0] > grid[0]), 0]
        time = np.unique(np.concatenate([grid, rows[events, 0], np.nextafter(jumps, -np.inf)]))
        owner = np.clip(np.searchsorted(rows[:, 0], time, side="right") - 1, 0, len(rows) - 1)
        return self._rows_as(rows, owner, np.clip(time - rows[owner, 0], 0.0, rows[owner, 1]), time)

    def dense_values(self, rows, owner, tau) -> np.ndarray:
        """Columns of `dense_kernels.evaluate` at tau (k,) [s] after the starts of the rows owner (k,)."""
        out = np.empty((owner.size, 2 * self.modes.omega.size + 1 + 6 * len(self.groups)))
        self.dense.evaluate(rows, owner, tau, self.modal_system, self.time_state, self.scratch, out)
        return out

    def _rows_as(self, rows, owner, tau, time) -> Response:
        """Histories at `time` (k,) [s], tau (k,) [s] after the starts of the rows owner (k,)."""
        return self._as_response(self.dense_values(rows, owner, tau), time)

    def _as_response(self, out, time) -> Response:
        """Histories at `time` (k,) [s] from the columns of `dense_values`."""
        modes = self.modes
        n = self.modes.omega.size
        z = out[:, :n].copy()
        v = out[:, n : 2 * n].copy()
        push = out[:, 2 * n]
        slides, rates, forces, slips, works, losses = (out[:, 2 * n + 1 + k :: 6] for k in range(6))
        base = push if self.drive.moving else np.zeros_like(push)
        accel = (
            -np.outer(push, modes.base)
            - v @ self.modal_system.damping.T
            - z * self.modal_system.square
            - forces @ self.modal_system.faces / modes.mass
        )
        work = works.sum(axis=1)
        lost = losses.sum(axis=1)
        extra = {"ledger": np.stack([work, self.stretched + work - lost, lost, 0 * lost])}
        if len(self.groups) > 1:
            extra |= {"slides": slides, "slide_rates": rates, "forces": forces, "slips": slips}
        return Response(
            time,
            z,
            v,
            *(part[:, 0].copy() for part in (slides, rates)),
            z @ modes.output,
            v @ modes.output,
            accel @ modes.output + base,
            base,
            forces[:, 0].copy(),
            slips[:, 0].copy(),
            extra,
        )


def _later(rows, times) -> np.ndarray:
    """Rows (k, w), the first column a time [s], once for each of some times (m,) [s] later."""
    out = np.tile(rows, (len(times), 1))
    out[:, 0] += np.repeat(times, len(rows))
    return out


_COLUMNS = (
    "time",
    "modal",
    "modal_rate",
    "slide",
    "slide_rate",
    "output",
    "output_rate",
    "acceleration",
    "base_acceleration",
    "force",
    "slip",
)


def _part(response: Response, which) -> Response:
    extra = {
        name: part[:, which] if name == "ledger" else part[which]
        for name, part in response.extra.items()
    }
    return Response(*(getattr(response, name)[which] for name in _COLUMNS), extra)


def _chain(parts) -> Response:
    if len(parts) == 1:
        return parts[0]
    extra = {
        name: np.concatenate([r.extra[name] for r in parts], axis=1 if name == "ledger" else 0)
        for name in parts[0].extra
    }
    whole = Response(
        *(np.concatenate([getattr(r, name) for r in parts]) for name in _COLUMNS), extra
    )
    later = np.diff(np.maximum.accumulate(whole.time), prepend=-np.inf) > 0
    return whole if later.all() else _part(whole, later)
