"""Independent solver of static patches, which uses nothing of the package.

The elements are those of order 4 of studies/contact/order_four.py, on separate grids; contact is
solved by a simple active-set method. `answer(scene)` grades its columns to the contact edges that
it finds, and returns the measures by name, for bodies of different materials with the coupled
tangential stiffness. Bodies are rectangles, of which the longer one overhangs; gaps are tilt, crown
and step.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu
from study_module import study

cells_of = study("contact/order_four.py")
ORDER = 4
# Three refinements: factor on `fine` at contact edges, cell at the corners of the bodies over the
# shorter side, growth, cells across a contact. With corner cells of 1/60, errors reached 40 times
# the stated errors at a tolerance of 1e-5.
LAPS = ((2.5, 1 / 250, 0.6, 16), (1.0, 1 / 1000, 0.5, 24), (0.4, 1 / 4000, 0.4, 36))
FIRST = (1.0, 1 / 60, 0.6, 16)


@dataclass(frozen=True)
class PieceInterface:
    """Body with lengths [m]; layers: (Young's modulus [Pa], Poisson's ratio) of coating and substrate."""

    length: float
    height: float
    thickness: float
    layers: tuple


@dataclass(frozen=True)
class Scene:
    """Patch under a load [N] at a prescribed tilt [rad].

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

    The size of the cells grows by `growth` per distance, up to `most`.
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

    They are per unit width, at the nodes of the cells of `inner`; nt is the normal displacement due
    to shear.
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
        cells, local = cells_of.condense_interior(
            cells_of.cell_stiffness(ORDER, ratio, young, nu), ORDER
        )
        node = place[
            iy[:, None] * ORDER + local // (ORDER + 1), ix[:, None] * ORDER + local % (ORDER + 1)
        ]
        # Nodes of the face; all tangential displacements are numbered before the normal ones.
        last = node >= count - m
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


def contact(compliance, gap, load: float, active=None) -> tuple:
    """Solve the contact by an active-set method that starts from `active`.

    Parameters
    ----------
    compliance : (m, m) array
        Normal compliance [m/N].
    gap : (m,) array
        Of the unloaded faces [m].
    load : float
        Sum of the nodal forces.
    active : (m,) array of bool, optional
        By default the smallest three tenths of the gaps.

    Returns
    -------
    tuple
        Nodal forces (m,) >= 0, the approach, and the nodes in contact. The gaps under load are >= 0, and zero where
        the force is not.
    """
    if active is None:
        active = gap <= np.quantile(gap, 0.3)
    for _ in range(400):
        index = np.flatnonzero(active)
        columns = np.stack([np.ones(index.size), gap[index]], axis=1)
        rows = np.linalg.solve(compliance[np.ix_(index, index)], columns)
        approach = (load + rows[:, 1].sum()) / rows[:, 0].sum()
        force = np.zeros(gap.size)
        force[index] = approach * rows[:, 0] - rows[:, 1]
        bent = compliance @ force
        leaves = active & (force < 0)
        enters = ~active & (bent + gap - approach < -1e-13 * np.abs(bent).max())
        if not leaves.any() and not enters.any():
            return force, approach, active
        active = active & ~leaves if leaves.any() else active | enters
    raise RuntimeError("no contact found")


def unloaded_gap(scene: Scene, place) -> np.ndarray:
    """Return the gap (m,) [m] of the unloaded faces; the edge of a step belongs to the side in contact."""
    gap = place**2 / 2 * scene.curvature + scene.tilt * place
    if scene.step:
        height, at = scene.step
        gap = gap + height * (place > at + 1e-15 if height > 0 else place > at - 1e-15)
    return gap


class Pressed(NamedTuple):
    """Pressed patch: compliances (m, m) [m2/N] per unit width, positions and weights (m,) [m], and the contact.

    - normal, tangential, cross: sums of both pieces; cross is the normal motion by shear
    - force: nodal forces (m,) per unit width [N/m]
    - edges: (from, to, free) of every stretch in contact
    """

    normal: np.ndarray
    tangential: np.ndarray
    cross: np.ndarray
    place: np.ndarray
    weight: np.ndarray
    force: np.ndarray
    approach: float
    edges: list


def press(scene: Scene, edges, fine: float, lap: tuple = FIRST) -> Pressed:
    """Press a scene on columns that are graded to `edges`.

    Parameters
    ----------
    scene : Scene
    edges : list
        Contact edges.
    fine : float
        Cell at an edge / shortest stretch.
    lap : tuple
        One of LAPS.
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
    if scene.skin:
        nn = nn + np.diag(1 / (scene.skin * weight))
    f, d, active = contact(nn, unloaded_gap(scene, place), scene.load / scene.width)
    pressure = f / weight
    change = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(int), [0]])))
    found = []
    for a, b in zip(change[::2], change[1::2] - 1):
        ends = [edge_of(place, pressure, a, -1, scene), edge_of(place, pressure, b, 1, scene)]
        if ends[1] - ends[0] > 1e-6 * scene.length or active.sum() < 9:
            found.append(
                (ends[0], max(ends[1], ends[0] + 1e-7 * scene.length), (a > 0, b < place.size - 1))
            )
    return Pressed(nn, low[1] + high[1], low[2] - high[2], place, weight, f, d, found)


def find_edges(scene: Scene, start=()) -> list:
    """Find the contact edges on two coarse grids."""
    edges = list(start)
    for size in (0.03, 0.01):
        edges = press(scene, edges, size).edges
    return edges


def measures(scene: Scene, pressed: Pressed) -> dict:
    """Return the measures of a pressed patch by name."""
    place = pressed.place
    force = pressed.force
    pressure = force / pressed.weight
    index = np.flatnonzero(force > 0)
    own = np.linalg.inv(pressed.normal[np.ix_(index, index)])
    xs = place[index]
    cross = pressed.cross[np.ix_(index, index)]
    soft = pressed.tangential[np.ix_(index, index)]
    if scene.upper != scene.lower:
        soft = soft - cross.T @ own @ cross
    width = scene.width
    stretches = pressed.edges
    return {
        "normal_load": scene.load,
        "approach": pressed.approach,
        "moment": force @ place * width,
        "contact_fraction": sum(b - a for a, b, _ in stretches) / scene.length,
        "contact_half_width": (stretches[-1][1] - stretches[0][0]) / 2,
        # A polynomial cannot follow a jump of the pressure.
        "pressure_peak": float(pressure.max()) if scene.step else peak(place, pressure),
        "pressure_centre": force @ place * width / scene.load,
        "normal_stiffness": own.sum() * width,
        "tangential_stiffness": np.linalg.solve(soft, np.ones(index.size)).sum() * width,
        "rotational_stiffness": xs @ own @ xs * width,
    }


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

    At the end of the patch or at a step it is this position itself.
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

    The uncertainty is the larger of the last change and a third of the previous change.
    """
    edges = find_edges(scene, start)
    found = []
    for lap in LAPS:
        pressed = press(scene, edges, fine, lap)
        edges = pressed.edges
        found.append(measures(scene, pressed))
    first, second, last = found
    return last, {
        name: max(abs(value - second[name]), abs(second[name] - first[name]) / 3)
        for name, value in last.items()
    }
