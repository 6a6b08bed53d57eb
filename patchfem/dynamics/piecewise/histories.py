"""Samples, extremes, energies and events of a run of rigid and piecewise-linear elements."""

from dataclasses import dataclass
from math import ceil, factorial

import numpy as np

from ...compiled import load
from ...core import ModalBasis, NotConverged, Outcome, PatchfemError, Response, Start, frozen_array
from ..events.event_list import BORDER, RELEASE, REVERSAL, ROOM, STOP, EventLog
from ..integrated import Loop
from ..piecewise_one import room as one
from .elements import stretches, table_of, virgin
from .plant import books_of, clock_of, place, plant_of, room_of

HERE, ALONE = "dynamics.piecewise", "dynamics.piecewise_one"
SAMPLES = 400  # per drive cycle in the kept window
LEAST = 101  # of a run that has no cycles
CHUNK = 4096  # rows held at once
CORNERS = 400_000  # turning points kept from before the window
NOISE = 64 * 2.0**-52  # of what a speed is added from, below which it rests
SLIPS = 0.5  # share of the slide that is irreversible from which an interface slips
# largest piece times rate for which g Gauss points, g = 0 to 12, integrate a product of two motions to 1e-14
GAUSS = np.array([0.0] + [0.5 * (1e-14 * (2 * g + 1) * factorial(2 * g)**3 / factorial(g)**4)**(1 / (2 * g))
                          for g in range(1, 13)])
PLACE, WEIGHT = np.zeros((2, GAUSS.size, GAUSS.size))  # of g Gauss points on [-1, 1], in row g
for _g in range(1, GAUSS.size):
    PLACE[_g, :_g], WEIGHT[_g, :_g] = np.polynomial.legendre.leggauss(_g)


@dataclass(frozen=True, eq=False, slots=True)
class PieceRun:
    """A run of piecewise-linear elements.

    response, window: histories; their `extra` has "ledger" (4, k) [J] of all interfaces, and of several interfaces
    slides, slide_rates, forces, slips (k, i). amplitudes (c, 2): extremes of the output per cycle; phasors (c,): its
    drive-frequency part in the last cycle of every window, 0 in the others; ledger: energies [J]; loops: a Loop per
    interface; starts: phases of the release of the first interface in the window, mod pi;
    acceleration: largest at the output in the window; log: events; snapshots: of the elements in the last cycle;
    events: how many pieces; swing, drift: half the range of the output in the window and the motion of the slide's
    mean per cycle [m]; waves: first and third harmonic of the absolute acceleration in the window [m s-2]; end:
    (Start, memory) to go on from; ring: (amplitude [m s-2], frequency [rad/s], damping ratio) of what rings while a
    single element holds, with an amplitude of 0 where nothing does, as behind elements whose sticks are too short for
    it; None where the samples have to tell; repeats: whether every cycle of the window is the same to the last bit.
    """

    response: Response
    window: Response
    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    loops: tuple
    starts: np.ndarray
    acceleration: float
    log: EventLog
    snapshots: list
    events: int
    swing: float
    drift: float
    waves: tuple
    cycles_done: float
    end: tuple
    ring: tuple | None = None
    repeats: bool = False


def warm_up(say=None) -> tuple:
    """The compiled loop and the sums over its rows; `say` is told where they have to be compiled first."""
    return load(f"{HERE}.march_kernels", say), load(f"{HERE}.dense_kernels", say)


def simulate(modes: ModalBasis, drive, groups, cycles: float, window: int = 10, travel: float = np.inf,
             frames: int = 0, progress=None, start: Start | None = None, memory=None) -> PieceRun:
    """Run `cycles` drive cycles from rest or `start`; keeps the last `window` cycles whole.

    groups: Elements of every interface; frames: snapshots of the elements in the last cycle; memory: of the elements at
    the start, unstretched without. The outcome is set only where the output passes `travel` [m]; the run ends there.
    NotConverged where events pile up.
    """
    if start is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError("structure.travel: the start lies beyond it; raise travel or start nearer to the middle")
    run = _Run(modes, drive, groups, cycles, window, travel, start, memory)
    done = run.go(frames, progress)
    if done is None:  # the travel ends the run: the same again to there, for the last cycles before it
        again = _Run(modes, drive, groups, run.now / drive.period, window, np.inf, start, memory)
        again.outcome = Outcome.EXCEEDS_TRAVEL
        done = again.go(frames, None)
    return done


