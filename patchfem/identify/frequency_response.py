"""Frequency response of a record by the H1 estimator, with its coherence.

H1 = G_xf / G_ff, averaged over windowed segments of the record (Bendat and Piersol, Random Data, ch. 6). The
coherence |G_xf|^2 / (G_ff G_xx) is the fraction of the response that depends linearly on the input. A segment
of length T widens each peak by about 1/T, which increases the damping of a fit to this estimate. `driven_modes`
therefore fits the record.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from ..response.welch import CrossDensities, average_segments, transform_segments

# Largest error of a sample time in time steps; times in text files may have only six digits.
MAX_TIME_ERROR = 1e-3
DEFAULT_N_SEGMENTS = 8  # default ratio of record length to segment length
MIN_SEGMENT_SAMPLES = 64  # smallest number of samples in a segment
# Largest response at both ends of a complete transient, relative to the largest response.
MAX_END_FRACTION = 1e-2
# Smallest input power of an excited spectral line, relative to the largest one.
MIN_INPUT_POWER = 1e-6
# Highest frequency that is used, relative to the Nyquist frequency, because of filters and aliasing.
MAX_NYQUIST_FRACTION = 0.8
# Half-width of the main lobe of a Hann window that disturbs the lines near 0, in spectral lines.
WINDOW_WIDTH_LINES = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class FrequencyResponse:
    """Frequency response function estimated from a record, with its coherence.

    - frequency: frequencies (q,) > 0 [Hz].
    - value: response over input (q,), complex.
    - input: power spectral density (q,) of the input.
    - coherence: coherence (q,), None for a single segment.
    - segment: number of samples per segment.
    - segments: number of averaged segments.
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
    """Return the time step [s] of an equally sampled record.

    `time` (k,) are the sample times [s]. Raises PatchfemError if they are not equally spaced.
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
        Number of samples per segment. Default: the whole record if the response starts and ends at
        rest, else an eighth of the record.
    window : str, optional
        ``"hann"`` or ``"none"``. Default: ``"none"`` for a whole record, else ``"hann"``.

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
    """Return whether a response starts and ends at rest, so that a single segment contains all of it."""
    n_end_samples = max(response.size // 50, 1)
    max_response = np.abs(response).max(initial=0.0)
    max_end_response = max(
        np.abs(response[:n_end_samples]).max(), np.abs(response[-n_end_samples:]).max()
    )
    return bool(max_end_response <= MAX_END_FRACTION * max_response)
