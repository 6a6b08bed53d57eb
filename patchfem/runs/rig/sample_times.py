"""Times of the samples of a run whose engine can evaluate the motion at any time.

In: a drive, the number of its cycles and the Numerics. Out: `SampleTimes`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...structure.drive_sizes import choose_samples_per_cycle

LATE_SAMPLES_PER_CYCLE = 400  # samples of each of the last cycles
MIN_WINDOW_SAMPLES = 101  # samples of the last cycles of a run shorter than a cycle
N_EARLY_SAMPLES = 8_000  # samples of equal distances before the last cycles
EARLY_SAMPLES_PER_CYCLE = 40  # largest number of these in a cycle by default
MIN_SAMPLED_CYCLES = 2.0  # cycles at the end that have as many samples as the window


class SampleTimes(NamedTuple):
    """Times of the samples of a run [s].

    - samples (k,): all of them.
    - snapshots (f,): those at which the elements are stored, in the last cycle.
    - window_start: start of the window.
    """

    samples: np.ndarray
    snapshots: np.ndarray
    window_start: float


def choose_sample_times(numerics, drive, cycles: float, frames: int = 0) -> SampleTimes:
    """Choose the times of the samples and of `frames` snapshots.

    Parameters
    ----------
    numerics : Numerics
        Number of cycles of the window, and whether the histories before it are stored.
    drive : drives.DriveSignal
    cycles : float
        Number of cycles of the drive in the run.
    frames : int
        Number of snapshots in the last cycle.
    """
    period = drive.period
    end = cycles * period
    window_start = max(0.0, end - numerics.window * period)
    first = window_start
    early = np.zeros(0)
    if numerics.whole:
        # Before the last cycles the distances are larger, and equal.
        first = max(0.0, min(window_start, end - MIN_SAMPLED_CYCLES * period))
        count = max(1, min(EARLY_SAMPLES_PER_CYCLE, N_EARLY_SAMPLES // max(cycles, 1)))
        count = choose_samples_per_cycle(drive, cycles) or count
        early = np.arange(0.0, first - 1e-9 * period, period / count)

    # Each of the last cycles has LATE_SAMPLES_PER_CYCLE samples.
    late = _divide(window_start, end, period, MIN_WINDOW_SAMPLES)
    if first < window_start:
        late = np.union1d(_divide(first, window_start, period, 2), late)

    # A snapshot is taken at a sample, where all histories have a value.
    begin = max(0.0, end - period)
    at = begin + (end - begin) * (1 + np.arange(frames)) / max(frames, 1)
    nearest = np.abs(late[:, None] - at).argmin(axis=0)
    return SampleTimes(np.append(early, late), late[nearest], window_start)


def _divide(begin: float, end: float, period: float, minimum: int) -> np.ndarray:
    """Return times (k,) [s] of equal distances from begin to end, LATE_SAMPLES_PER_CYCLE in a period.

    The times and the period are in [s], and `minimum` is the smallest number of times.
    """
    count = round((end - begin) / period * LATE_SAMPLES_PER_CYCLE) + 1
    return np.linspace(begin, end, max(minimum, count))


def remove_incomplete_cycle(run):
    """Remove the extremes and the complex amplitude of a last cycle that a run did not complete."""
    count = int(run.cycles_done + 1e-9)
    if not count:
        return run
    return replace(run, extremes=run.extremes[:count], phasors=run.phasors[:count])
