"""Cache of results that the runs of a process share: condensed pieces, patches, measures.

In: a key of plain values, equal for equal patches of different models, and a function that
computes the result. Out: the result, computed once. For example, all levels and frequencies of
a sweep use the same patch. A result is discarded after MAX_ENTRIES other results were used.
"""

from collections.abc import Callable
from dataclasses import replace

# Largest number of cached results. A patch with its measures and elements has about seven, its
# meshes have four to nine.
MAX_ENTRIES = 64

_RESULTS: dict = {}  # The dict is ordered from the least to the most recently used result.


def get_or_compute(key: tuple, make: Callable):
    """Return the cached value of a key; compute and store it on the first call."""
    result = _RESULTS[key] if key in _RESULTS else make()
    store_result(key, result)
    return result


def get_or_compute_in_sweep(patch_model, key: tuple, make: Callable):
    """Return the value of a key, which is cached only if other cases of a sweep may need it.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to which the result belongs.
    key : tuple
    make : callable
        Function without parameters that computes the result.
    """
    return get_or_compute(key, make) if may_be_shared(patch_model) else make()


def store_result(key: tuple, result) -> None:
    """Store a value under a key as the most recently used entry of the cache.

    Beyond MAX_ENTRIES, the least recently used result is discarded.
    """
    _RESULTS.pop(key, None)
    _RESULTS[key] = result
    if len(_RESULTS) > MAX_ENTRIES:
        del _RESULTS[next(iter(_RESULTS))]


def clear_cache() -> None:
    """Discard all cached values of this process."""
    _RESULTS.clear()


def content_key(patch_model) -> tuple:
    """Return a cache key that is equal for patch models with equal contents."""
    gap = patch_model.gap
    mesh = patch_model.mesh
    interface = patch_model.interface
    shapes = tuple((name, tuple(part)) for name, part in gap.shapes)
    heights = (gap.profile, gap.average, gap.limit, gap.is_rough, gap.side, gap.material)
    return (
        patch_model.pieces,
        patch_model.loading,
        (interface.strips, interface.has_shear, interface.partial_slip),
        interface.skin and tuple(interface.skin),
        replace(mesh, shared=None),
        mesh.shared and mesh.shared.name,
        patch_model.solved,
        shapes,
        heights,
    )


def may_be_shared(patch_model) -> bool:
    """Return whether other cases of a sweep may reuse the results of a patch model.

    This requires shared meshes, and neither a mesh nor a profile from a file.
    """
    return (
        patch_model.mesh.shared is not None
        and patch_model.mesh.file is None
        and patch_model.gap.profile is None
    )
