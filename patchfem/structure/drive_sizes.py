"""Sizes of a drive that defaults and measures need: largest acceleration, speed, frequency, cycle."""

import numpy as np

from ..core import BaseSine, ModalBasis, Start


def own_period(modes: ModalBasis) -> float:
    """Period [s] of the first coordinate that is not rigid; 1 s where all are rigid."""
    alive = modes.omega[modes.omega > 0]
    return float(2 * np.pi / alive[0]) if alive.size else 1.0


def largest(drive) -> float:
    """Largest acceleration of a drive [m s-2], >= 0: of its segments, its samples or its sweep.

    Of a force drive it is the force over the modal mass.
    """
    if isinstance(drive, BaseSine):
        return drive.acceleration
    if drive.segments:
        return max(abs(s.constant) + abs(s.amplitude) for s in drive.segments)
    if hasattr(drive, "value"):
        return float(np.abs(drive.value).max())
    if drive.displacement is not None:
        return drive.displacement * (2 * np.pi * max(drive.low, drive.high))**2
    return drive.acceleration


def omega_of(drive) -> float:
    """Circular frequency [rad/s] of what counts as a drive's cycle, 2 pi/period."""
    return 2 * np.pi / drive.period


def peak_speed(drive, start: Start | None = None) -> float:
    """Scale of the speeds to expect [m/s], >= 0: largest acceleration over omega, or that of the start.

    start: the larger counts, its displacements times the omega of the drive.
    """
    omega = omega_of(drive)
    out = largest(drive) / omega
    if start is not None:
        out = max(out, float(np.abs(start.v).max(initial=0.0)), omega * float(np.abs(start.z).max(initial=0.0)))
    return out


def fastest(drive) -> float:
    """Highest frequency of a drive over that of its cycle."""
    if hasattr(drive, "low"):
        return max(drive.low, drive.high) * drive.period
    return 1.0


def sinusoidal(drive) -> bool:
    """Whether a drive ends as a sine, without which phases and steady cycles mean nothing."""
    return bool(drive.segments) and drive.segments[-1].amplitude != 0


def whole(span: float, drive) -> bool:
    """Whether a window of `span` [s] holds a whole cycle of the drive, as a friction loop needs."""
    return span > drive.period * (1 - 1e-6)  # round-off of times after many cycles
