"""Static measures of a patch from Gauss-Lobatto cells of order 4, for tolerances that bilinear cells reach dearly.

A ladder of its own: every level has shorter cells at the edges of the contact and a gentler growth away from them, and
its columns break at the edges that the level before found. So an edge needs no interpolation between nodes for the
stiffnesses, and where it stood wrong a first-order correction takes them to where it is. Errors come from the changes
from level to level.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import Compliance, Interface, NotConverged, Outcome, Pressure, frozen_array
from ...elasticity import high_order
from ...elasticity.grid_fronts import predicted_seconds
from ...elasticity.lapack import cho_factor, cho_solve, one_thread
from ...mesh.grading import Layout, columns, rows
from ...model.pieces import layers_of
from .grids import contact_extent
from .press import pressure_on

ORDER = 4
LEAST_LEVELS, MOST_LEVELS = 3, 8
SPENT = 1.0  # predicted seconds of the dearest level
MOST_EDGES = 12  # of the contact
LEAST = 1e-9  # of the contact: the shortest stretch
FALLS, PLACE_FALLS, SLOWEST = 5.0, 4.0, 1.6  # ratio of successive changes: the best believed, of PLACES too, the least
PLACES = ("contact_fraction", "contact_half_width", "pressure_centre", "moment")
SAFE, ROUND = 2.5, 1e-8  # of the rest of a series; of a value, what round-off leaves at least
# of a value, what cells of order 4 in plane strain lack by Poisson's ratio: Hertz on grids of another program
LOCKED = ((0.4, 0.45, 0.49, 0.499), (0.0, 2e-5, 2e-4, 5e-4))
ROUGH = 1e-3  # round-off of the compliance beyond which a level is refused
SLOPE, EDGE, CORNER = 1.6, 0.03, 0.6  # of level 0: growth; cell at an edge over the contact, at a corner over its size
FALL = (0.75, 0.3, 0.3)  # of the three from level to level
INSIDE = (0.25, 0.55)  # of the contact: its longest cell on level 0, and how that falls; the peak errs by its 4th power
REACH = 12  # cells at an edge over which a parabola is laid through the square of the pressure: of 8 to 60 the best
UNLIKE = 1e-2  # of the cell at a corner where unlike pieces meet, whose pressure is singular there


class Edge(NamedTuple):
    """Where the contact ends: place [m]; side: 1 where it ends towards +x, else -1; free: inside the interface."""

    place: float
    side: int
    free: bool


@dataclass(frozen=True, eq=False, slots=True)
class CellLevel:
    """One level: its columns break at `edges`, the contact was found to end at `found`; values by name of measure.

    rounding: relative error of the compliance by round-off [1]; nodes: of the interface.
    """

    edges: tuple
    found: tuple
    values: dict
    rounding: float
    nodes: int


def takes_cells(asked) -> bool:
    """Whether a `PatchModel` has what cells of order 4 are made for: bare blocks under smooth shapes."""
    return asked.chosen and not asked.outlined and asked.skin is None and asked.strips is None \
        and asked.gap.profile is None and not asked.gap.jumps and asked.sweeps != "wear"


def sharper_by_cells(asked, patch, enough) -> dict:
    """Static measures by name, as (value, error), of a `PatchModel` pressed on a bilinear grid as `patch`.

    enough(measures) -> bool ends the climb, as do SPENT and MOST_LEVELS. {} where the contact is no stretch or two that
    cells can be laid out for, or where three levels cannot be solved.
    """
    edges, series = first_edges(patch), []
    while edges and len(series) < MOST_LEVELS:
        grids = cells_of(asked, edges, len(series))
        if seconds_of_cells(*grids) > SPENT:
            break
        try:
            series.append(level_of(asked, edges, *grids))
        except (NotConverged, np.linalg.LinAlgError):  # cells too short for the digits there are
            break
        edges = series[-1].found
        if not _apart(edges):
            break
        if len(series) >= LEAST_LEVELS:
            found = best_levels(series, locked(asked))
            if enough(found):
                break
    return best_levels(series, locked(asked)) if len(series) >= LEAST_LEVELS else {}


def locked(asked) -> float:
    """Relative error that a Poisson's ratio near 0.5 leaves in plane strain, whatever the changes show."""
    layers = [layers_of(asked, piece) for piece in (asked.lower, asked.upper)]
    ratios = [nu for one in layers for _, nu in (one.coating, one.substrate)]
    return float(np.interp(max(ratios), *LOCKED)) if asked.plane == "strain" else 0.0


