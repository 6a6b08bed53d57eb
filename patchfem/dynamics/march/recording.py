"""Samples of a march that are kept: all of the last cycles, and selected earlier ones."""

from dataclasses import dataclass

import numpy as np

from ...core import Response
from ..checkpoint import MarchedCycle, MarchSamples
from ..cycles import find_cycle_extremes, find_cycle_phasors, select_cycle_samples
from ..ledger import SampleColumn

# Sums since the start, which stand in front of the friction work of a step in a sample that is kept: friction work,
# dissipated and created energy [J].
FIRST_SUM = SampleColumn.STEP_WORK
N_SUMS = 3


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


class Recorder:
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

    def add(self, run, cycles: list) -> None:
        """Record cycles of equal length that follow each other."""
        rows = np.stack([cycle.rows for cycle in cycles])
        picks = [None] * len(cycles)
        if self.keeps_samples and self.capacity > 0 and rows.shape[1] > 1:
            picks = select_cycle_samples(rows, run, self._n_even)
        last = self.samples.last
        for cycle, pick in zip(cycles, picks):
            if self.keeps_samples and len(last) == last.maxlen and self.capacity > 0:
                self._keep_samples(run, last[0], self._picks.pop(last[0].first_step, None))
            last.append(cycle)
            self._picks[cycle.first_step] = pick
        if self.keeps_extremes:
            first_step = cycles[0].first_step
            self.samples.extremes += find_cycle_extremes(rows, run.modes, run.prop.dt)
            self.samples.phasors += find_cycle_phasors(rows, run.modes, first_step, run.prop.steps)

    def _keep_samples(self, run, cycle: MarchedCycle, pick=None) -> None:
        """Keep samples of a cycle that is none of the last ones; `pick` has their numbers if they are known."""
        if pick is None:
            pick = select_cycle_samples(cycle.rows[None], run)[0]
        self.samples.keep_early(cycle.rows[pick], cycle.first_step + pick)
        self.capacity -= len(pick)

    def repeat_last(self, run, count: int) -> None:
        """Skip `count` cycles that are equal to the last one.

        The samples of the last cycle are kept again for the skipped ones, with the sums that have grown since.
        """
        samples = self.samples
        first_step, rows, _ = samples.last[-1]
        for cycle in samples.last:
            if samples.capacity > 0:
                self._keep_samples(run, cycle)
        samples.last.clear()
        samples.extremes += [samples.extremes[-1]] * count
        samples.phasors += [samples.phasors[-1]] * count
        pick = select_cycle_samples(rows[None], run)[0]
        n_kept = min(count, -(-max(0, samples.capacity) // len(pick)))
        numbers = np.arange(1, 1 + n_kept)[:, None]
        begin = 2 * run.modes.omega.size + FIRST_SUM
        sums = slice(begin, begin + N_SUMS)
        later = np.tile(rows[pick], (n_kept, 1))
        later[:, sums] += np.repeat(numbers * (rows[-1, sums] - rows[0, sums]), len(pick), axis=0)
        samples.keep_early(later, (first_step + pick + run.prop.steps * numbers).ravel())
        run.skip_cycles(count)
        self.capacity = samples.capacity


def read_output_extremes(cycles, run) -> list:
    """Return the smallest and largest output [m] of each marched cycle."""
    extremes = []
    for cycle in cycles:
        extremes += find_cycle_extremes(cycle.rows[None], run.modes, run.prop.dt)
    return extremes


def make_mark(run, cycles, extremes, after=None) -> Mark:
    """Return the `Mark` of the cycles that end here.

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
        amplitudes=np.array(extremes),
        ledger=run.energy_balance(),
        after=after,
    )


def join_cycles(cycles) -> tuple:
    """Return the rows of successive cycles without their shared samples, and the number of the first step."""
    parts = [cycle.rows[:-1] for cycle in cycles]
    return np.concatenate([*parts, cycles[-1].rows[-1:]]), cycles[0].first_step
