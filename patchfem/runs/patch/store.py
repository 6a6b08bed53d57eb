"""Results that the runs of one process share: condensed pieces, pressed patches and what follows from them.

The levels and frequencies of a sweep press the same patch. So a result is kept under a key of plain values that equal
patches of different models have in common, until MAX_ENTRIES other results were used after it.
"""

from collections.abc import Callable
from dataclasses import replace

# a patch with its measures and elements is about seven entries, its meshes are four to nine
MAX_ENTRIES = 64

_RESULTS: dict = {}  # from the least to the most recently used


def reuse(key: tuple, make: Callable):
    """Return the result kept under a key, or make it and keep it."""
    result = _RESULTS[key] if key in _RESULTS else make()
    keep(key, result)
    return result


def keep(key: tuple, result) -> None:
    """Keep a result under a key as the most recently used one, in place of the least recently used beyond the limit."""
    _RESULTS.pop(key, None)
    _RESULTS[key] = result
    if len(_RESULTS) > MAX_ENTRIES:
        del _RESULTS[next(iter(_RESULTS))]


def clear() -> None:
    """Forget all results."""
    _RESULTS.clear()


def content_key(asked) -> tuple:
    """Key of a `PatchModel` that is equal for all with the same content."""
    gap = asked.gap
    mesh = asked.mesh
    interface = asked.interface
    shapes = tuple((name, tuple(part)) for name, part in gap.shapes)
    heights = (gap.profile, gap.average, gap.limit, gap.rough, gap.side, gap.material)
    return (
        asked.pieces,
        asked.loading,
        (interface.strips, interface.has_shear, interface.partial_slip),
        interface.skin and tuple(interface.skin),
        replace(mesh, shared=None),
        mesh.shared and mesh.shared.name,
        asked.solved,
        shapes,
        heights,
    )


def is_shared(asked) -> bool:
    """Whether a `PatchModel` may be one of several: it has meshes that it shares, and no file that may change."""
    return asked.mesh.shared is not None and asked.mesh.file is None and asked.gap.profile is None
