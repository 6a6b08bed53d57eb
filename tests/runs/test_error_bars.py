"""Errors of all static measures cover the results on meshes refined twice."""

import pytest
from scene_texts import PIECE

from patchfem import build
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch import mesh_levels
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values
from patchfem.scene import loads

BLOCKS = PIECE + 'substrate = "Ti-8Al-1Mo-1V"\n'
SCENES = [  # keys of [contact], drawn at random; the first five have elements of one size
    "coating.thickness=0.4556 mm; coating.material=WC-Co sintered; crown.radius=6.142 m; load=5918.67 N; "
    "holder.rotational_stiffness=3.07e5 N m/rad; element_size=0.270213 mm",
    "load=2878.66 N; crown.radius=0.01855 m; plane=stress; element_size=0.24902 mm",
    "load=590.165 N; tilt.angle=1.432e-6 rad; holder.rotational_stiffness=7.5e4 N m/rad; "
    "element_size=0.264583 mm",
    "load=2554.68 N; crown.radius=0.01495 m; load_line.offset=4.51 mm; element_size=0.154878 mm",
    "load=1411.53 N; tilt.angle=0.002425 rad; crown.radius=1.776 m; element_size=0.226786 mm; "
    "holder.rotational_stiffness=1.67e4 N m/rad",
    "load=4686.04 N; holder.rotational_stiffness=5.39e4 N m/rad",
    "load=74.8035 N; holder.rotational_stiffness=4.09e5 N m/rad",
]
# CPU seconds for a mesh; low, so that two finer levels remain affordable.
MAX_SECONDS = {True: 0.02, False: 0.02}


def compare_with_refined_meshes(scene: str) -> dict:
    """Return name -> (value, error, reference) of a scene; the reference extrapolates two
    refinements."""
    sets = [f"contact.{word}" for word in scene.split("; ")]
    model = build(loads(BLOCKS, "a.toml", [*sets, "accuracy.tolerance=1e-2"]))
    series = solve_with_coarser(model.patch, model.accuracy.tolerance)
    measures = series[0].measures
    grids = [series[0].pair.grid, series[0].pair.upper_grid]
    finest = [compute_static_values(series[0])]
    is_symmetric = grids[0] is grids[1]
    for _ in range(2):
        grids = [grid.refine() for grid in grids[: 2 - is_symmetric]]
        finest.append(
            compute_static_values(solve_patch_contact(model.patch, condense(model.patch, *grids)))
        )
    return {
        name: (m.value, m.error, extrapolate_or_last(*(value[name] for value in finest)))
        for name, m in measures.items()
        if m.value is not None
    }


def extrapolate_or_last(coarse, middle, fine) -> float:
    """Return the limit of three values on refined meshes if their changes shrink with one sign,
    otherwise the last value."""
    first_change = middle - coarse
    last_change = fine - middle
    if first_change * last_change <= 0 or abs(first_change) < 1.15 * abs(last_change):
        return fine
    return fine + last_change / (min(max(first_change / last_change, 1.2), 4.0) - 1)


def exceeds_error(value, error, reference) -> bool:
    """Return whether the reference differs from a value by more than its error."""
    return not abs(reference - value) <= error + 1e-11 * abs(value)


@pytest.fixture
def limit_mesh_cost(monkeypatch):
    """Limit the cost of the meshes so that two refinements remain affordable."""
    monkeypatch.setattr(mesh_levels, "MAX_CONDENSING_SECONDS", MAX_SECONDS)


@pytest.mark.share(0, 3, 6)
@pytest.mark.parametrize("scene", SCENES)
def test_always_errors_cover_refined_meshes(scene, limit_mesh_cost):
    """The errors cover refined meshes for scenes where three meshes alone would not suffice:
    symmetry up to round-off, full contact, contact of a few nodes."""
    for name, row in compare_with_refined_meshes(scene).items():
        assert not exceeds_error(*row), (name, row)
