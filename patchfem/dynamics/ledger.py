"""Positions in the ledger and in the samples of a march, which the compiled loops write."""

from enum import IntEnum


class Ledger(IntEnum):
    """Positions in the ledger of a march.

    - DRIVE_WORK, VISCOUS_LOSS: energies since the start [J]
    - DRIVE_POWER: sum of the absolute works of the drive in the steps [J]
    - FRICTION_LOSS: energy dissipated by friction [J]
    - MAX_STORED: largest stored energy [J]
    - N_ITERATIONS, MAX_ITERATIONS: iterations of all steps, and of the step that took most
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
    """Columns of a sample of a march, behind the coordinates and rates of the modes.

    They belong to the contact, or else to the first element.

    - SLIDE, SPEED: slide [m] and its speed [m/s]
    - FORCE: friction force [N]
    - SLIP: irreversible part of the slide [m]
    - MEAN_FORCE: mean force of the step that follows [N]
    - ENERGY: energy of the interface [J]
    - STEP_WORK: friction work of the step that follows [J]
    """

    SLIDE = 0
    SPEED = 1
    FORCE = 2
    SLIP = 3
    MEAN_FORCE = 4
    ENERGY = 5
    STEP_WORK = 6


N_SAMPLE_COLUMNS = len(SampleColumn)
