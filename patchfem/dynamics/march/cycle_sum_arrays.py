"""Arrays of a march that stores sums instead of samples, and the names of their rows."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class SumIndex(IntEnum):
    """Indices into `CycleSums.sums`: energies [J] accumulated over the cycles of one call.

    - WORK: friction work
    - LOSS, CREATED: dissipated energy, and energy created by numerical errors
    - SAMPLED_WORK: friction work by the trapezoidal rule from the samples
    - WORK_SIZE: sum of the absolute friction works of the steps
    """

    WORK = 0
    LOSS = 1
    CREATED = 2
    SAMPLED_WORK = 3
    WORK_SIZE = 4


class TraceRow(IntEnum):
    """Row indices of `CycleSums.trace`: output [m], output rate [m/s], cosine and sine of the drive phase."""

    OUTPUT = 0
    RATE = 1
    DRIVE_COS = 2
    DRIVE_SIN = 3


class CycleColumn(IntEnum):
    """Columns of the results for one cycle: extremes and phasor of the output [m]."""

    MIN_OUTPUT = 0
    MAX_OUTPUT = 1
    PHASOR_REAL = 2
    PHASOR_IMAG = 3


class BlockRow(IntEnum):
    """Row indices of `CycleSums.workspace`: energies and motion during a block of steps.

    - DRIVE_WORK, VISCOUS_LOSS: energies of the step [J]
    - SLIDE, SPEED: slide [m] and speed [m/s] at the end of the step; SLIDE later has the increment
    - OUTPUT, RATE: output [m] and output rate [m/s]
    - SQUARES: sum of v^2 + omega^2 z^2 of the modes

    As many further rows receive results that are discarded.
    """

    DRIVE_WORK = 0
    VISCOUS_LOSS = 1
    SLIDE = 2
    SPEED = 3
    OUTPUT = 4
    RATE = 5
    SQUARES = 6


N_BLOCK_ROWS = len(BlockRow)
BLOCK = 32  # number of steps in full slip that are computed as a block, mode by mode


class StepBounds(NamedTuple):
    """Tolerance and limits for a march that stores sums.

    - goal: tolerance of the friction force of a step [N]
    - force: friction limit [N]
    - travel: largest displacement of the output [m], beyond which the march ends
    """

    goal: float
    force: float
    travel: float


class LargestSlide(NamedTuple):
    """March sample with the largest relative displacement so far, for n modes.

    - row: (2 n + 7,) present sample
    - kept: (2 n + 10,) sample of the largest slide so far, with the energy sums at that time
    - number: (1,) number of this sample, counted from the first step
    """

    row: np.ndarray
    kept: np.ndarray
    number: np.ndarray


class CycleSums(NamedTuple):
    """Energy sums and output values that `passing_kernels` stores instead of samples.

    - bounds, largest: tolerance and limits, and the sample of the largest slide
    - ledger: (9,) energy sums, see `dynamics.ledger.Ledger`
    - sums: (5,) sums over these cycles [J], see `SumIndex`
    - totals: (3,) values of the first three sums before these cycles [J]
    - trace: (4, s + 1) samples of the output and of the harmonic functions of the drive, see `TraceRow`
    - workspace: (14, k) workspace for a block of k steps, see `BlockRow`
    """

    bounds: StepBounds
    largest: LargestSlide
    ledger: np.ndarray
    sums: np.ndarray
    totals: np.ndarray
    trace: np.ndarray
    workspace: np.ndarray


class CycleSumMarch(NamedTuple):
    """Arguments of `passing_kernels`: modes, contact and the record of sums.

    - motion: (2, n) coordinates and rates of the modes
    - modal_system: `interfaces.arrays.ModalArrays`
    - table: (s, k) table of `propagator.Propagator`
    - interface: `interfaces.arrays.ShearedPoints`
    - record: energy sums and output
    """

    motion: np.ndarray
    modal_system: tuple
    table: np.ndarray
    interface: tuple
    record: CycleSums
