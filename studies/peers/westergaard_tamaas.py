"""How fast and how exact is the half-space solver against Tamaas on Westergaard's wavy surface, and finite elements?

Both solve the same discrete problem (waves of a half plane, Polonsky and Keer's iteration): at half of the closing load
p(0) is wrong by 7e-7, 1e-8 and 2e-9 and p(x) by 3.4e-3, 8.4e-4 and 2.1e-4 in the mean square at 256, 1024 and 4096
points in either program, in the same number of iterations (64, 117, 214). At the same tolerance of 1e-10 Tamaas 2.9.0
needs 0.7, 4.6 and 39 ms, patchfem 2.6, 5.7 and 18 ms. As exact as the grid allows is Tamaas at looser tolerances,
which patchfem refuses to hand out (residual above 1e-9): 0.5, 2.0 and 25 ms, that is 0.18, 0.35 and 1.4 of patchfem's
time. The compiled loop wins on short rows, where NumPy pays 40 us per iteration for calls, and loses from 4096 on.

Finite elements: patchfem has no periodic pieces, but half a wave between two lines of symmetry is the same problem
without approximation. p(0) is wrong by 1.6e-4, 4e-5 and 3e-5 with 16, 32 and 64 cells per half wave, p(x) by 3.1e-2,
1.6e-2 and 8e-3 in the mean square, all of it at the edge of the contact.

Run: python studies/peers/westergaard_tamaas.py
"""

import sys
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from peer import Peer, run
from westergaard_wave import HIGH, MATERIAL, MEAN, WAVE, Row, errors_of, finite_elements, ours, places

POINTS = (256, 1024, 4096)  # of one wave
TOLERANCES = {"patchfem": (1e-10, 1e-11), "Tamaas": (1e-6, 1e-8, 1e-10)}  # of each program's own residual
CELLS = (16, 32, 64)  # per half wave, finite elements
NEAR = 1.01  # a solve counts as exact as its grid when its L2 error is within this of the least of both programs


def theirs(peer: Peer, points: int, tolerance: float, count: bool) -> Row:
    """One timed solve of Tamaas."""
    found = peer.ask(points=points, tolerance=tolerance, wavelength=WAVE, amplitude=HIGH, material=MATERIAL, mean=MEAN,
                     count=count)
    return Row("Tamaas", points, tolerance, found["seconds"], found["iterations"],
               *errors_of(places(points), np.array(found["pressure"])))


def _median(rows: list) -> Row:
    first = rows[0]
    return Row(first.program, first.points, first.tolerance, float(np.median([r.seconds for r in rows])),
               first.iterations, first.top, first.mean_square)


def fastest(rows: list, program: str, points: int) -> Row:
    """The fastest row of a program that is as exact as its grid allows."""
    here = [r for r in rows if r.points == points]
    least = min(r.mean_square for r in here)
    return min((r for r in here if r.program == program and r.mean_square <= NEAR * least), key=lambda r: r.seconds)


def main(points=POINTS, repeats: int = 9, cells=CELLS) -> list:
    """Medians of all rows, printed with the ratios of time; Missing where Tamaas is absent."""
    with threadpool_limits(1), Peer("Tamaas", "peers/tamaas_child.py", "PATCHFEM_TAMAAS_PYTHON", sys.executable,
                                    "pip install tamaas") as peer:
        print(f"Tamaas {peer.version}")
        warm_up = ours(64, 1e-10), theirs(peer, 64, 1e-8, False)
        tries = {}
        for count in points:
            for k in range(repeats):
                for tolerance in TOLERANCES["patchfem"]:
                    tries.setdefault(("p", count, tolerance), []).append(ours(count, tolerance))
                for tolerance in TOLERANCES["Tamaas"]:
                    tries.setdefault(("T", count, tolerance), []).append(theirs(peer, count, tolerance, k == 0))
        rows = [_median(found) for found in tries.values()]
        del warm_up
    for row in rows:
        print(f"  {row.program:9} {row.points:5d} points  tolerance {row.tolerance:.0e}  {1e3 * row.seconds:7.2f} ms  "
              f"{row.iterations:4d} iterations  p(0) {row.top:+.1e}  mean square {row.mean_square:.2e}")
    for count in points:
        mine, other = (fastest(rows, name, count) for name in TOLERANCES)
        print(f"  {count:5d} points, as exact as the grid: Tamaas over patchfem {other.seconds / mine.seconds:.2f}")
    for count in cells:
        top, square = finite_elements(count)
        print(f"  finite elements {count:4d} cells per half wave  p(0) {top:+.1e}  mean square {square:.2e}")
    return rows


if __name__ == "__main__":
    raise SystemExit(run(main))
