"""The meshes of a patch foreseen: where springs beside each other bear, and the grids that follow from it."""

import numpy as np
import pytest
from scene_texts import SMALL_PATCH

from patchfem.model.model import build
from patchfem.runs.patch.foreseen import contact
from patchfem.runs.patch.foreseen.grids import sizes
from patchfem.runs.patch.ladder import solve_all
from patchfem.scene.scene import loads

PIECES = """[contact]
length = "12 mm"
width = "10 mm"
height = "5 mm"
load = "200 N"
substrate = "Ti-8Al-1Mo-1V"
"""
COATED = '[contact.coating]\nmaterial = "WC-Co"\nthickness = "0.15 mm"\n'
X = np.linspace(-6e-3, 6e-3, contact.PLACES + 1)
CELL = 12e-3 / contact.PLACES


def asked(text, *sets):
    return build(loads(text, "a.toml", sets)).patch


def test_exact_springs_under_a_crown_bear_over_their_closed_form():
    """The integral of (a^2 - x^2)/(2 R) over -a..a is 2 a^3/(3 R)."""
    half, radius = 2.5e-3, 3.0
    bears = contact._bearing(X, X**2 / (2 * radius), 2 * half**3 / (3 * radius), None)
    assert np.abs(X[bears]).max() == pytest.approx(half, abs=CELL)


@pytest.mark.parametrize("arm", [1.9e-3, 2.5e-3, 4e-3, 5.5e-3, 5.98e-3])
def test_exact_springs_under_a_load_off_their_middle_bear_over_three_times_its_distance_from_the_end(arm):
    """Bars under a load at e > L/6 bear over 3 (L/2 - e), whatever their softness; within the middle third over all."""
    bears = contact._bearing(X, np.zeros(X.size), 1e-9, arm)
    length = X[-1] - X[bears].min()
    assert length == pytest.approx(min(12e-3, 3 * (6e-3 - arm)), abs=2 * CELL)


@pytest.mark.parametrize("text, tolerance, sets", [
    (PIECES, 1e-2, []), (PIECES + COATED, 1e-3, []), (SMALL_PATCH, 1e-3, []),
    (PIECES + '[contact.step]\nheight = "2 um"\nat = "1 mm"\n', 3e-3, []),
    (PIECES + '[contact.upper]\nheight = "4 mm"\n', 1e-3, ["contact.element_size=0.2 mm"])])
def test_exact_grids_are_those_of_the_run_where_all_or_one_side_of_a_step_bears(text, tolerance, sets):
    patch = asked(text, *sets)
    pair = solve_all(patch, tolerance)[0].pair
    bodies = [pair.grid] if pair.upper is pair.piece else [pair.grid, pair.upper_grid]
    assert sizes(patch, tolerance).finest == tuple((body.x.size, body.depth.size) for body in bodies)


@pytest.mark.parametrize("shape, off", [('[contact.crown]\nradius = "2 m"\n', (2, 1)),
                                        ('[contact.tilt]\nangle = "0.2 mrad"\n', (0, 0)),
                                        ('[contact.load_line]\noffset = "3 mm"\n', (0, 0))])
def test_always_first_grids_are_nearly_those_that_a_search_finds(shape, off):
    """The coarsest grid, by its nodes: springs err in how long a contact is, and columns go with its logarithm. A
    contact half or twice as long has two columns or a row more or less than that."""
    from patchfem.runs.patch.grading import base_grids

    patch = asked(PIECES + shape, "accuracy.tolerance=0.01")
    columns, rows = sizes(patch, 0.01).finest[0]
    (grid,) = base_grids(patch)
    missed = grid.x.size - ((columns - 1) / 4 + 1), grid.depth.size - ((rows - 1) / 4 + 1)
    assert 0 <= missed[0] <= off[0] and 0 <= missed[1] <= off[1]


def test_refuses_no_plan_for_want_of_a_mesh_as_a_plan_makes_none(monkeypatch):
    from patchfem.runs.patch import condensed
    from patchfem.runs.plan import plan

    monkeypatch.setattr(condensed, "assemble", None)
    text = PIECES + '[contact.crown]\nradius = "2 m"\n'
    with pytest.raises(TypeError):
        solve_all(asked(text), 1e-2)
    assert plan(loads(text, "a.toml")).unknowns["interface_points"] > 100
