"""Evaluation of a run of any engine: measures, stick, outcome and drive levels.

In: a run of an engine. Out: its `Solution`. Subclasses of `RunEvaluator` return the quantities that their engine computes
more accurately than from samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ... import structure
from ...core import Outcome, Response, SineDrive
from ...cost_model import measure_cpu_time
from ...effects import law_has_trait
from ...formatting import format_length
from ...measures.events import Events, VibratingMode, is_all_stuck
from ...measures.loops import CycleLoop, choose_reversal_force_rule, sample_loop
from ...measures.measures import Values, compare_friction_works
from ...measures.reasons import MAX_OTHER_MODES_FRACTION
from ...measures.rows import (
    AMPLITUDE,
    STEADY_AMPLITUDE,
    LastCycles,
    compute_measures,
    measure_amplitude,
)
from ...motion_measures import find_extremes
from ..results.result import SteadyData
from .levels import LevelRuns, run_levels

# Displacement at which a motion has left the range of a softening spring, relative to that without restoring force.
ESCAPE_DISPLACEMENT_RATIO = 2.0


@dataclass(frozen=True, eq=False, slots=True)
class EngineRun:
    """Run of an engine, with its histories.

    - values: measures of the last cycles by name, of an engine that sums them over its steps.
    - response, window: histories of the run and of its last cycles.
    - ledger: energies [J] and counters by name.
    - outcome, message: how the run ended, if it ended early.
    - extremes (c, 2), phasors (c,): minimum and maximum, and complex amplitude at the drive frequency, of the output [m]
      in each of c cycles.
    - end: state at the end, from which another run can go on.
    - cycles_done: number of cycles.
    - log: events of the interfaces, or None.
    - snapshots: states of the interface in the last cycle.
    """

    values: Values
    response: Response
    window: Response
    ledger: Values
    outcome: Outcome | None = None
    message: str = ""
    extremes: np.ndarray | None = None
    phasors: np.ndarray | None = None
    end: Any = None
    cycles_done: float = 0.0
    log: Events | None = None
    snapshots: Sequence = ()


@dataclass(frozen=True, eq=False, slots=True)
class SteadyPart:
    """What the solver of steady motions knows of the motion that it has found.

    - data: SteadyData of the motion and of its response curve.
    - errors: errors by measure, without coarse runs.
    - notes: warnings.
    - drive: drive of the largest motion of a response curve, or None for a single motion.
    - peak_error: error of the frequency of this drive [Hz], or inf for a curve without a peak, NaN without a curve.
    """

    data: SteadyData
    errors: Values
    notes: tuple[str, ...] = ()
    drive: SineDrive | None = None
    peak_error: float = np.nan

    def get_errors(self, values: Values) -> Values:
        """Return the known errors of measures by name, 0 for others."""
        return {name: self.errors.get(name, 0.0) for name in values}


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Motion with given settings, without error estimates from coarse runs.

    - values: measures by name.
    - run: run of the engine (`EngineRun` or `time_steps.time_march.Motion`), whose outcome is None if it is determined
      from the cycles.
    - seconds: CPU time of the run [s].
    - contact: contact points, or laws of the engine `event_driven`.
    - prepare: CPU time of each part of the preparation [s].
    - run_errors: error estimates by measure from the run itself, without coarse runs.
    - levels: LevelRuns of a drive in levels, or None.
    - steady: SteadyPart of a steady motion, or None.
    - tail: `events.VibratingMode` that remains after the last slip of a release, or None.
    """

    values: Values
    run: Any
    seconds: float
    contact: object = None
    prepare: Values = field(default_factory=dict)
    run_errors: Values = field(default_factory=dict)
    levels: LevelRuns | None = None
    steady: SteadyPart | None = None
    tail: VibratingMode | None = None


def find_travel(rig) -> float:
    """Return the output displacement [m] at which a run ends.

    It is the travel that the scene allows, or less for a softening spring, whose force decreases beyond a displacement.
    """
    cubic = rig.springs.cubic
    if cubic is None or cubic >= 0:
        return rig.springs.travel
    stiffness = rig.modes.mass * rig.modes.omega[0] ** 2 / max(rig.modes.output[0] ** 2, 1e-300)
    return min(rig.springs.travel, ESCAPE_DISPLACEMENT_RATIO * float(np.sqrt(stiffness / -cubic)))


