"""Spectral densities of records from transforms of overlapping segments (Welch, 1967).

In: equally sampled records. Out: `Segments` with their transforms, and `CrossDensities` of two records.
"""

from typing import NamedTuple

import numpy as np


class Segments(NamedTuple):
    """Fourier transforms of the overlapping segments of records.

    - frequency (q,): frequencies of the spectral lines [Hz].
    - transforms (r, m, q): transforms X of m segments of r records, scaled such that 2 |X|^2 is a
      one-sided spectral density.
    """

    frequency: np.ndarray
    transforms: np.ndarray


class CrossDensities(NamedTuple):
    """One-sided spectral densities of input and output, and cross-spectral density, (q,) each."""

    input: np.ndarray
    output: np.ndarray
    cross: np.ndarray

    def coherence(self) -> np.ndarray:
        """Return the coherence (q,): fraction of output power that is linear in the input."""
        magnitude = np.abs(self.cross)
        return (magnitude / np.maximum(self.input, 1e-300)) * (
            magnitude / np.maximum(self.output, 1e-300)
        )


def transform_segments(step: float, records, size: int) -> Segments:
    """Return the Fourier transforms of the segments of records, which overlap by half.

    The mean of each segment is removed before the Hann window is applied.

    Parameters
    ----------
    step : float
        Time between two samples [s].
    records : (r, k) array
        Equally spaced samples.
    size : int
        Number of samples per segment.

    Returns
    -------
    Segments
    """
    # SciPy's signal package is loaded only for records.
    from scipy.signal import stft

    frequency, _, transforms = stft(
        np.asarray(records),
        1 / step,
        nperseg=size,
        detrend="constant",
        boundary=None,
        padded=False,
        scaling="psd",
    )
    return Segments(frequency, np.swapaxes(transforms, 1, 2))


def average_segments(input_transforms, output_transforms) -> CrossDensities:
    """Return the CrossDensities of an input and an output, averaged over their segments."""
    return CrossDensities(
        input=2 * np.mean(np.abs(input_transforms) ** 2, axis=0),
        output=2 * np.mean(np.abs(output_transforms) ** 2, axis=0),
        cross=2 * np.mean(input_transforms.conj() * output_transforms, axis=0),
    )
