"""Run of an engine: its histories, made from modal coordinates.

What an engine integrated over the last cycles itself is a `core.IntegratedMeasures`.
"""

from dataclasses import dataclass, field

import numpy as np

from ..core import ModalBasis, Outcome, Response

# length of the mean of unit vectors at twice the phases of the starts of slip, above which they have one phase
MIN_ALIGNMENT = 0.95


def mean_slip_phase(count, cosine, sine):
    """Return the mean phase [rad] modulo pi of the starts of slip, of one run or of (n,) runs.

    It is NaN without a start, and where the starts differ by more than MIN_ALIGNMENT allows: the
    mean of several slips in half a cycle is the phase of none.

    Parameters
    ----------
    count, cosine, sine : array_like
        Number of starts, and sums of cosine and sine of twice their phases.

    Returns
    -------
    array_like
    """
    told = (count > 0) & (np.hypot(cosine, sine) >= MIN_ALIGNMENT * count)
    return np.where(told, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)[()]


@dataclass(frozen=True, eq=False, slots=True)
class EngineResult:
    """A run of an engine.

    - response, window: histories of the run and of its last cycles
    - amplitudes: (c, 2) smallest and largest output of every cycle [m]
    - phasors: (c,) output at the frequency of the drive [m]
    - ledger: energies [J] by name
    - outcome: how it ended, None where its amplitudes tell
    """

    response: Response
    window: Response
    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None = None
    message: str = ""
    snapshots: list = field(default_factory=list)


def find_accelerations(modes: ModalBasis, push, z, rate, pull) -> np.ndarray:
    """Return the modal accelerations (k, n) [m s-2] relative to the base, eq. 3.4.

    Parameters
    ----------
    modes : ModalBasis
    push : ndarray
        (k,) drive [m s-2].
    z, rate : ndarray
        (k, n) [m], [m/s].
    pull : ndarray
        (k, n) friction forces on the coordinates [N].

    Returns
    -------
    ndarray
    """
    damped = (
        rate * (2 * modes.zeta * modes.omega) if modes.damping is None else rate @ modes.damping.T
    )
    return -np.outer(push, modes.base) - damped - z * modes.omega**2 - pull / modes.mass


def make_histories(
    modes: ModalBasis, drive, time, motion: tuple, face: tuple, extra: dict
) -> Response:
    """Return the histories of a motion and of the first interface.

    Parameters
    ----------
    modes : ModalBasis
    drive
    time : ndarray
        (k,) [s].
    motion : tuple
        Coordinates and rates (k, n).
    face : tuple
        Relative displacement, velocity, force and slip (k,).
    extra : dict

    Returns
    -------
    Response
    """
    z, rate = motion
    slide, speed, force, slip = face
    push = drive.values(time)
    base = push if drive.moving else np.zeros_like(push)
    accel = find_accelerations(modes, push, z, rate, np.outer(force, modes.slide))
    return Response(
        time,
        z,
        rate,
        slide,
        speed,
        z @ modes.output,
        rate @ modes.output,
        accel @ modes.output + base,
        base,
        force,
        slip,
        extra,
    )
