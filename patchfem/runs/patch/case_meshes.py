"""Static measures of many cases of a patch, on meshes that the cases share.

In: a `PatchModel` whose loading and gap shapes may contain arrays, and a tolerance. Out: a `Batch`. The cases are pressed
together on nested meshes. Those that miss the tolerance go on with the next mesh. When this would be too expensive, they
get meshes that are graded to their own contacts; many of them are divided by the ends of their contacts before. A case
that is alone ends with its tolerance or with the limit of the mesh of a single run.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...mesh.grading import Layout
from ..refine import NO_LIMIT, refine
from . import grids, mesh_levels
from .cases import Batch, CaseMeasures, Cases, MeshFact, make_cases, take_patch
from .condensed import CondensedPair, condense
from .measures import (
    MIN_CONTACT_EDGE_ERROR_IN_CELLS,
    MeshValues,
    collect_mesh_values,
    estimate_static_measures,
)
from .press import Level, PressedCases, make_level, press_on_level
from .values import contact_reaches_steep_end, find_contact_edges

# Largest number of contacts for which the meshes of many cases are graded: half of them equally spaced in the order of
# their left ends, half in that of their right ends
MAX_GRADED_CONTACTS = 48
# Largest number of cases whose contacts are searched for before the meshes are chosen
MAX_SEARCHED_CASES = 256
# Largest number of contact searches for many cases: the columns of their grids reach the limit in the second search, and
# further searches hardly move them
MAX_SEARCHES = 3
# Largest number of interface nodes of meshes that many cases share; a finer mesh slows down every case
MAX_SHARED_NODES = 500
# Number of nested meshes of many cases. The first one has cells twice as long as that of a single run, so that the finest of
# four takes the time of that of three, while errors of limits from four values are half as large
N_CASE_MESHES = 4
# Largest part of the cases of a mesh, and number of them, that get one further mesh; more of them get two
MAX_SHARE_OF_ONE_GROUP = 1 / 3
MAX_CASES_OF_ONE_GROUP = 40
MAX_CHUNK_VALUES = 4_000_000  # numbers of a temporary array of cases, columns and nodes, 32 MB
# Error of the centre of a contact on a mesh for many contacts, in cell lengths: an end lies anywhere in its cell, and half
# of its position error remains. In 280 random crowned blocks, it was at most 0.0061 where the changes between meshes are
# smaller
CENTRE_ERROR_IN_CELLS = MIN_CONTACT_EDGE_ERROR_IN_CELLS / 2
# Number of contact sets beyond which a table is emptied between two parts of the cases; of 500 nodes, 0.1 GB
MAX_TABLE_SETS = 6000


class ContactPlaces(NamedTuple):
    """Where n contacts begin and end along the interface, independent of a mesh.

    - begins (n,): whether the first node is in contact.
    - crossings (n, e): positions [m] at which contact begins or ends, by increasing x; NaN beyond the last one.
    """

    begins: np.ndarray
    crossings: np.ndarray

    def take(self, rows) -> "ContactPlaces":
        """Return selected contacts; `rows` are indices or a mask (n,)."""
        return ContactPlaces(self.begins[rows], self.crossings[rows])

    def find_sets(self, x) -> np.ndarray:
        """Return the contact sets (n, m) of nodes at ascending positions x (m,) [m]."""
        counts = np.zeros((len(self.begins), x.size), np.int64)
        for crossing in self.crossings.T:
            counts += crossing[:, None] < x
        return (counts % 2 == 1) ^ self.begins[:, None]


def find_contact_places(pressed: PressedCases) -> ContactPlaces:
    """Return where the contacts of pressed cases begin and end along the interface."""
    edges = find_contact_edges(pressed)
    x = pressed.x
    crossings = x[edges.node] + edges.fraction * (x[edges.node + edges.side] - x[edges.node])
    return ContactPlaces(pressed.active[:, 0], np.where(edges.exists, crossings, np.nan))


def join_places(parts: Sequence[ContactPlaces]) -> ContactPlaces:
    """Return the contacts of several parts of the cases one after the other."""
    counts = [part.crossings.shape for part in parts]
    crossings = np.full((sum(n for n, _ in counts), max(e for _, e in counts)), np.nan)
    first = 0
    for part, (n_contacts, n_crossings) in zip(parts, counts):
        crossings[first : first + n_contacts, :n_crossings] = part.crossings
        first += n_contacts
    return ContactPlaces(np.concatenate([part.begins for part in parts]), crossings)


def find_contact(patch_model, number: int, pressed: PressedCases, row: int) -> grids.SolvedContact:
    """Return the contact of a case for which a mesh is graded.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases.
    number : int
        Number of the case.
    pressed : PressedCases
        Pressed cases.
    row : int
        Row of the case in `pressed`.
    """
    extent = grids.find_contact_extent(pressed, row)
    return grids.SolvedContact(take_patch(patch_model, number), [extent])


def collect_facts(pressed: PressedCases) -> np.ndarray:
    """Return what texts state about the mesh of pressed cases, as rows `MeshFact` (f, n)."""
    facts = np.zeros((len(MeshFact), len(pressed)))
    facts[MeshFact.N_NODES] = pressed.x.size
    facts[MeshFact.COUPLING] = pressed.level.pair.coupling
    facts[MeshFact.STEEP_END] = contact_reaches_steep_end(pressed)
    return facts


class OpenCases(NamedTuple):
    """Cases of a group that go on with finer meshes.

    - numbers (k,): numbers of the cases.
    - places: where their contacts begin and end; None if nothing is known.
    - series: their measures on the meshes so far, from coarse to fine.
    """

    numbers: np.ndarray
    places: ContactPlaces | None
    series: list[MeshValues]

    def take(self, rows) -> "OpenCases":
        """Return selected cases; `rows` are indices or a mask (k,)."""
        places = None if self.places is None else self.places.take(rows)
        return OpenCases(self.numbers[rows], places, [mesh.take(rows) for mesh in self.series])


def solve_cases(patch_model, count: int, tolerance: float) -> Batch:
    """Compute the static measures of all cases of a group, with errors within the tolerance if possible.

    A case that cannot be solved has an error (`Batch.messages`); one that misses the tolerance has its best values and an
    excess above 1. Neither stops the others.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases; numbers of its loading and of its gap shapes may be arrays (n,), except the position of a step.
    count : int
        Number n of cases.
    tolerance : float
        Relative error that the static measures have to meet.

    Returns
    -------
    Batch
    """
    solver = _CaseSolver(patch_model, make_cases(patch_model, count), tolerance)
    if patch_model.mesh.is_automatic:
        solver.solve()
    else:
        solver.solve_on_given_meshes()
    return solver.batch


class _CaseSolver:
    """Solution of the cases of a group on meshes that are chosen for them.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases, whose numbers may be arrays.
    cases : Cases
        The same cases as columns.
    tolerance : float
        Relative error of the static measures.
    """

    def __init__(self, patch_model, cases: Cases, tolerance: float):
        self.patch_model = patch_model
        self.cases = cases
        self.tolerance = tolerance
        self.batch = Batch.blank(cases.n_cases)
        self.contacts: dict[int, grids.SolvedContact] = {}

    def solve(self) -> None:
        """Solve the cases on meshes that they share, and those that miss the tolerance on meshes of smaller groups."""
        numbers = np.arange(self.cases.n_cases)
        search = _ContactSearch(self.patch_model, self.cases, numbers)
        layout, _ = grids.search_layout(self.patch_model, search.find_contacts, MAX_SEARCHES)
        groups = [(OpenCases(numbers, search.guess_places(), []), layout)]
        while groups:
            cases, layout = groups.pop()
            fine = grids.make_grids(self.patch_model, layout)
            missing = self._refine(cases, [grid.coarsen() for grid in fine])
            # A case that is alone has reached the limit of the mesh
            if missing.size and cases.numbers.size > 1:
                groups += self._regroup(missing, cases.numbers.size)

    def _regroup(self, numbers: np.ndarray, n_before: int) -> list[tuple[OpenCases, Layout]]:
        """Return groups of cases (k,) that miss the tolerance on a mesh, with the columns of their next meshes.

        Two groups have contacts that end at similar places. A small part of the `n_before` cases of a mesh stays together,
        because a mesh for its contacts alone is much finer there.
        """
        spans = np.array([self.contacts[number].extents[0].span for number in numbers.tolist()])
        side = np.ptp(spans, axis=0).argmax()
        numbers = numbers[np.argsort(spans[:, side], kind="stable")]
        n_most = min(MAX_SHARE_OF_ONE_GROUP * n_before, MAX_CASES_OF_ONE_GROUP)
        n_groups = 1 if numbers.size <= n_most else 2
        groups = []
        for part in filter(len, np.array_split(numbers, n_groups)):
            spread = np.linspace(0, part.size - 1, min(part.size, MAX_GRADED_CONTACTS))
            graded = part[spread.round().astype(int)].tolist()
            layout = grids.make_common_layout([self.contacts[number] for number in graded])
            groups.append((OpenCases(part, None, []), layout))
        return groups

    def solve_on_given_meshes(self) -> None:
        """Solve all cases on the meshes that the scene prescribes."""
        levels = mesh_levels.make_given_meshes(self.patch_model)
        numbers = np.arange(self.cases.n_cases)
        self._refine(OpenCases(numbers, None, []), levels[-1], levels[-2::-1])

    def _refine(self, cases: OpenCases, bodies, given=()) -> np.ndarray:
        """Solve cases on nested meshes; return the numbers of those that miss the tolerance on the finest one.

        Each further mesh halves the cells for the cases that miss the tolerance on the one before.

        Parameters
        ----------
        cases : OpenCases
            The cases, without measures.
        bodies : sequence
            Coarsest meshes of the pieces.
        given : sequence
            Finer meshes if the scene prescribes them.
        """
        max_nodes = MAX_SHARED_NODES if cases.numbers.size > 1 else np.inf
        nested = mesh_levels.NestedMeshes(self.patch_model, given, max_nodes)
        if self.patch_model.mesh.is_automatic:
            nested.n_needed = N_CASE_MESHES

        def press(bodies, before: mesh_levels.SolvedMeshes | None) -> mesh_levels.SolvedMeshes:
            """Press the cases that the meshes before have left."""
            before = before.solution if before else cases
            pair = condense(self.patch_model, *bodies, keep_factors=False)
            n_meshes = len(before.series) + 1
            done = self._press_parts(before, pair, is_judged=n_meshes >= nested.n_needed)
            excess = self.batch.excess[done.numbers].max(initial=0.0)
            return mesh_levels.SolvedMeshes(n_meshes, pair.meshes, excess, done)

        last, _ = refine(press, bodies, nested.judge, NO_LIMIT)
        return last.solution.numbers

    def _press_parts(self, before: OpenCases, pair: CondensedPair, *, is_judged: bool) -> OpenCases:
        """Press cases on a mesh, in parts that limit the memory, and return those that go on.

        Parameters
        ----------
        before : OpenCases
            Cases with their contacts and measures on the meshes before.
        pair : CondensedPair
            Pieces on the mesh.
        is_judged : bool
            Whether the measures are kept with their errors, and only cases that miss the tolerance go on.
        """
        numbers = before.numbers
        level = make_level(self.patch_model, pair)
        goes_on = np.ones(numbers.size, bool)
        parts = []

        # A case that cannot be pressed, or that meets its tolerance, is not pressed on the next mesh.
        for rows in _split_rows(numbers.size, level):
            part = before.take(rows)
            start = np.zeros((rows.size, level.x.size), bool)
            if part.places is not None:
                start = part.places.find_sets(level.x)
            pressed, errors = press_on_level(level, self.cases.take(part.numbers), start)
            values = collect_mesh_values(pressed)

            # Contacts of the cases that go on grade the meshes of their groups.
            if is_judged:
                series = [*part.series, values]
                goes_on[rows] = self._keep_measures(part.numbers, pressed, series, errors)
                for row in np.flatnonzero(goes_on[rows]):
                    number = int(part.numbers[row])
                    self.contacts[number] = find_contact(self.patch_model, number, pressed, row)
            for row, error in errors.items():
                goes_on[rows[row]] = False
                self.batch.fail(int(part.numbers[row]), error)

            parts.append((values, find_contact_places(pressed)))
            level.limit_sets(MAX_TABLE_SETS)

        values, places = zip(*parts)
        series = [*before.series, join_mesh_values(values)]
        return OpenCases(numbers, join_places(places), series).take(goes_on)

    def _keep_measures(self, numbers, pressed: PressedCases, series, errors) -> np.ndarray:
        """Estimate the errors of cases, and keep their measures; return whether they miss the tolerance (k,).

        Parameters
        ----------
        numbers : (k,) ndarray
            Numbers of the cases.
        pressed : PressedCases
            The cases on the finest mesh.
        series : list of MeshValues
            Their measures on all meshes from coarse to fine.
        errors : dict
            Errors of the cases that could not be pressed, by their rows.
        """
        mesh = self.patch_model.mesh
        length = self.patch_model.pieces.length
        tolerance = self.tolerance if mesh.is_automatic else None
        is_solved = np.ones(len(pressed), bool)
        is_solved[list(errors)] = False
        excess = np.full(len(pressed), np.inf)
        # The errors that three meshes give hold as well as those with a coarser one, which are larger or smaller
        for used in (series[-grids.MIN_NESTED_MESHES :], series):
            estimates = estimate_static_measures(pressed, used, tolerance, CENTRE_ERROR_IN_CELLS)
            own_excess = estimates.excess(self.tolerance, length)
            found = CaseMeasures(
                estimates.names,
                estimates.values,
                estimates.errors,
                estimates.floors(self.tolerance, length),
                own_excess,
                collect_facts(pressed),
            )
            self.batch.put(numbers[is_solved], found.take(is_solved))
            excess = np.minimum(excess, own_excess)
            if excess.max() <= 1 or len(used) == len(series):
                break
        return excess > 1


class _ContactSearch:
    """Search for the contacts of many cases, for which their meshes are graded.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases.
    cases : Cases
        n cases, of which MAX_SEARCHED_CASES are pressed: equally spaced ones in the order of their columns, and those with
        extreme columns.
    numbers : (n,) ndarray
        Numbers of the cases in the model.
    """

    def __init__(self, patch_model, cases: Cases, numbers: np.ndarray):
        self.patch_model = patch_model
        self.columns = np.nan_to_num(np.column_stack([*cases.holders, cases.amplitudes]))
        order = np.lexsort(self.columns.T[::-1])
        even = np.linspace(0, cases.n_cases - 1, min(cases.n_cases, MAX_SEARCHED_CASES))
        extreme = [*self.columns.argmin(axis=0), *self.columns.argmax(axis=0)]
        self.rows = np.unique([*order[even.round().astype(int)], *extreme])
        self.cases = cases.take(self.rows)
        self.numbers = numbers[self.rows]
        self.places: ContactPlaces | None = None

    def find_contacts(self, pair: CondensedPair) -> list[grids.SolvedContact]:
        """Return the contacts for which the next grid is graded, from the pieces on a grid."""
        level = make_level(self.patch_model, pair)
        start = np.zeros((self.cases.n_cases, level.x.size), bool)
        if self.places is not None:
            start = self.places.find_sets(level.x)
        pressed, errors = press_on_level(level, self.cases, start)
        self.places = find_contact_places(pressed)
        is_loaded = pressed.load > 0
        is_loaded[list(errors)] = False
        contacts = []
        for row in _spread_contacts(pressed.active, np.flatnonzero(is_loaded)):
            contacts.append(find_contact(self.patch_model, int(self.numbers[row]), pressed, row))
        return contacts

    def guess_places(self) -> ContactPlaces:
        """Return for each case the contact of the searched case whose numbers are nearest, relative to their ranges."""
        scale = np.ptp(self.columns, axis=0)
        scaled = self.columns / np.where(scale > 0, scale, 1.0)
        distances = ((scaled[:, None] - scaled[self.rows]) ** 2).sum(axis=2)
        return self.places.take(distances.argmin(axis=1))


def _spread_contacts(active, rows: np.ndarray) -> list[int]:
    """Select at most MAX_GRADED_CONTACTS of some contact sets, equally spaced in the order of their ends.

    `active` (n, m) are contact sets, and `rows` (k,) the numbers of those that are selected from.
    """
    if rows.size <= MAX_GRADED_CONTACTS:
        return rows.tolist()
    even = np.linspace(0, rows.size - 1, MAX_GRADED_CONTACTS // 2).round().astype(int)
    first = active[rows].argmax(axis=1)
    last = active[rows, ::-1].argmax(axis=1)
    orders = (np.argsort(place, kind="stable") for place in (first, last))
    return np.unique([rows[order[even]] for order in orders]).tolist()


def _split_rows(count: int, level: Level) -> list[np.ndarray]:
    """Return the numbers of `count` cases in parts whose arrays of nodes on a level need little memory."""
    size = max(1, MAX_CHUNK_VALUES // (level.x.size * (2 + len(level.shapes))))
    return np.split(np.arange(count), range(size, count, size))


def join_mesh_values(parts: Sequence[MeshValues]) -> MeshValues:
    """Return the measures of several parts of the cases on one mesh one after the other."""
    return MeshValues(
        parts[0].pair,
        {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values},
        np.concatenate([part.n_intervals for part in parts]),
        np.concatenate([part.end_pressure for part in parts]),
    )
