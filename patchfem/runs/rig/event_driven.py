"""Engines that are exact between events: Coulomb or no friction, elastic-plastic elements.

In: a Model, its Numerics and its pressed patch. Out: a Solution whose measures come from the
power series of the pieces (`dynamics.events`).
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
from ...response.rows import ROWS_NEEDING_RUN, stick_fraction
from ...response.spectrum import distortion_ratio
from ...structure.drive_sizes import (
    find_drive_omega,
    find_max_acceleration,
    find_min_decay_rate,
    has_full_cycle,
    is_periodic,
    is_sinusoidal,
)
from ..bench import averaged_law
from . import interface, strips
from .evaluation import Reader
from .levels import remove_incomplete_cycle, run_levels
from .solution import Solution, mode_stiffness, normal_load

# measures of the motion, which exist without an interface
MOTION_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "absolute_acceleration_fundamental",
    "acceleration_distortion",
)
MAX_CHANGE_RATIO = 1e-2  # largest ratio of the change of a settled motion to the tolerance
N_CHANGE_WINDOWS = 3  # number of last windows whose extremes show the change of the motion
# Relative decay of a free motion over the last windows that is assumed if there is less damping.
MIN_RELATIVE_DECAY = 1e-6


def run_pieces(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a rig from event to event, level after level of the drive.

    Coulomb friction, or none, has rigid elements, which keep no snapshots.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None under [normal] or between masses.
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.

    Returns
    -------
    Solution
    """
    contact_elements = RigidElements if numerics.engine == "exact" else YieldingElements
    reader = PieceReader(model, numerics, patch, contact_elements(model, numerics, patch))
    rig = model.rig
    begin = perf_counter()
    more = {}
    histories.load_event_kernels(say)
    prepare = {"reduce": reader.reduced, "compiled_code": perf_counter() - begin}
    begin = perf_counter()

    def integrate(drive, state, watch, is_last, cycles: float = rig.drive.levels.cycles):
        """Integrate the motion under a drive from a given state.

        Parameters
        ----------
        drive
        state : tuple
            State of the rig and memory of the elements at the start.
        watch : callable or None
            Callback for the completed fraction.
        is_last : bool
            Whether the run has snapshots of the interface.
        cycles : float
        """
        done = histories.simulate(
            rig.modes,
            drive,
            reader.groups,
            cycles,
            numerics.window,
            rig.springs.travel,
            frames * (is_last and not reader.rigid),
            watch,
            *state,
            even=bool(ROWS_NEEDING_RUN),
        )
        return reader.average_over_strips(done)

    if rig.drive.levels.amplitudes:
        done, more = run_levels(reader, integrate, (rig.start, None), lambda run: run.end, progress)
    else:
        done = integrate(rig.drive.signal, (rig.start, None), progress, True, numerics.cycles)
        done = remove_incomplete_cycle(done)
    more |= {} if reader.rigid else {"prepare": prepare}
    return reader.solution(done, perf_counter() - begin, **more)