def best_levels(series: list, locked: float = 0.0) -> dict:
    """(value, error) by name: that of the level, from the third on, whose error is least; at least the share `locked`
    of the value."""
    out = {}
    for name in series[0].values:
        values = [level.values[name] for level in series]
        falls = PLACE_FALLS if name in PLACES else FALLS
        errors = [(max(remainder(values[:k + 1], falls), _round_off(name, series[k])), k)
                  for k in range(LEAST_LEVELS - 1, len(values))]
        error, best = min(errors)
        out[name] = values[best], max(error, locked * abs(values[best]))
    return out


def _round_off(name: str, level: CellLevel) -> float:
    """Error of a measure by round-off; some are zero by symmetry."""
    share, value = max(ROUND, level.rounding), level.values[name]
    arm = share * (abs(level.found[-1].place) + abs(level.found[0].place)) / 10
    return max(share * abs(value), {"pressure_centre": arm, "moment": arm * level.values["normal_load"]}.get(name, 0.0))


def remainder(values: list, falls: float = FALLS) -> float:
    """Half-width around the last of three values or more that holds what is left of the series.

    The changes fall by some `falls` from level to level. Slower ones are taken as the geometric series that they show;
    one that is small by chance counts as what the change before it leaves, of three values for certain.
    """
    last, before = abs(values[-1] - values[-2]), abs(values[-2] - values[-3])
    ratio = before / last if last else falls
    chance = before / falls / (1 if len(values) == 3 else 2)
    left = max(last, chance) / (min(max(ratio, SLOWEST), falls) - 1)
    return SAFE * left


def first_edges(patch) -> tuple:
    """The edges of a contact pressed on a bilinear grid, () where they are no stretches that cells can be laid out
    for."""
    half, bears, seen = float(patch.x[-1]), patch.active, contact_extent(patch)
    places = [(-half, False)] * bool(bears[0]) + [(place, True) for place in seen.places]
    places += [(half, False)] * bool(bears[-1])
    edges = tuple(Edge(float(place), 2 * (k % 2) - 1, free) for k, (place, free) in enumerate(places))
    return edges if _apart(edges) else ()


def _apart(edges: tuple) -> bool:
    """Whether edges by rising x make stretches that do not touch, not more than MOST_EDGES."""
    places = [edge.place for edge in edges]
    return 0 < len(edges) <= MOST_EDGES and len(edges) % 2 == 0 and \
        all(b - a > LEAST * (places[-1] - places[0]) for a, b in pairwise(places))


def level_of(asked, edges: tuple, breaks, depths: list) -> CellLevel:
    """Solve a `PatchModel` on the cells of `cells_of`."""
    with one_thread():
        pieces, closing, rounding = condensed_cells(asked, breaks, depths)
        if rounding > ROUGH:
            raise NotConverged(f"the compliance of the pieces has a rounding error of {rounding:.1e}")
        x = pieces.interface.x
        pressure = pressure_on(asked, pieces, asked.gap.at(x)[0])
        if pressure.outcome is Outcome.NO_CONTACT:
            raise NotConverged("contact: the pieces touch on coarser cells only")
        found = edges_of(x, pressure.sigma_n, _thin(asked))
        values = _values(asked, pieces, pressure, found) | _stiffnesses(asked, pieces, closing, edges, found)
    return CellLevel(edges, found, values, rounding, x.size)


def condensed_cells(asked, breaks, depths: list) -> tuple:
    """(Compliance of both pieces, (m, m) normal closing per shear force [m/N], rounding [1]) on the cells of
    `cells_of`."""
    width, pieces = asked.width * asked.pairs, (asked.lower, asked.upper)
    faces = [high_order.condense(breaks, depth, coated, layers_of(asked, piece), ORDER)
             for piece, (depth, coated) in zip(pieces, depths)]
    low, high = faces[0], faces[-1]
    normal, tangential = (frozen_array((a + b) / width) for a, b in ((low.nn, high.nn), (low.tt, high.tt)))
    interface = Interface(frozen_array(low.x), frozen_array(low.weight * width), width)
    return Compliance(interface, normal, tangential), (low.nt - high.nt) / width, max(low.rounding, high.rounding)


