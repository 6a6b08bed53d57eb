"""March of a contact model over cycles of a drive signal, with selected samples and results."""

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import ModalBasis, Outcome, Response, SineDrive
from ...structure.drive_sizes import choose_samples_per_cycle
from ..checkpoint import MarchSamples, open_checkpoint
from .cycle_sums import can_sum_cycles, march_with_sums
from .models import ContactModel, load_instances
from .recording import Recorder, join_cycles, make_mark
from .run import Run


@dataclass(frozen=True, eq=False, slots=True)
class MarchResult:
    """Result of a march: selected samples, cycle extremes, energies and outcome.

    - `response`: histories of the samples that were kept.
    - `window`, `step_force`, `window_work`: samples of the last cycles, mean forces of their steps [N] and
      friction work [J].
    - `extremes` (c, 2), `phasors` (c,): extremes and phasor of the output in each cycle [m].
    - `ledger`: energies [J] by name, as `Run.energy_balance` returns them.
    - `outcome`, `message`: how the march ended, None and "" if it reached its last step.
    - `snapshots`: states of the interface in the last cycle.
    - `cycles_done`: number of completed cycles.
    - `marks`: the `Mark` at each requested number of cycles.
    """

    response: Response
    window: Response
    step_force: np.ndarray
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    snapshots: list
    window_work: float
    cycles_done: float
    message: str = ""
    marks: tuple = ()


def _get_run_class(model):
    """Return the class that integrates a model over time: that set by the model, otherwise `Run`."""
    return getattr(model, "runner", None) or Run


def warm_up(modes: ModalBasis, drive: SineDrive, model: ContactModel, say=None) -> None:
    """Load or compile the loop for a model by a march of zero steps.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    say : callable or None
        Callback that reports when the loop has to be compiled.
    """
    runner = _get_run_class(model)
    kind = None
    if runner is Run:
        is_damping_diagonal = modes.damping is None
        kind = model.kind, model.laws, model.loading, is_damping_diagonal
    if kind not in _LOADED_KINDS:
        run = runner(modes, drive, model, 4, np.inf, load_instances(say))
        run.march_cycle(0, 0, [])
        _LOADED_KINDS.update({kind} - {None})


_LOADED_KINDS = set()  # types of contact whose compiled code has been loaded


