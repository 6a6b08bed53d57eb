"""How a coupled run ended: outcome and steady estimate, by what its drive lets settle."""

from dataclasses import replace

import numpy as np

from ..core import Measure, Outcome
from ..structure import drive_sizes
from . import stationary
from .settling import (
    CLASSES,
    GROWS,
    STEADY,
    classes,
    classify,
    left_over,
    mean_amplitudes,
    steady_amplitude,
    windows_of,
)

TELLS = 0.02  # of the tolerance, from which what an amplitude will still change by is told
UNSETTLED = "the interface sticks, but the amplitude has not settled"
OPEN_LOOP = "the friction loop of the last cycle does not close"
SAFE = 1.5  # times the cycles that the decay needs: the last windows of a short run beat
MOST_MORE = 1e6  # cycles that are proposed
# of the displacement a/omega^2 of the drive: a change of the amplitude that is round-off
SMALL = 1e-12


def settle(
    raw, measures: dict, tolerance: float, drive, level_cycles: float = 0.0, slowest: float = 0.0
) -> tuple:
    """Outcome of a run, and its measures with the steady estimate where there is one.

    Under a periodic drive, and under levels in their last one, the amplitudes of successive windows decide
    (`classify`), and what free motion is left in them (`left_over`). A steady one that will still change by TELLS of
    the tolerance has the estimate too. A release or a step is steady once it is at rest, to the floor of its amplitude;
    else the same amplitudes decide, but a release grows only where a mode gains energy. A motion whose middle moves on
    is not steady (`moves_on`). A sweep or a recorded signal changes to the end: unless it leaves the interface stuck it
    is transient, without a steady estimate; a random one is done where both halves of its record move as much. So is an
    interface that holds while what it holds still rises. What rises to a motion that is known to exist, `raw.bounded`,
    does not grow.
    level_cycles: of each level, 0 without levels; slowest: rate [1/s] at which the slowest mode decays, below 0 where
    one gains energy.
    """
    if (
        raw.outcome is Outcome.STUCK
        and not hasattr(drive, "band")
        and still_loads(raw.window, drive.period, tolerance)
    ):
        return Outcome.TRANSIENT, measures
    if raw.outcome is not None:
        return raw.outcome, measures
    if hasattr(drive, "band"):
        return Outcome.DONE if stationary.steady(raw.window, drive) else Outcome.TRANSIENT, measures
    if not drive.segments and drive_sizes.repeat_cycles(drive) is None:
        return Outcome.TRANSIENT, measures
    # tones, of which a window holds whole beats
    if not drive.segments and not drive_sizes.is_periodic(drive):
        found = classify(
            raw.amplitudes,
            tolerance,
            SMALL * drive_sizes.max_acceleration(drive) / drive_sizes.drive_omega(drive) ** 2,
        )
        return found, without_bars(measures) if found is Outcome.GROWS else measures
    amplitudes, extremes = raw.amplitudes, raw.extremes
    window = max(1, round((raw.window.time[-1] - raw.window.time[0]) / drive.period))
    floor = SMALL * drive_sizes.max_acceleration(drive) / drive_sizes.drive_omega(drive) ** 2
    if level_cycles:
        amplitudes = amplitudes[-max(1, int(level_cycles / window)) :]
        extremes = None if extremes is None else extremes[-int(level_cycles) :]
    if not drive_sizes.is_periodic(drive):
        rests = amplitudes[-1] <= max(floor, measures["relative_displacement_amplitude"].floor)
        outcome = (
            Outcome.STEADY
            if rests
            else _held(
                classify(amplitudes, tolerance, floor),
                measures,
                tolerance,
                _middle(extremes, window),
            )
        )
        if outcome is Outcome.GROWS and not drive.segments[-1].constant and slowest >= 0:
            outcome = Outcome.TRANSIENT
        return outcome, without_bars(measures) if outcome is Outcome.GROWS else measures
    number, steady, error = (
        one[0]
        for one in settled(
            np.asarray(amplitudes, float)[None],
            None if extremes is None else np.asarray(extremes)[None],
            window,
            [np.array([np.nan if one is None else one]) for one in raw.steady],
            (tolerance, floor, max(slowest, 0.0) * window * drive.period),
            raw.bounded,
        )
    )
    outcome = _held(CLASSES[number], measures, tolerance)
    if outcome is Outcome.GROWS:
        return outcome, without_bars(measures)
    base = measures["relative_displacement_amplitude"]
    if not np.isnan(steady) and (
        outcome is Outcome.TRANSIENT or goes_on(steady, error, base.value, tolerance)
    ):
        total = steady_error(steady, error, base.value, base.error or 0.0)
        measures = measures | {
            "relative_displacement_amplitude_steady": Measure(
                float(steady), "m", float(total), base.floor
            )
        }
    return outcome, measures


