"""Frequency response of a record by the H1 estimate, with its coherence.

H1 = G_xf / G_ff with segments of the record windowed and averaged (Bendat and Piersol, Random Data, ch. 6); the
coherence |G_xf|^2 / (G_ff G_xx) says how much of the response follows the input linearly. A segment of length T blurs
every peak by about 1/T, which a fit to the estimate reads as damping: `driven_modes` fits the record itself.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from ..response.welch import CrossDensities, average_segments, transform_segments

UNEVEN = 1e-3  # of a step, that sampling times may be off; text holds them with six digits
AVERAGES = 8  # lengths of a segment in a record, unless one is asked for
QUIET = 1e-2  # of the largest response: below it at both ends, a record is one whole transient
FAINT = 1e-6  # of the largest power of the input: lines with less are not driven
TOP = 0.8  # of half the sampling rate: above it filters and aliases rule


@dataclass(frozen=True, eq=False, slots=True)
class Estimate:
    """A frequency response estimated from a record.

    frequency: (q,) [Hz] > 0; value: (q,) complex, response over input; input: (q,) power of the input per Hz;
    coherence: (q,) or None for one segment; segment [samples]; segments: how many were averaged; window: "hann" or
    "none".
    """

    frequency: np.ndarray
    value: np.ndarray
    input: np.ndarray
    coherence: np.ndarray | None
    segment: int
    segments: int
    window: str


def even_step(time) -> float:
    """Step [s] of times (k,); PatchfemError where they are not even."""
    step = (time[-1] - time[0]) / (time.size - 1)
    off = np.abs(time - time[0] - step * np.arange(time.size)).max() / step
    if off > max(UNEVEN, 1e-5 * time.size):
        raise PatchfemError(
            f"the times deviate from an even step of {step:.6g} s by up to {off:.2g} of this step; an "
            "evenly sampled record is needed"
        )
    return float(step)


def h1(
    step: float, force, response, segment: int | None = None, window: str | None = None
) -> Estimate:
    """H1 estimate of response (k,) over force (k,), sampled every `step` [s].

    segment [samples] and window ("hann", "none"): unless given, the whole record without a window where the response
    starts and ends in rest, else an eighth of it under Hann's; half of a segment overlaps the next. PatchfemError for a
    segment that does not fit and an input that is zero.
    """
    whole = _rests(response) and segment is None and window in (None, "none")
    segment = (
        (force.size if whole else 2 * (force.size // (2 * AVERAGES)))
        if segment is None
        else segment
    )
    window = window or ("none" if whole else "hann")
    if not 64 <= segment <= force.size:
        raise PatchfemError(
            f"a segment has {segment} samples; at least 64, and at most the {force.size} samples of "
            "the record, are needed"
        )
    frequency, transforms = transform_segments(
        step, (force, response), segment, has_window=window == "hann"
    )
    found = average_segments(*transforms)
    # a window widens the mean of a segment to one and a half lines
    lowest = 1.5 / (segment * step) if window == "hann" else 0.0
    kept = (frequency > lowest) & (frequency <= TOP / (2 * step))
    kept &= found.input > FAINT * found.input[kept].max(initial=0.0)
    if not kept.any() or not found.input.max() > 0:
        raise PatchfemError("the input is zero, so there is no response to it")
    found = CrossDensities(*(part[kept] for part in found))
    count = transforms.shape[1]
    coherence = found.coherence() if count > 1 else None
    return Estimate(
        frequency[kept], found.cross / found.input, found.input, coherence, segment, count, window
    )


def _rests(response) -> bool:
    """Whether a response starts and ends in rest, so that no segment cuts it."""
    edge, size = max(response.size // 50, 1), np.abs(response).max(initial=0.0)
    return bool(max(np.abs(response[:edge]).max(), np.abs(response[-edge:]).max()) <= QUIET * size)
