"""Solution of the cases of a patch on nested meshes, from which their errors are estimated.

In: a `PatchModel` whose loading and gap shapes may contain arrays, and a tolerance. Out: a `Batch`; or, of a single patch,
its `Patch` on each mesh. The cases are pressed together on nested meshes, and those that miss the tolerance go on with the
next mesh. When this would be too expensive, they get meshes that are graded to their own contacts; many of them are divided
by the ends of their contacts before. A case that is alone ends with its tolerance or with the limit of its mesh.
"""

from collections.abc import Iterator, Sequence
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from ...core import PatchfemError
from ...mesh.grading import Layout
from ...model.pieces import make_piece_meshes
from ..refine import NO_LIMIT, refine
from . import area, grids, profile_points, store
from .cases import Batch, MeshFact, make_cases, take_patch
from .condensed import CondensedPair, condense
from .contact_search import (
    MAX_GRADED_CONTACTS,
    ContactPlaces,
    ContactSearch,
    SolvedContact,
    find_contact_extent,
    find_contact_places,
    join_places,
)
from .measures import (
    MIN_CONTACT_EDGE_ERROR_IN_CELLS,
    MeshValues,
    StaticEstimates,
    add_measures,
    collect_mesh_values,
    estimate_static_measures,
    max_mesh_error_ratio,
    with_static_measures,
)
from .press import (
    Level,
    Patch,
    Patches,
    PointSolution,
    PressedCases,
    make_level,
    make_patch,
    press_on_level,
    solve_patch_contact,
)
from .values import contact_reaches_steep_end

# Largest part of the cases of a mesh that gets one further mesh; more of them get two. Of 100 loads, tilts and crowns, parts
# of 0.2 to 1 took the same CPU time within 6 %
MAX_SHARE_OF_ONE_GROUP = 1 / 3
MAX_CHUNK_VALUES = 4_000_000  # numbers of a temporary array of cases, columns and nodes, 32 MB
# Error of the centre of a contact on a mesh for many contacts, in cell lengths: an end lies anywhere in its cell, and half
# of its position error remains. In 280 random crowned blocks, it was at most 0.0061 where the changes between meshes are
# smaller
CENTRE_ERROR_IN_CELLS = MIN_CONTACT_EDGE_ERROR_IN_CELLS / 2
# Number of contact sets beyond which a table is emptied between two parts of the cases; of 500 nodes, 0.1 GB
MAX_TABLE_SETS = 6000
Bodies = Sequence[
    Any
]  # meshes of both pieces, `pieces.Mesh`; None for the upper one of identical pieces


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

    def find_sets(self, x) -> np.ndarray:
        """Return the contact sets (k, m) at nodes x (m,) [m] from which the search starts; empty ones without places."""
        if self.places is None:
            return np.zeros((self.numbers.size, x.size), bool)
        return self.places.find_sets(x)

    def take(self, rows) -> "OpenCases":
        """Return selected cases; `rows` are indices or a mask (k,)."""
        places = None if self.places is None else self.places.take(rows)
        return OpenCases(self.numbers[rows], places, [mesh.take(rows) for mesh in self.series])


class SinglePatch(NamedTuple):
    """What the solution of a single patch, of which its `Patch` on each mesh is wanted, depends on besides its model.

    - solved: patches of an earlier pass, from fine to coarse, which are not solved again.
    - with_errors: whether the patch is solved on coarser meshes, too, from which its errors follow.
    """

    solved: tuple[Patch, ...] = ()
    with_errors: bool = True


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
    if count == 1:
        patch_model = take_patch(patch_model, 0)
    return _CaseSolver(patch_model, count, tolerance).solve()


