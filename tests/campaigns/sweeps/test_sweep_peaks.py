"""Peak of a response over frequency, compared with the closed form of a single mode."""

import numpy as np
import pytest
from sweep_tables import make_table

from patchfem.campaigns.sweeps.peaks import find_peaks, locate_peak

NATURAL = 143.0  # [Hz]


def respond(frequency, damping):
    """Return the amplitude of an oscillator of unit static response."""
    ratio = (np.asarray(frequency) / NATURAL) ** 2
    return 1 / np.sqrt((1 - ratio) ** 2 + 4 * damping**2 * ratio)


def closed_form(damping):
    """Return frequency, height and half-power width of the peak of the oscillator."""
    square = 1 - 2 * damping**2
    height = 1 / (2 * damping * np.sqrt(1 - damping**2))
    # (1 - r)^2 + 4 D^2 r = 2/height^2 has the roots r of the half-power frequencies.
    roots = square + np.array([-1, 1]) * np.sqrt(square**2 - 1 + 2 / height**2)
    return NATURAL * np.sqrt(square), height, NATURAL * np.ptp(np.sqrt(roots))


@pytest.mark.parametrize("damping", [0.003, 0.02, 0.1])
def test_exact_peak_of_single_mode(damping):
    """Frequency, height and width of a single mode agree with the closed form to 1e-9, for cases at any distance."""
    expected = closed_form(damping)
    for spacing in (0.3, 0.61):
        width = expected[2]
        frequency = NATURAL + spacing * width * (np.arange(-6, 7) + 0.37)
        response = respond(frequency, damping)
        peak = locate_peak(frequency, response, np.zeros(13))
        assert (peak.frequency, peak.height, peak.width) == pytest.approx(expected, rel=1e-9)
        assert peak.frequency_error < 1e-8 * NATURAL


@pytest.mark.parametrize("seed", range(4))
def test_always_errors_of_distorted_peak_hold(seed):
    """The errors of frequency and height contain those of a peak that is not of a single mode."""
    rng = np.random.default_rng(seed)
    bend = rng.uniform(-0.15, 0.15)

    def respond_bent(frequency):
        """Return the response of a mode whose flank is bent."""
        return respond(frequency, 0.02) * (1 + bend * np.sin((frequency - NATURAL) / 3))

    fine = np.linspace(120, 170, 200_001)
    top = fine[np.argmax(respond_bent(fine))]
    frequency = np.linspace(125, 165, 33) + rng.uniform(0, 1.2)
    peak = locate_peak(frequency, respond_bent(frequency), np.zeros(33))
    assert abs(peak.frequency - top) <= peak.frequency_error
    assert abs(peak.height - respond_bent(top)) <= peak.height_error


def test_exact_peaks_of_two_loads_and_missing_peaks():
    """Each combination of the other keys has its peak; a curve that is largest at an end has none."""
    frequency = np.linspace(130, 155, 26)
    values = np.stack([respond(frequency, 0.01), respond(frequency, 0.02)])
    name = "relative_displacement_amplitude"
    keys = {"normal.load": [10.0, 20.0], "drive.frequency": frequency}
    table = make_table(keys, {name: values}, unit="Hz")
    peaks = find_peaks(table)
    assert [entry.peak.height for entry in peaks] == pytest.approx(
        [closed_form(damping)[1] for damping in (0.01, 0.02)], rel=1e-9
    )
    assert [table.keys[0].values[entry.case] for entry in peaks] == [10, 20]
    falling = make_table(
        {"drive.frequency": frequency + 20}, {name: values[0][::-1] * 0 + frequency}
    )
    assert find_peaks(falling) == []
    assert locate_peak(frequency[:4], values[0][:4], np.zeros(4)) is None
