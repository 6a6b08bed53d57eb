"""Result of a time integration: time histories from modal coordinates, energies and outcome.

Measures that an engine integrates over the last cycles itself are a `core.IntegratedMeasures`.
"""

from dataclasses import dataclass, field

import numpy as np

from ..core import ModalBasis, Outcome, Response

# Smallest mean resultant length of the doubled phases of slip onsets for
# which a common phase is reported.
MIN_ALIGNMENT = 0.95


def mean_slip_phase(count, cosine, sine):
    """Return the mean phase [rad], modulo pi, at which slip begins, for one run or for (n,) runs.

    It is NaN if there is no onset, and if the onsets differ by more than MIN_ALIGNMENT allows: the
    mean of several slip phases in a half cycle is the phase of none.

    Parameters
    ----------
    count, cosine, sine : array_like
        Number of slip onsets, and sums of cosine and sine of twice their phases.

    Returns
    -------
    array_like
    """
    have_common_phase = (count > 0) & (np.hypot(cosine, sine) >= MIN_ALIGNMENT * count)
    return np.where(have_common_phase, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)[()]


@dataclass(frozen=True, eq=False, slots=True)
class EngineResult:
    """Result of a run by one of the time integrators.

    - response, window: time histories of the run and of its last cycles
    - extremes: (c, 2) smallest and largest output of every cycle [m]
    - phasors: (c,) phasor of the output at the drive frequency in every cycle [m]
    - ledger: energies [J] by name
    - outcome: how the run ended; None if it follows from the extremes
    """

    response: Response
    window: Response
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None = None
    message: str = ""
    snapshots: list = field(default_factory=list)


def find_accelerations(modes: ModalBasis, drive_acceleration, z, rate, friction) -> np.ndarray:
    """Compute the modal accelerations (k, n) [m s-2] relative to the base from eq. 3.4.

    Parameters
    ----------
    modes : ModalBasis
    drive_acceleration : ndarray
        (k,) acceleration of the drive [m s-2].
    z, rate : ndarray
        (k, n) modal coordinates [m] and rates [m/s].
    friction : ndarray
        (k, n) friction forces on the coordinates [N].

    Returns
    -------
    ndarray
    """
    damped = (
        rate * (2 * modes.zeta * modes.omega) if modes.damping is None else rate @ modes.damping.T
    )
    return (
        -np.outer(drive_acceleration, modes.base)
        - damped
        - z * modes.omega**2
        - friction / modes.mass
    )
