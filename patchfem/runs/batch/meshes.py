"""Common meshes for cases of a sweep with the same patch geometry, on a bench or of patches that single runs press.

In: the models of the cases. Out: models with common meshes (`PatchMesh.shared`). The mesh of a single case is graded to its
own contact. At each position the common mesh has the cells of the case that needs the shortest ones. It is refined until
all cases meet the tolerance. Pieces with prescribed elements or with a mesh file have equal meshes in all cases anyway.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import astuple, replace
from functools import partial
from itertools import chain

import numpy as np

from ...core import PatchfemError
from ...mesh import pieces as piece_meshes
from ...model import patch as patch_models
from ...model.model import Model
from ..patch import condensed, grids, measures, mesh_levels

# Number of cases that determine the mesh, besides those with extreme numbers, if there are more.
MAX_SPREAD_LAYOUT_CASES = 48
# Largest number of interface nodes of the finest mesh; a finer mesh slows down every case.
MAX_INTERFACE_NODES = 500
N_FINER_MESHES_FOR_SLIP = 1  # Number of further meshes for cases that slip partially under a slide.

# Meshes of the lower and the upper piece on each level, from fine to coarse
Levels = tuple[tuple["piece_meshes.Mesh", "piece_meshes.Mesh | None"], ...]


class SharedMeshes:
    """Common meshes of the cases of a sweep, by patch geometry and tolerance.

    The meshes depend on all models, but not on their order. A sweep therefore creates them once,
    before its cases are divided into chunks.

    Parameters
    ----------
    models : iterable of Model or PatchfemError
    """

    def __init__(self, models: Iterable[Model | PatchfemError]):
        self.meshes: dict[Hashable, Levels | None] = {}
        groups = {}
        for model in models:
            groups.setdefault(_find_group(model), []).append(model)
        groups.pop(None, None)
        for group, members in groups.items():
            if len(members) < 2:
                continue
            patches = [model.patch for model in members]
            try:
                self.meshes[group] = _choose_meshes(patches, members[0].accuracy.tolerance)
            except PatchfemError:  # the single run of each case reports its error
                continue

    def with_shared_meshes(self, model: Model | PatchfemError) -> Model | PatchfemError:
        """Return a model with the common meshes of its geometry, or unchanged if there are none."""
        meshes = self.meshes.get(_find_group(model))
        if meshes is None:
            return model
        return replace(model, patch=model.patch.with_mesh(shared=meshes))


NO_SHARED_MESHES = SharedMeshes(())


def with_shared_meshes(models: Sequence[Model | PatchfemError]) -> list[Model | PatchfemError]:
    """Return the models with common meshes for patches of the same geometry.

    A patch whose geometry occurs only once keeps the mesh of its single run.
    """
    common_meshes = SharedMeshes(models)
    return [common_meshes.with_shared_meshes(model) for model in models]


def _find_group(model: Model | PatchfemError) -> Hashable | None:
    """Return a key that is equal for models that have a common mesh: tolerance, and all on which mesh and compliance depend.

    It is None for a model without a patch whose mesh takes most of the time of its run, or that has a common mesh already.
    The mesh of a rig, or of a patch that wears, is coarse: its own one costs less than a march on the larger common one, and
    makes a case equal to a single run. Faces share their cells without it.
    """
    patch = model.patch if isinstance(model, Model) else None
    if patch is None or not patch.mesh.is_fine or patch.mesh.shared or patch.area is not None:
        return None
    gap = patch.gap
    mesh = patch.mesh
    file = mesh.file
    has_file = file is not None and file.path.exists()
    return (
        model.accuracy.tolerance,
        patch.pieces,
        mesh.element_size,
        mesh.edge_motion,
        file,
        file.path.stat().st_mtime_ns if has_file else 0,
        gap.step_edges,
        gap.profile,
        gap.average,
    )


def _choose_meshes(patches: list[patch_models.PatchModel], tolerance: float) -> Levels | None:
    """Choose meshes that suit all patches of equal geometry, independently of their order.

    The result is None if no case can be solved.

    Parameters
    ----------
    patches : list of PatchModel
        Patches of a sweep, in any order.
    tolerance : float
        Relative error that the static measures of all patches have to meet.
    """
    patch_model = patches[0]
    if not patch_model.mesh.is_automatic:
        return tuple(mesh_levels.make_given_meshes(patch_model))
    cases = _select_distinct_patches(patches)
    layout, contact = grids.search_layout(patch_model, partial(grids.find_contacts_alone, cases))
    if contact is None:
        return None
    pairs = _refine_until_tolerance_is_met(cases, grids.make_grids(patch_model, layout), tolerance)
    return tuple(pair.meshes for pair in pairs)


def _select_distinct_patches(patches) -> list[patch_models.PatchModel]:
    """Select the patches that determine the meshes of a sweep: at most MAX_SPREAD_LAYOUT_CASES, and the extreme ones.

    Each patch has a row of numbers: its load, the lengths of its surface shapes, and its asperities. Patches with equal
    rows count once. Of many rows, sorted, equally spaced ones are selected, and those in which any of the numbers is the
    smallest or the largest. The result does not depend on the order of the patches.

    Parameters
    ----------
    patches : sequence of PatchModel
        Patches of equal geometry.
    """
    rows = {_load_and_shape_parameters(patch): patch for patch in patches}
    keys = sorted(rows)
    if len(keys) <= MAX_SPREAD_LAYOUT_CASES:
        return [rows[key] for key in keys]
    numbers = np.array(keys)
    even = np.linspace(0, len(keys) - 1, MAX_SPREAD_LAYOUT_CASES).round().astype(int)
    selected = np.unique([*even, *numbers.argmin(axis=0), *numbers.argmax(axis=0)])
    return [rows[keys[k]] for k in selected]


def _load_and_shape_parameters(patch_model) -> tuple[float, ...]:
    """Return the numbers [SI units] that may differ between patches of one mesh geometry: loads, shapes, asperities."""
    interface = patch_model.interface
    shapes = tuple(tuple(part) for _, part in patch_model.gap.shapes)
    skin = tuple(interface.skin or ())
    parameters = (astuple(patch_model.loading), patch_model.mesh.slip, shapes, skin)
    return tuple(_flatten_numbers(parameters))


def _flatten_numbers(value) -> list[float]:
    """Return all numbers in nested tuples as a flat list, in their order; None counts as 0, and texts are left out."""
    if value is None or isinstance(value, int | float):
        return [float(value or 0.0)]
    if not isinstance(value, tuple):
        return []
    return list(chain.from_iterable(map(_flatten_numbers, value)))


def _refine_until_tolerance_is_met(
    cases: list[patch_models.PatchModel], bodies, tolerance: float
) -> list[condensed.CondensedPair]:
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
    list of condensed.CondensedPair
        From fine to coarse.
    """
    # Partial slip needs shorter cells than the static measures, which decide on the other meshes.
    n_finer = N_FINER_MESHES_FOR_SLIP if any(case.mesh.slip is not None for case in cases) else 0
    pairs = []
    while True:
        pairs.insert(0, condensed.condense_once(cases[0], *bodies))
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


def _meets_tolerance(patch_model, pairs: list[condensed.CondensedPair], tolerance: float) -> bool:
    """Return whether a patch meets the tolerance on given condensed pieces, or cannot be solved on them.

    `patch_model` is the patch of one case, and `pairs` are from fine to coarse.
    """
    try:
        patches = mesh_levels.solve_on_pairs(patch_model, pairs, tolerance)
    except PatchfemError:  # The error is reported when this case is run alone.
        return True
    return measures.max_mesh_error_ratio(patches[0].measures, tolerance) <= 1
