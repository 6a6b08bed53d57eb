"""Independent program for static patches of rectangular pieces, which uses nothing of the package.

Rectangular elements of order 4 with Gauss-Lobatto nodes, on columns that are graded towards the edges of the contact,
its ends and steps. SuperLU eliminates the inside with the face last. Nodal forces meet the gap at the nodes of the face,
by a primal-dual interior-point method; a rough layer of constant stiffness adds to the compliance. The changes between
three levels of grading are the uncertainties. Measures have the names of the package.

The program of version 1.9 also knows rounded ends, strips, holders, other layers and measured traces.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

ORDER = 4


class Level(NamedTuple):
    """Grading of a mesh.

    - edge: column at a contact edge over the length of the shortest interval in contact
    - corner: column and row at a corner over the smaller of height and length
    - growth: growth of columns and rows with the distance
    - n_inside: smallest number of columns along an interval in contact
    - n_columns: smallest number of columns along half the interface
    """

    edge: float
    corner: float
    growth: float
    n_inside: int
    n_columns: int


SEARCHES = (Level(0.03, 1 / 60, 0.7, 8, 8), Level(0.01, 1 / 60, 0.7, 8, 8))
LEVELS = (
    Level(6e-4, 1 / 100, 0.9, 10, 6),
    Level(2e-4, 1 / 300, 0.75, 14, 9),
    Level(8e-5, 1 / 900, 0.6, 20, 12),
)
N_SEARCHES = 8
MAX_COLUMNS = 400
# Largest distance from the end of an interval, over its length, from which its edge is extrapolated
EDGE_WINDOW = 0.06


class Piece(NamedTuple):
    """Rectangular piece with lengths [m] and materials (Young's modulus [Pa], Poisson's ratio)."""

    length: float
    height: float
    thickness: float
    coating: tuple
    substrate: tuple


class Scene(NamedTuple):
    """Patch in SI units: pieces, gap of unloaded faces (function of x), marks along x, stiffness of the layer [Pa/m]."""

    pieces: list
    plane: str
    half: float
    width: float
    load: float
    gap: object
    marks: list
    step: float | None
    tilt: float
    layer: float


class Pressed(NamedTuple):
    """Pressed patch on one mesh: columns x, areas and forces (m,), compliances (m, m), softness (m,), contact."""

    x: np.ndarray
    area: np.ndarray
    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray
    soft: np.ndarray
    force: np.ndarray
    approach: float
    active: np.ndarray
    intervals: list


def number(text) -> float:
    """Return the number of a quantity in SI units."""
    return float(str(text).split(" ")[0])


def read_material(table: dict) -> tuple[float, float]:
    """Return Young's modulus and Poisson's ratio."""
    return number(table["young"]), table["poisson"]


def read_scene(contact: dict) -> Scene:
    """Return the scene of a table [contact]."""
    pieces = []
    for side in ("lower", "upper"):
        own = contact.get(side, {})
        coating = own.get("coating", contact.get("coating", "none"))
        has_coating = coating != "none"
        substrate = read_material(own.get("substrate", contact["substrate"]))
        pieces.append(
            Piece(
                number(own.get("length", contact["length"])),
                number(own.get("height", contact["height"])),
                number(coating["thickness"]) if has_coating else 0.0,
                read_material(coating["material"]) if has_coating else substrate,
                substrate,
            )
        )
    half = min(piece.length for piece in pieces) / 2
    tilt = number(contact.get("tilt", {}).get("angle", 0))
    curvature = 1 / number(contact["crown"]["radius"]) if "crown" in contact else 0.0
    step = contact.get("step")
    at = number(step["at"]) if step else None

    def gap(x):
        """Return the gap (m,) [m] of the unloaded faces."""
        out = tilt * x + x**2 / 2 * curvature
        return out + number(step["height"]) * np.heaviside(x - at, 0.5) if step else out

    return Scene(
        pieces,
        contact.get("plane", "strain"),
        half,
        number(contact["width"]),
        number(contact["load"]),
        gap,
        [-half, half, *([at] if step else [])],
        at,
        tilt,
        number(contact["asperities"]["normal_stiffness"]) if "asperities" in contact else np.inf,
    )


def grade(low, high, marks, sizes, growth, largest, bands=()) -> np.ndarray:
    """Return columns between two ends whose lengths grow smoothly with the distance from marks.

    A column ends at each mark; between two marks the columns are equal steps of the integral of 1/length. Columns within
    a band (from, to, length) are not longer than its length.
    """
    marks = np.asarray(marks)
    fixed = np.unique([low, *marks[(marks > low) & (marks < high)], high])
    fixed = fixed[np.append(True, np.diff(fixed) > 1e-12 * (high - low))]
    x = [np.array([low])]
    for begin, end in pairwise(fixed):
        near = (end - begin) / 2 * np.append(0.0, np.geomspace(1e-9, 1.0, 1500))
        s = np.concatenate([begin + near, (end - near)[-2::-1]])
        length = (sizes + growth * np.abs(s[:, None] - marks)).min(axis=1)
        for start, stop, size in bands:
            distance = np.maximum(0.0, np.maximum(start - s, s - stop))
            length = np.minimum(length, size + growth * distance)
        rate = 1 / np.minimum(largest, length)
        integral = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(s)))
        steps = max(2, int(np.ceil(integral[-1])))
        x.append(np.interp(np.arange(1, steps) / steps * integral[-1], integral, s))
        x.append(np.array([end]))
    return np.concatenate(x)


def lobatto() -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss-Lobatto points and weights on [-1, 1].

    The points are the ends and the zeros of P'_order; w = 2/(p (p + 1) P_p^2).
    """
    legendre_p = legendre.Legendre.basis(ORDER)
    points = np.concatenate([[-1.0], np.sort(legendre_p.deriv().roots().real), [1.0]])
    return points, 2 / (ORDER * (ORDER + 1) * legendre_p(points) ** 2)


