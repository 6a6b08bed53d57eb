"""Long marches of coupled bond points that store sums in place of samples (`passing_kernels`)."""

import numpy as np

from ...compiled import load
from ..checkpoint import MarchSamples
from ..interfaces.arrays import ShearedPoints
from ..ledger import N_SAMPLE_COLUMNS
from ..periodicity import cycles_to_next_check
from .cycle_sum_arrays import (
    BLOCK,
    N_BLOCK_ROWS,
    CycleColumn,
    CycleSumMarch,
    CycleSums,
    LargestSlide,
    StepBounds,
    SumIndex,
    TraceRow,
)
from .faces import STEP_TOL
from .recording import N_SUMS
from .run import Run

CYCLE_SUM_KERNELS = "dynamics.march.passing_kernels"


def can_sum_cycles(run: Run) -> bool:
    """Return whether a march can store sums in place of samples (see `march_with_sums`).

    This requires bond points coupled by shear modes, no other elements, and a constant load.

    """
    return type(run) is Run and run.model.tuple_of is ShearedPoints and not run.model.joints


def march_with_sums(run: Run, steps: int, samples: MarchSamples) -> bool:
    """March to a given step; store the energy sums, extremes and phasors of all cycles, but no samples.

    The sample at the largest slide is also stored.

    Parameters
    ----------
    run : Run
    steps : int
        Number of the step at which to end.
    samples : MarchSamples
        Extremes, phasors and the sample of the largest slide are added.

    Returns
    -------
    bool
        Whether the march reached the step.
    """
    cycle_steps = run.prop.steps
    kernel = load(CYCLE_SUM_KERNELS).march_cycles_with_sums
    record = _make_cycle_sums(run)
    largest = record.largest
    table = None
    largest_at = -1
    while run.done < steps and run.outcome is None:
        # The march begins with the fraction of a cycle, so that complete cycles follow.
        size = (steps - run.done) % cycle_steps or cycle_steps
        count = 1
        if size == cycle_steps:
            next_check = cycles_to_next_check(run.done // cycle_steps)
            count = min((steps - run.done) // size, next_check)
        rows, first_row = run.get_step_table(size * count)
        is_new_size = record.trace.shape[1] != size + 1
        if is_new_size:
            record = record._replace(trace=_make_trace(run, size))
        if is_new_size or rows is not table:
            table = rows
            bound = kernel.bind_arguments(
                CycleSumMarch(run.state, run.modal_system, rows, run.contact, record)
            )
        record.sums[:] = 0.0
        largest.number[0] = -1
        cycles = np.zeros((count, len(CycleColumn)))
        n_steps, status = kernel.call_with_bound_args(bound, first_row, cycles)
        if largest.number[0] >= 0:
            largest_at = run.done + int(largest.number[0]) - first_row
        run.done += n_steps
        run.totals += record.sums[:N_SUMS]
        run.work_sums += record.sums[N_SUMS:]
        run.set_outcome(status)
        extremes = cycles[:, [CycleColumn.MIN_OUTPUT, CycleColumn.MAX_OUTPUT]]
        samples.extremes += [*zip(*extremes.T.tolist())]
        real, imag = cycles[:, [CycleColumn.PHASOR_REAL, CycleColumn.PHASOR_IMAG]].T
        samples.phasors += (real + 1j * imag).tolist()
        n_left = (steps - run.done) // cycle_steps
        if run.done % cycle_steps == 0 and run.outcome is None and run.is_periodic(n_left):
            run.skip_cycles(n_left)
            samples.extremes += samples.extremes[-1:] * n_left
            samples.phasors += samples.phasors[-1:] * n_left
    if largest_at >= 0:
        samples.keep_early(largest.kept[None], np.array([largest_at]))
    return run.outcome is None


def _make_cycle_sums(run: Run) -> CycleSums:
    """Return the arrays for the sums that are stored in place of samples."""
    largest = LargestSlide(
        row=np.zeros(2 * run.modes.omega.size + N_SAMPLE_COLUMNS),
        kept=np.zeros(run.width + N_SUMS),
        number=np.full(1, -1),
    )
    bounds = StepBounds(
        goal=STEP_TOL * run.model.limit,
        force=float(run.model.limit),
        travel=float(run.travel),
    )
    return CycleSums(
        bounds=bounds,
        largest=largest,
        ledger=run.ledger,
        sums=np.zeros(len(SumIndex)),
        totals=run.totals,
        trace=np.zeros((len(TraceRow), 0)),
        workspace=np.zeros((2 * N_BLOCK_ROWS, BLOCK)),
    )


def _make_trace(run: Run, size: int) -> np.ndarray:
    """Return the record of the output in a cycle, with cosine and sine of the drive phase at its steps."""
    cycle_steps = run.prop.steps
    phase = 2 * np.pi * (run.done % cycle_steps + np.arange(size + 1)) / cycle_steps
    return np.array([0 * phase, 0 * phase, np.cos(phase), np.sin(phase)])
