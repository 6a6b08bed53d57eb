"""Independent program for static patches of every family, which uses nothing of the package.

Elements of order 4 with Gauss-Lobatto nodes, mapped to the shape of the pieces, on columns
that are graded towards the edges of the contact, its ends and steps. SuperLU eliminates the inside with the face last.
Nodal forces meet the gap at the nodes of the face. Bare contact is solved by a primal-dual interior-point method, a rough
layer by Newton's method for the separations. The changes between three levels of grading are the uncertainties. Measures
have the names of the package.
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy import sparse
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
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
MAX_COLUMNS_OF_WAVES = 1 / 50  # longest column under a trace, over half the interface
# Largest distance from the end of an interval, over its length, from which its edge is extrapolated
EDGE_WINDOW = 0.06
# Pressure over the peak at which a node of a rough layer counts as loaded
MIN_LAYER_PRESSURE = 1e-13


class Piece(NamedTuple):
    """Piece with lengths [m], materials (Young's modulus [Pa], Poisson's ratio), and the shape of its ends."""

    length: float
    height: float
    thickness: float
    coating: tuple
    substrate: tuple
    end: str
    end_size: float

    @property
    def half_contact(self) -> float:
        """Half the length [m] of the face that can touch: a rounding up to a slope of 0.097."""
        flat = self.length / 2 - self.end_size
        return flat + (self.end_size * 0.097 / hypot(1, 0.097) if self.end == "end_radius" else 0.0)

    def drop(self, x) -> np.ndarray:
        """Return the depth (k,) [m] of the face: 45 degrees, or a circle that goes on along its tangent of 60 degrees."""
        beyond = np.maximum(np.abs(x) - (self.length / 2 - self.end_size), 0.0)
        if self.end != "end_radius":
            return beyond * (self.end == "chamfer")
        last = self.end_size * sqrt(3) / 2
        circle = self.end_size - np.sqrt(self.end_size**2 - np.minimum(beyond, last) ** 2)
        return circle + sqrt(3) * np.maximum(beyond - last, 0.0)


class Scene(NamedTuple):
    """Patch in SI units: pieces, gap of unloaded faces (function of x), marks along x, holder and rough layer."""

    pieces: list
    plane: str
    half: float
    width: float
    load: float
    gap: object
    marks: list
    step: float | None
    tilt: float
    moment: float | None
    spring: float
    layer: dict
    strips: tuple
    is_wavy: bool


class Pressed(NamedTuple):
    """Pressed patch on one mesh: columns x, forces (s, m), compliances, motions and edges."""

    x: np.ndarray
    weight: np.ndarray
    force: np.ndarray
    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray
    slope: np.ndarray
    motion: np.ndarray
    active: np.ndarray
    intervals: list


def number(text) -> float:
    """Return the number of a quantity in SI units."""
    return float(str(text).split(" ")[0])


def read_material(table: dict) -> tuple[float, float]:
    """Return Young's modulus and Poisson's ratio."""
    return number(table["young"]), table["poisson"]


def read_scene(contact: dict, trace_points) -> Scene:
    """Return the scene of a table [contact]."""
    pieces = []
    for side in ("lower", "upper"):
        own = contact.get(side, {})
        coating = own.get("coating", contact.get("coating", "none"))
        has_coating = coating != "none"
        substrate = read_material(own.get("substrate", contact["substrate"]))
        end = next((key for key in ("chamfer", "end_radius") if key in own), "")
        pieces.append(
            Piece(
                number(own.get("length", contact["length"])),
                number(own.get("height", contact["height"])),
                number(coating["thickness"]) if has_coating else 0.0,
                read_material(coating["material"]) if has_coating else substrate,
                substrate,
                end,
                number(own[end]) if end else 0.0,
            )
        )
    half = min(piece.half_contact for piece in pieces)
    tilt = number(contact.get("tilt", {}).get("angle", 0))
    curvature = 1 / number(contact["crown"]["radius"]) if "crown" in contact else 0.0
    step = contact.get("step")
    curve = None
    if trace_points is not None:
        curve = CubicSpline(*trace_points, bc_type="natural")
        lowest = curve(np.linspace(-half, half, 20001)).min()

    def gap(x):
        """Return the gap (m,) [m] of the unloaded faces."""
        out = tilt * x + x**2 / 2 * curvature + sum(piece.drop(x) for piece in pieces)
        if step:
            out = out + number(step["height"]) * np.heaviside(x - number(step["at"]), 0.5)
        if curve is not None:
            out = out + curve(x) - lowest
        return out

    load = number(contact["load"])
    spring = number(contact.get("holder", {}).get("rotational_stiffness", 0))
    line = contact.get("load_line")
    moment = load * number(line["offset"]) if line else (0.0 if spring else None)
    flats = [
        p.length / 2 - p.end_size for p in pieces if p.end and p.length / 2 - p.end_size < half
    ]
    marks = [-half, half, *flats, *(-flat for flat in flats)]
    at = number(step["at"]) if step else None
    strips = contact.get("strips", {"count": 1})
    return Scene(
        pieces,
        contact.get("plane", "strain"),
        half,
        number(contact["width"]),
        load,
        gap,
        marks + ([at] if step else []),
        at,
        tilt,
        moment,
        spring,
        contact.get("asperities", {}),
        (strips["count"], number(strips.get("roll", 0))),
        curve is not None,
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


def cell_stiffness(corners, lame, shear) -> np.ndarray:
    """Return the stiffness (cells, 50, 50) of cells of order 4; u_x first, then u_y.

    Parameters
    ----------
    corners : (2, cells, 5, 5) ndarray
        Places [m] of the nodes, by rows.
    lame, shear : (cells,) ndarray
        Lame's constants [Pa].
    """
    points, _ = lobatto()
    gauss, weight = legendre.leggauss(ORDER + 1)
    coefficients = np.linalg.inv(legendre.legvander(points, ORDER))
    value = legendre.legvander(gauss, ORDER) @ coefficients
    slope = np.stack([legendre.legval(gauss, legendre.legder(c)) for c in coefficients.T], axis=1)
    rates = np.stack([np.kron(value, slope), np.kron(slope, value)])
    places = corners.reshape(2, -1, 25)

    # Derivatives of the shape functions along x and y by the inverse Jacobian of each Gauss point
    jacobian = np.einsum("aqn,bcn->cqab", rates, places)
    dx = np.einsum("cqab,bqn->acqn", np.linalg.inv(jacobian), rates)
    area = np.linalg.det(jacobian) * np.outer(weight, weight).ravel()
    x, y = dx
    weighted_x, weighted_y = (d.transpose(0, 2, 1) * area[:, None, :] for d in (x, y))
    xx, yy, xy = weighted_x @ x, weighted_y @ y, weighted_x @ y
    yx = xy.transpose(0, 2, 1)
    lame, shear = lame[:, None, None], shear[:, None, None]
    cells = np.empty((xx.shape[0], 50, 50))
    cells[:, :25, :25] = (lame + 2 * shear) * xx + shear * yy
    cells[:, 25:, 25:] = (lame + 2 * shear) * yy + shear * xx
    cells[:, :25, 25:] = lame * xy + shear * yx
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

    # The coating follows the drop of the face; the substrate fades out towards the far face.
    nodes_x, _ = face_nodes(x)
    nodes_y, _ = face_nodes(y)
    fade = np.minimum(1.0, (piece.height - nodes_y) / (piece.height - piece.thickness))
    places = np.stack(np.broadcast_arrays(nodes_x, nodes_y[:, None]))
    places[1] += piece.drop(nodes_x) * fade[:, None]
    rows = np.arange(n_y)[:, None] * ORDER + np.arange(ORDER + 1)
    columns = np.arange(n_x)[:, None] * ORDER + np.arange(ORDER + 1)
    of_cells = places[:, rows[:, None, :, None], columns[None, :, None, :]]
    is_coating = np.repeat((y[1:] + y[:-1]) / 2 < piece.thickness, n_x)
    layers = np.where(
        is_coating, np.array(piece.coating)[:, None], np.array(piece.substrate)[:, None]
    )
    shear = layers[0] / 2 / (1 + layers[1])
    lame = 2 * shear * layers[1] / (1 - 2 * layers[1])
    if plane == "stress":
        lame = 2 * lame * shear / (lame + 2 * shear)
    whole = cell_stiffness(of_cells.reshape(2, -1, 5, 5), lame, shear)
    cells, local = condense_interior(whole)

    # Nodes of the face are last; all their tangential displacements precede the normal ones.
    numbers, count = numbering(n_x, n_y)
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


def solve_blocks(blocks, rigid, spring, right, moments) -> tuple:
    """Solve B_s u_s - R_s q = right_s for every strip s, and sum_s L_s u_s + S q = moments.

    Parameters
    ----------
    blocks : (s, m, m) ndarray
        Matrices B.
    rigid : tuple of (s, m, r) and (s, r, m) ndarray
        Matrices R and L.
    spring : (r,) ndarray
        Diagonal of S.
    right : (s, m) ndarray
    moments : (r,) ndarray
    """
    moved, sums = rigid
    parts = np.linalg.solve(blocks, np.concatenate([right[:, :, None], moved], axis=2))
    own, by_motion = parts[:, :, 0], parts[:, :, 1:]
    matrix = np.einsum("srm,smt->rt", sums, by_motion) + np.diag(spring)
    q = np.linalg.solve(matrix, moments - np.einsum("srm,sm->r", sums, own))
    return own + by_motion @ q, q


def press_bare(C, gap, rigid, target, spring) -> tuple:
    """Minimise f C f / 2 + gap f for f >= 0 with rigid^T f + spring q = target, by an interior-point method.

    C: (m, m) compliance of each strip; gap (s, m); rigid (s, m, r). Returns forces (s, m), motions (r,) and the set.
    """
    scale = target[0] * np.abs(C).max()
    C, gap = C * target[0] / scale, (gap - gap.min()) / scale
    spring = spring / target[0] * scale
    goal = target / target[0]
    n = gap.size
    f, w, q = np.full(gap.shape, 1 / n), np.ones(gap.shape), np.zeros(target.size)
    sums = rigid.transpose(0, 2, 1)
    for _ in range(150):
        mu = (f * w).sum() / n
        dual = f @ C + gap - rigid @ q - w
        primal = np.einsum("srm,sm->r", sums, f) + spring * q - goal
        if mu < 1e-15 and abs(dual).max() < 1e-12 and abs(primal).max() < 1e-12:
            break
        blocks = C + np.apply_along_axis(np.diag, 1, w / f)

        def step(centre, blocks=blocks, f=f, w=w, dual=dual, primal=primal):
            """Return the Newton step towards complementarity products `centre`."""
            product = f * w - centre
            df, dq = solve_blocks(blocks, (rigid, sums), spring, -dual - product / f, -primal)
            return df, -(product + w * df) / f, dq

        def largest(value, change):
            """Return the largest step that keeps values positive."""
            ratio = np.where(change < 0, -value / np.where(change < 0, change, 1.0), np.inf)
            return min(1.0, 0.9995 * ratio.min())

        df, dw, _ = step(0.0)
        after = ((f + largest(f, df) * df) * (w + largest(w, dw) * dw)).sum() / n
        df, dw, dq = step((after / mu) ** 3 * mu - df * dw)
        a = min(largest(f, df), largest(w, dw))
        f, w, q = f + a * df, w + a * dw, q + a * dq
    return f * target[0], q * scale, f > w


class RoughLaw:
    """Pressure P(s) [Pa] of a rough layer as exp of a function of the separation s [m]."""

    def __init__(self, layer: dict, scene: Scene):
        if layer["law"] == "exponential":
            decay = number(layer["decay_length"])
            level = np.log(number(layer["normal_stiffness"]) * decay)
            self.unit = decay
            self.log = lambda s: (level - s / decay, np.full(s.shape, 1 / decay))
            return
        faces = [piece.coating for piece in scene.pieces]
        modulus = 1 / sum((1 - nu**2) / young for young, nu in faces)
        deviation = number(layer["height_deviation"])
        factor = 4 / 3 * modulus * number(layer["density"])
        factor *= number(layer["radius"]) ** 0.5 * deviation**1.5
        h = np.linspace(-30, 36, 1321)

        def integral(start):
            """Return the integral of (z - h)^1.5 phi(z) over z > h, times exp(h^2/2) for positive h."""
            shift = max(start, 0.0)

            def integrand(t):
                """Return the integrand at z = h + t."""
                z = start + t
                return t**1.5 * np.exp(-(z**2 - shift**2) / 2) / sqrt(2 * np.pi)

            peak = max(-start, 0.0)
            return quad(integrand, 0, peak + 12, points=[peak] if peak else None, limit=200)[0]

        values = [np.log(integral(start)) - max(start, 0.0) ** 2 / 2 for start in h]
        table = CubicSpline(h, np.array(values) + np.log(factor))
        rate = table.derivative()
        self.unit = deviation

        def log(s):
            """Return log P and its decay rate; beyond the table both go on along the tangent."""
            place = np.clip(s / deviation, h[0], h[-1])
            slope = rate(place)
            return table(place) + slope * (s / deviation - place), -slope / deviation

        self.log = log


def press_layer(law: RoughLaw, area, C, gap, rigid, target, spring) -> tuple:
    """Solve f = A P(s), s = gap - rigid q + C f, rigid^T f + spring q = target by damped Newton's method for s."""
    bare, q, _ = press_bare(C, gap, rigid, target, spring)
    q[0] += gap.min()
    wanted = np.log(np.maximum(bare, 1e-3 * bare.mean()) / area)
    s = np.zeros(gap.shape)
    for _ in range(400):
        log, rate = law.log(s)
        s = s + np.clip((log - wanted) / rate, -5 * law.unit, 5 * law.unit)
    s = np.maximum(s, gap - rigid @ q + bare @ C)
    sums = rigid.transpose(0, 2, 1)
    for _ in range(500):
        log, rate = law.log(s)
        f = area * np.exp(np.minimum(log, 300))
        D = f * rate
        mismatch = gap - rigid @ q + f @ C - s
        missing = target - np.einsum("srm,sm->r", sums, f) - spring * q
        # Newton step: ds + C D ds + rigid dq = mismatch, rigid^T D ds - spring dq = -missing
        blocks = np.eye(s.shape[1]) + C * D[:, None, :]
        ds, dq = solve_blocks(blocks, (-rigid, sums * D[:, None, :]), -spring, mismatch, -missing)
        matters = np.exp(np.minimum(0.0, log - ds * rate - log.max())) > 1e-14
        size = (np.abs(ds) * rate)[matters].max(initial=0.0)
        # A pressure may grow by a factor of e in a step; it may fall freely.
        risen = np.log(f.sum() / area.sum() / f.shape[0] * 0.01)
        limit = np.maximum(np.log1p(np.maximum(-ds * rate, 0.0)), risen - log) / rate
        s = s + np.maximum(ds, -limit)
        q = q + dq
        if size < 1e-11:
            break
    else:
        raise ArithmeticError("the rough layer did not converge")
    log, rate = law.log(s)
    f = area * np.exp(log)
    return f, q, log > log.max() + np.log(MIN_LAYER_PRESSURE), f * rate