def seconds_of_cells(breaks, depths: list) -> float:
    """Predicted CPU time [s] of condensing the pieces on the cells of `cells_of`."""
    return sum(predicted_seconds(ORDER * (breaks.size - 1) + 1, ORDER * (depth.size - 1) + 1, False, ORDER)
               for depth, _ in depths)


def cells_of(asked, edges: tuple, level: int) -> tuple:
    """Cells of a level: break points (k + 1,) [m] of the columns, and (depths (r + 1,) [m], rows in the coating) of
    each piece, one where they are alike."""
    layout = _layout(asked, edges, level)
    breaks = columns(layout, [edge.place for edge in edges if edge.free])
    pieces = (asked.lower,) if asked.alike else (asked.lower, asked.upper)
    return breaks, [_rows(asked, piece, breaks, layout.slope, CORNER * FALL[2]**level) for piece in pieces]


def _wide(edges: tuple) -> float:
    return min(b.place - a.place for a, b in zip(edges[::2], edges[1::2], strict=True))


def _thin(asked) -> float:
    return min([piece.thickness for piece in (asked.lower, asked.upper) if piece.thickness] + [asked.length / 2])


def _layout(asked, edges: tuple, level: int) -> Layout:
    half, wide = asked.length / 2, _wide(edges)
    slope, edge, corner = (first * fall**level for first, fall in zip((SLOPE, EDGE, CORNER), FALL, strict=True))
    size = _thin(asked) * corner
    bears = {one.side for one in edges if not one.free}
    bands = [(side * half, side * half, min(size, wide * corner) * (1 if asked.alike else UNLIKE) if side in bears else
              size) for side in (-1, 1)]
    fine = min(wide / 2, _thin(asked)) * edge
    bands += [(one.place, one.place, fine) for one in edges if one.free]
    span = (edges[0].place, edges[-1].place)
    return Layout(-half, half, tuple(bands), span, wide * INSIDE[0] * INSIDE[1]**level, asked.length / 3, slope)


def _rows(asked, piece, breaks, slope: float, corner: float) -> tuple:
    height, thick = piece.height, piece.thickness
    top = min(float(np.diff(breaks).min()), (thick or height) / 2)
    bands = [(0.0, 0.0, top), (height, height, min(height, asked.length) * corner / 4)]
    bands += [(thick, thick, max(min(thick * corner, thick / 2), top))] if thick else []
    cap = max(asked.length, height) / 3
    return rows(Layout(0.0, height, tuple(bands), (0.0, height), cap, cap, slope), thick)


def edges_of(x, pressure, thin: float) -> tuple:
    """Ends of the contact, as a tuple of Edge: inside the interface where the square of the pressure vanishes.

    Behind an edge the pressure is alpha sqrt(r) + beta/sqrt(r), beta from an edge that stands wrong on the mesh; its
    square is a line in r, and more of a polynomial further away.
    """
    bears = np.concatenate([[False], pressure > 0, [False]])
    change = np.flatnonzero(bears[1:] != bears[:-1])
    first, last = change[::2], change[1::2] - 1
    out = []
    for low, high in zip(first, last, strict=True):
        reach = min(0.45 * (x[high] - x[low]), thin)
        for node, side in ((low, -1), (high, 1)):
            free = 0 < node < x.size - 1
            place = _vanishes(x, pressure, node, side, reach) if free else float(x[node])
            out.append(Edge(place, side, bool(free)))
    return tuple(out)