def moves_on(drift, error, amplitude, tolerance, floor) -> np.ndarray:
    """Whether the middle of a motion moves by more than the tolerance of its amplitude [m] in a cycle; numbers or (n,).

    drift [m], known to `error`, and the floor of what counts as one.
    """
    return np.abs(drift) > tolerance * np.abs(amplitude) + error + floor


def _middle(extremes, window: int) -> float:
    """Motion per cycle [m] of the middle of the output from the window before the last to that, of extremes (c, 2) [m]
    per cycle; inf where they are not known. A window of a belt holds whole stick-slips, its cycles do not."""
    if extremes is None or len(extremes) < 2 * window:
        return np.inf
    part = np.asarray(extremes)[-2 * window :].reshape(2, window, 2)
    middle = (part[..., 0].min(axis=1) + part[..., 1].max(axis=1)) / 2
    return float(middle[1] - middle[0]) / window


def _held(outcome: Outcome, measures: dict, tolerance: float, middle: float = np.inf) -> Outcome:
    """TRANSIENT in place of STEADY where the middle of the motion moves on, from cycle to cycle and by `middle` [m] in
    each from window to window."""
    drift, amplitude = measures.get("drift_per_cycle"), measures["relative_displacement_amplitude"]
    if outcome is not Outcome.STEADY or drift is None or drift.value is None:
        return outcome
    moves = moves_on(
        min(abs(drift.value), abs(middle)),
        drift.error or 0.0,
        amplitude.value,
        tolerance,
        drift.floor,
    )
    return Outcome.TRANSIENT if moves else outcome


def without_bars(measures: dict) -> dict:
    """Measures of a motion that grows, which have no errors: those of a later time are others."""
    return {name: replace(one, error=None) for name, one in measures.items()}


def settled(amplitudes, extremes, window: int, steady, limits: tuple, bounded=False) -> tuple:
    """How motions under sines ended: (numbers of CLASSES, steady amplitudes [m], their errors [m]), (n,) each.

    amplitudes (n, w) [m] of successive windows of `window` cycles; extremes (n, c, 2) [m] of the output per cycle, None
    where they are not known; steady: (values, errors), (n,) [m], of `steady_amplitudes`, NaN for none; limits:
    (tolerance, floor [m], decay of the slowest mode over a window [1]), numbers or (n,); bounded: as in a Solution.
    A motion is steady only if what it is known to settle to, and what free motion is left in it, are both within the
    tolerance: near a crest of its amplitude it hardly changes from window to window, however far it has still to go.
    """
    (tolerance, floor, decay), (value, error) = limits, steady
    found = classes(amplitudes, tolerance, floor)
    found = np.where((found == GROWS) & bounded, 0, found)
    away = np.abs(np.where(np.isnan(value), amplitudes[:, -1], value) - amplitudes[:, -1])
    found = np.where((found == STEADY) & (away > tolerance * amplitudes[:, -1] + floor), 0, found)
    if extremes is not None:
        left = left_over(extremes, window, decay)
        found = np.where(
            (found != GROWS) & (left > tolerance * amplitudes[:, -1] + floor), 0, found
        )
        none, (mean, about) = np.isnan(value), mean_amplitudes(extremes, window)
        value, error = np.where(none, mean, value), np.where(none, about, error)
        # no tail is seen: about the cycles of the last window
        none = np.isnan(value) & (found == STEADY)
        value = np.where(none, windows_of(extremes, window)[1][:, -1], value)
        error = np.where(none, left + np.abs(amplitudes[:, -1] - value), error)
    return found, value, error


def goes_on(steady, error, amplitude, tolerance) -> np.ndarray:
    """Whether the amplitude of a motion that is steady to the tolerance will still change by a share of that which
    tells, by the steady estimate and its error; [m], numbers or (n,)."""
    return np.abs(steady - amplitude) + error > TELLS * tolerance * np.abs(amplitude)


def steady_error(steady, error, amplitude, own):
    """Error of a steady estimate [m]: its own and, in proportion, that of the amplitude of the last cycles."""
    return error + own * steady / np.maximum(np.abs(amplitude), 1e-300)