def condense_pieces(scene: Scene, parts: list, level: Level) -> tuple:
    """Return nodes and weights (m,) [m] of the face, and the compliances (3, m, m) [m/N] of both pieces.

    The columns are graded towards the edges of given intervals in contact.
    """
    half = scene.half
    contact = min((high - low for low, high in parts), default=2 * half)
    edges = []
    for end in sorted({end for part in parts for end in part if abs(end) < half * (1 - 1e-9)}):
        # Edges of strips that differ little share their columns.
        if not edges or end - edges[-1] > level.edge * contact:
            edges.append(end)
    bands = [(low, high, (high - low) / level.n_inside) for low, high in parts]
    lengths = [piece.half_contact for piece in scene.pieces]
    is_singular = max(lengths) > half * (1 + 1e-9) and not any(
        piece.end == "end_radius" and piece.half_contact <= half * (1 + 1e-9)
        for piece in scene.pieces
    )
    size = max(level.edge * contact, 1e-8 * half)
    shorter = min([2 * half, *(piece.height for piece in scene.pieces)])
    corner = size if is_singular else min(level.corner * shorter, contact / 30)
    sizes = np.array([corner] * 2 + [size] * (len(scene.marks) - 2) + [size] * len(edges))
    largest = half * (MAX_COLUMNS_OF_WAVES if scene.is_wavy else 1 / level.n_columns)
    x = grade(-half, half, [*scene.marks, *edges], sizes, level.growth, largest, bands)
    if x.size > MAX_COLUMNS:
        raise ArithmeticError(f"{x.size} columns are too many for this program")

    lower, upper = scene.pieces
    compliances = condense_piece(lower, scene, x, level)
    # The upper piece is the mirror image of a lower one: a shear moves its face the other way.
    mirror = np.array([1, 1, -1])[:, None, None]
    of_upper = compliances if upper == lower else condense_piece(upper, scene, x, level)
    nodes, weight = face_nodes(x)
    return nodes, weight, (compliances + mirror * of_upper) / scene.width


