"""Measures of the steady motions that `steady.maps` finds, and of the batches of `batch.lumped.pieces`.

In: a run of `dynamics.events`, whose interfaces have Coulomb friction, elastic-plastic elements or no friction. Out: a
Solution whose measures come from the power series of the time intervals between events.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...core import IntegratedMeasures, InterfaceLoop, NotConverged, SineDrive
from ...dynamics.events import elements, histories
from ...dynamics.events import steady as steady_events
from ...dynamics.events.positions_kernels import InterfaceMeasure
from ...dynamics.events.reading import Reading
from ...effects import law_has_trait
from ...response import run_events
from ...response.loops import interface_loops
from ...response.measures import MIN_SLIDE_RANGE, compute_harmonic, relative_gap
from ...response.ringing import compute_stuck_vibration, make_ringing_measures, select_strongest
from ...response.rows import stick_fraction
from ...response.spectrum import distortion_ratio
from ...structure.drive_sizes import (
    find_drive_omega,
    find_max_acceleration,
    has_full_cycle,
    is_periodic,
    is_sinusoidal,
)
from ..bench import averaged_law
from . import interface, strips
from .evaluation import RunEvaluator
from .solution import first_interface_load, first_mode_stiffness

# Measures of the motion that also exist without an interface.
MOTION_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "absolute_acceleration_fundamental",
    "acceleration_distortion",
)
MAX_CHANGE_RATIO = 1e-2  # Largest ratio of the change of a steady motion to the tolerance.
# Number of windows at the end of a run from which the change of the motion is determined.
N_CHANGE_WINDOWS = 3
# Smallest relative decay of a free motion over the last windows that is assumed; less damping counts
# as this decay.
MIN_RELATIVE_DECAY = 1e-6


class EventEvaluator(RunEvaluator):
    """Evaluation of the runs of the event-driven engines.

    `contact_elements` are the RigidElements or YieldingElements of the run.
    """

    def __init__(self, model, numerics, patch, contact_elements):
        super().__init__(
            model,
            numerics,
            patch,
            contact_elements.contact,
            contact_elements.stick_tolerance,
            histories.SAMPLES_PER_CYCLE,
        )
        self.groups = contact_elements.groups
        self.is_rigid = contact_elements.is_rigid
        self.reduction_seconds = contact_elements.seconds
        self.strips_slide_independently = (
            contact_elements.is_rigid and model.rig.friction.strips_slide_apart
        )

    def average_over_strips(self, run):
        """Average the histories of strips that slide independently."""
        if not self.strips_slide_independently:
            return run
        loads = strips.compute_strip_loads(self.patch)
        offsets = self.patch.strips.offsets
        return replace(
            run,
            response=strips.average_histories_over_strips(run.response, loads, offsets),
            window=strips.average_histories_over_strips(run.window, loads, offsets),
        )

    def is_stuck(self, run) -> bool:
        """Return whether the interface sticks; strips that slide independently must all stick."""
        if self.strips_slide_independently and self.has_friction:
            return run_events.is_all_stuck(run.window, self.stick_tolerance)
        return super().is_stuck(run)

    def compute_integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures that the engine computes from the intervals between events.

        Strips that slide independently have a single loop of their mean displacement, which is
        computed from samples.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.compute_integrated_measures`.
        """
        values = compute_event_measures(
            run.reading,
            run.ledger,
            is_sine=is_sinusoidal(drive),
            is_complete=bool(has_full_cycle(run.reading.span, drive)),
            stiffness=first_mode_stiffness(self.model, run.window),
            acceleration=find_max_acceleration(drive),
        )
        floats = {name: None if np.isnan(value) else float(value) for name, value in values.items()}
        names = list(floats)
        if not self.has_friction:
            names = [*MOTION_MEASURES, "drift_per_cycle"]
        elif self.strips_slide_independently:
            names = [*MOTION_MEASURES, "slip_start_phase"]
        return IntegratedMeasures(
            {name: floats[name] for name in names},
            loops=self.find_friction_loops(run, drive),
        )

    def find_friction_loops(self, run, drive) -> tuple:
        """Return the friction loop of each interface, or the mean loop of independent strips."""
        return (_compute_strips_loop(run, drive),) if self.strips_slide_independently else run.loops

    def collect_cycle_data(self, run, drive, *, stuck: bool) -> dict:
        """Return the energies of rigid elements, which dissipate all friction work.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.collect_cycle_data`.
        """
        if not (self.has_friction and self.is_rigid):
            return {}
        lost = run.ledger["friction"]
        return {
            "ledger": np.array([[lost], [0.0], [lost], [0.0]]),
            "is_single_interface": self.strips_slide_independently,
        }

    def measure_ringing(self, run, drive) -> tuple:
        """Compute frequency and damping of the free vibration during stick, with error estimates.

        Both have a closed form for a single element, and if every interface sticks until the end of
        a run without sinusoidal drive. In other runs they are measured in the stick intervals.
        """
        if not self.has_friction:
            return {}, {}
        if run.ring is not None:
            return make_ringing_measures(*run.ring, run.acceleration), {}
        if vibration := self.compute_stuck_vibration(run, run.window, drive):
            mode = select_strongest(vibration, "acceleration")
            omega = 2 * np.pi * mode.frequency
            return make_ringing_measures(
                mode.acceleration, omega, mode.damping, run.acceleration
            ), {}
        return run_events.measure_ringing_in_sticks(
            run.window, self.model.rig.modes, drive, run.log, repeats=run.repeats
        )

    def compute_stuck_vibration(self, run, motion, drive) -> list:
        """Return the free vibration of the modes while every interface sticks until the end.

        The list is empty unless every interface is a single spring that sticks until the end, and
        the drive is constant in this part of the run.

        Parameters
        ----------
        run : EventRunResult
        motion : Response
            Part of its histories in which the interfaces stick.
        drive
            Drive of the run.
        """
        springs = [group.stiffness for group in self.groups]
        is_stuck = (
            self.has_friction
            and not self.is_rigid
            and all(spring.size == 1 for spring in springs)
            and not any(loop.slip_range for loop in run.loops)
            and (not run.log.time.size or run.log.time[-1] < motion.time[0])
        )
        if not is_stuck or is_periodic(drive) or not drive.segments or motion.time.size < 2:
            return []
        return compute_stuck_vibration(self.model.rig.modes, np.concatenate(springs), motion)

    def estimate_run_errors(self, run, drive, values: dict) -> dict:
        """Estimate the errors due to sampling, and the error of the drift of rigid elements.

        The drift of rigid elements has the round-off of the difference of two means; a window
        shorter than 1.5 cycles has no means, only its ends. The means of independent strips are
        those of cubics through 400 samples per cycle. Their error is h^4/384 times the fourth
        derivative, and a comparison with 8000 samples per cycle gave 2e-14 of the range, because
        both cycles have nearly the same error. A jump excites a mode with r times the drive
        frequency in proportion to 1/r^2, and the fourth derivative increases with r^4, so the error
        increases with r^2.

        Parameters
        ----------
        run, drive, values
            See `RunEvaluator.estimate_run_errors`.
        """
        window = run.window
        modes = self.model.rig.modes
        errors = {}
        if not self.strips_slide_independently:
            errors = self.estimate_sampling_errors(run, drive, values)
        if not self.is_rigid or window.time[-1] - window.time[0] < 1.5 * drive.period:
            return errors
        if not self.strips_slide_independently:
            return errors | {
                "drift_per_cycle": 1e-14 * float(np.abs(window.slide).max(initial=0.0))
            }
        faster = max(1.0, float(modes.omega.max()) / find_drive_omega(drive)) ** 2
        return errors | {"drift_per_cycle": 1e-13 * faster * float(np.ptp(window.slide))}