class PieceReader(Reader):
    """Evaluation of the runs of the event-driven engines.

    found: RigidElements or YieldingElements of the run.
    """

    def __init__(self, model, numerics, patch, found):
        super().__init__(
            model, numerics, patch, found.contact, found.held, histories.SAMPLES_PER_CYCLE
        )
        self.groups = found.groups
        self.rigid = found.rigid
        self.reduced = found.seconds
        self.apart = found.rigid and model.rig.friction.strips_slide_apart

    def average_over_strips(self, run):
        """Average the histories of strips that slide independently over the patch."""
        if not self.apart:
            return run
        loads = strips.strip_loads(self.patch)
        offsets = self.patch.strips.offsets
        return replace(
            run,
            response=strips.average_strips(run.response, loads, offsets),
            window=strips.average_strips(run.window, loads, offsets),
        )

    def sticks(self, run) -> bool:
        """Return whether the interface sticks; independent strips must all stick."""
        if self.apart and self.has_friction:
            return run_events.is_all_stuck(run.window, self.held)
        return super().sticks(run)

    def integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures that the event-driven engine computes between its events.

        Strips that slide independently have a single loop, that of their mean, from samples.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.integrated_measures`.
        """
        values = evaluate_reading(
            run.reading,
            run.ledger,
            sine=is_sinusoidal(drive),
            whole=bool(has_full_cycle(run.reading.span, drive)),
            stiffness=mode_stiffness(self.model, run.window),
            size=find_max_acceleration(drive),
        )
        known = {name: None if np.isnan(value) else float(value) for name, value in values.items()}
        names = list(known)
        if not self.has_friction:
            names = [*MOTION_MEASURES, "drift_per_cycle"]
        elif self.apart:
            names = [*MOTION_MEASURES, "slip_start_phase"]
        return IntegratedMeasures(
            {name: known[name] for name in names},
            loops=self.loops(run, drive),
        )

    def loops(self, run, drive) -> tuple:
        """Return the loop of each interface; that of the mean of strips that slide independently."""
        return (_compute_strips_loop(run, drive),) if self.apart else run.loops

    def further_fields(self, run, drive, *, stuck: bool) -> dict:
        """Return the ledger of rigid elements, which dissipate all work of friction.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.further_fields`.
        """
        if not (self.has_friction and self.rigid):
            return {}
        lost = run.ledger["friction"]
        return {"ledger": np.array([[lost], [0.0], [lost], [0.0]]), "together": self.apart}

    def rings(self, run, drive) -> tuple:
        """Compute frequency and damping of the ringing during stick, with errors.

        It is known in closed form for a single element, and if every interface sticks until the end
        of a run without a sine. For a periodic motion, the stick intervals of one cycle are used.
        """
        if not self.has_friction:
            return {}, {}
        if run.ring is not None:
            return make_ringing_measures(*run.ring, run.acceleration), {}
        if held := self.compute_stuck_vibration(run, run.window, drive):
            mode = select_strongest(held, "acceleration")
            omega = 2 * np.pi * mode.frequency
            return make_ringing_measures(
                mode.acceleration, omega, mode.damping, run.acceleration
            ), {}
        return run_events.measure_ringing_in_sticks(
            run.window, self.model.rig.modes, drive, run.log, repeats=run.repeats
        )

    def compute_stuck_vibration(self, run, motion, drive) -> list:
        """Return the free vibration of the modes while every interface sticks on a single spring.

        The list is empty unless only a constant force acts in this part of the run, and every
        interface is a single spring that sticks until the end.

        Parameters
        ----------
        run : EventRunResult
        motion : Response
            Part of its histories.
        drive
            Drive of the run.
        """
        springs = [group.stiffness for group in self.groups]
        held = (
            self.has_friction
            and not self.rigid
            and all(spring.size == 1 for spring in springs)
            and not any(loop.slip_range for loop in run.loops)
            and (not run.log.time.size or run.log.time[-1] < motion.time[0])
        )
        if not held or is_periodic(drive) or not drive.segments or motion.time.size < 2:
            return []
        return compute_stuck_vibration(self.model.rig.modes, np.concatenate(springs), motion)

    def tail(self, run, drive) -> dict:
        """Return the mode that vibrates after the last slip of a release, as a dict."""
        if (
            self.model.rig.drive.kind != "free"
            or run.response is None
            or run.log is None
            or not run.log.time.size
        ):
            return {}
        after = run.response.select(run.response.time > run.log.time[-1])
        held = self.compute_stuck_vibration(run, after, drive)
        return {"tail": select_strongest(held, "displacement")} if held else {}

    def stated_errors(self, run, drive, values: dict) -> dict:
        """Return the errors due to sampling, and the error of the drift of rigid elements.

        The drift of rigid elements has the round-off of the difference of two means; below 1.5
        cycles there are no means, only the ends of the window. The means of independent strips are
        those of cubics through 400 samples per cycle, with an error of h^4/384 times the fourth
        derivative: 2e-14 of the range compared with 8000 samples per cycle, because both cycles
        have nearly the same error. The vibration that jumps excite in a mode r times as fast as the
        drive falls with 1/r^2, and its fourth derivative grows with r^2.

        Parameters
        ----------
        run, drive, values
            See `Reader.stated_errors`.
        """
        window = run.window
        modes = self.model.rig.modes
        left = {} if self.apart else self.sampling_errors(run, drive, values)
        if not self.rigid or window.time[-1] - window.time[0] < 1.5 * drive.period:
            return left
        if not self.apart:
            return left | {"drift_per_cycle": 1e-14 * float(np.abs(window.slide).max(initial=0.0))}
        faster = max(1.0, float(modes.omega.max()) / find_drive_omega(drive)) ** 2
        return left | {"drift_per_cycle": 1e-13 * faster * float(np.ptp(window.slide))}

    def solution_fields(self, run, drive) -> dict:
        """Return the ringing of a release, and the steady amplitude of a motion that still changes."""
        fields = {}
        if tail := self.tail(run, drive):
            fields["extra"] = tail
        numerics = self.numerics
        modes = self.model.rig.modes
        unsettled = may_still_change(
            run.amplitudes,
            numerics.window,
            self.model.accuracy.tolerance,
            find_min_decay_rate(modes) * drive.period,
        )
        may_settle = numerics.whole and run.outcome is None and not self.rigid
        if may_settle and unsettled and not self.sticks(run):
            steady = find_steady_motion(modes, drive, self.groups, run)
            if steady is not None:
                fields |= {"steady": steady, "bounded": True}
        return fields


def _compute_strips_loop(run, drive) -> InterfaceLoop:
    """Compute the friction loop of a patch from the samples of its independent strips.

    The samples are those on both sides of every event; the yaw does work in addition to the mean
    slide.
    """
    window = run.window
    omega = find_drive_omega(drive)
    gaps = np.diff(window.time)
    weight = np.concatenate([[0.0], gaps / 2]) + np.concatenate([gaps / 2, [0.0]])
    held = ~window.extra["slide_rates"].any(axis=1)
    power = (window.extra["forces"] * window.extra["slide_rates"]).sum(axis=1)
    slide = window.slide - weight @ window.slide / weight.sum()
    return InterfaceLoop(
        displacement_harmonic=complex(compute_harmonic(window.time, weight, slide, omega)),
        force_harmonic=complex(compute_harmonic(window.time, weight, window.force, omega)),
        work=float(weight @ power),
        slip_range=float(np.ptp(window.slip)),
        stuck_time=float(weight[held].sum()),
        max_force=float(np.abs(window.force).max()),
    )


def may_still_change(extremes, window: int, tolerance: float, decay: float) -> bool:
    """Return whether a motion may change by more than a fraction of the tolerance in future.

    It may if the run is too short, or if the extremes of its cycles have moved too much in the last
    N_CHANGE_WINDOWS windows, divided by the fraction of the slowest free motion that decays in this time.
    The extremes of a slow beat hardly move while it is largest.

    Parameters
    ----------
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window.
    tolerance : float
    decay : float
        Decay of the slowest free motion over a cycle [1].
    """
    last = np.asarray(extremes, float)[-N_CHANGE_WINDOWS * window :]
    if len(last) < N_CHANGE_WINDOWS * window:
        return True
    decayed = max(-np.expm1(-decay * len(last)), MIN_RELATIVE_DECAY)
    limit = MAX_CHANGE_RATIO * tolerance * decayed * np.ptp(last[-window:]) / 2
    return np.ptp(last, axis=0).max() > limit


def find_steady_motion(modes, drive, groups, done) -> tuple | None:
    """Compute the steady amplitude [m] and its error to which a run converges.

    It is found by the map of the yields over a period.

    Parameters
    ----------
    modes
        Modal basis.
    drive
        Drive.
    groups : tuple
        Elements of every interface.
    done : EventRunResult

    Returns
    -------
    tuple or None
        None if the run does not end with a whole period of a sine, or no stable motion was found.
    """
    last = drive.segments[-1] if drive.segments else None
    if (
        last is None
        or not is_sinusoidal(drive)
        or last.constant != 0
        or abs(done.cycles_done - round(done.cycles_done)) > 1e-9
    ):
        return None
    sine = SineDrive(last.amplitude, last.omega, drive.moving)
    try:
        motion = steady_events.continue_to_steady_state(modes, sine, groups, *done.end)
    except NotConverged:
        return None
    amplitude, error = find_stable_amplitude(motion.amplitude, motion.residual, motion.multipliers)
    return None if np.isnan(amplitude) else (amplitude, error)


def find_stable_amplitude(amplitude: float, residual: float, multipliers) -> tuple:
    """Return the amplitude [m] and error of a periodic motion; NaN if it is unstable.

    Parameters
    ----------
    amplitude : float
        [m].
    residual : float
        Difference of the states after a period, relative to the motion.
    multipliers : (m,)
        Floquet multipliers over a period. The error in the motion is the residual over their
        distance from 1.
    """
    if np.abs(multipliers).max(initial=0.0) >= 1:
        return np.nan, np.nan
    apart = max(float(np.abs(1 - multipliers).min(initial=1.0)), 1e-12)
    return float(amplitude), float(amplitude * max(1e-9, 10 * residual / apart))


class YieldingElements:
    """Elastic-plastic friction elements of all interfaces of a model.

    - groups: elements of each interface.
    - contact: ContactModel of a single interface.
    - held: slip in a cycle [m] below which the interface sticks in it.
    - seconds: CPU seconds of the reduction.
    """

    rigid = False

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
        self.held = 1e-3 * min(lengths, default=0.0)
        self.groups = tuple(make_elements_of_law(element) for element in parts)
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

    Any slip counts as slip.
    """

    rigid = True
    contact = None
    held = 0.0
    seconds = 0.0

    def __init__(self, model, numerics, patch):
        limits = coulomb_limits(model, patch)
        self.groups = tuple(elements.make_coulomb_elements(*pair) for pair in limits)


