"""Files in the wrong order: the headline says so, for exchanged traces and not for others; places to the same digits.

The rule was tuned on seeds 95000 to 95020; the seeds here are others, but for the one that was called wrongly.
"""

from dataclasses import replace

import numpy as np
import pytest
from pairs import KINDS, pair, track

from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import GREW as EXCHANGED
from patchfem.surface.compare.verdict import compose_verdict

HELD_OUT = 96000
SHARES = (0.1, 0.3, 0.5)


def made_pairs(count: int):
    """Yield pairs and tracks of held-out seeds."""
    for seed in range(HELD_OUT, HELD_OUT + count):
        yield from (pair(seed, share=share) for share in SHARES)
        yield from (track(kind, seed, 2001) for kind in KINDS)


@pytest.mark.slow
def test_always_the_order_of_150_made_traces_is_known():
    """Called exchanged though they are not: at most 2 of 150; told where they are: at least 8 of 10."""
    called = [
        [
            compare_traces(*files).is_exchanged
            for files in ((p.before, p.after), (p.after, p.before))
        ]
        for p in made_pairs(25)
    ]
    wrong, right = np.mean(called, axis=0)
    assert wrong <= 2 / 150 and right >= 0.8, (wrong, right)


@pytest.mark.slow
@pytest.mark.share(1)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_exact_the_headline_names_the_order_first(share):
    """Unworn traces have no order: nothing is said about it either way."""
    p = pair(30077, share=share)
    there = compare_traces(p.before, p.after)
    back = compare_traces(p.after, p.before)
    assert not there.is_exchanged and EXCHANGED not in compose_verdict([there])[0]
    assert back.is_exchanged == (share > 0) and compose_verdict([back])[0].startswith(
        EXCHANGED
    ) == (share > 0)
    if share:
        assert compose_verdict([back])[0] == f"{EXCHANGED}; as given: increased"
        assert back.worn.mean.value is None


def test_always_a_flat_floor_is_no_reason_to_exchange():
    """The worn floor alone agrees when exchanged, with less noise: 21 of 100 heights against 76."""
    p = track("band", 95000, 2001)
    found = compare_traces(p.before, p.after)
    assert found.basis == "place" and not found.is_exchanged
    assert found.motion.shift.low <= p.shift <= found.motion.shift.high
    assert not any("wrong order" in text for text in found.notes)
    assert compare_traces(p.after, p.before).is_exchanged


@pytest.fixture(scope="module")
def compared():
    """A pair of traces with a worn part."""
    return compare_traces(*pair(90301)[:2])


@pytest.mark.parametrize(
    "first, last, says",
    [
        (76.58e-9, 7.9404e-3, "0 um to 7.94 mm"),
        (-3.2e-6, 7.9404e-3, "-3 um to 7.94 mm"),
        (1.23456e-3, 7.98765e-3, "1.235 mm to 7.988 mm"),
        (0.0, 0.0, "0 um to 0 um"),
        (-2.04e-6, 100e-6, "-2 um to 100 um"),
    ],
)
def test_exact_two_places_have_their_digits_in_common(compared, first, last, says):
    """The sentence once said "from x = 76.58 nm to 7.94 mm"."""
    ends = compared.worn.extent.before
    places = tuple(end._replace(value=value) for end, value in zip(ends, (first, last)))
    worn = replace(compared.worn, extent=compared.worn.extent._replace(before=places))
    sentences = compose_verdict([replace(compared, worn=worn)])[1]
    text = next(text for text in sentences if "Worn from x = " in text)
    assert f"Worn from x = {says} in the first trace (before wear), that is from " in text
