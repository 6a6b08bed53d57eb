"""The march of a model in pieces of one or some drive cycles, and what is kept of it."""

from collections import deque
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...compiled import load
from ...core import ModalBasis, Outcome, Response, SineDrive
from ...formatting import format_length
from ...friction.bonds.list_rows_kernels import STATUS
from ...friction.path_work import sampled_work
from ...structure.drive_sizes import choose_samples_per_cycle
from ..checkpoint import MarchSamples, open_checkpoint
from ..cycles import find_cycle_extremes, find_cycle_phasors, select_cycle_samples
from ..integrated import make_histories
from ..interfaces import arrays
from ..interfaces.arrays import ModalArrays
from ..ledger import LEDGER
from ..periodicity import (
    FIRST_CHECK,
    bound_remaining_change,
    cycles_to_next_check,
    is_checked_after,
)
from ..propagator import make_propagator
from .capacity import copy_state, enlarge_list
from .faces import STEP_TOL, make_faces
from .models import ContactModel, frictionless_model, load_instances

# Status of `loop_kernels.march` if a list of bonds is full, and if no contact set fits the motion.
MEMORY_FULL = 2
NO_CONTACT_SET = 4
# A step has not followed the motion if its displacement exceeds the travel by this factor.
DIVERGED_FACTOR = 10.0
ELEMENT_COLUMNS = 5  # columns of an element in a row, as in `faces_kernels`
MAX_PIECE_STEPS = 8000  # number of steps of a piece of a march
MAX_PIECE_CYCLES = 16  # number of cycles of a piece of a march
FOLDED_KERNELS = "dynamics.march.passing_kernels"
PERIODIC_TOL = 1e-12  # change of a periodic motion in all cycles that are left, over its size
# Positions in the ledger that grow from cycle to cycle.
SUMS = [
    LEDGER.drive_work,
    LEDGER.viscous_loss,
    LEDGER.drive_power,
    LEDGER.friction_loss,
    LEDGER.n_iterations,
    LEDGER.n_unconverged,
    LEDGER.friction_work,
]


@dataclass(frozen=True, eq=False, slots=True)
class MarchResult:
    """Samples, cycles, energies and outcome of a march.

    - `response`: the samples that are kept.
    - `window`, `step_force`, `window_work`: samples of the last cycles, mean forces of their steps [N] and
      friction work [J].
    - `amplitudes` (c, 2), `phasors` (c,): extremes and phasor of the output in each cycle [m].
    - `ledger`: energies [J] by name, as `Run.energy_balance` returns them.
    - `outcome`, `message`: how the march ended, None and "" if it reached its last step.
    - `snapshots`: states of the interface in the last cycle.
    - `cycles_done`: number of cycles.
    - `marks`: the `Mark` of each number of cycles that was asked for.
    """

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
    """Last cycles of a march at a requested number of cycles, and the march at that time.

    - `window`, `step_force`, `work`, `amplitudes`, `ledger`: as in `MarchResult`.
    - `after`: the `Run` to continue from.
    """

    window: Response
    step_force: np.ndarray
    work: float
    amplitudes: np.ndarray
    ledger: dict
    after: object = None


def _make_response(rows, number, dt, modes, drive) -> Response:
    """Return the histories of samples.

    Parameters
    ----------
    rows : (k, w) array
        Samples, as the loop writes them.
    number : (k,) array
        Numbers of their steps.
    dt : float
        Length of the step [s].
    modes : ModalBasis
    drive : float
        Acceleration of the base [m s-2].
    """
    n = modes.omega.size
    return make_histories(
        modes,
        drive,
        number * dt,
        (rows[:, :n], rows[:, n : 2 * n]),
        rows[:, 2 * n : 2 * n + 4].T,
        {"ledger": rows[:, [2 * n + 6, 2 * n + 5, 2 * n + 7, 2 * n + 8]].T},
    )


def make_modal_arrays(modes: ModalBasis, prop) -> ModalArrays:
    """Return the `ModalArrays` of a basis and its propagator."""
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


def _run_class(model):
    """Return the class that marches a model: `Run`, or the one that the model names."""
    return getattr(model, "runner", None) or Run


def warm_up(modes: ModalBasis, drive: SineDrive, model: ContactModel, say=None) -> None:
    """Load the compiled loop of a model, or compile it, by a march without steps.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    say : callable or None
        Callback that is told before the loop is compiled.
    """
    runner = _run_class(model)
    kind = None
    if runner is Run:
        slides_in_plane = any(joint.mate for joint in model.joints)
        is_damping_diagonal = modes.damping is None
        kind = model.kind, model.laws, model.loading, is_damping_diagonal, slides_in_plane
    if kind not in _LOADED_KINDS:
        run = runner(modes, drive, model, 4, np.inf, load_instances(say))
        run.march_cycle(0, 0, [])
        _LOADED_KINDS.update({kind} - {None})


