"""Solution of a patch on nested meshes, from which its errors are estimated.

In: a `PatchModel` and a tolerance. Out: solved patches from fine to coarse. A mesh that the scene
does not prescribe is refined until the static measures meet the tolerance or the next mesh is too
expensive (`solve_on_refined_meshes`).
"""

from functools import partial
from math import inf

from ...core import NotConverged, Outcome, PatchfemError
from ...mesh import pieces as piece_meshes
from ...mesh.grid import TensorGrid
from ...model.pieces import make_piece_meshes
from ..refine import NO_LIMIT, Verdict, refine
from . import area, profile_points, store
from .condensed import CondensedPair, condense
from .grids import (
    COARSE_GRID_DENSITY,
    MIN_NESTED_MESHES,
    choose_density,
    find_contacts_alone,
    halve_cells,
    make_base_grids,
    make_grids,
    predict_condensing_seconds,
    search_layout,
)
from .measures import max_mesh_error_ratio, with_static_measures
from .press import Patch, Patches, solve_patch_contact

# Largest number of columns of a mesh that has no coarser mesh.
MAX_COLUMNS_WITHOUT_COARSER = 8


def solve_with_coarser(
    patch_model, tolerance: float, with_errors: bool = True, solved: Patches = ()
) -> Patches:
    """Solve a patch on its mesh and on the coarser meshes of its error estimate.

    On each mesh the pieces are condensed to the nodes of the interface, so that a compliance [m/N]
    relates nodal forces and displacements. The pressure sigma_n [Pa] and the gap under load [m] satisfy
    sigma_n >= 0, gap >= 0 and sigma_n gap = 0 at every node, and the pressure balances the load [N] or
    gives the prescribed approach [m].

    If the element size is not prescribed, nested meshes are refined until the patch meets the
    tolerance. An unstructured mesh has no coarser one; its second solution is on the mesh with all
    edges halved.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve, with its mesh or element size.
    tolerance : float
        Relative error that the static measures have to meet.
    with_errors : bool
        Whether to solve the coarser meshes as well.
    solved : tuple
        Patches of an earlier pass, from fine to coarse, whose meshes are refined further.

    Returns
    -------
    tuple
        Patches from fine to coarse, at least two; None for each mesh that is not solved. The first
        has the static measures with the errors that follow from all of them (`Patch.measures`).
    """
    mesh = patch_model.mesh

    def solve() -> Patches:
        """Solve the patch on its own meshes or on those that the scene prescribes."""
        if patch_model.area is not None:
            return solved or area.solve_face_on_grids(
                patch_model, tolerance, with_errors=with_errors
            )
        if mesh.is_automatic:
            return solve_on_refined_meshes(patch_model, tolerance, with_errors, solved)
        # Only the finest mesh needs factors, for the stress inside the pieces. The patches of many rigs do not keep them.
        levels = make_given_meshes(patch_model)[: None if with_errors else 1]
        pairs = [
            condense(patch_model, *level, keep_factors=mesh.is_fine and level is levels[0])
            for level in levels
        ]
        return solve_on_pairs(patch_model, pairs, tolerance)

    # Many runs of a rig or of a bench have the same patch. That of a bench has large factors, so that only one stays.
    key = ("patches", store.content_key(patch_model), tolerance, with_errors)
    return store.get_or_compute(key, solve, is_large=mesh.is_fine)


def solve_on_pairs(patch_model, pairs, tolerance: float) -> Patches:
    """Solve a patch on given condensed pieces.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve.
    pairs : sequence of CondensedPair
        From fine to coarse.
    tolerance : float
        Relative error; measures that miss it are extrapolated if the mesh is automatic.

    Returns
    -------
    tuple
        Patches as in `solve_with_coarser`.
    """
    patches = []
    for pair in reversed(pairs):
        coarse = patches[0] if patches else None
        patches.insert(0, solve_patch_contact(patch_model, pair, coarse=coarse))
    return with_static_measures((*patches, *(3 - len(patches)) * [None]), tolerance)


def make_given_meshes(patch_model) -> "list[tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]]":
    """Return the meshes of a patch with prescribed element size or mesh file, from fine to coarse.

    The error follows from two coarser grids, or from the unstructured mesh with all edges halved. Meshes with few columns
    have none of them.
    """
    levels = [make_piece_meshes(patch_model)]
    n_levels = 3 if isinstance(levels[0][0], TensorGrid) else 2
    while len(levels) < n_levels and levels[-1][0].x.size > MAX_COLUMNS_WITHOUT_COARSER:
        levels.append(_change_elements(levels[-1]))
    return levels


def _change_elements(
    bodies: "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]",
) -> "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]":
    """Return grids with elements twice as long, or unstructured meshes, which have no coarser ones, with halved edges."""
    is_grid = isinstance(bodies[0], TensorGrid)
    lower, upper = (body and (body.coarsen() if is_grid else body.refine()) for body in bodies)
    return lower, upper