def _vanishes(x, pressure, node: int, side: int, reach: float) -> float:
    """Place [m] beyond or before the last node where the square of the pressure vanishes."""
    behind = side * (x[node] - x)
    cell = side * (x[node] - x[node - side * ORDER]) if 0 <= node - side * ORDER < x.size else reach / 8
    cell = abs(cell)
    use = (behind > cell / 2) & (behind < min(REACH * cell, reach)) & (pressure > 0)
    if np.count_nonzero(use) < 5:
        use = (behind >= 0) & (behind < 1.3 * reach) & (pressure > 0)
    if np.count_nonzero(use) < 3:
        return float(x[node] + side * (abs(x[node + side] - x[node]) / 2))
    r, degree = behind[use] / cell, min(2, np.count_nonzero(use) // 3)
    roots = np.roots(np.polyfit(r, pressure[use]**2, max(degree, 1), w=1 / (1 + r)))
    roots = roots[np.abs(roots.imag) < 1e-9].real
    roots = roots[(roots > -2) & (roots < 1)]
    if not roots.size:
        return float(x[node] + side * (abs(x[node + side] - x[node]) / 2))
    return float(x[node] - side * cell * roots[np.argmin(np.abs(roots))])


def _values(asked, pieces: Compliance, pressure: Pressure, found: tuple) -> dict:
    """The measures but the stiffnesses."""
    weight = pieces.interface.weight
    force, load = pressure.sigma_n * weight, pressure.load
    ends = np.array([edge.place for edge in found]).reshape(-1, 2)
    top = high_order.peak(force, weight, ORDER, pressure.sigma_n > 0)
    return {"normal_load": load, "contact_fraction": float(np.diff(ends).sum() / asked.length), "pressure_peak": top,
            "moment": pressure.moment, "rotation": pressure.rotation, "approach": pressure.approach,
            "contact_half_width": float(ends[-1, 1] - ends[0, 0]) / 2, "pressure_centre": pressure.moment / load,
            "loaded_fraction": load / (weight.sum() * top)}


def _stiffnesses(asked, pieces: Compliance, closing, edges: tuple, found: tuple) -> dict:
    """Stiffnesses of the nodes between the edges on the mesh, corrected to first order for where the edges are.

    A flat punch presses with kappa/sqrt(r) behind its edge; moved by da it is stiffer by 2 pi kappa^2/E* da (Irwin's
    rate of release of energy).
    """
    x, width = pieces.interface.x, pieces.interface.width
    ends = np.array([edge.place for edge in edges]).reshape(-1, 2)
    tiny = 1e-12 * asked.length
    held = np.flatnonzero(((x[:, None] >= ends[:, 0] - tiny) & (x[:, None] <= ends[:, 1] + tiny)).any(axis=1))
    here, one = np.ix_(held, held), np.ones(held.size)
    arms = np.stack([one, x[held]], axis=1)
    normal = cho_solve(cho_factor(pieces.normal[here]), arms)
    soft = pieces.tangential[here]
    if not asked.alike:
        cross = closing[here]
        soft = soft - cross.T @ np.linalg.solve(pieces.normal[here], cross)
    shear = np.linalg.solve(soft, one)
    out = np.array([one @ normal[:, 0], one @ shear, x[held] @ normal[:, 1]])
    if len(found) == len(edges):
        parts = np.stack([normal[:, 0], shear, normal[:, 1]]) / pieces.interface.weight[held]
        out += width / _modulus(asked) * sum(
            2 * np.pi * _intensity(x[held], parts, a)**2 * a.side * (b.place - a.place)
            for a, b in zip(edges, found, strict=True) if a.free and b.free)
    return dict(zip(("normal_stiffness", "tangential_stiffness", "rotational_stiffness"), map(float, out), strict=True))


def _modulus(asked) -> float:
    """Contact modulus E* [Pa] of the two faces."""
    faces = [layers_of(asked, piece).coating for piece in (asked.lower, asked.upper)]
    return 1 / sum((1 - nu**2 * (asked.plane == "strain")) / young for young, nu in faces)


def _intensity(x, parts, edge: Edge) -> np.ndarray:
    """kappa (3,) of pressures (3, m) that go as kappa/sqrt(r) behind an edge, from a line through p sqrt(r)."""
    behind = edge.side * (edge.place - x)
    order = np.argsort(np.abs(behind))
    order = order[behind[order] >= 0][ORDER:3 * ORDER + 1]
    r = behind[order]
    return np.polyfit(r / r.max(), (parts[:, order] * np.sqrt(r)).T, 1)[1] if r.size > 2 else np.zeros(len(parts))
