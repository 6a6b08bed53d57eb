"""Height, slope, spacing and bearing parameters against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from patchfem.surface import Heights, abbott_curve
from patchfem.surface.roughness.parameters import (
    find_crossings,
    fit_core,
    mean_element_height,
    mean_spacing,
)
from patchfem.surface.roughness.rows import AREAL, PRIMARY, ROUGH, TABLE, WAVES, WINDOW

UM = 1e-6


def wave(count=8000, length=400.0, amplitude=UM, section=None) -> Heights:
    """A whole number of sine waves every micrometre, phase off the samples."""
    return Heights(amplitude * np.sin(2 * np.pi * (np.arange(count) + 0.3) / length), UM, section)


def test_exact_a_sine():
    sine = wave()
    assert TABLE["Ra"].compute(sine) == pytest.approx(2 / np.pi * UM, rel=1e-4)
    assert TABLE["Rq"].compute(sine) == pytest.approx(UM / np.sqrt(2), rel=1e-12)
    assert TABLE["Rsk"].compute(sine) == pytest.approx(0, abs=1e-12)
    assert TABLE["Rku"].compute(sine) == pytest.approx(1.5)
    assert TABLE["Rt"].compute(sine) == pytest.approx(2 * UM, rel=1e-4)
    chord = 2 * np.sin(np.pi / 400) / UM  # of the slope between two samples
    assert TABLE["Rdq"].compute(sine) == pytest.approx(UM / np.sqrt(2) * chord, rel=1e-4)
    assert mean_spacing(sine) == pytest.approx(400 * UM, rel=1e-6)


def test_exact_sections_of_a_growing_sine():
    """Rz is the mean over whole sections, Rt that of all, and Rz = Rp + Rv."""
    x = np.arange(1000)
    found = Heights(np.where(x < 950, 1 + x // 200, 99.0) * np.sin(2 * np.pi * x / 40), 1.0, 200.0)
    assert found.sections.shape == (5, 200)
    trace = Heights(found.z[:999], 1.0, 200.0)
    assert trace.sections.shape == (4, 200)  # what is left belongs to none
    assert TABLE["Rz"].compute(trace) == pytest.approx(2 * np.mean([1, 2, 3, 4]), rel=1e-12)
    rp, rv, rz = (TABLE[name].compute(trace) for name in ("Rp", "Rv", "Rz"))
    assert rp + rv == pytest.approx(rz, rel=1e-14)
    assert TABLE["Rt"].compute(trace) == pytest.approx(198, rel=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(20, 300), st.floats(0.1, 10))
def test_always_heights_scale_and_numbers_do_not(seed, count, factor):
    z = np.random.default_rng(seed).normal(0, UM, count)
    one = Heights(z, UM)
    other = Heights(factor * z, UM)
    for row in PRIMARY:
        grown = 1.0 if row.name in ("PSm", "PMr1", "PMr2", "Psk", "Pku") else factor
        value = row.compute(one)
        assert row.compute(other) == (
            None if value is None else pytest.approx(grown * value, rel=1e-9)
        ), row.name


def test_exact_small_and_narrow_hills_do_not_count():
    """A ripple of 4 % on a wave crosses the mean line many times more; the spacing stays that of the wave."""
    x = np.arange(40_000.0)
    z = np.sin(2 * np.pi * x / 4000 + 0.5) + 0.04 * np.sin(2 * np.pi * x / 50)
    found = Heights(z, UM, 8000 * UM)
    assert (np.diff(z > 0) != 0).sum() > 20
    assert find_crossings(found).size == 20
    assert mean_spacing(found) == pytest.approx(4000 * UM, rel=0.005)
    spiked = z.copy()
    spiked[200:210] -= 3  # deep enough, but narrower than 1 % of the section
    assert find_crossings(Heights(spiked, UM, 8000 * UM)).size == 20
    # without a cut-off there is no section to compare with
    assert find_crossings(Heights(spiked, UM)).size == 22


def test_exact_a_trace_without_two_elements_has_no_spacing():
    assert mean_spacing(Heights(np.sin(np.linspace(0, 6, 100)), UM)) is None
    assert mean_spacing(Heights(np.zeros(100), UM)) is None


def test_exact_core_of_gaussian_heights():
    """The curve of a Gaussian surface by its quantiles; line, ratios and areas by quadrature of the normal law."""
    n = 200_001
    ratio = (np.arange(n) + 0.5) / n
    found = fit_core(Heights(norm.isf(ratio), UM))
    middle = ratio[np.abs(ratio - 0.5) <= 0.2]
    slope = np.polyfit(middle, norm.isf(middle), 1)[0]
    top = -slope / 2
    first = norm.sf(top)
    area = norm.pdf(top) - top * first  # of the peaks above the top
    assert found.height == pytest.approx(-slope, rel=1e-4) and found.top == pytest.approx(
        top, rel=1e-4
    )
    assert [found.first_ratio, found.second_ratio] == pytest.approx([first, 1 - first], rel=1e-3)
    assert [found.peak_height, found.valley_depth] == pytest.approx(
        [2 * area / first] * 2, rel=1e-3
    )


def test_exact_a_plateau_with_valleys():
    """Plateau from 0 to -0.1 on 80 % of the length, valleys down to -2: the valleys alone stand out."""
    z = np.concatenate([np.linspace(0, -0.1, 8000), np.linspace(-0.1, -2.1, 2001)[1:]])
    found = fit_core(Heights(z, UM))
    assert found.height == pytest.approx(0.125, rel=1e-3) and found.peak_height == pytest.approx(
        0, abs=1e-4
    )
    share = 0.2 * (1 - 0.025 / 2)  # of the length below the bottom at -0.125
    assert found.second_ratio == pytest.approx(1 - share, abs=1e-4)
    assert found.valley_depth == pytest.approx(2.1 - 0.125, rel=1e-3)


def test_exact_abbott_curve_of_a_sine():
    ratio, level = abbott_curve(wave(), 101)
    assert level == pytest.approx(UM * np.cos(np.pi * ratio), abs=0.01 * UM)


def test_exact_a_flat_trace_has_no_shape():
    flat = Heights(np.zeros(100), UM, 20 * UM)
    without = [row.name for row in ROUGH if row.compute(flat) is None]
    assert without == ["Rsk", "Rku", "RSm", "Rk", "Rpk", "Rvk", "Mr1", "Mr2", "Rc"]


def test_exact_every_row_has_a_name_of_its_own_and_a_definition():
    rows = [*PRIMARY, *ROUGH]
    assert len(rows) + len(AREAL) + len(WAVES) + len(WINDOW) == len(TABLE)
    assert all(len(row.text.split()) > 4 and row.unit in ("m", "1") for row in TABLE.values())


def test_exact_elements_of_unlike_heights():
    """Triangles of 1, 2, 3, 4 over dales of 1: from rise to rise 2 3 4 5, from fall to fall 3 4 5 (a dale of 1, then
    the next hill): their mean over both kinds."""
    hills = [1.0, 2.0, 3.0, 4.0]
    z = np.concatenate(
        [np.concatenate([h * np.array([0.5, 1, 0.5]), [-0.5, -1, -0.5]]) for h in hills]
    )
    z = np.concatenate([[-0.5, -1, -0.5], z])  # crossings: rise, fall, ... the last dale has no end
    assert mean_element_height(Heights(z, 1.0)) == pytest.approx(
        np.mean([2, 3, 3, 4, 4, 5]), rel=1e-12
    )
