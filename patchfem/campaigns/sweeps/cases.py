"""Cases of a sweep: all combinations of the values of its keys, or one row of values each."""

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

# Keys with these prefixes change the pieces or their mesh.
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
    rows : bool
        Whether case k has the k-th value of every axis; otherwise the cases are all combinations,
        the last axis fastest.
    drawn : bool
        Whether the rows are random.
    words : tuple of str
        Words of the command that gives the same rows; () if they are not known.
    """

    axes: tuple[Axis, ...]
    rows: bool = False
    drawn: bool = False
    words: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.axes[0].texts) if self.rows else prod(self.shape)

    @property
    def shape(self) -> tuple:
        """Number of values of each axis; for rows the number of cases."""
        return (len(self),) if self.rows else tuple(len(axis.texts) for axis in self.axes)

    def places(self, number: int) -> tuple:
        """Return the index of a case along each axis."""
        if self.rows:
            return (number,) * len(self.axes)
        out = []
        for axis in reversed(self.axes):
            number, place = divmod(number, len(axis.texts))
            out.append(place)
        return tuple(reversed(out))

    def texts(self, number: int) -> tuple:
        """Return the values of a case as written in the request, axis by axis."""
        return tuple(axis.texts[place] for axis, place in zip(self.axes, self.places(number)))

    def sets(self, number: int) -> tuple:
        """Return a case as `table.key=value` strings."""
        return tuple(f"{axis.key}={text}" for axis, text in zip(self.axes, self.texts(number)))

    def values(self, number: int) -> tuple:
        """Return the values of a case in SI units, axis by axis.

        They are floats, or strings if a key has no number.
        """
        return tuple(axis.values[place] for axis, place in zip(self.axes, self.places(number)))

    def columns(self, numbers: Sequence[int]) -> np.ndarray | None:
        """Return the values of cases (n, k) in SI units; None if a key has no numbers."""
        if not all(isinstance(axis.values[0], float) for axis in self.axes):
            return None
        places = [numbers] * len(self.axes) if self.rows else np.unravel_index(numbers, self.shape)
        columns = []
        for axis, axis_places in zip(self.axes, places):
            places_list = np.asarray(axis_places).tolist()
            columns.append(np.array([axis.values[place] for place in places_list]))
        return np.array(columns).T

    def spread_cases(self, max_cases: int) -> list[int]:
        """Return case numbers that are spread over all axes and include the ends of each axis.

        These are all cases if there are no more than `max_cases`.
        """
        if len(self) <= max_cases:
            return list(range(len(self)))
        counts = [1] * len(self.shape)
        while True:
            rising = [k for k, size in enumerate(self.shape) if counts[k] < size]
            k = min(rising, key=lambda k: counts[k])
            if prod(counts) // counts[k] * (counts[k] + 1) > max_cases:
                break
            counts[k] += 1
        numbers = np.zeros(1, int)
        for size, count in zip(self.shape, counts):
            places = [round(j * (size - 1) / max(count - 1, 1)) for j in range(count)]
            numbers = np.add.outer(numbers * size, places).ravel()
        return numbers.tolist()

    def representative_cases(self, max_cases: int) -> list[int]:
        """Return at most `max_cases` case numbers that represent all cases of a sweep.

        For random cases these are the first ones, because every 8th point of a Sobol sequence may
        lie in the same half of a range; otherwise those of `spread_cases`.
        """
        if self.drawn:
            return list(range(min(max_cases, len(self))))
        return self.spread_cases(max_cases)

    def neighbours(self, numbers: Sequence[int]) -> list[int]:
        """Sort cases such that those with the same pieces follow one another.

        Such cases share most of the work. Among them, cases with the same patch follow one another.
        """
        slow = [k for k, axis in enumerate(self.axes) if axis.key.startswith("contact.")]
        if not slow:
            return list(numbers)
        slow.sort(key=lambda k: not self.axes[k].key.startswith(PIECE_KEYS))
        # Equal values of an axis count as its first value.
        first_places = [{} for _ in self.axes]
        for first, axis in zip(first_places, self.axes):
            for place, value in enumerate(axis.values):
                first.setdefault(value, place)

        def patch_places(number: int) -> list:
            """Return the axis indices of a case for the keys that change its patch."""
            values = self.values(number)
            return [first_places[k][values[k]] for k in slow]

        return sorted(numbers, key=patch_places)

    def names(self, sweep_scene: SweepScene, numbers: Sequence[int] | None = None) -> np.ndarray:
        """Return hashes (n,) uint64 of cases, which identify them across sweeps.

        A hash covers the keys and values of the case and what all cases share. The same values in
        other units or in another order have the same hash, also as part of another sweep of the
        same scene, unless all cases of a sweep share a mesh that is chosen for them.

        Parameters
        ----------
        sweep_scene : SweepScene
        numbers : sequence of int, optional
            Numbers of the cases; by default all.
        """
        hasher = _CaseHasher(self, sweep_scene)
        every_case = range(len(self))
        shared = sweep_scene.digest()
        if sweep_scene.shares_meshes([axis.key for axis in self.axes]):
            shared = sha256(np.sort(hasher.hash_cases(shared, every_case)).tobytes()).hexdigest()
        return hasher.hash_cases(shared, every_case if numbers is None else numbers)


class _CaseHasher:
    """Hash function of the cases of a sweep.

    The hashes of random values are not cached, because hardly any case has the value of another.
    """

    def __init__(self, cases: Cases, sweep_scene: SweepScene):
        self.cases = cases
        self.sweep_scene = sweep_scene
        keys = [json.dumps(axis.key) for axis in cases.axes]
        self.keys = keys
        # The order of the keys is the same for all cases.
        self.order = sorted(range(len(keys)), key=keys.__getitem__)
        self.cached_json = lru_cache(0 if cases.drawn else None)(self._value_json)

    def hash_cases(self, shared: str, numbers: Sequence[int]) -> np.ndarray:
        """Return a hash (n,) uint64 of each case.

        `shared` describes what all cases share.
        """
        hashes = np.empty(len(numbers), np.uint64)
        for k, number in enumerate(numbers):
            places = self.cases.places(number)
            values = [self.cached_json(axis, places[axis]) for axis in self.order]
            digest = sha256("\n".join([shared, *values]).encode()).hexdigest()
            hashes[k] = int(digest[:16], 16)
        return hashes

    def _value_json(self, axis: int, place: int) -> str:
        """Return a key and its value as JSON, with the hash of the file that the value names."""
        key = self.keys[axis]
        value = self.cases.axes[axis].values[place]
        if isinstance(value, float) and isfinite(value):
            return f'[{key}, {value!r}, ""]'
        content = self.sweep_scene.content(value) if isinstance(value, str) else ""
        return f"[{key}, {json.dumps(value)}, {json.dumps(content)}]"


def combine_cases(parts: Sequence[Cases]) -> Cases:
    """Return all combinations of the cases of several parts, the last part fastest.

    The result has rows if one of the parts has rows.
    """
    if len(parts) == 1:
        return parts[0]
    if not any(part.rows for part in parts):
        return Cases(tuple(chain.from_iterable(part.axes for part in parts)))
    count = prod(map(len, parts))
    axes = []
    n_inner = count
    for part in parts:
        n_inner //= len(part)
        numbers = [number // n_inner % len(part) for number in range(count)]
        places = list(map(part.places, numbers))
        for k, axis in enumerate(part.axes):
            texts = tuple(axis.texts[place[k]] for place in places)
            values = tuple(axis.values[place[k]] for place in places)
            axes.append(Axis(axis.key, texts, values, axis.unit))
    return Cases(tuple(axes), True, all(part.drawn for part in parts))
