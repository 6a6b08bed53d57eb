"""Number of steps per cycle for cases in lanes, from the fastest rate of each case.

In: models of one friction law. Out: steps per cycle.
"""

from collections.abc import Sequence

import numpy as np

from ....dynamics.lanes import run as march
from ....model.model import Model
from ....model.similar_models import collect_columns
from ....structure.drive_sizes import find_max_acceleration
from .lane_numbers import LANE_LAWS, may_create_energy, point_contact_parameters

STRETCH_STEPS = (128, 256, 512, 1024, 2048)  # possible steps per cycle of a stretch law
MAX_STEP_PHASE = 0.5  # largest product of fastest rate and step size for a stretch law [rad]
# Fraction of the largest relaxation rate of the tanh law, reached at zero speed, that the steps must resolve.
LAYER_RATE_FRACTION = 0.5
# Rate of the force peak of the LuGre law in a reversal, relative to acceleration / Stribeck speed.
STRIBECK_RATE_FACTOR = 0.75
# Largest ratio of the fastest rate of a single point to the drive frequency, and the steps per cycle for it.
POINT_STEPS = ((5.0, 96), (10.0, 192), (20.0, 384))
# Largest ratio of the fastest rate of a patch to the drive frequency, and the steps per cycle for it.
PATCH_STEPS = ((10.0, 96), (20.0, 192), (40.0, 384), (80.0, 768))


def steps_per_cycle(models: Sequence[Model]) -> np.ndarray:
    """Return the steps per cycle (n,) for models of one law; 0 for cases that need too many."""
    limits = POINT_STEPS
    if march.has_one_stretch(LANE_LAWS[models[0].friction.law]):
        limits = [(MAX_STEP_PHASE * steps / (2 * np.pi), steps) for steps in STRETCH_STEPS]
    return steps_for_rates(
        collect_columns(models, lambda model: (_max_relative_rate(model),))[0], limits
    )


def steps_for_rates(rates, limits) -> np.ndarray:
    """Return the steps per cycle (n,) for ratios (n,) of fastest rate to drive frequency.

    limits: sequence of (largest rate, steps per cycle); 0 steps above the last rate.
    """
    steps = np.append([steps for _, steps in limits], 0)
    return steps[np.searchsorted([limit for limit, _ in limits], rates)]


def relative_stick_rate(model: Model, stiffness):
    """Return the ratio of the fastest rate during stick to the drive frequency."""
    modes = model.rig.modes
    rate = np.sqrt(modes.omega[0] ** 2 + stiffness * modes.slide[0] ** 2 / modes.mass)
    return (rate + modes.damping_matrix[0, 0]) / model.rig.drive.signal.omega


def _max_relative_rate(model: Model):
    """Return the ratio of the fastest rate of a model to its drive frequency; inf if unresolvable."""
    friction = model.friction
    stiffness = point_contact_parameters(model).stiffness
    if not march.has_one_stretch(LANE_LAWS[friction.law]):
        return relative_stick_rate(model, stiffness)
    modes = model.rig.modes
    omega = model.rig.drive.signal.omega
    scale = modes.slide[0] ** 2 / modes.mass
    rate = modes.damping_matrix[0, 0]
    if friction.law == "tanh":
        friction_limit = model.friction_limits(model.point.load)[0]
        rate = friction_limit / friction.reference_speed * scale + rate
        max_rate = MAX_STEP_PHASE * STRETCH_STEPS[-1] / (2 * np.pi) * omega
        rate = np.where(rate > max_rate, np.inf, LAYER_RATE_FRACTION * rate)
    # the force peak of LuGre in a reversal lasts while the speed is below the Stribeck speed
    if friction.law == "lugre":
        acceleration = np.abs(modes.slide[0] * modes.base[0]) * find_max_acceleration(
            model.rig.drive.signal
        )
        rate = np.maximum(rate, STRIBECK_RATE_FACTOR * acceleration / friction.stribeck_speed)
    rate = np.maximum(rate, np.sqrt(modes.omega[0] ** 2 + stiffness * scale)) / omega
    return np.where(may_create_energy(model), np.inf, rate)
