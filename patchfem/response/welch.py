"""Spectral densities of records from transforms of overlapping segments (Welch, 1967).

In: records at equal time steps. Out: `Segments` of their transforms, and `CrossDensities` of
two of them.
"""

from typing import NamedTuple

import numpy as np


class Segments(NamedTuple):
    """Fourier transforms of the overlapping segments of a record.

    - frequency (q,): [Hz].
    - transforms (r, m, q): of r records over m segments, scaled so that 2 |X|^2 is a one-sided
      spectral density.
    """

    frequency: np.ndarray
    transforms: np.ndarray


class CrossDensities(NamedTuple):
    """One-sided spectral densities of input and output with their cross density, (q,) each."""

    input: np.ndarray
    output: np.ndarray
    cross: np.ndarray

    def coherence(self) -> np.ndarray:
        """Return the coherence (q,): the fraction of the output that depends linearly on the input."""
        size = np.abs(self.cross)
        return (size / np.maximum(self.input, 1e-300)) * (size / np.maximum(self.output, 1e-300))


def transform_segments(step: float, records, size: int, *, has_window: bool = True) -> Segments:
    """Compute the Fourier transforms of record segments that overlap by half.

    Parameters
    ----------
    step : float
        Time between two samples [s].
    records : (r, k) array
        Equally spaced samples.
    size : int
        Samples of a segment.
    has_window : bool
        Whether each segment is tapered by Hann's window, about its own mean.

    Returns
    -------
    Segments
    """
    records = np.asarray(records)
    starts = np.arange(0, records.shape[1] - size + 1, size - size // 2)
    segments = records[:, starts[:, None] + np.arange(size)]
    taper = np.ones(size)
    if has_window:
        taper = np.sin(np.pi * np.arange(size) / size) ** 2  # This is Hann's window, periodic.
        segments = (segments - segments.mean(axis=2, keepdims=True)) * taper
    transforms = np.fft.rfft(segments) * np.sqrt(step / np.sum(taper**2))
    return Segments(np.fft.rfftfreq(size, step), transforms)


def average_segments(driven, response) -> CrossDensities:
    """Average products of segment transforms to spectral densities."""
    return CrossDensities(
        input=2 * np.mean(np.abs(driven) ** 2, axis=0),
        output=2 * np.mean(np.abs(response) ** 2, axis=0),
        cross=2 * np.mean(driven.conj() * response, axis=0),
    )
