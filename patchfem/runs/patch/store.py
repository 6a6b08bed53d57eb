"""Cache of results that several runs of a process use: condensed pieces, patches, measures.

In: a key of plain values, equal for equal patches of different models, and a function that computes
the result. Out: the result, computed once. For example, all levels and frequencies of a sweep use
the same patch. The least recently used results are discarded beyond MAX_ENTRIES or MAX_BYTES.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

# Largest number of cached results. A patch has about seven of them with its measures and elements,
# and its meshes have four to nine.
MAX_ENTRIES = 64
# Largest memory of the arrays of all cached results. A patch on a fine mesh has 300 MB of them, most of
# which are factors of the stiffness.
MAX_BYTES = 2_000_000_000

Key = tuple[Any, ...]  # plain values, the first one naming the kind of the result
Result = TypeVar("Result")


class _Entry(NamedTuple):
    """Cached result.

    - result: the result.
    - array_sizes: sizes [bytes] of the arrays of its key and of the result, by their identity.
    """

    result: Any
    array_sizes: dict[int, int]


_ENTRIES: dict[Key, _Entry] = {}  # Entries from the least to the most recently used one.


def get_or_compute(key: Key, make: Callable[[], Result]) -> Result:
    """Return the cached result of a key; compute and cache it on the first call.

    It becomes the most recently used one; the last result is kept whatever its size.
    """
    if key in _ENTRIES:
        _ENTRIES[key] = _ENTRIES.pop(key)
        return _ENTRIES[key].result
    result = make()
    _ENTRIES[key] = _Entry(result, _find_array_sizes((key, result)))
    while len(_ENTRIES) > MAX_ENTRIES or (len(_ENTRIES) > 1 and _count_bytes() > MAX_BYTES):
        del _ENTRIES[next(iter(_ENTRIES))]
    return result


def _count_bytes() -> int:
    """Return the memory [bytes] of the arrays of all cached results, which may share them."""
    sizes: dict[int, int] = {}
    for entry in _ENTRIES.values():
        sizes |= entry.array_sizes
    return sum(sizes.values())


def _find_array_sizes(value) -> dict[int, int]:
    """Return the sizes [bytes] of all arrays in an object and in its parts, by the identity of the arrays."""
    sizes = {}
    visited = set()
    parts = [value]
    while parts:
        part = parts.pop()
        # Numbers and texts hold no arrays. An outcome is a text whose class has more than 60 attributes.
        if id(part) in visited or isinstance(part, str | int | float | None):
            continue
        visited.add(id(part))
        if isinstance(part, np.ndarray):
            # The memory of a view is that of the array on which it is based.
            owner = part if part.base is None else part.base
            sizes[id(owner)] = getattr(owner, "nbytes", part.nbytes)
        elif isinstance(part, dict):
            parts += part.values()
        elif isinstance(part, tuple | list):
            parts += part
        else:
            parts += getattr(part, "__dict__", {}).values()
            slots = getattr(type(part), "__slots__", ())
            parts += [getattr(part, name) for name in slots if hasattr(part, name)]
    return sizes


def clear_cache() -> None:
    """Discard all cached results of this process."""
    _ENTRIES.clear()


def content_key(patch_model) -> Key:
    """Return a cache key that is equal for patch models with equal contents.

    A patch with files is equal to itself alone, because the files may change.
    """
    gap = patch_model.gap
    mesh = patch_model.mesh
    interface = patch_model.interface
    if mesh.file is not None or gap.profile is not None:
        return (patch_model,)
    return (
        patch_model.pieces,
        patch_model.loading,
        (interface.strips, interface.has_shear, interface.partial_slip),
        interface.skin and tuple(interface.skin),
        mesh,
        tuple((name, tuple(part)) for name, part in gap.shapes),
        (gap.average, gap.limit, gap.is_rough, gap.side),
    )
