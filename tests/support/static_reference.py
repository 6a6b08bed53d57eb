"""Independent solver of static patches, which uses nothing of the package.

The cells are those of order 4 of studies/contact/order_four.py, on separate grids; contact is
solved by a plain active set. `answer(scene)` grades its columns to the contact edges that it finds,
and gives the measures by name, for unlike pieces with the coupled tangential stiffness. Pieces are
rectangles, of which a longer one overhangs; gaps are tilt, crown and step.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu
from study_module import study

cells_of = study("contact/order_four.py")
ORDER = 4
# of three laps: cells at an edge over `fine`, at the corners of the pieces over the shorter side, growth, cells across
# a stretch; corners that stayed at 1/60 were off by up to 40 bars of runs at a tolerance of 1e-5
LAPS = ((2.5, 1 / 250, 0.6, 16), (1.0, 1 / 1000, 0.5, 24), (0.4, 1 / 4000, 0.4, 36))
FIRST = (1.0, 1 / 60, 0.6, 16)


@dataclass(frozen=True)
class PieceInterface:
    """One piece with lengths [m]; layers: (Young's modulus [Pa], Poisson's ratio) of each layer.

    The layers are coating and substrate.
    """

    length: float
    height: float
    thickness: float
    layers: tuple


@dataclass(frozen=True)
class Scene:
    """A patch under a load [N] at a prescribed tilt [rad].

    curvature: of a crown [1/m]; step: (height, position) [m] or None; skin: stiffness of the
    asperities [Pa/m] or None.
    """

    length: float
    width: float
    plane: str
    lower: PieceInterface
    upper: PieceInterface
    load: float
    tilt: float = 0.0
    curvature: float = 0.0
    step: tuple | None = None
    skin: float | None = None


def spread(points, sizes, begin: float, end: float, growth: float, most: float) -> np.ndarray:
    """Return break points from begin to end with cells of sizes[k] at points[k].

    The cells grow by `growth` per distance, up to `most`.
    """
    points = np.asarray(points, float)
    sizes = np.asarray(sizes, float)
    stops = np.unique(np.concatenate([[begin, end], points[(points > begin) & (points < end)]]))
    stops = stops[np.concatenate([[True], np.diff(stops)[:-1] > sizes.min() / 4, [True]])]
    out = [begin]
    for low, high in pairwise(stops):
        fine = (high - low) * np.concatenate([[0.0], np.geomspace(1e-8, 0.5, 1000)])
        place = np.concatenate([low + fine, high - fine[-2::-1]])
        size = np.minimum((sizes + growth * np.abs(place[:, None] - points)).min(axis=1), most)
        count = np.concatenate(
            [[0.0], np.cumsum(np.diff(place) * (1 / size[1:] + 1 / size[:-1]) / 2)]
        )
        cells = max(2, int(np.ceil(count[-1])))
        out += list(np.interp(np.arange(1, cells + 1) * count[-1] / cells, count, place))
        out[-1] = high
    return np.array(out)


def face(body: PieceInterface, plane: str, inner, growth: float, corner: float) -> tuple:
    """Return compliances (nn, tt, nt), (m, m) [m2/N], of the common part of the face.

    They are per unit width, at the nodes of the cells of `inner`; nt is the normal motion by shear.
    """
    x = inner
    extra = 0
    if body.length > inner[-1] - inner[0] + 1e-12:
        beyond = spread(
            [inner[-1]],
            [inner[-1] - inner[-2]],
            inner[-1],
            body.length / 2,
            growth,
            body.length / 8,
        )
        x = np.concatenate([-beyond[:0:-1], inner, beyond[1:]])
        extra = (beyond.size - 1) * ORDER
    top = float(np.diff(inner).min())
    thick = body.thickness
    points = [0.0, body.height]
    sizes = [top, corner]
    if thick:
        points = [*points, thick]
        sizes = [*sizes, max(top, min(thick / 4, corner))]
    deep = spread(points, sizes, 0.0, body.height, growth, min(body.height, body.length) / 4)
    place, count = cells_of.numbering(x.size - 1, deep.size - 1, ORDER)
    m = (x.size - 1) * ORDER + 1
    rows = []
    columns = []
    entries = []
    for number, (young, nu) in enumerate(body.layers):
        if plane == "stress":
            young = young * (1 + 2 * nu) / (1 + nu) ** 2
            nu = nu / (1 + nu)
        layer = np.flatnonzero(((deep[1:] + deep[:-1]) / 2 > thick) == bool(number))
        if not layer.size:
            continue
        iy, ix = (grid.ravel() for grid in np.meshgrid(layer, np.arange(x.size - 1), indexing="ij"))
        ratio = np.diff(deep)[iy] / np.diff(x)[ix]
        cells, local = cells_of.without_interior(
            cells_of.cell_stiffness(ORDER, ratio, young, nu), ORDER
        )
        node = place[
            iy[:, None] * ORDER + local // (ORDER + 1), ix[:, None] * ORDER + local % (ORDER + 1)
        ]
        last = node >= count - m  # the nodes of the face; all motions along it come first
        dof = np.concatenate(
            [
                np.where(last, node + count - m, 2 * node),
                np.where(last, node + count, 2 * node + 1),
            ],
            axis=1,
        )
        dof = np.where(np.tile(node, 2) < 0, -1, dof)
        rows.append(np.broadcast_to(dof[:, :, None], cells.shape).ravel())
        columns.append(np.broadcast_to(dof[:, None, :], cells.shape).ravel())
        entries.append(cells.ravel())
    row = np.concatenate(rows)
    column = np.concatenate(columns)
    entry = np.concatenate(entries)
    free = (row >= 0) & (column >= 0)
    matrix = sparse.csc_array(
        (entry[free], (row[free], column[free])), shape=(2 * count, 2 * count)
    )
    factor = splu(
        matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    stiff = factor.L[-2 * m :, -2 * m :].toarray() @ factor.U[-2 * m :, -2 * m :].toarray()
    c = cho_solve(cho_factor((stiff + stiff.T) / 2), np.eye(2 * m))
    own = slice(extra, m - extra)
    return c[m:, m:][own, own], c[:m, :m][own, own], c[m:, :m][own, own]


def contact(c, g, load: float, theta_x) -> tuple:
    """Return nodal forces (m,) >= 0 of total `load`, and the approach d.

    The gaps c f + g + theta_x - d are >= 0, and zero where the force is not.
    """
    gap = g + theta_x
    active = gap <= np.quantile(gap, 0.3)
    for _ in range(400):
        index = np.flatnonzero(active)
        rows = np.linalg.solve(
            c[np.ix_(index, index)], np.stack([np.ones(index.size), gap[index]], axis=1)
        )
        d = (load + rows[:, 1].sum()) / rows[:, 0].sum()
        f = np.zeros(g.size)
        f[index] = d * rows[:, 0] - rows[:, 1]
        left = c @ f + gap - d
        wrong_in = active & (f < 0)
        wrong_out = ~active & (left < -1e-13 * np.abs(c @ f).max())
        if not wrong_in.any() and not wrong_out.any():
            return f, d
        active = (active & ~wrong_in) | (wrong_out if not wrong_in.any() else False)
    raise RuntimeError("no contact found")


def solve(scene: Scene, edges, fine: float, lap: tuple = FIRST) -> tuple:
    """Solve a scene on columns that are graded to `edges`.

    Parameters
    ----------
    scene : Scene
    edges : list
        Contact edges.
    fine : float
        Cell at an edge / shortest stretch.
    lap : tuple
        One of LAPS.

    Returns
    -------
    tuple
        Values by name, and the edges (from, to, free) of every stretch.
    """
    half, (share, corner, growth, inside) = scene.length / 2, lap
    fine *= share
    wide = min((b - a for a, b, _ in edges), default=scene.length)
    corner *= min(scene.lower.height, scene.length)
    points = [-half, half]
    sizes = [min(corner, wide / 30)] * 2
    if scene.lower.length != scene.upper.length:
        sizes = [wide * fine] * 2
    for a, b, _ in edges:
        points = [*points, a, b, (a + b) / 2]
        sizes = [*sizes, wide * fine, wide * fine, (b - a) / inside]
    if scene.step:
        points = [*points, scene.step[1]]
        sizes = [*sizes, wide * fine]
    x = spread(points, sizes, -half, half, growth, scene.length / 10)
    place, weight = cells_of.face_nodes(x, ORDER)
    bodies = [scene.lower] + [scene.upper] * (scene.upper != scene.lower)
    parts = [face(one, scene.plane, x, growth, corner) for one in bodies]
    low = parts[0]
    high = parts[-1]
    nn = low[0] + high[0]
    tt = low[1] + high[1]
    nt = low[2] - high[2]
    if scene.skin:
        nn = nn + np.diag(1 / (scene.skin * weight))
    gap = place**2 / 2 * scene.curvature
    if scene.step:
        height, at = scene.step
        # The corner node of a step belongs to the side in contact, up to its edge.
        gap = gap + height * (place > at + 1e-15 if height > 0 else place > at - 1e-15)
    f, d = contact(nn, gap, scene.load / scene.width, scene.tilt * place)
    pressure = f / weight
    active = f > 0
    change = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(int), [0]])))
    found = []
    for a, b in zip(change[::2], change[1::2] - 1):
        ends = [edge_of(place, pressure, a, -1, scene), edge_of(place, pressure, b, 1, scene)]
        if ends[1] - ends[0] > 1e-6 * scene.length or active.sum() < 9:
            found.append(
                (ends[0], max(ends[1], ends[0] + 1e-7 * scene.length), (a > 0, b < place.size - 1))
            )
    index = np.flatnonzero(active)
    own = np.linalg.inv(nn[np.ix_(index, index)])
    xs = place[index]
    cross = nt[np.ix_(index, index)]
    soft = tt[np.ix_(index, index)] - (cross.T @ own @ cross if scene.upper != scene.lower else 0.0)
    total = scene.width
    # A curve cannot follow a jump.
    largest = float(pressure.max()) if scene.step else peak(place, pressure)
    values = {
        "normal_load": scene.load,
        "approach": d,
        "moment": f @ place * total,
        "contact_fraction": sum(b - a for a, b, _ in found) / scene.length,
        "contact_half_width": (found[-1][1] - found[0][0]) / 2,
        "pressure_peak": largest,
        "pressure_centre": f @ place * total / scene.load,
        "normal_stiffness": own.sum() * total,
        "tangential_stiffness": np.linalg.solve(soft, np.ones(index.size)).sum() * total,
        "rotational_stiffness": xs @ own @ xs * total,
    }
    return values, found


def peak(x, pressure) -> float:
    """Return the maximum of the polynomial through the five nodes around the largest pressure."""
    top = int(np.argmax(pressure))
    if not 2 <= top < x.size - 2 or (pressure[top - 2 : top + 3] <= 0).any():
        return float(pressure[top])
    near = (x[top - 2 : top + 3] - x[top]) / (x[top + 2] - x[top - 2])
    form = np.polynomial.Polynomial.fit(near, pressure[top - 2 : top + 3], 4)
    return float(form(np.linspace(near[1], near[3], 201)).max())


def edge_of(x, pressure, node: int, side: int, scene: Scene) -> float:
    """Return the position at which the square of the pressure vanishes after the last node.

    At a border or a step it is this position itself.
    """
    if node in (0, x.size - 1):
        return float(x[node])
    if scene.step and abs(x[node] - scene.step[1]) <= abs(x[node] - x[node - side]):
        return float(scene.step[1])
    back = np.arange(1, 9)
    at = node - side * back
    at = at[(at >= 0) & (at < x.size)]
    at = at[pressure[at] > 0]
    if scene.skin or at.size < 4:
        return float(x[node] + (x[node + side] - x[node]) / 2)
    line = np.polyfit(x[at] - x[node], pressure[at] ** 2, 2 if at.size > 5 else 1)
    roots = np.roots(line)
    roots = roots[np.abs(roots.imag) < 1e-12].real
    reach = 4 * abs(x[node + side] - x[node])
    roots = roots[np.abs(roots) < reach]
    return float(
        x[node]
        + (roots[np.argmin(np.abs(roots))] if roots.size else (x[node + side] - x[node]) / 2)
    )


def answer(scene: Scene, fine: float = 5e-4, start=()) -> tuple:
    """Return values and their uncertainties by name, from the last of LAPS.

    The uncertainty is the largest of the last change and a third of the change before.
    """
    edges = list(start)
    found = []
    for size in (0.03, 0.01):
        edges = solve(scene, edges, size)[1]
    for lap in LAPS:
        values, edges = solve(scene, edges, fine, lap)
        found.append(values)
    first, second, last = found
    return last, {
        name: max(abs(value - second[name]), abs(second[name] - first[name]) / 3)
        for name, value in last.items()
    }
