"""Steps per cycle of the cases that march in lanes, from the fastest rate of each case.

In: models of one friction law. Out: steps per cycle.
"""

from collections.abc import Sequence

import numpy as np

from ....dynamics.lanes import run as march
from ....model.model import Model
from ....model.similar_models import collect_columns
from ....structure.drive_sizes import find_max_acceleration
from .lane_numbers import LANE_LAWS, make_point_contact, may_create_energy

STRETCH_STEPS = (128, 256, 512, 1024, 2048)  # steps per cycle under a stretch law
MAX_STEP_PHASE = 0.5  # largest phase of the fastest rate of a stretch law in a step [rad]
# Fraction of the relaxation rate at the speeds around 0, where tanh regularises the friction, that the steps
# have to resolve.
LAYER_RATE_FRACTION = 0.5
# Ratio of the rate of the force peak of LuGre to (acceleration / Stribeck speed), which is the inverse of
# the time in which a reversal passes this speed.
STRIBECK_RATE_FACTOR = 0.75
# largest ratio of the fastest rate of a single point to that of the drive, and the steps per cycle for it
POINT_STEPS = ((5.0, 96), (10.0, 192), (20.0, 384))
# largest ratio of the fastest rate of a patch of sliders to that of the drive, and the steps per cycle for it
PATCH_STEPS = ((10.0, 96), (20.0, 192), (40.0, 384), (80.0, 768))


def steps_per_cycle(models: Sequence[Model]) -> np.ndarray:
    """Return the time steps per cycle (n,) of models of one law; 0 for cases that need too many."""
    ends = POINT_STEPS
    if march.has_one_stretch(LANE_LAWS[models[0].friction.law]):
        ends = [(MAX_STEP_PHASE * steps / (2 * np.pi), steps) for steps in STRETCH_STEPS]
    return select_steps_for_rates(
        collect_columns(models, lambda model: (_fastest_relative_rate(model),))[0], ends
    )


def select_steps_for_rates(rates, ends) -> np.ndarray:
    """Return the steps per cycle (n,) for ratios (n,) of fastest rate to drive frequency.

    ends: sequence of (largest rate, steps).
    """
    steps = np.append([steps for _, steps in ends], 0)
    return steps[np.searchsorted([end for end, _ in ends], rates)]


def fastest_rate(model: Model, stiffness):
    """Return the ratio of the fastest rate of a sticking rig to the drive frequency."""
    modes = model.rig.modes
    rate = np.sqrt(modes.omega[0] ** 2 + stiffness * modes.slide[0] ** 2 / modes.mass)
    return (rate + modes.damping_matrix[0, 0]) / model.rig.drive.signal.omega


def _fastest_relative_rate(model: Model):
    """Return the ratio of the fastest rate of a model to its drive; inf if it is unresolvable."""
    friction = model.friction
    stiffness = make_point_contact(model).stiffness
    if not march.has_one_stretch(LANE_LAWS[friction.law]):
        return fastest_rate(model, stiffness)
    modes = model.rig.modes
    omega = model.rig.drive.signal.omega
    scale = modes.slide[0] ** 2 / modes.mass
    rate = modes.damping_matrix[0, 0]
    if friction.law == "tanh":
        limit = model.friction_limits(model.point.load)[0]
        rate = limit / friction.reference_speed * scale + rate
        max_rate = MAX_STEP_PHASE * STRETCH_STEPS[-1] / (2 * np.pi) * omega
        rate = np.where(rate > max_rate, np.inf, LAYER_RATE_FRACTION * rate)
    # the force peak of LuGre in a reversal lasts as long as the speed is below the Stribeck speed
    if friction.law == "lugre":
        acceleration = np.abs(modes.slide[0] * modes.base[0]) * find_max_acceleration(
            model.rig.drive.signal
        )
        rate = np.maximum(rate, STRIBECK_RATE_FACTOR * acceleration / friction.stribeck_speed)
    rate = np.maximum(rate, np.sqrt(modes.omega[0] ** 2 + stiffness * scale)) / omega
    return np.where(may_create_energy(model), np.inf, rate)
