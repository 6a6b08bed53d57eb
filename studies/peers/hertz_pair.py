"""The Hertz pair of `hertz_getfem`: its mesh, its errors against the closed form, and patchfem's timed answer."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from peer import measure_seconds

from patchfem.closed_forms import contact as exact
from patchfem.contact import press
from patchfem.contact.gaps import crown, tilt
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity import Layers, Piece, interface_compliance
from patchfem.mesh import TensorGrid
from patchfem.mesh.tensor import graded_rows

HALF = 0.1e-3  # half width a of the contact [m]
LOAD = 9107.0  # [N/m] load
MATERIAL = (121e9, 0.32)
MODULUS = exact.combined_modulus(*MATERIAL)
RADIUS = np.pi * MODULUS * HALF**2 / (4 * LOAD)
PEAK = exact.hertz_peak(LOAD, RADIUS, MODULUS)
LENGTH = 40e-3  # [m] 200 half widths, at which the half planes of Hertz are valid within 1e-5
HEIGHT = 20e-3  # [m] height of each body
GROWTH = 1.15
# (load factor, tilt [rad]) of each step; later steps start from the previous solution
STEPS = (
    (1.0, 0.0),
    (1.3, 0.0),
    (1.3, 0.1 * HALF / RADIUS),
)
FORMS = {"mirror": 1, "pair": 2}  # number of bodies that are assembled


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """Result of one program on one mesh.

    Contains CPU seconds of assembly, condensation or factors, and contact (`cold`) and of a further
    step (`warm`); errors of p(0), of the half width from p^2 inside 0.8 a, and of the pressure
    inside 0.9 a (rms over p0); pressures (steps, m) [Pa].
    """

    program: str
    form: str
    cells: int
    dofs: int
    cold: float
    warm: float
    errors: tuple
    pressure: np.ndarray


def _line(fine: float, even: float, total: float) -> np.ndarray:
    """Return points from 0 to `total` with cells of `fine` up to `even`, growing from there."""
    return np.concatenate(
        [
            np.arange(round(even / fine) + 1) * fine,
            even + np.cumsum(graded_rows(fine * GROWTH, total - even, GROWTH)),
        ]
    )


def make_grid(cells: int) -> TensorGrid:
    """Make a grid with cells of HALF/cells along 1.25 a and down to a.

    Even rows down to a cost little; rows that grow from the face on have an error of 5e-4 in p(0).
    """
    fine = HALF / cells
    right = _line(fine, 1.25 * HALF, LENGTH / 2)
    return TensorGrid(np.concatenate([-right[:0:-1], right]), _line(fine, HALF, HEIGHT), 0)


def compute_errors(x, p) -> tuple:
    """Return relative errors of nodal pressures (m,) [Pa]: p(0), half width, and rms inside 0.9 a over p0."""
    near = np.abs(x) < 0.8 * HALF
    inside = np.abs(x) < 0.9 * HALF
    slope, top = np.polyfit((x[near] / HALF) ** 2, (p[near] / PEAK) ** 2, 1)
    miss = p[inside] - exact.hertz_pressure(x[inside], LOAD, RADIUS, MODULUS)
    return (
        p[x.size // 2] / PEAK - 1,
        np.sqrt(-top / slope) - 1,
        float(np.sqrt(np.mean(miss**2)) / PEAK),
    )


def condense_pair(grid: TensorGrid, bodies: int) -> Compliance:
    """Condense the pair from its meshes: one piece counted twice, or both pieces assembled and condensed."""
    layers = Layers(MATERIAL, MATERIAL, "strain")
    parts = [interface_compliance(Piece(grid, layers)) for _ in range(bodies)]
    low = parts[0]
    high = parts[-1]
    return Compliance(
        Interface(grid.x, frozen_array(grid.tributary_lengths()), 1.0),
        low[0] + high[0],
        low[1] + high[1],
    )


def ours(cells: int, form: str) -> Row:
    """Solve by patchfem on one mesh, without stored results."""
    grid = make_grid(cells)
    shape = crown(grid.x, RADIUS)
    pair, making = measure_seconds(lambda: condense_pair(grid, FORMS[form]))
    state, solving = measure_seconds(lambda: press(pair, shape, LOAD))
    found = [state]
    warm = []
    for factor, angle in STEPS[1:]:
        gap = shape + tilt(grid.x, angle)
        start = found[-1].sigma_n > 0
        state, seconds = measure_seconds(
            lambda gap=gap, factor=factor, start=start: press(
                pair, gap, factor * LOAD, rotation=0.0, start=start
            ),
            5,
        )
        found.append(state)
        warm.append(seconds)
    p = np.array([one.sigma_n for one in found])
    dofs = FORMS[form] * 2 * grid.x.size * (grid.depth.size - 1)
    return Row(
        "patchfem",
        form,
        cells,
        dofs,
        making + solving,
        float(np.mean(warm)),
        compute_errors(grid.x, p[0]),
        p,
    )