def press(scene: Scene, parts: list, level: Level) -> Pressed:
    """Press a scene on columns that are graded towards the edges of given intervals in contact."""
    return press_nodes(scene, *condense_pieces(scene, parts, level))


def condense_piece(piece: Piece, scene: Scene, x, level: Level) -> np.ndarray:
    """Return the compliances (3, m, m) [m2/N] of a piece per unit width at the nodes of the columns x of the interface."""
    h = np.diff(x)
    half, stop = scene.half, piece.length / 2
    kinks = [stop - piece.end_size, stop - piece.end_size * (1 - sqrt(3) / 2)]
    kinks = [kink for kink in kinks if piece.end and half * (1 + 1e-9) < kink < stop]
    sides = []
    for cell in (h[0], h[-1]):
        part = np.zeros(0)
        if stop > half * (1 + 1e-12):
            places = [half, stop, *kinks]
            sizes = np.array([cell, *[(stop - half) / 8] * (len(places) - 1)])
            part = grade(half, stop, places, sizes, level.growth, (stop - half) / 2)[1:]
        sides.append(part)
    columns = np.concatenate([-sides[0][::-1], x, sides[1]])
    face = slice(sides[0].size, sides[0].size + x.size)
    return condense(columns, piece, scene.plane, h.min(), level, face)