_LOADED_KINDS = set()  # kinds of patches that have marched, so that their compiled code is loaded


def start_run(
    modes: ModalBasis, drive, model, steps_per_cycle: int, travel: float = np.inf, start=None
):
    """Return the march of a model at its start.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    steps_per_cycle : int
    travel : float
        Largest displacement of the output [m].
    start : core.InitialState or None
        Rest if None.

    Returns
    -------
    Run
    """
    return _run_class(model)(modes, drive, model, steps_per_cycle, travel, load_instances(), start)


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
    *,
    keeps_samples: bool = True,
    keeps_extremes: bool = False,
    even: bool = False,
) -> MarchResult:
    """March a model over cycles of its drive, from rest or from an initial state.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
        Or another drive; a motion is only found to be periodic under a sine.
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    cycles : float
        Number of cycles of the drive; a fraction of a cycle comes first.
    steps_per_cycle : int
    window : int
        Number of whole cycles at the end whose samples are all kept.
    travel : float
        Largest displacement of the output [m], beyond which the march ends.
    frames : int
        Number of snapshots of the interface during the last cycle.
    say : callable or None
        Callback that is told if the loop has to be compiled first.
    progress : callable or None
        Callback that is told the fraction of the march that is done.
    start : core.InitialState or None
    marks : sequence of float
        Numbers of whole cycles after which a `Mark` is kept.
    keeps_samples : bool
        Whether samples and extremes from before the last cycles are kept; always true with marks.
    keeps_extremes : bool
        Whether extremes and phasors of all cycles are kept for bonds behind shear modes although `keeps_samples`
        is false, and the sample of the largest slide.
    even : bool
        The argument `needs_history` of `choose_samples_per_cycle`.

    Returns
    -------
    MarchResult
        The outcome is set if the travel was exceeded, and if a step missed its residual or the motion is not finite.

    Raises
    ------
    Missing
        If a list of bonds becomes too long.
    """
    run = _run_class(model)(
        modes, drive, model, steps_per_cycle, travel, load_instances(say), start
    )
    n_last = max(window, 2)
    mark_steps = sorted({round(mark * steps_per_cycle) for mark in marks})
    plan = _Plan(round(cycles * steps_per_cycle), steps_per_cycle, window, frames, mark_steps)
    samples = MarchSamples(deque(maxlen=n_last))

    def restart():
        return start_run(modes, drive, model, steps_per_cycle, travel, start)

    checkpoint = open_checkpoint(
        run,
        (plan.n_steps, steps_per_cycle, window, frames, keeps_samples, *mark_steps),
        samples,
        restart,
    )
    before_last = plan.n_steps - n_last * steps_per_cycle
    keeps_samples = keeps_samples or bool(mark_steps)
    keeps_folded = keeps_extremes and run.can_fold and not mark_steps
    if keeps_folded:
        if not run.march_folded(before_last, samples):
            # The march ends before its last cycles, so it is repeated cycle by cycle with all samples.
            run = restart()
            samples = MarchSamples(samples.last)
            keeps_folded = False
            keeps_samples = True
    elif not keeps_samples and not samples.is_restarted:
        if not run.march_without_samples(
            before_last, lambda: checkpoint.write_if_due(run, samples)
        ):
            run = restart()
            samples.is_restarted = True
    n_even = choose_samples_per_cycle(drive, cycles, needs_history=even)
    recorder = _Recorder(
        samples,
        n_even,
        keeps_samples=keeps_samples,
        keeps_extremes=keeps_samples or keeps_folded,
    )
    snapshots = _march_recorded(run, recorder, plan, checkpoint, progress)
    run.check_steps()
    return _make_result(run, recorder, plan, snapshots)


class _Plan(NamedTuple):
    """Number of steps of a march and of a cycle, cycles of the window, snapshots of the last cycle, steps of marks."""

    n_steps: int
    steps_per_cycle: int
    window: int
    frames: int
    mark_steps: list

    def next_mark(self, done: int) -> int:
        """Return the number of steps at the next mark, or at the end."""
        return min((step for step in self.mark_steps if step > done), default=self.n_steps)