def solve_with_coarser(
    patch_model, tolerance: float, with_errors: bool = True, solved: Patches = ()
) -> Patches:
    """Solve a patch on its mesh and on the coarser meshes of its error estimate.

    On each mesh the pieces are condensed to the nodes of the interface, so that a compliance [m/N]
    relates nodal forces and displacements. The pressure sigma_n [Pa] and the gap under load [m] satisfy
    sigma_n >= 0, gap >= 0 and sigma_n gap = 0 at every node, and the pressure balances the load [N] or
    gives the prescribed approach [m].

    If the element size is not prescribed, nested meshes are refined until the patch meets the
    tolerance. An unstructured mesh has no coarser one; its second solution is on the mesh with all
    edges halved.

    Parameters
    ----------
    patch_model : PatchModel
        Patch to solve, with its mesh or element size.
    tolerance : float
        Relative error that the static measures have to meet.
    with_errors : bool
        Whether to solve the coarser meshes as well.
    solved : tuple
        Patches of an earlier pass, from fine to coarse, whose meshes are refined further.

    Returns
    -------
    tuple
        Patches from fine to coarse, at least two; None for each mesh that is not solved. The first
        has the static measures with the errors that follow from all of them (`Patch.measures`).

    Raises
    ------
    PatchfemError
        If the patch cannot be solved.
    """

    def solve() -> Patches:
        """Solve the patch on its own meshes or on those that the scene prescribes."""
        if patch_model.area is not None:
            return solved or area.solve_face_on_grids(
                patch_model, tolerance, with_errors=with_errors
            )
        earlier = tuple(patch for patch in solved if patch is not None)
        solver = _CaseSolver(patch_model, 1, tolerance, SinglePatch(earlier, with_errors))
        batch = solver.solve()
        # A mesh whose cells are too short for double precision is left out.
        if not solver.patches:
            raise batch.messages[0]
        patches = solver.patches
        if patches[0].measures is None:
            patches = with_static_measures(patches, tolerance)
        return (*patches, *[None] * (grids.MIN_NESTED_MESHES - len(patches)))

    # Runs of a rig or of a bench that have the same patch take it from the store. The factors of a fine mesh need much
    # memory, so that only the last of such patches stays there.
    key = ("patches", store.content_key(patch_model), tolerance, with_errors)
    return store.get_or_compute(key, solve, is_large=patch_model.mesh.is_fine)


def solve_on_other_mesh(patch: Patch, tolerance: float) -> Patch:
    """Solve a patch on a mesh whose elements are twice or half as long, so that a change shows the error of its mesh.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    tolerance : float
        Relative error of the static measures.

    Raises
    ------
    PatchfemError
        If the mesh has too few columns to be coarsened, or if the patch cannot be solved on the other mesh.
    """
    n_columns = patch.pair.meshes[0].x.size - 1
    if n_columns < grids.MAX_COLUMNS_WITHOUT_COARSER:
        raise PatchfemError(f"the mesh has only {n_columns} columns; use smaller elements", "")
    pair = condense(patch.model, *grids.change_elements(patch.pair.meshes))
    return with_static_measures([solve_patch_contact(patch.model, pair)], tolerance)[0]


def needs_finer_mesh(patch_model, patches, tolerance: float) -> bool:
    """Return whether a patch would get a finer mesh at a smaller tolerance.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of the run.
    patches : sequence of Patch or None
        Patches from fine to coarse.
    tolerance : float
        The smaller tolerance.
    """
    if grids.is_too_expensive(patch_model, grids.halve_cells(patches[0].pair.meshes)):
        return False
    # Values are extrapolated where they miss the tolerance.
    patches = with_static_measures(patches, tolerance, patches[0].points)
    return max_mesh_error_ratio(patches[0].measures, tolerance) > 1


def condense_for_contacts(patch_models) -> CondensedPair | None:
    """Condense the pieces of several patches on a mesh that is graded to the contacts of all of them.

    The mesh is as fine as that of a patch without error estimates. The result is None for patches with different pieces
    or steps, and for faces.
    """
    geometries = {(patch.pieces, patch.gap.step_edges) for patch in patch_models}
    if len(geometries) != 1 or patch_models[0].area is not None:
        return None
    first = patch_models[0]
    if not first.mesh.is_automatic:
        return condense(first, *make_piece_meshes(first))
    layout, _ = grids.search_layout([ContactSearch(patch, 1) for patch in patch_models])
    return condense(
        first, *grids.halve_cells(grids.make_grids(first, layout), grids.MIN_NESTED_MESHES - 1)
    )