class _Run:
    """Rows as they come: what is summed is summed, all but turning points and slips is forgotten before the window."""

    def __init__(self, modes, drive, groups, cycles, window, travel, start, memory):
        self.modes, self.drive, self.groups, self.window = modes, drive, tuple(groups), window
        self.kernels, self.dense = warm_up()
        self.table, self.plant = table_of(self.groups), plant_of(modes)
        if np.any(~self.plant.faces.any(axis=1) & (self.table.static > 0)):
            raise PatchfemError("structure.mode.slide: no mode moves the interface, so friction cannot act")
        self.clock, self.room = clock_of(drive, len(self.groups)), room_of(self.plant)
        self.reading, self.rigid = room_of(self.plant), bool(self.table.static.any())
        n, count = modes.omega.size, max(1, ceil(cycles - 1e-9))
        self.motion = np.zeros((2, n))
        if start is not None:
            self.motion[:] = start.z, start.v
        fresh = virgin(self.table, self.plant.faces @ self.motion[0])
        self.memory = fresh if memory is None else type(fresh)(*(part.copy() for part in memory))
        wanted = np.zeros(count)
        wanted[max(0, int(cycles + 1e-9)) - 1::-window] = 1.0  # the last whole cycle of every window
        self.books, self.cycles, self.period = books_of(count, wanted, travel), cycles, drive.period
        alone = not self.rigid and one.serves(self.plant, self.clock, travel)
        self.alone = one.rig_of(self.plant) if alone else None
        self.lines = one.room_of() if self.alone is not None else None
        self.last = one.last_of(self.table.reach.shape[1])
        self.width = self.kernels.HEAD + 2 * n + self.kernels.EACH * len(self.groups)
        self.early, self.kept, self.events, self.count = [], 0, [], 0
        self.outcome, self.snapshots = None, []
        self.before = self._ways(self.plant.faces @ self.motion[1], np.abs(self.plant.faces) @ np.abs(self.motion[1]))
        self.passed, self.repeats = False, False
        self.begun = self.kernels.stored(self.motion, self.plant, self.table, self.memory)
        still = self.kernels.stored(np.zeros_like(self.motion), self.plant, self.table, self.memory)
        self.stretched = still - float(np.sum(self.memory.worked - self.memory.lost))  # [J] from before the books began

    def until(self, cycles: float, whole: bool, progress=None) -> list:
        """Rows up to a time in cycles: all of them, or where not `whole` only turning points and slips."""
        out, stop = [], place(cycles * self.period, self.period)
        rows = np.empty((CHUNK, self.width))
        code = self.kernels.FULL
        while code == self.kernels.FULL and not self.passed:
            code, used = self._march(stop, rows)
            if code == self.kernels.PILED:
                raise NotConverged(f"dynamics: events pile up at t = {rows[max(used - 1, 0), 0]:.9g} s")
            if code == self.kernels.OPEN:
                raise NotConverged("dynamics: no state of stick and slip that satisfies the law of friction was found "
                                   "after an event; bring friction.kinetic nearer to static, or use method = "
                                   "\"march\"")
            if code == self.kernels.TRAVEL:
                self.passed = True
                break
            done = rows[:used]
            marked = self._note(done) | (done[:, 4] == self.kernels.TURNED)
            if whole:
                out.append(done.copy())
            elif self.kept < CORNERS:
                self.early.append(done[marked])
                self.kept += int(marked.sum())
            if progress is not None:
                progress(min(self.now / (self.cycles * self.period), 1.0))
        return out

    def _ways(self, speeds, sizes) -> np.ndarray:
        """Signs (i,) of the slip of rigid elements at speeds (i,) [m/s] that are added from sizes (i,)."""
        return np.where((self.table.static > 0) & (np.abs(speeds) > NOISE * sizes), np.sign(speeds), 0.0)

    def _march(self, stop, rows) -> tuple:
        """(code, rows used) of the compiled loop, of one mode its own."""
        if self.alone is None:
            return self.kernels.march(stop, self.motion, self.plant, self.table, self.memory, self.clock, self.books,
                                      self.room, rows)
        return load(f"{ALONE}.one_kernels").march(stop, self.motion, self.alone, self.table, self.memory, self.clock,
                                                  self.books, self.last, self.lines, rows)

    def _note(self, rows) -> np.ndarray:
        """Note stops, releases and reversals of all interfaces and borders of the drive; which rows (k,) begin with a
        change of the first."""
        marked = np.zeros(len(rows), bool)
        if not len(rows):
            return marked
        shares = rows[:, self.width - self.kernels.EACH * len(self.groups) + 2::self.kernels.EACH]
        for f, share in enumerate(shares.T):
            way = np.where(share >= SLIPS, rows[:, self._at(f, 7)], 0.0)
            old = np.concatenate([self.before[f:f + 1], way[:-1]])
            self.before[f] = way[-1]
            turned = np.flatnonzero(old != way)
            what = np.where(way[turned] == 0, STOP, np.where(old[turned] == 0, RELEASE, REVERSAL) * way[turned])
            z = rows[turned, self.kernels.HEAD:self.kernels.HEAD + self.modes.omega.size]
            place = rows[turned, self._at(f, 8)] if self.rigid else z @ self.plant.faces[f]
            self.events.append(np.stack([rows[turned, 0], rows[turned, 2] % (2 * np.pi), 0 * place + f, what, place],
                                        axis=1))
            self.count += turned.size
            marked[turned] = True
        borders = np.flatnonzero(rows[:, 4] == self.kernels.BORDERED) if self.rigid else ()
        if len(borders):
            some = rows[borders]
            self.events.append(np.stack([some[:, 0], some[:, 2] % (2 * np.pi), 0 * some[:, 0] - 1,
                                         0 * some[:, 0] + BORDER, 0 * some[:, 0]], axis=1))
            self.count += len(borders)
            marked[borders] = True
        return marked

    def _at(self, face: int, column: int) -> int:
        return self.kernels.HEAD + 2 * self.modes.omega.size + self.kernels.EACH * face + column

    def go(self, frames: int, progress) -> PieceRun | None:
        """The whole run; None where its output passed the travel."""
        end = self.cycles
        first, last = max(0.0, end - self.window), max(0.0, end - 1)
        begin = max(0.0, min(first, end - 2))
        if begin > 0:
            self.until(begin, False, progress)
        wide = self.until(first, True, progress) if first > begin else []
        late = []
        before = float(self.before[0]) if len(self.before) else 0.0
        self.repeats = self.alone is not None and bool(self.last[0, one.REPEATS])
        for stop in (first + 1, last):  # the drift asks for the first and the last cycle of the window
            if first < stop < end:
                late += self.until(stop, True, progress)
        for k in range(frames):
            late += self.until(last + (end - last) * (k + 1) / frames, True)
            self.snapshots.append(self._snapshot())
        late += self.until(end, True, progress)
        return None if self.passed else self._close(wide, late, before)

    @property
    def now(self) -> float:
        """Time [s] of the run."""
        return float(self.clock.now[0] * self.period + self.clock.now[1])

    def _snapshot(self) -> dict:
        return {"time": self.now, "slide": float(self.memory.place[0]), "force": float(self.memory.force[0]),
                "rate": float(self.plant.faces[0] @ self.motion[1]), "slip": float(self.memory.slip[0]),
                "stretch": stretches(self.groups[0], self.memory, 0)}

    def _ring(self, late, before: float) -> tuple | None:
        """`PieceRun.ring` of the rows of the window; before: way of the slip before them."""
        if self.alone is None or len(self.drive.segments) != 1:
            return None
        found, last = np.zeros(one.NUMBERS), self.clock.segments[0]
        load(f"{ALONE}.window_kernels").rings(late, before, self.period, (last[5], last[4], last[3]), self.alone, found)
        if self.table.count[0] > 1:
            return (0.0, 0.0, 0.0) if found[one.SWING] < one.RINGS else None
        return one.ring_of(self.alone, self.table.stiff[0, -1], found[one.RING])

    def _close(self, wide, late, before: float) -> PieceRun:
        """Everything kept, as a PieceRun."""
        none, late = np.empty((0, self.width)), np.concatenate(late)
        stop = late[-1, 0] + late[-1, 1]
        early, begun = np.concatenate([none, *self.early]), late[0, 0]
        number = max(LEAST, round((stop - begun) / self.period * SAMPLES) + 1)
        window = self.sample(late, np.linspace(begun, stop, number))
        parts = [self._rows_as(early, np.arange(len(early)), np.zeros(len(early)), early[:, 0])] if len(early) else []
        wide = np.concatenate([none, *wide])
        if len(wide):
            span = begun - wide[0, 0]
            more = self.sample(wide, np.linspace(wide[0, 0], begun, round(span / self.period * SAMPLES) + 1))
            parts.append(_part(more, more.time < begun))
        done = slice(0, max(1, ceil(stop / self.period - 1e-9)))
        names = ("work_in", "viscous", "power")
        book = dict(zip(names, map(float, self.books.ledger[:3]))) | {"friction": float(self.books.ledger[4])}
        now = self.kernels.stored(self.motion, self.plant, self.table, self.memory)
        book |= {"stored": now - self.begun, "peak_stored": max(float(self.books.ledger[5]), self.begun)}
        log = self.log()
        starts = _starts(log, begun, self.period)
        reactions = np.zeros(len(self.groups))
        high = self.dense.peak(late, self.plant, self.clock, float(self.drive.moving), self.reading, reactions)
        phasors = self.books.phasors[done] @ [1, 1j]
        loops, *moved = self._loops(late)
        loops = tuple(part._replace(force=max(part.force, float(held))) for part, held in zip(loops, reactions))
        return PieceRun(_chain([*parts, window]), window, self.books.extremes[done], phasors, book, self.outcome,
                        loops, starts, float(high), log, self.snapshots, int(self.books.ledger[6]), *moved,
                        stop / self.period, (Start(*self.motion.copy()), self.memory), self._ring(late, before),
                        self.repeats)

    def log(self) -> EventLog:
        """The last stops and releases."""
        rows = np.concatenate([np.empty((0, 5)), *self.events])
        rows = rows[np.argsort(rows[:, 0], kind="stable")][-ROOM:]
        time, phase, interface, what, slide = rows.T
        return EventLog(frozen_array(time), frozen_array(phase), frozen_array(interface, np.int64),
                        frozen_array(what, np.int64), frozen_array(slide), self.count)

    def sample(self, rows, grid) -> Response:
        """Histories at the times of a grid (k,) [s] and wherever a row begins with a turning point, a stop or a
        release; of rigid elements, whose force jumps, on both sides of it."""
        shares = rows[:, self._at(0, 2)::self.kernels.EACH] >= SLIPS
        jumps = (rows[:, 4] > self.kernels.TURNED) & self.rigid
        turns = rows[:, 4] == self.kernels.TURNED
        events = jumps | turns | np.any(np.diff(shares, axis=0, prepend=shares[:1]), axis=1)
        if np.count_nonzero(rows[:, 4]) <= 2 * grid.size:
            events |= rows[:, 4] == self.kernels.YIELDED  # the force bends at a yield, so both books close
        jumps = rows[jumps & (rows[:, 0] > grid[0]), 0]
        time = np.unique(np.concatenate([grid, rows[events, 0], np.nextafter(jumps, -np.inf)]))
        owner = np.clip(np.searchsorted(rows[:, 0], time, side="right") - 1, 0, len(rows) - 1)
        return self._rows_as(rows, owner, np.clip(time - rows[owner, 0], 0.0, rows[owner, 1]), time)

    def dense_values(self, rows, owner, tau) -> np.ndarray:
        """Columns of `dense_kernels.evaluate` at tau (k,) [s] after the starts of the rows owner (k,)."""
        out = np.empty((owner.size, 2 * self.modes.omega.size + 1 + 6 * len(self.groups)))
        self.dense.evaluate(rows, owner, tau, self.plant, self.clock, self.reading, out)
        return out

    def _rows_as(self, rows, owner, tau, time) -> Response:
        """Histories at `time` (k,) [s], tau (k,) [s] after the starts of the rows owner (k,)."""
        return self._as_response(self.dense_values(rows, owner, tau), time)

    def _as_response(self, out, time) -> Response:
        """Histories at `time` (k,) [s] from the columns of `dense_values`."""
        modes, n = self.modes, self.modes.omega.size
        z, v, push = out[:, :n].copy(), out[:, n:2 * n].copy(), out[:, 2 * n]
        slides, rates, forces, slips, works, losses = (out[:, 2 * n + 1 + k::6] for k in range(6))
        base = push if self.drive.moving else np.zeros_like(push)
        accel = -np.outer(push, modes.base) - v @ self.plant.damping.T - z * self.plant.square \
            - forces @ self.plant.faces / modes.mass
        work, lost = works.sum(axis=1), losses.sum(axis=1)
        extra = {"ledger": np.stack([work, self.stretched + work - lost, lost, 0 * lost])}
        if len(self.groups) > 1:
            extra |= {"slides": slides, "slide_rates": rates, "forces": forces, "slips": slips}
        return Response(time, z, v, *(part[:, 0].copy() for part in (slides, rates)), z @ modes.output,
                        v @ modes.output, accel @ modes.output + base, base, forces[:, 0].copy(), slips[:, 0].copy(),
                        extra)

    def _loops(self, rows) -> tuple:
        """(what the measures ask of every interface over the pieces of the window, half the range of the output, motion
        of the first slide per cycle), by Gauss points and the ends of the pieces."""
        owner, tau, weight = self._points(rows)
        n, out, time = self.modes.omega.size, self.dense_values(rows, owner, tau), rows[owner, 0] + tau
        turn = np.exp(-2j * np.pi * time / self.period) * weight
        begin = self.dense_values(rows, np.arange(len(rows)), np.zeros(len(rows)))
        close = self.dense_values(rows[-1:], np.zeros(1, np.int64), rows[-1:, 1].copy())
        ends, span = np.concatenate([begin, close]), rows[:, 1].sum()
        found = []
        for f in range(len(self.groups)):
            at = 2 * n + 1 + 6 * f
            slide, force, slip, work = (ends[:, at + k] for k in (0, 2, 3, 4))
            stuck = rows[rows[:, self._at(f, 2)] < SLIPS, 1].sum()
            middle = slide.mean()
            q, pull = (2 / span * np.sum(turn * part) for part in (out[:, at] - middle, out[:, at + 2]))
            found.append(Loop(complex(q), complex(pull),
                              float(self.memory.worked[f] - work[0]), float(np.ptp(slip)), float(stuck),
                              float(np.abs(force).max())))
        output, felt = ends[:, :n] @ self.modes.output, self._as_response(out, time).acceleration
        waves = tuple(complex(2 / span * np.sum(weight * felt * np.exp(-2j * np.pi * k * time / self.period)))
                      for k in (1, 3))
        drift = self._drift(time, weight, out[:, 2 * n + 1], rows[0, 0], rows[-1, 0] + rows[-1, 1], ends[:, 2 * n + 1])
        return tuple(found), float(np.ptp(output)) / 2, drift, waves

    def _points(self, rows) -> tuple:
        """(row (k,), time in it (k,) [s], weight (k,) [s]) of Gauss points that integrate products of the motion and
        of the third harmonic over the pieces of rows."""
        springs = rows[:, self._at(0, 1)::self.kernels.EACH][:, :len(self.groups)]
        springs = np.where(np.isfinite(springs), springs, 0.0)
        square, damp = self.plant.square_most + springs @ self.plant.reach, 0.5 * self.plant.damping_most
        rate = np.maximum(damp + np.sqrt(damp**2 + square), 6 * np.pi / self.period)
        count = np.minimum(np.searchsorted(GAUSS, rate * rows[:, 1]), GAUSS.size - 1).clip(2)
        owner = np.repeat(np.arange(len(rows)), count)
        each = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
        half = rows[owner, 1] / 2
        return owner, half * (1 + PLACE[count[owner], each]), half * WEIGHT[count[owner], each]

    def _drift(self, time, weight, slide, start: float, end: float, ends) -> float:
        """Mean of a slide in the last cycle of [start, end] less that in the first, per cycle between them [m]; in
        fewer than 1.5 cycles the motion from end to end."""
        cycles = (end - start) / self.period
        if cycles < 1.5:
            return float(ends[-1] - ends[0]) / max(cycles, 1e-9)
        means = [np.sum((weight * slide)[part]) / np.sum(weight[part])
                 for part in (time < start + self.period, time > end - self.period)]
        return float(means[1] - means[0]) / (cycles - 1)


_COLUMNS = ("time", "modal", "modal_rate", "slide", "slide_rate", "output", "output_rate", "acceleration",
            "base_acceleration", "force", "slip")


def _part(response: Response, which) -> Response:
    extra = {name: part[:, which] if name == "ledger" else part[which] for name, part in response.extra.items()}
    return Response(*(getattr(response, name)[which] for name in _COLUMNS), extra)


def _starts(log: EventLog, begun: float, period: float) -> np.ndarray:
    """Phases modulo pi of the releases of the first interface after `begun` [s].

    Where a slip turns at the limit a release stands between two stops at one time: nothing sticks or slips there.
    """
    mine = log.interface == 0
    time, phase = log.time[mine], log.phase[mine]
    lasts = np.append(np.diff(time), np.inf) > 1e-9 * period
    return phase[(np.abs(log.what[mine]) == RELEASE) & lasts & (time > begun)] % np.pi


def _chain(parts) -> Response:
    if len(parts) == 1:
        return parts[0]
    extra = {name: np.concatenate([r.extra[name] for r in parts], axis=1 if name == "ledger" else 0)
             for name in parts[0].extra}
    return Response(*(np.concatenate([getattr(r, name) for r in parts]) for name in _COLUMNS), extra)
