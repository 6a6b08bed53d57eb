"""Cases of a static patch as columns, and their solution: records with a leading case axis.

In: a `PatchModel` in whose loading and gap shapes numbers may be arrays (n,). Out: `Cases` with the columns of the contact
problem; `Batch` with the measures of all cases. `case_meshes.solve_cases` turns the one into the other.

Letters of array shapes: n cases, p gap shapes, m interface nodes.
"""

from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ... import contact
from ...contact.gaps import ShapeProperties
from ...contact.press_cases import Holders
from ...core import PatchfemError
from ...model.gap import Gap
from ...model.patch import PatchModel
from ...scene.keys.types import Table
from ..results.patch_rows import POSITIVE_MESH_MEASURES, Arrays, Values


class OutcomeCode(IntEnum):
    """Code of a case in `Batch.outcome`.

    The first three are those of the `Outcome` of a run. FAILED cases have no values, but an error in `Batch.messages`.
    """

    DONE = 0
    NO_CONTACT = 1
    NOT_CONVERGED = 2
    FAILED = 3


class Cases(NamedTuple):
    """Loads, prescribed motions and gap shapes of n patches with the same pieces, layer and mesh settings.

    - holders: loads and prescribed motions of the holders.
    - rotation (n,): rotation [rad] of the upper piece that the gap already contains.
    - amplitudes (n, p): factors of the gap shapes of `make_gap_shapes`.
    - step_changes (n, 2): changes [m] of the gap at a node on the edge of the step, which move the node from half the
      height of the step to its higher and to its lower side; None for gaps without a step.
    """

    holders: Holders
    rotation: np.ndarray
    amplitudes: np.ndarray
    step_changes: np.ndarray | None

    @property
    def n_cases(self) -> int:
        """Number n of cases."""
        return len(self.amplitudes)

    def take(self, rows) -> "Cases":
        """Return selected cases; `rows` are indices or a mask (n,)."""
        steps = None if self.step_changes is None else self.step_changes[rows]
        return Cases(self.holders.take(rows), self.rotation[rows], self.amplitudes[rows], steps)

    @property
    def variants(self) -> "list[tuple[float, Cases]]":
        """Cases with a node at the step on its higher side (-1) and on its lower side (1), of gaps with a step."""
        variants = []
        for side, change in zip((-1.0, 1.0), self.step_changes.T):
            amplitudes = self.amplitudes.copy()
            amplitudes[:, -1] = change
            variants.append((side, self._replace(amplitudes=amplitudes)))
        return variants


class _SplitGap(NamedTuple):
    """Shapes of a gap in the order of their columns.

    - scaled: (name, table, properties) of each shape that is proportional to a number of its table.
    - rest: gap with all other shapes and the profile.
    - has_rest: whether these, or rounded ends of the pieces, contribute to the gap.
    """

    scaled: list[tuple[str, Table, ShapeProperties]]
    rest: Gap
    has_rest: bool


def _split_gap(patch_model: PatchModel) -> _SplitGap:
    """Split the gap of a patch model into shapes with amplitudes and the rest."""
    gap = patch_model.gap
    scaled = []
    fixed = []
    for name, keys in gap.shapes:
        properties = contact.gaps.SHAPE_PROPERTIES.get(name)
        if properties is None or properties.amplitude is None:
            fixed.append((name, keys))
        else:
            scaled.append((name, keys, properties))
    has_round_ends = any(piece.end.kind == "radius" for piece in patch_model.pieces.both)
    has_rest = bool(fixed) or gap.profile is not None or has_round_ends
    return _SplitGap(scaled, replace(gap, shapes=tuple(fixed)), has_rest)


def make_cases(patch_model: PatchModel, count: int) -> Cases:
    """Return the cases of a patch model in which numbers of the loading and of the gap shapes may be arrays (n,).

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases. The position of a step is the same in all of them.
    count : int
        Number n of cases.
    """
    loading = patch_model.loading

    def fill(value) -> np.ndarray:
        """Return a number, or an array (n,), as an array (n,); NaN for None."""
        return np.broadcast_to(np.nan if value is None else np.asarray(value, float), count)

    holders = Holders(
        fill(loading.load),
        fill(loading.approach),
        fill(loading.moment),
        fill(loading.rotational_stiffness),
    )
    # After the part that no case scales comes the change of a node at a step
    split = _split_gap(patch_model)
    amplitudes = [properties.amplitude(keys) for _, keys, properties in split.scaled]
    heights = [keys.height for name, keys in patch_model.gap.shapes if name == "step"]
    amplitudes += [1.0] * split.has_rest + [0.0] * bool(heights)
    step_changes = None
    if heights:
        step_changes = np.abs(fill(heights[0]))[:, None] * [-0.5, 0.5]
    return Cases(
        holders,
        fill(patch_model.gap.angle),
        np.array([fill(value) for value in amplitudes]).reshape(len(amplitudes), count).T,
        step_changes,
    )


