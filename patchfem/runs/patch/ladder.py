"""A patch on its own mesh and on coarser ones, from which its errors are estimated."""

from dataclasses import replace
from functools import partial

from ...core import NotConverged, Outcome
from ...model.pieces import piece_meshes
from . import fine, slip_zones, store
from .condensed import condensed, shared_pairs
from .grids import MAX_SECONDS, MIN_LEVELS, base_grids, seconds_of
from .measures import measures, met
from .press import pressed, solve

TOL_OF_SECONDS = 1e-3  # up to this tolerance a slip has the seconds of a mesh that moves; ten times tighter, 3.2 times
MAX_DECADES = 6  # decades below a tolerance in which one that asks for a finer mesh is looked for


def solve_split(asked, level: int, estimate: bool) -> tuple:
    """A patch on the mesh of its file with every edge halved `level` times, and on coarser ones as `solve_all`."""
    low, high = piece_meshes(asked)
    for _ in range(level):
        low, high = (None if body is None else body.refine() for body in (low, high))
    return _with_coarser(asked, low, high, estimate, True)


def solve_all(asked, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """A patch on its mesh and on coarser ones, fine to coarse; two of them at least, None where one is not wanted.

    A patch whose element size is not pinned climbs a ladder of nested meshes to its `tolerance`. A mesh of any cells
    has no coarser one: its second patch is on the mesh with every edge halved. Where it shares meshes they are those;
    but a patch under a trace that these do not resolve to its tolerance climbs its own ladder, as its single run does.
    fresh: condense anew, whatever is kept on disk.
    """
    if asked.solved is not None and not fresh:
        return asked.solved.patches
    if asked.mesh.shared is not None:
        if fresh:
            return on_pairs(
                asked,
                [condensed(asked, *level, fresh=True) for level in asked.mesh.shared.levels],
                estimate,
            )
        if store.is_shared(asked):
            return store.reuse(
                ("patches", store.content_key(asked), estimate),
                lambda: on_pairs(asked, shared_pairs(asked), estimate),
            )
        found = on_pairs(asked, shared_pairs(asked), estimate)
        if estimate and _misses_trace(asked, found, asked.mesh.tolerance or tolerance):
            return climb(asked.with_mesh(shared=None), asked.mesh.tolerance or tolerance)
        return found
    if asked.mesh.is_automatic:
        return climb(asked, asked.mesh.tolerance or tolerance, estimate, fresh)
    return _with_coarser(asked, *piece_meshes(asked), estimate, fresh)


def _misses_trace(asked, patches: tuple, tolerance: float) -> bool:
    """Whether a patch under a trace misses its tolerance on meshes that it shares."""
    if not asked.mesh.is_automatic or asked.gap.profile is None or patches[1] is None:
        return False
    return not met(measures(*patches, tolerance=tolerance), tolerance)


def on_pairs(asked, pairs, estimate: bool = True) -> tuple:
    """A patch pressed on condensed pieces, the first for the answer and the others for its error, as `solve_all`."""
    return _filled(pressed(asked, pair) for pair in pairs[: None if estimate else 1])


def _filled(patches) -> tuple:
    """Patches with None for each that three lack."""
    out = tuple(patches)
    return out + (None,) * (3 - len(out))


def _with_coarser(asked, low, high, estimate: bool, fresh: bool) -> tuple:
    """A patch on given bodies and on coarser ones, as `solve_all`."""
    found = [(low, high), *(meshes_beside(low, high) if estimate else ())]
    return _filled(solve(asked, *level, fresh) for level in found)


def meshes_of_file(asked) -> list:
    """The meshes of a patch whose elements are pinned or come from a file, as `solve_all` takes them."""
    low, high = piece_meshes(asked)
    return [(low, high), *meshes_beside(low, high)]


def meshes_beside(low, high) -> list:
    """The meshes, (lower, upper or None), that show the error of given ones: coarser grids, or a mesh of any cells
    with every edge halved."""
    if low.x.size <= 8:
        return []
    if low.base_grid is None:
        return [tuple(None if body is None else body.refine() for body in (low, high))]
    out = []
    while len(out) < 2 and low.x.size > 8:
        low, high = low.coarsen(), high.coarsen() if high is not None else None
        out.append((low, high))
    return out


def climb(asked, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """A patch on the coarsest mesh of the ladder that meets its tolerance, and on all coarser ones, fine to coarse.

    Where the next mesh is dear, points as fine as a trace add sharper measures; then the mesh serves fields and motion.
    The climb ends where the next mesh would take more than the work that is spent on a patch. With a prescribed slip it
    also has to show the work of that. Without an estimate it is the third mesh, and nothing is solved on the others.
    """
    grids, out, on_points = base_grids(asked).bodies, [], None
    while True:
        try:
            wanted = estimate or len(out) == MIN_LEVELS - 1
            out.insert(0, pressed(asked, condensed(asked, *grids, fresh=fresh)) if wanted else None)
        except NotConverged:  # cells too short for the digits there are: the meshes before stay
            if not out or out[0] is None:
                raise
            return tuple(out) if len(out) > 1 else (*out, None)
        grids = [grid.refine() for grid in grids]
        if len(out) < MIN_LEVELS:
            continue
        nothing = out[0].pressure.outcome is Outcome.NO_CONTACT
        if not estimate or nothing:
            return tuple(out)
        dear = seconds_of(grids)
        if on_points is not None:  # the solution on points of the trace serves finer meshes as well
            out[0] = replace(
                out[0],
                sharper=on_points.sharper,
                averaging=on_points.averaging,
                fine=on_points.fine,
                stretches=on_points.stretches,
            )
        found, shows_slip = measures(*out, tolerance=tolerance), _shows_slip(asked, out, tolerance)
        if dear > MAX_SECONDS[False] and not met(found, tolerance) and _finer(asked):
            on_points = out[0] = _on_points(asked, out, tolerance)
            found = measures(*out, tolerance=tolerance)
        enough = bool(out[0].sharper) or met(found, tolerance)
        if dear > most_seconds(asked, tolerance) or (shows_slip and enough):
            return tuple(out)


def most_seconds(asked, tolerance: float | None = None) -> float:
    """Return the predicted seconds that the finest mesh of a `PatchModel` may take at a tolerance, None: at any.

    The motion of a prescribed slip costs little, so a tight tolerance buys it a finer mesh, up to what a static patch
    may cost.
    """
    if asked.mesh.slip is None:
        return MAX_SECONDS[asked.mesh.is_static]
    if tolerance is None:
        return MAX_SECONDS[True]
    return min(
        MAX_SECONDS[True], MAX_SECONDS[False] * max(1.0, (TOL_OF_SECONDS / tolerance) ** 0.5)
    )


def static_ladder(asked, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """The patch of a bench that slips part by part as a run without motion solves it, fine to coarse.

    () where there is no such ladder: the mesh is pinned, shared with other cases, or solved already.
    """
    if (
        not asked.interface.partial_slip
        or asked.solved is not None
        or asked.mesh.shared is not None
        or not asked.mesh.is_automatic
    ):
        return ()
    static = asked.with_mesh(is_static=True, slip=None)
    return climb(static, asked.mesh.tolerance or tolerance, estimate, fresh)


def _shows_slip(asked, patches: list, tolerance: float) -> bool:
    """Whether the meshes of patches, fine to coarse, show the work of a prescribed slip to the tolerance."""
    if asked.mesh.slip is None:
        return True
    return slip_zones.slip_missed(patches, asked.mesh.slip, tolerance) <= 1


def _finer(asked) -> bool:
    """Whether a trace may be solved on points finer than any cells."""
    if asked.gap.profile is None:
        return False

    return fine.takes_points(asked)


def _on_points(asked, patches: list, tolerance: float):
    """The finest of patches, fine to coarse, with what points as fine as a trace add to it."""
    found, first = fine.solve_on_points(asked, partial(_enough, patches, tolerance)), patches[0]
    return replace(
        first,
        sharper=found.measures,
        averaging=found.spacing or first.averaging,
        fine=found.surface,
        stretches=found.stretches,
    )


def climbs_at(asked, patches, tolerance: float) -> float | None:
    """The loosest tenth, hundredth, ... of a tolerance for which a patch climbs beyond its finest mesh.

    patches: as `climb` returns them for that tolerance. None where the next mesh is dear, or no tolerance asks for
    it: then the ladder has ended for good.
    """
    seconds = next_seconds(patches[0])
    if seconds > most_seconds(asked):
        return None
    if asked.gap.profile is not None and patches[0].sharper:
        ended = not met(
            measures(*(one for one in patches if one is not None), tolerance=tolerance), tolerance
        )
        return None if ended else tolerance / 10
    known = [one for one in patches if one is not None]
    for tighter in (tolerance * 10.0**-k for k in range(1, MAX_DECADES + 1)):
        enough = met(measures(*known, tolerance=tighter), tighter) and _shows_slip(
            asked, known, tighter
        )
        if not enough and seconds <= most_seconds(asked, tighter):
            return tighter
    return None


def next_seconds(patch) -> float:
    """Predicted CPU seconds of condensing the pieces of a patch on the next mesh of its ladder."""
    return seconds_of([grid.refine() for grid in _grids(patch)])


def _grids(patch) -> tuple:
    """The bodies that a patch is pressed on, one where its pieces are alike."""
    pair = patch.pair
    return (pair.grid,) if pair.upper is pair.piece else (pair.grid, pair.upper_grid)


def _enough(patches: list, tolerance: float, sharp: dict) -> bool:
    """Whether patches, fine to coarse, meet the tolerance with the measures that points of a trace add."""
    return met(
        measures(replace(patches[0], sharper=sharp), *patches[1:], tolerance=tolerance), tolerance
    )
