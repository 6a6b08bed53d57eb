"""A scar over most of the trace: its unworn flanks tell it from a bent datum and from flanks that grew.

Traces of 4 mm at 1 um, Rq 0.4 um with waves of 0.25 um, noise 20 nm, shift 20 um. The rule was built on seeds 0 to 9.
"""

import re

import numpy as np
import pytest
from pairs import UM
from scipy.ndimage import gaussian_filter1d

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

HELD_OUT = 7002
MM = 1e-3


def worn_pair(seed: int, depth, bow: float = 0.0) -> tuple:
    """(comparison, worn area [m2]) of a surface and of the same less depth(x [m]) [m], with a sag [m] of the datum."""
    random = np.random.default_rng(seed)
    x = (np.arange(4200) - 100) * UM
    parts = [
        size * part / part.std()
        for size, part in (
            (0.4 * UM, gaussian_filter1d(random.standard_normal(x.size), 8)),
            (0.25 * UM, gaussian_filter1d(random.standard_normal(x.size), 300)),
        )
    ]
    z = sum(parts)
    lost = depth(x)
    after = z - lost + bow * ((x - 2 * MM) / (2 * MM)) ** 2
    traces = [
        Profile(
            frozen_array(x[100:4100]),
            frozen_array(one + 20e-9 * random.standard_normal(4000)),
            name,
        )
        for one, name in ((z[100:4100], "before"), (after[80:4080], "after"))
    ]
    return compare_traces(*traces), float(lost[(x >= 0) & (x < 3.98 * MM)].sum() * UM)


def scar(width: float, power: int, depth: float = 0.6 * UM):
    return lambda x: depth * np.clip(1 - np.abs((x - 2 * MM) / (width / 2)) ** power, 0, None)


@pytest.mark.parametrize("width, power", [(3.3, 2), (3.5, 2), (3.5, 20)])
def test_always_flanks_tell_a_wide_scar_from_a_bow_and_from_grown_flanks(width, power):
    found, true = worn_pair(HELD_OUT, scar(width * MM, power))
    assert found.worn.area.value == pytest.approx(true, rel=0.03)
    # twice the interval
    assert abs(found.worn.area.value - true) < found.worn.area.high - found.worn.area.low
    headline, said = compose_verdict([found])
    assert headline.startswith("worn, no change") and any("Other reading" in one for one in said)


def test_always_flanks_too_short_to_tell_leave_both_readings_with_their_numbers():
    found, true = worn_pair(HELD_OUT, scar(3.7 * MM, 2))
    assert found.worn.area.value is None and found.worn.extent is None and not found.tracks.sizes
    headline, said = compose_verdict([found])
    assert headline.startswith("a scar or a bent datum, both are possible")
    line = found.alignment.rival
    assert line.depth.mean() * np.ptp(line.x) == pytest.approx(true, rel=0.05)
    told = re.search(
        r"datum bent by ([\d.]+) nm .* trace ([\d.]+) um\^2 wore off, ([\d.]+) nm on average",
        said[0],
    )
    assert float(told[1]) == pytest.approx(found.alignment.bend * 1e9, rel=0.01)
    assert float(told[2]) == pytest.approx(true * 1e12, rel=0.05)


@pytest.mark.parametrize("bow", [0.3 * UM, -0.3 * UM])
def test_always_a_scar_beside_flanks_of_a_bent_datum_is_not_given_as_wear_of_its_ends(bow):
    """The bow of both together left 33 (17 to 49) um^2 at the ends, of 1400 um^2 that wore off."""
    found, _ = worn_pair(HELD_OUT + 2, scar(3.5 * MM, 2), bow)
    assert found.worn.area.value is None and found.alignment.rival is not None
    assert "two readings" in compose_verdict([found])[1][0]


def test_always_a_flat_floor_beside_short_flanks_has_both_readings_told():
    """The headline said that material grew."""
    found, true = worn_pair(HELD_OUT, scar(3.7 * MM, 20))
    headline, said = compose_verdict([found])
    assert headline.startswith("a scar or material that grew at the ends")
    assert found.worn.area.value is None
    assert "of material grew at the ends" in said[0]
    assert "or the ends are unworn and in a scar" in said[0]
    line = found.alignment.rival
    assert line.depth.mean() * np.ptp(line.x) == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize(
    "depth, bow",
    [
        (lambda x: 0 * x, 0.5 * UM),
        (lambda x: 0 * x, 0.0),
        (scar(0.7 * MM, 2), 0.5 * UM),
        (lambda x: -scar(0.7 * MM, 2)(x), 0.0),
        (lambda x: scar(0.7 * MM, 2)(x + 1.9 * MM), 0.5 * UM),
    ],
)
def test_exact_a_bow_a_narrow_track_an_edge_and_a_deposit_have_no_rival(depth, bow):
    assert worn_pair(HELD_OUT + 1, depth, bow)[0].alignment.rival is None


def test_always_each_of_two_tracks_is_told_with_its_area():
    """Sentence and table described one of them, and nothing said that there were two."""
    one = scar(0.5 * MM, 2, 0.8 * UM)
    two = scar(0.7 * MM, 2, 1.2 * UM)
    found, true = worn_pair(HELD_OUT, lambda x: one(x + 0.8 * MM) + two(x - 0.9 * MM))
    said = " ".join(compose_verdict([found])[1])
    assert "2 tracks were found" in said and len(found.tracks.others) == 1
    told = re.search(
        r"Worn, too: a track from x = (\S+) um to (\S+) mm .* lost in this track is ([\d.]+) um",
        said,
    )
    # shifted by 20 um
    assert (float(told[1]), 1e3 * float(told[2])) == pytest.approx((970, 1470), abs=60)
    small = 2 / 3 * 0.5 * MM * 0.8 * UM
    assert 1e-12 * float(told[3]) == pytest.approx(small, rel=0.03)
    assert found.tracks.sizes["area_gross"].value + 1e-12 * float(told[3]) == pytest.approx(
        true, rel=0.03
    )
