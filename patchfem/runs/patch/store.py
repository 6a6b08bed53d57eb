"""Cache of results that several runs of a process use: condensed pieces, patches, measures.

In: a key of plain values, equal for equal patches of different models, and a function that computes
the result. Out: the result, computed once. For example, all levels and frequencies of a sweep use
the same patch. The least recently used results are discarded beyond MAX_STORED_RESULTS.
"""

from collections.abc import Callable
from typing import Any, TypeVar

# Largest number of cached results. A patch has about seven of them with its measures and elements, and its meshes have four
# to nine. One of the seven holds up to 300 MB on a fine mesh, most of which are factors of the stiffness.
MAX_STORED_RESULTS = 48

# Largest number of patches with factors of their stiffness: those of two passes of a bench, of which the second has factors
MAX_LARGE_RESULTS = 2

Key = tuple[Any, ...]  # plain values, the first one naming the kind of the result
Result = TypeVar("Result")


_RESULTS: dict[Key, Any] = {}  # Results from the least to the most recently used one.
_LARGE_KEYS: list[Key] = []  # keys of the large results, from the oldest one


def get_or_compute(key: Key, make: Callable[[], Result], *, is_large: bool = False) -> Result:
    """Return the cached result of a key, which becomes the most recently used one; compute it on the first call.

    Parameters
    ----------
    key : tuple
        Plain values, the first one naming the kind of the result.
    make : callable
        Function without parameters that computes the result.
    is_large : bool
        Whether only the last MAX_LARGE_RESULTS results of this kind stay.

    Returns
    -------
    object
    """
    if key in _RESULTS:
        _RESULTS[key] = _RESULTS.pop(key)
        return _RESULTS[key]
    if is_large:
        while len(_LARGE_KEYS) >= MAX_LARGE_RESULTS:
            _RESULTS.pop(_LARGE_KEYS.pop(0), None)
        _LARGE_KEYS.append(key)
    _RESULTS[key] = result = make()
    if len(_RESULTS) > MAX_STORED_RESULTS:
        del _RESULTS[next(iter(_RESULTS))]
    return result


def clear_cache() -> None:
    """Discard all cached results of this process."""
    _RESULTS.clear()
    _LARGE_KEYS.clear()


def content_key(patch_model) -> Key:
    """Return a cache key that is equal for patch models with equal contents.

    A patch with files is equal to itself alone, because the files may change.
    """
    gap = patch_model.gap
    mesh = patch_model.mesh
    interface = patch_model.interface
    has_scan = patch_model.area is not None and patch_model.area.scan is not None
    if mesh.file is not None or gap.profile is not None or has_scan:
        return (patch_model,)
    return (
        patch_model.pieces,
        patch_model.loading,
        (interface.has_shear, interface.partial_slip),
        patch_model.area,
        interface.skin and tuple(interface.skin),
        mesh,
        tuple((name, tuple(part)) for name, part in gap.shapes),
        (gap.average, gap.limit, gap.is_rough, gap.side),
    )
