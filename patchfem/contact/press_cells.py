"""Pressing of two faces that are divided into cells, by a load or an approach, with free or fixed tilts."""

from typing import NamedTuple

import numpy as np

from .cells import CellCompliance


class FaceLoading(NamedTuple):
    """Load and prescribed motions of the holder of a face.

    - load: Normal load [N]; None under a prescribed approach.
    - approach: Approach [m] in place of a load, at fixed tilts.
    - line_x, line_y: Position of the load [m]; the tilt along that axis is free. None: the tilt is fixed.
    - spring_x, spring_y: Stiffness [N m/rad] of the holder against the tilt along each axis, unloaded at the tilt that the
      gap contains.
    - hardness: Largest pressure [Pa].
    """

    load: float | None = None
    approach: float = 0.0
    line_x: float | None = None
    line_y: float | None = None
    spring_x: float = 0.0
    spring_y: float = 0.0
    hardness: float = np.inf


class PressedCells(NamedTuple):
    """Pressed cells.

    - pressure, gap (ny, nx): Pressure [Pa] and gap under load [m].
    - approach: Approach of the holder [m].
    - tilt_x, tilt_y: Tilts [rad] that the holder adds to those in the gap: positive ones open the gap at +x and at +y. A
      tilt along x turns the holder about y.
    - n_iterations: Number of products with the compliance.
    - residual: Largest wrong gap over the largest displacement.
    """

    pressure: np.ndarray
    gap: np.ndarray
    approach: float
    tilt_x: float
    tilt_y: float
    n_iterations: int
    residual: float


def press_cells(
    compliance: CellCompliance,
    gap: np.ndarray,
    loading: FaceLoading,
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
) -> PressedCells:
    """Press two faces.

    Parameters
    ----------
    compliance : CellCompliance
        Normal compliance of the cells.
    gap : (ny, nx) ndarray
        Gap of the unloaded faces [m], with fixed tilts.
    loading : FaceLoading
        Load or approach, load line, springs and hardness.
    start : (ny, nx) ndarray, optional
        Pressure [Pa] of a similar problem.
    tolerance : float
        Largest wrong gap over the largest displacement.

    Returns
    -------
    PressedCells

    Raises
    ------
    NotConverged
        If the tolerance is not met.
    """
    raise NotImplementedError


def compute_set_stiffness(
    compliance: CellCompliance, active: np.ndarray, motion: np.ndarray | float = 1.0
) -> float:
    """Compute the stiffness of a contact set against a motion of its cells.

    Parameters
    ----------
    compliance : CellCompliance
        Normal or shear compliance.
    active : (ny, nx) bool ndarray
        Cells in contact.
    motion : (ny, nx) ndarray or float
        Displacement of the cells per unit: 1 for a translation, x or y for a tilt.

    Returns
    -------
    float
        Stiffness [N/m], or [N m/rad] for a tilt.
    """
    raise NotImplementedError
