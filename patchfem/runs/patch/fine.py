"""Patch under a measured profile on equally spaced points, as fine as the samples and finer.

In: a `PatchModel` with a profile. Out: static measures with errors, and the pressure on the
points. The compliance of waves along the interface is known in closed form; finite elements
only compute the smooth change due to the free ends of the pieces. Errors come from the changes from
level to level, as for meshes: with cells half as long at the ends, and with twice as many
points.
"""

from typing import NamedTuple

import numpy as np

from ...contact.active_set import patch_problem
from ...contact.conjugate_gradients import solve_by_gradients
from ...contact.half_space.layer import end_compliance, layer_compliance
from ...contact.half_space.point_compliance import (
    PointCompliance,
    find_edges,
    set_stiffness,
    smooth_modes,
)
from ...core import NotConverged
from ...elasticity.elasticity import make_piece
from ...elasticity.lapack import one_thread
from ...mesh.grading import Layout, divide_into_columns, divide_into_rows
from ...model import profile
from ...model.pieces import make_elastic_layers
from .measures import OFFSET, Hidden, measures_from_series, shared_errors
from .press import Surface
from .values import vertex

MIN_LEVELS = 3  # fewer levels do not show an order of convergence
MAX_POINTS = 60_000  # points of a level; more would exceed the time of a patch
MAX_WORK = 2.5e7  # iterations times points of a level, for the same reason
MIN_POINTS = 500  # points of the first level
END_CELL = 1e-4  # cell at the ends over the length, on level 0
MIDDLE_CELL = 1 / 30  # cell in the middle over the length, on level 0
GROWTH = 0.8  # growth of these cells per distance
CONTACT_TOL = 3e-8  # relative residual of a solved contact
MAX_ITERATIONS = 4000  # iterations of one contact
CORNER_SPAN = 1e-3  # length of a corner over that of the interface
# pressure at a corner over the largest; above it the largest pressure may be at the corner
CORNER_PRESSURE = 0.2
MAX_OVERLAP = 1e-6  # largest overlap of a solved contact over the displacement due to the pressure


class PointSolution(NamedTuple):
    """Static measures from points of a profile, and the finest level that was solved.

    - measures: (value, error) by name; {} if a level is not solved.
    - surface, stretches: as in `Patch`; None if a level is not solved.
    """

    measures: dict
    surface: Surface | None = None
    stretches: np.ndarray | None = None

    @property
    def spacing(self) -> float | None:
        """Distance [m] between the points; None without a solution."""
        return None if self.surface is None else float(self.surface.x[1] - self.surface.x[0])


class PointLevel(NamedTuple):
    """Solution of the contact on the points of one level.

    - force (n,): nodal forces [N].
    - surface: pressure and gap on the points.
    - stretches (k, 2): parts in contact [m].
    - values: static measures by name.
    - hidden: errors that the levels may share.
    - work: iterations.
    - cornered: whether the pressure at a free corner may be the largest; a few cells at the ends do
      not resolve it.
    """

    force: np.ndarray
    surface: Surface
    stretches: np.ndarray
    values: dict
    hidden: Hidden
    work: int
    cornered: bool


def takes_points(patch_model) -> bool:
    """Return whether a `PatchModel` can be solved on equally spaced points.

    These are bare pieces of equal length with a profile, under a load, or under an approach without
    rotation.
    """
    loading = patch_model.loading
    can_turn = loading.can_rotate or loading.rotational_stiffness > 0
    held = loading.approach is None or not can_turn
    return (
        patch_model.mesh.is_automatic
        and patch_model.gap.profile is not None
        and patch_model.interface.skin is None
        and patch_model.interface.strips is None
        and not patch_model.pieces.has_overhang
        and patch_model.mesh.edge_motion != "wear"
        and held
    )


def solve_on_points(patch_model, enough) -> PointSolution:
    """Solve a `PatchModel` on an increasing number of points.

    Parameters
    ----------
    patch_model : PatchModel
    enough : callable
        Function of the measures that ends the refinement; MAX_POINTS and MAX_WORK end it as well.
    """
    count = _first_level_points(patch_model)
    series = []
    found = {}
    with one_thread():
        try:
            cells = [_ends(patch_model, level) for level in range(MIN_LEVELS)]
            coarse = [_level(patch_model, ends, count, None) for ends in cells]
            series = coarse[-1:]
            while len(series) < MIN_LEVELS or not (enough(found) or _is_expensive(series[-1])):
                series.append(
                    _level(patch_model, cells[-1], 2 * series[-1].force.size, series[-1].force)
                )
                found = _add_series(coarse, series) if len(series) >= MIN_LEVELS else {}
        except (NotConverged, np.linalg.LinAlgError):
            pass
    return (
        PointSolution(found, series[-1].surface, series[-1].stretches)
        if found
        else PointSolution({})
    )


