"""The solution that an engine gives back, and the last cycles as the measures see them."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import Measure, Outcome, Response
from ...response.decay_curve import last_swing
from ...response.measures import half_swing, harmonic
from ...response.reasons import SHARED
from ...response.rows import Seen
from ...structure.drive_sizes import drive_omega, has_full_cycle, is_sinusoidal

NO_PEAK = "the output does not move at any of the swept frequencies, so there is no peak"
OF_OTHERS = 3.0  # times the way that a peak moves by a coarser mesh or fewer modes


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """One run of an engine before its errors are known.

    values: measure -> value; response: kept histories, window: those of the last cycles; amplitudes: per window;
    steady: (steady amplitude, error) or (None, None); outcome: None where the amplitudes decide; snapshots of the
    interface; book: energies; contact: what the march moved; prepare: seconds of its preparation; levels: of a drive in
    levels, probe: as `levels.onset` asks; log: events of the exact engine; notes: warnings of the method; held: slip
    [m] below which a cycle sticks; own: what the run itself leaves open of its measures; errors: by measure, where the
    engine has them itself; summed: how bonds are, a Choice, None without a sum; coarser: runs of levels at half the
    steps and on coarser meshes, each with the one that it is held against, None for this run; extremes (c, 2) [m]: of
    the output in every cycle of the run, by which the outcome is judged, None where the engine knows it; bounded: the
    steady amplitude is that of a motion known to exist; extra: for the report.
    """

    values: dict
    response: Response
    window: Response
    amplitudes: np.ndarray
    steady: tuple
    outcome: Outcome | None
    snapshots: list
    book: dict
    seconds: float
    contact: object = None
    prepare: dict | None = None
    message: str = ""
    levels: tuple = ()
    probe: object = None
    log: object = None
    notes: tuple = ()
    held: float = 0.0
    own: dict | None = None
    errors: dict | None = None
    summed: object = None
    coarser: tuple = ()
    extremes: np.ndarray | None = None
    bounded: bool = False
    extra: dict = field(default_factory=dict)


def gauged(model, raw: Solution) -> Solution:
    """The Solution as a gauge sees it that does not move as the accelerometer does: its displacement and histories.

    How the motion settles is that of the accelerometer; where it would settle the gauge is not known.
    """
    gauge = model.rig.modes.gauge
    if gauge is None:
        return raw
    name, moved = "relative_displacement_amplitude", []
    for one in (raw.response, raw.window):
        felt = {"sensor": one.output, "sensor_rate": one.output_rate}
        moved.append(
            replace(
                one,
                output=one.modal @ gauge,
                output_rate=one.modal_rate @ gauge,
                extra=one.extra | felt,
            )
        )
    seen = half_swing(raw.window.time, moved[1].output, moved[1].output_rate)
    if model.rig.drive.kind == "free":
        seen = decaying(moved[1], model.rig.drive.signal.period, seen)
    share = max(1.0, seen / max(raw.values[name], 1e-300))
    errors = raw.errors and raw.errors | {name: share * raw.errors.get(name, 0.0)}
    values = {key: value for key, value in raw.values.items() if key != f"{name}_steady"}
    return replace(
        raw,
        values=values | {name: seen},
        response=moved[0],
        window=moved[1],
        steady=(None, None),
        errors=errors,
    )


def decaying(window, period: float, whole: float) -> float:
    """Amplitude [m] of a release in its last whole cycle, by its window; that of the `whole` window where it holds no
    whole cycle."""
    found = last_swing(window.time, window.output, window.output_rate, period)
    return whole if found is None else found


def borne(model, patch) -> float | None:
    """Normal load [N] on the first interface, of the pressed patch or of the point; None where nothing rubs."""
    if model.friction is None:
        return None
    return patch.pressure.load if patch is not None else model.point.load


def last_cycles(model, patch, window, extremes, book: dict, **more) -> Seen:
    """The last cycles of a run of a model, as the measures see them (`response.rows.Seen`).

    window: Response; extremes: (c, 2) [m] of the output; book: energies; more: the other
    fields of Seen, with `drive` where it is not the model's own.
    """
    drive = more.pop("drive", model.rig.drive.signal)
    return Seen(
        window,
        drive,
        extremes,
        book,
        borne(model, patch),
        mode_stiffness(model, window),
        is_sinusoidal(drive),
        **more,
    )


def mode_stiffness(model, window) -> float:
    """Stiffness [N/m] of the first mode as the contact meets it, 0 where another mode carries part of the slide."""
    first_mode = model.rig.first_mode
    if first_mode.fraction_of_other_modes(window.modal) > SHARED:
        return 0.0
    return first_mode.stiffness


def sampled_loop(window, drive, work: float, force: complex | None = None) -> tuple | None:
    """Loop of equally spaced samples by the trapezoidal rule, as `Seen` takes it; None where the window holds no whole
    cycle.

    work: per cycle [J]; force: its first harmonic where it is known better.
    """
    if not has_full_cycle(window.time[-1] - window.time[0], drive):
        return None
    weight, omega = np.full(window.time.size, 1.0), drive_omega(drive)
    weight[[0, -1]] = 0.5
    slide = harmonic(window.time, weight, window.slide - window.slide.mean(), omega)
    pull = harmonic(window.time, weight, window.force, omega) if force is None else force
    return slide, pull, work


def curve_measures(extra: dict, coarser=()) -> dict:
    """Measure of a curve of steady motions: the frequency [Hz] of its largest amplitude, no value where that is 0.

    extra: of a Solution; {} without a curve; coarser: Solutions of coarser runs, which have their peak elsewhere.
    """
    if "at_error" not in extra:
        return {}
    at, others = (
        np.array([one["at"].omega for one in every]) / (2 * np.pi)
        for every in ([extra], [one.extra for one in coarser if "at" in one.extra])
    )
    if extra["at_error"] is None:
        return {"peak_frequency": Measure(None, "Hz", None, 0.0, reason=NO_PEAK)}
    error = extra["at_error"] + OF_OTHERS * float(np.abs(others - at).max(initial=0.0))
    return {"peak_frequency": Measure(float(at[0]), "Hz", error, 0.0)}