def solve_on_other_mesh(patch: Patch, tolerance: float) -> Patch:
    """Solve a patch on a mesh whose elements are twice or half as long, so that a change shows the error of its mesh.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    tolerance : float
        Relative error of the static measures.

    Raises
    ------
    PatchfemError
        If the mesh has too few columns to be coarsened, or if the patch cannot be solved on the other mesh.
    """
    n_columns = patch.pair.meshes[0].x.size - 1
    if n_columns < MAX_COLUMNS_WITHOUT_COARSER:
        raise PatchfemError(f"the mesh has only {n_columns} columns; use smaller elements", "")
    pair = condense(patch.model, *_change_elements(patch.pair.meshes))
    return solve_on_pairs(patch.model, [pair], tolerance)[0]


def condense_for_contacts(patch_models) -> CondensedPair | None:
    """Condense the pieces of several patches on a mesh that is graded to the contacts of all of them.

    The mesh is as fine as that of a patch without error estimates. The result is None for patches with different pieces
    or steps, and for faces.
    """
    geometries = {(patch.pieces, patch.gap.step_edges) for patch in patch_models}
    if len(geometries) != 1 or patch_models[0].area is not None:
        return None
    first = patch_models[0]
    if not first.mesh.is_automatic:
        return condense(first, *make_piece_meshes(first))
    layout, _ = search_layout(first, partial(find_contacts_alone, patch_models))
    return condense(first, *halve_cells(make_grids(first, layout), MIN_NESTED_MESHES - 1))


def solve_on_refined_meshes(
    patch_model, tolerance: float, with_errors: bool = True, solved: Patches = ()
) -> Patches:
    """Solve a patch on successively finer meshes until it meets the tolerance.

    At least MIN_NESTED_MESHES meshes are solved, because the error follows from the changes between them. Each
    mesh halves the cells of the previous one. The refinement ends if the next mesh would exceed the CPU
    time that is allowed for a patch. If the next mesh of a patch with a profile is expensive, the
    measures are computed on points as dense as the profile, and the mesh only serves fields and motion.
    `PatchMesh.n_finer` more meshes follow.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve, without a prescribed element size.
    tolerance : float
        Relative error that the static measures have to meet.
    with_errors : bool
        If False, only the third mesh is solved.
    solved : tuple
        Patches of an earlier pass, from fine to coarse, which are not solved again.

    Returns
    -------
    tuple
        Patches on all meshes, from fine to coarse. The first has the static measures of the last
        turn of the refinement (`Patch.measures`), by which the refinement ended.
    """
    solved = tuple(patch for patch in solved if patch is not None)
    if solved:
        bodies = [mesh for mesh in solved[-1].pair.meshes if mesh is not None]
    else:
        bodies = make_base_grids(patch_model).bodies
    meshes = _PatchMeshes(patch_model, tolerance, solved)
    if with_errors or solved:
        patches, _ = refine(meshes.press, bodies, meshes.judge, NO_LIMIT)
    else:
        bodies = halve_cells(bodies, MIN_NESTED_MESHES - 1)
        patches = (meshes.solve(bodies, None, keep_factors=True),)
    if len(patches) < MIN_NESTED_MESHES:
        missing = (MIN_NESTED_MESHES - len(patches)) * [None]
        return with_static_measures((*patches, *missing), tolerance)
    return patches


