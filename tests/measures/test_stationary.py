"""Random vibration: spectra compared with SciPy, rms values with integrals, and intervals with the scatter of records."""

import numpy as np
import pytest
from random_shaking import CASES, NAMES, normalized_measures, simulate_random_response
from scipy.signal import csd, welch

from patchfem.measures import stationary


def test_exact_spectra_agree_with_scipy():
    """Power spectra and gain of a record agree with scipy.signal within 1e-9."""
    window, drive = simulate_random_response(100.0, 0.02, 4.0, 3)
    record = stationary.make_record(window, drive)
    found = stationary.compute_spectra(window, drive)
    size = 2 * (record.displacement.size // (2 * stationary.SEGMENTS_PER_RECORD))
    asked = {"fs": 1 / record.step, "nperseg": size, "noverlap": size // 2, "detrend": "constant"}
    f, push = welch(record.drive, **asked)
    kept = (f > 0) & (f <= 2 * drive.band[1])
    assert found.frequency == pytest.approx(f[kept], rel=1e-12) and found.drive == pytest.approx(
        push[kept], rel=1e-9
    )
    for mine, values in (
        (found.displacement, record.displacement),
        (found.acceleration, record.acceleration),
    ):
        assert mine == pytest.approx(welch(values, **asked)[1][kept], rel=1e-9, abs=0)
    gain = (csd(record.drive, record.displacement, **asked)[1] / push)[kept]
    inside = ~np.isnan(found.coherence)
    assert found.gain[inside] == pytest.approx(gain[inside], rel=1e-9) and np.all(
        found.coherence[inside] <= 1 + 1e-12
    )
    assert np.all(
        (found.frequency[inside] >= drive.band[0]) & (found.frequency[inside] <= drive.band[1])
    )


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_always_record_intervals_cover_closed_forms(count):
    """The 95 % intervals of random records cover the closed forms in 95 % less three standard deviations."""
    rows = np.array([normalized_measures(*CASES[0], seed) for seed in range(count)])
    inside = np.abs(rows[..., 0] - 1) <= rows[..., 1]
    assert np.all(inside.mean(axis=0) >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / count)), dict(
        zip(NAMES, inside.mean(axis=0))
    )
    far = rows[..., 0].std(axis=0) / np.sqrt(count)
    # no window, and no start, shifts the mean
    assert np.all(np.abs(rows[..., 0].mean(axis=0) - 1) <= 4 * far)
    # nor are the intervals idle
    assert np.all(rows[..., 1].mean(axis=0) <= 4 * rows[..., 0].std(axis=0))
