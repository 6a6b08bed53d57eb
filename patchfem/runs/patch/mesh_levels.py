"""Solution of a patch on nested meshes, from which its errors are estimated.

In: a `PatchModel` and a tolerance. Out: solved patches from fine to coarse, which are those of a group with a single case
(`case_meshes`). A mesh that the scene does not prescribe is refined until the static measures meet the tolerance or the next
mesh is too expensive.
"""

from ...core import PatchfemError
from ...model.pieces import make_piece_meshes
from . import area, store
from .case_meshes import SinglePatch, solve_single_patch
from .condensed import CondensedPair, condense
from .contact_search import ContactSearch
from .grids import (
    MAX_COLUMNS_WITHOUT_COARSER,
    MIN_NESTED_MESHES,
    change_elements,
    halve_cells,
    is_too_expensive,
    make_grids,
    search_layout,
)
from .measures import max_mesh_error_ratio, with_static_measures
from .press import Patch, Patches, solve_patch_contact


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
        earlier = tuple(patch for patch in solved if patch is not None)
        patches = solve_single_patch(patch_model, tolerance, SinglePatch(earlier, with_errors))
        return (*patches, *[None] * (MIN_NESTED_MESHES - len(patches)))

    # Many runs of a rig or of a bench have the same patch. That of a bench has large factors, so that only one stays.
    key = ("patches", store.content_key(patch_model), tolerance, with_errors)
    return store.get_or_compute(key, solve, is_large=patch_model.mesh.is_fine)


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
    pair = condense(patch.model, *change_elements(patch.pair.meshes))
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
    layout, _ = search_layout([ContactSearch(patch, 1) for patch in patch_models])
    return condense(first, *halve_cells(make_grids(first, layout), MIN_NESTED_MESHES - 1))


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
