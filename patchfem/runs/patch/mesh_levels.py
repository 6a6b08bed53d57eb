"""Solution of a patch on nested meshes, from which its errors are estimated.

In: a `PatchModel` and a tolerance. Out: solved patches from fine to coarse. A mesh that the scene
does not prescribe is refined until the static measures meet the tolerance or the next mesh is too
expensive (`NestedMeshes`); the meshes of many patches (`case_meshes`) are refined in the same way.
"""

from collections.abc import Sequence
from functools import partial
from math import inf
from typing import Any, NamedTuple

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

    def solve() -> Patches:
        """Solve the patch on its own meshes or on those that the scene prescribes."""
        if patch_model.area is not None:
            return solved or area.solve_face_on_grids(
                patch_model, tolerance, with_errors=with_errors
            )
        return _PatchMeshes(patch_model, tolerance, solved, with_errors=with_errors).solve()

    # Many runs of a rig or of a bench have the same patch. That of a bench has large factors, so that only one stays.
    key = ("patches", store.content_key(patch_model), tolerance, with_errors)
    return store.get_or_compute(key, solve, is_large=patch_model.mesh.is_fine)


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
    return with_static_measures([solve_patch_contact(patch.model, pair)], tolerance)[0]


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


class SolvedMeshes(NamedTuple):
    """Solution of one or many patches on nested meshes.

    - n_meshes: number of meshes.
    - meshes: those of both pieces on the finest level.
    - excess: largest ratio of error to allowed error of the patches that go on.
    - solution: solution on all meshes.
    """

    n_meshes: int
    meshes: "Sequence[piece_meshes.Mesh | None]"
    excess: float
    solution: Any


class NestedMeshes:
    """Nested meshes of one or many patches, which `refine` halves until the patches meet their tolerance.

    At least MIN_NESTED_MESHES meshes are solved, because the error follows from the changes between them. The refinement
    ends if the next mesh would exceed the CPU time that is allowed for a patch. `PatchMesh.n_finer` more meshes follow.

    Parameters
    ----------
    patch_model : PatchModel
        Patch, or one of the patches with the same pieces.
    given : sequence
        Finer meshes if the scene prescribes them.
    max_nodes : float
        Largest number of interface nodes.
    """

    def __init__(self, patch_model, given=(), max_nodes: float = inf):
        self.patch_model = patch_model
        self.given = given
        self.max_nodes = max_nodes
        self.n_finer = patch_model.mesh.n_finer
        is_automatic = patch_model.mesh.is_automatic
        self.n_needed = MIN_NESTED_MESHES if is_automatic else 1 + len(given)

    def judge(self, done: SolvedMeshes, excesses: list[float]) -> Verdict:
        """Decide whether a finer mesh follows; `excesses` are those of the meshes before."""
        if not self.patch_model.mesh.is_automatic:
            finer = self.given[done.n_meshes - 1 :][:1]
            return Verdict(done.excess, *finer)
        finer = halve_cells(done.meshes)
        is_last = done.excess <= 1
        if done.n_meshes >= self.n_needed:
            is_last |= finer[0].x.size > self.max_nodes
            is_last = is_last or is_too_expensive(self.patch_model, finer)
        if is_last:
            if self.n_finer == 0:
                return Verdict(done.excess)
            self.n_finer -= 1
        return Verdict(done.excess, finer)


