"""How fast and how exact is the condensed contact against GetFEM on the same Hertz pair?

Two alike blocks of 40 x 20 mm, a = 0.1 mm, the crown in the gap, one tensor grid and one thread for both programs,
medians of three on a busy machine. With the corner rule on the interface GetFEM 5.4.2 (augmented Lagrangian, symmetric
Newton, MUMPS) solves the very same discrete problem and finds the same pressures to 2e-12, with both pieces, where it
looks nodes up across the faces, to 9e-5.

                     a/8                a/16               a/32
  rms error, nodal   2.7e-3             1.7e-4             8.0e-5      both programs
  rms error, gauss   3.1e-2             2.8e-3             4.5e-4      GetFEM's integral contact, sawtooth at the edge
  one piece (mirror) .016 / 0.22 / 0.28 .021 / 0.47 / 0.57 .043 / 1.2 / 1.2 s cold, patchfem / nodal / gauss
  both pieces        .027 / 0.61 / 0.78 .040 / 1.5 / 2.0   .12 / 4.6 / 4.5 s

So cold, with the same reduction, GetFEM takes 14 to 28 times as long on one piece and 22 to 49 times on two. At equal
error its nodal form keeps these ratios, its integral contact takes 36 to 60 times (one piece) and 73 to 130 times (two)
as long; against a patchfem that condenses one of two alike pieces, 38 to 110 times at the same mesh. Every further load
or tilt costs patchfem 0.1 to 0.4 ms and GetFEM a new factorisation per Newton step, 800 to 3000 times as much on one
piece and 2200 to 13000 times on two.

Run: python studies/peers/hertz_getfem.py
"""

import sys
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from hertz_pair import (
    FORMS,
    HALF,
    LOAD,
    MATERIAL,
    RADIUS,
    STEPS,
    Row,
    compute_errors,
    make_grid,
    ours,
)
from peer import Peer, interpolate_seconds, ratio_text, run

FINENESS = (8, 16, 32)  # elements per half width of the contact
PEERS = ("nodal", "gauss")


def theirs(peer: Peer, cells: int, form: str, quadrature: str) -> Row:
    """Solve by GetFEM on the same mesh and gap, in mm, N and MPa, from an initial overlap of 1.4 a."""
    grid = make_grid(cells)
    newton = LOAD * 1e-3
    steps = [
        {"N": factor * newton, "crown": 1e-3 / RADIUS, "tilt": angle} for factor, angle in STEPS
    ]
    found = peer.ask(
        x=(grid.x * 1e3).tolist(),
        depth=(grid.depth * 1e3).tolist(),
        bodies=FORMS[form],
        material=(MATERIAL[0] * 1e-6, MATERIAL[1]),
        quadrature=quadrature,
        steps=steps,
        augmentation=1e6,
        limit=1e-8 * newton,
        start=FORMS[form] * 0.49 * HALF**2 / RADIUS * 1e3,
    )
    p = np.array(found["pressure"]) * 1e6
    return Row(
        f"GetFEM {quadrature}",
        form,
        cells,
        found["dofs"],
        found["build"] + found["solve"],
        float(np.mean(found["warm"])),
        compute_errors(grid.x, p[0]),
        p,
    )


def _median(rows: list) -> Row:
    first = rows[0]
    return Row(
        first.program,
        first.form,
        first.cells,
        first.dofs,
        float(np.median([r.cold for r in rows])),
        float(np.median([r.warm for r in rows])),
        first.errors,
        first.pressure,
    )


def agreement(one: Row, other: Row) -> float:
    """Return the largest difference of the pressures of all steps relative to the largest pressure."""
    return float(np.abs(one.pressure - other.pressure).max() / one.pressure.max())


def _format_row(row: Row) -> str:
    return (
        f"{row.program:13} a/{row.cells:<3} {row.dofs:6d} dofs  cold {row.cold:6.3f} s  "
        f"further {1e3 * row.warm:8.2f} ms  p(0) {row.errors[0]:+.1e}  half width {row.errors[1]:+.1e}  "
        f"rms {row.errors[2]:.1e}"
    )


def ratios(rows: list) -> list:
    """Return the ratios of time for one form.

    They are (GetFEM row, its first time over ours on the same mesh, at the same rms error, and for
    a further step).
    """
    mine = [r for r in rows if r.program == "patchfem"]
    out = []
    for row in (r for r in rows if r.program != "patchfem"):
        same = next(r for r in mine if r.cells == row.cells)
        at, sign = interpolate_seconds(
            row.errors[2], [r.errors[2] for r in mine], [r.cold for r in mine]
        )
        out.append(
            (row, row.cold / same.cold, ratio_text(row.cold, at, sign), row.warm / same.warm)
        )
    return out


def main(fineness=FINENESS, repeats: int = 3, forms=tuple(FORMS), peers=PEERS) -> dict:
    """Print the ratios of times and return {form: medians of all rows}; raise Missing without GetFEM."""
    out = {}
    with (
        threadpool_limits(1),
        Peer(
            "GetFEM",
            "peers/getfem_child.py",
            "PATCHFEM_GETFEM_PYTHON",
            "/usr/bin/python3",
            "install python3-getfem (Debian)",
        ) as peer,
    ):
        print(f"GetFEM {peer.version}")
        # the first calls load and compile; they are not timed
        ours(4, "mirror"), theirs(peer, 4, "mirror", "nodal")
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
                print("  " + _format_row(row))
            for row, cold, equal, warm in ratios(rows):
                print(
                    f"  {row.program:13} a/{row.cells:<3} over patchfem: cold {cold:.1f} at the same mesh, {equal} "
                    f"at the same rms error; further step {warm:.0f}"
                )
        if len(out) == 2:
            for mine, other in (
                (m, o)
                for m in out["mirror"]
                for o in out["pair"]
                if m.program == "patchfem" and o.program != "patchfem" and m.cells == o.cells
            ):
                print(
                    f"both pieces in {other.program} a/{other.cells} over one of two in patchfem: "
                    f"cold {other.cold / mine.cold:.1f}"
                )
    return out


if __name__ == "__main__":
    raise SystemExit(run(main))
