"""Height, slope, spacing and bearing parameters of traces, compared with closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from patchfem.surface.roughness.rows import PRIMARY, TABLE
from scipy.stats import norm

from patchfem.surface import Heights, abbott_curve
from patchfem.surface.roughness.parameters import (
    find_crossings,
    fit_core,
    mean_element_height,
    mean_spacing,
)

UM = 1e-6


def make_wave(count=8000, length=400.0, amplitude=UM, section=None) -> Heights:
    """Return the heights of a whole number of sine waves at steps of one micrometre."""
    return Heights(amplitude * np.sin(2 * np.pi * (np.arange(count) + 0.3) / length), UM, section)


def test_exact_parameters_of_sine():
    """Parameters of a sine agree with the closed forms."""
    heights = make_wave()
    assert TABLE["Ra"].compute(heights) == pytest.approx(2 / np.pi * UM, rel=1e-4)
    assert TABLE["Rq"].compute(heights) == pytest.approx(UM / np.sqrt(2), rel=1e-12)
    assert TABLE["Rsk"].compute(heights) == pytest.approx(0, abs=1e-12)
    assert TABLE["Rku"].compute(heights) == pytest.approx(1.5)
    assert TABLE["Rt"].compute(heights) == pytest.approx(2 * UM, rel=1e-4)
    chord = 2 * np.sin(np.pi / 400) / UM  # slope between two samples relative to the amplitude
    assert TABLE["Rdq"].compute(heights) == pytest.approx(UM / np.sqrt(2) * chord, rel=1e-4)
    assert mean_spacing(heights) == pytest.approx(400 * UM, rel=1e-6)


def test_exact_sections_of_growing_sine():
    """Rz is the mean over whole sections, Rt belongs to the whole trace, and Rz = Rp + Rv."""
    x = np.arange(1000)
    found = Heights(np.where(x < 950, 1 + x // 200, 99.0) * np.sin(2 * np.pi * x / 40), 1.0, 200.0)
    assert found.sections.shape == (5, 200)
    trace = Heights(found.z[:999], 1.0, 200.0)
    assert trace.sections.shape == (4, 200)  # the incomplete last section is left out
    assert TABLE["Rz"].compute(trace) == pytest.approx(2 * np.mean([1, 2, 3, 4]), rel=1e-12)
    rp, rv, rz = (TABLE[name].compute(trace) for name in ("Rp", "Rv", "Rz"))
    assert rp + rv == pytest.approx(rz, rel=1e-14)
    assert TABLE["Rt"].compute(trace) == pytest.approx(198, rel=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(20, 300), st.floats(0.1, 10))
def test_always_parameters_scale_with_heights(seed, count, factor):
    """Parameters of height scale with the heights, and dimensionless ones do not change."""
    z = np.random.default_rng(seed).normal(0, UM, count)
    reference = Heights(z, UM)
    scaled = Heights(factor * z, UM)
    for row in PRIMARY:
        expected_factor = 1.0 if row.name in ("PSm", "PMr1", "PMr2", "Psk", "Pku") else factor
        value = row.compute(reference)
        assert row.compute(scaled) == (
            None if value is None else pytest.approx(expected_factor * value, rel=1e-9)
        ), row.name


def test_exact_small_hills_are_ignored_in_spacing():
    """A ripple of 4 % on a wave crosses the mean line more often, but the spacing stays that of the wave."""
    x = np.arange(40_000.0)
    z = np.sin(2 * np.pi * x / 4000 + 0.5) + 0.04 * np.sin(2 * np.pi * x / 50)
    found = Heights(z, UM, 8000 * UM)
    assert (np.diff(z > 0) != 0).sum() > 20
    assert find_crossings(found).size == 20
    assert mean_spacing(found) == pytest.approx(4000 * UM, rel=0.005)
    spiked = z.copy()
    spiked[200:210] -= 3  # the valley is deep enough, but narrower than 1 % of the section
    assert find_crossings(Heights(spiked, UM, 8000 * UM)).size == 20
    # without a cut-off there is no section for comparison
    assert find_crossings(Heights(spiked, UM)).size == 22


def test_exact_trace_with_one_element_has_no_spacing():
    """A trace with fewer than two profile elements has no mean spacing."""
    assert mean_spacing(Heights(np.sin(np.linspace(0, 6, 100)), UM)) is None
    assert mean_spacing(Heights(np.zeros(100), UM)) is None


def test_exact_core_of_gaussian_heights():
    """The core parameters of Gaussian heights agree with those of the normal law within 0.1 %."""
    n = 200_001
    ratio = (np.arange(n) + 0.5) / n
    found = fit_core(Heights(norm.isf(ratio), UM))
    middle = ratio[np.abs(ratio - 0.5) <= 0.2]
    slope = np.polyfit(middle, norm.isf(middle), 1)[0]
    top = -slope / 2
    first = norm.sf(top)
    area = norm.pdf(top) - top * first  # area of the peaks above the core
    assert found.height == pytest.approx(-slope, rel=1e-4) and found.top == pytest.approx(
        top, rel=1e-4
    )
    assert [found.first_ratio, found.second_ratio] == pytest.approx([first, 1 - first], rel=1e-3)
    assert [found.peak_height, found.valley_depth] == pytest.approx(
        [2 * area / first] * 2, rel=1e-3
    )


def test_exact_core_of_plateau_with_valleys():
    """A plateau with valleys on 20 % of its length has a thin core, no peaks and the depth of the valleys."""
    z = np.concatenate([np.linspace(0, -0.1, 8000), np.linspace(-0.1, -2.1, 2001)[1:]])
    found = fit_core(Heights(z, UM))
    assert found.height == pytest.approx(0.125, rel=1e-3) and found.peak_height == pytest.approx(
        0, abs=1e-4
    )
    fraction = 0.2 * (1 - 0.025 / 2)  # fraction of the length below the core
    assert found.second_ratio == pytest.approx(1 - fraction, abs=1e-4)
    assert found.valley_depth == pytest.approx(2.1 - 0.125, rel=1e-3)


def test_exact_abbott_curve_of_sine():
    """The Abbott curve of a sine agrees with A cos(pi p), where p is the material ratio, within 1 % of A."""
    ratio, level = abbott_curve(make_wave(), 101)
    assert level == pytest.approx(UM * np.cos(np.pi * ratio), abs=0.01 * UM)


def test_exact_mean_element_height_of_unequal_hills():
    """The mean element height Rc of hills of 1 to 4 and dales of 1 is the mean over both kinds of elements.

    From rise to rise the elements have heights of 2, 3, 4 and 5, from fall to fall 3, 4 and 5.
    """
    hills = [1.0, 2.0, 3.0, 4.0]
    z = np.concatenate(
        [np.concatenate([h * np.array([0.5, 1, 0.5]), [-0.5, -1, -0.5]]) for h in hills]
    )
    # the crossings alternate between rise and fall, and the last dale has no end
    z = np.concatenate([[-0.5, -1, -0.5], z])
    assert mean_element_height(Heights(z, 1.0)) == pytest.approx(
        np.mean([2, 3, 3, 4, 4, 5]), rel=1e-12
    )
