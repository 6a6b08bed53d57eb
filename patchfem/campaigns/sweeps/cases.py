"""Cases of a sweep: all combinations of the values of its keys, or the rows of a table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from itertools import chain
from math import isfinite, prod

import numpy as np

from ...scene.axes import Axis
from .case_models import SweepScene

MAX_CACHED_VALUES = 4096  # values of keys whose text is kept while the cases are named
# Prefixes of the keys that change the pieces or their mesh.
PIECE_KEYS = (
    "contact.length",
    "contact.width",
    "contact.height",
    "contact.pairs",
    "contact.plane",
    "contact.substrate",
    "contact.coating",
    "contact.upper",
    "contact.lower",
    "contact.mesh",
    "contact.element_size",
    "contact.step",
    "contact.profile",
)


@dataclass(frozen=True, slots=True)
class Cases:
    """Cases of a sweep, numbered from 0.

    Attributes
    ----------
    axes : tuple of Axis
        Keys with their values.
    is_table : bool
        Whether case k has the k-th value of every axis. Otherwise the cases are all combinations of
        the values, in which the last axis varies fastest.
    is_random : bool
        Whether the values of a table are random.
    request_arguments : tuple of str
        Command-line arguments that request the same table; () if they are unknown.
    """

    axes: tuple[Axis, ...]
    is_table: bool = False
    is_random: bool = False
    request_arguments: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.axes[0].texts) if self.is_table else prod(self.shape)

    @property
    def shape(self) -> tuple:
        """Number of values of each axis; the number of cases for a table."""
        return (len(self),) if self.is_table else tuple(len(axis.texts) for axis in self.axes)

    def axis_indices(self, number: int) -> tuple:
        """Return the index of the value of a case on each axis."""
        if self.is_table:
            return (number,) * len(self.axes)
        out = []
        for axis in reversed(self.axes):
            number, index = divmod(number, len(axis.texts))
            out.append(index)
        return tuple(reversed(out))

    def texts(self, number: int) -> tuple:
        """Return the values of a case as strings from the request, one per axis."""
        return tuple(axis.texts[k] for axis, k in zip(self.axes, self.axis_indices(number)))

    def assignments(self, number: int) -> tuple:
        """Return the `table.key=value` strings of a case."""
        return tuple(f"{axis.key}={text}" for axis, text in zip(self.axes, self.texts(number)))

    def values(self, number: int) -> tuple:
        """Return the values of a case in SI units, one per axis.

        They are floats, or strings for a key that is not numeric.
        """
        return tuple(axis.values[k] for axis, k in zip(self.axes, self.axis_indices(number)))

    def value_matrix(self, numbers: Sequence[int]) -> np.ndarray | None:
        """Return the values (n, k) of cases in SI units; None if a key is not numeric."""
        if not all(isinstance(axis.values[0], float) for axis in self.axes):
            return None
        indices = [numbers] * len(self.axes)
        if not self.is_table:
            indices = np.unravel_index(numbers, self.shape)
        columns = []
        for axis, axis_indices in zip(self.axes, indices):
            index_list = np.asarray(axis_indices).tolist()
            columns.append(np.array([axis.values[index] for index in index_list]))
        return np.array(columns).T

    def spread_case_numbers(self, max_cases: int) -> list[int]:
        """Return the numbers of cases that are evenly spread over all axes, including their ends.

        Returns all numbers if there are at most `max_cases` cases.
        """
        if len(self) <= max_cases:
            return list(range(len(self)))
        counts = [1] * len(self.shape)
        while True:
            extensible_axes = [k for k, size in enumerate(self.shape) if counts[k] < size]
            k = min(extensible_axes, key=lambda k: counts[k])
            if prod(counts) // counts[k] * (counts[k] + 1) > max_cases:
                break
            counts[k] += 1
        numbers = np.zeros(1, int)
        for size, count in zip(self.shape, counts):
            indices = [round(j * (size - 1) / max(count - 1, 1)) for j in range(count)]
            numbers = np.add.outer(numbers * size, indices).ravel()
        return numbers.tolist()

    def representative_case_numbers(self, max_cases: int) -> list[int]:
        """Return the numbers of at most `max_cases` cases that represent the whole sweep.

        For random cases these are the first ones, because every 8th point of a Sobol sequence may
        lie in the same half of a range; otherwise they come from `spread_case_numbers`.
        """
        if self.is_random:
            return list(range(min(max_cases, len(self))))
        return self.spread_case_numbers(max_cases)

    def sort_by_pieces(self, numbers: Sequence[int]) -> list[int]:
        """Sort case numbers so that cases whose pieces have the same shape and material are consecutive.

        Such cases have most computations in common. Cases with equal patches are consecutive, too.
        """
        contact_axes = [k for k, axis in enumerate(self.axes) if axis.key.startswith("contact.")]
        if not contact_axes:
            return list(numbers)
        contact_axes.sort(key=lambda k: not self.axes[k].key.startswith(PIECE_KEYS))
        # Repeated values of an axis have the index of their first occurrence.
        first_indices = [{} for _ in self.axes]
        for first, axis in zip(first_indices, self.axes):
            for index, value in enumerate(axis.values):
                first.setdefault(value, index)

        def patch_axis_indices(number: int) -> list:
            """Return the axis indices of a case for the keys that change its patch."""
            values = self.values(number)
            return [first_indices[k][values[k]] for k in contact_axes]

        return sorted(numbers, key=patch_axis_indices)

    def compute_hashes(
        self, sweep_scene: SweepScene, numbers: Sequence[int] | None = None
    ) -> np.ndarray:
        """Return hashes (n,) uint64 of cases, which identify them in any sweep of the scene.

        A hash covers the keys and values of the case and the data common to all cases. It does not
        depend on units, on the order of keys or on the other cases of the sweep, unless the mesh is
        chosen for all cases together.

        Parameters
        ----------
        sweep_scene : SweepScene
        numbers : sequence of int, optional
            Numbers of the cases; all by default.
        """
        hasher = _CaseHasher(self, sweep_scene)
        every_case = range(len(self))
        common_text = sweep_scene.hash_common_data()
        if sweep_scene.has_shared_meshes([axis.key for axis in self.axes]):
            common_text = sha256(
                np.sort(hasher.hash_cases(common_text, every_case)).tobytes()
            ).hexdigest()
        return hasher.hash_cases(common_text, every_case if numbers is None else numbers)


class _CaseHasher:
    """Hash function of the cases of a sweep.

    Random values are not cached, because they hardly ever repeat.
    """

    def __init__(self, cases: Cases, sweep_scene: SweepScene):
        self.cases = cases
        self.sweep_scene = sweep_scene
        keys = [json.dumps(axis.key) for axis in cases.axes]
        self.keys = keys
        # The order of the keys is the same for all cases.
        self.order = sorted(range(len(keys)), key=keys.__getitem__)
        self.cached_json = lru_cache(0 if cases.is_random else MAX_CACHED_VALUES)(self._value_json)

    def hash_cases(self, common_text: str, numbers: Sequence[int]) -> np.ndarray:
        """Return a hash (n,) uint64 of each case.

        `common_text` identifies the data common to all cases.
        """
        hashes = np.empty(len(numbers), np.uint64)
        for k, number in enumerate(numbers):
            indices = self.cases.axis_indices(number)
            values = [self.cached_json(axis, indices[axis]) for axis in self.order]
            digest = sha256("\n".join([common_text, *values]).encode()).hexdigest()
            hashes[k] = int(digest[:16], 16)
        return hashes

    def _value_json(self, axis: int, index: int) -> str:
        """Return a key and its value as JSON, with the hash of the file that the value names."""
        key = self.keys[axis]
        value = self.cases.axes[axis].values[index]
        if isinstance(value, float) and isfinite(value):
            return f'[{key}, {value!r}, ""]'
        content = self.sweep_scene.hash_file_contents(value) if isinstance(value, str) else ""
        return f"[{key}, {json.dumps(value)}, {json.dumps(content)}]"


def combine_cases(parts: Sequence[Cases]) -> Cases:
    """Return the Cartesian product of several sets of cases; the last set varies fastest.

    The result is a table if one of the sets is a table.
    """
    if len(parts) == 1:
        return parts[0]
    if not any(part.is_table for part in parts):
        return Cases(tuple(chain.from_iterable(part.axes for part in parts)))
    count = prod(map(len, parts))
    axes = []
    n_inner = count
    for part in parts:
        n_inner //= len(part)
        numbers = [number // n_inner % len(part) for number in range(count)]
        indices = list(map(part.axis_indices, numbers))
        for k, axis in enumerate(part.axes):
            texts = tuple(axis.texts[place[k]] for place in indices)
            values = tuple(axis.values[place[k]] for place in indices)
            axes.append(Axis(axis.key, texts, values, axis.unit))
    return Cases(tuple(axes), True, all(part.is_random for part in parts))