def _compute_strips_loop(run, drive) -> InterfaceLoop:
    """Compute the friction loop of a patch from the samples of its independent strips.

    Each event has samples on both sides. The yaw does work in addition to that of the mean
    displacement.
    """
    window = run.window
    omega = find_drive_omega(drive)
    gaps = np.diff(window.time)
    weight = np.concatenate([[0.0], gaps / 2]) + np.concatenate([gaps / 2, [0.0]])
    is_stuck = ~window.extra["slide_rates"].any(axis=1)
    power = (window.extra["forces"] * window.extra["slide_rates"]).sum(axis=1)
    slide = window.slide - weight @ window.slide / weight.sum()
    return InterfaceLoop(
        displacement_harmonic=complex(compute_harmonic(window.time, weight, slide, omega)),
        force_harmonic=complex(compute_harmonic(window.time, weight, window.force, omega)),
        work=float(weight @ power),
        slip_range=float(np.ptp(window.slip)),
        stuck_time=float(weight[is_stuck].sum()),
        max_force=float(np.abs(window.force).max()),
    )


def may_still_change(extremes, window: int, tolerance: float, decay: float) -> bool:
    """Return whether a motion may still change by more than a fraction of the tolerance.

    This is the case if the run is too short. Otherwise, the change of the extremes in the last
    N_CHANGE_WINDOWS windows is divided by the fraction by which the slowest free motion decays in
    this time, because the extremes of a slow beat hardly change near its maximum.

    Parameters
    ----------
    extremes : (c, 2)
        Minimum and maximum output of each cycle [m].
    window : int
        Number of cycles in a window.
    tolerance : float
    decay : float
        Exponent of the decay of the slowest free motion per cycle [1].
    """
    last = np.asarray(extremes, float)[-N_CHANGE_WINDOWS * window :]
    if len(last) < N_CHANGE_WINDOWS * window:
        return True
    decayed = max(-np.expm1(-decay * len(last)), MIN_RELATIVE_DECAY)
    limit = MAX_CHANGE_RATIO * tolerance * decayed * np.ptp(last[-window:]) / 2
    return np.ptp(last, axis=0).max() > limit