def press_nodes(scene: Scene, x, weight, compliance) -> Pressed:
    """Press the nodes x of the face with the compliances (3, m, m) of both pieces."""
    nn = compliance[0]
    count, roll = scene.strips
    y = ((np.arange(count) + 0.5) / count - 0.5) * scene.width
    area = weight * scene.width / count

    # Strips side by side do not interact; each is `count` times as compliant as the patch.
    gap = scene.gap(x) + roll * y[:, None]
    can_rotate = scene.moment is not None
    rigid = np.stack([np.ones(x.size), x], axis=1)[:, : 1 + can_rotate]
    rigid = np.repeat(rigid[None], count, axis=0)
    target = np.array([scene.load, scene.moment or 0.0])[: 1 + can_rotate]
    spring = np.array([0.0, scene.spring])[: 1 + can_rotate]
    C = nn * count
    slope = np.full(gap.shape, np.inf)
    law = scene.layer.get("law", "")
    if law in ("exponential", "hertz"):
        rough = RoughLaw(scene.layer, scene)
        force, motion, active, slope = press_layer(rough, area, C, gap, rigid, target, spring)
    else:
        if law:
            slope = np.broadcast_to(number(scene.layer["normal_stiffness"]) * area, gap.shape)
            C = C + np.diag(1 / slope[0])
        force, motion, active = press_bare(C, gap, rigid, target, spring)
        motion[0] += gap.min()
    intervals = [
        find_intervals(scene, x, strip / area, nodes)
        for strip, nodes in zip(force, join_neighbours(active))
    ]
    return Pressed(x, area, force, *(compliance * count), slope, motion, active, intervals)


