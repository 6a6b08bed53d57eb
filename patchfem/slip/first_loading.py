"""Partial slip over the cells of a face: first loading, parallel elements, shear modes, states at a reversal.

Cells yield at fixed tractions. Slip zones only grow within a stroke, so each displacement of the first loading is one
bounded problem from rest, and Masing's rule gives the other strokes.
"""

from typing import NamedTuple

import numpy as np

from .shear_modes import ShearModes

OPEN = 0  # State of a cell without contact
STICK = 1  # State of a cell in contact below its friction limit
SLIP = 2  # State of a cell at its friction limit


class FirstLoading(NamedTuple):
    """First loading of a face from rest to gross slip at n displacements of the holder.

    - displacement (n + 1,): Displacements [m] from 0 to gross slip.
    - force (n + 1,): Friction force [N] at them.
    """

    displacement: np.ndarray
    force: np.ndarray


class SpringSliders(NamedTuple):
    """Parallel springs in series with sliders that have the curve of a first loading.

    - stiffness (k,): [N/m].
    - yield_displacement (k,): [m], increasing.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray


class ReversalState(NamedTuple):
    """State of the cells at the reversal of steady cycles with a displacement amplitude.

    - traction (ny, nx): Shear traction [Pa] of the cells.
    - slip (ny, nx): Slip of the first loading up to the amplitude [m]; a steady cycle slips four times as far.
    - state (ny, nx): OPEN, STICK or SLIP.
    - force: Friction force [N].
    """

    traction: np.ndarray
    slip: np.ndarray
    state: np.ndarray
    force: float


def find_first_loading(shear, limit: np.ndarray, n_displacements: int = 16) -> FirstLoading:
    """Find the force over the displacement of the holder, from rest to gross slip.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    n_displacements : int
        Number of displacements, 12 to 24.

    Returns
    -------
    FirstLoading

    Raises
    ------
    PatchfemError
        If no cell carries load.
    """
    raise NotImplementedError


def make_spring_sliders(first_loading: FirstLoading, count: int = 256) -> SpringSliders:
    """Make parallel elements whose first loading is a given curve.

    Parameters
    ----------
    first_loading : FirstLoading
        Curve, interpolated by monotone cubics.
    count : int
        Number of yield displacements.

    Returns
    -------
    SpringSliders
    """
    raise NotImplementedError


def find_reversal_state(shear, limit: np.ndarray, amplitude: float) -> ReversalState:
    """Find traction, slip and state of the cells at the reversal of a steady cycle.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    amplitude : float
        Amplitude of the displacement of the holder [m].

    Returns
    -------
    ReversalState
    """
    raise NotImplementedError


def find_shear_modes(shear, limit: np.ndarray, n_modes: int) -> ShearModes:
    """Find the most compliant modes of D^1/2 C D^1/2, with D the friction limits [N] of the cells in contact.

    Parameters
    ----------
    shear : CellCompliance
        Shear compliance C of the cells.
    limit : (ny, nx) ndarray
        Friction limit [Pa] of each cell; 0 without contact.
    n_modes : int
        Number of modes, at most that of the cells in contact.

    Returns
    -------
    ShearModes
        Its points are indices into the flattened cells.
    """
    raise NotImplementedError
