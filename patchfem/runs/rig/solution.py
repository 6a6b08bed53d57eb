"""Solution of one run of a rig, and quantities that several engines compute in the same way.

In: a run of an engine. Out: `Solution`, and friction loop, load and stiffness of the last cycles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...core import Measure, Outcome, Response, SineDrive
from ...formatting import format_length
from ...motion_measures import find_extremes
from ...response.events import Events
from ...response.levels import Level
from ...response.loops import CycleLoop, sample_loop
from ...response.measures import Measures, Values
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.ringing import VibratingMode
from ...response.rows import AMPLITUDE, STEADY_AMPLITUDE
from ...structure.drive_sizes import find_drive_omega, has_full_cycle
from ..results.result import Settings, SteadyData

Fields = dict[str, Any]  # fields of a record by name
# Displacement at which a motion has left the range of a softening spring, relative to that without restoring force.
ESCAPE_DISPLACEMENT_RATIO = 2.0
NO_PEAK_REASON = "the output does not move at any of the swept frequencies, so there is no peak"
# Safety factor on the change of a peak frequency in a coarse run.
PEAK_SHIFT_SAFETY_FACTOR = 3.0


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """Result of an engine for one run, without error estimates from coarse runs.

    - values: measures by name.
    - response, window: stored histories, and those of the last cycles.
    - outcome: Outcome, or None if it is determined from the cycles.
    - snapshots: states of the interface in the last cycle.
    - book: energies [J] and counters by name.
    - seconds: CPU time of the run [s].
    - contact: contact model of the run.
    - prepare: CPU time of each part of the preparation [s].
    - message: reason of an early end.
    - levels, run_level: Level of each drive level, and a function that runs another level, see
      `levels.find_onset`.
    - log: events of an event-driven engine.
    - notes: warnings of the engine.
    - stick_tolerance: largest slip per cycle [m] at which the interface counts as stuck.
    - run_errors: error estimates by measure from the run itself, without coarse runs.
    - errors: error estimates by measure of an engine that needs no coarse runs, or None.
    - bond_summation: EngineChoice of the bond summation, or None without bonds.
    - coarser: pairs of a coarse run and its reference run (None for this run).
    - extremes (c, 2), phasors (c,): minimum and maximum output, and phasor of the output, of every cycle [m], from which
      the outcome is determined, or None if the engine sets the outcome.
    - drive: drive of the largest motion of a response curve or of drive levels, or None for a single motion.
    - peak_error: error of the frequency of this drive [Hz], or inf for a curve without a peak, NaN without a curve.
    - tail: `ringing.VibratingMode` that remains after the last slip of a release, or None.
    - settings: Settings of an engine that only it knows.
    - periodic: SteadyData of a periodic motion, or None.
    """

    values: Values
    response: Response
    window: Response
    outcome: Outcome | None
    snapshots: Sequence
    book: Values
    seconds: float
    contact: object = None
    prepare: Values | None = None
    message: str = ""
    levels: tuple[Level, ...] = ()
    run_level: object = None
    log: Events | None = None
    notes: tuple[str, ...] = ()
    stick_tolerance: float = 0.0
    run_errors: Values = field(default_factory=dict)
    errors: Values | None = None
    bond_summation: object = None
    coarser: "tuple[tuple[Solution, Solution | None], ...]" = ()
    extremes: np.ndarray | None = None
    phasors: np.ndarray | None = None
    drive: SineDrive | None = None
    peak_error: float = np.nan
    tail: VibratingMode | None = None
    settings: Settings = field(default_factory=Settings)
    periodic: SteadyData | None = None


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
    window = _compute_gauge_histories(solution.window, gauge)
    low, high = find_extremes(window.time, window.output, window.output_rate)
    amplitude = (high - low) / 2
    ratio = max(1.0, amplitude / max(solution.values[AMPLITUDE], 1e-300))
    errors = solution.errors and solution.errors | {
        AMPLITUDE: ratio * solution.errors.get(AMPLITUDE, 0.0)
    }
    values = {key: value for key, value in solution.values.items() if key != STEADY_AMPLITUDE}
    return replace(
        solution,
        values=values | {AMPLITUDE: amplitude},
        response=_compute_gauge_histories(solution.response, gauge),
        window=window,
        errors=errors,
    )


def _compute_gauge_histories(histories: Response, gauge) -> Response:
    """Return histories whose output is the motion at the gauge.

    `gauge` (n,) is the participation of the modes in this motion.
    """
    sensor = {"sensor": histories.output, "sensor_rate": histories.output_rate}
    return replace(
        histories,
        output=histories.modal @ gauge,
        output_rate=histories.modal_rate @ gauge,
        extra=histories.extra | sensor,
    )


def first_interface_load(model, patch) -> float | None:
    """Return the normal load [N] on the first interface; None without friction."""
    if model.friction is None:
        return None
    return model.point.load if patch is None else patch.pressure.load


def first_mode_stiffness(model, window) -> float:
    """Return the stiffness [N/m] of the first mode, referred to the displacement at the contact.

    It is 0 if other modes contribute more than MAX_OTHER_MODES_FRACTION of this displacement.

    Parameters
    ----------
    model : Model
        Model of a rig.
    window : Response
        Samples of the last cycles.
    """
    first_mode = model.rig.first_mode
    if first_mode.fraction_of_other_modes(window.modal) > MAX_OTHER_MODES_FRACTION:
        return 0.0
    return first_mode.stiffness


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
    if not has_full_cycle(window.time[-1] - window.time[0], drive):
        return None
    force = window.force if force is None else force
    return sample_loop(window.time, window.slide, force, find_drive_omega(drive), work)


def compute_peak_frequency(solution: Solution, coarser=()) -> Measures:
    """Return a dict with the frequency [Hz] of the peak of a response curve and its error.

    The measure has no value if the amplitude is 0. The dict is empty without a curve.

    Parameters
    ----------
    solution : Solution
        Solution at the peak, with its drive and the error of its frequency.
    coarser : sequence of Solution
        Coarse runs; the shift of their peaks is part of the error.

    Returns
    -------
    dict
        `peak_frequency`, or {}.
    """
    if np.isnan(solution.peak_error):
        return {}
    if np.isinf(solution.peak_error):
        return {"peak_frequency": Measure(None, "Hz", None, 0.0, reason=NO_PEAK_REASON)}
    peak_frequency = float(solution.drive.omega / (2 * np.pi))
    peaks = [run.drive.omega / (2 * np.pi) for run in coarser if run.drive is not None]
    shift = float(np.abs(np.array(peaks) - peak_frequency).max(initial=0.0))
    error = solution.peak_error + PEAK_SHIFT_SAFETY_FACTOR * shift
    return {"peak_frequency": Measure(peak_frequency, "Hz", error, 0.0)}
