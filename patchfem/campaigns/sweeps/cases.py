"""Cases of a sweep: all combinations of the values of its keys, or one row of values each."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from math import isfinite, prod

import numpy as np

from ...scene.axes import Axis
from .case_models import SweepScene

PIECE_KEYS = tuple(
    f"contact.{name}"
    for name in (
        "length",
        "width",
        "height",
        "pairs",
        "plane",
        "substrate",
        "coating",
        "upper",
        "lower",
        "mesh",
        "element_size",
        "step",
        "profile",
    )
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
        """Return the values of a case as written, axis by axis."""
        return tuple(axis.texts[place] for axis, place in zip(self.axes, self.places(number)))

    def sets(self, number: int) -> tuple:
        """Return a case as `table.key=value` strings."""
        return tuple(f"{axis.key}={text}" for axis, text in zip(self.axes, self.texts(number)))

    def values(self, number: int) -> tuple:
        """Return the values of a case, axis by axis.

        They are floats in SI, or strings if a key has no number.
        """
        return tuple(axis.values[place] for axis, place in zip(self.axes, self.places(number)))

    def columns(self, numbers: Sequence[int]) -> np.ndarray | None:
        """Return the values of cases (n, k) in SI; None if a key has no numbers."""
        if not all(isinstance(axis.values[0], float) for axis in self.axes):
            return None
        places = [numbers] * len(self.axes) if self.rows else np.unravel_index(numbers, self.shape)
        return np.array(
            [
                np.array([axis.values[place] for place in np.asarray(some).tolist()])
                for axis, some in zip(self.axes, places)
            ]
        ).T

    def spread_cases(self, most: int) -> list[int]:
        """Return at most `most` case numbers, spread over all axes and including the ends of each.

        All cases, if there are no more than that.
        """
        if len(self) <= most:
            return list(range(len(self)))
        each = [1] * len(self.shape)
        while True:
            rising = [k for k, size in enumerate(self.shape) if each[k] < size]
            k = min(rising, key=lambda k: each[k])
            if prod(each) // each[k] * (each[k] + 1) > most:
                break
            each[k] += 1
        places = [
            [round(j * (size - 1) / max(count - 1, 1)) for j in range(count)]
            for size, count in zip(self.shape, each)
        ]
        numbers = [0]
        for size, some in zip(self.shape, places):
            numbers = [number * size + place for number in numbers for place in some]
        return numbers

    def representative_cases(self, most: int) -> list[int]:
        """Return at most `most` case numbers that represent all cases.

        For random cases these are the first ones, because every 8th point of a Sobol sequence may
        lie in the same half of a range; otherwise those of `spread_cases`.
        """
        return list(range(min(most, len(self)))) if self.drawn else self.spread_cases(most)

    def neighbours(self, numbers: Sequence[int]) -> list[int]:
        """Return cases in an order in which those with the same pieces follow one another.

        They share most of the work. Among them, cases with the same patch follow one another.
        """
        slow = sorted(
            (k for k, axis in enumerate(self.axes) if axis.key.startswith("contact.")),
            key=lambda k: not self.axes[k].key.startswith(PIECE_KEYS),
        )
        if not slow:
            return list(numbers)
        alike = [
            {value: place for place, value in reversed(list(enumerate(axis.values)))}
            for axis in self.axes
        ]

        def patch(number: int) -> list:
            """Return the indices of the values of a case that change its patch."""
            places = self.places(number)
            return [alike[k][self.axes[k].values[places[k]]] for k in slow]

        return sorted(numbers, key=patch)

    def names(self, asked: SweepScene, numbers: Sequence[int] | None = None) -> np.ndarray:
        """Return names (n,) uint64 of cases: hashes of their keys and values and of what all cases share.

        The same values in other units or in another order have the same name, also as part of
        another sweep of the same scene, unless all cases of a sweep share a mesh that is chosen for
        them.

        Parameters
        ----------
        asked : SweepScene
        numbers : sequence of int, optional
            Numbers of the cases; by default all.
        """
        # The order of the keys is the same for all cases.
        order = sorted(range(len(self.axes)), key=lambda k: json.dumps(self.axes[k].key))
        keys = [json.dumps(axis.key) for axis in self.axes]
        mark = lru_cache(0 if self.drawn else None)(
            lambda k, place: _value_json(keys[k], self.axes[k].values[place], asked)
        )

        def signs(shared: str, of: Sequence[int]) -> np.ndarray:
            """Return a hash (n,) of each case, from the data that all cases share and its values."""
            placed = (self.places(number) for number in of)
            own = ("\n".join([shared, *(mark(k, places[k]) for k in order)]) for places in placed)
            return np.fromiter(
                (int(sha256(one.encode()).hexdigest()[:16], 16) for one in own), np.uint64, len(of)
            )

        shared = asked.digest()
        if asked.shares_meshes([axis.key for axis in self.axes]):
            shared = sha256(np.sort(signs(shared, range(len(self)))).tobytes()).hexdigest()
        return signs(shared, range(len(self)) if numbers is None else numbers)


def _value_json(key: str, value: float | str, asked: SweepScene) -> str:
    """Return a key, given as JSON, and a value as JSON, with the hash of the file that it names."""
    if isinstance(value, float) and isfinite(value):
        return f'[{key}, {value!r}, ""]'
    return f"[{key}, {json.dumps(value)}, {json.dumps(asked.content(value) if isinstance(value, str) else '')}]"


def combine_cases(parts: Sequence[Cases]) -> Cases:
    """Return all combinations of the cases of several parts, the last part fastest.

    The result has rows if one of the parts has rows.
    """
    if len(parts) == 1:
        return parts[0]
    if not any(part.rows for part in parts):
        return Cases(tuple(axis for part in parts for axis in part.axes))
    count = prod(map(len, parts))
    axes = []
    inner = prod(map(len, parts))
    for part in parts:
        inner //= len(part)
        picked = [part.places(number // inner % len(part)) for number in range(count)]
        for at, axis in enumerate(part.axes):
            axes.append(
                Axis(
                    axis.key,
                    tuple(axis.texts[one[at]] for one in picked),
                    tuple(axis.values[one[at]] for one in picked),
                    axis.unit,
                )
            )
    return Cases(tuple(axes), True, all(part.drawn for part in parts))
