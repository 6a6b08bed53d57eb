"""Solution that an engine returns, and the last cycles as input of the measures.

In: a run of an engine. Out: `Solution`, and `LastCycles` for the rows of `response.rows`.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core import Measure, Outcome, Response
from ...response.decay_curve import measure_last_swing
from ...response.measures import compute_harmonic, measure_half_swing
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.rows import LastCycles
from ...structure.drive_sizes import find_drive_omega, has_full_cycle, is_sinusoidal

NO_PEAK = "the output does not move at any of the swept frequencies, so there is no peak"
OF_OTHERS = 3.0  # factor on the shift of a peak by a coarser mesh or fewer modes


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """One run of an engine before its errors are known.

    - values: measures by name.
    - response, window: histories that are kept, and those of the last cycles.
    - amplitudes: amplitude of each window [m].
    - steady: steady amplitude [m] and its error [m], or (None, None).
    - outcome: None if the amplitudes decide.
    - snapshots: states of the interface in the last cycle.
    - book: energies [J] and counters by name.
    - seconds: CPU seconds of the run.
    - contact: contact that was moved.
    - prepare: CPU seconds of the preparation by name.
    - message: reason of an early end.
    - levels, probe: levels of the drive, and the function that `levels.onset` calls.
    - log: events of the exact engine.
    - notes: warnings of the method.
    - held: slip in a cycle [m] below which the interface sticks in it.
    - stated_errors: errors by measure that the run itself states.
    - errors: errors by measure, if the engine knows them itself.
    - summed: Choice for the sum over bonds; None without a sum.
    - coarser: coarse runs of levels, each with its reference run (None for this run).
    - extremes (c, 2): smallest and largest output of every cycle [m], which decide the outcome;
      None if the engine knows it.
    - bounded: whether the steady amplitude is that of a motion known to exist.
    - extra: further data of the result.
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
    stated_errors: dict | None = None
    errors: dict | None = None
    summed: object = None
    coarser: tuple = ()
    extremes: np.ndarray | None = None
    bounded: bool = False
    extra: dict = field(default_factory=dict)


def seen_by_gauge(model, raw: Solution) -> Solution:
    """Return the Solution as seen by a gauge that is not at the accelerometer.

    Displacement and histories are those of the gauge. How the motion settles is judged at the
    accelerometer; the steady amplitude at the gauge is not known.
    """
    gauge = model.rig.modes.gauge
    if gauge is None:
        return raw
    name = "relative_displacement_amplitude"
    moved = []
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
    seen = measure_half_swing(raw.window.time, moved[1].output, moved[1].output_rate)
    if model.rig.drive.kind == "free":
        seen = last_cycle_amplitude(moved[1], model.rig.drive.signal.period, seen)
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


def last_cycle_amplitude(window, period: float, whole: float) -> float:
    """Return the amplitude [m] of a release in its last whole cycle.

    `whole` is the amplitude of the window, returned if it contains no whole cycle.
    """
    found = measure_last_swing(window.time, window.output, window.output_rate, period)
    return whole if found is None else found


def normal_load(model, patch) -> float | None:
    """Return the normal load [N] on the first interface; None without friction."""
    if model.friction is None:
        return None
    return patch.pressure.load if patch is not None else model.point.load


def last_cycles(model, patch, window, extremes, book: dict, **more) -> LastCycles:
    """Return the last cycles of a run as input of the measures (`response.rows.LastCycles`).

    Parameters
    ----------
    model : Model
    patch : Patch or None
    window : Response
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    book : dict
        Energies by name [J].
    more
        Other fields of LastCycles, with `drive` if it is not that of the model.
    """
    drive = more.pop("drive", model.rig.drive.signal)
    return LastCycles(
        window,
        drive,
        extremes,
        book,
        normal_load(model, patch),
        mode_stiffness(model, window),
        is_sinusoidal(drive),
        **more,
    )


def mode_stiffness(model, window) -> float:
    """Return the stiffness [N/m] of the first mode as seen by the contact.

    It is 0 if other modes carry more than MAX_OTHER_MODES_FRACTION of the slide.
    """
    first_mode = model.rig.first_mode
    if first_mode.fraction_of_other_modes(window.modal) > MAX_OTHER_MODES_FRACTION:
        return 0.0
    return first_mode.stiffness


def sampled_loop(window, drive, work: float, force: complex | None = None) -> tuple | None:
    """Return the loop of equally spaced samples by the trapezoidal rule (`LastCycles.loop`).

    Parameters
    ----------
    window : Response
    drive
    work : float
        Friction work per cycle [J].
    force : complex, optional
        First harmonic of the force [N], if it is known better.

    Returns
    -------
    tuple or None
        None if the window contains no whole cycle.
    """
    if not has_full_cycle(window.time[-1] - window.time[0], drive):
        return None
    weight = np.full(window.time.size, 1.0)
    omega = find_drive_omega(drive)
    weight[[0, -1]] = 0.5
    slide = compute_harmonic(window.time, weight, window.slide - window.slide.mean(), omega)
    pull = compute_harmonic(window.time, weight, window.force, omega) if force is None else force
    return slide, pull, work


def curve_measures(extra: dict, coarser=()) -> dict:
    """Return the frequency [Hz] of the largest amplitude of a curve of steady motions, by name.

    It has no value if the amplitude is 0.

    Parameters
    ----------
    extra : dict
        `Solution.extra`.
    coarser : sequence of Solution
        Coarse runs, whose peak lies elsewhere.

    Returns
    -------
    dict
        {} without a curve.
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
