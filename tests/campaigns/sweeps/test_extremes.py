"""Smallest or largest value of a measure over a swept key: place, interval and band."""

import numpy as np
import pytest
from sweep_tables import make_table

from patchfem.campaigns.sweeps.changes import analyse
from patchfem.export.sweeps.words import make_verdict


def find(x, y, errors=0.0):
    """Return the extremes of two main measures with values y over a load x; the second one is their negative."""
    columns = {"loop_area": y, "relative_displacement_amplitude": -np.asarray(y)}
    analysis = analyse(make_table({"normal.load": x}, columns, errors=errors))
    return {one.measure: one for one in analysis.extremes}


def test_exact_parabola_has_its_vertex_and_band():
    """A parabola has its vertex to round-off; its band ends where linear interpolation leaves 5 % of the value."""
    x = np.linspace(0.0, 10.0, 21)
    found = find(x, 100.0 - 4.0 * (x - 4.2) ** 2)
    for name, sign in (("loop_area", 1), ("relative_displacement_amplitude", -1)):
        one = found[name]
        assert one.is_largest == (sign > 0) and one.place == pytest.approx(4.2, rel=1e-12)
        assert one.value == pytest.approx(sign * 100.0, rel=1e-12)
        assert one.interval == pytest.approx((4.2, 4.2), rel=1e-9)
        ends = np.array([4.2 - 1.25**0.5, 4.2 + 1.25**0.5])
        assert np.abs(np.array(one.band) - ends).max() < 0.03


def test_always_interval_contains_the_extreme():
    """Of 400 smooth curves with errors, over a linear or a logarithmic key, at least 95 % have it inside the interval."""
    rng = np.random.default_rng(104)
    n_found = 0
    n_held = 0
    for _ in range(400):
        n = int(rng.integers(5, 40))
        u = np.linspace(-1, 1, n)
        top, skew, width = rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(0.3, 2.0)
        is_log = rng.random() < 0.5
        to_key = (lambda u: 10.0**u) if is_log else (lambda u: 3.0 + u)
        true = 1 / (1 + ((u - top) / width) ** 2 * (1 + skew * (u - top)))
        error = 10.0 ** rng.uniform(-6, -2.5)
        noisy = true + error * rng.uniform(-1, 1, n)
        one = find(to_key(u), noisy, errors=error).get("loop_area")
        if one is not None and one.is_largest:
            n_found += 1
            n_held += one.interval[0] <= to_key(top) <= one.interval[1]
            assert one.band[0] <= one.interval[1] and one.band[1] >= one.interval[0]
    assert n_found > 300 and n_held >= 0.95 * n_found


@pytest.mark.parametrize(
    "y", [[1, 2, 3, 4], [4, 2, 1, 0], [1, 1 + 1e-6, 1], [1, 2], [1, np.nan, 1]]
)
def test_exact_monotonic_measures_have_no_extreme(y):
    """A measure that rises or falls within its errors, or has fewer than three values, has no extreme."""
    assert find(np.arange(1.0, len(y) + 1), np.array(y, float), errors=1e-6) == {}


def test_exact_first_sentence_names_each_main_measure():
    """The first sentence names the range of each main measure, and its extreme with interval and band."""
    x = np.linspace(1.0, 5.0, 9)
    columns = {
        "loop_area": 10 - (x - 3.1) ** 2,
        "relative_displacement_amplitude": x,
        "absolute_acceleration_peak": np.full(9, 2.0),
    }
    table = make_table({"normal.load": x}, columns, errors=1e-3)
    sentence = make_verdict(table, analyse(table))[0]
    assert sentence.startswith(
        "With normal.load, relative displacement amplitude changes most: from 1 at 1 to 5 at 5; "
    )
    assert "loop area from 5.59 at 1 to 9.99 at 3 (largest, 10, at 3.1, 3.09" in sentence
    assert "; within 5 % of it from 2.4" in sentence and " to 3.76" in sentence
    assert sentence.endswith("; absolute acceleration peak by no more than its error.")