def coulomb_limits(model, patch) -> list:
    """Return the static and kinetic friction limits [N] of every Coulomb interface."""
    rig = model.rig
    friction = model.friction
    if rig.friction.strips_slide_apart:
        loads = strips.strip_loads(patch)
        return [tuple(map(float, model.friction_limits(load))) for load in loads]
    if friction is None:
        return [(0.0, 0.0)] * len(rig.modes.interfaces)
    if rig.friction.names:
        laws = rig.friction.interfaces
        return [tuple(map(float, law.friction_limits(law.load))) for law in laws]
    static, kinetic = model.friction_limits(normal_load(model, patch))
    if law_has_trait(friction.law, "averaged"):
        static = static * averaged_law.slip_force_ratio(model, patch)
    if friction.kinetic is None:
        kinetic = static
    return [(float(static), float(kinetic))]


def make_elements_of_law(element) -> elements.Elements:
    """Return the elastic-plastic elements of a law of parallel springs and sliders."""
    count = int(element.numbers[1])
    return elements.make_elements(
        element.numbers[2 : 2 + count], element.numbers[2 + count : 2 + 2 * count]
    )


def evaluate_reading(
    reading: Reading, book: dict, *, sine: bool, whole: bool, stiffness, size
) -> dict:
    """Return measures of the motion and the first interface of one or many event-driven runs.

    Parameters
    ----------
    reading : Reading
    book : dict
        Energies of the run [J].
    sine : bool
        Whether the drive is a sine at the end.
    whole : bool
        Whether the evaluated cycles are complete.
    stiffness : float or (n,)
        K of the first mode as seen by the contact [N/m]; 0 if no damping ratio refers to it.
    size : float or (n,)
        Acceleration of the drive [m s-2].

    Returns
    -------
    dict
        NaN for a measure that a run does not have.
    """
    none = np.full(np.shape(reading.output_amplitude), np.nan)[()]
    has_waves = sine and whole
    first, third = reading.acceleration_harmonics
    loop = reading.loop()
    values = {
        "relative_displacement_amplitude": reading.output_amplitude,
        "absolute_acceleration_peak": reading.acceleration,
        "absolute_acceleration_fundamental": first if has_waves else none,
        "acceleration_distortion": distortion_ratio(first, third, size) if has_waves else none,
        "drift_per_cycle": reading.drift,
        "slip_start_phase": reading.start if sine else none,
        "work_check": _compute_work_check(reading, book),
        "slip_amplitude": loop.slip_range / 2,
        "friction_force_peak": loop.max_force,
        "stick_fraction": stick_fraction(loop.stuck_time, reading.span),
    }
    return values | _loop_measures(reading, stiffness, sine=sine) if whole else values


