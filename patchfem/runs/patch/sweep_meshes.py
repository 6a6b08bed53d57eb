"""Meshes for all cases of a sweep, with short cells wherever the contact of any case ends.

In: the `PatchModel`s of the cases. Out: the meshes of all levels (`PatchMesh.shared`). The mesh of a
single case is graded to its own contact. At each position the shared mesh has the cells of the case
that needs the shortest ones there. It is refined until all cases meet the tolerance. Pieces with
prescribed elements or with a mesh file have equal meshes in all cases anyway.
"""

from dataclasses import astuple
from functools import partial
from itertools import chain

import numpy as np

from ...core import PatchfemError
from ...mesh import pieces as piece_meshes
from ...model.patch import PatchModel
from . import grids, mesh_levels
from .condensed import CondensedPair, condense_once
from .measures import max_mesh_error_ratio
from .store import Key

# Number of cases that determine the mesh, besides those with extreme numbers, if there are more.
MAX_SPREAD_LAYOUT_CASES = 48
# Largest number of interface nodes of the finest mesh; a finer mesh slows down every case.
MAX_INTERFACE_NODES = 500
# Tolerance that needs the cells of a single case; a larger one needs longer cells, because the errors
# are of second order in their length.
SINGLE_CASE_CELLS_TOL = 1e-3
N_FINER_MESHES_FOR_SLIP = 1  # Number of further meshes for cases that slip partially under a slide.
MAX_CELL_LENGTH_FACTOR = 4.0  # Largest factor on the cell lengths.


def geometry_key(patch_model) -> Key:
    """Return a hashable key of everything on which the meshes and the compliance depend.

    Patches that may share meshes have equal keys; load and surface shapes do not matter.
    """
    mesh = patch_model.mesh
    gap = patch_model.gap
    file = mesh.file
    modification_time = (
        file.path.stat().st_mtime_ns if file is not None and file.path.exists() else 0
    )
    return (
        patch_model.pieces,
        mesh.element_size,
        mesh.is_fine,
        mesh.edge_motion,
        file,
        modification_time,
        gap.step_edges,
        gap.profile,
        gap.average,
    )


def choose_shared_meshes(
    patches, tolerance: float, is_complete: bool = True
) -> "tuple[tuple[piece_meshes.Mesh, piece_meshes.Mesh | None], ...] | None":
    """Choose meshes that suit all patches of equal geometry, independently of their order.

    Parameters
    ----------
    patches : sequence of PatchModel
        Patches of a sweep, in any order.
    tolerance : float
        Relative error that the static measures of all patches have to meet.
    is_complete : bool
        Whether the sweep has no further cases.

    Returns
    -------
    tuple or None
        Meshes of the lower and the upper piece on each level, from fine to coarse (`PatchMesh.shared`). None if no case
        can be solved.
    """
    patch_model = patches[0]
    if not patch_model.mesh.is_automatic:
        return tuple(mesh_levels.make_given_meshes(patch_model))
    cases, are_all_patches = select_distinct_patches(patches)
    has_partial_slip = any(patch.interface.partial_slip for patch in patches)
    layout, contact = grids.search_layout(patch_model, partial(grids.find_contacts_alone, cases))
    if contact is None:
        return None
    # If the contact edges move or the patch slips partially, the initial contact does not determine
    # the measures. Cases between the given ones have longer cells at their own contact edges.
    cell_factor = 1.0
    is_known = are_all_patches and is_complete
    if is_known and not (patch_model.mesh.edge_motion or has_partial_slip):
        cell_factor = np.clip(
            (tolerance / SINGLE_CASE_CELLS_TOL) ** 0.5, 1.0, MAX_CELL_LENGTH_FACTOR
        )
    pairs = _refine_until_tolerance_is_met(
        cases, grids.make_grids(patch_model, layout.scale_cells(float(cell_factor))), tolerance
    )
    return tuple(pair.meshes for pair in pairs)


