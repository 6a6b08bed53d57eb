"""From the results of the stages to the arrays of the compiled loop, and the march in pieces of one drive cycle."""

from collections import deque
from copy import copy
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...compiled import load
from ...core import ModalBasis, Outcome, Response, SineDrive
from ...formatting import format_length
from ...friction.bonds.list_rows_kernels import STATUS
from ...friction.path_work import sampled_work
from ...structure.drive_sizes import stored_samples_per_cycle
from ..checkpoint import Samples, slot_of
from ..cycles import extremes_of, phasors_of, thinned
from ..integrated import histories
from ..interfaces import arrays
from ..interfaces.arrays import ModalArrays
from ..periodicity import APART, ahead, looked_at, until_look
from ..propagator import propagator
from .capacity import keep, lengthened
from .faces import GOAL, faces_of
from .models import ContactModel, free_model, load_kernels

# status of a loop whose list of bonds is full, and where no contact set fits the motion
FULL, UNFIT = (
    2,
    4,
)
FLUNG = 10.0  # times beyond its stop that no step ends which followed the motion
EACH = 5  # columns of an element in a row, as of `faces_kernels`
AT_ONCE, PIECES = 8000, 16  # steps and cycles of a piece of a run of which nothing is kept
PASSING = "dynamics.march.passing_kernels"
# of its size, by which a motion that repeats may still change in all that is left of it
REPEATS = 1e-12
SUMS = [0, 1, 2, 3, 5, 7, 8]  # of the ledger: what grows from cycle to cycle


@dataclass(frozen=True, eq=False, slots=True)
class MarchResult:
    """A march: kept samples, the last cycles whole and their step-mean forces, extremes and phasors per cycle, the
    energy ledger and how it ended."""

    response: Response
    window: Response
    step_force: np.ndarray
    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    snapshots: list
    window_work: float
    cycles_done: float
    message: str = ""
    marks: tuple = ()


@dataclass(frozen=True, eq=False, slots=True)
class Mark:
    """The last window of cycles before a mark: its samples, step-mean forces, friction work [J], extremes of the output
    per cycle (c, 2), the ledger there, and the march as it stood (`after`), to go on from."""

    window: Response
    step_force: np.ndarray
    work: float
    amplitudes: np.ndarray
    ledger: dict
    after: object = None


def _response(rows, number, dt, modes, drive) -> Response:
    """Histories of the samples with step numbers `number` (k,)."""
    n = modes.omega.size
    return histories(
        modes,
        drive,
        number * dt,
        (rows[:, :n], rows[:, n : 2 * n]),
        rows[:, 2 * n : 2 * n + 4].T,
        {"ledger": rows[:, [2 * n + 6, 2 * n + 5, 2 * n + 7, 2 * n + 8]].T},
    )


def modal_arrays(modes: ModalBasis, prop) -> ModalArrays:
    """The ModalArrays of a basis and its Propagator."""
    damping = np.zeros((0, 0)) if modes.damping is None else modes.damping
    own = (
        modes.omega,
        2 * modes.zeta * modes.omega,
        modes.slide,
        modes.base,
        modes.output,
        damping,
        prop.free,
        prop.push,
        prop.dense,
        prop.reach,
        prop.loss,
        prop.dense_loss,
    )
    arrays = [np.array(v, float, order="C") for v in own]
    numbers = float(prop.dt), float(prop.beta[0, 0]), float(modes.mass)
    return ModalArrays(*arrays, *numbers, np.zeros((3, modes.omega.size)))


def _runner(model):
    """The class that marches a model: Run, or its own."""
    return getattr(model, "runner", None) or Run


def warm_up(modes: ModalBasis, drive: SineDrive, model: ContactModel, say=None) -> None:
    """Load the compiled loop of a model, or compile it, by a march of no steps; say: told before it compiles."""
    runner = _runner(model)
    kind = (
        (
            model.kind,
            model.laws,
            model.loading,
            modes.damping is None,
            any(one.mate for one in model.joints),
        )
        if runner is Run
        else None
    )
    if kind not in _WARM:
        run = runner(modes, drive, model, 4, np.inf, load_kernels(say))
        run.cycle(0, 0, [])
        _WARM.update({kind} - {None})