def start_run(
    modes: ModalBasis, drive, model, steps_per_cycle: int, travel: float = np.inf, start=None
):
    """Create the march of a model in its initial state.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    steps_per_cycle : int
    travel : float
        Largest displacement of the output [m].
    start : core.InitialState or None
        Initial state; rest if None.

    Returns
    -------
    Run
    """
    return _get_run_class(model)(
        modes, drive, model, steps_per_cycle, travel, load_instances(), start
    )


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
    """March a model over cycles of its drive signal, from rest or from an initial state.

    The equation of motion is (3.4) of the report: z'' + 2 zeta omega z' + omega^2 z equals the modal
    acceleration of the drive minus phi^T F/mass, with the friction force F on the interface. In a
    time step the modes move exactly (`propagator`) under the drive and the mean of F over the path of
    the step. The increment of the relative displacement follows from this mean by Newton's method, so
    that friction work and energy balance to round-off. The amplitude is of second order in the step.
    The extremes of a cycle are those of the cubic Hermite polynomials through the samples of the
    output and its rate.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
        Or another drive; the check for a periodic motion needs a sinusoidal drive.
    model : ContactModel, joints.JointsModel or varying_load.VaryingLoadModel
    cycles : float
        Number of cycles of the drive; the march begins with the fraction of a cycle.
    steps_per_cycle : int
    window : int
        Number of whole cycles at the end whose samples are all kept.
    travel : float
        Largest displacement of the output [m], beyond which the march ends.
    frames : int
        Number of snapshots of the interface during the last cycle.
    say : callable or None
        Callback that reports when the loop has to be compiled first.
    progress : callable or None
        Callback for the completed fraction of the march.
    start : core.InitialState or None
    marks : sequence of float
        Numbers of whole cycles after which a `Mark` is kept.
    keeps_samples : bool
        Whether samples and extremes from before the last cycles are kept; always true with marks.
    keeps_extremes : bool
        Whether extremes and phasors of all cycles are kept for bond points coupled by shear modes although `keeps_samples`
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

    def restart():
        return start_run(modes, drive, model, steps_per_cycle, travel, start)

    load_instances(say)
    run = restart()
    n_last = max(window, 2)
    mark_steps = sorted({round(mark * steps_per_cycle) for mark in marks})
    plan = _MarchPlan(round(cycles * steps_per_cycle), steps_per_cycle, window, frames, mark_steps)
    samples = MarchSamples(deque(maxlen=n_last))
    checkpoint = open_checkpoint(
        run,
        (plan.n_steps, steps_per_cycle, window, frames, keeps_samples, *mark_steps),
        samples,
        restart,
    )
    before_last = plan.n_steps - n_last * steps_per_cycle
    keeps_samples = keeps_samples or bool(mark_steps)
    keeps_sums = keeps_extremes and can_sum_cycles(run) and not mark_steps
    if keeps_sums:
        if not march_with_sums(run, before_last, samples):
            # The march ended before its last cycles, so it is repeated
            # cycle by cycle with all samples.
            run = restart()
            samples = MarchSamples(samples.last)
            keeps_sums = False
            keeps_samples = True
    elif not keeps_samples and not samples.is_restarted:
        if not run.march_without_samples(
            before_last, lambda: checkpoint.write_if_due(run, samples)
        ):
            run = restart()
            samples.is_restarted = True
    n_even = choose_samples_per_cycle(drive, cycles, needs_history=even)
    recorder = Recorder(
        samples,
        n_even,
        keeps_samples=keeps_samples,
        keeps_extremes=keeps_samples or keeps_sums,
    )
    snapshots = _march_recorded(run, recorder, plan, checkpoint, progress)
    run.check_steps()
    return _make_result(run, recorder, plan, snapshots)


class _MarchPlan(NamedTuple):
    """Lengths of a march and of its records, in steps and cycles.

    - n_steps: number of steps of the march
    - steps_per_cycle: number of steps of a cycle
    - window: number of last cycles with all samples
    - frames: number of snapshots in the last cycle
    - mark_steps: steps after which the state is recorded as a `Mark`

    """

    n_steps: int
    steps_per_cycle: int
    window: int
    frames: int
    mark_steps: list

    def next_mark_step(self, n_completed: int) -> int:
        """Return the next step at which the state is recorded as a `Mark`, or the last step if there is none."""
        return min((step for step in self.mark_steps if step > n_completed), default=self.n_steps)


def _march_recorded(run, recorder: Recorder, plan: _MarchPlan, checkpoint, progress) -> list:
    """March to the end of a plan, and record the cycles.

    Returns the snapshots of the last cycle. The remaining cycles of a periodic motion are skipped; see `Run.is_periodic`.
    """
    samples = recorder.samples
    snapshots = []
    # The march begins with the fraction of a cycle, so that the window has complete cycles.
    size = (plan.n_steps - run.done) % plan.steps_per_cycle or plan.steps_per_cycle
    while run.done < plan.n_steps and run.outcome is None:
        next_stop = plan.next_mark_step(run.done)
        frames = plan.frames if next_stop == plan.n_steps else 0
        for cycles in run.march_cycles(size, next_stop, frames, snapshots):
            recorder.add(run, cycles)
        if run.done in plan.mark_steps:
            cycles = list(samples.last)[-plan.window :]
            samples.marks.append((run.fork(run.drive), cycles, samples.extremes[-plan.window :]))
        size = plan.steps_per_cycle
        n_left = (plan.next_mark_step(run.done) - run.done) // size - samples.last.maxlen
        if recorder.keeps_samples and run.is_periodic(n_left):
            recorder.repeat_last(run, n_left)
        if run.done < plan.n_steps:
            checkpoint.write_if_due(run, samples)
        if progress is not None:
            progress(run.done / plan.n_steps)
    return snapshots


def _make_result(run, recorder: Recorder, plan: _MarchPlan, snapshots: list) -> MarchResult:
    """Return the result of a finished march, made from its recorded samples."""
    samples = recorder.samples
    extremes = samples.extremes
    if not recorder.keeps_extremes:
        extremes = extremes[-len(samples.last) :]
    last_mark = make_mark(run, list(samples.last)[-plan.window :], extremes)
    rows, first_step = join_cycles(samples.last)
    number = np.concatenate([*samples.early_numbers, first_step + np.arange(len(rows))])
    return MarchResult(
        response=run.make_response(np.concatenate([*samples.early_rows, rows]), number),
        window=last_mark.window,
        step_force=last_mark.step_force,
        extremes=last_mark.extremes,
        phasors=np.array(samples.phasors),
        ledger=last_mark.ledger,
        outcome=run.outcome,
        snapshots=snapshots,
        window_work=last_mark.work,
        cycles_done=run.done / plan.steps_per_cycle,
        message=run.message,
        marks=tuple(make_mark(*mark, mark[0]) for mark in samples.marks),
    )
