"""Recording of a march: all samples of the last cycles, and selected samples of earlier ones."""

from dataclasses import dataclass

import numpy as np

from ...core import Response
from ..checkpoint import MarchedCycle, MarchSamples
from ..cycles import find_cycle_extremes, find_cycle_phasors, select_cycle_samples
from ..ledger import SampleColumn

# Column offset of the running sums since the start (friction work, dissipated and created energy
# [J]), which are inserted before the friction work of the step in a recorded sample.
FIRST_SUM = SampleColumn.STEP_WORK
N_SUMS = 3


@dataclass(frozen=True, eq=False, slots=True)
class Mark:
    """State of a march recorded after a requested number of cycles, with the last samples before it.

    - `window`, `step_force`, `work`, `extremes`, `ledger`: as in `march.MarchResult`.
    - `after`: the `Run` from which to continue.
    """

    window: Response
    step_force: np.ndarray
    work: float
    extremes: np.ndarray
    ledger: dict
    after: object = None


class Recorder:
    """Recorder of march samples: all samples of the last cycles, and selected earlier ones.

    - `samples`: the recorded `checkpoint.MarchSamples`.
    - `keeps_samples`: whether samples from before the last cycles are kept.
    - `keeps_extremes`: whether the phasors of all cycles are kept, and the result contains the extremes of all cycles
      instead of those of the last cycles.
    - `capacity`: remaining number of samples from before the last cycles that may be kept.
    """

    def __init__(
        self, samples: MarchSamples, n_even: int, *, keeps_samples: bool, keeps_extremes: bool
    ):
        self.samples = samples
        self.keeps_samples = keeps_samples
        self.keeps_extremes = keeps_extremes
        self.capacity = samples.capacity
        self._n_even = n_even
        self._picks = {}  # indices of the selected samples of a cycle, by its first step

    def add(self, run, cycles: list) -> None:
        """Record successive marched cycles of equal length."""
        rows = np.stack([cycle.rows for cycle in cycles])
        indices_of_cycles = [None] * len(cycles)
        if self.keeps_samples and self.capacity > 0 and rows.shape[1] > 1:
            indices_of_cycles = select_cycle_samples(rows, run, self._n_even)
        last = self.samples.last
        for cycle, indices in zip(cycles, indices_of_cycles):
            if self.keeps_samples and len(last) == last.maxlen and self.capacity > 0:
                self._keep_samples(run, last[0], self._picks.pop(last[0].first_step, None))
            last.append(cycle)
            self._picks[cycle.first_step] = indices
        self.samples.extremes += find_cycle_extremes(rows, run.modes, run.prop.dt)
        if self.keeps_extremes:
            first_step = cycles[0].first_step
            self.samples.phasors += find_cycle_phasors(rows, run.modes, first_step, run.prop.steps)

    def _keep_samples(self, run, cycle: MarchedCycle, indices=None) -> None:
        """Keep selected samples of a cycle that no longer belongs to the last cycles.

        indices: indices of the samples, None to select them.

        """
        if indices is None:
            indices = select_cycle_samples(cycle.rows[None], run)[0]
        self.samples.keep_early(cycle.rows[indices], cycle.first_step + indices)
        self.capacity -= len(indices)

    def repeat_last(self, run, count: int) -> None:
        """Skip cycles of a periodic motion: repeat the samples of the last cycle in their place.

        The running energy sums of the repeated samples increase from cycle to cycle.
        """
        samples = self.samples
        first_step, rows, _ = samples.last[-1]
        for cycle in samples.last:
            if samples.capacity > 0:
                self._keep_samples(run, cycle)
        samples.last.clear()
        samples.extremes += [samples.extremes[-1]] * count
        samples.phasors += [samples.phasors[-1]] * count
        indices = select_cycle_samples(rows[None], run)[0]
        n_kept = min(count, -(-max(0, samples.capacity) // len(indices)))
        numbers = np.arange(1, 1 + n_kept)[:, None]
        first_sum = 2 * run.modes.omega.size + FIRST_SUM
        sums = slice(first_sum, first_sum + N_SUMS)
        repeated_rows = np.tile(rows[indices], (n_kept, 1))
        repeated_rows[:, sums] += np.repeat(
            numbers * (rows[-1, sums] - rows[0, sums]), len(indices), axis=0
        )
        samples.keep_early(repeated_rows, (first_step + indices + run.prop.steps * numbers).ravel())
        run.skip_cycles(count)
        self.capacity = samples.capacity


def read_output_extremes(cycles, run) -> list:
    """Return the smallest and largest output [m] in each recorded cycle."""
    extremes = []
    for cycle in cycles:
        extremes += find_cycle_extremes(cycle.rows[None], run.modes, run.prop.dt)
    return extremes


def make_mark(run, cycles, extremes, after=None) -> Mark:
    """Return the mark of a march: its last cycles, energies and present state.

    Parameters
    ----------
    run : Run
    cycles : list of MarchedCycle
    extremes : list of tuple
        Smallest and largest output [m] of each cycle so far.
    after : Run or None
        The march to continue from.

    Returns
    -------
    Mark
    """
    rows, first_step = join_cycles(cycles)
    return Mark(
        window=run.make_response(rows, first_step + np.arange(len(rows))),
        step_force=rows[:-1, 2 * run.modes.omega.size + SampleColumn.MEAN_FORCE].copy(),
        work=sum(cycle.work for cycle in cycles),
        extremes=np.array(extremes),
        ledger=run.energy_balance(),
        after=after,
    )


def join_cycles(cycles) -> tuple:
    """Join the samples of successive cycles; return the rows and the step number of the first row.

    The sample that two cycles share is kept once.

    """
    parts = [cycle.rows[:-1] for cycle in cycles]
    return np.concatenate([*parts, cycles[-1].rows[-1:]]), cycles[0].first_step
