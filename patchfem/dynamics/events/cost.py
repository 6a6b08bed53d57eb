"""Estimates of the CPU time that the event-driven solver takes in interpreted Python.

The engine decides by it whether to compile its loop.

The estimates are the same in every process.
"""

from math import pi, sqrt

import numpy as np

from ...core import ModalBasis
from ...cost_model import PYTHON_PIECE_SECONDS, PYTHON_SAMPLE_TIME_RATIO
from ...structure.drive_sizes import find_max_frequency_ratio


def estimate_cycle_time(modes: ModalBasis, drive, stiffness: float, elements: int) -> float:
    """Estimate the CPU time [s] that one drive cycle takes in interpreted Python.

    Parameters
    ----------
    modes : ModalBasis
    drive
    stiffness : float
        Largest stiffness of an interface [N/m].
    elements : int
        Number of elements of all interfaces.

    Returns
    -------
    float
    """
    n_interfaces = len(modes.interfaces)
    half_damping = float(np.linalg.norm(modes.damping_matrix, 2)) / 2
    added_stiffness = (
        stiffness * float((modes.interfaces**2).sum(axis=1).max(initial=0.0)) / modes.mass
    )
    rate = half_damping + sqrt(half_damping**2 + float(modes.omega.max()) ** 2 + added_stiffness)
    pieces = (
        max(rate * drive.period, 2 * pi * find_max_frequency_ratio(drive)) / 2
        + 4 * n_interfaces
        + 2 * elements
    )
    return PYTHON_PIECE_SECONDS * (1 + modes.omega.size) * (1 + n_interfaces) * pieces


def estimate_sample_time(modes: ModalBasis) -> float:
    """Estimate the CPU time [s] to evaluate one sample of the motion in interpreted Python."""
    return (
        PYTHON_SAMPLE_TIME_RATIO
        * PYTHON_PIECE_SECONDS
        * (1 + modes.omega.size)
        * (1 + len(modes.interfaces))
    )
