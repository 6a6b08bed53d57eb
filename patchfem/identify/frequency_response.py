"""Frequency response of a record by the H1 estimator, with its coherence.

H1 = G_xf / G_ff, averaged over windowed segments of the record (Bendat and Piersol, Random Data, ch. 6). The
coherence |G_xf|^2 / (G_ff G_xx) is the part of the response that depends linearly on the input. A segment of
length T widens each peak by about 1/T, which a fit to the estimate takes for damping; `driven_modes` fits the
record itself.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from ..response.welch import CrossDensities, average_segments, transform_segments

# largest error of a sample time in time steps; times in text files have only six digits
MAX_TIME_ERROR = 1e-3
DEFAULT_N_SEGMENTS = 8  # length of a record / length of its segments, if the user gives no length
MIN_SEGMENT_SAMPLES = 64  # smallest number of samples in a segment
# fraction of the largest response; if both ends are below it, the record is a complete transient
MAX_END_FRACTION = 1e-2
# fraction of the largest input power; spectral lines with less are not excited
MIN_INPUT_POWER = 1e-6
# fraction of the Nyquist frequency; filters and aliasing disturb higher lines
MAX_NYQUIST_FRACTION = 0.8
# number of spectral lines by which a Hann window widens the average of a segment
WINDOW_WIDTH_LINES = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class FrequencyResponse:
    """Frequency response function estimated from a record, with its coherence.

    - frequency: frequencies (q,) > 0 [Hz].
    - value: response over input (q,), complex.
    - input: power spectral density (q,) of the input.
    - coherence: coherence (q,), None for a single segment.
    - segment: samples of a segment.
    - segments: number of segments that were averaged.
    - window: "hann" or "none".
    """

    frequency: np.ndarray
    value: np.ndarray
    input: np.ndarray
    coherence: np.ndarray | None
    segment: int
    segments: int
    window: str


def find_time_step(time) -> float:
    """Return the time step [s] of an evenly sampled record.

    `time` (k,) are the times of its samples. Raises PatchfemError if they are not evenly spaced.
    """
    step = (time[-1] - time[0]) / (time.size - 1)
    deviation = np.abs(time - time[0] - step * np.arange(time.size)).max() / step
    if deviation > max(MAX_TIME_ERROR, 1e-5 * time.size):
        raise PatchfemError(
            f"the times deviate from an even step of {step:.6g} s by up to {deviation:.2g} of this step; an "
            "evenly sampled record is needed"
        )
    return float(step)


def estimate_response(
    step: float, force, response, segment: int | None = None, window: str | None = None
) -> FrequencyResponse:
    """Estimate the frequency response function of a record by the H1 estimator.

    Segments overlap by half.

    Parameters
    ----------
    step : float
        Time step [s].
    force, response : (k,) ndarray
        Input and response.
    segment : int, optional
        Samples of a segment. By default it is the whole record if the response starts and ends at rest,
        else an eighth of the record.
    window : str, optional
        ``"hann"`` or ``"none"``; by default Hann's for segments, and none for a whole record.

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    PatchfemError
        If the segment does not fit, or if the input is zero.
    """
    is_single_segment = segment is None and window in (None, "none") and _is_transient(response)
    if segment is None:
        segment = force.size if is_single_segment else 2 * (force.size // (2 * DEFAULT_N_SEGMENTS))
    window = window or ("none" if is_single_segment else "hann")
    if not MIN_SEGMENT_SAMPLES <= segment <= force.size:
        raise PatchfemError(
            f"a segment has {segment} samples; at least {MIN_SEGMENT_SAMPLES}, and at most the {force.size} samples of "
            "the record, are needed"
        )
    has_window = window == "hann"
    frequency, transforms = transform_segments(
        step, (force, response), segment, has_window=has_window
    )
    densities = average_segments(*transforms)
    min_frequency = WINDOW_WIDTH_LINES / (segment * step) if has_window else 0.0
    is_kept = (frequency > min_frequency) & (frequency <= MAX_NYQUIST_FRACTION / (2 * step))
    is_kept &= densities.input > MIN_INPUT_POWER * densities.input[is_kept].max(initial=0.0)
    if not is_kept.any() or not densities.input.max() > 0:
        raise PatchfemError("the input is zero, so there is no response to it")
    densities = CrossDensities(*(density[is_kept] for density in densities))
    n_segments = transforms.shape[1]
    return FrequencyResponse(
        frequency=frequency[is_kept],
        value=densities.cross / densities.input,
        input=densities.input,
        coherence=densities.coherence() if n_segments > 1 else None,
        segment=segment,
        segments=n_segments,
        window=window,
    )


def _is_transient(response) -> bool:
    """Return whether a response starts and ends at rest, so that one segment can contain it all."""
    n_end_samples = max(response.size // 50, 1)
    max_response = np.abs(response).max(initial=0.0)
    max_end_response = max(
        np.abs(response[:n_end_samples]).max(), np.abs(response[-n_end_samples:]).max()
    )
    return bool(max_end_response <= MAX_END_FRACTION * max_response)