def describe_escape(rig, travel: float) -> str:
    """Return why a run ended at the displacement `travel` [m]; "" if it is the travel that the scene allows."""
    if travel >= rig.springs.travel:
        return ""
    return (
        f"beyond a displacement of {format_length(travel, 3)} the motion grows without limit, because the force of the "
        "softening spring no longer pulls the block back; the run ended there"
    )


def replace_output_by_gauge(model, solution: Solution) -> Solution:
    """Return a Solution whose output is the motion at the gauge instead of the accelerometer.

    Whether the motion has become steady is still judged at the accelerometer. The steady amplitude
    at the gauge is unknown.
    """
    gauge = model.rig.modes.gauge
    if gauge is None:
        return solution

    def see(histories: Response) -> Response:
        """Return histories whose output is the motion at the gauge."""
        sensor = {"sensor": histories.output, "sensor_rate": histories.output_rate}
        output = histories.modal @ gauge
        rate = histories.modal_rate @ gauge
        return replace(histories, output=output, output_rate=rate, extra=histories.extra | sensor)

    # The errors of the motion grow with its size.
    run = solution.run
    window = see(run.window)
    # The drive is no release here: a release has no gauge apart from the output.
    extremes = find_extremes(window.time, window.output, window.output_rate)
    amplitude = measure_amplitude(np.array(extremes))
    ratio = max(1.0, amplitude / max(solution.values[AMPLITUDE], 1e-300))
    steady = solution.steady
    if steady is not None:
        error = ratio * steady.errors.get(AMPLITUDE, 0.0)
        steady = replace(steady, errors=steady.errors | {AMPLITUDE: error})

    values = solution.values | {AMPLITUDE: amplitude}
    values.pop(STEADY_AMPLITUDE, None)
    run = replace(run, response=see(run.response), window=window)
    return replace(solution, values=values, run=run, steady=steady)


def first_interface_load(model, patch) -> float | None:
    """Return the normal load [N] on the first interface; None without friction."""
    if model.friction is None:
        return None
    return model.point.load if patch is None else patch.pressure.load


def first_mode_stiffness(model, window) -> float:
    """Return the stiffness [N/m] of the first mode, referred to the displacement at the contact.

    It is 0 if other modes contribute more than MAX_OTHER_MODES_FRACTION of this displacement in the last cycles, whose
    histories are `window`.
    """
    first_mode = model.rig.first_mode
    is_alone = first_mode.fraction_of_other_modes(window.modal) <= MAX_OTHER_MODES_FRACTION
    return first_mode.stiffness if is_alone else 0.0


def compute_sampled_loop(window, drive, work: float, force=None) -> CycleLoop | None:
    """Compute the friction loop of the last cycles from samples; None if they contain no complete cycle.

    Parameters
    ----------
    window : Response
        Samples of the last cycles.
    drive
        Drive, whose frequency is that of the harmonics.
    work : float
        Friction work per cycle [J].
    force : complex, optional
        First harmonic of the force [N], if it is known more accurately.
    """
    if not structure.drive_sizes.has_full_cycle(window.time[-1] - window.time[0], drive):
        return None
    force = window.force if force is None else force
    omega = structure.drive_sizes.find_drive_omega(drive)
    return sample_loop(window.time, window.slide, force, omega, work)


def compute_work_check(energies: Values) -> float:
    """Return the relative difference of the friction work from samples and from the energy balance.

    Parameters
    ----------
    energies : dict
        Energies of a run [J]. "sampled" is the friction work from samples, "booked" that of the
        energy balance, and "passed" the integral of its absolute value.
    """
    scale = energies["power"] + energies["peak_stored"]
    return compare_friction_works(
        energies["sampled"], energies["booked"], energies["passed"], scale
    )