class _PatchMeshes(NestedMeshes):
    """Nested meshes of a single patch, of which the solution on each mesh is kept.

    If the next mesh of a patch with a profile is expensive, the measures are computed on points as dense as the profile, and
    the mesh only serves fields and motion.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve.
    tolerance : float
        Relative error that the static measures have to meet.
    solved : tuple of Patch
        Patches of an earlier pass, from fine to coarse, which are not solved again.
    with_errors : bool
        Whether the patch is solved on coarser meshes, too, from which its errors follow.
    """

    def __init__(self, patch_model, tolerance: float, solved: Patches, *, with_errors: bool):
        levels = ()
        if not patch_model.mesh.is_automatic:
            levels = make_given_meshes(patch_model)[: None if with_errors else 1]
        super().__init__(patch_model, levels[-2::-1])
        self.tolerance = tolerance
        self.solved = tuple(patch for patch in solved if patch is not None)
        self.points = None
        self.has_tried_points = False

        # The coarsest meshes
        if levels:
            self.bodies = levels[-1]
        elif self.solved:
            self.bodies = [mesh for mesh in self.solved[-1].pair.meshes if mesh is not None]
        else:
            self.bodies = make_base_grids(patch_model).bodies
            if not with_errors:
                self.bodies = halve_cells(self.bodies, MIN_NESTED_MESHES - 1)
                self.n_needed = 1

    def solve(self) -> Patches:
        """Return the patch on all meshes, from fine to coarse.

        The first patch has the static measures by which the refinement ended (`Patch.measures`).
        """
        done, _ = refine(self.press, self.bodies, self.judge, NO_LIMIT)
        patches = done.solution
        if len(patches) < MIN_NESTED_MESHES:
            missing = (MIN_NESTED_MESHES - len(patches)) * [None]
            patches = with_static_measures((*patches, *missing), self.tolerance)
        return patches

    def press(self, bodies, before: SolvedMeshes | None) -> SolvedMeshes | None:
        """Solve the patch on meshes, and estimate the errors of its measures from those before; None if this fails."""
        patches = before.solution if before else ()
        coarse = patches[0] if patches else None
        if len(patches) < len(self.solved):
            patch = self.solved[-1 - len(patches)]
        else:
            # Only the last mesh needs factors, for the stress inside the pieces, which is computed on a coarser mesh if this
            # one is expensive. The patches of many rigs do not keep them.
            if coarse is not None:
                coarse.pair.forget_factors()
            has_factors = self.patch_model.mesh.is_fine and len(patches) + 1 >= self.n_needed
            has_factors &= not is_too_expensive(self.patch_model, bodies)
            pair = condense(self.patch_model, *bodies, keep_factors=has_factors)
            try:
                patch = solve_patch_contact(self.patch_model, pair, coarse=coarse)
            # The cells are too short for double precision, so that the finest mesh is left out.
            except NotConverged:
                if coarse is None:
                    raise
                return None

        # Fewer meshes than the error needs are followed by another one.
        patches = (patch, *patches)
        excess = inf if len(patches) < self.n_needed else 0.0
        if len(patches) >= MIN_NESTED_MESHES:
            patches, excess = self._judge_measures(patches)
        return SolvedMeshes(len(patches), patch.pair.meshes, excess, patches)

    def _judge_measures(self, patches: Patches) -> tuple[Patches, float]:
        """Return the patches with measures, and the largest ratio of error to allowed error that a finer mesh reduces."""
        # The solution on the points of a profile is used with all finer meshes.
        patches = with_static_measures(patches, self.tolerance, self.points)
        if patches[0].pressure.outcome is Outcome.NO_CONTACT:
            return patches, 0.0
        excess = max_mesh_error_ratio(patches[0].measures, self.tolerance)
        if excess > 1 and not self.has_tried_points:
            patches = self._use_points(patches)
            excess = max_mesh_error_ratio(patches[0].measures, self.tolerance)
        # The points do not determine a peak that may be at a free corner, but a finer mesh does.
        has_peak = self.points is not None and "pressure_peak" in self.points.measures
        return patches, 0.0 if has_peak else excess

    def _use_points(self, patches: Patches) -> Patches:
        """Return the patches with measures on the points of a profile, if the next mesh would take long.

        Points replace a mesh that would take longer than those of a rig. Where they do not converge, they would not do so
        beside the next mesh either.
        """
        finer = halve_cells(patches[0].pair.meshes)
        is_expensive = (
            predict_condensing_seconds(finer) > COARSE_GRID_DENSITY.max_condensing_seconds
        )
        if not (is_expensive and profile_points.can_use_points(self.patch_model)):
            return patches
        self.has_tried_points = True
        self.points = self.solved[0].points if self.solved else None
        if self.points is None:
            meets_tolerance = partial(_meets_tolerance, patches, self.tolerance)
            self.points = profile_points.solve_on_points(self.patch_model, meets_tolerance)
        return with_static_measures(patches, self.tolerance, self.points)


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
