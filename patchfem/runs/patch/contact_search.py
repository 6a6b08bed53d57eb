"""Contacts of the cases of a patch on a grid, for which their meshes are graded.

In: a `PatchModel`, whose loading and gap shapes may contain arrays, and condensed pieces. Out: `SolvedContact`s with the
regions of contact, and `ContactPlaces`, from which the search on the next mesh starts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...model.patch import PatchModel
from . import slip_zones
from .cases import make_cases, take_patch
from .condensed import CondensedPair
from .press import PressedCases, make_level, make_patch, press_on_level
from .values import find_contact_edges

# Largest number of contact edges for which the mesh is graded; with more edges it has equal
# columns.
MAX_GRADED_CONTACT_ENDS = 12
# Expected range of a varying load, relative to its mean.
VARYING_LOAD_FACTORS = (0.5, 1.5)
# Largest number of contacts for which the meshes of many cases are graded: half of them equally spaced in the order of
# their left ends, half in that of their right ends
MAX_GRADED_CONTACTS = 48
# Largest number of cases whose contacts are searched for before the meshes are chosen
MAX_SEARCHED_CASES = 256

Pairs = tuple[tuple[float, float], ...]  # (start, end) or (position, half-width) [m]


@dataclass(frozen=True, eq=False, slots=True)
class ContactExtent:
    """Region of contact with its edges, corners, pressure maxima and slip zones.

    - span: (start, end) [m] of the loaded part of the interface.
    - places: positions [m] of the contact edges inside the interface; for a contact that is too
      small to resolve, its nodes.
    - corners: ends of the interface that carry pressure [m].
    - cell: longest cell [m] in which the contact ends; inf for an unresolved contact.
    - crests: (position, half-width) [m] of the largest pressure maxima.
    - slip_zones: (start, end) [m] of the zones that slip under a prescribed displacement.
    """

    span: tuple[float, float]
    places: tuple[float, ...]
    corners: tuple[float, ...]
    cell: float
    crests: Pairs = ()
    slip_zones: Pairs = ()

    @property
    def width(self) -> float:
        """Length [m] of the loaded part of the interface."""
        return self.span[1] - self.span[0]


class SolvedContact(NamedTuple):
    """Contact regions of a patch in a search: its PatchModel, and the regions under its loads."""

    model: PatchModel
    extents: list[ContactExtent]


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
    if len(parts) == 1:
        return parts[0]
    counts = [part.crossings.shape for part in parts]
    crossings = np.full((sum(n for n, _ in counts), max(e for _, e in counts)), np.nan)
    first = 0
    for part, (n_contacts, n_crossings) in zip(parts, counts):
        crossings[first : first + n_contacts, :n_crossings] = part.crossings
        first += n_contacts
    return ContactPlaces(np.concatenate([part.begins for part in parts]), crossings)


class ContactSearch:
    """Search for the contacts of the cases of a group.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases, whose numbers may be arrays.
    count : int
        Number n of cases, of which MAX_SEARCHED_CASES are pressed: equally spaced ones in the order of their columns, and
        those with extreme columns.

    Attributes
    ----------
    error : PatchfemError or None
        Error of a case in the last search.
    """

    def __init__(self, patch_model: PatchModel, count: int):
        self.patch_model = patch_model
        self.n_cases = count
        loaded_models = (patch_model, *make_load_variants(patch_model))
        loaded = [make_cases(model, count) for model in loaded_models]
        self.columns = np.nan_to_num(np.column_stack([*loaded[0].holders, loaded[0].amplitudes]))
        order = np.lexsort(self.columns.T[::-1])
        even = np.linspace(0, count - 1, min(count, MAX_SEARCHED_CASES))
        extreme = [*self.columns.argmin(axis=0), *self.columns.argmax(axis=0)]
        self.rows = np.unique([*order[even.round().astype(int)], *extreme])
        self.has_load = np.broadcast_to(np.greater(patch_model.nominal_load, 0), count)[self.rows]
        self.loaded = [cases.take(self.rows) for cases in loaded]
        self.places: ContactPlaces | None = None
        self.error: PatchfemError | None = None

    def find_contacts(self, pair: CondensedPair) -> list[SolvedContact]:
        """Return the contacts for which the next grid is graded, from the pieces on a grid; [] without a load.

        Cases that cannot be solved are left out.
        """
        if not self.has_load.any():
            return []
        level = make_level(self.patch_model, pair)
        start = np.zeros((self.rows.size, level.x.size), bool)
        if self.places is not None:
            start = self.places.find_sets(level.x)

        # Contacts under the load of each case, and at the ends of its range
        solved = []
        is_solved = self.has_load.copy()
        for cases in self.loaded:
            pressed, errors = press_on_level(level, cases, start)
            for row, self.error in errors.items():
                is_solved[row] = False
            solved.append(pressed)
        self.places = find_contact_places(solved[0])

        # An open case of a group has no contact to grade a mesh to; a single one has the place of its smallest gap.
        is_closed = is_solved & (solved[0].load > 0)
        rows = np.flatnonzero(is_closed if is_closed.any() else is_solved)
        contacts = []
        for row in _spread_contacts(solved[0].active, rows):
            extents = [find_contact_extent(pressed, row) for pressed in solved]
            contacts.append(SolvedContact(take_patch(self.patch_model, self.rows[row]), extents))
        return contacts

    def guess_places(self) -> ContactPlaces | None:
        """Return for each case the contact of the searched case whose numbers are nearest, relative to their ranges.

        The result is None without a load.
        """
        if self.places is None:
            return None
        scale = np.ptp(self.columns, axis=0)
        scaled = self.columns / np.where(scale > 0, scale, 1.0)
        distances = ((scaled[:, None] - scaled[self.rows]) ** 2).sum(axis=2)
        return self.places.take(distances.argmin(axis=1))


def make_load_variants(patch_model: PatchModel) -> list[PatchModel]:
    """Return the patch at the ends of the range of a varying load; [] if no load moves its edges."""
    load = patch_model.loading.load
    if patch_model.mesh.edge_motion != "load" or load is None:
        return []
    return [patch_model.with_loading(load=factor * load) for factor in VARYING_LOAD_FACTORS]


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


def find_contact_extent(pressed: PressedCases, case: int) -> ContactExtent:
    """Return the contact region of a case on a coarse grid, or without contact the cells around its smallest gap.

    A smooth asperity layer carries pressure everywhere, so that only pressures above a thousandth
    of the peak count.

    Parameters
    ----------
    pressed : PressedCases
        Cases on the grid.
    case : int
        Number of the case.
    """
    x = pressed.x
    pressure = pressed.pressure[case]
    is_loaded = pressure > (1e-3 * pressure.max() if pressed.level.is_smooth else 0.0)
    loaded_nodes = np.flatnonzero(is_loaded)
    if not loaded_nodes.size:
        loaded_nodes = np.array([np.argmin(pressed.gap[case])])
    low = x[max(loaded_nodes[0] - 1, 0)]
    high = x[min(loaded_nodes[-1] + 1, x.size - 1)]

    # Around a contact of few nodes, the next search has shorter cells.
    if loaded_nodes.size < 4 and loaded_nodes.size < x.size:
        return ContactExtent((float(low), float(high)), tuple(x[loaded_nodes].tolist()), (), np.inf)

    # An edge lies in the cell between a loaded and a free node; the solver knows it more
    # accurately.
    edge_cells = np.flatnonzero(is_loaded[1:] != is_loaded[:-1])
    edge_positions = (x[edge_cells] + x[edge_cells + 1]) / 2
    cells = np.diff(x)[edge_cells]
    if pressed.active[case].any():
        edges = find_contact_edges(pressed)
        exists = edges.exists[case]
        if exists.sum() == edge_cells.size:
            edge_positions = edges.position[case, exists]

    corners = tuple(float(x[at]) for at in (0, -1) if is_loaded[at])
    low = edge_positions[0] if loaded_nodes[0] else x[0]
    high = edge_positions[-1] if loaded_nodes[-1] < x.size - 1 else x[-1]
    zones = ()
    # Only the patch of a bench slides, which is a single case.
    slip = pressed.level.model.mesh.slip
    if slip is not None:
        zones = slip_zones.find_slip_zones(make_patch(pressed, 0.0), slip)
    return ContactExtent(
        (float(low), float(high)),
        tuple(edge_positions.tolist()),
        corners,
        float(cells.max(initial=0.0)),
        _find_pressure_maxima(x, pressed.contact_pressure[case]),
        zones,
    )


def _find_pressure_maxima(x, sigma) -> Pairs:
    """Return (position, half-width) [m] of the pressure maxima inside a contact.

    Both follow from parabolas through three nodal pressures.
    """
    # Smallest local pressure maximum, relative to the peak pressure, around which the mesh is
    # refined.
    peak_node = np.flatnonzero(
        (sigma[1:-1] > 0.3 * sigma.max()) & (sigma[1:-1] > sigma[:-2]) & (sigma[1:-1] >= sigma[2:])
    )
    slope = np.diff(sigma) / np.diff(x)
    curvature = -2 * np.diff(slope)[peak_node] / (x[peak_node + 2] - x[peak_node])
    half_width = np.sqrt(2 * sigma[peak_node + 1] / curvature)
    if peak_node.size > MAX_GRADED_CONTACT_ENDS:
        return ()
    return tuple(zip(x[peak_node + 1].tolist(), half_width.tolist()))