def find_steady_motion(modes, drive, groups, run) -> tuple | None:
    """Compute the amplitude [m] of the steady motion to which a run converges, and its error.

    It is the fixed point of the map over a drive period, which is linear between yield events.

    Parameters
    ----------
    modes
        Modal basis.
    drive
        Drive.
    groups : tuple
        Elements of each interface.
    run : EventRunResult

    Returns
    -------
    tuple or None
        None if the run does not end with a complete period of a sine, or if no stable motion was
        found.
    """
    last = drive.segments[-1] if drive.segments else None
    if (
        last is None
        or not is_sinusoidal(drive)
        or last.constant != 0
        or abs(run.cycles_done - round(run.cycles_done)) > 1e-9
    ):
        return None
    sine = SineDrive(last.amplitude, last.omega, drive.moving)
    try:
        motion = steady_events.continue_to_steady_state(modes, sine, groups, *run.end)
    except NotConverged:
        return None
    amplitude, error = find_stable_amplitude(motion.amplitude, motion.residual, motion.multipliers)
    return None if np.isnan(amplitude) else (amplitude, error)


def find_stable_amplitude(amplitude: float, residual: float, multipliers) -> tuple:
    """Return the amplitude [m] of a periodic motion and its error; NaN if it is unstable.

    Parameters
    ----------
    amplitude : float
        [m].
    residual : float
        Change of the state over a period, relative to the motion.
    multipliers : (m,)
        Floquet multipliers of the period. The error of the motion is the residual divided by the
        smallest distance of a multiplier from 1.
    """
    if np.abs(multipliers).max(initial=0.0) >= 1:
        return np.nan, np.nan
    strips_slide_independently = max(float(np.abs(1 - multipliers).min(initial=1.0)), 1e-12)
    return float(amplitude), float(
        amplitude * max(1e-9, 10 * residual / strips_slide_independently)
    )


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
        for _ in range(numerics.pairs):
            self.groups = tuple(map(elements.merge_elements, self.groups))
        if numerics.joined:
            groups = list(self.groups)
            for number, law in enumerate(rig.friction.interfaces):
                if law_has_trait(law.numbers.law, "cells"):
                    groups[number] = elements.merge_elements(groups[number], *numerics.joined)
            self.groups = tuple(groups)
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