def _loop_measures(reading: Reading, stiffness, *, sine: bool) -> dict:
    """Return the measures of the friction loop of the first interface."""
    loop = reading.loop()
    moves = (
        reading.interface_value(InterfaceMeasure.MAX_SLIDE)
        - reading.interface_value(InterfaceMeasure.MIN_SLIDE)
        > MIN_SLIDE_RANGE
    ) & sine
    half = np.where(moves, reading.interface_value(InterfaceMeasure.MEAN_RANGE) / 2, 0.0)[()]
    work = loop.work * reading.period / reading.span
    secant = np.where(moves, reading.interface_value(InterfaceMeasure.SECANT), np.nan)[()]
    measures = interface_loops(
        half, loop.displacement_harmonic, loop.force_harmonic, work, stiffness
    )
    return measures | {"secant_stiffness": secant}


def _compute_work_check(reading: Reading, book: dict):
    """Return the relative difference [1] of friction work from samples and energy balance.

    The samples are the ends of the time intervals; their work follows from the trapezoidal rule.
    """
    sampled = reading.faces[..., InterfaceMeasure.END_WORK].sum(axis=-1)
    booked = reading.faces[..., InterfaceMeasure.WORK].sum(axis=-1)
    exchanged = reading.faces[..., InterfaceMeasure.PATH_WORK].sum(axis=-1)
    return relative_gap(sampled, booked, exchanged, book["power"] + book["peak_stored"])
