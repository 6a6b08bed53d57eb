"""A patch on its own mesh and on coarser ones, from which its errors are estimated."""

from ...mesh.tensor import TensorGrid, coarser
from ...model.pieces import bodies_of
from .press import solve


def solve_all(asked, tolerance: float, estimate: bool = True, fresh: bool = False) -> tuple:
    """A patch on its mesh and on meshes twice and four times as coarse, None for those that are not wanted.

    A static patch whose element size is neither pinned nor decided by a profile gets the mesh that `tolerance` asks
    for. A mesh of any cells has no coarser one: its second patch is on the mesh with every edge halved. fresh: condense
    anew, whatever is kept on disk.
    """
    if estimate and asked.chosen:
        from .grading import solve_graded

        return solve_graded(asked, tolerance, fresh)
    low, high = bodies_of(asked)
    out = [solve(asked, low, high, fresh), None, None]
    if not estimate or low.x.size <= 8:
        return tuple(out)
    if not isinstance(low, TensorGrid):
        from ...mesh.anymesh import halved

        out[1] = solve(asked, halved(low), halved(high))
        return tuple(out)
    for k in (1, 2):
        if low.x.size > 8:
            low, high = coarser(low), coarser(high) if high is not None else None
            out[k] = solve(asked, low, high, fresh)
    return tuple(out)
