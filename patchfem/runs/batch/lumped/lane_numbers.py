"""Dimensionless parameters of the cases in lanes.

In: models of one friction law. Out: `Cases` of `dynamics.lanes`, and the `Scales` that convert
results to SI units.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....effects import law_has_trait
from ....friction.laws.iwan import max_yield_displacement
from ....model.model import Model
from ....model.similar_models import collect_columns
from ....structure.drive_sizes import find_max_acceleration

# Name of the law in `dynamics.lanes`, by friction law of the scene.
LANE_LAWS = {
    "coulomb": "rigid",
    "elastic-plastic": "yielding",
    "iwan": "masing",
    "tanh": "friction.laws.tanh_kernels",
    "bouc-wen": "friction.laws.bouc_wen_kernels",
    "lugre": "friction.laws.lugre_kernels",
    "nonlocal": "friction.laws.stretch_kernels",
}
# Largest slip amplitude of a sticking interface, relative to the stretch at the friction limit.
MAX_STICK_SLIP_FRACTION = 1e-3


class Scales(NamedTuple):
    """Scale factors and reference quantities of n dimensionless cases, (n,) each.

    - omega: angular frequency of the drive [rad/s].
    - energy: energy per squared slide [J m-2].
    - ratio: ratio of output to slide [1].
    - max_stick_slip: largest slip amplitude of a sticking interface [m].
    - stiffness: stiffness of the first mode at the contact [N/m].
    - load: normal load [N].
    - acceleration: largest acceleration of the drive [m s-2].
    """

    omega: np.ndarray
    energy: np.ndarray
    ratio: np.ndarray
    max_stick_slip: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray
    acceleration: np.ndarray


class LaneCases(NamedTuple):
    """Dimensionless cases with the same friction law, on the fine and on a coarser mesh.

    - cases, scales: cases and their scales on the fine mesh.
    - coarse: (cases, scales) on the coarser mesh; None without a mesh.
    """

    cases: march.Cases
    scales: Scales
    coarse: tuple | None = None


def select_rows(values, indices):
    """Return selected rows of all arrays in a dict or a (named) tuple."""
    if isinstance(values, dict):
        return {name: select_rows(value, indices) for name, value in values.items()}
    if isinstance(values, tuple):
        parts = [select_rows(value, indices) for value in values]
        return type(values)(*parts) if hasattr(values, "_fields") else tuple(parts)
    return values[indices] if np.ndim(values) else values


def count_evaluated_cycles(cycles: int) -> int:
    """Return the number of evaluated cycles at the end of a run."""
    return min(10, cycles // 10)


def find_lane_law(model: Model) -> str:
    """Return the name of a model's friction law in `dynamics.lanes`."""
    return LANE_LAWS[model.friction.law] if model.patch is None else "table"


class StretchLaw(NamedTuple):
    """Parameters of a stretch law, in which one elastic stretch determines the friction force.

    - numbers: parameters of the `rate_equation` of the law.
    - length: stretch at the friction limit [m]; 0 if there is none.
    """

    numbers: tuple
    length: float


def stretch_law_parameters(model: Model) -> StretchLaw:
    """Return the parameters of the stretch law of a model."""
    friction = model.friction
    load = model.point.load
    limit = model.friction_limits(load)[0]
    if friction.law == "tanh":
        return StretchLaw((limit, 1 / friction.reference_speed), 0.0)
    if law_has_trait(friction.law, "bonds"):
        length = friction.bond_length
        return StretchLaw((limit / length, length), length)
    length = limit / friction.stiffness
    if friction.law == "bouc-wen":
        return StretchLaw((limit, length, friction.exponent, friction.shape), length)
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    parameters = (
        friction.stiffness,
        kinetic * load,
        limit,
        friction.stribeck_speed,
        friction.micro_damping,
        friction.viscous,
    )
    return StretchLaw(parameters, length)


class ContactParameters(NamedTuple):
    """Parameters of a single contact point.

    - stiffness: stiffness during stick [N/m].
    - length: stretch at the friction limit [m].
    - others: further parameters of the law (see `Cases`).
    """

    stiffness: float
    length: float
    others: tuple = ()


def point_contact_parameters(model: Model) -> ContactParameters:
    """Return the contact parameters of a model with a single point."""
    friction = model.friction
    static = model.friction_limits(model.point.load)[0]
    if friction.law == "iwan":
        chi = friction.chi
        fraction = 1 / (1 + friction.beta)
        # fraction of the friction limit that slips before the last slider
        early_slip = fraction * (chi + 1) / (chi + 2 - fraction)
        half_stretch_ratio = np.minimum(1.0, (0.5 / early_slip) ** (1 / (chi + 2)))
        length = max_yield_displacement(static, friction.stiffness, chi, friction.beta)
        return ContactParameters(
            friction.stiffness, length, (chi + 1, fraction, half_stretch_ratio)
        )
    if march.has_one_stretch(LANE_LAWS[friction.law]):
        law = stretch_law_parameters(model)
        stiffness = 0.0 if friction.law == "tanh" else static / law.length
        return ContactParameters(stiffness, law.length, law.numbers)
    if friction.law == "elastic-plastic":
        return ContactParameters(static / friction.bond_length, friction.bond_length)
    return ContactParameters(0.0, 0.0)


