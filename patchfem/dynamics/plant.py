"""The modes of a rig as the arrays that the compiled loops of a march take."""

from typing import NamedTuple

import numpy as np


class Plant(NamedTuple):
    """The modes as the compiled loops see them.

    omega, damp = 2 zeta omega, slide, base, output: (n,); damping: (n, n) where it couples, else (0, 0); their steps,
    arrays of `propagator.Propagator`, dt [s] and the beta [m/N] of the first interface; mass [kg]; room: (3, n).
    """

    omega: np.ndarray
    damp: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    damping: np.ndarray
    free: np.ndarray
    push: np.ndarray
    dense: np.ndarray
    reach: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    dt: float
    beta: float
    mass: float
    room: np.ndarray