def take_patch(patch_model: PatchModel, case: int) -> PatchModel:
    """Return the patch model of one case, whose numbers are no arrays."""

    def take(value):
        """Return the number of the case."""
        return float(value[case]) if isinstance(value, np.ndarray) else value

    loading = patch_model.loading
    numbers = {name: take(getattr(loading, name)) for name in loading.__dataclass_fields__}
    shapes = []
    for name, keys in patch_model.gap.shapes:
        own = {key: take(value) for key, value in keys}
        shapes.append((name, keys.model_copy(update=own)))
    gap = replace(patch_model.gap, shapes=tuple(shapes))
    return replace(patch_model, gap=gap, loading=replace(loading, **numbers))


class GapShapes(NamedTuple):
    """Gap shapes of a group of cases at the m nodes of a mesh.

    - shapes (p, m): shapes [m per unit amplitude].
    - notes: sentences on a profile.
    - seconds: CPU seconds by name of the shape.
    """

    shapes: np.ndarray
    notes: tuple[str, ...]
    seconds: Values


def make_gap_shapes(patch_model: PatchModel, x, end_gap) -> GapShapes:
    """Return the gap shapes of a group of cases at the nodes of a mesh.

    A table with a number that scales its shape gives a shape of unit amplitude. All other parts of the gap, if there are
    any, are one shape. The last one, for gaps with a step, is 1 at a node on the edge of the step.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases.
    x : (m,) ndarray
        Positions [m].
    end_gap : (m,) ndarray
        Gap [m] due to the rounded ends of the pieces.
    """
    split = _split_gap(patch_model)
    shapes = []
    for name, keys, properties in split.scaled:
        numbers = {key: value for key, value in keys if key != "on"} | dict(properties.unit)
        shapes.append(getattr(contact.gaps, name)(x, **numbers))
    notes = ()
    seconds = {}
    if split.has_rest:
        heights, notes, seconds = split.rest.evaluate(x)
        shapes.append(heights + end_gap)
    edges = patch_model.gap.step_edges
    if edges:
        shapes.append(np.isin(x, edges).astype(float))
    return GapShapes(np.array(shapes).reshape(-1, x.size), notes, seconds)


class MeshFact(IntEnum):
    """Rows of `Batch.facts`: what texts state about the finest mesh of a case.

    - N_NODES: number of interface nodes.
    - COUPLING: coupling of shear and normal motion (`CondensedPair.coupling`).
    - STEEP_END: 1 if the contact reaches the steep part of a rounded end, else 0.
    """

    N_NODES = 0
    COUPLING = 1
    STEEP_END = 2


@dataclass(frozen=True, eq=False, slots=True)
class Batch:
    """Static measures of n cases of a group.

    - values, errors, floors {name: (n,)}: measures in SI units (`patch_rows.PATCH_TABLE`). A value is NaN where the case
      failed or the measure is unbounded; an error is NaN without an estimate.
    - excess (n,): largest ratio of error to allowed error of the measures for which the mesh is refined; above 1 the
      case misses its tolerance, and a case that failed has inf.
    - outcome (n,) of int8: `OutcomeCode`.
    - facts (f, n): rows `MeshFact` of the finest mesh of each case.
    - messages: error of each case that failed, by its number; a single run raises it.
    """

    values: Arrays
    errors: Arrays
    floors: Arrays
    excess: np.ndarray
    outcome: np.ndarray
    facts: np.ndarray
    messages: dict[int, PatchfemError] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.excess)

    @classmethod
    def blank(cls, count: int) -> "Batch":
        """Return a batch of cases that are not solved yet."""
        return cls(
            {},
            {},
            {},
            np.full(count, np.inf),
            np.full(count, OutcomeCode.FAILED, np.int8),
            np.zeros((len(MeshFact), count)),
        )

    def put(self, numbers: np.ndarray, estimates, excess: np.ndarray, facts: np.ndarray) -> None:
        """Store measures of k cases whose errors are smaller than those that they have.

        Parameters
        ----------
        numbers : (k,) ndarray
            Numbers of the cases.
        estimates : StaticEstimates
            Their measures on a mesh.
        excess : (k,) ndarray
            Largest ratio of error to allowed error; inf for a case without measures.
        facts : (f, k) ndarray
            Rows `MeshFact` of the mesh.
        """
        rows = np.flatnonzero(excess < self.excess[numbers])
        cases = numbers[rows]
        new_columns = (estimates.values, estimates.errors, estimates.floors)
        for columns, new in zip((self.values, self.errors, self.floors), new_columns):
            for name, row in zip(estimates.names, new):
                if name not in columns:
                    columns[name] = np.full(len(self), np.nan)
                columns[name][cases] = row[rows]

        self.excess[cases] = excess[rows]
        self.facts[:, cases] = facts[:, rows]
        self.outcome[cases] = OutcomeCode.DONE
        for name in POSITIVE_MESH_MEASURES:
            is_unknown = (self.errors[name][cases] > 0) & (
                self.errors[name][cases] >= self.values[name][cases]
            )
            self.outcome[cases[is_unknown]] = OutcomeCode.NOT_CONVERGED
        is_open = ~(self.values["normal_load"][cases] > 0)
        self.outcome[cases[is_open]] = OutcomeCode.NO_CONTACT

    def fail(self, number: int, error: PatchfemError) -> None:
        """Store the error of a case that has no measures yet."""
        if np.isinf(self.excess[number]):
            self.messages[number] = error