def join_neighbours(active) -> np.ndarray:
    """Close openings of up to two nodes, which are ripples of the pressure where it vanishes, and drop such islands."""
    out = active.copy()
    for value in (True, False):
        for row in out:
            change = np.flatnonzero(np.diff(np.concatenate([[True], row == value, [True]])))
            for begin, end in change.reshape(-1, 2):
                is_inside = 0 < begin and end < row.size
                if is_inside and end - begin <= 2 and row.sum() > 6:
                    row[begin:end] = value
    return out


def find_intervals(scene: Scene, x, pressure, active) -> list:
    """Return the intervals (from, to) [m] of a strip in contact."""
    law = scene.layer.get("law", "")
    ends = []
    padded = np.concatenate([[False], active, [False]])
    for k in np.flatnonzero(padded[1:] != padded[:-1]):
        is_start = bool(padded[k + 1])
        node, side = (k, -1) if is_start else (k - 1, 1)
        outside = node + side
        if not 0 <= outside < x.size:
            ends.append(float(x[node]))
            continue
        cell = x[outside] - x[node]
        near_step = scene.step is not None and min(abs(x[[node, outside]] - scene.step)) < abs(cell)
        place = x[node] + cell / 2
        if law in ("exponential", "hertz"):
            logs = np.log(np.maximum(pressure[[node, outside]], 1e-300) / pressure.max())
            place = x[node] + cell * (logs[0] - np.log(MIN_LAYER_PRESSURE)) / (logs[0] - logs[1])
        elif near_step:
            place = scene.step
        else:
            place = extrapolate_edge(scene, x, pressure * active, (node, side)) or place
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
    power = 1 if scene.layer else 2
    curve = np.polyfit(depth[near] / window, (pressure[near] / pressure.max()) ** power, 3)
    roots = np.roots(curve)
    roots = roots[np.abs(roots.imag) < 1e-9].real
    if not roots.size or np.abs(roots).min() > 1.0:
        return None
    return float(x[node] - side * window * roots[np.argmin(np.abs(roots))])