class _Recorder:
    """Recorder of a march: all samples of the last cycles, and selected earlier samples.

    - `samples`: the `checkpoint.MarchSamples` that are kept.
    - `keeps_samples`, `keeps_extremes`: whether samples from before the last cycles are kept, and extremes and phasors
      of all cycles.
    - `capacity`: number of samples from before the last cycles that may still be kept.
    """

    def __init__(
        self, samples: MarchSamples, n_even: int, *, keeps_samples: bool, keeps_extremes: bool
    ):
        self.samples = samples
        self.keeps_samples = keeps_samples
        self.keeps_extremes = keeps_extremes
        self.capacity = samples.capacity
        self._n_even = n_even
        self._picks = {}  # first step of a cycle -> numbers of its samples that are worth keeping

    def add(self, run, first: int, rows, works) -> None:
        """Add cycles (k, steps + 1, width) that start at step `first`, with their friction works (k,) [J]."""
        last = self.samples.last
        picks = [None] * len(works)
        if self.keeps_samples and self.capacity > 0 and rows.shape[1] > 1:
            picks = select_cycle_samples(rows, run, self._n_even)
        for k, work in enumerate(works):
            if self.keeps_samples and len(last) == last.maxlen and self.capacity > 0:
                pick = self._picks.pop(last[0][0], None)
                self.capacity -= _keep_samples(self.samples, run, last[0], pick)
            last.append((first + k * run.prop.steps, rows[k], work))
            self._picks[last[-1][0]] = picks[k]
        if self.keeps_extremes:
            self.samples.extremes += find_cycle_extremes(rows, run.modes, run.prop.dt)
            self.samples.phasors += find_cycle_phasors(rows, run.modes, first, run.prop.steps)

    def repeat_last(self, run, count: int) -> None:
        """Skip cycles that are equal to the last one."""
        self.capacity = _repeat_last_cycle(self.samples, run, count)


def _march_recorded(run, recorder: _Recorder, plan: _Plan, checkpoint, progress) -> list:
    """March to the end of a plan and record the cycles; return the snapshots of the last cycle.

    A motion that has become periodic is not marched on; see `Run.is_periodic`.
    """
    samples = recorder.samples
    snapshots = []
    # A fraction of a cycle comes first, so that the window has whole cycles.
    size = (plan.n_steps - run.done) % plan.steps_per_cycle or plan.steps_per_cycle
    while run.done < plan.n_steps and run.outcome is None:
        stop = plan.next_mark(run.done)
        frames = plan.frames if stop == plan.n_steps else 0
        for first, rows, works in run.march_cycles(size, stop, frames, snapshots):
            recorder.add(run, first, rows, works)
        if run.done in plan.mark_steps:
            cycles = list(samples.last)[-plan.window :]
            samples.marks.append((run.fork(run.drive), cycles, samples.extremes[-plan.window :]))
        size = plan.steps_per_cycle
        n_left = (plan.next_mark(run.done) - run.done) // size - samples.last.maxlen
        if recorder.keeps_samples and run.is_periodic(n_left):
            recorder.repeat_last(run, n_left)
        if run.done < plan.n_steps:
            checkpoint.write_if_due(run, samples)
        if progress is not None:
            progress(run.done / plan.n_steps)
    return snapshots


def _make_result(run, recorder: _Recorder, plan: _Plan, snapshots: list) -> MarchResult:
    """Return the result of a march that is done."""
    samples = recorder.samples
    extremes = (
        samples.extremes if recorder.keeps_extremes else read_output_extremes(samples.last, run)
    )
    phasors = samples.phasors if recorder.keeps_extremes else []
    end = make_mark(run, list(samples.last)[-plan.window :], extremes)
    rows, first = _join_cycles(list(samples.last))
    number = np.concatenate([*samples.early_numbers, first + np.arange(len(rows))])
    return MarchResult(
        response=run.make_response(np.concatenate([*samples.early_rows, rows]), number),
        window=end.window,
        step_force=end.step_force,
        amplitudes=end.amplitudes,
        phasors=np.array(phasors),
        ledger=end.ledger,
        outcome=run.outcome,
        snapshots=snapshots,
        window_work=end.work,
        cycles_done=run.done / plan.steps_per_cycle,
        message=run.message,
        marks=tuple(make_mark(*mark, mark[0]) for mark in samples.marks),
    )


def _keep_samples(samples: MarchSamples, run, cycle, pick=None) -> int:
    """Keep samples of a cycle (first step, rows, work) that is none of the last ones.

    Returns how many.

    `pick` has their numbers if they are known.
    """
    first, rows, _ = cycle
    pick = select_cycle_samples(rows[None], run)[0] if pick is None else pick
    samples.keep_early(rows[pick], first + pick)
    return len(pick)