def condense_interior(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Condense cells to the nodes on their edges; return the stiffness and the numbers of these nodes (of 25)."""
    row, column = np.divmod(np.arange((ORDER + 1) ** 2), ORDER + 1)
    inside = (row % ORDER != 0) & (column % ORDER != 0)
    keep = np.flatnonzero(~np.tile(inside, 2))
    drop = np.flatnonzero(np.tile(inside, 2))
    out = cells[:, keep[:, None], keep]
    mixed = cells[:, drop[:, None], keep]
    out = out - mixed.transpose(0, 2, 1) @ np.linalg.solve(cells[:, drop[:, None], drop], mixed)
    return out, np.flatnonzero(~inside)


def _dissection(x0: int, x1: int, y0: int, y1: int, into: list[tuple[int, int, int, int]]) -> None:
    """Order the nodes strictly inside a box of cells by nested dissection.

    Separators follow the two halves that they separate.
    """
    if (x1 - x0 <= 1 and y1 - y0 <= 1) or x1 - x0 < 1 or y1 - y0 < 1:
        return
    if x1 - x0 >= y1 - y0:
        middle = (x0 + x1) // 2
        _dissection(x0, middle, y0, y1, into)
        _dissection(middle, x1, y0, y1, into)
        into.append((middle * ORDER, middle * ORDER + 1, y0 * ORDER + 1, y1 * ORDER))
    else:
        middle = (y0 + y1) // 2
        _dissection(x0, x1, y0, middle, into)
        _dissection(x0, x1, middle, y1, into)
        into.append((x0 * ORDER + 1, x1 * ORDER, middle * ORDER, middle * ORDER + 1))


def numbering(nx: int, ny: int) -> tuple[np.ndarray, int]:
    """Return the elimination index of every node, -1 for fixed or condensed nodes, and the number of indices.

    Nested dissection inside, then the free sides, the face y = 0 (row 0) last; the far row is held.

    Parameters
    ----------
    nx, ny : int
        Cells along and across.
    """
    place = np.full((ny * ORDER + 1, nx * ORDER + 1), -1)
    boxes: list[tuple[int, int, int, int]] = []
    _dissection(0, nx, 0, ny, boxes)
    boxes += [
        (0, 1, 1, ny * ORDER),
        (nx * ORDER, nx * ORDER + 1, 1, ny * ORDER),
        (0, nx * ORDER + 1, 0, 1),
    ]
    count = 0
    for x0, x1, y0, y1 in boxes:
        size = (y1 - y0) * (x1 - x0)
        place[y0:y1, x0:x1] = count + np.arange(size).reshape(y1 - y0, x1 - x0)
        count += size
    return place, count


def face_nodes(xs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the face and their lumped Gauss-Lobatto weights [m]."""
    points, weights = lobatto()
    h = np.diff(xs)
    x = (0.5 * (xs[:-1] + xs[1:])[:, None] + 0.5 * h[:, None] * points)[:, :-1].ravel()
    weight = np.zeros(len(h) * ORDER + 1)
    for k in range(ORDER + 1):
        weight[k : k + len(h) * ORDER : ORDER][: len(h)] += 0.5 * h * weights[k]
    return np.append(x, xs[-1]), weight


def cell_stiffness(widths, heights, lame, shear) -> np.ndarray:
    """Return the stiffness (cells, 50, 50) of rectangular cells of order 4; u_x first, then u_y, each by rows.

    Parameters
    ----------
    widths, heights : (cells,) ndarray
        Lengths of the sides [m].
    lame, shear : (cells,) ndarray
        Lame's constants [Pa].
    """
    points, _ = lobatto()
    gauss, weight = legendre.leggauss(ORDER + 1)
    coefficients = np.linalg.inv(legendre.legvander(points, ORDER))
    value = legendre.legvander(gauss, ORDER) @ coefficients
    slope = np.stack([legendre.legval(gauss, legendre.legder(c)) for c in coefficients.T], axis=1)

    # Integrals of products of shape functions and of their slopes along a side of length 2
    mass, mixed, stiff = (
        one.T * weight @ other for one, other in ((value, value), (slope, value), (slope, slope))
    )
    ratio = (heights / widths)[:, None, None]
    xx, yy, xy = np.kron(mass, stiff) * ratio, np.kron(stiff, mass) / ratio, np.kron(mixed.T, mixed)
    lame, shear = lame[:, None, None], shear[:, None, None]
    cells = np.empty((ratio.size, 50, 50))
    cells[:, :25, :25] = (lame + 2 * shear) * xx + shear * yy
    cells[:, 25:, 25:] = (lame + 2 * shear) * yy + shear * xx
    cells[:, :25, 25:] = lame * xy + shear * xy.T
    cells[:, 25:, :25] = cells[:, :25, 25:].transpose(0, 2, 1)
    return cells


def condense(x, piece: Piece, plane: str, row: float, level: Level, face: slice) -> np.ndarray:
    """Return the compliances (3, m, m) [m2/N]: nn, tt, nt of the nodes of a part of the face, per unit width.

    x: all columns [m]; row: length of the first row [m]; face: columns of the part.
    """
    corner = level.corner * min(piece.height, piece.length)
    marks, sizes = [0.0, piece.height], [row, corner]
    if piece.thickness:
        marks = [*marks, piece.thickness]
        sizes = [*sizes, max(row, min(piece.thickness / 4, corner))]
    largest = min(piece.height, piece.length) / 4
    y = grade(0.0, piece.height, marks, np.array(sizes), level.growth, largest)
    n_x, n_y = x.size - 1, y.size - 1

    is_coating = np.repeat((y[1:] + y[:-1]) / 2 < piece.thickness, n_x)
    young, poisson = np.where(
        is_coating, np.array(piece.coating)[:, None], np.array(piece.substrate)[:, None]
    )
    shear = young / 2 / (1 + poisson)
    lame = 2 * shear * poisson / (1 - 2 * poisson)
    if plane == "stress":
        lame = 2 * lame * shear / (lame + 2 * shear)
    whole = cell_stiffness(np.tile(np.diff(x), n_y), np.repeat(np.diff(y), n_x), lame, shear)
    cells, local = condense_interior(whole)

    # Nodes of the face are last; all their tangential displacements precede the normal ones.
    numbers, count = numbering(n_x, n_y)
    rows = np.arange(n_y)[:, None] * ORDER + np.arange(ORDER + 1)
    columns = np.arange(n_x)[:, None] * ORDER + np.arange(ORDER + 1)
    numbers = numbers[rows[:, None, :, None], columns[None, :, None, :]].reshape(-1, 25)[:, local]
    m = n_x * ORDER + 1
    last = numbers >= count - m
    along_x = np.where(last, numbers + count - m, 2 * numbers)
    along_y = np.where(last, numbers + count, 2 * numbers + 1)
    dof = np.where(np.tile(numbers, 2) < 0, -1, np.concatenate([along_x, along_y], axis=1))
    row_of, column_of = np.broadcast_arrays(dof[:, :, None], dof[:, None, :])
    free = (row_of >= 0) & (column_of >= 0)
    K = sparse.csc_array(
        (cells[free], (row_of[free], column_of[free])), shape=(2 * count, 2 * count)
    )
    factor = splu(K, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    stiff = factor.L[-2 * m :, -2 * m :].toarray() @ factor.U[-2 * m :, -2 * m :].toarray()
    c = cho_solve(cho_factor((stiff + stiff.T) / 2), np.eye(2 * m))
    part = slice(face.start * ORDER, (face.stop - 1) * ORDER + 1)
    return np.stack([c[m:, m:], c[:m, :m], c[m:, :m]])[:, part, part]


def press_bare(C, gap, load: float) -> tuple:
    """Minimise f C f / 2 + gap f for f >= 0 with sum f = load, by an interior-point method.

    C: (m, m) compliance; gap (m,). Returns forces (m,), the approach beyond the smallest gap, and the nodes in contact.
    """
    scale = load * np.abs(C).max()
    C, gap = C * load / scale, (gap - gap.min()) / scale
    n = gap.size
    f, w, q = np.full(n, 1 / n), np.ones(n), 0.0
    for _ in range(150):
        mu = f @ w / n
        dual = C @ f + gap - q - w
        primal = f.sum() - 1
        if mu < 1e-15 and abs(dual).max() < 1e-12 and abs(primal) < 1e-12:
            break

        def step(centre, f=f, w=w, dual=dual, primal=primal):
            """Return the Newton step towards complementarity products `centre`."""
            product = f * w - centre
            right = np.stack([-dual - product / f, np.ones(n)], axis=1)
            own, by_motion = np.linalg.solve(C + np.diag(w / f), right).T
            dq = (-primal - own.sum()) / by_motion.sum()
            df = own + by_motion * dq
            return df, -(product + w * df) / f, dq

        def largest(value, change):
            """Return the largest step that keeps values positive."""
            ratio = np.where(change < 0, -value / np.where(change < 0, change, 1.0), np.inf)
            return min(1.0, 0.9995 * ratio.min())

        df, dw, _ = step(0.0)
        after = (f + largest(f, df) * df) @ (w + largest(w, dw) * dw) / n
        df, dw, dq = step((after / mu) ** 3 * mu - df * dw)
        a = min(largest(f, df), largest(w, dw))
        f, w, q = f + a * df, w + a * dw, q + a * dq
    return f * load, q * scale, f > w


def condense_pieces(scene: Scene, parts: list, level: Level) -> tuple:
    """Return nodes and weights (m,) [m] of the face, and the compliances (3, m, m) [m/N] of both pieces.

    The columns are graded towards the edges of given intervals in contact.
    """
    half = scene.half
    contact = min((high - low for low, high in parts), default=2 * half)
    edges = sorted({end for part in parts for end in part if abs(end) < half * (1 - 1e-9)})
    bands = [(low, high, (high - low) / level.n_inside) for low, high in parts]
    size = max(level.edge * contact, 1e-8 * half)
    shorter = min([2 * half, *(piece.height for piece in scene.pieces)])
    # The pressure is unbounded at an end that presses on a longer piece.
    is_singular = max(piece.length for piece in scene.pieces) / 2 > half * (1 + 1e-9)
    corner = size if is_singular else min(level.corner * shorter, contact / 30)
    sizes = np.array([corner] * 2 + [size] * (len(scene.marks) - 2) + [size] * len(edges))
    marks = [*scene.marks, *edges]
    x = grade(-half, half, marks, sizes, level.growth, half / level.n_columns, bands)
    if x.size > MAX_COLUMNS:
        raise ArithmeticError(f"{x.size} columns are too many for this program")

    lower, upper = scene.pieces
    compliances = condense_piece(lower, scene, x, level)
    # The upper piece is the mirror image of a lower one: a shear moves its face the other way.
    mirror = np.array([1, 1, -1])[:, None, None]
    of_upper = compliances if upper == lower else condense_piece(upper, scene, x, level)
    nodes, weight = face_nodes(x)
    return nodes, weight, (compliances + mirror * of_upper) / scene.width


def condense_piece(piece: Piece, scene: Scene, x, level: Level) -> np.ndarray:
    """Return the compliances (3, m, m) [m2/N] of a piece per unit width at the nodes of the columns x of the interface."""
    h = np.diff(x)
    half, stop = scene.half, piece.length / 2
    sides = []
    for cell in (h[0], h[-1]):
        part = np.zeros(0)
        if stop > half * (1 + 1e-12):
            sizes = np.array([cell, (stop - half) / 8])
            part = grade(half, stop, [half, stop], sizes, level.growth, (stop - half) / 2)[1:]
        sides.append(part)
    columns = np.concatenate([-sides[0][::-1], x, sides[1]])
    face = slice(sides[0].size, sides[0].size + x.size)
    return condense(columns, piece, scene.plane, h.min(), level, face)


def press(scene: Scene, parts: list, level: Level) -> Pressed:
    """Press a scene on columns that are graded towards the edges of given intervals in contact."""
    x, weight, compliances = condense_pieces(scene, parts, level)
    area = weight * scene.width
    soft = 1 / (scene.layer * area)
    gap = scene.gap(x)
    force, approach, active = press_bare(compliances[0] + np.diag(soft), gap, scene.load)
    intervals = find_intervals(scene, x, force / area, join_neighbours(active))
    return Pressed(x, area, *compliances, soft, force, approach + gap.min(), active, intervals)


def join_neighbours(active) -> np.ndarray:
    """Close openings of up to two nodes, which are ripples of the pressure where it vanishes, and drop such islands."""
    out = active.copy()
    for value in (True, False):
        change = np.flatnonzero(np.diff(np.concatenate([[True], out == value, [True]])))
        for begin, end in change.reshape(-1, 2):
            if 0 < begin and end < out.size and end - begin <= 2 and out.sum() > 6:
                out[begin:end] = value
    return out


def find_intervals(scene: Scene, x, pressure, active) -> list:
    """Return the intervals (from, to) [m] in contact."""
    ends = []
    padded = np.concatenate([[False], active, [False]])
    for k in np.flatnonzero(padded[1:] != padded[:-1]):
        node, side = (k, -1) if padded[k + 1] else (k - 1, 1)
        outside = node + side
        if not 0 <= outside < x.size:
            ends.append(float(x[node]))
            continue
        cell = x[outside] - x[node]
        if scene.step is not None and min(abs(x[[node, outside]] - scene.step)) < abs(cell):
            place = scene.step
        else:
            middle = x[node] + cell / 2
            place = extrapolate_edge(scene, x, pressure * active, (node, side)) or middle
        ends.append(float(place))
    return np.reshape(ends, (-1, 2)).tolist()


def extrapolate_edge(scene: Scene, x, pressure, end: tuple) -> float | None:
    """Return the place [m] at which a power of the pressure vanishes beyond a contact, None if it is unknown.

    The square of the pressure of bare pieces vanishes linearly, and so does the pressure of a layer. A cubic polynomial is
    fitted near the end (last node, side) of the interval, without its outermost nodes, whose pressures are least exact. The
    fit ends at a kink of the gap and is shorter than the coating is thick, because the pressure changes its form there.
    """
    node, side = end
    open_nodes = np.flatnonzero(pressure <= 0)
    before = open_nodes[(open_nodes - node) * side < 0]
    other = before.max(initial=-1) + 1 if side > 0 else before.min(initial=x.size) - 1
    depth = (x[node] - x) * side
    kinks = [(x[node] - mark) * side for mark in scene.marks]
    coatings = [piece.thickness for piece in scene.pieces if piece.thickness]
    window = min([EDGE_WINDOW * depth[other], *coatings, *(kink for kink in kinks if kink > 0)])
    near = (depth > window / 15) & (depth < window) & (pressure > 0)
    near[np.clip(node - side * np.arange(ORDER), 0, x.size - 1)] = False
    if near.sum() < 6:
        return None
    power = 1 if np.isfinite(scene.layer) else 2
    curve = np.polyfit(depth[near] / window, (pressure[near] / pressure.max()) ** power, 3)
    roots = np.roots(curve)
    roots = roots[np.abs(roots.imag) < 1e-9].real
    if not roots.size or np.abs(roots).min() > 1.0:
        return None
    return float(x[node] - side * window * roots[np.argmin(np.abs(roots))])


def find_stiffnesses(pressed: Pressed, nodes) -> np.ndarray:
    """Return the normal [N/m], tangential [N/m] and rotational stiffness [N m/rad] of a set of nodes."""
    index = np.flatnonzero(nodes)
    inside = np.ix_(index, index)
    x = pressed.x[index]
    nn = pressed.nn[inside] + np.diag(pressed.soft[index])
    nt = pressed.nt[inside]
    rates = np.linalg.solve(nn, np.stack([np.ones(index.size), x, *nt.T], axis=1))
    shear = np.linalg.solve(pressed.tt[inside] - nt.T @ rates[:, 2:], np.ones(index.size))
    return np.array([rates[:, 0].sum(), shear.sum(), x @ rates[:, 1]])


def interpolate_stiffnesses(pressed: Pressed) -> np.ndarray:
    """Return the stiffnesses for edges between the nodes."""
    x = pressed.x

    # The set of the nodes between the edges, and the set with one more node at each edge
    inner = np.zeros(x.size, bool)
    fractions = []
    for low, high in pressed.intervals:
        first, last = np.searchsorted(x, [low - 1e-12, high + 1e-12]) - [0, 1]
        inner[first : last + 1] = True
        if first > 0:
            fractions.append((x[first] - low) / (x[first] - x[first - 1]))
        if last < x.size - 1:
            fractions.append((high - x[last]) / (x[last + 1] - x[last]))
    outer = inner.copy()
    outer[1:] |= inner[:-1]
    outer[:-1] |= inner[1:]
    fraction = np.mean(fractions) if fractions else 0.0
    values = [find_stiffnesses(pressed, nodes) for nodes in (inner, outer)]
    return (1 - fraction) * values[0] + fraction * values[1]


def find_measures(scene: Scene, pressed: Pressed) -> dict:
    """Return the measures of a pressed patch by name."""
    normal, shear, turn = interpolate_stiffnesses(pressed)
    moment = pressed.force @ pressed.x
    out = {
        "contact_fraction": sum(high - low for low, high in pressed.intervals) / 2 / scene.half,
        "contact_half_width": np.ptp(pressed.intervals) / 2,
        "pressure_peak": interpolate_peak(scene, pressed),
        "approach": pressed.approach,
        "rotation": scene.tilt,
        "moment": moment,
        "pressure_centre": moment / scene.load,
        "normal_stiffness": normal,
        "tangential_stiffness": shear,
        "rotational_stiffness": turn,
    }
    return {name: float(value) for name, value in out.items()}


def interpolate_peak(scene: Scene, pressed: Pressed) -> float:
    """Return the maximum of the pressure, of the polynomial through five nodes where it is smooth."""
    pressure = pressed.force / pressed.area
    largest = np.argmax(pressure)
    near = pressure[largest - 2 : largest + 3]
    if scene.step or not 2 <= largest < pressed.x.size - 2 or (near <= 0).any():
        return pressure.max()
    places = pressed.x[largest - 2 : largest + 3] - pressed.x[largest]
    places = places / places[4]
    curve = np.polynomial.Polynomial.fit(places, near, 4)
    return curve(np.linspace(places[1], places[3], 201)).max()


def press_levels(scene: Scene, levels=LEVELS) -> list[Pressed]:
    """Return the patch pressed on each level, whose columns are graded towards the contact edges of the mesh before."""
    parts = []
    for k in range(N_SEARCHES):
        before = parts
        parts = find_parts(press(scene, parts, SEARCHES[min(k // 2, 1)]))
        if k > 1 and len(parts) == len(before):
            change = np.abs(np.subtract(parts, before)).max()
            if change < min(high - low for low, high in parts) / 100:
                break
    found = []
    for level in levels:
        found.append(press(scene, parts, level))
        parts = find_parts(found[-1])
    return found


def solve_patch(contact: dict) -> tuple[dict, dict]:
    """Return the measures of a table [contact] and their uncertainties by name.

    The uncertainty is the larger of the change to the last level and half of the change before it.

    Parameters
    ----------
    contact : dict
        Quantities as text in SI units, such as "0.01 m".
    """
    scene = read_scene(contact)
    first, second, last = (find_measures(scene, pressed) for pressed in press_levels(scene))
    doubt = {
        name: max(abs(value - second[name]), abs(second[name] - first[name]) / 2)
        for name, value in last.items()
    }
    return last, doubt


def find_parts(pressed: Pressed) -> list:
    """Return the intervals (from, to) [m] towards whose ends the next columns are graded."""
    x = pressed.x
    cells = np.diff(x)
    out = []
    for low, high in pressed.intervals:
        k = np.clip(np.searchsorted(x, (low + high) / 2) - 1, 0, cells.size - 1)
        least = cells[k] / 2
        out.append((min(low, (low + high) / 2 - least), max(high, (low + high) / 2 + least)))
    return sorted(out)
