"""Random traces on random pieces, and how their errors stand beside even meshes that are much finer.

`drawn(seed)` is the recipe; `scored(seed)` runs a scene with nothing pinned and at the default tolerance, and the same
patch on cells alone, with its own coarser meshes: even ones of a 1588th of the length where a trace is fine everywhere,
else graded ones of a tolerance ten times as tight. These have other compliances than the points
that a trace is pressed on, another way to press and other edges. All see the same curve through the samples.
`python tests/support/random_traces.py FIRST COUNT FILE` writes a line of JSON for each of COUNT seeds from FIRST on;
`python tests/support/random_traces.py --sum FILE...` prints the table.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from scene_texts import COATING, PIECE
from synthetic import self_affine

import patchfem as pf
from patchfem.model.model import build
from patchfem.runs.patch import ladder
from patchfem.runs.patch.ladder import solve_all
from patchfem.runs.patch.measures import measures
from patchfem.scene.scene import loads

LENGTH, CELLS = 12.7e-3, 1588  # of the interface [m]; of the even mesh beside
KINDS = ("corner", "roofs", "punch", "wave", "short wave", "rough", "smooth rough", "crowned wave")
FINE = ("roofs", "short wave", "rough")
MODULUS = 6e10  # Pa, about that of a pair of faces
PIECES = ('substrate = "steel"\n', 'substrate = "Ti-8Al-1Mo-1V"\n' + COATING,
          'substrate = "Ti-8Al-1Mo-1V"\n' + COATING + '[contact.lower]\ncoating = "none"\nheight = "9 mm"\n')


def drawn(seed: int) -> tuple:
    """(kind, x (n,) [m], z (n,) [m] of the gap, text of the scene without its profile) of a seed."""
    draw = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    count = int(draw.integers(300, 500)) if kind in ("corner", "roofs", "rough") else int(draw.integers(800, 1600))
    x = np.linspace(-LENGTH / 2, LENGTH / 2, count + 1)
    z, load = _shape(kind, x, draw)
    text = PIECE + f'load = "{load!r} N"\n' + PIECES[draw.integers(3)]
    turned = draw.integers(3)
    if turned == 1:
        text += f'[contact.tilt]\nangle = "{draw.uniform(-3e-5, 3e-5)!r} rad"\n'
    elif turned == 2:
        text += f'[contact.load_line]\noffset = "{draw.uniform(-1, 1)!r} mm"\n'
    return kind, x, z, text


def _shape(kind: str, x, draw) -> tuple:
    """Gap (n,) [m] of a kind, and a load [N] that closes some of it."""
    area, half = LENGTH * 12.7e-3, LENGTH / 2
    place = draw.uniform(-0.4, 0.4) * half
    if kind == "corner":
        left, right = 10**draw.uniform(-4, -2.7, 2)
        return np.where(x < place, left * (place - x), right * (x - place)), 10**draw.uniform(1.7, 3)
    if kind == "roofs":
        at = np.sort(draw.uniform(-1, 1, int(draw.integers(4, 9)))) * half
        heights = draw.uniform(0, 10**draw.uniform(-6.5, -5.5), at.size)
        return np.interp(x, at, heights), 10**draw.uniform(1.7, 3)
    if kind == "punch":
        flat, radius = draw.uniform(0.05, 0.3) * half, 10**draw.uniform(-1.7, 0)
        return np.maximum(np.abs(x - place) - flat, 0)**2 / (2 * radius), 10**draw.uniform(2, 3.5)
    if kind in ("rough", "smooth rough"):
        short = 2.05 * LENGTH / (x.size - 1) if kind == "rough" else draw.uniform(150e-6, 400e-6)
        z = self_affine(LENGTH, x.size - 1, 10**draw.uniform(-7.3, -6.3), draw.uniform(0.5, 1), 0.8e-3, short,
                        int(draw.integers(10**6))).z
        slope = np.sqrt(np.mean((np.diff(z) / np.diff(x))**2))
        return z, float(np.clip(10**draw.uniform(-2.5, -0.7) * MODULUS * slope * area, 5.0, 2e4))
    wave = LENGTH / draw.uniform(4, 30) if kind != "short wave" else LENGTH / draw.uniform(30, 200)
    high = 10**draw.uniform(-7.5, -6.5)
    z = high * np.cos(2 * np.pi * (x - place) / wave)
    if kind == "crowned wave":
        z = z + x**2 / (2 * 10**draw.uniform(0, 1.5))
    return z, float(np.clip(10**draw.uniform(-1.7, 0.3) * np.pi * MODULUS * high / wave * area, 5.0, 2e4))


def scored(seed: int) -> dict:
    """Of a seed: kind, CPU seconds, whether points were taken, and (value, error, value beside, error beside) by name.
    """
    kind, x, z, text = drawn(seed)
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist()))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        (path.parent / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
        scene = loads(text + '[contact.profile]\nfile = "trace.csv"\n', path)
        begin = process_time()
        found = pf.run(scene)
        spent, tolerance = process_time() - begin, build(scene).accuracy.tolerance
        beside = _beside(kind, build(scene).patch, tolerance / 10)
    out = {name: (float(one.value), float(one.error), float(beside[name].value), float(beside[name].error), one.floor)
           for name, one in found.measures.items()
           if name != "normal_load" and one.value is not None and beside[name].value is not None}
    return {"seed": seed, "kind": kind, "seconds": spent, "points": bool(found.patch.sharper), "measures": out,
            "warned": len(found.warnings)}


def _beside(kind: str, asked, tolerance: float) -> dict:
    """Measures of a patch by name from cells alone: even ones of traces that are fine everywhere, else graded ones."""
    if kind in FINE:
        return measures(*solve_all(replace(asked, element_size=LENGTH / CELLS), tolerance))
    given, ladder._finer = ladder._finer, lambda asked: False
    try:
        return measures(*(one for one in solve_all(asked, tolerance) if one is not None), tolerance=tolerance)
    finally:
        ladder._finer = given


def right(row) -> bool:
    """Whether the bars of a measure and of that beside it meet; row as in `scored`."""
    value, error, other, own, floor = row
    return abs(value - other) <= error + own + 1e-3 * floor


def sharp(row, tolerance: float = 1e-3) -> bool | None:
    """Whether a bar is at most five times the true error; None where that is not known to be above what the mesh
    beside leaves open, or the bar is below a tenth of the tolerance."""
    value, error, other, own, floor = row
    off = abs(value - other)
    if error <= 5 * max(off - own, 0.0):
        return True
    return None if error <= 5 * (off + own) or error <= tolerance * abs(value) / 10 + floor else False


def main(args: list) -> None:
    """Write seeds, or print the sum of files."""
    if args[0] == "--sum":
        lines = [json.loads(line) for name in args[1:] for line in Path(name).read_text().splitlines()]
        for name in sorted({name for line in lines for name in line["measures"]}):
            rows = [(line["seed"], line["measures"][name]) for line in lines if name in line["measures"]]
            wrong = [seed for seed, row in rows if not right(row)]
            judged = [sharp(row) for _, row in rows]
            known = [one for one in judged if one is not None]
            wide = sum(row[1] > 1e-3 * abs(row[0]) + row[4] for _, row in rows)
            print(f"{name:22s} {len(rows) - len(wrong)}/{len(rows)} right, {known.count(True)}/{len(known)} sharp, "
                  f"{len(rows) - len(known)} open, {wide} above the tolerance, wrong {wrong}")
        seconds = sorted(line["seconds"] for line in lines)
        print(f"{len(lines)} traces, {sum(line['points'] for line in lines)} by points; CPU s median "
              f"{seconds[len(seconds) // 2]:.1f}, largest {seconds[-1]:.1f}")
        return
    first, count, name = int(args[0]), int(args[1]), args[2]
    for seed in range(first, first + count):
        try:
            line = scored(seed)
        except pf.PatchfemError as error:
            line = {"seed": seed, "kind": drawn(seed)[0], "seconds": 0.0, "points": False, "measures": {},
                    "warned": 0, "fault": str(error)}
        with open(name, "a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