def _repeat_last_cycle(samples: MarchSamples, run, count: int) -> int:
    """Skip `count` cycles that are equal to the last one.

    Returns how many samples may still be kept.

    The samples of the last cycle are kept again for the skipped ones, with the sums that have grown since.
    """
    first, rows, _ = samples.last[-1]
    for cycle in samples.last:
        if samples.capacity > 0:
            _keep_samples(samples, run, cycle)
    samples.last.clear()
    samples.extremes += [samples.extremes[-1]] * count
    samples.phasors += [samples.phasors[-1]] * count
    pick = select_cycle_samples(rows[None], run)[0]
    begin = 2 * run.modes.omega.size + 6
    shown = np.arange(1, 1 + min(count, -(-max(0, samples.capacity) // len(pick))))[:, None]
    # friction work, and what is dissipated and created, since the start
    sums = slice(begin, begin + 3)
    later = np.tile(rows[pick], (len(shown), 1))
    later[:, sums] += np.repeat(shown * (rows[-1, sums] - rows[0, sums]), len(pick), axis=0)
    samples.keep_early(later, (first + pick + run.prop.steps * shown).ravel())
    run.skip_cycles(count)
    return samples.capacity


def read_output_extremes(cycles, run) -> list:
    """Return the smallest and largest output [m] of each of the cycles (first step, rows, work)."""
    return [
        cycle_extreme
        for _, rows, _ in cycles
        for cycle_extreme in find_cycle_extremes(rows[None], run.modes, run.prop.dt)
    ]


def make_mark(run, cycles, extremes, after=None) -> Mark:
    """Return the `Mark` of the cycles (first step, rows, work [J]) that end here.

    Parameters
    ----------
    run : Run
    cycles : list of tuple
    extremes : list of tuple
        Smallest and largest output [m] of each cycle so far.
    after : Run or None
        The march to continue from.

    Returns
    -------
    Mark
    """
    rows, first = _join_cycles(cycles)
    return Mark(
        run.make_response(rows, first + np.arange(len(rows))),
        rows[:-1, 2 * run.modes.omega.size + 4].copy(),
        sum(work for _, _, work in cycles),
        np.array(extremes),
        run.energy_balance(),
        after,
    )


def _join_cycles(parts) -> tuple:
    """Return the rows of successive cycles without their shared samples, and the number of the first step."""
    return np.concatenate([rows[:-1] for _, rows, _ in parts] + [parts[-1][1][-1:]]), parts[0][0]


class Run:
    """State of a march: its arrays and the number of steps done.

    - `state` (2, n): coordinates and rates of the modes.
    - `contact`, `faces`, `load`: arrays of the contact, the elements and the load, in `interfaces.arrays`.
    - `ledger` (9,): energy balance of `loop_kernels.march`.
    - `totals` (3,): friction work, dissipated and created energy since the start [J].
    - `second` (2,): friction work from the samples, and sum of the absolute works of the steps [J].
    - `done`: number of steps that are done.
    - `outcome`, `message`: how it ended.
    """

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        self.modes = modes
        self.drive = drive
        self.model = model
        self.travel = travel
        self.loops = loops
        self.prop = make_propagator(modes, drive, steps_per_cycle, getattr(model, "rows", None))
        self.contact = model.build()
        self.state = np.zeros((2, modes.omega.size))
        if start is not None:
            self.state[:] = start.z, start.v
        self.ledger = np.zeros(9)
        self.done = 0
        self.outcome = None
        self.message = ""
        self.totals = np.zeros(3)
        # friction work from the samples, and energy exchanged in both directions [J]
        self.second = np.zeros(2)
        self.ledger[LEDGER.drive_work] = (
            self.find_modal_energy()
        )  # energy that is stored at the start counts as work input
        self.modal_system = make_modal_arrays(modes, self.prop)
        self.faces, self.load = (
            make_faces(model, self.prop, self.modal_system, modes.mass),
            self._initial_load(),
        )
        self.width = (
            2 * modes.omega.size + 7 + ELEMENT_COLUMNS * len(model.joints) + 5 * bool(model.loading)
        )
        if model.joints or model.loading:
            self.ledger[LEDGER.drive_work] += self.find_interface_energy()
        self.periodic = (
            self.prop.tables(drive, 0, steps_per_cycle) if isinstance(drive, SineDrive) else None
        )
        # `is_periodic` uses the states at the last check and one cycle before the next one, their sizes, and the
        # energies one cycle before.
        self.looks = np.zeros((3, sum(map(len, self._carried_state()))))
        self.books = np.zeros(14)
        self.change = np.inf

    def fork(self, drive):
        """Return a copy of the march as it is, which continues under another drive."""
        twin = copy(self)
        twin.drive = drive
        twin.periodic = None
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(twin, name, value.copy())
        twin.contact, twin.faces, twin.load = map(
            arrays.copy_arrays, (self.contact, self.faces, self.load)
        )
        return twin

    def _carried_state(self) -> list:
        """Return the state that the march carries to the next step, as rows of numbers of one kind.

        The first row has the coordinates and the rates over the frequency of the drive, the others the
        memories. The list is empty if no period brings the state back.
        """
        model = self.model
        element = getattr(model, "element", None) or frictionless_model().element
        memories = arrays.split_memory(self.contact, element)
        if self.periodic is None or memories is None or getattr(model, "load", None) is not None:
            return []
        rows = [np.append(self.state[0], self.state[1] / self.drive.omega), *memories]
        for k, joint in enumerate(model.joints):
            memory = self.faces.mem[k, : joint.element.memory.size]
            rows += arrays.split_element_memory(joint.element, memory)
        return rows

    def _sums_so_far(self) -> np.ndarray:
        """Return the ledger, the totals and the second energies, (14,)."""
        return np.concatenate([self.ledger, self.totals, self.second])

    def is_periodic(self, left: int) -> bool:
        """Return whether the motion has become periodic, so that `left` more cycles may be skipped.

        It is to be called at the end of every cycle, or of those that `dynamics.periodicity.cycles_to_next_check` names.
        """
        number = self.done // self.prop.steps
        size = self.looks.shape[1]
        if (
            not size
            or self.periodic is None
            or not (is_checked_after(number) or is_checked_after(number + 1))
        ):
            return False
        rows = self._carried_state()
        now = np.concatenate(rows)
        if not is_checked_after(number):
            self.looks[1], self.books = now, self._sums_so_far()
            return False
        sizes = np.repeat([np.abs(row).max(initial=0.0) for row in rows], [*map(len, rows)])
        self.looks[2] = np.maximum(self.looks[2], sizes)
        scale = np.where(self.looks[2] > 0, self.looks[2], 1.0)
        change, last = (float(np.max(np.abs(now - then) / scale)) for then in self.looks[:2])
        before = self.change
        self.change = change
        self.looks[0] = now
        # changes over two intervals between checks are known
        known = left > 0 and number >= 4 * FIRST_CHECK
        return (
            known
            and max(change, last) <= PERIODIC_TOL
            and bound_remaining_change(change, before, left, number) <= PERIODIC_TOL
        )

    def skip_cycles(self, count: int) -> None:
        """Skip `count` cycles that are equal to the last one, directly after `is_periodic`."""
        grown = count * (self._sums_so_far() - self.books)
        self.ledger[SUMS] += grown[SUMS]
        self.totals += grown[9:12]
        self.second += grown[12:]
        self.done += count * self.prop.steps

    def move_to(self, place, rate) -> None:
        """Move the march to coordinates and rates (n,) at the start of a cycle.

        The contact slides there slowly.
        """
        path = np.array([self.modes.slide @ self.state[0], self.modes.slide @ place])
        if path[0] != path[1]:
            self._slide_contact(path)
        self.state[:] = (place, rate)
        self.done = 0

    def _slide_contact(self, path) -> None:
        """Move the memory of the contact along a slide path (2,) [m] in a second."""
        self.loops.follow_path(
            path,
            1.0,
            self.model.kind,
            self.contact,
            STEP_TOL * self.model.limit,
            np.zeros((2, 2)),
            np.zeros((2, 3)),
        )

    def reset_balance(self) -> None:
        """Start the energy balance here, with the present energies, at the start of a cycle."""
        self.ledger[:] = 0.0
        self.totals[:] = 0.0
        self.second[:] = 0.0
        self.done = 0
        self.ledger[LEDGER.drive_work] = self.find_modal_energy() + self.find_interface_energy()

    def march_to_mark(self, cycles: int, window: int) -> Mark:
        """March more cycles and return the `Mark` of the last `window` of them."""
        parts = deque(maxlen=window)
        for _ in range(cycles):
            parts.append(self.march_cycle(self.prop.steps, 0, []))
            if self.outcome is not None:
                break
        return make_mark(self, list(parts), read_output_extremes(parts, self))

    def step_table(self, count: int) -> tuple:
        """Return a table of `propagator.tables` for the next steps, and the row of the first of them."""
        if self.periodic is not None:
            return self.periodic, self.done % len(self.periodic)
        return self.prop.tables(self.drive, self.done, max(count, 1)), 0

    def make_response(self, rows, number) -> Response:
        """Return the histories of the samples with step numbers `number` (k,)."""
        out = _make_response(rows, number, self.prop.dt, self.modes, self.drive)
        return self._add_elements(out, rows) if hasattr(self.model, "patch") else out

    def _add_elements(self, out, rows) -> Response:
        """Add the elements to the histories.

        `extra` gets slides, slide_rates, forces and slips (k, i) of the interfaces, spring_forces (k, s), and
        for elements in a plane lateral_slides and so on (k, i), which are 0 for the other elements.
        """
        modes = self.modes
        faces = self.faces
        parts, (ports, rubs, mates) = self._element_columns(rows), faces.of
        second = mates < np.arange(mates.size)
        rubs = (rubs == 1) & ~second
        push = -np.einsum("ke,en->kn", parts[:, :, 2], faces.rows[ports]) / modes.mass
        if self.model.patch is None:
            # that of the first element is counted already
            push += np.outer(out.force, modes.slide) / modes.mass
        extra = out.extra | {"spring_forces": parts[:, ~(rubs | second), 2]}
        names = ("slides", "slide_rates", "forces", "slips")
        if rubs.any():
            extra |= {name: parts[:, rubs, k] for k, name in enumerate(names)}
        for k, name in enumerate(names if second.any() else ()):
            column = extra[f"lateral_{name}"] = np.zeros((len(rows), rubs.sum()))
            column[:, mates[second]] = parts[:, second, k]
        return replace(out, acceleration=out.acceleration + push @ modes.output, extra=extra)

    def _element_columns(self, rows) -> np.ndarray:
        """Return the columns of the elements (k, e, ELEMENT_COLUMNS) of samples."""
        count = len(self.model.joints)
        begin = 2 * self.modes.omega.size + 7 + rows.shape[1] - self.width
        return rows[:, begin : begin + ELEMENT_COLUMNS * count].reshape(
            len(rows), count, ELEMENT_COLUMNS
        )

    def march_without_samples(self, steps: int, tell=None) -> bool:
        """March to a step in long pieces without keeping samples.

        Returns whether the march reached the step.

        `tell` is called after each piece.
        """
        size = self.prop.steps
        while self.done < steps and self.outcome is None:
            look = (cycles_to_next_check(self.done // size) + self.done // size) * size - self.done
            rows = self._march_rows(
                min(steps - self.done, MAX_PIECE_STEPS, MAX_PIECE_CYCLES * size, look), 0, []
            )
            self.totals += self._step_energies(rows).sum(axis=1)
            left = (steps - self.done) // size
            if self.done % size == 0 and self.outcome is None and self.is_periodic(left):
                self.skip_cycles(left)
            if tell is not None:
                tell()
        return self.outcome is None

    @property
    def can_fold(self) -> bool:
        """Whether `march_folded` can march it: bonds behind shear modes alone, under a constant load."""
        return (
            type(self) is Run
            and self.model.tuple_of is arrays.ShearedPoints
            and not self.model.joints
        )

    def march_folded(self, steps: int, samples: MarchSamples) -> bool:
        """March to a step without samples, and keep extremes and phasors of all cycles.

        The sample of the largest slide is kept too. Returns whether the march reached the step.
        """
        around = self.prop.steps
        kernels = load(FOLDED_KERNELS)
        n_rows = 2 * kernels.N_BLOCK_ROWS
        largest = arrays.LargestSlide(
            row=np.zeros(2 * self.modes.omega.size + 7),
            kept=np.zeros(self.width + 3),
            number=np.full(1, -1),
        )
        folded = arrays.FoldedCycles(
            bounds=arrays.StepBounds(
                goal=STEP_TOL * self.model.limit,
                force=float(self.model.limit),
                travel=float(self.travel),
            ),
            largest=largest,
            ledger=self.ledger,
            sums=np.zeros(5),
            totals=self.totals,
            trace=np.zeros((4, 0)),
            workspace=np.zeros((n_rows, kernels.BLOCK)),
        )
        table = None
        largest_at = -1
        while self.done < steps and self.outcome is None:
            # A fraction of a cycle comes first.
            size = (steps - self.done) % around or around
            count = 1
            if size == around:
                count = min((steps - self.done) // size, cycles_to_next_check(self.done // around))
            rows, first_row = self.step_table(size * count)
            is_new_size = folded.trace.shape[1] != size + 1
            if is_new_size:
                folded = folded._replace(trace=self._drive_trace(size))
            if is_new_size or rows is not table:
                table = rows
                bound = kernels.march_folded_cycles.bind_arguments(
                    self.state, self.modal_system, rows, self.contact, folded
                )
            folded.sums[:] = 0.0
            largest.number[0] = -1
            cycles = np.zeros((count, 4))
            did, status = kernels.march_folded_cycles.call_with_bound_args(bound, first_row, cycles)
            if largest.number[0] >= 0:
                largest_at = self.done + int(largest.number[0]) - first_row
            self.done += did
            self.totals += folded.sums[:3]
            self.second += folded.sums[3:]
            self._set_outcome(status)
            samples.extremes += [*zip(*cycles[:, :2].T.tolist())]
            samples.phasors += (cycles[:, 2] + 1j * cycles[:, 3]).tolist()
            n_left = (steps - self.done) // around
            if self.done % around == 0 and self.outcome is None and self.is_periodic(n_left):
                self.skip_cycles(n_left)
                samples.extremes += samples.extremes[-1:] * n_left
                samples.phasors += samples.phasors[-1:] * n_left
        if largest_at >= 0:
            samples.keep_early(largest.kept[None], np.array([largest_at]))
        return self.outcome is None

    def _drive_trace(self, size: int) -> np.ndarray:
        """Return the trace of a cycle of `size` steps from here, with the waves of the drive."""
        around = self.prop.steps
        phase = 2 * np.pi * (self.done % around + np.arange(size + 1)) / around
        return np.array([0 * phase, 0 * phase, np.cos(phase), np.sin(phase)])

    def march_cycles(self, size: int, stop: int, frames: int, snapshots: list) -> list:
        """March a cycle, or several whole cycles at once.

        No cycle goes beyond the step `stop` or the next look of `is_periodic`. With frames the last cycle is
        marched by itself, in as many pieces, with a snapshot after each.

        Parameters
        ----------
        size : int
            Number of steps.
        stop : int
            Number of a step.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.

        Returns
        -------
        list of tuple
            Parts of cycles: first step, rows (k, steps + 1, width) and friction works (k,) [J]; first the
            whole cycles, then what
            was begun of the next one if the march ends.
        """
        first = self.done
        n = 2 * self.modes.omega.size + 6
        whole = self.prop.steps
        together = min(
            MAX_PIECE_CYCLES,
            MAX_PIECE_STEPS // whole,
            (stop - first) // whole,
            cycles_to_next_check(-(-first // whole)),
        )
        if frames and first + together * whole == stop:
            together -= 1
        count = max(1, together) if size == whole else 1
        rows = self._march_rows(count * size, frames if first + size == stop else 0, snapshots)
        works = self._step_works(rows)
        booked = np.concatenate([rows[:, :n], self._running_sums(rows).T, rows[:, n:]], axis=1)
        done = (len(rows) - 1) // size if size else 0
        end = done * size
        parts = []
        if done:
            cycle_rows = sliding_window_view(booked, size + 1, axis=0)[::size].swapaxes(1, 2)
            parts.append((first, cycle_rows, works[:end].reshape(done, size).sum(axis=1)))
        if end < len(rows) - 1 or not done:
            parts.append((first + end, booked[None, end:], works[None, end:].sum(axis=1)))
        return parts

    def march_cycle(self, size: int, frames: int, snapshots: list) -> tuple:
        """March `size` steps as one cycle: return first step, rows (steps + 1, width) and friction work [J].

        Parameters
        ----------
        size : int
            Number of steps.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.
        """
        ((first, rows, works),) = self.march_cycles(size, self.done + size, frames, snapshots)
        return first, rows[0], works[0]

    def _march_rows(self, size: int, frames: int, snapshots: list) -> np.ndarray:
        """Return the rows (steps + 1, width) of `size` steps as the loop writes them.

        The arguments are those of `march_cycles`.

        Parameters
        ----------
        size : int
            Number of steps.
        frames : int
            Number of snapshots.
        snapshots : list
            Snapshots, which are appended.
        """
        parts = []
        edges = np.linspace(0, size, max(min(frames, size), 1) + 1).round().astype(int)
        for piece in np.diff(edges) if size else [0]:
            rows = np.empty((piece + 1, self.width))
            rows[-1] = 0.0  # the entries of the step that follows the last one are not known yet
            kept = copy_state(self.contact, *self._changing_arrays())
            begin = self._copy_before_piece()
            did, status = self._march_steps(int(piece), rows)
            while status == MEMORY_FULL:
                self.contact = enlarge_list(
                    self.contact, kept, f"at step {self.done + did}", *self._changing_arrays()
                )
                did, status = self._march_steps(int(piece), rows)
            if begin and self._has_diverged(rows[: did + 1]):
                for array, old in zip((*self.contact, *self._changing_arrays()), begin):
                    array[...] = old
                did = self._march_steps(did - 1, rows)[0]
                status = 1
                distance = format_length(self._output_distance(rows[did]), 3)
                self.message = (
                    f"beyond a displacement of {distance} the motion grows without limit, because the "
                    "force of the softening spring no longer pulls the block back; the run ended there"
                )
            self.done += did
            parts.append(rows[: did + 1])
            self._set_outcome(status)
            if frames:
                snapshots.append(self._snapshot(rows[did]))
            if self.outcome is not None:
                break
        rows = parts[0]
        if len(parts) > 1:
            rows = np.concatenate([part[:-1] for part in parts[:-1]] + parts[-1:])
        self.second += self._sampled_works(rows).sum(), np.abs(self._step_works(rows)).sum()
        return rows

    def _copy_before_piece(self) -> tuple:
        """Return copies of all arrays that steps change, if a spring is nonlinear."""
        if all(joint.potential is None for joint in self.model.joints):
            return ()
        return tuple(array.copy() for array in (*self.contact, *self._changing_arrays()))

    def _has_diverged(self, rows) -> bool:
        """Return whether the last step ends FLUNG times beyond the travel, or is not finite."""
        return len(rows) > 1 and not (
            self._output_distance(rows[-1]) <= DIVERGED_FACTOR * self.travel
            and np.isfinite(rows[-1]).all()
        )

    def _output_distance(self, row) -> float:
        """Return the distance of the output from rest [m] in a row."""
        with np.errstate(invalid="ignore", over="ignore"):
            return abs(float(self.modes.output @ row[: self.modes.omega.size]))

    def _march_steps(self, count: int, rows) -> tuple:
        """March `count` steps into rows (count + 1, width).

        Returns the number of steps done and the status.
        """
        table, row = self.step_table(count)
        return self.loops.march(
            self.model,
            row,
            count,
            self.state,
            self.modal_system,
            table,
            self.contact,
            self.faces,
            self._load_of_steps(count),
            float(self.travel),
            self.ledger,
            rows,
        )

    def _initial_load(self):
        """Return the load at the start; here it is constant."""
        return arrays.ConstantLoad(np.zeros(0))

    def _load_of_steps(self, count: int):
        """Return the arrays of the load in the next steps."""
        return self.load

    def _running_sums(self, rows) -> np.ndarray:
        """Return friction work, dissipated and created energy since the start at the rows (3, steps + 1) [J].

        `march_cycles` inserts them into the rows as further columns.
        """
        parts = self._step_energies(rows)
        sums = np.empty((3, parts.shape[1] + 1))
        sums[:, 0] = self.totals
        np.cumsum(parts, axis=1, out=sums[:, 1:])
        sums[:, 1:] += self.totals[:, None]
        self.totals = sums[:, -1].copy()
        return sums

    def _step_energies(self, rows) -> np.ndarray:
        """Return the friction work, the dissipated and the created energy of the steps between the rows (3, steps) [J].

        The dissipated energy is the work less the increase of the energy of the interface.
        """
        n = 2 * self.modes.omega.size
        parts = np.zeros((3, len(rows) - 1))
        parts[0] = self._step_works(rows)
        lost = parts[0] - np.diff(rows[:, n + 5])
        if lost.min(initial=0.0) == 0.0:
            parts[1] = lost
            return parts
        # error of the work due to the tolerance of the step solution and to round-off of the slide
        noise = self.model.limit * (
            1e-12 * np.abs(np.diff(rows[:, n])) + 1e-15 * np.abs(rows[:-1, n])
        )
        np.copyto(parts[1], lost, where=lost > -noise)
        np.copyto(parts[2], -lost, where=lost < -noise)
        return parts

    def _step_works(self, rows) -> np.ndarray:
        """Return the friction work of the steps between the rows [J]."""
        return rows[:-1, 2 * self.modes.omega.size + 6]

    def _sampled_works(self, rows) -> np.ndarray:
        """Return the friction work of the steps between the rows [J] from slides and forces alone.

        Blows at the end of a step, of slides that stop, have no slide from which their work could be read;
        their work is added if all friction is set-valued.
        """
        n = 2 * self.modes.omega.size
        model = self.model
        smooth = not model.joints or getattr(model, "patch", None) is not None
        out = sampled_work(rows[:, n], rows[:, n + 2]) if smooth else np.zeros(len(rows) - 1)
        blows = rows[:-1, n + 6].copy()
        for one, part in zip(model.joints, self._element_columns(rows).transpose(1, 2, 0)):
            if one.potential is None:
                slide, _, force, _, mean = part
                steady = bool(one.element.kernels)
                out += sampled_work(slide, force, None if steady else mean[:-1])
                blows -= mean[:-1] * np.diff(slide)
                smooth |= steady
        return out if smooth else out + blows

    def _changing_arrays(self) -> tuple:
        """Return the arrays that a step changes, without those of the contact."""
        faces = self.faces
        return self.state, self.ledger, *faces[:-1], *(faces.stops if self.model.joints else ())

    def _set_outcome(self, status: int) -> None:
        if status == 1:
            self.outcome = Outcome.EXCEEDS_TRAVEL
        if status == 3:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"at step {self.done} the computed motion is not a finite number; raise "
                "accuracy.steps_per_cycle"
            )
        if status == NO_CONTACT_SET:
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
        } | self.model.picture_fields(self.contact)

    def check_steps(self) -> None:
        """Set the outcome to not_converged if a step missed its residual; the samples are kept."""
        if self.ledger[LEDGER.n_unconverged]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[LEDGER.n_unconverged])} of {self.done} time steps have an error of the friction force "
                f"above the permitted {STEP_TOL:.0e} of the friction limit; raise accuracy.steps_per_cycle"
            )

    def read_rates_and_slips(self, rows) -> tuple:
        """Return slide rates (k, i) [m/s] and slips (k, i) [m] of the interfaces in the rows of `march_cycles`."""
        n = 2 * self.modes.omega.size
        parts = self._element_columns(rows)
        return np.column_stack([rows[:, n + 1], parts[:, :, 1]]), np.column_stack(
            [rows[:, n + 3], parts[:, :, 3]]
        )

    def find_modal_energy(self) -> float:
        """Return the kinetic and elastic energy of the modes [J]."""
        return (
            0.5
            * self.modes.mass
            * float(np.sum(self.state[1] ** 2 + (self.modes.omega * self.state[0]) ** 2))
        )

    def find_interface_energy(self) -> float:
        """Return the energy [J] stored in the interfaces, the springs and the normal contact."""
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
            self._load_of_steps(0),
            np.inf,
            np.zeros(9),
            rows,
        )
        energy = rows[0, n + 5]
        if self.model.loading:
            energy += rows[0, -3]  # normal energy of the preloaded contact
        for joint, columns in zip(self.model.joints, self._element_columns(rows)[0]):
            if joint.potential is not None:
                energy += joint.potential(columns[0])
        return float(energy)

    def energy_balance(self) -> dict:
        """Return the energy balance [J] and the counters by name."""
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
            "stored": self.find_modal_energy() + self.find_interface_energy()
        }
        book |= {
            "booked": float(self.ledger[LEDGER.friction_work]),
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
