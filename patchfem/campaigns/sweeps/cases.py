"""Cases of a sweep: all combinations of the values of its keys, or the rows of a table."""

import json
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import chain
from math import isfinite, prod
from pathlib import Path

import numpy as np

from ...disk.file_hashes import hash_named_files
from ...scene.assignments import Axis
from .case_models import SweepScene

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
    command : str
        Command line that computes them; "" in Python.
    warning : str
        Warning if some of the cases are invalid; "" otherwise.
    """

    axes: tuple[Axis, ...]
    is_table: bool = False
    is_random: bool = False
    command: str = ""
    warning: str = ""

    def __len__(self) -> int:
        return len(self.axes[0].texts) if self.is_table else prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis; the number of cases for a table."""
        return (len(self),) if self.is_table else tuple(len(axis.texts) for axis in self.axes)

    def axis_indices(self, numbers: int | Sequence[int]) -> tuple[int | np.ndarray, ...]:
        """Return for each axis the index of the value in a case, or in several cases.

        `numbers` are those of the cases, from 0.
        """
        if self.is_table:
            return (np.asarray(numbers),) * len(self.axes)
        return np.unravel_index(numbers, self.shape)

    def texts(self, number: int) -> tuple[str, ...]:
        """Return the values of a case, by its number, as strings from the request, one per axis."""
        return tuple(axis.texts[k] for axis, k in zip(self.axes, self.axis_indices(number)))

    def assignments(self, number: int) -> tuple[str, ...]:
        """Return the `table.key=value` strings of a case, by its number."""
        return tuple(f"{axis.key}={text}" for axis, text in zip(self.axes, self.texts(number)))

    def make_columns(self, numbers: Sequence[int]) -> list[np.ndarray]:
        """Return the values (n,) of each axis in several cases: floats in SI, or strings.

        `numbers` (n,) are those of the cases.
        """
        columns = []
        for axis, indices in zip(self.axes, self.axis_indices(numbers)):
            kind = float if isinstance(axis.values[0], float) else str
            columns.append(np.asarray(axis.values, kind)[indices])
        return columns

    def spread_case_numbers(self, max_cases: int) -> list[int]:
        """Return the numbers of cases that are evenly spread over all axes, including their ends.

        Returns all numbers if there are at most `max_cases` cases.
        """
        if len(self) <= max_cases:
            return list(range(len(self)))
        counts = list(self.shape)
        while prod(counts) > max_cases:
            largest = int(np.argmax(counts))
            counts[largest] = (counts[largest] + 1) // 2
        places = [np.linspace(0, size - 1, count) for size, count in zip(self.shape, counts)]
        grid = np.meshgrid(*(np.rint(place).astype(int) for place in places), indexing="ij")
        return np.ravel_multi_index(grid, self.shape).ravel().tolist()

    def split_into_groups(
        self, numbers: Sequence[int], plain_keys: Sequence[str]
    ) -> list[np.ndarray]:
        """Return the places in `numbers` of the cases of each group, whose cases differ in plain keys alone.

        Groups with the same pieces are consecutive, and so are cases of a group with equal patches, because they have most
        computations in common.

        Parameters
        ----------
        numbers : sequence of int
            Numbers of the cases.
        plain_keys : sequence of str
            Keys with numbers in which similar models differ.
        """
        ranked = []
        for axis, column in zip(self.axes, self.make_columns(numbers)):
            is_plain = axis.key in plain_keys
            is_contact = axis.key.startswith("contact.")
            rank = (is_plain, not axis.key.startswith(PIECE_KEYS), not is_contact)
            if is_contact or not is_plain:
                ranked.append((rank, np.unique(column, return_inverse=True)[1]))
        ranked.sort(key=lambda pair: pair[0])
        codes = np.array([column for _, column in ranked], int).reshape(len(ranked), len(numbers))
        order = np.lexsort(codes[::-1]) if ranked else np.arange(len(numbers))
        n_shared = sum(not is_plain for (is_plain, *_), _ in ranked)
        is_next = np.diff(codes[:n_shared, order]).any(axis=0)
        return np.split(order, np.flatnonzero(is_next) + 1)

    def compute_hashes(self, sweep_scene: SweepScene) -> np.ndarray:
        """Return hashes (n,) uint64 of the cases, which identify them in any sweep of the scene.

        A hash covers the keys and values of the case and the data common to all cases. It does not
        depend on units, on the order of keys or on the other cases of the sweep, unless the mesh is
        chosen for all cases together.
        """
        # the order of the keys is the same for all cases
        order = np.argsort([axis.key for axis in self.axes], kind="stable")
        texts = [_describe_values(axis, sweep_scene.path.parent) for axis in self.axes]
        common_text = sweep_scene.hash_common_data()
        indices = self.axis_indices(np.arange(len(self)))
        columns = [map(texts[axis].__getitem__, indices[axis].tolist()) for axis in order]
        hashes = np.empty(len(self), np.uint64)
        for number, values in enumerate(zip(*columns)):
            hashes[number] = _hash_to_integer("\n".join([common_text, *values]).encode())
        if sweep_scene.has_shared_meshes([axis.key for axis in self.axes]):
            hashes ^= np.uint64(_hash_to_integer(np.sort(hashes).tobytes()))
        return hashes


def _describe_values(axis: Axis, folder: Path) -> list[str]:
    """Return key and value as JSON for each value of a swept key, an axis.

    A value that names files has their hashes. The names are relative to the folder.
    """
    texts = []
    for value in axis.values:
        is_number = isinstance(value, float) and isfinite(value)
        files = [] if is_number else [sign for _, sign in hash_named_files([str(value)], folder)]
        texts.append(json.dumps([axis.key, value, files]))
    return texts


def _hash_to_integer(content: bytes) -> int:
    """Return the first 64 bits of the SHA-256 hash of a content."""
    return int.from_bytes(sha256(content).digest()[:8], "big")


def take_values(axis: Axis, indices: Sequence[int]) -> Axis:
    """Return a swept key, an axis, with the values at some indices."""
    values = [axis.values[index] for index in indices]
    return replace(
        axis,
        texts=tuple(axis.texts[index] for index in indices),
        values=array("d", values) if isinstance(axis.values, array) else tuple(values),
    )


def combine_cases(parts: Sequence[Cases]) -> Cases:
    """Return the Cartesian product of several sets of cases, `parts`.

    The last one varies fastest. The result is a table if one of the sets is a table.
    """
    if len(parts) == 1:
        return parts[0]
    if not any(part.is_table for part in parts):
        return Cases(tuple(chain.from_iterable(part.axes for part in parts)))
    sizes = [len(part) for part in parts]
    axes = []
    for part, numbers in zip(parts, np.unravel_index(np.arange(prod(sizes)), sizes)):
        axes += map(take_values, part.axes, part.axis_indices(numbers))
    return Cases(tuple(axes), True, all(part.is_random for part in parts))