class _PatchMeshes:
    """Meshes of a single patch, for which `refine` is called.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve.
    tolerance : float
        Relative error that the static measures have to meet.
    solved : tuple of Patch
        Patches of an earlier pass, from fine to coarse.
    """

    def __init__(self, patch_model, tolerance: float, solved: Patches):
        self.patch_model = patch_model
        self.tolerance = tolerance
        self.solved = solved
        self.n_finer = patch_model.mesh.n_finer
        self.points = None
        self.has_tried_points = False
        self.is_done = False

    def press(self, bodies, patches: Patches | None) -> Patches | None:
        """Solve the patch on meshes, and estimate the errors of its measures from those before; None if this fails.

        `patches` are those on the meshes before, from fine to coarse.
        """
        patches = patches or ()
        coarse = patches[0] if patches else None
        if len(patches) < len(self.solved):
            patch = self.solved[-1 - len(patches)]
        else:
            # Only the last mesh needs factors
            if coarse is not None:
                coarse.pair.forget_factors()
            is_judged = len(patches) >= MIN_NESTED_MESHES - 1
            try:
                patch = self.solve(bodies, coarse, keep_factors=is_judged)
            # The cells are too short for double precision, so that the finest mesh is left out.
            except NotConverged:
                if coarse is None:
                    raise
                return None
        patches = (patch, *patches)
        if len(patches) < MIN_NESTED_MESHES:
            return patches

        # The solution on the points of a profile is used with all finer meshes.
        patches = with_static_measures(patches, self.tolerance, self.points)
        self.is_done = max_mesh_error_ratio(patches[0].measures, self.tolerance) <= 1
        if not (self.is_done or self.has_tried_points):
            patches = self._use_points(patches)
        # The points do not determine a peak that may be at a free corner, but a finer mesh does.
        points = self.points
        self.is_done |= points is not None and "pressure_peak" in points.measures
        return patches

    def solve(self, bodies, coarse: Patch | None, *, keep_factors: bool) -> Patch:
        """Solve the patch on meshes; `coarse` is the patch on the meshes before, with whose contact the search starts.

        Factors serve the stress inside the pieces, which is computed on a coarser mesh if this one is expensive. The patches
        of many rigs do not keep them.
        """
        keep_factors &= self.patch_model.mesh.is_fine
        keep_factors &= not is_too_expensive(self.patch_model, bodies)
        pair = condense(self.patch_model, *bodies, keep_factors=keep_factors)
        return solve_patch_contact(self.patch_model, pair, coarse=coarse)

    def _use_points(self, patches: Patches) -> Patches:
        """Return the patches with measures on the points of a profile, if the next mesh would take long.

        Points replace a mesh that would take longer than those of a rig. Where they do not converge, they would not do so
        beside the next mesh either.
        """
        finer = halve_cells(patches[0].pair.meshes)
        is_expensive = (
            predict_condensing_seconds(finer) > COARSE_GRID_DENSITY.max_condensing_seconds
        )
        has_load = patches[0].pressure.outcome is not Outcome.NO_CONTACT
        if not (is_expensive and has_load and profile_points.can_use_points(self.patch_model)):
            return patches
        self.has_tried_points = True
        self.points = self.solved[0].points if self.solved else None
        if self.points is None:
            meets_tolerance = partial(_meets_tolerance, patches, self.tolerance)
            self.points = profile_points.solve_on_points(self.patch_model, meets_tolerance)
        return with_static_measures(patches, self.tolerance, self.points)

    def judge(self, patches: Patches, excesses) -> Verdict:
        """Decide whether a finer mesh follows; `patches` are solved, and `excesses` those of the meshes before."""
        finer = halve_cells(patches[0].pair.meshes)
        if len(patches) < MIN_NESTED_MESHES:
            return Verdict(inf, finer)
        if patches[0].pressure.outcome is Outcome.NO_CONTACT:
            return Verdict(0.0)
        excess = max_mesh_error_ratio(patches[0].measures, self.tolerance)
        if self.is_done or is_too_expensive(self.patch_model, finer):
            if self.n_finer == 0:
                return Verdict(excess)
            self.n_finer -= 1
        return Verdict(excess, finer)


def _meets_tolerance(patches: Patches, tolerance: float, points) -> bool:
    """Return whether the errors of the static measures for which the mesh is refined are within the tolerance.

    `patches` are the solved patch on successive meshes, and `points` the solution on equally spaced points of a profile, or
    None.
    """
    fine = with_static_measures(patches, tolerance, points)[0]
    return max_mesh_error_ratio(fine.measures, tolerance) <= 1


def select_pair_for_stress(patch: Patch) -> CondensedPair:
    """Return condensed pieces on whose mesh the stress inside the pieces is computed.

    They are those of the patch, unless the motion needed a finer mesh than the static measures may have. Such a mesh is
    coarsened: it is fine because of the contact edges, and all its nodes in all frames would need gigabytes.
    """
    meshes = patch.pair.meshes
    if not (patch.model.mesh.is_automatic and is_too_expensive(patch.model, meshes)):
        return patch.pair
    while is_too_expensive(patch.model, meshes):
        meshes = [mesh and mesh.coarsen() for mesh in meshes]
    return condense(patch.model, *meshes)


def is_too_expensive(patch_model, bodies) -> bool:
    """Return whether condensing the pieces on given meshes takes more CPU time than the finest mesh of a patch may take.

    To condense a piece is to compute its compliance at the interface nodes. `bodies` are the meshes of both pieces.
    """
    return predict_condensing_seconds(bodies) > choose_density(patch_model).max_condensing_seconds


def needs_finer_mesh(patch_model, patches, tolerance: float) -> bool:
    """Return whether a patch would get a finer mesh at a smaller tolerance.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of the run.
    patches : sequence of Patch or None
        Patches from fine to coarse.
    tolerance : float
        The smaller tolerance.
    """
    if is_too_expensive(patch_model, halve_cells(patches[0].pair.meshes)):
        return False
    # Values are extrapolated where they miss the tolerance.
    patches = with_static_measures(patches, tolerance, patches[0].points)
    return max_mesh_error_ratio(patches[0].measures, tolerance) > 1
