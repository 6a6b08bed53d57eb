"""A half wave of the pieces between two lines of symmetry: what makes finite elements periodic, exactly.

On a line of symmetry of the pressure there is no motion along x and no shear, so the wave of a piece that goes on for
ever is the problem of a strip of half a wave, its two sides guided. The unknowns along x of the sides are taken out
of the assembled stiffness by a unit row, which leaves its columns alike in size, as the condensation wants them.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import diags
from stiffness import stencil_of, stiffness_of

from patchfem.closed_forms import contact as exact
from patchfem.contact.unilateral import press
from patchfem.core import Compliance, Interface, Pressure, frozen_array
from patchfem.elasticity.elasticity import (
    Layers,
    Piece,
    assemble,
    displacement,
    interface_compliance,
)
from patchfem.mesh.tensor import TensorGrid, graded_rows

EVEN = 0.1  # depth of even rows over the wave
DEPTH = 2.0  # height of the strip over the wave: what the far face holds fades as exp(-4 pi)


def strip_grid(wave: float, cells: int, coating: float = 0.0, growth: float = 1.1) -> TensorGrid:
    """Even columns from 0 to wave/2 [m], rows of the same size to EVEN of the wave, then growing by growth^(8/cells):
    twice the cells are twice the rows everywhere. At least `cells`/2 rows in the coating."""
    fine, growth = wave / 2 / cells, growth ** (16 / cells)
    top = EVEN * wave if not coating else min(EVEN * wave, coating)
    rows = np.full(max(round(top / fine), cells // 2 if coating else 1), 0.0)
    rows[:] = top / rows.size
    coated = rows.size
    if coating > top:
        more = graded_rows(rows[-1] * growth, coating - top, growth)
        rows, coated = np.concatenate([rows, more]), rows.size + more.size
    under = graded_rows(rows[-1] * growth, DEPTH * wave + coating - rows.sum(), growth)
    depth = np.concatenate([[0.0], np.cumsum(rows), rows.sum() + np.cumsum(under)])
    return TensorGrid(np.linspace(0, wave / 2, cells + 1), depth, coated if coating else 0)


def guided(grid: TensorGrid, layers: Layers) -> Piece:
    """The piece with its sides free to slide up and down but not along x."""
    piece = assemble(grid.x, grid.depth, grid.coating_rows, layers)
    held = np.zeros((grid.x.size, grid.depth.size - 1, 2), bool)
    held[[0, -1], :, 0] = True
    free = diags((~held.ravel()).astype(float))
    whole = stiffness_of(piece)
    matrix = (free @ whole @ free + diags(float(whole.diagonal().mean()) * held.ravel())).tocsr()
    return replace(piece, computed={"stencil": stencil_of(matrix, grid.x.size)})


def strip_compliance(grid: TensorGrid, layers: Layers) -> np.ndarray:
    """(nx, nx) inward motion per inward nodal force of one guided piece per unit width [m2/N]."""
    return interface_compliance(guided(grid, layers))[0]


def harmonic_compliance(grid: TensorGrid, layers: Layers) -> float:
    """C(k) [m/Pa] of one piece for the wave of the strip, from the work of p = cos(k x) on its own displacement."""
    k = np.pi / grid.x[-1]
    h = grid.x[1] - grid.x[0]
    # consistent with straight shape functions
    force = h * np.cos(k * grid.x) * 2 * (1 - np.cos(k * h)) / (k * h) ** 2
    force[[0, -1]] /= 2
    motion = displacement(guided(grid, layers), 0 * force, force)[0].reshape(grid.x.size, -1, 2)[
        :, 0, 1
    ]
    return float(force @ motion / (grid.x[-1] / 2))


def wavy_pair(cells: int, wave: float, material: tuple) -> Compliance:
    """Two guided pieces of one material with `cells` per half wave [m], per unit width."""
    grid = strip_grid(wave, cells)
    normal = 2 * strip_compliance(grid, Layers(material, material, "strain"))
    return Compliance(Interface(grid.x, frozen_array(grid.tributary()), 1.0), normal, normal)


def wavy_press(pair: Compliance, share: float, amplitude: float, modulus: float) -> Pressure:
    """The pair pressed on the gap A (1 - cos(2 pi x/wave)), E* = `modulus` [Pa]; the crest is the first node, x = 0,
    and the mean pressure the `share` of that which closes it."""
    x, wave = pair.interface.x, 2 * pair.interface.length
    mean = share * exact.westergaard_full_pressure(wave, amplitude, modulus)
    return press(pair, 2 * amplitude * np.sin(np.pi * x / wave) ** 2, mean * wave / 2)