_WARM = set()  # kinds of patches that have marched: their code is there


def fresh(
    modes: ModalBasis, drive, model, steps_per_cycle: int, travel: float = np.inf, start=None
):
    """A Run of a model at its start, from rest or from `start`; travel [m]: of the output, where it ends."""
    return _runner(model)(modes, drive, model, steps_per_cycle, travel, load_kernels(), start)


def march(
    modes: ModalBasis,
    drive: SineDrive,
    model: ContactModel,
    cycles: float,
    steps_per_cycle: int,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    say=None,
    progress=None,
    start=None,
    marks=(),
    whole: bool = True,
    folds: bool = False,
    *,
    even: bool = False,
) -> MarchResult:
    """March for `cycles` drive cycles at `steps_per_cycle` steps from rest or from `start` (core.InitialState).

    window: whole cycles kept at the end; frames: snapshots of the interface during the last cycle; marks: numbers
    of whole cycles after which a Mark is kept besides; whole: False keeps nothing, samples and extremes, from
    before the last cycles of a run without marks; folds: of bonds behind shear modes extremes and phasors of all
    cycles are kept besides, and the sample of the largest slide; even: as `wanted` of `stored_samples_per_cycle`. The
    outcome is set for travel and where a step missed its residual or the motion is not finite (not_converged, `message`
    says what); Missing when a bond list overflows.
    """

    # samples: what is kept so far, `last` of it the cycles of the window; marks may be those of an interrupted march
    run = _runner(model)(modes, drive, model, steps_per_cycle, travel, load_kernels(say), start)
    total = round(cycles * steps_per_cycle)
    samples = Samples(deque(maxlen=max(window, 2)))
    last = samples.last
    snapshots = []
    asked = {round(mark * steps_per_cycle) for mark in marks}
    slot = slot_of(
        run,
        (total, steps_per_cycle, window, frames, whole, *sorted(asked)),
        samples,
        lambda: fresh(modes, drive, model, steps_per_cycle, travel, start),
    )
    found = [mark_of(*one, one[0]) for one in samples.marks]
    behind = total - max(window, 2) * steps_per_cycle
    folds = folds and run.folds and not asked
    if folds and not run.folded(behind, samples):
        run = fresh(modes, drive, model, steps_per_cycle, travel, start)
        samples = Samples(last)
        # it ends before: once more, cycle by cycle
        folds = False
        whole = True
    elif not (
        folds
        or whole
        or asked
        or samples.again
        or run.passed(behind, lambda: slot.offer(run, samples))
    ):
        run = fresh(modes, drive, model, steps_per_cycle, travel, start)
        samples.again = True
    extremes = samples.extremes
    phasors = samples.phasors
    # capacity: how many more samples of cycles before the window may be kept;
    # picked: first step of a cycle -> its samples worth keeping
    capacity = samples.capacity
    whole = whole or bool(asked)
    picked = {}
    even = stored_samples_per_cycle(drive, cycles, wanted=even)
    # a fraction of a cycle comes first, the window is whole
    size = (total - run.done) % steps_per_cycle or steps_per_cycle
    while run.done < total and run.outcome is None:
        stop = min((mark for mark in asked if mark > run.done), default=total)
        for first, rows, works in run.cycles(size, stop, frames if stop == total else 0, snapshots):
            picks = (
                thinned(rows, run, even)
                if whole and capacity > 0 and rows.shape[1] > 1
                else [None] * len(works)
            )
            for k, work in enumerate(works):
                if whole and len(last) == last.maxlen and capacity > 0:
                    capacity -= _shelved(samples, run, last[0], picked.pop(last[0][0], None))
                last.append((first + k * steps_per_cycle, rows[k], work))
                picked[last[-1][0]] = picks[k]
            if whole or folds:
                extremes += extremes_of(rows, modes, run.prop.dt)
                phasors += phasors_of(rows, modes, first, steps_per_cycle)
        if run.done in asked:
            samples.marks.append((run.fork(run.drive), list(last)[-window:], extremes[-window:]))
            found.append(mark_of(*samples.marks[-1], samples.marks[-1][0]))
        size = steps_per_cycle
        left = (
            min((mark for mark in asked if mark > run.done), default=total) - run.done
        ) // size - last.maxlen
        if whole and run.repeats(left):
            capacity = _left_out(samples, run, left)
        if run.done < total:
            slot.offer(run, samples)
        if progress is not None:
            progress(run.done / total)
    run.check()
    if not (whole or folds):
        extremes = ends_of(last, run)
        phasors = []
    end = mark_of(run, list(last)[-window:], extremes)
    rows, start = _joined(list(last))
    number = np.concatenate([*samples.kept_at, start + np.arange(len(rows))])
    full = run.response(np.concatenate([*samples.kept, rows]), number)
    return MarchResult(
        full,
        end.window,
        end.step_force,
        end.amplitudes,
        np.array(phasors),
        end.ledger,
        run.outcome,
        snapshots,
        end.work,
        run.done / steps_per_cycle,
        run.message,
        tuple(found),
    )


