"""Score of stated errors of patches under measured traces, by run and by sweep, against `trace_reference`.

    python tests/support/trace_bars.py FIRST COUNT FILE    # a line of JSON for each seed
    python tests/support/trace_bars.py --sum FILE...       # the table

A trace has waviness, noise or steps on a slight crown. The same case is computed by `run` and as a case of a `sweep`
over loads and tilts. Seeds from 97000 on are for scores.
"""

import json
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import trace_reference as reference
from scipy.ndimage import gaussian_filter1d

import patchfem as pf

KINDS = ("waviness", "noise", "steps")
LENGTH, WIDTH, HEIGHT = 10e-3, 8e-3, 5e-3  # [m]
COATING = 150e-6  # [m]
LEVELS = 9  # of the reference; its cells are halved from level to level
LEFT_OUT = ("normal_load", "rotation", "moment")


def draw_case(seed: int) -> tuple:
    """Draw (kind, positions [m], gap heights [m], tilt [rad], load [N], whether the pieces are coated) of a seed."""
    draw = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    x = np.linspace(-LENGTH / 2, LENGTH / 2, int(draw.integers(400, 1500)))
    z = x**2 / 2 / draw.uniform(1.5, 12.0)
    for _ in range(3):
        wave = draw.uniform(0.3e-3, 3e-3)
        z = z + draw.uniform(0.02e-6, 0.3e-6) * np.sin(2 * np.pi * (x / wave + draw.random()))
    if kind == "noise":
        noise = gaussian_filter1d(draw.normal(size=x.size), draw.uniform(1.0, 4.0))
        z = z + draw.uniform(0.01e-6, 0.1e-6) * noise / noise.std()
    if kind == "steps":
        for _ in range(int(draw.integers(1, 4))):
            place = draw.uniform(-0.35, 0.35) * LENGTH
            z = z + draw.uniform(-0.5e-6, 0.5e-6) / (1 + np.exp(-(x - place) / draw.uniform(20e-6, 80e-6)))
    return kind, x, z, draw.uniform(-2e-5, 2e-5), 10**draw.uniform(1.3, 3.0), bool(draw.random() < 0.5)


def text_of(load: float, tilt: float, is_coated: bool) -> str:
    """Scene of a case; its trace is the file trace.csv."""
    parts = [f'[contact]\nlength = "{LENGTH!r} m"\nwidth = "{WIDTH!r} m"\nheight = "{HEIGHT!r} m"\nload = "{load!r} N"',
             'substrate = {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"}']
    if is_coated:
        parts.append(f'[contact.coating]\nthickness = "{COATING!r} m"\n'
                     'material = {young = "250 GPa", poisson = 0.24, density = "14500 kg/m^3"}')
    parts += [f'[contact.tilt]\nangle = "{tilt!r} rad"', '[contact.profile]\nfile = "trace.csv"']
    return "\n".join(parts) + "\n"


def rows_of(measures: dict, truth) -> list:
    """List [name, value, error, true value, uncertainty of the reference] of the measures that both have."""
    return [[name, value, error, truth.values[name], truth.changes[name]] for name, (value, error) in measures.items()
            if name in truth.values and name not in LEFT_OUT and value is not None and error is not None]


def compare_case(seed: int) -> dict:
    """Compute the case of a seed by run, by sweep and by the reference."""
    kind, x, z, tilt, load, is_coated = draw_case(seed)
    titanium, carbide = reference.Layer(121e9, 0.32), reference.Layer(250e9, 0.24)
    block = reference.Block(LENGTH, HEIGHT, titanium, carbide, COATING) if is_coated else \
        reference.Block(LENGTH, HEIGHT, titanium)
    case = reference.Case(WIDTH, reference.gap_of(x, z, tilt), load)
    truth = reference.solve(reference.Pair((block, block)), case, LEVELS)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.toml")
        lines = [f"{1e3 * a:.9f},{1e6 * b:.9f}" for a, b in zip(x, z)]
        Path(folder, "trace.csv").write_text("\n".join(["x [mm],z [um]", *lines]) + "\n", "utf-8")
        scene.write_text(text_of(load, tilt, is_coated), "utf-8")
        result = pf.run(scene)
        swept = pf.sweep(scene, {"contact.load": [f"{load!r} N", f"{1.4 * load!r} N"],
                                 "contact.tilt.angle": [f"{tilt!r} rad", f"{tilt + 1e-5!r} rad"]})
    by_run = {name: (one.value, one.error) for name, one in result.measures.items()}
    by_sweep = {name: (float(swept[name].values[0, 0]), float(swept[f"{name}_error"].values[0, 0]))
                for name in by_run if name in swept}
    by_sweep = {name: pair for name, pair in by_sweep.items() if np.isfinite(pair).all()}
    both = [[name, *by_run[name], *by_sweep[name]] for name in by_sweep if by_run[name][1] is not None]
    return {"seed": seed, "kind": kind, "outcome": str(result.outcome), "overlap": truth.overlap,
            "run": rows_of(by_run, truth), "sweep": rows_of(by_sweep, truth), "both": both}


def print_table(lines: list) -> None:
    """Print the share of errors that hold by run and by sweep, and how often run and sweep agree."""
    for way in ("run", "sweep"):
        shares = defaultdict(list)
        for line in lines:
            for name, value, error, true, doubt in line[way]:
                miss = max(abs(value - true) - doubt, 0.0) / max(error, 1e-12 * abs(true) + 1e-30)
                shares[name].append(miss)
                if miss > 1:
                    print(way, line["seed"], line["kind"], line["outcome"], f"{name} {value:.6g} +- {error:.2g}, true "
                          f"{true:.6g} +- {doubt:.2g}: {miss:.2f}")
        for name, misses in shares.items():
            print(f"{way:6s} {name:24s} {np.mean(np.array(misses) <= 1):.3f} of {len(misses)} hold, worst "
                  f"{max(misses):.2f} times the error")
    agree = [abs(one - other) <= first + second + 1e-12 * abs(one) for line in lines
             for _, one, first, other, second in line["both"]]
    print(f"run and sweep agree within the sum of their errors: {sum(agree)} of {len(agree)}; outcomes "
          f"{[line['outcome'] for line in lines].count('done')} of {len(lines)} done")


if __name__ == "__main__":
    if sys.argv[1] == "--sum":
        print_table([json.loads(text) for name in sys.argv[2:] for text in Path(name).read_text("utf-8").splitlines()])
    else:
        for number in range(int(sys.argv[1]), int(sys.argv[1]) + int(sys.argv[2])):
            with open(sys.argv[3], "a", encoding="utf-8") as out:
                try:
                    out.write(json.dumps(compare_case(number), default=float) + "\n")
                except (RuntimeError, pf.PatchfemError) as error:
                    print(number, error)
