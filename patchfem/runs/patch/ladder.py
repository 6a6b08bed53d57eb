"""Solution of a patch on nested meshes, from which its errors are estimated.

In: a `PatchModel` and a tolerance. Out: pressed patches from fine to coarse. A mesh that the
scene does not prescribe is refined until the static measures meet the tolerance or the next
mesh is too expensive (`solve_on_ladder`).
"""

from dataclasses import replace
from functools import partial

from ...core import NotConverged, Outcome
from ...model.pieces import make_piece_meshes
from . import fine, slip_zones, store
from .condensed import condense, shared_pairs
from .grids import MAX_SECONDS, MIN_LEVELS, base_grids, predict_condensing_seconds
from .measures import is_within_tolerance, measures
from .press import press_patch, solve

# tolerance [1] down to which a patch that slips may take as many CPU seconds as a moving mesh; at a tenth of this
# tolerance it may take 3.2 times as many
TOL_OF_SECONDS = 1e-3
MAX_DECADES = 6  # decades of the tolerance that are searched for one that needs a finer mesh


def solve_split(patch_model, level: int, estimate: bool) -> tuple:
    """Solve a patch on the mesh of its file with every edge halved `level` times.

    The coarser patches are those of `solve_all`.
    """
    low, high = make_piece_meshes(patch_model)
    for _ in range(level):
        low, high = (None if body is None else body.refine() for body in (low, high))
    return _with_coarser(patch_model, low, high, estimate, True)


