"""Run of an engine: its histories and those of its last cycles, made from modal coordinates.

What an engine integrated over the last cycles itself is a `core.IntegratedMeasures`.
"""

from dataclasses import dataclass, field

import numpy as np

from ..core import ModalBasis, Outcome, Response

ALIKE = 0.95  # length of the mean of unit vectors at twice their phases, from which starts of slip have one phase


def start_phase(count, cosine, sine):
    """Mean phase [rad] modulo pi of the starts of slip, of numbers or (n,) of n runs: their count, and the sums of the
    cosine and of the sine of twice their phases. NaN without a start, and where they differ by more than ALIKE has it:
    the mean of several slips in half a cycle is the phase of none of them."""
    told = (count > 0) & (np.hypot(cosine, sine) >= ALIKE * count)
    return np.where(told, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)[()]


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """A run of an engine: histories, and those of the last cycles; extremes of the output (c, 2) [m] and its part at
    the drive's frequency (c,) [m] per cycle; energies [J] by name; how it ended, None where its amplitudes tell."""

    response: Response
    window: Response
    amplitudes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None = None
    message: str = ""
    snapshots: list = field(default_factory=list)


def accelerations(modes: ModalBasis, push, z, rate, pull) -> np.ndarray:
    """Modal accelerations (k, n) [m s-2] relative to the base, eq. 3.4.

    push (k,) [m s-2]: the drive; z, rate (k, n) [m], [m/s]; pull (k, n) [N]: what the interfaces resist the coordinates
    with.
    """
    damped = (
        rate * (2 * modes.zeta * modes.omega) if modes.damping is None else rate @ modes.damping.T
    )
    return -np.outer(push, modes.base) - damped - z * modes.omega**2 - pull / modes.mass


def histories(modes: ModalBasis, drive, time, motion: tuple, face: tuple, extra: dict) -> Response:
    """The Response at times (k,) [s] of motion (z, rate), (k, n) each, and of the first interface: face (slide, its
    speed, force, slip), (k,) each."""
    z, rate = motion
    slide, speed, force, slip = face
    push = drive.values(time)
    base = push if drive.moving else np.zeros_like(push)
    accel = accelerations(modes, push, z, rate, np.outer(force, modes.slide))
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