class RunEvaluator:
    """Evaluation of the runs of a model that one engine has computed.

    The subclass of an engine integrates the motion under a drive from the end of another run (`integrate`). It returns the
    fields of `LastCycles` that it computes more accurately than from samples (`describe_cycles`), and the errors that the
    run itself shows (`estimate_run_errors`).

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    contact
        Contact points, or laws of the engine `event_driven`.
    stick_tolerance : float
        Largest slip per cycle [m] at which the interface counts as stuck.

    Attributes
    ----------
    prepare : dict
        CPU time of each part of the preparation [s].
    """

    prepare: Values

    def __init__(self, model, numerics, patch, contact, stick_tolerance: float):
        self.model = model
        self.numerics = numerics
        self.patch = patch
        self.contact = contact
        self.has_friction = model.friction is not None
        # With a law that creeps, the interface slips under every force, however small.
        self.creeps = self.has_friction and law_has_trait(model.friction.law, "creeps")
        self.stick_tolerance = 0.0 if self.creeps else stick_tolerance

    def find_tail(self, run) -> VibratingMode | None:
        """Return the free vibration that remains after the last slip of a release, if the engine knows it."""

    def solve(self, n_frames: int, progress) -> Solution:
        """Compute the motion of the rig, for one drive level after another, and its Solution.

        Parameters
        ----------
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        progress : callable or None
            Callback for the completed fraction.
        """
        begin = measure_cpu_time()
        drive = self.model.rig.drive
        levels = None
        if drive.levels.amplitudes:
            run, levels = run_levels(self, n_frames, progress)
        else:
            run = self.integrate(drive.signal, self.numerics.cycles, None, n_frames, progress)
        solution = self.make_solution(run, measure_cpu_time() - begin)
        return replace(solution, prepare=self.prepare, levels=levels)

    def evaluate_measures(self, run, drive=None) -> Values:
        """Compute the measures of a run from its last cycles.

        Parameters
        ----------
        run
            Run of the engine, with all cycles or with those of a drive level.
        drive : optional
            Drive of the run; default: that of the model.
        """
        model = self.model
        drive = drive or model.rig.drive.signal
        fields = {"window": run.window, "run_energies": run.ledger}
        if self.has_friction:
            fields["reversal_rule"] = choose_reversal_force_rule(model)
            fields["ledger"] = run.response.extra.get("ledger")
        if model.rig.drive.is_release:
            fields["release"] = run.response

        # What the engine knows better replaces what follows from samples.
        fields |= self.describe_cycles(run, drive)
        last_cycles = LastCycles(
            drive=drive,
            extremes=run.extremes[-min(self.numerics.window, len(run.extremes)) :],
            load=first_interface_load(model, self.patch),
            stiffness=first_mode_stiffness(model, fields["window"]),
            is_sine=structure.drive_sizes.is_sinusoidal(drive),
            **fields,
        )
        return compute_measures(last_cycles)

    def is_stuck(self, run) -> bool:
        """Return whether no interface or band slips in the last cycles by more than `stick_tolerance` [m].

        A law that creeps never sticks.
        """
        if not self.has_friction or self.creeps:
            return False
        return is_all_stuck(run.window, self.stick_tolerance)

    def make_solution(self, run, seconds: float, drive=None) -> Solution:
        """Evaluate a run and return its Solution.

        Measures follow from the last `numerics.window` cycles (`measures.rows`). `run_errors` are the errors that the run
        itself shows: of sampling, and those of its engine. Errors due to steps and mesh need coarse runs and are not part
        of it.

        Parameters
        ----------
        run
            Run of the engine.
        seconds : float
            CPU time of the run [s].
        drive : optional
            Drive of the run; default: that of the model.
        """
        drive = drive or self.model.rig.drive.signal
        values = self.evaluate_measures(run, drive)
        errors = self.estimate_run_errors(run, drive, values)
        tail = self.find_tail(run)
        if run.outcome is None and self.is_stuck(run):
            run = replace(run, outcome=Outcome.STUCK)
        return Solution(values, run, seconds, self.contact, run_errors=errors, tail=tail)
