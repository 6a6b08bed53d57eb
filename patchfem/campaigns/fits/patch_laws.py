"""Friction laws of a single point, fitted to given friction loops.

Each law has the slip force of the loops. Its other values minimise the squares of the relative
differences in force at the reversals and, with a fifth of the weight, in loss per cycle.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...friction.record import steady_loop
from ...identify.least_squares import Fit, Problem

MIN_LOSS = 1e-3  # Loss/(4 x force x displacement) above which the patch counts as slipping.
# Weights of the differences in force and in loss; the relative error of the loss is 5 times as
# large.
WEIGHTS = np.array([[1.0], [0.2]])
# Factor below and above the stiffness of the patch up to which that of a law is searched for.
STIFFNESS_RANGE = 20.0


class LawKeys(NamedTuple):
    """Parameters of a law that are fitted in addition to its stiffness.

    The stiffness is fitted as a multiple of that of the patch.

    Attributes
    ----------
    low, high : tuple
        Bounds (n,).
    keys : callable
        (stiffness [N/m], slip force [N], *values) -> keys of [friction].
    units : dict
        Unit by key, for keys that have one.
    """

    low: tuple
    high: tuple
    keys: Callable
    units: dict


def _iwan_keys(stiffness: float, slip_force: float, chi: float, fraction: float) -> dict:
    """Return the scene keys of law "iwan" for fitted values."""
    return {"stiffness": stiffness, "chi": chi, "beta": fraction / (1 - fraction)}


def _bouc_wen_keys(stiffness: float, slip_force: float, exponent: float, shape: float) -> dict:
    """Return the scene keys of law "bouc-wen" for fitted values."""
    return {"stiffness": stiffness, "exponent": exponent, "shape": shape}


def _elastic_plastic_keys(stiffness: float, slip_force: float) -> dict:
    """Return the scene keys of law "elastic-plastic" for fitted values."""
    return {"bond_length": slip_force / stiffness}


FITTED_LAWS = {
    "iwan": LawKeys((-0.999, 0.0), (0.0, 0.999), _iwan_keys, {"stiffness": "N/m"}),
    "bouc-wen": LawKeys((0.02, 0.5), (50.0, 1.0), _bouc_wen_keys, {"stiffness": "N/m"}),
    "elastic-plastic": LawKeys((), (), _elastic_plastic_keys, {"bond_length": "m"}),
}


class Curves(NamedTuple):
    """Friction force at the reversals [N] and energy loss per cycle [J], (k,) each."""

    force: np.ndarray
    loss: np.ndarray

    def relative_deviations(self, target: "Curves", slides) -> np.ndarray:
        """Return the relative differences (2, k) from target curves at amplitudes (k,) [m]."""
        scale = np.maximum(target.loss, MIN_LOSS * 4 * slides * target.force)
        return np.array([self.force / target.force - 1, (self.loss - target.loss) / scale])


class FittedLaw(NamedTuple):
    """Friction law of a point that replaces a patch, with its deviations.

    Attributes
    ----------
    values : dict
        Values by key of [friction].
    curves : Curves
    deviations : (2, k) array
        Relative differences of the curves from those of the patch.
    fit : Fit
    """

    values: dict
    curves: Curves
    deviations: np.ndarray
    fit: Fit


class LawProblem(NamedTuple):
    """Least-squares fit of a friction law to the loops of a joint.

    Attributes
    ----------
    law : str
        One of FITTED_LAWS.
    static : float
        Coefficient of friction.
    load : float
        Normal load [N]; the slip force is static x load.
    slides : (k,) array
        Displacement amplitudes [m].
    target : Curves
        Curves of the joint at these amplitudes.
    stiffness : float
        Stiffness of the joint [N/m], near which that of the law is searched.
    """

    law: str
    static: float
    load: float
    slides: np.ndarray
    target: Curves
    stiffness: float

    def keys(self, values) -> dict:
        """Return the [friction] keys for given fit parameters (n,)."""
        slip_force = self.static * self.load
        return FITTED_LAWS[self.law].keys(values[0] * self.stiffness, slip_force, *values[1:])

    def curves(self, values) -> Curves:
        """Compute force and loss of the law for given fit parameters (n,)."""
        friction = _FrictionKeys(self.law, self.static, self.keys(values))
        return Curves(*steady_loop(friction, self.load, self.slides))

    def deviations(self, values) -> np.ndarray:
        """Return the relative differences (2, k) of the law from the loops of the joint."""
        return self.curves(values).relative_deviations(self.target, self.slides)

    def solve(self) -> FittedLaw:
        """Fit the parameters of the friction law."""
        other = FITTED_LAWS[self.law]
        middle = [(low + high) / 2 for low, high in zip(other.low, other.high)]
        problem = Problem(
            residual=lambda values: (WEIGHTS * self.deviations(values)).ravel(),
            low=(1 / STIFFNESS_RANGE, *other.low),
            high=(STIFFNESS_RANGE, *other.high),
            start=(1.0, *middle),
        )
        fit = problem.solve(max_descents=2, interval_kind="bounds")
        values = fit.values
        return FittedLaw(
            self.keys(values.tolist()), self.curves(values), self.deviations(values), fit
        )


class _FrictionKeys:
    """Stand-in for a [friction] table with values within the bounds of the fit.

    Its values need no check.
    """

    def __init__(self, law: str, static: float, values: dict):
        self.__dict__.update(values, law=law, static=static)