def may_create_energy(model: Model):
    """Return whether a stretch law may create energy, or the stretches of its bonds differ."""
    friction = model.friction
    if law_has_trait(friction.law, "bonds"):
        return np.not_equal(friction.breakaway or 0.0, 0.0) | np.not_equal(
            friction.initial_bonds, 1.0
        )
    if friction.law == "lugre":  # for larger damping, the friction power may become negative
        kinetic_limit = stretch_law_parameters(model).numbers[1]
        return np.greater(friction.micro_damping * model.rig.speed_scale, 4 * kinetic_limit)
    return np.less(friction.shape, 0.5) if friction.law == "bouc-wen" else False


def make_cases(models: Sequence[Model], contacts=None) -> tuple[march.Cases, Scales]:
    """Return models as dimensionless cases, and the scales for the conversion to SI units.

    contacts: contact parameters (m, n) as in `_contact_parameters`; None: those of single points.
    """
    rig = _RigParameters(*collect_columns(models, _rig_parameters))
    if contacts is None:
        contacts = collect_columns(models, _contact_parameters)
    static, kinetic, load, spring, length, *others = contacts
    law = find_lane_law(models[0])
    omega = rig.drive_omega
    slide = rig.slide
    scale = slide**2 / (rig.mass * omega**2)
    numbers = np.array(others).T
    if march.has_one_stretch(law):
        numbers = numbers * march.law_number_scales(law, scale, omega)
    else:
        numbers = numbers.reshape(len(omega), -1)
    cases = march.Cases(
        rig.damping / omega,
        (rig.mode_omega / omega) ** 2,
        -slide * rig.base * rig.acceleration / omega**2,
        scale * kinetic,
        scale * static,
        scale * spring,
        length,
        rig.output / slide * omega**2,
        rig.acceleration * rig.moving,
        slide * rig.start,
        slide * rig.start_speed / omega,
        numbers,
    )
    scales = Scales(
        omega=omega,
        energy=rig.mass * (omega / slide) ** 2,
        ratio=rig.output / slide,
        max_stick_slip=MAX_STICK_SLIP_FRACTION
        * np.divide(static, spring, out=0 * omega, where=spring > 0),
        stiffness=rig.stiffness,
        load=load,
        acceleration=rig.max_acceleration,
    )
    return cases, scales


class _RigParameters(NamedTuple):
    """Parameters of a rig with one mode under sinusoidal drive, in SI units.

    - mode_omega, damping: natural frequency and damping rate of the mode [rad/s].
    - slide, base, output, mass: participations of the mode, and its modal mass [kg].
    - acceleration, drive_omega, moving: attributes of the drive (`core.SineDrive`).
    - start, start_speed: modal coordinate and its rate at t = 0.
    - stiffness: stiffness of the first mode at the contact [N/m].
    - max_acceleration: largest acceleration of the drive [m s-2].
    """

    mode_omega: np.ndarray
    damping: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    mass: np.ndarray
    acceleration: np.ndarray
    drive_omega: np.ndarray
    moving: np.ndarray
    start: np.ndarray
    start_speed: np.ndarray
    stiffness: np.ndarray
    max_acceleration: np.ndarray


def _rig_parameters(model: Model) -> _RigParameters:
    """Return the parameters of the single mode and the drive of a model."""
    modes = model.rig.modes
    drive = model.rig.drive.signal
    start = model.rig.start
    return _RigParameters(
        modes.omega[0],
        modes.damping_matrix[0, 0],
        modes.slide[0],
        modes.base[0],
        modes.output[0],
        modes.mass,
        drive.acceleration,
        drive.omega,
        drive.moving,
        0.0 if start is None else start.z[0],
        0.0 if start is None else start.v[0],
        model.rig.first_mode.stiffness,
        find_max_acceleration(drive),
    )


def _contact_parameters(model: Model) -> list:
    """Return the friction limits, the load and the contact parameters of a model as a list.

    The list contains static and kinetic friction limit [N], load [N], and the ContactParameters.
    """
    static, kinetic = model.friction_limits(model.point.load)
    if find_lane_law(model) != "rigid" or model.friction.kinetic is None:
        kinetic = static
    contact = point_contact_parameters(model)
    return [static, kinetic, model.point.load, contact.stiffness, contact.length, *contact.others]
