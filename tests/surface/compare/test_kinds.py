"""Every kind of pair that a laboratory brings: no sentence is false, no "at most" stands below what wore off.

The rules were set on seeds 0 to 8 and 1000 to 1040; the seeds here are others.
"""

import numpy as np
import pytest
from pairs import UM
from worn_kinds import KINDS, made

from patchfem.core import frozen_array
from patchfem.surface.compare.compare import compared
from patchfem.surface.compare.verdict import EXCHANGED, verdicts
from patchfem.surface.profile import Profile, despiked

HELD_OUT = 52000
UNWORN = ("unworn", "even", "wedge", "arch", "deposits", "dust", "dropouts", "bent", "exchanged", "elsewhere")
WORN = tuple(kind for kind in KINDS if kind not in UNWORN)


def faults(kind: str, seed: int) -> tuple:
    """Sentences that are false of a pair, and whether each interval of mean and largest depth holds the truth."""
    pair = made(kind, seed)
    one = compared(pair.before, pair.after)
    headline, sentences = verdicts([one])
    text, out, held = " ".join((headline, *sentences)), [], []
    worn = pair.worn[::-1] if one.mirrored else pair.worn
    if kind in UNWORN and (headline.startswith("worn") or "; worn" in headline):
        out.append(f"{kind} {seed}: {headline}")
    if "at most" in text and one.worn.mean.high < worn.mean():
        out.append(f"{kind} {seed}: at most {one.worn.mean.high}")
    if kind not in ("exchanged", "deposits") and headline.startswith(EXCHANGED):
        out.append(f"{kind} {seed}: {headline}")
    if (one.registration is None) != headline.startswith("not comparable") and not one.exchanged:
        out.append(f"{kind} {seed}: {headline}")
    if one.mirrored != (kind == "mirrored" and one.registration is not None) or \
            one.turned != (kind == "turned" and one.registration is not None):
        out.append(f"{kind} {seed}: mirrored {one.mirrored}, turned {one.turned}")
    if one.registration is not None and one.worn.mean.value is not None and not one.exchanged:
        there = np.interp(one.registration.x, pair.after.x, worn)
        held = [q.low <= true <= q.high for q, true in ((one.worn.mean, there.mean()), (one.worn.largest, there.max()))]
    return out, held


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [1, pytest.param(40, marks=pytest.mark.slow)])
def test_always_no_sentence_is_false(kind, count):
    """Intervals hold 90 of 100; of 40 pairs one may be called what it is not."""
    found = [faults(kind, seed) for seed in range(HELD_OUT, HELD_OUT + count)]
    false = [text for one, _ in found for text in one]
    assert len(false) <= count // 40, false
    held = [one for _, one in found if one]
    if count > 1 and len(held) > 20:
        assert (np.mean(held, axis=0) > 0.85).all(), np.mean(held, axis=0)


def test_exact_even_wear_has_no_limit_and_the_tilt_is_half_its_length_of_wear():
    pair = made("unworn", HELD_OUT + 50)
    x = pair.after.x
    after = Profile(x, frozen_array(pair.after.z - 3 * UM - 2e-3 * x), "after")
    one = compared(pair.before, after)
    length = float(np.ptp(one.registration.x))
    assert one.worn.mean.value is None and one.hidden.high is None and one.hidden.low == 0.0
    tilt = abs(one.tilt.value)
    assert one.hidden.value == pytest.approx((tilt + (one.tilt.high - one.tilt.low) / 2) * length / 2, rel=1e-9)
    text = verdicts([one])[1][0]
    assert "at most" not in text and "Even wear of any depth" in text and "reference mark" in text


def test_exact_a_spike_is_found_with_its_feet_and_a_groove_stays():
    pair = made("groove", HELD_OUT + 51)
    assert despiked(pair.after) is pair.after
    z = np.array(pair.before.z)
    z[300] += 200 * UM
    left = despiked(Profile(pair.before.x, frozen_array(z), "before"))
    assert left.missing[300] and left.missing.sum() <= 3 and "--keep-spikes" in left.notes[-1]
    one, kept = (compared(Profile(pair.before.x, frozen_array(z), "before"), pair.after, keep_spikes=keep)
                 for keep in (False, True))
    assert one.removed == (int(left.missing.sum()), 0) and kept.removed == (0, 0)
    assert one.worn.largest.value == pytest.approx(pair.worn.max(), rel=0.02) and kept.worn.largest.value > 100 * UM


@pytest.mark.parametrize("shape", ["speck", "hollow"])
def test_exact_dust_and_dropouts_of_many_samples_are_no_wear(shape):
    """A Gaussian speck before, a signal lost over ten samples after: both read as micrometres of wear."""
    pair = made("groove", HELD_OUT + 52)
    k = np.arange(pair.before.x.size)
    before, after = np.array(pair.before.z), np.array(pair.after.z)
    if shape == "speck":
        before += 60 * UM * np.exp(-0.5 * ((k - 120) / 3) ** 2)
    else:
        after[115:125] -= 60 * UM
    one = compared(Profile(pair.before.x, frozen_array(before), "b"), Profile(pair.after.x, frozen_array(after), "a"))
    assert one.removed[shape == "hollow"] >= 8
    assert one.worn.largest.low <= pair.worn.max() <= one.worn.largest.high


@pytest.mark.parametrize("seed", range(2))
def test_always_sizes_of_a_track_are_of_one_span(seed):
    pair = made("edge", HELD_OUT + 60 + seed)
    one = compared(pair.before, pair.after)
    track = one.tracks.sizes
    inside = (pair.after.x >= track["from"].value) & (pair.after.x <= track["to"].value)
    true = np.trapezoid(pair.worn[inside], pair.after.x[inside])
    width = track["to"].value - track["from"].value
    assert track["depth_mean"].value == pytest.approx(track["area_gross"].value / width, rel=1e-12)
    assert track["depth_mean"].low <= true / width <= track["depth_mean"].high
    assert track["depth_floor"].low <= pair.worn.max() <= track["depth_floor"].high
    net = track["area_gross"].value - track["pile_up"].value
    assert track["area_net"].value == pytest.approx(net, rel=1e-12)
