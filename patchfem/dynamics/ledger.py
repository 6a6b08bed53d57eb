"""Indices into the energy sums and sample rows that the compiled loops of a march fill."""

from enum import IntEnum


class Ledger(IntEnum):
    """Indices into the ledger of a march: energy sums and counters since the start.

    - DRIVE_WORK, VISCOUS_LOSS: energies since the start [J]
    - DRIVE_POWER: sum of the absolute works of the drive in the steps [J]
    - FRICTION_LOSS: energy dissipated by friction [J]
    - MAX_STORED: largest stored energy [J]
    - N_ITERATIONS, MAX_ITERATIONS: iterations of all steps, and largest number in a step
    - N_UNCONVERGED: number of steps without convergence
    - FRICTION_WORK: work of the friction forces [J]
    """

    DRIVE_WORK = 0
    VISCOUS_LOSS = 1
    DRIVE_POWER = 2
    FRICTION_LOSS = 3
    MAX_STORED = 4
    N_ITERATIONS = 5
    MAX_ITERATIONS = 6
    N_UNCONVERGED = 7
    FRICTION_WORK = 8


class SampleColumn(IntEnum):
    """Columns of a march sample for the first interface; they follow the modal coordinates and rates.

    They belong to the contact, or to the first element if the rig has no contact.

    - SLIDE, SPEED: slide [m] and its speed [m/s]
    - FORCE: friction force [N]
    - SLIP: irreversible part of the slide [m]
    - MEAN_FORCE: mean force of the following step [N]
    - ENERGY: energy stored in the interface [J]
    - STEP_WORK: friction work of the following step [J]
    """

    SLIDE = 0
    SPEED = 1
    FORCE = 2
    SLIP = 3
    MEAN_FORCE = 4
    ENERGY = 5
    STEP_WORK = 6


N_SAMPLE_COLUMNS = len(SampleColumn)