def find_stiffnesses(scene: Scene, pressed: Pressed, strip: int, nodes) -> np.ndarray:
    """Return the normal [N/m], tangential [N/m] and rotational stiffness [N m/rad] of a set of nodes of a strip."""
    law = scene.layer.get("law", "")
    ratio = scene.layer.get("tangential_ratio")
    index = np.flatnonzero(nodes)
    inside = np.ix_(index, index)
    x = pressed.x[index]
    soft = 1 / pressed.slope[strip, index] if law else np.zeros(index.size)
    nn = pressed.nn[inside] + np.diag(soft)
    tt = pressed.tt[inside] + (np.diag(soft / ratio) if ratio else 0.0)
    # Strips side by side slide without a motion across.
    nt = pressed.nt[inside] if len(pressed.force) == 1 else 0.0 * pressed.nt[inside]
    rates = np.linalg.solve(nn, np.stack([np.ones(index.size), x, *nt.T], axis=1))
    shear = np.linalg.solve(tt - nt.T @ rates[:, 2:], np.ones(index.size))
    return np.array([rates[:, 0].sum(), shear.sum(), x @ rates[:, 1]])


def interpolate_stiffnesses(scene: Scene, pressed: Pressed, strip: int) -> np.ndarray:
    """Return the stiffnesses of a strip for edges between the nodes."""
    x = pressed.x
    if scene.layer.get("law", "") in ("exponential", "hertz"):
        return find_stiffnesses(scene, pressed, strip, pressed.active[strip])

    # The set of the nodes between the edges, and the set with one more node at each edge
    inner = np.zeros(x.size, bool)
    fractions = []
    for low, high in pressed.intervals[strip]:
        first, last = np.searchsorted(x, [low - 1e-12, high + 1e-12]) - [0, 1]
        inner[first : last + 1] = True
        if first > 0:
            fractions.append((x[first] - low) / (x[first] - x[first - 1]))
        if last < x.size - 1:
            fractions.append((high - x[last]) / (x[last + 1] - x[last]))
    if not inner.any():
        return np.zeros(3)
    outer = inner.copy()
    outer[1:] |= inner[:-1]
    outer[:-1] |= inner[1:]
    fraction = np.mean(fractions) if fractions else 0.0
    values = [find_stiffnesses(scene, pressed, strip, nodes) for nodes in (inner, outer)]
    return (1 - fraction) * values[0] + fraction * values[1]


