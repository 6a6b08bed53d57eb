"""Random rigs of `hybrid` beside an independent integrator: values and stated errors agree."""

from random_rigs import RIGS, compare_with_reference


def test_always_random_rigs_agree_with_independent_integrator():
    """Each measure lies within five errors of its reference, at most one of a rig and 5 % of all outside the error."""
    rigs = {name: compare_with_reference(**rig) for name, rig in RIGS.items()}
    outside = {
        name: {measure: ratio for measure, ratio in ratios.items() if ratio > 1}
        for name, ratios in rigs.items()
    }
    assert all(len(ratios) < 2 for ratios in outside.values()), outside
    assert all(ratio < 5 for ratios in outside.values() for ratio in ratios.values()), outside
    n_values = sum(map(len, rigs.values()))
    assert n_values > 500 and sum(map(len, outside.values())) < 0.05 * n_values