def _shelved(samples: Samples, run, cycle, pick=None) -> int:
    """Keep what is worth it of a cycle (first step, rows, work) that is none of the last ones; how many samples. pick:
    their numbers where they are known."""
    first, rows, _ = cycle
    pick = thinned(rows[None], run)[0] if pick is None else pick
    samples.early(rows[pick], first + pick)
    return len(pick)


def _left_out(samples: Samples, run, count: int) -> int:
    """Go on by `count` cycles that are as the last one; the samples that may be kept yet.

    What is kept of them are the samples of that cycle, with the sums that have grown since.
    """
    first, rows, _ = samples.last[-1]
    for cycle in samples.last:
        if samples.capacity > 0:
            _shelved(samples, run, cycle)
    samples.last.clear()
    samples.extremes += [samples.extremes[-1]] * count
    samples.phasors += [samples.phasors[-1]] * count
    pick = thinned(rows[None], run)[0]
    begin = 2 * run.modes.omega.size + 6
    shown = np.arange(1, 1 + min(count, -(-max(0, samples.capacity) // len(pick))))[:, None]
    # friction work, and what is dissipated and created, since the start
    sums = slice(begin, begin + 3)
    later = np.tile(rows[pick], (len(shown), 1))
    later[:, sums] += np.repeat(shown * (rows[-1, sums] - rows[0, sums]), len(pick), axis=0)
    samples.early(later, (first + pick + run.prop.steps * shown).ravel())
    run.leave_out(count)
    return samples.capacity


def ends_of(cycles, run) -> list:
    """(smallest, largest) output [m] of each of the cycles (first step, rows, work)."""
    return [one for _, rows, _ in cycles for one in extremes_of(rows[None], run.modes, run.prop.dt)]


def mark_of(run, cycles, extremes, after=None) -> Mark:
    """The Mark of the cycles (first step, rows, work [J]) that end here.

    extremes: (smallest, largest) output [m] of each cycle so far; after: the march to go on with.
    """
    rows, first = _joined(cycles)
    return Mark(
        run.response(rows, first + np.arange(len(rows))),
        rows[:-1, 2 * run.modes.omega.size + 4].copy(),
        sum(work for _, _, work in cycles),
        np.array(extremes),
        run.book(),
        after,
    )


def _joined(parts) -> tuple:
    """Rows of successive cycles without their shared samples, and the number of the first step."""
    return np.concatenate([rows[:-1] for _, rows, _ in parts] + [parts[-1][1][-1:]]), parts[0][0]


class Run:
    """The arrays of one march and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        self.modes = modes
        self.drive = drive
        self.model = model
        self.travel = travel
        self.loops = loops
        self.prop = propagator(modes, drive, steps_per_cycle, getattr(model, "rows", None))
        self.contact = model.build()
        self.state = np.zeros((2, modes.omega.size))
        if start is not None:
            self.state[:] = start.z, start.v
        self.ledger = np.zeros(9)
        self.done = 0
        self.outcome = None
        self.message = ""
        self.totals = np.zeros(3)
        self.second = np.zeros(2)  # friction work off the samples, and what went to and fro [J]
        self.ledger[0] = self.motion()  # what is released at the start counts as work in
        self.modal_system = modal_arrays(modes, self.prop)
        self.faces, self.load = (
            faces_of(model, self.prop, self.modal_system, modes.mass),
            self._pressing(),
        )
        self.width = 2 * modes.omega.size + 7 + EACH * len(model.joints) + 5 * bool(model.loading)
        if model.joints or model.loading:
            self.ledger[0] += self.strained()
        self.periodic = (
            self.prop.tables(drive, 0, steps_per_cycle) if isinstance(drive, SineDrive) else None
        )
        # of `repeats`: states at the last look and one cycle before the next, their sizes; the books a cycle before
        self.looks = np.zeros((3, sum(map(len, self._carried()))))
        self.books = np.zeros(14)
        self.change = np.inf

    def fork(self, drive):
        """A copy of the march as it stands that goes on by itself, under another drive."""
        twin = copy(self)
        twin.drive = drive
        twin.periodic = None
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(twin, name, value.copy())
        twin.contact, twin.faces, twin.load = map(
            arrays.copied, (self.contact, self.faces, self.load)
        )
        return twin

    def _carried(self) -> list:
        """What the march carries from one step to the next, as rows of numbers of one kind each: coordinates and rates
        over the drive's frequency, then the memories. [] of one that no period brings back."""
        model = self.model
        rubs = arrays.carried(self.contact, getattr(model, "element", None) or free_model().element)
        if self.periodic is None or rubs is None or getattr(model, "load", None) is not None:
            return []
        beside = (
            [
                arrays.memory_rows(one.element, row[: one.element.memory.size])
                for one, row in zip(model.joints, self.faces.mem)
            ]
            if model.joints
            else []
        )
        return [np.append(self.state[0], self.state[1] / self.drive.omega), *rubs, *chain(*beside)]

    def _sums_so_far(self) -> np.ndarray:
        """The ledger, the sums of `_sums` and the second book, (14,)."""
        return np.concatenate([self.ledger, self.totals, self.second])

    def repeats(self, left: int) -> bool:
        """Whether the motion has become periodic, at the end of a cycle, so that `left` more may be left out.

        Asked for at the end of every cycle, or of those that `dynamics.periodicity.until_look` names.
        """
        number = self.done // self.prop.steps
        size = self.looks.shape[1]
        if not size or self.periodic is None or not (looked_at(number) or looked_at(number + 1)):
            return False
        rows = self._carried()
        now = np.concatenate(rows)
        if not looked_at(number):
            self.looks[1], self.books = now, self._sums_so_far()
            return False
        sizes = np.repeat([np.abs(row).max(initial=0.0) for row in rows], [*map(len, rows)])
        self.looks[2] = np.maximum(self.looks[2], sizes)
        scale = np.where(self.looks[2] > 0, self.looks[2], 1.0)
        change, last = (float(np.max(np.abs(now - then) / scale)) for then in self.looks[:2])
        before = self.change
        self.change = change
        self.looks[0] = now
        known = left > 0 and number >= 4 * APART  # two changes between looks
        return (
            known
            and max(change, last) <= REPEATS
            and ahead(change, before, left, number) <= REPEATS
        )

    def leave_out(self, count: int) -> None:
        """Go on by `count` cycles that are as the last one, right after `repeats`."""
        grown = count * (self._sums_so_far() - self.books)
        self.ledger[SUMS] += grown[SUMS]
        self.totals += grown[9:12]
        self.second += grown[12:]
        self.done += count * self.prop.steps

    def placed(self, place, rate) -> None:
        """Go on from the coordinates place and rates (n,) at the start of a cycle of a drive that repeats, the contact
        slid there slowly."""
        path = np.array([self.modes.slide @ self.state[0], self.modes.slide @ place])
        if path[0] != path[1]:
            self._slid(path)
        self.state[:] = (place, rate)
        self.done = 0

    def _slid(self, path) -> None:
        """Move the memory of the contact along a slide, path (2,) [m], in a second."""
        self.loops.follow_path(
            path,
            1.0,
            self.model.kind,
            self.contact,
            GOAL * self.model.limit,
            np.zeros((2, 2)),
            np.zeros((2, 3)),
        )

    def books_anew(self) -> None:
        """Begin the books here, with the energies that are there, at the start of a cycle of a drive that repeats."""
        self.ledger[:] = 0.0
        self.totals[:] = 0.0
        self.second[:] = 0.0
        self.done = 0
        self.ledger[0] = self.motion() + self.strained()

    def mark(self, cycles: int, window: int) -> Mark:
        """The Mark of the last `window` of `cycles` more cycles."""
        parts = deque(maxlen=window)
        for _ in range(cycles):
            parts.append(self.cycle(self.prop.steps, 0, []))
            if self.outcome is not None:
                break
        return mark_of(self, list(parts), ends_of(parts, self))

    def table(self, count: int) -> tuple:
        """(table of `propagator.tables`, row of the next step in it) for `count` steps from here."""
        if self.periodic is not None:
            return self.periodic, self.done % len(self.periodic)
        return self.prop.tables(self.drive, self.done, max(count, 1)), 0

    def response(self, rows, number) -> Response:
        """Histories of the samples with step numbers `number` (k,)."""
        out = _response(rows, number, self.prop.dt, self.modes, self.drive)
        return self._beside(out, rows) if hasattr(self.model, "patch") else out

    def _beside(self, out, rows) -> Response:
        """Histories with the elements beside the first: `extra` has slides, slide_rates, forces, slips (k, i) of the
        interfaces and spring_forces (k, s), and lateral_slides and so on (k, i) of those in a plane, 0 of others."""
        modes = self.modes
        faces = self.faces
        parts, (ports, rubs, mates) = self._elements(rows), faces.of
        second = mates < np.arange(mates.size)
        rubs = (rubs == 1) & ~second
        push = -np.einsum("ke,en->kn", parts[:, :, 2], faces.rows[ports]) / modes.mass
        if self.model.patch is None:
            # of the first element, counted already
            push += np.outer(out.force, modes.slide) / modes.mass
        extra = out.extra | {"spring_forces": parts[:, ~(rubs | second), 2]}
        names = ("slides", "slide_rates", "forces", "slips")
        if rubs.any():
            extra |= {name: parts[:, rubs, k] for k, name in enumerate(names)}
        for k, name in enumerate(names if second.any() else ()):
            column = extra[f"lateral_{name}"] = np.zeros((len(rows), rubs.sum()))
            column[:, mates[second]] = parts[:, second, k]
        return replace(out, acceleration=out.acceleration + push @ modes.output, extra=extra)

    def _elements(self, rows) -> np.ndarray:
        """The columns of the elements (k, e, EACH) in booked rows, or in those of the loop (`_moved`)."""
        count = len(self.model.joints)
        begin = 2 * self.modes.omega.size + 7 + rows.shape[1] - self.width
        return rows[:, begin : begin + EACH * count].reshape(len(rows), count, EACH)

    def passed(self, steps: int, tell=None) -> bool:
        """March to the step of this number in long pieces, of which nothing is kept; whether the run went on so far.
        tell: called after each."""
        size = self.prop.steps
        while self.done < steps and self.outcome is None:
            look = (until_look(self.done // size) + self.done // size) * size - self.done
            rows = self._moved(min(steps - self.done, AT_ONCE, PIECES * size, look), 0, [])
            self.totals += self._parts(rows).sum(axis=1)
            left = (steps - self.done) // size
            if self.done % size == 0 and self.outcome is None and self.repeats(left):
                self.leave_out(left)
            if tell is not None:
                tell()
        return self.outcome is None

    @property
    def folds(self) -> bool:
        """Whether `folded` marches it: bonds behind shear modes alone, under a load that stays."""
        return type(self) is Run and self.model.tuple_of is arrays.Sheared and not self.model.joints

    def folded(self, steps: int, samples: Samples) -> bool:
        """March to the step of this number as `passed` does, and keep the extremes and phasors of its cycles and the
        sample of the largest slide."""
        n = 2 * self.modes.omega.size
        around = self.prop.steps
        table = None
        far = np.zeros(self.width + 3)
        at = np.zeros(1, np.int64)
        number = -1
        kernels = load(PASSING)
        workspace = np.zeros(n + 7), far, at, np.zeros((14, kernels.BLOCK))
        while self.done < steps and self.outcome is None:
            size = (steps - self.done) % around or around
            count = (
                min((steps - self.done) // size, until_look(self.done // around))
                if size == around
                else 1
            )
            seen, sums, begin, (rows, row) = (
                np.zeros((count, 4)),
                np.zeros(5),
                self.done,
                self.table(size * count),
            )
            if rows is not table:
                table = rows
                held = kernels.passing.held(
                    self.state,
                    self.modal_system,
                    rows,
                    self.contact,
                    GOAL * self.model.limit,
                    float(self.model.limit),
                    float(self.travel),
                    self.ledger,
                    self.totals,
                    *workspace,
                )
            phase = 2 * np.pi * (begin % around + np.arange(size + 1)) / around
            at[0] = -1
            trace = np.array([0 * phase, 0 * phase, np.cos(phase), np.sin(phase)])
            did, status = kernels.passing.call_with_bound_args(held, row, sums, trace, seen)
            self.done = begin + did
            number = begin + int(at[0]) - row if at[0] >= 0 else number
            self.totals += sums[:3]
            self.second += sums[3:]
            self._judge(status)
            samples.extremes += [*zip(*seen[:, :2].T.tolist())]
            samples.phasors += (seen[:, 2] + 1j * seen[:, 3]).tolist()
            left = (steps - self.done) // around
            if self.done % around == 0 and self.outcome is None and self.repeats(left):
                self.leave_out(left)
                samples.extremes += samples.extremes[-1:] * left
                samples.phasors += samples.phasors[-1:] * left
        if number >= 0:
            samples.early(far[None], np.array([number]))
        return self.outcome is None

    def cycles(self, size: int, stop: int, frames: int, snapshots: list) -> list:
        """March a cycle of `size` steps, or some whole ones at once, none beyond the step `stop` or the next look of
        `repeats`; with frames the last of them by itself, in so many pieces with a snapshot after each.

        Returns parts of cycles (k,): (first step, rows (k, steps + 1, width), friction works (k,) [J]), the whole ones
        and what was begun of the next where the run ends.
        """
        first = self.done
        n = 2 * self.modes.omega.size + 6
        whole = self.prop.steps
        together = min(
            PIECES, AT_ONCE // whole, (stop - first) // whole, until_look(-(-first // whole))
        )
        if frames and first + together * whole == stop:
            together -= 1
        count = max(1, together) if size == whole else 1
        rows = self._moved(count * size, frames if first + size == stop else 0, snapshots)
        works = self._works(rows)
        booked = np.concatenate([rows[:, :n], self._sums(rows).T, rows[:, n:]], axis=1)
        done = (len(rows) - 1) // size if size else 0
        out = (
            [
                (
                    first,
                    sliding_window_view(booked, size + 1, axis=0)[::size].swapaxes(1, 2),
                    works[: done * size].reshape(done, size).sum(axis=1),
                )
            ]
            if done
            else []
        )
        if done * size < len(rows) - 1 or not done:
            out.append(
                (
                    first + done * size,
                    booked[None, done * size :],
                    works[None, done * size :].sum(axis=1),
                )
            )
        return out

    def cycle(self, size: int, frames: int, snapshots: list) -> tuple:
        """March `size` steps as one cycle: (first step, rows (steps + 1, width), friction work [J])."""
        ((first, rows, works),) = self.cycles(size, self.done + size, frames, snapshots)
        return first, rows[0], works[0]

    def _moved(self, size: int, frames: int, snapshots: list) -> np.ndarray:
        """The rows (steps + 1, width) of `size` steps as the loop writes them; arguments as `cycles`."""
        parts = []
        edges = np.linspace(0, size, max(min(frames, size), 1) + 1).round().astype(int)
        for piece in np.diff(edges) if size else [0]:
            rows = np.empty((piece + 1, self.width))
            rows[-1] = 0.0  # what belongs to the step after the last one is nothing yet
            kept = keep(self.contact, *self._moving())
            begin = self._before_a_fling()
            did, status = self._steps(int(piece), rows)
            while status == FULL:
                self.contact = lengthened(
                    self.contact, kept, f"at step {self.done + did}", *self._moving()
                )
                did, status = self._steps(int(piece), rows)
            if begin and self._flung(rows[: did + 1]):
                for array, old in zip((*self.contact, *self._moving()), begin):
                    array[...] = old
                did = self._steps(did - 1, rows)[0]
                status = 1
                self.message = (
                    f"beyond a displacement of {format_length(self._out(rows[did]), 3)} the motion grows without "
                    "limit, because the force of the softening spring no longer pulls the block back; the "
                    "run ended there"
                )
            self.done += did
            parts.append(rows[: did + 1])
            self._judge(status)
            if frames:
                snapshots.append(self._snapshot(rows[did]))
            if self.outcome is not None:
                break
        rows = (
            np.concatenate([part[:-1] for part in parts[:-1]] + parts[-1:])
            if len(parts) > 1
            else parts[0]
        )
        self.second += self._sampled(rows).sum(), np.abs(self._works(rows)).sum()
        return rows

    def _before_a_fling(self) -> tuple:
        """Copies of all that steps change, beside a spring that bends."""
        springs = any(one.potential is not None for one in self.model.joints)
        return tuple(array.copy() for array in (*self.contact, *self._moving())) if springs else ()

    def _flung(self, rows) -> bool:
        """Whether the last step of the rows ends FLUNG times beyond the stop, or nowhere."""
        return len(rows) > 1 and not (
            self._out(rows[-1]) <= FLUNG * self.travel and np.isfinite(rows[-1]).all()
        )

    def _out(self, row) -> float:
        """Distance of the output from rest [m] in a row."""
        with np.errstate(invalid="ignore", over="ignore"):
            return abs(float(self.modes.output @ row[: self.modes.omega.size]))

    def _steps(self, count: int, rows) -> tuple:
        """March `count` steps into rows (count + 1, width): (steps done, status)."""
        table, row = self.table(count)
        return self.loops.march(
            self.model,
            row,
            count,
            self.state,
            self.modal_system,
            table,
            self.contact,
            self.faces,
            self._load(count),
            float(self.travel),
            self.ledger,
            rows,
        )

    def _pressing(self):
        """The load at the start: one that stays."""
        return arrays.Steady(np.zeros(0))

    def _load(self, count: int):
        """What the loop is told of the load in the next steps."""
        return self.load

    def _sums(self, rows) -> np.ndarray:
        """Friction work, the energy dissipated and that created since the start (3, steps + 1) [J] at the rows; `cycle`
        puts them into the rows as further columns."""
        parts = self._parts(rows)
        sums = np.empty((3, parts.shape[1] + 1))
        sums[:, 0] = self.totals
        np.cumsum(parts, axis=1, out=sums[:, 1:])
        sums[:, 1:] += self.totals[:, None]
        self.totals = sums[:, -1].copy()
        return sums

    def _parts(self, rows) -> np.ndarray:
        """What `_sums` adds up, of the steps between the rows (3, steps) [J]: the net of the work and of what the
        interface stores."""
        n = 2 * self.modes.omega.size
        parts = np.zeros((3, len(rows) - 1))
        parts[0] = self._works(rows)
        lost = parts[0] - np.diff(rows[:, n + 5])
        if lost.min(initial=0.0) == 0.0:
            parts[1] = lost
            return parts
        # of the step solve, and of the slide's last digit
        noise = self.model.limit * (
            1e-12 * np.abs(np.diff(rows[:, n])) + 1e-15 * np.abs(rows[:-1, n])
        )
        np.copyto(parts[1], lost, where=lost > -noise)
        np.copyto(parts[2], -lost, where=lost < -noise)
        return parts

    def _works(self, rows) -> np.ndarray:
        """Friction work [J] of the steps between the rows."""
        return rows[:-1, 2 * self.modes.omega.size + 6]

    def _sampled(self, rows) -> np.ndarray:
        """Friction work [J] of the steps between the rows, off their slides and forces alone.

        What blows take at the end of a step, from slides that stop or hold, has no slide to be read off: where all that
        rubs is set-valued it counts.
        """
        n = 2 * self.modes.omega.size
        model = self.model
        smooth = not model.joints or getattr(model, "patch", None) is not None
        out = sampled_work(rows[:, n], rows[:, n + 2]) if smooth else np.zeros(len(rows) - 1)
        blows = rows[:-1, n + 6].copy()
        for one, part in zip(model.joints, self._elements(rows).transpose(1, 2, 0)):
            if one.potential is None:
                slide, _, force, _, mean = part
                steady = bool(one.element.kernels)
                out += sampled_work(slide, force, None if steady else mean[:-1])
                blows -= mean[:-1] * np.diff(slide)
                smooth |= steady
        return out if smooth else out + blows

    def _moving(self) -> tuple:
        """The arrays that a step changes besides those of the contact."""
        faces = self.faces
        return self.state, self.ledger, *faces[:-1], *(faces.stops if self.model.joints else ())

    def _judge(self, status: int) -> None:
        if status == 1:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        if status == 3:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the computed motion is not a finite number; raise "
                "accuracy.steps_per_cycle"
            )
        if status == UNFIT:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the method could not determine which points are in contact; raise "
                "accuracy.steps_per_cycle"
            )

    def _snapshot(self, row) -> dict:
        n = 2 * self.modes.omega.size
        return {
            "time": self.done * self.prop.dt,
            "slide": row[n],
            "rate": row[n + 1],
            "force": row[n + 2],
            "slip": row[n + 3],
        } | self.model.shown(self.contact)

    def check(self) -> None:
        """Mark the run not_converged when a step missed its residual; what was computed is kept."""
        if self.ledger[7]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[7])} of {self.done} time steps have an error of the friction force "
                f"above the permitted {GOAL:.0e} of the friction limit; raise accuracy.steps_per_cycle"
            )

    def watched(self, rows) -> tuple:
        """Slide rates (k, i) [m/s] and slips (k, i) [m] of the interfaces in booked rows."""
        n = 2 * self.modes.omega.size
        parts = self._elements(rows)
        return np.column_stack([rows[:, n + 1], parts[:, :, 1]]), np.column_stack(
            [rows[:, n + 3], parts[:, :, 3]]
        )

    def motion(self) -> float:
        """Kinetic and elastic energy of the modes [J]."""
        return (
            0.5
            * self.modes.mass
            * float(np.sum(self.state[1] ** 2 + (self.modes.omega * self.state[0]) ** 2))
        )

    def strained(self) -> float:
        """Energy stored in what rubs, in springs and in the contact that presses [J]."""
        n = 2 * self.modes.omega.size
        rows = np.zeros((1, self.width))
        self.loops.march(
            self.model,
            0,
            0,
            self.state,
            self.modal_system,
            np.zeros((1, 4 * n + 3)),
            self.contact,
            self.faces,
            self._load(0),
            np.inf,
            np.zeros(9),
            rows,
        )
        springs = [
            one.potential(part[0])
            for one, part in zip(self.model.joints, self._elements(rows)[0])
            if one.potential is not None
        ]
        normal = rows[0, -3] if self.model.loading else 0.0  # of the preloaded contact
        return float(rows[0, n + 5] + normal + sum(springs))

    def book(self) -> dict:
        """The energy ledger [J]."""
        names = (
            "work_in",
            "viscous",
            "power",
            "friction",
            "peak_stored",
            "iterations",
            "worst_iterations",
        )
        book = dict(zip(names, map(float, self.ledger))) | {
            "stored": self.motion() + self.strained()
        }
        book |= {
            "booked": float(self.ledger[8]),
            "sampled": float(self.second[0]),
            "passed": float(self.second[1]),
        }
        if hasattr(self.contact, "status"):
            status = getattr(self.contact, "statuses", self.contact.status[None])
            totals = status.sum(axis=0)
            book |= {
                "created": float(totals[STATUS.created]),
                "dissipated": float(totals[STATUS.dissipated]),
                "substeps": float(totals[STATUS.n_extra]),
                "strips": float(status[:, STATUS.max_strips].max()),
            }
        return book
