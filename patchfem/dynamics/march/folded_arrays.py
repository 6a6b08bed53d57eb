"""Arrays of a march without stored samples, and the names of their rows."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class SumPlace(IntEnum):
    """Places in `FoldedCycles.sums` [J].

    - WORK: friction work
    - LOSS, CREATED: dissipated and created energy
    - SAMPLED_WORK: friction work from the samples alone
    - WORK_SIZE: sum of the absolute works of the steps
    """

    WORK = 0
    LOSS = 1
    CREATED = 2
    SAMPLED_WORK = 3
    WORK_SIZE = 4


class TraceRow(IntEnum):
    """Rows of `FoldedCycles.trace`: output [m] and its rate [m/s], cosine and sine of the drive."""

    OUTPUT = 0
    RATE = 1
    DRIVE_COS = 2
    DRIVE_SIN = 3


class CycleColumn(IntEnum):
    """Columns of the results of a cycle: extremes and phasor of the output [m]."""

    MIN_OUTPUT = 0
    MAX_OUTPUT = 1
    PHASOR_REAL = 2
    PHASOR_IMAG = 3


class BlockRow(IntEnum):
    """Rows of `FoldedCycles.workspace`, of a block of steps.

    - DRIVE_WORK, VISCOUS_LOSS: energies of the step [J]
    - SLIDE, SPEED: slide [m] and speed [m/s] at its end; SLIDE later has the increment
    - OUTPUT, RATE: output [m] and its rate [m/s]
    - SQUARES: sum of v^2 + omega^2 z^2 of the modes

    As many rows again receive results that are not used.
    """

    DRIVE_WORK = 0
    VISCOUS_LOSS = 1
    SLIDE = 2
    SPEED = 3
    OUTPUT = 4
    RATE = 5
    SQUARES = 6


N_BLOCK_ROWS = len(BlockRow)
BLOCK = 32  # number of steps of a drag that are tried at once


class StepBounds(NamedTuple):
    """Bounds of a march of folded cycles.

    - goal: tolerance of the friction force of a step [N]
    - force: friction limit [N]
    - travel: displacement of the output beyond which the march ends [m]
    """

    goal: float
    force: float
    travel: float


class LargestSlide(NamedTuple):
    """Sample of the largest slide, in a system of n modes.

    - row: (2 n + 7,) the present sample
    - kept: (2 n + 10,) sample of the largest slide so far, with the sums there
    - number: (1,) its number, counted from the first step
    """

    row: np.ndarray
    kept: np.ndarray
    number: np.ndarray


class FoldedCycles(NamedTuple):
    """Sums and output that `passing_kernels` records of cycles without samples.

    - bounds, largest: as above
    - ledger: (9,) see `dynamics.ledger.Ledger`
    - sums: (5,) sums over these cycles [J], see `SumPlace`
    - totals: (3,) the first three sums before these cycles [J]
    - trace: (4, s + 1) samples of the output and waves of the drive, see `TraceRow`
    - workspace: (14, k) space for a block of k steps, see `BlockRow`
    """

    bounds: StepBounds
    largest: LargestSlide
    ledger: np.ndarray
    sums: np.ndarray
    totals: np.ndarray
    trace: np.ndarray
    workspace: np.ndarray


class FoldedMarch(NamedTuple):
    """Arrays that `passing_kernels` takes.

    - motion: (2, n) coordinates and rates of the modes
    - modal_system: `interfaces.arrays.ModalArrays`
    - table: (s, k) table of `propagator.Propagator`
    - interface: `interfaces.arrays.ShearedPoints`
    - folded: sums and output that are recorded
    """

    motion: np.ndarray
    modal_system: tuple
    table: np.ndarray
    interface: tuple
    folded: FoldedCycles