def find_measures(scene: Scene, pressed: Pressed) -> dict:
    """Return the measures of a pressed patch by name."""
    x = pressed.x
    count = len(pressed.force)
    stiffnesses = [interpolate_stiffnesses(scene, pressed, strip) for strip in range(count)]
    normal, shear, turn = np.sum(stiffnesses, axis=0)
    length = sum(high - low for strip in pressed.intervals for low, high in strip)
    places = np.concatenate([part for part in pressed.intervals if part])
    force = pressed.force.sum(axis=0)
    can_rotate = scene.moment is not None
    out = {
        "contact_fraction": length / count / (2 * scene.half),
        "contact_half_width": np.ptp(places) / 2,
        "pressure_peak": interpolate_peak(scene, pressed),
        "approach": pressed.motion[0],
        "rotation": scene.tilt - (pressed.motion[1] if can_rotate else 0.0),
        "moment": force @ x,
        "pressure_centre": force @ x / scene.load,
        "normal_stiffness": normal,
        "tangential_stiffness": shear,
        "rotational_stiffness": turn,
    }
    return {name: float(value) for name, value in out.items()}


def interpolate_peak(scene: Scene, pressed: Pressed) -> float:
    """Return the maximum of the pressure, of the polynomial through five nodes where it is smooth."""
    pressure = pressed.force / pressed.weight
    strip, largest = np.unravel_index(np.argmax(pressure), pressure.shape)
    nodes = slice(largest - 2, largest + 3)
    near = pressure[strip, nodes]
    if scene.step or not 2 <= largest < pressed.x.size - 2 or (near <= 0).any():
        return pressure.max()
    places = pressed.x[nodes] - pressed.x[largest]
    places = places / places[4]
    curve = np.polynomial.Polynomial.fit(places, near, 4)
    return curve(np.linspace(places[1], places[3], 201)).max()


def press_levels(scene: Scene, levels=LEVELS) -> list[Pressed]:
    """Return the patch pressed on each level, whose columns are graded towards the contact edges of the mesh before."""
    parts = []
    for k in range(N_SEARCHES):
        before = parts
        parts = find_parts(scene, press(scene, parts, SEARCHES[min(k // 2, 1)]))
        if k > 1 and len(parts) == len(before):
            change = np.abs(np.subtract(parts, before)).max()
            if change < min(high - low for low, high in parts) / 100:
                break
    found = []
    for level in levels:
        found.append(press(scene, parts, level))
        parts = find_parts(scene, found[-1])
    return found


def solve_patch(contact: dict, trace_points=None) -> tuple[dict, dict]:
    """Return the measures of a table [contact] and their uncertainties by name.

    The uncertainty is the larger of the change to the last level and half of the change before it.

    Parameters
    ----------
    contact : dict
        Quantities as text in SI units, such as "0.01 m".
    trace_points : (2, k) ndarray, optional
        Positions and heights [m] of a gap.
    """
    scene = read_scene(contact, trace_points)
    first, second, last = (find_measures(scene, pressed) for pressed in press_levels(scene))
    doubt = {
        name: max(abs(value - second[name]), abs(second[name] - first[name]) / 2)
        for name, value in last.items()
    }
    return last, doubt


def find_parts(scene: Scene, pressed: Pressed) -> list:
    """Return the intervals (from, to) [m] towards whose ends the next columns are graded."""
    x = pressed.x
    cells = np.diff(x)
    pressure = pressed.force / pressed.weight
    parts = [part for strip in pressed.intervals for part in strip]
    if scene.layer.get("law", "") in ("exponential", "hertz"):
        loaded = pressure > 1e-2 * pressure.max()
        strips = (find_intervals(scene, x, *strip) for strip in zip(pressure, loaded))
        parts = [part for strip in strips for part in strip]
    out = []
    for low, high in parts:
        k = np.clip(np.searchsorted(x, (low + high) / 2) - 1, 0, cells.size - 1)
        least = cells[k] / 2
        out.append((min(low, (low + high) / 2 - least), max(high, (low + high) / 2 + least)))
    return sorted(out)
