"""Measures of the batches of `batch.lumped.pieces`.

In: a run of `dynamics.events`, whose interfaces have Coulomb friction, elastic-plastic elements or no friction. Out: a
Solution whose measures come from the power series of the time intervals between events.
"""

from time import perf_counter

import numpy as np

from ....dynamics.events import elements
from ....dynamics.events.positions_kernels import InterfaceMeasure
from ....dynamics.events.reading import Reading
from ....effects import law_has_trait
from ....response.loops import interface_loops
from ....response.measures import MIN_SLIDE_RANGE, relative_gap
from ....response.rows import stick_fraction
from ....response.spectrum import distortion_ratio
from ...bench import averaged_law
from ...rig import interface, strips
from ...rig.solution import first_interface_load

MAX_CHANGE_RATIO = 1e-2  # Largest ratio of the change of a steady motion to the tolerance.


class YieldingElements:
    """Elastic-plastic friction elements of all interfaces of a model.

    - groups: elements of each interface.
    - contact: ContactModel of a single interface.
    - stick_tolerance: largest slip per cycle [m] at which the interface counts as stuck.
    - seconds: CPU time of the reduction [s].
    """

    is_rigid = False

    def __init__(self, model, numerics, patch):
        rig = model.rig
        self.contact = None
        begin = perf_counter()
        if len(rig.modes.interfaces) > 1:
            parts = interface.make_interface_elements(model, numerics.meshed)
        else:
            self.contact = interface.make_single_contact(model, numerics, patch)
            parts = [self.contact.element]
        lengths = [element.length for element in parts if element.limit > 0]
        self.stick_tolerance = 1e-3 * min(lengths, default=0.0)
        self.groups = tuple(convert_to_elements(element) for element in parts)
        self.seconds = perf_counter() - begin


class RigidElements:
    """Rigid friction elements of all Coulomb interfaces of a model.

    There is no elastic displacement, so any motion of the interface counts as slip.
    """

    is_rigid = True
    contact = None
    stick_tolerance = 0.0
    seconds = 0.0

    def __init__(self, model, numerics, patch):
        limits = coulomb_limits(model, patch)
        self.groups = tuple(elements.make_coulomb_elements(*pair) for pair in limits)


def coulomb_limits(model, patch) -> list:
    """Return the static and kinetic friction limits [N] of each Coulomb interface."""
    rig = model.rig
    friction = model.friction
    if rig.friction.strips_slide_apart:
        loads = strips.compute_strip_loads(patch)
        return [tuple(map(float, model.friction_limits(load))) for load in loads]
    if friction is None:
        return [(0.0, 0.0)] * len(rig.modes.interfaces)
    if rig.friction.names:
        laws = rig.friction.interfaces
        return [tuple(map(float, law.friction_limits(law.load))) for law in laws]
    static, kinetic = model.friction_limits(first_interface_load(model, patch))
    if law_has_trait(friction.law, "averaged"):
        static = static * averaged_law.slip_force_ratio(model, patch)
    if friction.kinetic is None:
        kinetic = static
    return [(float(static), float(kinetic))]


def convert_to_elements(element) -> elements.Elements:
    """Convert a law of parallel springs and sliders to elastic-plastic elements."""
    count = int(element.numbers[1])
    return elements.make_elements(
        element.numbers[2 : 2 + count], element.numbers[2 + count : 2 + 2 * count]
    )


def compute_event_measures(
    reading: Reading,
    energies: dict,
    *,
    is_sine: bool,
    is_complete: bool,
    stiffness,
    acceleration,
) -> dict:
    """Compute measures of the motion and of the first interface of event-driven runs.

    Arrays evaluate several runs at once.

    Parameters
    ----------
    reading : Reading
    energies : dict
        Energies of the run [J].
    is_sine : bool
        Whether the drive is sinusoidal at the end of the run.
    is_complete : bool
        Whether the evaluated cycles are complete.
    stiffness : float or (n,)
        Stiffness of the first mode referred to the contact [N/m]; 0 if the run has no damping
        ratio.
    acceleration : float or (n,)
        Acceleration amplitude of the drive [m s-2].

    Returns
    -------
    dict
        Measures by name; NaN if a run does not have a measure.
    """
    nan = np.full(np.shape(reading.output_amplitude), np.nan)[()]
    valid = is_sine and is_complete
    first, third = reading.acceleration_harmonics
    loop = reading.loop()
    values = {
        "relative_displacement_amplitude": reading.output_amplitude,
        "absolute_acceleration_peak": reading.acceleration,
        "absolute_acceleration_fundamental": first if valid else nan,
        "acceleration_distortion": distortion_ratio(first, third, acceleration) if valid else nan,
        "drift_per_cycle": reading.drift,
        "slip_start_phase": reading.slip_start_phase if is_sine else nan,
        "work_check": _compute_work_check(reading, energies),
        "slip_amplitude": loop.slip_range / 2,
        "friction_force_peak": loop.max_force,
        "stick_fraction": stick_fraction(loop.stuck_time, reading.span),
    }
    if not is_complete:
        return values
    return values | _compute_loop_measures(reading, stiffness, is_sine=is_sine)


def _compute_loop_measures(reading: Reading, stiffness, *, is_sine: bool) -> dict:
    """Compute the measures of the friction loop of the first interface."""
    loop = reading.loop()
    moves = (
        reading.interface_value(InterfaceMeasure.MAX_SLIDE)
        - reading.interface_value(InterfaceMeasure.MIN_SLIDE)
        > MIN_SLIDE_RANGE
    ) & is_sine
    half = np.where(moves, reading.interface_value(InterfaceMeasure.MEAN_RANGE) / 2, 0.0)[()]
    work = loop.work * reading.period / reading.span
    secant = np.where(moves, reading.interface_value(InterfaceMeasure.SECANT), np.nan)[()]
    measures = interface_loops(
        half, loop.displacement_harmonic, loop.force_harmonic, work, stiffness
    )
    return measures | {"secant_stiffness": secant}


def _compute_work_check(reading: Reading, energies: dict):
    """Return the relative difference of the friction work from samples and from the energy balance.

    The samples are the ends of the time intervals, between which the trapezoidal rule is used.
    """
    sampled = reading.faces[..., InterfaceMeasure.END_WORK].sum(axis=-1)
    booked = reading.faces[..., InterfaceMeasure.WORK].sum(axis=-1)
    exchanged = reading.faces[..., InterfaceMeasure.PATH_WORK].sum(axis=-1)
    return relative_gap(sampled, booked, exchanged, energies["power"] + energies["peak_stored"])