def still_loads(window, period: float, tolerance: float) -> bool:
    """Whether the force that a stuck interface holds still rises: the stick of a belt outlasts the window then.

    By the mean of the last cycle against that of the first, more than the tolerance of the largest force; in a window
    of one cycle where it rises all the way. window: Response; period [s] of the drive.
    """
    time, forces = (
        window.time,
        np.column_stack(
            [
                window.extra.get("forces", window.force),
                window.extra.get("lateral_forces", np.zeros((window.time.size, 0))),
            ]
        ),
    )
    largest_force = np.abs(forces).max(axis=0)
    if time[-1] - time[0] < 1.5 * period:
        size = np.abs(forces)
        rises = np.all(np.diff(size, axis=0) >= -1e-9 * largest_force, axis=0)
        return bool(np.any(rises & (size[-1] - size[0] > tolerance * largest_force)))
    near = period * (1 + 1e-9)  # round-off at its end would leave out a step
    first, last = time <= time[0] + near, time >= time[-1] - near
    means = [
        np.abs(np.trapezoid(forces[part], time[part], axis=0)) / period for part in (first, last)
    ]
    return bool(np.any(means[1] - means[0] > tolerance * largest_force))


def off_the_piece(outcome: Outcome | None, reach: float, length: float) -> Outcome | None:
    """The outcome of a run, or LEAVES_CONTACT where its largest |slide| `reach` [m] passed the length [m] of the piece.

    From that moment on nothing overlaps, so it comes before whatever the run did later: settle, go on growing, or pass
    the stop of the flexure, which would have ended the run before had it stood nearer. A motion that grows without
    having passed the end within the run still `grows`. Only a solve that missed its residual comes first, since its
    slide means nothing.
    """
    return (
        Outcome.LEAVES_CONTACT
        if reach > length and outcome is not Outcome.NOT_CONVERGED
        else outcome
    )


def unsettled(raw, measures: dict, limits: tuple, drive, cycles: float) -> list:
    """Warning, as a list, of a motion under a sine that sticks but rings on: its amplitude is that of a transient.

    limits: (tolerance, rate [1/s] at which the slowest mode decays); cycles: of the run. By what the amplitude of the
    last window will still change, with the cycles after which a free motion at that rate is below the tolerance.
    """
    (tolerance, slowest), main = limits, measures["relative_displacement_amplitude"]
    if (
        raw.outcome is not Outcome.STUCK
        or not drive_sizes.is_periodic(drive)
        or raw.extremes is None
        or not main.value
    ):
        return []
    window = max(1, round((raw.window.time[-1] - raw.window.time[0]) / drive.period))
    decay = slowest * drive.period
    left = float(ringing_left(np.asarray(raw.extremes), window, decay))
    return rings_on(left, (main.value, main.floor), (tolerance, decay), cycles)


def ringing_left(extremes, window: int, decay):
    """How much of the amplitude of motions that stick [m] is free vibration, (...), by the extremes (..., c, 2) [m] of
    their cycles: `left_over`, and the change of the last window at least; decay (...): of the slowest mode over a cycle
    [1]."""
    ends = windows_of(extremes, window)[0]
    left = left_over(extremes, window, np.maximum(decay, 0.0) * window)
    return np.maximum(left, np.abs(ends[..., -1] - ends[..., -2])) if ends.shape[-1] > 1 else left


def rings_on(left: float, sizes: tuple, limits: tuple, cycles: float) -> list:
    """`unsettled` of a motion that sticks, of which so much is `ringing_left` [m]; sizes: its amplitude and the floor
    of that [m]; limits: tolerance, and the decay of its slowest mode over a cycle [1]."""
    (amplitude, floor), (tolerance, decay) = sizes, limits
    if not left > tolerance * amplitude + floor:
        return []
    more = np.log(left / amplitude / tolerance) / decay if decay > 0 else np.inf
    remedy = (
        f"set drive.cycles = {float(f'{cycles + SAFE * more:.2g}'):g}"
        if more < MOST_MORE
        else 'set accuracy.method = "harmonic" for the steady motion'
    )
    return [
        f"{UNSETTLED}: by up to {100 * left / amplitude:.2g} % (limit {100 * tolerance:g} %) it is free vibration "
        f"that will decay, so relative_displacement_amplitude is that of a transient; {remedy}"
    ]


def changing_note(outcome: Outcome, drive) -> list:
    """The sentence, in a list, on measures under a drive that changes to the end; an empty list for other drives."""
    if (
        outcome is not Outcome.TRANSIENT
        or drive.segments
        or drive_sizes.repeat_cycles(drive) is not None
    ):
        return []
    return [
        "the drive changes until the end of the run, so the motion cannot become steady; the measures are those of "
        "the last cycles, and result.nc contains the whole motion"
    ]


def steady_of(drive, amplitudes, phasors) -> tuple:
    """Steady amplitude and its error under a periodic drive, (None, None) under any other.

    A released or struck rig comes to rest, whatever the tail of its amplitudes looks like. Under a drive that is no
    sine the motion may have no first harmonic, so the amplitudes are extrapolated in place of the phasors.
    """
    if not drive_sizes.is_periodic(drive):
        return None, None
    return steady_amplitude(amplitudes, phasors if drive_sizes.is_sinusoidal(drive) else amplitudes)
