"""A list of bonds that fills up grows and goes on, in a march, beside springs and along a given slide."""

from dataclasses import replace

import numpy as np
import pytest
from march_paths import OMEGA, one_mode

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


def model_of(law, entries):
    made = bond_list_model(law, LIMIT, np.inf, 0.0)
    return replace(
        made, fields=made.fields | {"bondlist": np.zeros((len(made.fields["bondlist"]), entries))}
    )


def marched(model, frames=0):
    return march(
        one_mode(OMEGA, 0.01, 1.0),
        SineDrive(5 * 9.80665, OMEGA),
        model,
        3,
        100,
        window=3,
        frames=frames,
    )


@pytest.mark.share(0, 1, 2)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("beside", [False, True])
def test_exact_a_march_whose_list_grows_is_that_with_room_from_the_start(law, beside):
    """Every strip is kept, so the list fills up within a cycle: it goes back, takes twice the capacity and goes on."""

    def model(entries):
        alone = model_of(LAWS[law], entries)
        return (
            JointsModel(alone, (make_cubic_spring(1, 1e10),), np.ones((2, 1)), LIMIT)
            if beside
            else alone
        )

    few, many = (
        marched(model(entries), frames=4) for entries in (3 if law == "printed" else 40, 20_000)
    )
    assert many.ledger["strips"] > (6 if law == "printed" else 200)
    assert np.array_equal(few.response.slide, many.response.slide)
    assert np.array_equal(few.window.force, many.window.force) and few.ledger == many.ledger


def test_refuses_more_entries_than_the_stated_limit(monkeypatch):
    monkeypatch.setattr(capacity, "MAX_ENTRIES", 100)
    with pytest.raises(
        Missing, match=r"grew beyond 100 entries \(0 MB\) at step \d+; raise accuracy.tail"
    ):
        marched(model_of(LAWS["stretch"], 40))


def test_exact_a_bench_whose_list_grows_is_that_with_room_from_the_start(monkeypatch):
    from patchfem.friction.bonds import list_numbers

    text = (
        '[normal]\nload = "100 N"\n[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"\norder = 2\n'
        '[slide]\nkind = "sine"\namplitude = "40 um"\nfrequency = "10 Hz"\n[accuracy]\nquadrature = "direct"\n'
    )
    one = bench.run(build(text), None, 400)
    monkeypatch.setattr(list_numbers, "list_capacity", lambda *_: 50)
    two = bench.run(build(text), None, 400)
    assert np.array_equal(one.force, two.force) and np.array_equal(one.ledger, two.ledger)
