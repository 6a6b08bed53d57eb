"""Random benches with [contact.shear] against a separate partial-slip solver.

Campaign `partial-slip` of `campaigns`. The benches are crowned, tilted or both, coated or not, and
slide by 0.02 to 2 of the relative displacement at which the whole patch slips, at tolerances of
1e-2 to 1e-4.

The solver shares nothing with patchfem. Half of a pair is a grid of biquadratic elements, assembled
as sums of Kronecker products. Pressure and shear are constant on the cells of the interface;
contact and stick hold for the averages over cells. With the limits g = mu p of the cells, the
missing shear r = g - t at the slide q solves r >= 0, C r >= C g - q, r (C r - C g + q) = 0, and
Masing's rule gives the loop. Each bench is solved on two grids; their difference is the uncertainty
of the reference.
"""

from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from scipy.interpolate import PchipInterpolator
from scipy.sparse import bmat, csc_matrix, kron, lil_matrix
from scipy.sparse.linalg import splu

import patchfem as pf

MATERIALS = (("steel", 210e9, 0.3), ("titanium", 121e9, 0.32), ("aluminium", 70e9, 0.33))
COATING = 250e9, 0.24  # Young's modulus [Pa] and Poisson's ratio
MASS = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30  # quadratic element of length 1
STIFFNESS = np.array([[7, -8, 1], [-8, 16, -8], [1, -8, 7]]) / 3
# Derivative of the row's function times the column's function.
GRADIENT = np.array([[-3, -4, 1], [4, 0, -4], [-1, 4, 3]]) / 6


def line_matrix(element, lengths, scale):
    """Return the matrix (2 n + 1, 2 n + 1) of quadratic elements; scale: (n,) factor of each."""
    out = lil_matrix((2 * lengths.size + 1, 2 * lengths.size + 1))
    for k, factor in enumerate(scale):
        out[2 * k : 2 * k + 3, 2 * k : 2 * k + 3] += factor * element
    return csc_matrix(out)


def stiffness_of(columns, rows, young, poisson):
    """Return the stiffness of a grid in plane strain, with the last row fixed.

    The unknowns are all u, then all v, with x before y.

    Parameters
    ----------
    columns, rows : (n + 1,), (m + 1,) array
        Grid lines [m].
    young, poisson : (m,) array
        Of each row.
    """
    hx = np.diff(columns)
    hy = np.diff(rows)
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = young / (2 + 2 * poisson)
    mass, stiff, grad = (
        line_matrix(*part)
        for part in ((MASS, hx, hx), (STIFFNESS, hx, 1 / hx), (GRADIENT, hx, np.ones(hx.size)))
    )
    free = 2 * hy.size

    def along_y(element, lengths, scale):
        return line_matrix(element, lengths, scale)[:free, :free]

    def terms(a, b):
        return kron(stiff, along_y(MASS, hy, a * hy)) + kron(mass, along_y(STIFFNESS, hy, b / hy))

    mixed = kron(grad, along_y(GRADIENT, hy, lame).T) + kron(grad.T, along_y(GRADIENT, hy, shear))
    uu = terms(lame + 2 * shear, shear)
    vv = kron(stiff, along_y(MASS, hy, shear * hy)) + kron(
        mass, along_y(STIFFNESS, hy, (lame + 2 * shear) / hy)
    )
    return csc_matrix(bmat([[uu, mixed], [mixed.T, vv]])), free


