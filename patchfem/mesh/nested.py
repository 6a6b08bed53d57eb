"""Made grids with their cells split or merged two by two: a TensorGrid, or a ShapedGrid over one."""

from . import tensor
from .tensor import TensorGrid


def finer(body):
    """The body with every cell split in two in both directions."""
    return tensor.finer(body) if isinstance(body, TensorGrid) else body.finer()


def coarser(body):
    """The body with its cells merged two by two in both directions."""
    return tensor.coarser(body) if isinstance(body, TensorGrid) else body.coarser()


def plan_of(body) -> TensorGrid | None:
    """The tensor grid over the interface that a body is made from, None for a mesh of any cells."""
    return body if isinstance(body, TensorGrid) else getattr(body, "inner", None)