def solve_all(patch_model, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """Solve a patch on its mesh and on coarser ones.

    A patch without a prescribed element size is solved on a ladder of nested meshes until it meets
    its tolerance. An unstructured mesh has no coarser one: its second patch is on the mesh with
    every edge halved. Shared meshes are used as they are, except that a patch with a profile that
    these do not resolve to its tolerance is solved on its own ladder, as in a single run.

    Parameters
    ----------
    patch_model : PatchModel
    tolerance : float
    estimate : bool
        Whether the coarser meshes are solved as well.
    fresh : bool
        Whether to ignore condensed operators kept on disk.

    Returns
    -------
    tuple
        Patches, fine to coarse, at least two; None for each that is not solved.
    """
    if patch_model.solved is not None and not fresh:
        return patch_model.solved.patches
    if patch_model.mesh.shared is not None:
        if fresh:
            return solve_on_pairs(
                patch_model,
                [
                    condense(patch_model, *level, fresh=True)
                    for level in patch_model.mesh.shared.levels
                ],
                estimate,
            )
        if store.may_be_shared(patch_model):
            return store.reuse(
                ("patches", store.content_key(patch_model), estimate),
                lambda: solve_on_pairs(patch_model, shared_pairs(patch_model), estimate),
            )
        found = solve_on_pairs(patch_model, shared_pairs(patch_model), estimate)
        if estimate and _misses_trace(patch_model, found, patch_model.mesh.tolerance or tolerance):
            return solve_on_ladder(
                patch_model.with_mesh(shared=None), patch_model.mesh.tolerance or tolerance
            )
        return found
    if patch_model.mesh.is_automatic:
        return solve_on_ladder(
            patch_model, patch_model.mesh.tolerance or tolerance, estimate, fresh
        )
    return _with_coarser(patch_model, *make_piece_meshes(patch_model), estimate, fresh)


def _misses_trace(patch_model, patches: tuple, tolerance: float) -> bool:
    """Return whether a patch with a profile misses its tolerance on shared meshes."""
    if not patch_model.mesh.is_automatic or patch_model.gap.profile is None or patches[1] is None:
        return False
    return not is_within_tolerance(measures(*patches, tolerance=tolerance), tolerance)


def solve_on_pairs(patch_model, pairs, estimate: bool = True) -> tuple:
    """Solve a patch on condensed pieces, from fine to coarse (see `solve_all`)."""
    return _pad_to_three(
        press_patch(patch_model, pair) for pair in pairs[: None if estimate else 1]
    )


def _pad_to_three(patches) -> tuple:
    """Return patches, padded with None to at least three."""
    out = tuple(patches)
    return out + (None,) * (3 - len(out))


def _with_coarser(patch_model, low, high, estimate: bool, fresh: bool) -> tuple:
    """Solve a patch on given bodies and on coarser ones (see `solve_all`)."""
    found = [(low, high), *(comparison_meshes(low, high) if estimate else ())]
    return _pad_to_three(solve(patch_model, *level, fresh) for level in found)


def meshes_of_file(patch_model) -> list:
    """Return the meshes of a patch whose elements are prescribed or come from a file.

    The order is that of `solve_all`.
    """
    low, high = make_piece_meshes(patch_model)
    return [(low, high), *comparison_meshes(low, high)]


def comparison_meshes(low, high) -> list:
    """Return the meshes (lower, upper or None) that show the error of given ones.

    They are coarser grids, or the unstructured mesh with every edge halved; empty for few columns.
    """
    if low.x.size <= 8:
        return []
    if low.base_grid is None:
        return [tuple(None if body is None else body.refine() for body in (low, high))]
    out = []
    while len(out) < 2 and low.x.size > 8:
        low = low.coarsen()
        high = high.coarsen() if high is not None else None
        out.append((low, high))
    return out


def solve_on_ladder(
    patch_model, tolerance: float, estimate: bool = True, fresh: bool = False
) -> tuple:
    """Solve a patch on a ladder of nested meshes until it meets its tolerance.

    If the next mesh is expensive, points as fine as the profile give more accurate measures, and
    the mesh serves fields and motion. The refinement ends if the next mesh would exceed the work
    that is allowed for a patch. With a prescribed slip, the meshes also have to resolve the work of
    the slip.

    Parameters
    ----------
    patch_model : PatchModel
    tolerance : float
    estimate : bool
        If False, only the third mesh is solved.
    fresh : bool
        Whether to ignore condensed operators kept on disk.

    Returns
    -------
    tuple
        Patches on all meshes, fine to coarse.
    """
    grids = base_grids(patch_model).bodies
    out = []
    on_points = None
    while True:
        try:
            wanted = estimate or len(out) == MIN_LEVELS - 1
            out.insert(
                0,
                press_patch(patch_model, condense(patch_model, *grids, fresh=fresh))
                if wanted
                else None,
            )
        # the cells are too short for double precision: the coarser meshes are kept
        except NotConverged:
            if not out or out[0] is None:
                raise
            return tuple(out) if len(out) > 1 else (*out, None)
        grids = [grid.refine() for grid in grids]
        if len(out) < MIN_LEVELS:
            continue
        nothing = out[0].pressure.outcome is Outcome.NO_CONTACT
        if not estimate or nothing:
            return tuple(out)
        dear = predict_condensing_seconds(grids)
        if on_points is not None:  # the solution on points of the profile is kept for finer meshes
            out[0] = replace(
                out[0],
                sharper=on_points.sharper,
                averaging=on_points.averaging,
                fine=on_points.fine,
                stretches=on_points.stretches,
            )
        found = measures(*out, tolerance=tolerance)
        shows_slip = _shows_slip(patch_model, out, tolerance)
        if (
            dear > MAX_SECONDS[False]
            and not is_within_tolerance(found, tolerance)
            and _finer(patch_model)
        ):
            on_points = out[0] = _on_points(patch_model, out, tolerance)
            found = measures(*out, tolerance=tolerance)
        enough = bool(out[0].sharper) or is_within_tolerance(found, tolerance)
        if dear > most_seconds(patch_model, tolerance) or (shows_slip and enough):
            return tuple(out)


def most_seconds(patch_model, tolerance: float | None = None) -> float:
    """Return the predicted CPU seconds that the finest mesh of a `PatchModel` may take.

    The motion of a prescribed slip is cheap, so that a tight tolerance allows a finer mesh, up to
    the limit of a static patch. tolerance: None for the limit at any tolerance.
    """
    if patch_model.mesh.slip is None:
        return MAX_SECONDS[patch_model.mesh.is_static]
    if tolerance is None:
        return MAX_SECONDS[True]
    return min(
        MAX_SECONDS[True], MAX_SECONDS[False] * max(1.0, (TOL_OF_SECONDS / tolerance) ** 0.5)
    )


def solve_static_ladder(
    patch_model, tolerance: float, estimate: bool = True, fresh: bool = False
) -> tuple:
    """Solve the patch of a bench with partial slip on the meshes of a static run, fine to coarse.

    Return () if the mesh is prescribed or shared with other cases, or if the patch is solved
    already.
    """
    if (
        not patch_model.interface.partial_slip
        or patch_model.solved is not None
        or patch_model.mesh.shared is not None
        or not patch_model.mesh.is_automatic
    ):
        return ()
    static = patch_model.with_mesh(is_static=True, slip=None)
    return solve_on_ladder(static, patch_model.mesh.tolerance or tolerance, estimate, fresh)


def _shows_slip(patch_model, patches: list, tolerance: float) -> bool:
    """Return whether patches, fine to coarse, resolve the work of a prescribed slip."""
    if patch_model.mesh.slip is None:
        return True
    return slip_zones.slip_missed(patches, patch_model.mesh.slip, tolerance) <= 1


def _finer(patch_model) -> bool:
    """Return whether a patch with a profile can be solved on equally spaced points."""
    if patch_model.gap.profile is None:
        return False

    return fine.takes_points(patch_model)


def _on_points(patch_model, patches: list, tolerance: float):
    """Return the finest patch with measures computed on points as fine as its profile."""
    found = fine.solve_on_points(patch_model, partial(_enough, patches, tolerance))
    first = patches[0]
    return replace(
        first,
        sharper=found.measures,
        averaging=found.spacing or first.averaging,
        fine=found.surface,
        stretches=found.stretches,
    )


def tolerance_of_next_mesh(patch_model, patches, tolerance: float) -> float | None:
    """Return the loosest tolerance / 10^k at which a patch would be solved on a finer mesh.

    Parameters
    ----------
    patch_model : PatchModel
    patches : sequence of Patch
        As `solve_on_ladder` returns them at that tolerance.
    tolerance : float

    Returns
    -------
    float or None
        None if the next mesh is too expensive or no tolerance needs it: then the ladder is
        complete.
    """
    seconds = next_seconds(patches[0])
    if seconds > most_seconds(patch_model):
        return None
    if patch_model.gap.profile is not None and patches[0].sharper:
        ended = not is_within_tolerance(
            measures(*(patch for patch in patches if patch is not None), tolerance=tolerance),
            tolerance,
        )
        return None if ended else tolerance / 10
    known = [patch for patch in patches if patch is not None]
    for tighter in (tolerance * 10.0**-k for k in range(1, MAX_DECADES + 1)):
        enough = is_within_tolerance(measures(*known, tolerance=tighter), tighter) and _shows_slip(
            patch_model, known, tighter
        )
        if not enough and seconds <= most_seconds(patch_model, tighter):
            return tighter
    return None


def next_seconds(patch) -> float:
    """Return the predicted CPU seconds of condensing the pieces of a patch on its next mesh."""
    return predict_condensing_seconds([grid.refine() for grid in _grids(patch)])


def _grids(patch) -> tuple:
    """Return the meshes of a patch, a single one if its pieces are alike."""
    pair = patch.pair
    return (pair.grid,) if pair.upper is pair.piece else (pair.grid, pair.upper_grid)


def _enough(patches: list, tolerance: float, sharp: dict) -> bool:
    """Return whether patches meet the tolerance with the measures `sharp` computed on points."""
    return is_within_tolerance(
        measures(replace(patches[0], sharper=sharp), *patches[1:], tolerance=tolerance), tolerance
    )
