"""Modes of masses on springs and dampers between them and to the base (report, figure 16)."""

import numpy as np

from ..core import ModalBasis
from . import matrices


def make_slide_rows(pairs, n: int) -> np.ndarray:
    """Return the rows (k, n) that map the motions of n masses to k relative displacements.

    `pairs` holds k pairs (i, j) of masses, numbered from 1; 0 is the base.
    """
    motions = np.eye(n + 1)[:, 1:]  # row 0, the base, does not move
    first, second = np.array(pairs, int).reshape(-1, 2).T
    return motions[first] - motions[second]


def build_basis(
    masses, springs, dampers, interfaces, output: int, driven_mass: int | None = None
) -> ModalBasis:
    """Compute the modal basis (modal mass 1 kg) of masses that are joined by springs and dampers.

    A mass that no spring holds has a rigid mode.

    Parameters
    ----------
    masses : (n,) array_like
        Masses [kg].
    springs, dampers : sequence of ((i, j), float)
        Pair of masses, numbered from 1 on and 0 for the base, with the stiffness [N/m] or the damping
        coefficient [N s/m] between them.
    interfaces : sequence of (i, j)
        Pairs that slide on each other; the slide is x_i - x_j.
    output : int
        Mass that carries the accelerometer.
    driven_mass : int, optional
        Mass that a force drives; by default the base moves.

    Returns
    -------
    ModalBasis
    """
    n = len(masses)
    unit = np.eye(n)
    return matrices.build_basis(
        np.diag(np.asarray(masses, float)),
        faces=make_slide_rows(interfaces, n) if interfaces else None,
        output=unit[output - 1],
        force=None if driven_mass is None else unit[driven_mass - 1],
        spring_rows=_make_weighted_rows(springs, n),
        damper_rows=_make_weighted_rows(dampers, n),
    )


def _make_weighted_rows(elements, n: int) -> np.ndarray:
    """Return rows (k, n) such that rows^T rows is the stiffness or damping matrix of k springs or dampers.

    `elements` are pairs of (mass, mass), numbered from 1 on and 0 for the base, and a coefficient.
    """
    rows = make_slide_rows([pair for pair, _ in elements], n)
    coefficients = np.array([coefficient for _, coefficient in elements], float)
    return rows * np.sqrt(coefficients)[:, None]