class _CaseSolver:
    """Solution of the cases of a group on meshes that are chosen for them.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases, whose numbers may be arrays.
    count : int
        Number n of cases.
    tolerance : float
        Relative error of the static measures.
    single : SinglePatch, optional
        If the only case is to have its `Patch` on each mesh.

    Attributes
    ----------
    patches : tuple of Patch
        A single patch on its meshes, from fine to coarse; () for cases of which only the measures are wanted.
    """

    def __init__(
        self, patch_model, count: int, tolerance: float, single: SinglePatch | None = None
    ):
        self.patch_model = patch_model
        self.cases = make_cases(patch_model, count)
        self.tolerance = tolerance
        self.single = single
        self.batch = Batch.blank(count)
        self.contacts: dict[int, SolvedContact] = {}
        self.patches: tuple[Patch, ...] = ()
        self.points = None
        self.has_tried_points = False

    def solve(self) -> Batch:
        """Solve the cases on meshes that they share, and those that miss the tolerance on meshes of smaller groups."""
        cases = OpenCases(np.arange(self.cases.n_cases), None, [])
        if not self.patch_model.mesh.is_automatic:
            levels = grids.make_given_meshes(self.patch_model)
            if not self.has_errors:
                levels = levels[:1]
            self._refine(cases, levels[-1], levels[-2::-1])
            return self.batch

        groups = [self._choose_first_meshes(cases)]
        while groups:
            cases, bodies = groups.pop()
            missing = self._refine(cases, bodies)
            # A case that is alone has reached the limit of the mesh
            if missing.size and cases.numbers.size > 1:
                groups += self._regroup(missing, cases.numbers.size)
        return self.batch

    @property
    def has_errors(self) -> bool:
        """Whether the errors follow from coarser meshes."""
        return self.single is None or self.single.with_errors

    def _choose_first_meshes(self, cases: OpenCases) -> tuple[OpenCases, Bodies]:
        """Return the cases with what is known of their contacts, and the coarsest of their meshes."""
        if self.single is not None and self.single.solved:
            return cases, self.single.solved[-1].pair.meshes
        if self.cases.n_cases == 1:
            bodies = grids.make_base_grids(self.patch_model).bodies
            n_halvings = 0 if self.has_errors else grids.MIN_NESTED_MESHES - 1
            return cases, grids.halve_cells(bodies, n_halvings)
        search = ContactSearch(self.patch_model, self.cases.n_cases)
        layout, _ = grids.search_layout([search])
        bodies = self._make_bodies(layout, self.cases.n_cases)
        return cases._replace(places=search.guess_places()), bodies

    def _make_bodies(self, layout: Layout, count: int) -> Bodies:
        """Return the coarsest meshes of `count` cases with the columns of a layout."""
        bodies = grids.make_grids(self.patch_model, layout)
        return bodies if count == 1 else [body.coarsen() for body in bodies]

    def _regroup(self, numbers: np.ndarray, n_before: int) -> "list[tuple[OpenCases, Bodies]]":
        """Return groups of cases (k,) that miss the tolerance on a mesh, with the coarsest of their next meshes.

        Two groups have contacts that end at similar places. A small part of the `n_before` cases of a mesh stays together,
        because a mesh for its contacts alone is much finer there.
        """
        spans = np.array([self.contacts[number].extents[0].span for number in numbers.tolist()])
        side = np.ptp(spans, axis=0).argmax()
        numbers = numbers[np.argsort(spans[:, side], kind="stable")]
        n_groups = 1 if numbers.size <= MAX_SHARE_OF_ONE_GROUP * n_before else 2
        groups = []
        for part in filter(len, np.array_split(numbers, n_groups)):
            spread = np.linspace(0, part.size - 1, min(part.size, MAX_GRADED_CONTACTS))
            graded = part[spread.round().astype(int)].tolist()
            layout = grids.make_common_layout([self.contacts[number] for number in graded])
            groups.append((OpenCases(part, None, []), self._make_bodies(layout, part.size)))
        return groups

    def _refine(self, cases: OpenCases, bodies: Bodies, given: Sequence[Bodies] = ()) -> np.ndarray:
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
        is_shared = self.patch_model.mesh.is_automatic and cases.numbers.size > 1
        nested = grids.NestedMeshes(self.patch_model, given, is_shared=is_shared)
        if not self.has_errors:
            nested.n_needed = 1

        def press(bodies: Bodies, before: grids.SolvedMeshes | None) -> grids.SolvedMeshes | None:
            """Press the cases that the meshes before have left; None if a single patch has no solution on the mesh."""
            before = before.solution if before else cases
            level = self._make_level(bodies, len(before.series) + 1, nested)
            done = self._press_on_mesh(before, level, nested)
            if done is None:
                return None
            excess = self.batch.excess[done.numbers].max(initial=0.0)
            return grids.SolvedMeshes(len(before.series) + 1, level.pair.meshes, excess, done)

        last, _ = refine(press, bodies, nested.judge, NO_LIMIT)
        return last.solution.numbers if last else np.zeros(0, int)

    def _make_level(self, bodies: Bodies, n_meshes: int, nested: grids.NestedMeshes) -> Level:
        """Return the pieces on meshes, which are the n-th of the nested ones; those of an earlier pass are not condensed."""
        keep_factors = False
        if self.single is not None:
            if n_meshes <= len(self.single.solved):
                return self.single.solved[-n_meshes].pressed.level
            # Only the last mesh needs factors, for the stress inside the pieces, which is computed on a coarser mesh if this
            # one is expensive. The patches of many rigs do not keep them.
            for patch in self.patches[:1]:
                patch.pair.forget_factors()
            keep_factors = self.patch_model.mesh.is_fine and n_meshes >= nested.n_needed
            keep_factors &= not grids.is_too_expensive(self.patch_model, bodies)
        return make_level(
            self.patch_model, condense(self.patch_model, *bodies, keep_factors=keep_factors)
        )

    def _press_on_mesh(
        self, before: OpenCases, level: Level, nested: grids.NestedMeshes
    ) -> OpenCases | None:
        """Press cases on a mesh, and return those that go on; None if a single patch has no solution on it.

        From the mesh on that the errors need, measures are kept with their errors, and only cases that miss the tolerance go
        on. A case that cannot be pressed is not pressed on the next mesh.

        Parameters
        ----------
        before : OpenCases
            Cases with their contacts and measures on the meshes before.
        level : Level
            Pieces on the mesh.
        nested : NestedMeshes
            Meshes of the cases.
        """
        numbers = before.numbers
        is_judged = len(before.series) + 1 >= nested.n_needed
        goes_on = np.ones(numbers.size, bool)
        parts = []
        for rows, pressed, errors in self._press_parts(before, level):
            part = before.take(rows)
            values = collect_mesh_values(pressed)
            for row, error in errors.items():
                goes_on[rows[row]] = False
                self.batch.fail(int(part.numbers[row]), error)
            if self.single is not None and errors:
                return None

            # Contacts of the cases that go on grade the meshes of their groups.
            if is_judged:
                series = [*part.series, values]
                is_missed = self._keep_measures(part.numbers, pressed, series, errors, nested)
                goes_on[rows] &= is_missed | (nested.n_finer > 0)
                for row in np.flatnonzero(is_missed & nested.is_shared):
                    number = int(part.numbers[row])
                    extent = find_contact_extent(pressed, row)
                    patch = take_patch(self.patch_model, number)
                    self.contacts[number] = SolvedContact(patch, [extent])

            parts.append((values, find_contact_places(pressed)))
            level.limit_sets(MAX_TABLE_SETS)

        values, places = zip(*parts)
        series = [*before.series, join_mesh_values(values)]
        return OpenCases(numbers, join_places(places), series).take(goes_on)

    def _press_parts(
        self, before: OpenCases, level: Level
    ) -> Iterator[tuple[np.ndarray, PressedCases, dict[int, PatchfemError]]]:
        """Press cases on a mesh, in parts that limit the memory: their rows, the pressed cases and errors by their rows.

        A single patch becomes the first of `patches`; that of an earlier pass is not pressed again.
        """
        n_meshes = len(before.series) + 1
        if self.single is not None and n_meshes <= len(self.single.solved):
            self.patches = self.single.solved[-n_meshes:]
            yield np.arange(1), self.patches[0].pressed, {}
            return
        for rows in _split_rows(before.numbers.size, level):
            begin = process_time()
            part = before.take(rows)
            start = part.find_sets(level.x)
            pressed, errors = press_on_level(level, self.cases.take(part.numbers), start)
            if self.single is not None and not errors:
                self.patches = (make_patch(pressed, process_time() - begin), *self.patches)
            yield rows, pressed, errors

    def _keep_measures(
        self, numbers, pressed: PressedCases, series, errors, nested: grids.NestedMeshes
    ) -> np.ndarray:
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
        nested : NestedMeshes
            Meshes of the cases.
        """
        choices = [series]
        centre_error = None
        if nested.is_shared:
            # The errors that three meshes give hold as well as those with a coarser one, which are larger or smaller
            choices = [series[-grids.MIN_NESTED_MESHES :], series]
            centre_error = CENTRE_ERROR_IN_CELLS
        facts = collect_facts(pressed)
        excess = np.full(len(pressed), np.inf)
        for used in choices:
            estimates = estimate_static_measures(pressed, used, self.tolerance, centre_error)
            own_excess = estimates.compute_excess(self.tolerance)
            own_excess[list(errors)] = np.inf
            self.batch.put(numbers, estimates, own_excess, facts)
            excess = np.minimum(excess, own_excess)
            if excess.max() <= 1:
                break
        if self.single is not None:
            excess[0] = self._measure_patch(estimates)
        return excess > 1

    def _measure_patch(self, estimates: StaticEstimates) -> float:
        """Add its measures to a single patch, and return the largest ratio of error to allowed error on its finest mesh.

        If the next mesh of a patch with a profile is expensive, the measures are computed on points as dense as the profile,
        and the mesh only serves fields and motion. Points replace a mesh that would take longer than those of a rig. Where
        they do not converge, they would not do so beside the next mesh either.
        """
        patch, *coarse = self.patches

        def find_excess(points: PointSolution | None) -> float:
            """Add the measures with a solution on points, and return the excess of those that control the mesh."""
            self.patches = (add_measures(patch, estimates, self.tolerance, points), *coarse)
            return max_mesh_error_ratio(self.patches[0].measures, self.tolerance)

        excess = find_excess(self.points)
        if excess > 1 and not self.has_tried_points and self._prefers_points(patch):
            self.has_tried_points = True
            self.points = self.single.solved[0].points if self.single.solved else None
            if self.points is None:
                self.points = profile_points.solve_on_points(
                    self.patch_model, lambda points: find_excess(points) <= 1
                )
            excess = find_excess(self.points)
        # The points do not determine a peak that may be at a free corner, but a finer mesh does.
        has_peak = self.points is not None and "pressure_peak" in self.points.measures
        return 0.0 if has_peak else excess

    def _prefers_points(self, patch: Patch) -> bool:
        """Return whether points of a profile replace the next mesh of a patch, which would take long."""
        seconds = grids.predict_condensing_seconds(grids.halve_cells(patch.pair.meshes))
        is_expensive = seconds > grids.COARSE_GRID_DENSITY.max_condensing_seconds
        return is_expensive and profile_points.can_use_points(self.patch_model)


def _split_rows(count: int, level: Level) -> list[np.ndarray]:
    """Return the numbers of `count` cases in parts whose arrays of nodes on a level need little memory."""
    size = max(1, MAX_CHUNK_VALUES // (level.x.size * (2 + len(level.gap.shapes))))
    return np.split(np.arange(count), range(size, count, size))


def join_mesh_values(parts: Sequence[MeshValues]) -> MeshValues:
    """Return the measures of several parts of the cases on one mesh one after the other."""
    if len(parts) == 1:
        return parts[0]
    return MeshValues(
        parts[0].pair,
        {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values},
        np.concatenate([part.n_intervals for part in parts]),
        np.concatenate([part.end_pressure for part in parts]),
    )
