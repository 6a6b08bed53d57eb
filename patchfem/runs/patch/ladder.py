"""A patch on its own mesh and on coarser ones, from which its errors are estimated."""

from ...mesh.nested import coarser, finer, plan_of
from ...model.pieces import bodies_of
from .grading import solve_graded
from .press import solve
from .values import values


def solve_split(asked, level: int) -> tuple:
    """Static measures of a patch on the mesh of its file with every edge halved `level` times."""
    low, high = bodies_of(asked)
    for _ in range(level):
        low, high = (None if body is None else _halved(body) for body in (low, high))
    return values(solve(asked, low, high, True))


def _halved(body):
    if plan_of(body) is not None:
        return finer(body)
    from ...mesh.anymesh import halved

    return halved(body)


def solve_all(asked, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """A patch on its mesh and on meshes twice and four times as coarse, None for those that are not wanted.

    A static patch whose element size is neither pinned nor decided by a profile gets the mesh that `tolerance` asks
    for. A mesh of any cells has no coarser one: its second patch is on the mesh with every edge halved. fresh: condense
    anew, whatever is kept on disk.
    """
    if estimate and asked.chosen:
        return solve_graded(asked, tolerance, fresh)
    low, high = bodies_of(asked)
    out = [solve(asked, low, high, fresh), None, None]
    if not estimate or low.x.size <= 8:
        return tuple(out)
    if plan_of(low) is None:
        out[1] = solve(asked, _halved(low), _halved(high))
        return tuple(out)
    for k in (1, 2):
        if low.x.size > 8:
            low, high = coarser(low), coarser(high) if high is not None else None
            out[k] = solve(asked, low, high, fresh)
    return tuple(out)
