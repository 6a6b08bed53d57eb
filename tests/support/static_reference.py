"""Independent solver of static patches, which uses nothing of the package.

The elements are those of order 4 of studies/contact/order_four.py, on separate grids; contact is
solved by a simple active-set method. `solve_scene(scene)` grades its columns to the contact edges that
it finds, and returns the measures by name, for bodies of different materials with the coupled
tangential stiffness. Bodies are rectangles, of which the longer one overhangs; gaps are tilt, crown
and step.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from patch_of_order_four import ORDER, Level, Piece, condense, order_four

# Three refinements: factor on `fine` at contact edges, cell at the corners of the bodies over the
# shorter side, growth, cells across a contact. With corner cells of 1/60, errors reached 40 times
# the stated errors at a tolerance of 1e-5.
LAPS = ((2.5, 1 / 250, 0.6, 16), (1.0, 1 / 1000, 0.5, 24), (0.4, 1 / 4000, 0.4, 36))
FIRST = (1.0, 1 / 60, 0.6, 16)


@dataclass(frozen=True)
class BodySection:
    """Body with lengths [m]; layers: (Young's modulus [Pa], Poisson's ratio) of coating and substrate."""

    length: float
    height: float
    thickness: float
    layers: tuple


@dataclass(frozen=True)
class PatchScene:
    """Patch under a load [N] at a prescribed tilt [rad].

    curvature: of a crown [1/m]; step: (height, position) [m] or None; skin: stiffness of the
    asperities [Pa/m] or None.
    """

    length: float
    width: float
    plane: str
    lower: BodySection
    upper: BodySection
    load: float
    tilt: float = 0.0
    curvature: float = 0.0
    step: tuple | None = None
    skin: float | None = None


def grade_points(
    points, sizes, begin: float, end: float, growth: float, max_size: float
) -> np.ndarray:
    """Return break points from begin to end with cells of sizes[k] at points[k].

    The size of the cells grows by `growth` per distance, up to `max_size`.
    """
    points = np.asarray(points, float)
    sizes = np.asarray(sizes, float)
    fixed_points = np.unique(
        np.concatenate([[begin, end], points[(points > begin) & (points < end)]])
    )
    fixed_points = fixed_points[
        np.concatenate([[True], np.diff(fixed_points)[:-1] > sizes.min() / 4, [True]])
    ]
    out = [begin]
    for low, high in pairwise(fixed_points):
        fine = (high - low) * np.concatenate([[0.0], np.geomspace(1e-8, 0.5, 1000)])
        samples = np.concatenate([low + fine, high - fine[-2::-1]])
        size = np.minimum(
            (sizes + growth * np.abs(samples[:, None] - points)).min(axis=1), max_size
        )
        count = np.concatenate(
            [[0.0], np.cumsum(np.diff(samples) * (1 / size[1:] + 1 / size[:-1]) / 2)]
        )
        cells = max(2, int(np.ceil(count[-1])))
        out += list(np.interp(np.arange(1, cells + 1) * count[-1] / cells, count, samples))
        out[-1] = high
    return np.array(out)


def condense_face(body: BodySection, plane: str, inner, growth: float, corner: float) -> np.ndarray:
    """Return compliances (3, m, m) [m2/N], nn, tt and nt, of the common part of the face.

    They are per unit width, at the nodes of the cells of `inner`; nt is the normal displacement due
    to shear.
    """
    x = inner
    extra = 0
    if body.length > inner[-1] - inner[0] + 1e-12:
        overhang = grade_points(
            [inner[-1]],
            [inner[-1] - inner[-2]],
            inner[-1],
            body.length / 2,
            growth,
            body.length / 8,
        )
        x = np.concatenate([-overhang[:0:-1], inner, overhang[1:]])
        extra = overhang.size - 1
    piece = Piece(body.length, body.height, body.thickness, *body.layers, "", 0.0)
    level = Level(0.0, corner / min(body.height, body.length), growth, 0, 0)
    face = slice(extra, extra + inner.size)
    return condense(x, piece, plane, float(np.diff(inner).min()), level, face)


def solve_contact(compliance, gap, load: float, active=None) -> tuple:
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
        displacement = compliance @ force
        leaves = active & (force < 0)
        enters = ~active & (displacement + gap - approach < -1e-13 * np.abs(displacement).max())
        if not leaves.any() and not enters.any():
            return force, approach, active
        active = active & ~leaves if leaves.any() else active | enters
    raise RuntimeError("no contact found")


def unloaded_gap(scene: PatchScene, place) -> np.ndarray:
    """Return the gap (m,) [m] of the unloaded faces; the edge of a step belongs to the side in contact."""
    gap = place**2 / 2 * scene.curvature + scene.tilt * place
    if scene.step:
        height, position = scene.step
        gap = gap + height * (place > position + 1e-15 if height > 0 else place > position - 1e-15)
    return gap


class PressedPatch(NamedTuple):
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


def press_scene(scene: PatchScene, edges, fine: float, lap: tuple = FIRST) -> PressedPatch:
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
    half, (edge_factor, corner, growth, cells_inside) = scene.length / 2, lap
    fine *= edge_factor
    shortest = min((b - a for a, b, _ in edges), default=scene.length)
    corner *= min(scene.lower.height, scene.length)
    points = [-half, half]
    sizes = [min(corner, shortest / 30)] * 2
    if scene.lower.length != scene.upper.length:
        sizes = [shortest * fine] * 2
    for a, b, _ in edges:
        points = [*points, a, b, (a + b) / 2]
        sizes = [*sizes, shortest * fine, shortest * fine, (b - a) / cells_inside]
    if scene.step:
        points = [*points, scene.step[1]]
        sizes = [*sizes, shortest * fine]
    x = grade_points(points, sizes, -half, half, growth, scene.length / 10)
    place, weight = order_four.face_nodes(x, ORDER)
    bodies = [scene.lower] + [scene.upper] * (scene.upper != scene.lower)
    parts = [condense_face(one, scene.plane, x, growth, corner) for one in bodies]
    lower = parts[0]
    upper = parts[-1]
    nn = lower[0] + upper[0]
    if scene.skin:
        nn = nn + np.diag(1 / (scene.skin * weight))
    f, d, active = solve_contact(nn, unloaded_gap(scene, place), scene.load / scene.width)
    pressure = f / weight
    change = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(int), [0]])))
    edges_found = []
    for a, b in zip(change[::2], change[1::2] - 1):
        ends = [
            locate_edge(place, pressure, a, -1, scene),
            locate_edge(place, pressure, b, 1, scene),
        ]
        if ends[1] - ends[0] > 1e-6 * scene.length or active.sum() < 9:
            edges_found.append(
                (ends[0], max(ends[1], ends[0] + 1e-7 * scene.length), (a > 0, b < place.size - 1))
            )
    return PressedPatch(
        nn, lower[1] + upper[1], lower[2] - upper[2], place, weight, f, d, edges_found
    )


def find_edges(scene: PatchScene, start=()) -> list:
    """Find the contact edges on two coarse grids."""
    edges = list(start)
    for size in (0.03, 0.01):
        edges = press_scene(scene, edges, size).edges
    return edges


def compute_measures(scene: PatchScene, pressed: PressedPatch) -> dict:
    """Return the measures of a pressed patch by name."""
    place = pressed.place
    force = pressed.force
    pressure = force / pressed.weight
    index = np.flatnonzero(force > 0)
    stiffness = np.linalg.inv(pressed.normal[np.ix_(index, index)])
    x = place[index]
    cross = pressed.cross[np.ix_(index, index)]
    compliance = pressed.tangential[np.ix_(index, index)]
    if scene.upper != scene.lower:
        compliance = compliance - cross.T @ stiffness @ cross
    width = scene.width
    stretches = pressed.edges
    return {
        "normal_load": scene.load,
        "approach": pressed.approach,
        "moment": force @ place * width,
        "contact_fraction": sum(b - a for a, b, _ in stretches) / scene.length,
        "contact_half_width": (stretches[-1][1] - stretches[0][0]) / 2,
        # A polynomial cannot follow a jump of the pressure.
        "pressure_peak": float(pressure.max()) if scene.step else interpolate_peak(place, pressure),
        "pressure_centre": force @ place * width / scene.load,
        "normal_stiffness": stiffness.sum() * width,
        "tangential_stiffness": np.linalg.solve(compliance, np.ones(index.size)).sum() * width,
        "rotational_stiffness": x @ stiffness @ x * width,
    }


def interpolate_peak(x, pressure) -> float:
    """Return the maximum of the polynomial through the five nodes around the largest pressure."""
    largest = int(np.argmax(pressure))
    if not 2 <= largest < x.size - 2 or (pressure[largest - 2 : largest + 3] <= 0).any():
        return float(pressure[largest])
    positions = (x[largest - 2 : largest + 3] - x[largest]) / (x[largest + 2] - x[largest - 2])
    polynomial = np.polynomial.Polynomial.fit(positions, pressure[largest - 2 : largest + 3], 4)
    return float(polynomial(np.linspace(positions[1], positions[3], 201)).max())


def locate_edge(x, pressure, node: int, side: int, scene: PatchScene) -> float:
    """Return the position at which the square of the pressure vanishes after the last node.

    At the end of the patch or at a step it is this position itself.
    """
    if node in (0, x.size - 1):
        return float(x[node])
    if scene.step and abs(x[node] - scene.step[1]) <= abs(x[node] - x[node - side]):
        return float(scene.step[1])
    offsets = np.arange(1, 9)
    nodes = node - side * offsets
    nodes = nodes[(nodes >= 0) & (nodes < x.size)]
    nodes = nodes[pressure[nodes] > 0]
    if scene.skin or nodes.size < 4:
        return float(x[node] + (x[node + side] - x[node]) / 2)
    polynomial = np.polyfit(x[nodes] - x[node], pressure[nodes] ** 2, 2 if nodes.size > 5 else 1)
    roots = np.roots(polynomial)
    roots = roots[np.abs(roots.imag) < 1e-12].real
    max_distance = 4 * abs(x[node + side] - x[node])
    roots = roots[np.abs(roots) < max_distance]
    return float(
        x[node]
        + (roots[np.argmin(np.abs(roots))] if roots.size else (x[node + side] - x[node]) / 2)
    )


def solve_scene(scene: PatchScene, fine: float = 5e-4, start=()) -> tuple:
    """Return values and their uncertainties by name, from the last of LAPS.

    The uncertainty is the larger of the last change and a third of the previous change.
    """
    edges = find_edges(scene, start)
    results = []
    for lap in LAPS:
        pressed = press_scene(scene, edges, fine, lap)
        edges = pressed.edges
        results.append(compute_measures(scene, pressed))
    first, second, last = results
    return last, {
        name: max(abs(value - second[name]), abs(second[name] - first[name]) / 3)
        for name, value in last.items()
    }
