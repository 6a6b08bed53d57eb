"""The sentence about cases that miss the tolerance names them as far as a reader can use their names."""

import numpy as np
import pytest
from sweep_tables import make_table

from patchfem.campaigns.sweeps.changes import analyse
from patchfem.export.sweeps.words import make_verdict


@pytest.mark.parametrize("n_missing", range(6))
def test_exact_missing_cases_are_counted_and_up_to_three_are_named(n_missing):
    """The number of cases above the tolerance is stated, three values of the key are named, and others are mentioned."""
    forces = np.arange(1.0, 9.0)
    errors = np.where(forces <= n_missing, 0.1, 1e-5)
    table = make_table(
        {"drive.force": forces},
        {"relative_displacement_amplitude": forces, "peak_frequency": 1e4 + 0 * forces},
        errors=errors * forces,
    )
    (words,) = [text for text in make_verdict(table, analyse(table)) if "tolerance" in text]
    named = ", ".join(f"{force:.0f}" for force in forces[: min(n_missing, 3)])
    assert (f"{n_missing} over the tolerance in peak amplitude at {named}" in words) == bool(
        n_missing
    )
    assert (f"{named} and others" in words) == (n_missing > 3)
