"""Independent program for static patches, which uses nothing of the package.

Both pieces are meshed by scikit-fem with quadratic elements on columns that are graded towards the edges of the
contact, its ends and steps. SuperLU eliminates the inside with the face last. The pressure is linear between the corners
of the face and meets the mean of the gap over its hat functions. Bare contact is solved by a primal-dual interior-point
method, a rough layer by Newton's method for the separations. Differences between two levels of grading are the
uncertainties. Measures have the names of the package.
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad
from skfem.helpers import ddot, eye, sym_grad, trace

# Shortest columns at the contact edges over the length of the contact, growth of the columns with distance, smallest
# number of columns along a contact and in half the interface, and factor on the cells at corners and in coatings: of the
# search, and of the two levels that are compared
SEARCH = (1 / 40, 0.7, 15, 12, 1.0)
LEVELS = ((1 / 120, 0.5, 24, 16, 0.5), (1 / 600, 0.35, 48, 32, 0.1))
N_PASSES = 2  # largest number of meshes on a level, each graded to the edges on the previous one
N_SEARCHES = 8
MAX_POINTS = 900  # largest number of columns of all strips together
MIN_LAYER_PRESSURE = (
    1e-13  # pressure over the peak at which a node of a rough layer counts as loaded
)
SPLU = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


@BilinearForm
def elasticity(u, v, w):
    """Weak form of plane elasticity."""
    strain = sym_grad(u)
    return ddot(w.lam * eye(trace(strain), 2) + 2 * w.mu * strain, sym_grad(v))


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
    cells: float


def number(text) -> float:
    """Return the number of a quantity in SI units."""
    return float(str(text).split(" ")[0])


def read_material(table: dict) -> tuple[float, float]:
    """Return Young's modulus and Poisson's ratio."""
    return number(table["young"]), table["poisson"]


def read_scene(contact: dict, trace_points) -> Scene:
    """Return the scene of a table [contact]."""
    pieces = []
    coating = contact.get("coating")
    for side in ("lower", "upper"):
        own = contact.get(side, {})
        substrate = read_material(own.get("substrate", contact["substrate"]))
        end = next((key for key in ("chamfer", "end_radius") if key in own), "")
        pieces.append(
            Piece(
                number(own.get("length", contact["length"])),
                number(own.get("height", contact["height"])),
                number(coating["thickness"]) if coating else 0.0,
                read_material(coating["material"]) if coating else substrate,
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


def condense(x, piece: Piece, plane: str, rows: tuple, face: slice) -> np.ndarray:
    """Return the compliances (3, m, m): nn, tt, nt of hat-weighted pressures on the face, per unit width.

    rows: length of the first row [m], growth of the rows, and factor on the rows at the holder and in a coating.
    """
    row, growth, factor = rows
    marks, sizes = [0.0, piece.height], [row, factor * piece.height / 20]
    if piece.thickness:
        finest = max(row, factor * piece.thickness / 4)
        marks, sizes = [*marks, piece.thickness], [*sizes, finest]
    y = grade(0.0, piece.height, marks, np.array(sizes), growth, piece.height / 5)
    mesh = MeshQuad.init_tensor(x, y)
    is_coating = mesh.p[1][mesh.t].mean(axis=0) < piece.thickness
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=4)
    places = basis.doflocs.copy()
    # The coating follows the drop of the face, the substrate up to the far face.
    fade = np.minimum(1.0, (piece.height - mesh.p[1]) / (piece.height - piece.thickness))
    shaped = mesh.translated((0.0, 0.0))
    moved = mesh.p + np.stack([0 * mesh.p[0], piece.drop(mesh.p[0]) * fade])
    basis = Basis(MeshQuad(moved, shaped.t), ElementVector(ElementQuad2()), intorder=4)

    young, nu = np.where(
        is_coating, np.array(piece.coating)[:, None], np.array(piece.substrate)[:, None]
    )
    mu = young / 2 / (1 + nu)
    lam = 2 * mu * nu / (1 - 2 * nu)
    if plane == "stress":
        lam = 2 * lam * mu / (lam + 2 * mu)
    ones = np.ones(basis.dx.shape)
    K = elasticity.assemble(basis, lam=lam[:, None] * ones, mu=mu[:, None] * ones).tocsc()

    # Nodes of the face by x, with the x and the y displacement of each
    on_face = np.flatnonzero(np.abs(places[1]) < 1e-15)
    order = on_face[np.argsort(places[0][on_face], kind="stable")].reshape(-1, 2)
    order = np.sort(order, axis=1)[2 * face.start : 2 * face.stop - 1]
    boundary = order.T.ravel()
    fixed = np.flatnonzero(places[1] > piece.height * (1 - 1e-12))
    rest = np.setdiff1d(np.arange(K.shape[0]), np.concatenate([boundary, fixed]))
    inside = splu(K[rest][:, rest], permc_spec="MMD_AT_PLUS_A", **SPLU)
    sequence = np.concatenate([rest[np.argsort(inside.perm_c)], boundary])
    factor = splu(K[sequence][:, sequence], permc_spec="NATURAL", **SPLU)
    n = boundary.size
    stiffness = factor.L[-n:, -n:].toarray() @ factor.U[-n:, -n:].toarray()

    # Loads: int phi_i N_j along the face, phi_i the hat functions, N_j quadratic along an edge
    h = np.diff(x[face])
    m = h.size + 1
    loads = np.zeros((n // 2, m))
    local = np.array([[1 / 6, 1 / 3, 0], [0, 1 / 3, 1 / 6]]).T
    for cell in range(m - 1):
        loads[2 * cell : 2 * cell + 3, cell : cell + 2] += h[cell] * local
    loads /= loads.sum(axis=0)
    both = np.kron(np.eye(2), loads)
    c = both.T @ np.linalg.solve((stiffness + stiffness.T) / 2, both)
    return np.stack([c[m:, m:], c[:m, :m], c[m:, :m]])


def press_bare(C, gap, rigid, target, spring) -> tuple:
    """Minimise f C f / 2 + gap f for f >= 0 with rigid^T f + spring q = target, by an interior-point method."""
    n, r = rigid.shape
    scale = target[0] * np.abs(C).max()
    C, gap = C * target[0] / scale, (gap - gap.min()) / scale
    S = np.diag(spring) / target[0] * scale
    goal = target / target[0]
    f, w, q = np.full(n, 1 / n), np.ones(n), np.zeros(r)
    for _ in range(150):
        mu = f @ w / n
        dual = C @ f + gap - rigid @ q - w
        primal = rigid.T @ f + S @ q - goal
        if mu < 1e-15 and abs(dual).max() < 1e-12 and abs(primal).max() < 1e-12:
            break
        kkt = np.block([[C + np.diag(w / f), -rigid], [rigid.T, S]])

        def step(centre, kkt=kkt, f=f, w=w, dual=dual, primal=primal):
            """Return the Newton step towards complementarity products `centre`."""
            product = f * w - centre
            d = np.linalg.solve(kkt, np.concatenate([-dual - product / f, -primal]))
            return d[:n], -(product + w * d[:n]) / f, d[n:]

        def largest(value, change):
            """Return the largest step that keeps values positive."""
            ratio = np.where(change < 0, -value / np.where(change < 0, change, 1.0), np.inf)
            return min(1.0, 0.9995 * ratio.min())

        df, dw, _ = step(0.0)
        after = (f + largest(f, df) * df) @ (w + largest(w, dw) * dw) / n
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
    s = np.zeros(gap.size)
    for _ in range(400):
        log, rate = law.log(s)
        s = s + np.clip((log - wanted) / rate, -5 * law.unit, 5 * law.unit)
    s = np.maximum(s, gap - rigid @ q + C @ bare)
    for _ in range(500):
        log, rate = law.log(s)
        f = area * np.exp(np.minimum(log, 300))
        D = f * rate
        mismatch = gap - rigid @ q + C @ f - s
        missing = target - rigid.T @ f - spring * q
        # Newton step: ds = mismatch - rigid dq - C D ds, missing + rigid^T D ds - spring dq = 0
        matrix = np.block(
            [
                [np.eye(s.size) + C * D, rigid],
                [-(rigid * D[:, None]).T, np.diag(spring)],
            ]
        )
        change = np.linalg.solve(matrix, np.concatenate([mismatch, missing]))
        ds = change[: s.size]
        matters = np.exp(np.minimum(0.0, log - ds * rate - log.max())) > 1e-14
        size = (np.abs(ds) * rate)[matters].max(initial=0.0)
        # A pressure may grow by a factor of e in a step; it may fall freely.
        risen = np.log(f.sum() / area.sum() * 0.01)
        limit = np.maximum(np.log1p(np.maximum(-ds * rate, 0.0)), risen - log) / rate
        s = s + np.maximum(ds, -limit)
        q = q + change[s.size :]
        if size < 1e-11:
            break
    else:
        raise ArithmeticError("the rough layer did not converge")
    log, rate = law.log(s)
    f = area * np.exp(log)
    return f, q, log > log.max() + np.log(MIN_LAYER_PRESSURE), f * rate


def press(scene: Scene, parts: list, level: tuple) -> Pressed:
    """Press a scene on columns that are graded towards the edges of given intervals in contact."""
    finest, growth, n_inside, n_columns, corner_factor = level
    half = scene.half
    contact = min((high - low for low, high in parts), default=2 * half)
    edges = sorted({end for part in parts for end in part if abs(end) < half * (1 - 1e-9)})
    bands = [(low, high, (high - low) / n_inside) for low, high in parts]
    lengths = [piece.half_contact for piece in scene.pieces]
    is_singular = max(lengths) > half * (1 + 1e-9) and not any(
        piece.end == "end_radius" and piece.half_contact <= half * (1 + 1e-9)
        for piece in scene.pieces
    )
    size = max(finest * contact, 1e-8 * half)
    thin = min((p.thickness for p in scene.pieces if p.thickness), default=half)
    corner = size if is_singular else corner_factor * min(half / 40, thin / 6, contact / 30)
    sizes = np.array([corner] * 2 + [size] * (len(scene.marks) - 2) + [size] * len(edges))
    is_wavy = "CubicSpline" in repr(scene.gap.__closure__)
    largest = half / 100 if is_wavy else half / n_columns
    x = grade(-half, half, [*scene.marks, *edges], sizes, growth, largest, bands)
    if x.size * scene.strips[0] > MAX_POINTS:
        raise ArithmeticError(f"{x.size} columns are too many for this program")
    h = np.diff(x)
    weight = (np.append(h, 0) + np.append(0, h)) / 2
    total = 0
    for sign, piece in zip((1, -1), scene.pieces):
        parts = []
        flat = piece.length / 2 - piece.end_size
        for cell in (h[0], h[-1]):
            stop = piece.length / 2
            part = np.zeros(0)
            if stop > half * (1 + 1e-12):
                places = [half, stop, *([flat] if half < flat < stop else [])]
                cells = np.array([cell, *[(stop - half) / 8] * (len(places) - 1)])
                part = grade(half, stop, places, cells, growth, (stop - half) / 2)[1:]
            parts.append(part)
        columns = np.concatenate([-parts[0][::-1], x, parts[1]])
        face = slice(parts[0].size, parts[0].size + x.size)
        rows = (h.min() * 1.5, growth, corner_factor)
        nn, tt, nt = condense(columns, piece, scene.plane, rows, face)
        total = total + np.array([nn, tt, sign * nt]) / scene.width
    nn, tt, nt = total
    count, roll = scene.strips
    y = ((np.arange(count) + 0.5) / count - 0.5) * scene.width
    area = weight * scene.width / count

    # Strips side by side do not interact; each is `count` times as compliant as the patch.
    gap = (average_over_hats(scene.gap, x) + roll * y[:, None]).ravel()
    can_rotate = scene.moment is not None
    rigid = np.stack([np.ones(gap.size), np.tile(x, count)], axis=1)[:, : 1 + can_rotate]
    target = np.array([scene.load, scene.moment or 0.0])[: 1 + can_rotate]
    spring = np.array([0.0, scene.spring])[: 1 + can_rotate]
    C = np.kron(np.eye(count), nn * count)
    areas = np.tile(area, count)
    slope = np.full(gap.size, np.inf)
    law = scene.layer.get("law", "")
    if law in ("exponential", "hertz"):
        rough = RoughLaw(scene.layer, scene)
        force, motion, active, slope = press_layer(rough, areas, C, gap, rigid, target, spring)
    else:
        if law:
            slope = number(scene.layer["normal_stiffness"]) * areas
            C = C + np.diag(1 / slope)
        force, motion, active = press_bare(C, gap, rigid, target, spring)
        motion[0] += gap.min()
    force, active, slope = (part.reshape(count, -1) for part in (force, active, slope))
    intervals = []
    cells = 0.0
    for strip, nodes in zip(force, join_neighbours(active)):
        found, length = find_intervals(scene, x, strip / area, nodes)
        intervals.append(found)
        cells += length
    return Pressed(
        x, area, force, nn * count, tt * count, nt * count, slope, motion, active, intervals, cells
    )


def average_over_hats(function, x) -> np.ndarray:
    """Return the means (m,) of a function over the hat functions of columns x (m,), by Gauss rules on the columns."""
    points, weights = np.polynomial.legendre.leggauss(4)
    h = np.diff(x)
    fraction = (points + 1) / 2
    values = function(x[:-1, None] + h[:, None] * fraction) * (weights / 2 * h[:, None])
    out = np.zeros(x.size)
    out[:-1] += values @ (1 - fraction)
    out[1:] += values @ fraction
    return out * 2 / (np.append(h, 0) + np.append(0, h))


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


def find_intervals(scene: Scene, x, pressure, active) -> tuple:
    """Return the intervals [m] of a strip in contact, and the sum of the cells in which they end [m]."""
    law = scene.layer.get("law", "")
    ends = []
    cells = 0.0
    padded = np.concatenate([[False], active, [False]])
    for k in np.flatnonzero(padded[1:] != padded[:-1]):
        is_start = bool(padded[k + 1])
        node, side = (k, -1) if is_start else (k - 1, 1)
        outside = node + side
        if not 0 <= outside < x.size:
            ends.append(float(x[node]))
            continue
        cell = x[outside] - x[node]
        cells += abs(cell)
        near_step = scene.step is not None and min(abs(x[[node, outside]] - scene.step)) < abs(cell)
        place = x[node] + cell / 2
        if law in ("exponential", "hertz"):
            logs = np.log(np.maximum(pressure[[node, outside]], 1e-300) / pressure.max())
            place = x[node] + cell * (logs[0] - np.log(MIN_LAYER_PRESSURE)) / (logs[0] - logs[1])
        elif near_step:
            place = scene.step
        else:
            # The square of the pressure of bare pieces vanishes linearly, and so does the pressure of a layer. The last
            # node is left out, because its pressure is least exact.
            nodes = node - side * np.arange(1, 7)
            nodes = nodes[(nodes >= 0) & (nodes < x.size)]
            if nodes.size == 6 and (pressure[nodes] > 0).all():
                curve = np.polyfit(
                    (x[nodes] - x[node]) / cell, pressure[nodes] ** (1 if law else 2), 2
                )
                roots = np.roots(curve)
                roots = roots[np.abs(roots.imag) < 1e-9].real
                if roots.size:
                    root = roots[np.argmin(np.abs(roots - 0.5))]
                    place = x[node] + np.clip(root, -1.0, 2.0) * cell
        ends.append(float(place))
    return np.reshape(ends, (-1, 2)).tolist(), cells


def find_measures(scene: Scene, pressed: Pressed) -> dict:
    """Return the measures of a pressed patch by name, None where the pressure is unbounded."""
    x = pressed.x
    count = len(pressed.force)
    law = scene.layer.get("law", "")
    ratio = scene.layer.get("tangential_ratio")
    normal = shear = turn = length = 0.0
    for strip, nodes in enumerate(pressed.active):
        index = np.flatnonzero(nodes)
        if not index.size:
            continue
        inside = np.ix_(index, index)
        soft = 1 / pressed.slope[strip, index] if law else np.zeros(index.size)
        nn = pressed.nn[inside] + np.diag(soft)
        tt = pressed.tt[inside] + (np.diag(soft / ratio) if ratio else 0.0)
        nt = pressed.nt[inside] if count == 1 else 0.0 * pressed.nt[inside]
        ones = np.ones(index.size)
        rates = np.linalg.solve(nn, np.stack([ones, x[index]], axis=1))
        both = np.block([[nn, nt], [nt.T, tt]])
        normal += rates[:, 0].sum()
        turn += x[index] @ rates[:, 1]
        shear += np.linalg.solve(both, np.concatenate([0 * ones, ones]))[index.size :].sum()
        length += np.diff(pressed.intervals[strip]).sum()
    places = np.concatenate([part for part in pressed.intervals if part])
    force = pressed.force.sum(axis=0)
    can_rotate = scene.moment is not None
    out = {
        "contact_fraction": length / count / (2 * scene.half),
        "contact_half_width": np.ptp(places) / 2,
        "pressure_peak": (pressed.force / pressed.weight).max(),
        "approach": pressed.motion[0],
        "rotation": scene.tilt - (pressed.motion[1] if can_rotate else 0.0),
        "moment": force @ x,
        "pressure_centre": force @ x / scene.load,
        "normal_stiffness": normal,
        "tangential_stiffness": shear,
        "rotational_stiffness": turn,
    }
    return {name: float(value) for name, value in out.items()}


def solve_patch(contact: dict, trace_points=None) -> tuple[dict, dict]:
    """Return the measures of a table [contact] and their uncertainties by name.

    Parameters
    ----------
    contact : dict
        Quantities as text in SI units, such as "0.01 m".
    trace_points : (2, k) ndarray, optional
        Positions and heights [m] of a gap.
    """
    scene = read_scene(contact, trace_points)
    parts = []
    for _ in range(N_SEARCHES):
        before = parts
        parts = find_parts(scene, press(scene, parts, SEARCH))
        if len(parts) == len(before):
            change = np.abs(np.subtract(parts, before)).max()
            if change < min(high - low for low, high in parts) / 30:
                break
    results = []
    for level in LEVELS:
        for _ in range(N_PASSES):
            before = parts
            pressed = press(scene, parts, level)
            parts = find_parts(scene, pressed)
            if len(parts) == len(before):
                change = np.abs(np.subtract(parts, before)).max()
                if change < 4 * level[0] * min(high - low for low, high in parts):
                    break
        results.append(find_measures(scene, pressed))
    coarse, fine = results
    doubt = {name: abs(value - coarse[name]) for name, value in fine.items()}
    # The position of an edge within its cell is known to a tenth.
    count = len(pressed.force)
    doubt["contact_fraction"] += 0.1 * pressed.cells / count / (2 * scene.half)
    doubt["contact_half_width"] += 0.1 * pressed.cells / count / 2
    return fine, doubt


def find_parts(scene: Scene, pressed: Pressed) -> list:
    """Return the intervals (from, to) [m] towards whose ends the next columns are graded."""
    x = pressed.x
    cells = np.diff(x)
    pressure = pressed.force / pressed.weight
    parts = [part for strip in pressed.intervals for part in strip]
    if scene.layer.get("law", "") in ("exponential", "hertz"):
        parts = []
        for row in pressure:
            found, _ = find_intervals(scene, x, row, row > 1e-2 * pressure.max())
            parts += found
    out = []
    for low, high in parts:
        k = np.clip(np.searchsorted(x, (low + high) / 2) - 1, 0, cells.size - 1)
        least = cells[k] / 2
        out.append((min(low, (low + high) / 2 - least), max(high, (low + high) / 2 + least)))
    return sorted(out)
