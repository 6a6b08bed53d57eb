"""The grids of a patch: a plan predicts those of the run, and short waves of the gap have enough
cells."""

import pytest
from scene_texts import SMALL_PATCH

from patchfem import build
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.plan import predict_grid_sizes
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


def build_patch(text, *sets):
    """Return the patch of a scene with --set options."""
    return build(loads(text, "a.toml", sets)).patch


def count_nodes_of_run(patch, tolerance) -> tuple:
    """Return the numbers of nodes of the interface and of the finest grids, and the number of levels, of a run."""
    patches = solve_with_coarser(patch, tolerance)
    pair = patches[0].pair
    bodies = [pair.grid] if pair.upper is pair.piece else [pair.grid, pair.upper_grid]
    n_nodes = sum(len(body.points) for body in bodies)
    return pair.grid.x.size, n_nodes, sum(level is not None for level in patches)


@pytest.mark.parametrize(
    "text, tolerance, sets",
    [
        (PIECES + COATED, 1e-3, []),
        (SMALL_PATCH, 1e-3, []),
        (PIECES + ENDING.format("step", 'height = "2 um"\nat = "1 mm"'), 3e-3, []),
        (PIECES + ENDING.format("load_line", 'offset = "3 mm"'), 1e-2, []),
        (PIECES + '[contact.upper]\nheight = "4 mm"\n', 1e-3, ["contact.element_size=0.2 mm"]),
    ],
)
def test_exact_plan_predicts_grids_of_run(text, tolerance, sets):
    """A plan predicts the finest grid, the number of levels and the number of interface nodes of the run."""
    patch = build_patch(text, *sets)
    expected = predict_grid_sizes(patch, tolerance)
    assert expected[:3] == count_nodes_of_run(patch, tolerance)


@pytest.mark.parametrize(
    "text",
    [
        PIECES + ENDING.format("crown", 'radius = "0.3 m"'),
        PIECES
        + '[contact.asperities]\nlaw = "exponential"\ndecay_length = "0.2 um"\n'
        + ENDING.format("tilt", 'angle = "0.5 mrad"'),
    ],
)
def test_always_plan_predicts_grid_of_limited_contact(text):
    """A plan searches the contact region of a crown or of a soft skin as a run does and predicts
    the same grid."""
    patch = build_patch(text)
    assert predict_grid_sizes(patch, 1e-2)[:2] == count_nodes_of_run(patch, 1e-2)[:2]