def compliances(columns, rows, young, poisson, cells, width):
    """Return normal and tangential compliance (k, k) [m/N] of both pieces.

    They relate averages over cells.
    """
    matrix, free = stiffness_of(columns, rows, young, poisson)
    size = matrix.shape[0]
    order = np.argsort(np.tile(np.repeat(np.arange(2 * columns.size - 1), free), 2), kind="stable")
    factor = splu(
        matrix[order][:, order],
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    place = np.empty(size, int)
    place[order] = np.arange(size)
    out = []
    for offset in (size // 2, 0):  # v for pressure, u for shear
        nodes = np.array([[place[offset + (2 * c + k) * free] for k in range(3)] for c in cells])
        found = np.empty((len(cells), len(cells)))
        for first in range(0, len(cells), 64):
            part = nodes[first : first + 64]
            load = np.zeros((size, len(part)))
            for column, triple in enumerate(part):
                load[triple, column] = (1 / 6, 4 / 6, 1 / 6)
            moved = factor.solve(load)
            found[:, first : first + 64] = (
                moved[nodes[:, 0]] + 4 * moved[nodes[:, 1]] + moved[nodes[:, 2]]
            ) / 6
        out.append((found + found.T) / width)
    return out


def complementary(matrix, right, load=None):
    """Solve the complementarity problem f >= 0, matrix f - right - d >= 0.

    d is 0, or such that sum f = load.
    """
    active = np.ones(right.size, bool)
    for _ in range(200):
        index = np.flatnonzero(active)
        ones = np.ones(index.size)
        block = matrix[np.ix_(index, index)]
        both = (
            np.linalg.solve(block, np.stack([right[index], ones], axis=1))
            if index.size
            else np.zeros((0, 2))
        )
        level = 0.0 if load is None else (load - both[:, 0].sum()) / both[:, 1].sum()
        force = np.zeros(right.size)
        force[index] = both[:, 0] + level * both[:, 1]
        apart = matrix @ force - right - level
        following = np.where(active, force > 0, apart < -1e-14 * np.abs(right).max())
        if (following == active).all():
            return force, level
        active = following
    raise RuntimeError("active set cycles")


def spaced(start, stop, size):
    """Return positions from start to stop with steps of about size(x)."""
    x = start
    out = [start]
    while x < stop:
        x += size(x + size(x) / 2)
        out.append(x)
    out = np.array(out)
    return start + (out - start) * (stop - start) / (out[-1] - start)


class Bench:
    """A bench in SI: pieces, shapes, law, slide and tolerance."""

    def __init__(self, seed):
        draw = np.random.default_rng(seed)
        self.kind = draw.choice(["crown", "tilt", "both"])
        self.length = draw.uniform(10e-3, 60e-3)
        self.width = draw.uniform(5e-3, 45e-3)
        self.height = draw.uniform(3e-3, 25e-3)
        self.load = 10 ** draw.uniform(1.5, 4)
        self.name, self.young, self.poisson = MATERIALS[draw.integers(3)]
        self.static = draw.uniform(0.1, 0.6)
        self.thick = draw.choice([0.0, 1.0], p=[0.6, 0.4])
        self.thick *= draw.uniform(50e-6, 400e-6)
        plane = self.young / (1 - self.poisson**2)
        reach = draw.uniform(0.15, 1.8) * self.length / 2  # half-width of Hertz
        self.radius = reach**2 * np.pi * plane / 2 / (4 * self.load / self.width)
        opening = 2 * self.load * 2 * self.height / (plane * self.length * self.width) / self.length
        self.angle = 10 ** draw.uniform(-0.7, 1.5) * opening
        self.crowned, self.tilted = self.kind != "tilt", self.kind != "crown"
        if self.kind == "both":
            self.angle *= 0.3
        self.share = 10 ** draw.uniform(np.log10(0.02), np.log10(2))
        self.tolerance = draw.choice(["1e-2", "1e-3", "1e-3", "1e-4"])
        self.cycles = int(draw.integers(2, 4))
        self.amplitude = None

    def gap(self, x):
        """Return the gap [m] of the unloaded faces at x [m]."""
        return (x**2 / (2 * self.radius) if self.crowned else 0.0) + (
            self.angle * x if self.tilted else 0.0
        )

    def text(self):
        """Return the text of the scene, for which the amplitude must be set."""
        out = [
            f'[contact]\nlength = "{self.length!r} m"\nwidth = "{self.width!r} m"\nheight = "{self.height!r} m"',
            f'load = "{self.load!r} N"',
            f'substrate = {{young = "{self.young!r} Pa", poisson = {self.poisson!r}, density = "7000 kg/m^3"}}',
        ]
        if self.thick:
            out += [
                f'[contact.coating]\nthickness = "{self.thick!r} m"',
                "material = {young = "
                f'"{COATING[0]!r} Pa", poisson = {COATING[1]!r}, density = "14500 kg/m^3"}}',
            ]
        out += [f'[contact.crown]\nradius = "{self.radius!r} m"'] if self.crowned else []
        out += [f'[contact.tilt]\nangle = "{self.angle!r} rad"'] if self.tilted else []
        out += [
            '[contact.shear]\n[friction]\nlaw = "coulomb"',
            f"static = {self.static!r}",
            '[slide]\nkind = "sine"',
            f'amplitude = "{self.amplitude!r} m"',
            f'frequency = "10 Hz"\ncycles = {self.cycles}\n',
        ]
        return "\n".join(out).replace("np.float64(", "").replace(")", "")


class Reference:
    """Solution of a bench by this solver; fine: number of cells relative to the coarse grid."""

    def __init__(self, bench, fine):
        self.bench = bench
        half = bench.length / 2
        cells = spaced(-half, half, lambda x: bench.length / 80)
        low = -half
        high = half
        for _ in range(3):  # grids that zoom in on the contact
            centre = (cells[1:] + cells[:-1]) / 2
            chosen = np.flatnonzero((centre > low) & (centre < high))
            normal, _ = self._matrices(cells, chosen, 1.0)
            force, _ = complementary(normal, -bench.gap(centre[chosen]), bench.load)
            ends = self._ends(cells, chosen, force)
            wide = ends[1] - ends[0]
            cells = spaced(-half, half, self._sizes(ends, 1 / 40, 0.25))
            low = max(ends[0] - 0.2 * wide, -half)
            high = min(ends[1] + 0.2 * wide, half)
        self.ends = ends
        cells = spaced(-half, half, self._sizes(ends, 4e-4 / fine, 0.12 / fine))
        centre = (cells[1:] + cells[:-1]) / 2
        margin = 0.02 * wide
        chosen = np.flatnonzero((centre > ends[0] - margin) & (centre < ends[1] + margin))
        normal, shear = self._matrices(cells, chosen, fine)
        force, _ = complementary(normal, -bench.gap(centre[chosen]), bench.load)
        index = np.flatnonzero(force > 0)
        self.shear = shear[np.ix_(index, index)]
        self.limit = bench.static * force[index]
        self.stiffness = float(np.linalg.solve(self.shear, np.ones(index.size)).sum())

    def _sizes(self, ends, least, slope):
        """Return the cell length as a function of x for a contact between `ends`.

        `least` is its fraction of the contact at the open ends.
        """
        half = self.bench.length / 2
        wide = ends[1] - ends[0]
        inside = wide * max(least, 1 / 60 * slope / 0.12)
        open_ends = [end for end in ends if abs(end) < half * (1 - 1e-9)]

        def size(x):
            out = (
                min([wide * least + slope * abs(x - end) for end in open_ends] + [inside])
                if ends[0] <= x <= ends[1]
                else min([wide * least + slope * abs(x - end) for end in ends])
            )
            corner = self.bench.length * 2e-3 + 3 * slope * min(half - x, half + x)
            return min(out, max(corner, self.bench.length * 1e-3), self.bench.length / 12)

        return size

    def _ends(self, cells, chosen, force):
        """Return the ends of the contact [m]."""
        loaded = np.flatnonzero(force > 0)
        first = chosen[loaded[0]]
        last = chosen[loaded[-1]]
        return float(cells[first]), float(cells[last + 1])

    def _matrices(self, cells, chosen, fine):
        bench = self.bench
        near = float(np.diff(cells)[chosen].min())

        def size(y):
            far = bench.height * 4e-3 + 0.5 / fine * (bench.height - y)
            at_coat = (
                np.inf if not bench.thick else bench.thick / 3 + 0.4 / fine * abs(y - bench.thick)
            )
            return max(min(near + 0.35 / fine * y, far, at_coat), near)

        rows = spaced(0.0, bench.height, size)
        if bench.thick:
            rows = np.append(
                spaced(0.0, bench.thick, size), spaced(bench.thick, bench.height, size)[1:]
            )
        middle = (rows[1:] + rows[:-1]) / 2
        young = np.where(middle < bench.thick, COATING[0], bench.young)
        poisson = np.where(middle < bench.thick, COATING[1], bench.poisson)
        return compliances(cells, rows, young, poisson, chosen, bench.width)

    def measures(self):
        """Return the measures by their names in patchfem."""
        bench = self.bench
        amplitude = self.bench.amplitude
        free = self.shear @ self.limit
        slides = amplitude * (np.arange(161) / 160) ** 2
        lack = np.array(
            [
                self.stiffness * q - self.limit.sum() + complementary(self.shear, free - q)[0].sum()
                for q in slides
            ]
        )
        lack[0] = 0.0
        curve = PchipInterpolator(slides, np.maximum(lack, 0.0))
        area = curve.antiderivative()

        def loop(a):
            return float(4 * a * curve(a) - 8 * area(a))

        force = self.stiffness * amplitude - float(curve(amplitude))
        stored = (
            float(-area(amplitude) - 4 * area(amplitude / 2) + amplitude * curve(amplitude))
            - loop(amplitude) / 4
            - loop(amplitude / 2) / 2
        )
        lost = (
            loop(amplitude) / 4 + (bench.cycles - 0.5) * loop(amplitude) + loop(amplitude / 2) / 2
        )
        angle = (np.arange(4000) + 0.5) * np.pi / 4000
        back = curve(amplitude) - 2 * curve(amplitude * (1 - np.cos(angle)) / 2)
        end = float(curve(amplitude) - 2 * curve(amplitude / 2))
        return {
            "tangential_stiffness": self.stiffness,
            "loop_area": loop(amplitude),
            "slip_amplitude": loop(amplitude) / (4 * self.limit.sum()),
            "friction_force_peak": force,
            "secant_stiffness": force / amplitude,
            "energy_stored": stored,
            "energy_dissipated": lost,
            "friction_work": lost + stored,
            "friction_ratio_peak": force / bench.load,
            "friction_ratio_end": end / bench.load,
            "equivalent_stiffness": self.stiffness
            - float(2 / np.pi / amplitude * np.mean(back * np.cos(angle)) * np.pi),
        }


def solve_bench(seed: int) -> tuple:
    """Return a bench, its measures on the fine grid, and their differences from the coarse grid."""
    bench = Bench(seed)
    fine = Reference(bench, 1.5)
    coarse = Reference(bench, 1.0)
    bench.amplitude = float(bench.share * bench.static * bench.load / fine.stiffness)
    found = fine.measures()
    other = coarse.measures()
    return bench, found, {name: abs(value - other[name]) for name, value in found.items()}


def compare_bench(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare a bench with its reference; see `campaigns`."""
    if earlier and "true" in earlier:
        bench = Bench(seed)
        true = earlier["true"]
        doubt = earlier["doubt"]
        bench.amplitude = earlier["amplitude"]
    else:
        bench, true, doubt = solve_bench(seed)
    begin = process_time()
    result = pf.run(bench.text(), **{"accuracy.tolerance": float(bench.tolerance)})
    return {
        "group": bench.kind,
        "engine": "coated" if bench.thick else "bare",
        "seconds": process_time() - begin,
        "warnings": list(result.warnings),
        "true": true,
        "doubt": doubt,
        "amplitude": bench.amplitude,
        "rows": measure_rows(result.measures, true, doubt),
    }
