"""How fast and how exact is the condensed contact against GetFEM on the same Hertz pair?

Two alike blocks of 40 x 20 mm, a = 0.1 mm, the crown in the gap, one tensor grid and one thread for both programs,
medians of three on a busy machine. With the corner rule on the interface GetFEM 5.4.2 (augmented Lagrangian, symmetric
Newton, MUMPS) solves the very same discrete problem and finds the same pressures to 2e-12, with both pieces, where it
looks nodes up across the faces, to 9e-5.

                     a/8                a/16               a/32
  rms error, nodal   2.7e-3             1.7e-4             8.0e-5      both programs
  rms error, gauss   3.1e-2             2.8e-3             4.5e-4      GetFEM's integral contact, sawtooth at the edge
  one piece (mirror) 0.06 / 0.21 / 0.25 0.15 / 0.45 / 0.60 0.30 / 1.1 / 1.1 s cold, patchfem / nodal / gauss
  both pieces        0.11 / 0.56 / 0.73 0.23 / 1.4 / 1.7   0.60 / 4.0 / 4.0 s

So cold, with the same reduction, GetFEM takes 3 to 4 times as long on one piece and 5 to 8 times on two. At equal error
its nodal form keeps these ratios, its integral contact takes 9 to 11 times (one piece) and 13 to 23 times (two) as
long; against a patchfem that condenses one of two alike pieces, 9 to 14 times at the same mesh. Every further load or
tilt costs patchfem 0.1 to 0.3 ms and GetFEM a new factorisation per Newton step, 800 to 3000 times as much on one piece
and 2200 to 14000 times on two.

Run: python studies/peers/hertz_getfem.py
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from peer import Peer, ratio_text, run, seconds_at, timed

from patchfem import closed_forms as exact
from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import press
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity.elasticity import Layers, assemble, interface_compliance
from patchfem.mesh.tensor import TensorGrid, graded_rows

HALF = 0.1e-3  # half width a of the contact [m]
LOAD = 9107.0  # [N/m]
MATERIAL = (121e9, 0.32)
MODULUS = exact.combined_modulus(*MATERIAL)
RADIUS = np.pi * MODULUS * HALF**2 / (4 * LOAD)
PEAK = exact.hertz_peak(LOAD, RADIUS, MODULUS)
LENGTH, HEIGHT = 40e-3, 20e-3  # 200 half widths to the nearest far face: the half planes of Hertz to 1e-5
GROWTH = 1.15
STEPS = ((1.0, 0.0), (1.3, 0.0), (1.3, 0.1 * HALF / RADIUS))  # (load factor, tilt [rad]): the first cold, then warm
FINENESS = (8, 16, 32)  # cells per half width
FORMS = {"mirror": 1, "pair": 2}  # bodies that are assembled
PEERS = ("nodal", "gauss")


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """One program on one mesh. cold: CPU s of assembly, condensation or factors, contact; warm: of a further step;
    errors: of p(0), of the half width from p^2 inside 0.8 a, of the pressure inside 0.9 a in the mean square over p0;
    pressure: (steps, m) [Pa] of the steps."""

    program: str
    form: str
    cells: int
    dofs: int
    cold: float
    warm: float
    errors: tuple
    pressure: np.ndarray


def _line(fine: float, even: float, total: float) -> np.ndarray:
    """Points from 0 to `total`: cells of `fine` up to `even`, growing from there."""
    return np.concatenate([np.arange(round(even / fine) + 1) * fine,
                           even + np.cumsum(graded_rows(fine * GROWTH, total - even, GROWTH))])


def grid_of(cells: int) -> TensorGrid:
    """Piece with HALF/cells along 1.25 a and down to a; even rows to the depth a cost little and cure the floor of
    5e-4 in p(0) that rows growing from the face on leave."""
    fine = HALF / cells
    right = _line(fine, 1.25 * HALF, LENGTH / 2)
    return TensorGrid(np.concatenate([-right[:0:-1], right]), _line(fine, HALF, HEIGHT), 0)


def errors_of(x, p) -> tuple:
    """Relative errors (p(0), half width, mean square inside 0.9 a over p0) of nodal pressures (m,) [Pa]."""
    near, inside = np.abs(x) < 0.8 * HALF, np.abs(x) < 0.9 * HALF
    slope, top = np.polyfit((x[near] / HALF)**2, (p[near] / PEAK)**2, 1)
    miss = p[inside] - exact.hertz_pressure(x[inside], LOAD, RADIUS, MODULUS)
    return p[x.size // 2] / PEAK - 1, np.sqrt(-top / slope) - 1, float(np.sqrt(np.mean(miss**2)) / PEAK)


def condensed(grid: TensorGrid, bodies: int) -> Compliance:
    """The pair from its meshes on: one piece doubled, or both pieces assembled and condensed."""
    layers = Layers(MATERIAL, MATERIAL, "strain")
    parts = [interface_compliance(assemble(grid.x, grid.depth, 0, layers)) for _ in range(bodies)]
    low, high = parts[0], parts[-1]
    return Compliance(Interface(grid.x, frozen_array(grid.tributary()), 1.0), low[0] + high[0], low[1] + high[1])


def ours(cells: int, form: str) -> Row:
    """patchfem on one mesh, nothing kept from before."""
    grid = grid_of(cells)
    shape = crown(grid.x, RADIUS)
    pair, making = timed(lambda: condensed(grid, FORMS[form]))
    state, solving = timed(lambda: press(pair, shape, LOAD))
    found, warm = [state], []
    for factor, angle in STEPS[1:]:
        gap, start = shape + tilt(grid.x, angle), found[-1].sigma_n > 0
        state, seconds = timed(lambda gap=gap, factor=factor, start=start: press(
            pair, gap, factor * LOAD, rotation=0.0, start=start), 5)
        found.append(state)
        warm.append(seconds)
    p = np.array([one.sigma_n for one in found])
    dofs = FORMS[form] * 2 * grid.x.size * (grid.depth.size - 1)
    return Row("patchfem", form, cells, dofs, making + solving, float(np.mean(warm)), errors_of(grid.x, p[0]), p)


def theirs(peer: Peer, cells: int, form: str, quadrature: str) -> Row:
    """GetFEM on the same mesh and gap; units mm, N, MPa, its start the overlap of 1.4 a."""
    grid = grid_of(cells)
    newton = LOAD * 1e-3
    steps = [{"N": factor * newton, "crown": 1e-3 / RADIUS, "tilt": angle} for factor, angle in STEPS]
    found = peer.ask(x=(grid.x * 1e3).tolist(), depth=(grid.depth * 1e3).tolist(), bodies=FORMS[form],
                     material=(MATERIAL[0] * 1e-6, MATERIAL[1]), quadrature=quadrature, steps=steps,
                     augmentation=1e6, limit=1e-8 * newton, start=FORMS[form] * 0.49 * HALF**2 / RADIUS * 1e3)
    p = np.array(found["pressure"]) * 1e6
    return Row(f"GetFEM {quadrature}", form, cells, found["dofs"], found["build"] + found["solve"],
               float(np.mean(found["warm"])), errors_of(grid.x, p[0]), p)


def _median(rows: list) -> Row:
    first = rows[0]
    return Row(first.program, first.form, first.cells, first.dofs, float(np.median([r.cold for r in rows])),
               float(np.median([r.warm for r in rows])), first.errors, first.pressure)


def agreement(one: Row, other: Row) -> float:
    """Largest difference of the pressures of all steps over the largest pressure."""
    return float(np.abs(one.pressure - other.pressure).max() / one.pressure.max())


def _line_of(row: Row) -> str:
    return (f"{row.program:13} a/{row.cells:<3} {row.dofs:6d} dofs  cold {row.cold:6.3f} s  "
            f"further {1e3 * row.warm:8.2f} ms  p(0) {row.errors[0]:+.1e}  half width {row.errors[1]:+.1e}  "
            f"rms {row.errors[2]:.1e}")


def ratios(rows: list) -> list:
    """Of one form: (peer row, its cold time over ours at the same mesh, at the same rms error, its further step)."""
    mine = [r for r in rows if r.program == "patchfem"]
    out = []
    for row in (r for r in rows if r.program != "patchfem"):
        same = next(r for r in mine if r.cells == row.cells)
        at, sign = seconds_at(row.errors[2], [r.errors[2] for r in mine], [r.cold for r in mine])
        out.append((row, row.cold / same.cold, ratio_text(row.cold, at, sign), row.warm / same.warm))
    return out


def main(fineness=FINENESS, repeats: int = 3, forms=tuple(FORMS), peers=PEERS) -> dict:
    """form -> medians of all rows, printed with the ratios of time; Missing where GetFEM is absent."""
    out = {}
    with threadpool_limits(1), Peer("GetFEM", "peers/getfem_child.py", "PATCHFEM_GETFEM_PYTHON", "/usr/bin/python3",
                                    "install python3-getfem (Debian)") as peer:
        print(f"GetFEM {peer.version}")
        ours(4, "mirror"), theirs(peer, 4, "mirror", "nodal")  # first calls load and compile
        for form in forms:
            tries = {}
            for cells in (4, *fineness):
                for _ in range(repeats):
                    tries.setdefault(("patchfem", cells), []).append(ours(cells, form))
                    for kind in peers if cells != 4 else ():
                        tries.setdefault((kind, cells), []).append(theirs(peer, cells, form, kind))
            rows = out[form] = [_median(found) for found in tries.values()]
            print(f"{form}: {FORMS[form]} of the two pieces assembled")
            for row in rows:
                print("  " + _line_of(row))
            for row, cold, equal, warm in ratios(rows):
                print(f"  {row.program:13} a/{row.cells:<3} over patchfem: cold {cold:.1f} at the same mesh, {equal} "
                      f"at the same rms error; further step {warm:.0f}")
        if len(out) == 2:
            for mine, other in ((m, o) for m in out["mirror"] for o in out["pair"]
                                if m.program == "patchfem" and o.program != "patchfem" and m.cells == o.cells):
                print(f"both pieces in {other.program} a/{other.cells} over one of two in patchfem: "
                      f"cold {other.cold / mine.cold:.1f}")
    return out


if __name__ == "__main__":
    raise SystemExit(run(main))
