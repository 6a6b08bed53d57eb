"""Lists of bonds whose arrays are enlarged during a march, beside springs and along a prescribed
slide."""

from dataclasses import replace

import numpy as np
import pytest
from march_paths import OMEGA, make_one_mode

from patchfem import build
from patchfem.core import Missing, SineDrive
from patchfem.dynamics import JointsModel, bond_list_model, make_cubic_spring
from patchfem.dynamics.march import capacity
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.runs.bench import bench

LAWS = {
    "stretch": Bonds(0.4, 2e-5, 0.5), "printed": Bonds(0.4, 2e-5, 1.0, "report", initial=0.0),
    "growing": Bonds(0.4, 2e-5, 1.0, "report", 0.6, 10.0, 5e-6, 1e-4),
}  # fmt: skip
LIMIT = 0.4 * 98.0665


def make_model(law, entries):
    """Return the model of a bond list with arrays for a number of entries."""
    original = bond_list_model(law, LIMIT, np.inf, 0.0)
    return replace(
        original,
        fields=original.fields
        | {"bondlist": np.zeros((len(original.fields["bondlist"]), entries))},
    )


def march_model(model, frames=0):
    """Return a march of three cycles at 5 g."""
    return march(
        make_one_mode(OMEGA, 0.01, 1.0),
        SineDrive(5 * 9.80665, OMEGA),
        model,
        3,
        100,
        window=3,
        frames=frames,
    )


@pytest.mark.share(0, 1, 2)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("with_spring", [False, True])
def test_exact_enlarged_list_equals_large_list(law, with_spring):
    """A march whose list fills up within a cycle goes back, doubles the arrays and continues; the
    results are bit-identical to those with large arrays."""

    def model(entries):
        patch = make_model(LAWS[law], entries)
        return (
            JointsModel(patch, (make_cubic_spring(1, 1e10),), np.ones((2, 1)), LIMIT)
            if with_spring
            else patch
        )

    growing, large = (
        march_model(model(entries), frames=4) for entries in (3 if law == "printed" else 40, 20_000)
    )
    assert large.ledger["strips"] > (6 if law == "printed" else 200)
    assert np.array_equal(growing.response.slide, large.response.slide)
    assert (
        np.array_equal(growing.window.force, large.window.force) and growing.ledger == large.ledger
    )


def test_refuses_list_longer_than_limit(monkeypatch):
    """A list that exceeds the largest number of entries is refused with a message that names the
    key to change."""
    monkeypatch.setattr(capacity, "MAX_ENTRIES", 100)
    with pytest.raises(
        Missing, match=r"grew beyond 100 entries \(0 MB\) at step \d+; raise accuracy.tail"
    ):
        march_model(make_model(LAWS["stretch"], 40))


def test_exact_enlarged_list_of_bench_equals_large_list(monkeypatch):
    """A bench whose list is enlarged has bit-identical forces and energies to one with a large
    list."""
    from patchfem.friction.bonds import list_numbers

    text = (
        '[normal]\nload = "100 N"\n[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"\norder = 2\n'
        '[slide]\nkind = "sine"\namplitude = "40 um"\nfrequency = "10 Hz"\n[accuracy]\nquadrature = "direct"\n'
    )
    large = bench.run_bench(build(text), None, 400)
    monkeypatch.setattr(list_numbers, "list_capacity", lambda *_: 50)
    growing = bench.run_bench(build(text), None, 400)
    assert np.array_equal(large.force, growing.force) and np.array_equal(
        large.ledger, growing.ledger
    )
