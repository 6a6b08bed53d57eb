"""How long does an unstructured pair of 1e6 unknowns take, and which factors are the fastest?

About 7 s of one processor and 1.45 GB with the package's own fronts, which need no library beside SciPy: as fast as
CHOLMOD or Pardiso, so they are the default and the others serve to check them. Two unlike pieces of triangles,
1 005 708 unknowns, 401 interface nodes, graded towards the interface; both factors kept; a process of its own, one
thread, AMD EPYC 2.6 GHz, a busy machine. Seconds of the processor for order, stiffness and factors | both compliances |
contact under a tilt, and the largest memory:

    fronts    10.0 | 0.03 | 0.02   1.8 GB      cholmod    9.2 | 0.9 | 0.02   2.5 GB
    pardiso   11.2 | 0.04 | 0.02   1.7 GB      superlu   12.8 | 5.2 | 0.02   5.3 GB

That table is of version 0.4, whose stiffness took 2 s a piece; the peak pressure of the four agreed to 3e-11. Now the
stiffness takes .6 s and the fronts 6.9 s and 1.45 GB, where 0.4 took 10.9 s and 1.83 GB minutes before on the same
machine. Of the 3.4 s of a piece the order takes .8, the factors 1.6.

Run: python studies/speed/large_pair.py [fronts superlu cholmod pardiso]      (fronts; --full: all four)
"""

import json
import os
import subprocess
import sys

COLUMNS, ROWS = 400, 624  # cells along the interface and through a piece: 2 x 500 000 unknowns
LENGTH, HEIGHT, COATING, LOAD = 12.7e-3, 6.35e-3, 152.4e-6, 115.65 / 12.7e-3
NAMES = ("fronts", "superlu", "cholmod", "pardiso")


def piece(seed: int, columns: int = COLUMNS, rows: int = ROWS):
    """Triangles on shaken, shuffled points whose rows thin out towards the far face; the diagonals fall by chance."""
    import numpy as np

    from patchfem.mesh.anymesh import PieceMesh
    from patchfem.mesh.tensor import graded_rows

    draw, coat = np.random.default_rng(seed), rows // 6
    below = graded_rows(COATING / coat, HEIGHT - COATING, 1 + 4 / rows)
    depth = np.concatenate([np.linspace(0, COATING, coat + 1), COATING + np.cumsum(below)])
    x, y = np.meshgrid(np.linspace(-LENGTH / 2, LENGTH / 2, columns + 1), depth, indexing="ij")
    shake = draw.uniform(-0.25, 0.25, (2, *x.shape))
    # interface, coating, far face and sides stay straight
    shake[:, :, [0, coat, -1]] = shake[:, [0, -1]] = 0
    y = y + shake[1] * np.minimum(np.gradient(depth), np.append(np.diff(depth), 1.0))
    x = x + shake[0] * LENGTH / columns
    node = draw.permutation(x.size).reshape(x.shape)
    a, b, c, d = (
        part.ravel() for part in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
    )
    first = draw.random(a.size) < 0.5
    halves = np.where(
        first[:, None, None],
        np.stack([a, b, c, a, c, d], 1).reshape(-1, 2, 3),
        np.stack([a, b, d, b, c, d], 1).reshape(-1, 2, 3),
    )
    is_coating = np.repeat(np.tile(np.arange(depth.size - 1) < coat, columns), 2)
    points = np.empty((x.size, 2))
    points[node.ravel()] = np.stack([x.ravel(), y.ravel()], axis=1)
    return PieceMesh(
        points, halves.reshape(-1, 3), np.empty((0, 4), int), is_coating, node[:, 0], node[:, -1]
    )


def once(name: str, columns: int = COLUMNS, rows: int = ROWS) -> dict:
    """Seconds on the wall and of the processor per step, unknowns, peak resident memory [GB], peak pressure [Pa]."""
    import resource
    from itertools import pairwise
    from pathlib import Path
    from time import perf_counter, process_time

    sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
    from factors import make_piece

    from patchfem.contact.unilateral import press
    from patchfem.core import Compliance, Interface
    from patchfem.elasticity.elasticity import Layers, interface_compliance

    bodies = [piece(seed, columns, rows) for seed in (1, 2)]
    layers, clock = (
        Layers((250e9, 0.24), (121e9, 0.32), "strain"),
        [(perf_counter(), process_time())],
    )
    # both factors are kept, as for the fields of a run
    pieces = [make_piece(body, layers, name) for body in bodies]
    clock.append((perf_counter(), process_time()))
    nn, tt, _ = map(sum, zip(*(interface_compliance(one) for one in pieces)))
    clock.append((perf_counter(), process_time()))
    x, weight = bodies[0].x, bodies[0].tributary_lengths()
    # tilted by 10 urad
    found = press(Compliance(Interface(x, weight, 1.0), nn, tt), 1e-5 * x, LOAD)
    clock.append((perf_counter(), process_time()))
    steps = {
        step: [round(b - a, 2) for a, b in zip(*pair)]
        for step, pair in zip(("assemble", "condense", "press"), pairwise(clock))
    }
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return {
        "factor": name,
        "unknowns": sum(2 * one.order.size for one in pieces),
        **steps,
        "total": [round(b - a, 2) for a, b in zip(clock[0], clock[-1])],
        "memory": round(memory, 2),
        "peak": float(found.sigma_n.max()),
    }


def main(names=NAMES, columns: int = COLUMNS, rows: int = ROWS) -> list:
    """`once` for every name, each in a process of its own with one thread."""
    one = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
    out = []
    for name in names:
        done = subprocess.run(
            [sys.executable, __file__, name, str(columns), str(rows), "--once"],
            text=True,
            env=os.environ | one,
            capture_output=True,
        )
        if done.returncode == 0:
            out.append(json.loads(done.stdout))
            print(done.stdout, end="", flush=True)
        else:
            print(
                f"{name}: left out, {done.stderr.strip().splitlines()[-1].partition(': ')[2]}",
                flush=True,
            )
    return out


if __name__ == "__main__":
    if sys.argv[-1] == "--once":
        print(json.dumps(once(sys.argv[1], *map(int, sys.argv[2:4]))))
    else:
        main(NAMES if "--full" in sys.argv else sys.argv[1:] or NAMES[:1])