def _first_level_points(patch_model) -> int:
    """Return the number of points of the first level."""
    n_samples = patch_model.pieces.length / profile.find_sample_spacing(patch_model.gap.profile)
    return max(MIN_POINTS, min(round(n_samples / 4), MAX_POINTS // 4))


def _is_expensive(last: PointLevel) -> bool:
    """Return whether doubling the points of a level exceeds the limit of points or iterations."""
    return 2 * last.force.size > MAX_POINTS or 3 * last.work * last.force.size > MAX_WORK


def _add_series(coarse: list, series: list) -> dict:
    """Return (value, error) by name from two series of levels.

    The first series has ever finer cells at the ends, the second ever more points with the finest
    of these cells. The extrapolation and the error of the first are added to the second.
    """
    mine = series[-1].values
    found = measures_from_series(
        [one.values for one in series], shared_errors(series[-1].hidden, mine), True, 0.0
    )
    ends = measures_from_series([one.values for one in coarse], {}, True, 0.0)
    unknown = ("pressure_peak", "loaded_fraction") if series[-1].cornered else ()
    return {
        name: (one.value + ends[name].value - coarse[-1].values[name], one.error + ends[name].error)
        for name, one in found.items()
        if name not in unknown
    }


def _ends(patch_model, level: int) -> list:
    """Return the change of compliance due to the free ends of the pieces, on the cells of a level.

    Returns positions (k,) [m] and changes (2, k, k) [m2/N] for pressure and for shear.
    """
    length = patch_model.pieces.length
    sides = (-0.5, 0.5)
    layout = Layout(
        -length / 2,
        length / 2,
        tuple((side * length, side * length, END_CELL * length) for side in sides),
        (-length / 2, length / 2),
        MIDDLE_CELL * length,
        MIDDLE_CELL * length,
        GROWTH,
    ).scale_cells(0.5**level)
    places = divide_into_columns(layout)
    changes = 0.0
    for piece, share in _bodies(patch_model):
        depth, coated = _rows(piece, layout)
        changes = changes + share * np.array(
            end_compliance(
                make_piece(places, depth, coated, make_elastic_layers(patch_model, piece))
            )
        )
    return places, changes


def _bodies(patch_model) -> list:
    """Return (piece, multiplicity) for the distinct pieces."""
    pieces = patch_model.pieces
    return [(pieces.upper, 2)] if pieces.are_alike else [(pieces.lower, 1), (pieces.upper, 1)]


def operators(patch_model, ends: tuple, count: int) -> tuple:
    """Return the PointCompliance for pressure and for shear of equally spaced points.

    Parameters
    ----------
    patch_model : PatchModel
    ends : tuple
        Change of compliance by the free ends of the pieces, from `_ends`.
    count : int
        Number of points.
    """
    length = patch_model.pieces.length
    width = patch_model.pieces.width * patch_model.pieces.pairs
    x = ((np.arange(count) + 0.5) / count - 0.5) * length
    k = np.arange(count) * np.pi / length
    waves = sum(
        share
        * np.array(
            layer_compliance(
                k, piece.height, piece.thickness, make_elastic_layers(patch_model, piece)
            )
        )
        for piece, share in _bodies(patch_model)
    )
    out = []
    for wave, change in zip(waves, ends[1]):
        modes, sizes = smooth_modes(ends[0], change, x)
        out.append(PointCompliance(x, length / count * width, wave, modes, sizes / width))
    return tuple(out)


def _rows(piece, layout: Layout) -> tuple:
    """Return the depths [m] of the rows of a piece, and the number of rows in its coating."""
    height = piece.height
    thick = piece.thickness
    least = layout.bands[0][2]
    bands = [
        (0.0, 0.0, least),
        (height, height, height * layout.max_length / (layout.stop - layout.start) / 2),
    ]
    bands += [(thick, thick, max(thick * layout.slope / 4, least))] if thick else []
    most = 2 * height * layout.max_length / (layout.stop - layout.start)
    return divide_into_rows(
        Layout(0.0, height, tuple(bands), (0.0, height), most, most, layout.slope), thick
    )


def _level(patch_model, ends: tuple, count: int, start) -> PointLevel:
    """Solve the contact on `count` points.

    start: forces (n,) [N] of the level with half as many points, or None.
    """
    normal, shear = operators(patch_model, ends, count)
    x = normal.x
    between = np.linspace(
        -patch_model.pieces.length / 2, patch_model.pieces.length / 2, 2 * count + 1
    )
    gap = patch_model.gap.evaluate(between).heights[1::2]
    force, closing, theta, work = _solve_forces(patch_model, normal, gap, start)
    moved = normal.product(force)
    opening = gap + theta * x - closing + moved
    touches = force > 0
    if not opening.min() >= -MAX_OVERLAP * np.abs(moved).max():
        raise NotConverged(
            f"contact: at {count} points the pieces still overlap by up to {-opening.min():.1e} m"
        )
    opening = np.where(touches, 0.0, np.maximum(opening, 0.0))
    surface = Surface(x, np.full(count, normal.area), force / normal.area, opening, gap)
    values, found, stretches = _values(patch_model, (normal, shear), force, opening)
    values |= {"approach": closing, "rotation": patch_model.gap.angle + theta}
    cell = patch_model.pieces.length / count
    hidden = Hidden(
        patch_model.pieces.length,
        int(touches.sum()),
        cell * bool(found),
        cell * len(found),
        OFFSET,
        patch_model.loading.moment is not None,
        float(np.ptp(gap) + np.abs(moved).max()),
        0.0,
        0.0,
    )
    near = max(1, round(CORNER_SPAN * count))
    cornered = max(force[:near].max(), force[-near:].max()) > CORNER_PRESSURE * force.max()
    return PointLevel(force, surface, stretches, values, hidden, work, bool(cornered))


def _solve_forces(patch_model, normal: PointCompliance, gap, start) -> tuple:
    """Solve for the forces of a level.

    Returns forces (n,) [N], approach [m], rotation [rad] in addition to that in the gap, and
    iterations.
    """
    x = normal.x
    begin = None if start is None else np.repeat(start, 2) / 2
    low = gap.min() if patch_model.loading.approach is None else patch_model.loading.approach
    moment = None if patch_model.loading.approach is not None else patch_model.loading.moment
    load = patch_model.loading.load if patch_model.loading.approach is None else None
    force, count = solve_by_gradients(
        normal,
        patch_problem(x, gap - low, load, moment, patch_model.loading.rotational_stiffness),
        CONTACT_TOL,
        MAX_ITERATIONS,
        begin,
    )
    touches = force > 0
    if patch_model.loading.approach is not None or not touches.any():
        return force, float(low), 0.0, count
    depth = (gap + normal.product(force))[touches]
    if moment is None:
        return force, float(depth.mean()), 0.0, count
    middle = x[touches].mean()
    arms = x[touches] - middle
    lean = float(arms @ depth) / max(float(arms @ arms), 1e-300)
    return force, float(depth.mean() - lean * middle), -lean, count


def _values(patch_model, both: tuple, force, gap) -> tuple:
    """Return the measures except approach and rotation, the ends of the contact, and its parts.

    The parts are (k, 2) [m].
    """
    (normal, shear), x, load = both, both[0].x, float(force.sum())
    touches = force > 0
    sigma = force / normal.area
    if not touches.any():
        raise NotConverged("contact: the pieces touch on coarser cells only")
    one = np.ones(x.size)
    found = find_edges(normal, force, gap, normal.solve_forces(touches, one))
    bears = np.concatenate([[False], touches, [False]])
    edges = iter(found)
    places = [
        next(edges).position if 0 < at < x.size else (at / x.size - 0.5) * patch_model.pieces.length
        for at in np.flatnonzero(bears[1:] != bears[:-1])
    ]
    stretches = np.array(places).reshape(-1, 2)
    long = np.maximum(np.diff(stretches).ravel(), 0.0)
    peak = float(sigma.max())
    top = int(np.argmax(sigma))
    if 0 < top < x.size - 1:
        peak = max(peak, float(vertex(x, sigma[None], np.array([top]))[0]))
    moment = float(force @ x)
    out = {
        "normal_load": load,
        "contact_fraction": float(long.sum()) / patch_model.pieces.length,
        "pressure_peak": peak,
        "moment": moment,
        "contact_half_width": float(places[-1] - places[0]) / 2,
        "pressure_centre": moment / load,
        "loaded_fraction": load / (normal.area * x.size * peak),
        "normal_stiffness": set_stiffness(normal, touches, one, found),
        "rotational_stiffness": set_stiffness(normal, touches, x, found),
    }
    if patch_model.pieces.are_alike:
        out["tangential_stiffness"] = set_stiffness(shear, touches, one, found)
    return out, found, stretches