def select_distinct_patches(patches) -> tuple[list[PatchModel], bool]:
    """Select the patches that determine the meshes of a sweep: at most MAX_SPREAD_LAYOUT_CASES, and the extreme ones.

    Each patch has a row of numbers: its load, the lengths of its surface shapes, and its asperities. Patches with equal
    rows count once. Of many rows, sorted, equally spaced ones are selected, and those in which any of the numbers is the
    smallest or the largest. The result does not depend on the order of the patches.

    Parameters
    ----------
    patches : sequence of PatchModel
        Patches of equal geometry.

    Returns
    -------
    selected : list of PatchModel
    are_all_patches : bool
        Whether no row was left out.
    """
    rows = {_load_and_shape_parameters(patch): patch for patch in patches}
    keys = sorted(rows)
    if len(keys) <= MAX_SPREAD_LAYOUT_CASES:
        return [rows[key] for key in keys], True
    numbers = np.array(keys)
    even = np.linspace(0, len(keys) - 1, MAX_SPREAD_LAYOUT_CASES).round().astype(int)
    selected = np.unique([*even, *numbers.argmin(axis=0), *numbers.argmax(axis=0)])
    return [rows[keys[k]] for k in selected], False


def _load_and_shape_parameters(patch_model) -> tuple[float, ...]:
    """Return the numbers [SI units] that may differ between patches of one mesh geometry: loads, shapes, asperities."""
    interface = patch_model.interface
    shapes = tuple(tuple(part) for _, part in patch_model.gap.shapes)
    skin = tuple(interface.skin or ())
    parameters = (
        astuple(patch_model.loading),
        patch_model.mesh.slip,
        shapes,
        skin,
    )
    return tuple(_list_numbers(parameters))


def _list_numbers(value) -> list[float]:
    """Return all numbers in nested tuples as a flat list, in their order; None counts as 0, and texts are left out."""
    if value is None or isinstance(value, int | float):
        return [float(value or 0.0)]
    if not isinstance(value, tuple):
        return []
    return list(chain.from_iterable(map(_list_numbers, value)))


def _refine_until_tolerance_is_met(
    cases: list[PatchModel], bodies, tolerance: float
) -> list[CondensedPair]:
    """Refine nested meshes until all patches meet the tolerance or the mesh is too expensive.

    Parameters
    ----------
    cases : list of PatchModel
        Patches that share the meshes.
    bodies : list
        Meshes of the pieces on the coarsest level.
    tolerance : float
        Relative error that the static measures of all patches have to meet.

    Returns
    -------
    list of CondensedPair
        From fine to coarse.
    """
    # Partial slip needs shorter cells than the static measures, which decide on the other meshes.
    n_finer = N_FINER_MESHES_FOR_SLIP if any(case.mesh.slip is not None for case in cases) else 0
    pairs = []
    while True:
        pairs.insert(0, condense_once(cases[0], *bodies))
        bodies = [body.refine() for body in bodies]
        if len(pairs) < grids.MIN_NESTED_MESHES:
            continue
        is_too_large = bodies[0].x.size > MAX_INTERFACE_NODES
        if is_too_large or mesh_levels.is_too_expensive(cases[0], bodies):
            return pairs
        # The refinement goes on as soon as one case misses the tolerance.
        if all(_meets_tolerance(case, pairs, tolerance) for case in cases):
            if n_finer == 0:
                return pairs
            n_finer -= 1


def _meets_tolerance(patch_model, pairs: list[CondensedPair], tolerance: float) -> bool:
    """Return whether a patch meets the tolerance on given condensed pieces, or cannot be solved on them.

    `patch_model` is the patch of one case, and `pairs` are from fine to coarse.
    """
    try:
        patches = mesh_levels.solve_on_pairs(patch_model, pairs, tolerance)
    except PatchfemError:  # The error is reported when this case is run alone.
        return True
    return max_mesh_error_ratio(patches[0].measures, tolerance) <= 1
