"""Frictionless contact of two blocks under a trace, by a boundary-element program of its own.

It shares no code with patchfem. The compliance of a block is the closed form of a line load on a half-plane
(Flamant) plus the smooth rest that the finite block, its held foot, its free sides and its coating make, from finite
elements of second order. Pressure is constant in cells that are halved where the blocks touch, down to a few
nanometres, on the trace read as a natural cubic spline. `solve` returns the values of the last level and how much they
changed from the level before.

The rest is tabulated for loads at |x| < REACH of the half length: contacts nearer to the ends are refused.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

REACH = 0.97  # largest |x| over the half length of a tabulated load
COLUMNS = 160  # elements along a block
HALVINGS = 6  # of the last element at each side
GROWTH = 0.18  # of the elements down a block, per distance from its faces
MAX_CELLS = 2500  # of a level that is solved; where more would be needed the level before is the last
SAMPLES = 16  # of the gap in a cell, from which its least is taken
GAUSS = (np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 9)


class Layer(NamedTuple):
    """A material: Young's modulus [Pa] and Poisson's ratio."""

    young: float
    poisson: float

    @property
    def stiffness(self) -> np.ndarray:
        """Plane-strain stiffness (3, 3) for (xx, yy, 2 xy) [Pa]."""
        lam = self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))
        mu = self.young / (2 * (1 + self.poisson))
        return np.array([[lam + 2 * mu, lam, 0], [lam, lam + 2 * mu, 0], [0, 0, mu]])


class Block(NamedTuple):
    """A block: length and height [m], substrate, coating (Layer or None) and its thickness [m]."""

    length: float
    height: float
    substrate: Layer
    coating: Layer | None = None
    thickness: float = 0.0

    @property
    def face(self) -> Layer:
        """Material of the face."""
        return self.coating or self.substrate


def flamant(layer: Layer, x, y, along: bool) -> tuple:
    """Displacement (2, ...) [m] and stress (3, ...) [Pa] of a unit line load at the origin of y >= 0.

    The load points to +y, or to +x if `along`. Johnson, Contact Mechanics, section 2.2, in plane strain.
    """
    a, b = (x, -y) if along else (y, x)  # along the load, and across it
    r2, angle = a * a + b * b, np.arctan2(b, a)
    young, nu = layer
    log = np.log(np.sqrt(r2))
    first, second = (1 - nu**2) / (np.pi * young), (1 - 2 * nu) * (1 + nu) / (np.pi * young)
    cos, sin = np.cos(angle), np.sin(angle)
    radial = -2 * first * cos * log - second * angle * sin
    turning = 2 * first * sin * log + 2 * nu * (1 + nu) / (np.pi * young) * sin + second * (sin - angle * cos)
    ahead, aside = radial * cos - turning * sin, radial * sin + turning * cos
    u = np.stack([ahead, -aside] if along else [aside, ahead])
    radial_stress = -2 / np.pi * a / r2**2
    return u, np.stack([radial_stress * x * x, radial_stress * y * y, radial_stress * x * y])


def _lines(block: Block) -> tuple:
    """Element borders along x and down y, halved towards the sides, the foot and the face of the coating."""
    x = np.linspace(-0.5, 0.5, COLUMNS + 1) * block.length
    ends = x[1] - (x[1] - x[0]) * (1 - 0.5 ** np.arange(HALVINGS, 0, -1))[::-1]
    x = np.unique(np.concatenate([x, ends, -ends]))
    step = min(block.length / COLUMNS, block.thickness / 3 if block.thickness else np.inf)
    faces = [0.0, block.thickness, block.height] if block.thickness else [0.0, block.height]
    least = {face: step / 4 for face in faces[:-1]} | {block.height: step / 16}
    down = [0.0]
    for low, high in pairwise(faces):
        borders, far = [low], [high]
        while far[-1] - borders[-1] > 0:
            near = min(least[low] + GROWTH * (borders[-1] - low), (far[-1] - borders[-1]))
            back = min(least[high] + GROWTH * (high - far[-1]), (far[-1] - borders[-1]))
            if near + back >= far[-1] - borders[-1]:
                break
            borders.append(borders[-1] + near)
            far.append(far[-1] - back)
        down += [*borders[1:], *far[::-1]]
    return x, np.array(down)


def _shapes(t):
    """Quadratic functions on [-1, 1] and their slopes, (3, ...) each."""
    return np.stack([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2]), np.stack([t - 0.5, -2 * t, t + 0.5])


@lru_cache(maxsize=8)
def rest_of(block: Block, along: bool = False) -> tuple:
    """(places (k,) [m], rest (k, k) [m per N/m]) of the motion of the face under line loads on it."""
    lines_x, lines_y = _lines(block)
    nx, ny = lines_x.size - 1, lines_y.size - 1
    x = np.interp(np.arange(2 * nx + 1) / 2, np.arange(nx + 1), lines_x)
    y = np.interp(np.arange(2 * ny + 1) / 2, np.arange(ny + 1), lines_y)
    rows = y.size
    ex, ey = (one.ravel() for one in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    local = [(i, j) for i in range(3) for j in range(3)]
    nodes = np.stack([(2 * ex + i) * rows + 2 * ey + j for i, j in local], axis=1)
    dofs = (2 * nodes[:, :, None] + np.arange(2)).reshape(len(nodes), 18)
    hx, hy = np.diff(lines_x)[ex] / 2, np.diff(lines_y)[ey] / 2
    coated = lines_y[ey + 1] <= block.thickness * (1 + 1e-9)
    inside, face = block.substrate.stiffness, block.face.stiffness
    stiff = np.where(coated[:, None, None], face, inside)
    matrix, points = np.zeros((len(nodes), 18, 18)), []
    for tx, wx in zip(*GAUSS):
        for ty, wy in zip(*GAUSS):
            (fx, gx), (fy, gy) = _shapes(tx), _shapes(ty)
            dx = np.array([gx[i] * fy[j] for i, j in local])[None] / hx[:, None]
            dy = np.array([fx[i] * gy[j] for i, j in local])[None] / hy[:, None]
            strain = np.zeros((len(nodes), 3, 18))
            strain[:, 0, ::2], strain[:, 1, 1::2] = dx, dy
            strain[:, 2, ::2], strain[:, 2, 1::2] = dy, dx
            weight = wx * wy * hx * hy
            matrix += np.einsum("e,eka,ekl,elb->eab", weight, strain, stiff, strain, optimize=True)
            points.append((strain, weight, lines_x[ex] + hx * (1 + tx), lines_y[ey] + hy * (1 + ty)))
    size = 2 * x.size * rows
    whole = coo_matrix((matrix.ravel(), (np.repeat(dofs, 18), np.tile(dofs, 18).ravel())), (size, size)).tocsc()
    foot = (2 * (np.arange(x.size) * rows + rows - 1)[:, None] + np.arange(2)).ravel()
    free = np.setdiff1d(np.arange(size), foot)
    factor = splu(whole[free][:, free])
    sources = lines_x[np.abs(lines_x) <= REACH * block.length / 2]
    compliance = np.linalg.inv(face)
    out = np.empty((sources.size, x.size))
    top = 2 * np.arange(x.size) * rows + (0 if along else 1)
    for k, s in enumerate(sources):
        load = np.zeros(size)
        if block.coating is not None:
            some = ~coated
            for strain, weight, px, py in points:
                _, stress = flamant(block.face, px[some] - s, py[some], along)
                moved = ((inside - face) @ compliance) @ stress
                np.add.at(load, dofs[some], -np.einsum("e,ke,eka->ea", weight[some], moved, strain[some]))
        for side, column in ((-1, 0), (1, x.size - 1)):
            for t, w in zip(*GAUSS):
                fy, _ = _shapes(t)
                half = np.diff(lines_y) / 2
                py = lines_y[:-1] + half * (1 + t)
                _, stress = flamant(block.face, np.full(ny, x[column] - s), py, along)
                for j in range(3):
                    at = 2 * (column * rows + 2 * np.arange(ny) + j)
                    for axis, part in ((0, stress[0]), (1, stress[2])):
                        np.add.at(load, at + axis, -side * w * half * fy[j] * part)
        held, _ = flamant(block.face, x - s, np.full(x.size, block.height), along)
        fixed = np.zeros(size)
        fixed[foot] = -held.T.ravel()
        fixed[free] = factor.solve((load - whole @ fixed)[free])
        out[k] = fixed[top]
        # the constant of the closed form at the face
        out[k] += flamant(block.face, np.array([1.0]), np.array([0.0]), along)[0][0 if along else 1]
    some = np.isin(x, sources)
    rest = out[:, some]
    return sources, (rest + rest.T) / 2


def _log_integral(a, b) -> np.ndarray:
    """Integral of ln|t| from a to b."""
    def of(t):
        size = np.abs(t)
        return t * np.log(np.where(size > 0, size, 1.0)) - t

    return of(b) - of(a)


@dataclass
class Pair:
    """Two blocks as one compliance per line load [m per N/m]."""

    blocks: tuple

    def spline(self, along: bool) -> RectBivariateSpline:
        """The smooth rest of both blocks."""
        found = [rest_of(block, along) for block in self.blocks]
        return RectBivariateSpline(found[0][0], found[0][0], sum(rest for _, rest in found))

    def matrix(self, at, low, high, along: bool = False) -> np.ndarray:
        """Motion (n, m) [m/Pa] at the places under pressures of 1 in cells (m,) from low to high."""
        soft = sum(2 * (1 - one.face.poisson**2) / (np.pi * one.face.young) for one in self.blocks)
        out = -soft * _log_integral(low[None] - at[:, None], high[None] - at[:, None])
        middle = (low + high) / 2
        order, back = np.argsort(at), np.argsort(np.argsort(at))
        columns, again = np.argsort(middle), np.argsort(np.argsort(middle))
        rest = self.spline(along)(at[order], middle[columns])[back][:, again]
        return out + rest * (high - low)


class Case(NamedTuple):
    """What presses a pair: width [m], gap as a function of x, load [N], its offset [m] or None where the rotation is
    prescribed (it is then part of the gap)."""

    width: float
    gap: CubicSpline
    load: float
    offset: float | None = None


def gap_of(x, z, angle: float = 0.0):
    """The levelled heights of a trace, a natural cubic spline from its least on, and a tilt [rad]."""
    slope, height = np.polyfit(x, z, 1)
    curve = CubicSpline(x, z - slope * x - height, bc_type="natural")
    places = np.linspace(x[0], x[-1], 64 * (x.size - 1) + 1)
    least = curve(places).min()
    return lambda at: curve(at) - least + angle * at


def _press(matrix, gap, middle, size, case: Case, active) -> tuple:
    """(pressures (m,), approach, rotation) of an active-set iteration from `active`."""
    load = case.load / case.width
    for _ in range(200):
        motions = [np.ones(gap.size)] + ([] if case.offset is None else [-middle])
        rigid = np.stack(motions, axis=1)
        sums = np.array([load] + ([] if case.offset is None else [-load * case.offset]))
        on = np.flatnonzero(active)
        free = rigid.shape[1]
        system = np.zeros((on.size + free, on.size + free))
        system[:on.size, :on.size] = matrix[np.ix_(on, on)]
        system[:on.size, on.size:] = -rigid[on]
        system[on.size:, :on.size] = (rigid[on] * size[on, None]).T
        found = np.linalg.solve(system, np.append(-gap[on], sums))
        pressure = np.zeros(gap.size)
        pressure[on] = found[:on.size]
        bad = pressure < 0
        if bad.any():
            active = active & ~bad
            continue
        opening = gap + matrix[:, on] @ pressure[on] - rigid @ found[on.size:]
        late = (opening < -1e-15) & ~active
        if not late.any():
            return pressure, found[on.size], found[on.size + 1] if free > 1 else 0.0, opening
        active = active | late
    raise RuntimeError("the active set does not settle")


def _stretches(active, low, high) -> list:
    """Runs of neighbouring active cells as (first, last) numbers."""
    joined = np.isclose(high[:-1], low[1:], rtol=0, atol=1e-12) & active[:-1] & active[1:]
    starts = np.flatnonzero(active & ~np.append(False, joined))
    ends = np.flatnonzero(active & ~np.append(joined, False))
    return list(zip(starts, ends))


def _edge(place, square, side: int) -> float:
    """Where the square of the pressure ends, by a line through the cells second and third from the edge."""
    if square.size < 4:
        return np.nan
    first, second = (1, 2) if side < 0 else (-2, -3)
    slope = (square[second] - square[first]) / (place[second] - place[first])
    return place[first] - square[first] / slope if slope else np.nan


def _values(pair: Pair, case: Case, level: tuple, length: float, alike: bool) -> dict:
    low, high, matrix, pressure, delta, theta = level
    middle, size = (low + high) / 2, high - low
    active = pressure > 0
    ends = []
    for first, last in _stretches(active, low, high):
        part = slice(first, last + 1)
        left, right = (_edge(middle[part], pressure[part]**2, side) for side in (-1, 1))
        ends.append((left if np.isfinite(left) and abs(left - low[first]) < 2 * size[first] else low[first],
                     right if np.isfinite(right) and abs(right - high[last]) < 2 * size[last] else high[last]))
    ends = np.array(ends)
    force = pressure * size * case.width
    load, moment = force.sum(), force @ middle
    on = np.ix_(active, active)
    areas = size[active] * case.width

    def stiffness(of, motion):
        return float(np.linalg.solve(of, motion) * areas @ motion)

    one = np.ones(active.sum())
    out = {"contact_fraction": np.diff(ends).sum() / length, "pressure_peak": pressure.max(), "approach": delta,
           "rotation": theta, "contact_half_width": (ends[-1, 1] - ends[0, 0]) / 2, "moment": moment,
           "pressure_centre": moment / load, "loaded_fraction": load / (case.width * length * pressure.max()),
           "normal_stiffness": stiffness(matrix[on], one),
           "rotational_stiffness": stiffness(matrix[on], middle[active])}
    if alike:
        shear = pair.matrix(middle[active], low[active], high[active], True)
        out["tangential_stiffness"] = stiffness(shear, one)
    return out


class Solution(NamedTuple):
    """Values by name, their changes from the level before, the last cell [m], the largest overlap left anywhere [m]."""

    values: dict
    changes: dict
    cell: float
    overlap: float


def solve(pair: Pair, case: Case, levels: int, first: int = 1600) -> Solution:
    """Press a pair on cells of the reach over `first`, halved up to `levels` times where the blocks touch."""
    length = pair.blocks[0].length
    alike = pair.blocks[0] == pair.blocks[1]
    edges = np.linspace(-REACH, REACH, first + 1) * length / 2 * 0.999
    low, high = edges[:-1], edges[1:]
    active, found, shown = None, [], np.linspace(0, 1, SAMPLES + 1)
    for level in range(levels + 1):
        middle = (low + high) / 2
        matrix = pair.matrix(middle, low, high)
        gap = case.gap(middle)
        if active is None:
            active = gap < np.quantile(gap, 0.05)
        pressure, delta, theta, opening = _press(matrix, gap, middle, high - low, case, active)
        state = low, high, matrix, pressure, delta, theta
        found.append(_values(pair, case, state, length, alike))
        if level == levels:
            break
        least = case.gap(low[:, None] + (high - low)[:, None] * shown).min(axis=1) - gap + opening
        local = np.abs(np.gradient(opening, middle)) * (high - low)
        near = (pressure > 0) | (least < 0.5e-9 + local)
        near[1:] |= near[:-1]
        near[:-1] |= near[1:]
        if 2 * near.sum() > MAX_CELLS:
            break
        active = np.repeat(pressure[near] > 0, 2)
        half = (low[near] + high[near]) / 2
        low, high = np.stack([low[near], half], 1).ravel(), np.stack([half, high[near]], 1).ravel()
        if not active.any():
            raise RuntimeError("nothing touches")
    changes = {name: abs(value - found[-2][name]) for name, value in found[-1].items()}
    return Solution(found[-1], changes, float((high - low).min()), _missed(pair, case, state))


def _missed(pair: Pair, case: Case, level: tuple) -> float:
    """Largest overlap [m] between the blocks anywhere within the reach, which the chosen cells may have left out."""
    low, high, _, pressure, delta, theta = level
    on = pressure > 0
    places = np.linspace(-REACH, REACH, 40001) * pair.blocks[0].length / 2 * 0.999
    worst = 0.0
    for some in np.array_split(places, 20):
        opening = case.gap(some) - delta + theta * some + pair.matrix(some, low[on], high[on]) @ pressure[on]
        worst = max(worst, float(-opening.min()))
    return worst
