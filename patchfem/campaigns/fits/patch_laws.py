"""Single-point friction laws fitted to given friction loops.

Each law has the slip force of the loops. Its other parameters minimise the sum of squares of the
relative deviations in force at the reversals and, with a fifth of the weight, in loss per cycle.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...friction.record import steady_loop
from ...identify.least_squares import Fit, Problem

MIN_LOSS = 1e-3  # Smallest loss/(4 x force x displacement) of a slipping patch.
# Weights of the relative deviations in force and in loss; the relative error of a loss is 5 times
# that of a force.
WEIGHTS = np.array([[1.0], [0.2]])
# Largest ratio of the stiffness of a law to that of the patch, and of its inverse.
STIFFNESS_RANGE = 20.0


class LawParameters(NamedTuple):
    """Parameters of a law that are fitted in addition to its stiffness.

    The stiffness is fitted as a multiple of that of the patch.

    Attributes
    ----------
    low, high : tuple
        Bounds of the parameters (n,).
    make_keys : callable
        Function (stiffness [N/m], slip force [N], *values) that returns the [friction] keys.
    units : dict
        Unit by key; keys without a unit are missing.
    """

    low: tuple
    high: tuple
    make_keys: Callable
    units: dict


def _iwan_keys(stiffness: float, slip_force: float, chi: float, fraction: float) -> dict:
    """Return the [friction] keys of law "iwan" for fitted values."""
    return {"stiffness": stiffness, "chi": chi, "beta": fraction / (1 - fraction)}


def _bouc_wen_keys(stiffness: float, slip_force: float, exponent: float, shape: float) -> dict:
    """Return the [friction] keys of law "bouc-wen" for fitted values."""
    return {"stiffness": stiffness, "exponent": exponent, "shape": shape}


def _elastic_plastic_keys(stiffness: float, slip_force: float) -> dict:
    """Return the [friction] keys of law "elastic-plastic" for fitted values."""
    return {"bond_length": slip_force / stiffness}


FITTED_LAWS = {
    "iwan": LawParameters((-0.999, 0.0), (0.0, 0.999), _iwan_keys, {"stiffness": "N/m"}),
    "bouc-wen": LawParameters((0.02, 0.5), (50.0, 1.0), _bouc_wen_keys, {"stiffness": "N/m"}),
    "elastic-plastic": LawParameters((), (), _elastic_plastic_keys, {"bond_length": "m"}),
}


class LoopCurves(NamedTuple):
    """Friction force at the reversals [N] and energy loss per cycle [J], (k,) each."""

    force: np.ndarray
    loss: np.ndarray

    def relative_deviations(self, target: "LoopCurves", amplitudes) -> np.ndarray:
        """Return the relative deviations (2, k) from target curves at amplitudes (k,) [m]."""
        scale = np.maximum(target.loss, MIN_LOSS * 4 * amplitudes * target.force)
        return np.array([self.force / target.force - 1, (self.loss - target.loss) / scale])


class FittedLaw(NamedTuple):
    """Single-point friction law that replaces a patch, with its deviations from the patch.

    Attributes
    ----------
    values : dict
        Values by key of [friction].
    curves : LoopCurves
    deviations : (2, k) array
        Relative deviations of `curves` from those of the patch.
    fit : Fit
    """

    values: dict
    curves: LoopCurves
    deviations: np.ndarray
    fit: Fit


class LawProblem(NamedTuple):
    """Least-squares fit of a friction law to the friction loops of a joint.

    Attributes
    ----------
    law : str
        One of FITTED_LAWS.
    static : float
        Coefficient of friction.
    load : float
        Normal load [N]; the slip force is static x load.
    amplitudes : (k,) array
        Displacement amplitudes [m].
    target : LoopCurves
        Force and loss of the joint at these amplitudes.
    stiffness : float
        Stiffness of the joint [N/m], the initial value of the stiffness of the law.
    """

    law: str
    static: float
    load: float
    amplitudes: np.ndarray
    target: LoopCurves
    stiffness: float

    def make_keys(self, values) -> dict:
        """Return the [friction] keys for given fit parameters (n,)."""
        slip_force = self.static * self.load
        return FITTED_LAWS[self.law].make_keys(values[0] * self.stiffness, slip_force, *values[1:])

    def compute_curves(self, values) -> LoopCurves:
        """Compute peak force and energy loss of the law for given fit parameters (n,)."""
        friction = _FrictionTable(self.law, self.static, self.make_keys(values))
        return LoopCurves(*steady_loop(friction, self.load, self.amplitudes))

    def compute_deviations(self, values) -> np.ndarray:
        """Return the relative deviations (2, k) of the law from the friction loops of the joint."""
        return self.compute_curves(values).relative_deviations(self.target, self.amplitudes)

    def solve(self) -> FittedLaw:
        """Fit the parameters of the friction law."""
        parameters = FITTED_LAWS[self.law]
        range_middles = [(low + high) / 2 for low, high in zip(parameters.low, parameters.high)]
        problem = Problem(
            residual=lambda values: (WEIGHTS * self.compute_deviations(values)).ravel(),
            low=(1 / STIFFNESS_RANGE, *parameters.low),
            high=(STIFFNESS_RANGE, *parameters.high),
            start=(1.0, *range_middles),
        )
        fit = problem.solve(max_descents=2, interval_kind="bounds")
        values = fit.values
        return FittedLaw(
            self.make_keys(values.tolist()),
            self.compute_curves(values),
            self.compute_deviations(values),
            fit,
        )


class _FrictionTable:
    """Substitute for a validated [friction] table, whose values are set without validation.

    The values lie within the bounds of the fit.
    """

    def __init__(self, law: str, static: float, values: dict):
        self.__dict__.update(values, law=law, static=static)
