"""Positions in the ledger of a march: sums over its steps that the compiled loops write."""

from typing import NamedTuple


class LedgerPositions(NamedTuple):
    """Positions in the ledger of a march.

    - drive_work, viscous_loss: energies since the start [J]
    - drive_power: sum of the absolute works of the drive in the steps [J]
    - friction_loss: energy dissipated by friction [J]
    - max_stored: largest stored energy [J]
    - n_iterations, max_iterations: iterations of all steps, and of the step that took most
    - n_unconverged: number of steps without convergence
    - friction_work: work of the friction forces [J]
    """

    drive_work: int = 0
    viscous_loss: int = 1
    drive_power: int = 2
    friction_loss: int = 3
    max_stored: int = 4
    n_iterations: int = 5
    max_iterations: int = 6
    n_unconverged: int = 7
    friction_work: int = 8


LEDGER = LedgerPositions()
