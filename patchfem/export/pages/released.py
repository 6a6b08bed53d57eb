"""Motion of an output after a release: its first swing and the time until it comes to rest."""

import numpy as np

from ...formatting import format_length, format_quantity, format_value
from ...runs.results.result import Result

# Largest deviation of an output at rest from its final position, relative to this position, which
# is printed with three digits.
REST_FRACTION = 5e-3
# Smallest number of amplitudes of a decay for which frequency and damping are printed.
MIN_AMPLITUDES = 5
# Largest change between samples that is attributed to round-off, relative to the largest output.
ROUND_OFF_FRACTION = 1e-13
# Largest final position that counts as 0, relative to the largest output: the remainder of a decay.
ZERO_FRACTION = 1e-9


def describe_release(result: Result) -> str:
    """Describe the motion of a released rig in a sentence, or return "" for any other run.

    The text has no full stop at the end.
    """
    rig = result.plan.model.rig
    r = result.response
    if rig is None or rig.drive.kind != "free" or r is None or r.time.size < 2:
        return ""
    amplitude = result.measures.get("relative_displacement_amplitude")
    error, last = (getattr(amplitude, name, None) for name in ("error", "value"))
    return describe_swing(r.time, r.output, error or 0.0, last) + _describe_decay(
        result.extra.get("decay")
    )


def _describe_decay(decay) -> str:
    """Return a clause on frequency and damping ratio at the start and at the end of a decay."""
    known_swings = (
        []
        if decay is None
        else np.flatnonzero(np.isfinite(decay.damping_error + decay.frequency_error)).tolist()
    )
    if len(known_swings) < MIN_AMPLITUDES:
        return ""
    parts = [
        f"{format_value(decay.frequency[k], decay.frequency_error[k], unit='Hz')}, damping ratio "
        f"{format_value(decay.damping[k], decay.damping_error[k])} at {format_quantity(float(decay.amplitude[k]), 'm', 3)}"
        for k in dict.fromkeys((known_swings[1], known_swings[-1]))
    ]
    return f"; it decays at {', and at '.join(parts)}"


def describe_swing(time, output, error: float = 0.0, amplitude: float | None = None) -> str:
    """Describe a released motion from its stored samples and reversals.

    Parameters
    ----------
    time : (k,) array
        [s]
    output : (k,) array
        [m]
    error : float
        Error of the amplitude [m]. An output that moves by no more than this, or than the digits of
        its final position show, is at rest.
    amplitude : float, optional
        Amplitude of the last whole cycle [m]; by default that of the last tenth of the samples.

    Returns
    -------
    str
    """
    end = float(output[-1])
    start = float(output[0])
    end = 0.0 if abs(end) < ZERO_FRACTION * np.abs(output).max() else end
    distance = np.abs(output - end)
    if not np.isfinite(distance).all() or not distance.max() > 0:
        return f"released at {format_length(start, 3)}, the output does not move"
    moving_steps = np.flatnonzero(
        np.abs(np.diff(output)) > ROUND_OFF_FRACTION * np.abs(output).max()
    )
    reversals = 1 + moving_steps[:-1][np.diff(np.sign(np.diff(output)[moving_steps])) != 0]
    rest_limit = max(error, REST_FRACTION * abs(end), ZERO_FRACTION * np.abs(output).max())
    reversals = reversals[distance[reversals] > rest_limit]
    first_motion = (
        f"first swings to {format_length(float(output[reversals[0]]), 3)}"
        if reversals.size
        else f"goes to {format_length(end, 3)}"
    )
    first = f"released at {format_length(start, 3)}, the output {first_motion}"
    tenth = np.ptp(output[time >= time[-1] - 0.1 * (time[-1] - time[0])]) / 2
    last = tenth if amplitude is None else min(tenth, amplitude)
    if last > rest_limit:
        end_time = format_quantity(float(time[-1]), "s", 3)
        return (
            f"{first} and at the end, after {end_time}, still moves with an amplitude (half peak-to-peak of its last "
            f"whole cycle) of {format_length(float(last), 3)}"
        )
    last_moving = (
        int(np.flatnonzero(distance > rest_limit)[-1]) if (distance > rest_limit).any() else 0
    )
    last_moving = min(last_moving, time.size - 2)
    rests = f"comes to rest at {format_length(end, 3)} after {format_quantity(float(time[last_moving + 1]), 's', 3)}"
    return (
        f"{first}, reverses {reversals.size} times and {rests}"
        if reversals.size
        else f"{first} and {rests}"
    )
