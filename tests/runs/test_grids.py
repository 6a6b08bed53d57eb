"""The grids of a patch: a plan counts those that a run makes, and a wave of the gap has cells that show it."""

import numpy as np
import pytest
from scene_texts import SMALL_PATCH

from patchfem import build
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch import grids, store
from patchfem.runs.patch.plan import expected_grids
from patchfem.scene import loads

PIECES = """[contact]
length = "12 mm"
width = "10 mm"
height = "5 mm"
load = "200 N"
substrate = "Ti-8Al-1Mo-1V"
"""
COATED = '[contact.coating]\nmaterial = "WC-Co"\nthickness = "0.15 mm"\n'
ENDING = "[contact.{}]\n{}\n"


def asked(text, *sets):
    return build(loads(text, "a.toml", sets)).patch


def grids_of_run(patch, tolerance) -> tuple:
    """(columns, rows) of nodes of the finest grid of each piece, as a run solves them; how many levels there are."""
    patches = solve_with_coarser(patch, tolerance)
    pair = patches[0].pair
    bodies = [pair.grid] if pair.upper is pair.piece else [pair.grid, pair.upper_grid]
    return tuple((body.x.size, body.depth.size) for body in bodies), sum(
        one is not None for one in patches
    )


@pytest.mark.parametrize(
    "text, tolerance, sets",
    [
        (PIECES, 1e-2, []),
        (PIECES + COATED, 1e-3, []),
        (SMALL_PATCH, 1e-3, []),
        (PIECES + ENDING.format("step", 'height = "2 um"\nat = "1 mm"'), 3e-3, []),
        (PIECES + ENDING.format("tilt", 'angle = "0.2 mrad"'), 1e-2, []),
        (PIECES + ENDING.format("load_line", 'offset = "3 mm"'), 1e-2, []),
        (PIECES + '[contact.upper]\nheight = "4 mm"\n', 1e-3, ["contact.element_size=0.2 mm"]),
    ],
)
def test_exact_a_plan_counts_the_grids_of_the_run(text, tolerance, sets):
    patch = asked(text, *sets)
    found, (finest, levels) = expected_grids(patch, tolerance), grids_of_run(patch, tolerance)
    assert found.finest == finest
    assert found.levels == levels
    assert found.points == max(n for n, _ in finest)


@pytest.mark.parametrize(
    "text",
    [
        PIECES + ENDING.format("crown", 'radius = "2 m"'),
        PIECES + ENDING.format("crown", 'radius = "0.3 m"'),
        PIECES
        + '[contact.asperities]\nlaw = "exponential"\ndecay_length = "0.2 um"\n'
        + ENDING.format("tilt", 'angle = "0.5 mrad"'),
    ],
)
def test_always_a_plan_expects_the_grids_of_a_contact_that_only_its_pressure_ends(text):
    """A plan searches the contact as a run does."""
    patch = asked(text)
    (found,), ((wanted,), _) = expected_grids(patch, 1e-2).finest, grids_of_run(patch, 1e-2)
    assert np.array_equal(found, wanted)


ECCENTRIC_LOAD = 'offset = "3 mm"'
SMALL_CROWN = 'radius = "0.3 m"'


@pytest.mark.parametrize(
    "ending", [ENDING.format("load_line", ECCENTRIC_LOAD), ENDING.format("crown", SMALL_CROWN)]
)
def test_always_further_searches_for_the_contact_give_the_same_columns(ending, monkeypatch):
    columns = []
    for fraction in (grids.BAND_CHANGE_TOL, -1.0):  # a search is never settled with -1
        store.clear_cache()
        monkeypatch.setattr(grids, "BAND_CHANGE_TOL", fraction)
        columns.append(grids.make_base_grids(asked(PIECES + ending)).bodies[0].x)
    settled, searched = columns
    assert np.abs(settled - searched).max() < 0.1 * np.diff(searched).min()
