"""Random static patches, as texts of scenes and as what `static_reference` solves, and their bars held against it.

`python tests/support/static_scenes.py FIRST COUNT FILE [TOLERANCE ...]` writes a line for each scene and tolerance to
FILE; `--again FILE OTHER` runs the scenes of FILE with the importable version of patchfem, takes the reference from
FILE and writes OTHER; `--read FILE` prints how many bars hold, by measure and by kind.
"""

from __future__ import annotations

import json
import sys
import time
from itertools import pairwise

import numpy as np
from static_reference import PieceInterface, Scene, answer

KINDS = ("plain", "crown", "h1", "step", "ends", "skin")
MATERIALS = ((121e9, 0.32), (210e9, 0.3), (70e9, 0.34), (250e9, 0.24))
TOLERANCES = (1e-2, 1e-3, 1e-4)
JUDGED = (
    "contact_fraction",
    "contact_half_width",
    "pressure_peak",
    "approach",
    "moment",
    "pressure_centre",
    "normal_stiffness",
    "tangential_stiffness",
    "rotational_stiffness",
)


def drawn(seed: int) -> Scene:
    """The scene of a seed; its kind is KINDS[seed % 6]."""
    r, kind = np.random.default_rng([seed, 28]), KINDS[seed % len(KINDS)]

    def wide(low, high):
        return float(f"{10 ** r.uniform(np.log10(low), np.log10(high)):.5g}")

    length, load = wide(5e-3, 5e-2), wide(10, 5e3)
    height = float(f"{length * r.uniform(0.3, 1.2):.5g}")
    kinds = r.choice(len(MATERIALS), 3)
    thick = float(f"{height * r.uniform(0.01, 0.2):.5g}") if r.random() < 0.5 else 0.0
    base = tuple(MATERIALS[k] for k in kinds[:2]) if thick else (MATERIALS[kinds[1]],) * 2
    lower = upper = PieceInterface(length, height, thick, base)
    if r.random() < 0.3:
        upper = PieceInterface(length, height, 0.0, (MATERIALS[kinds[2]],) * 2)
    tilt = float(f"{10 ** r.uniform(-6.5, -3.5) * r.choice([-1, 1]):.5g}")
    curvature = step = skin = None
    if kind in ("crown", "h1") or (kind in ("step", "skin") and r.random() < 0.5):
        curvature = float(f"{10 ** r.uniform(-1.5, 1):.5g}")
    if kind == "h1":  # a narrow contact of long pieces, aside of their middle
        length = wide(2e-2, 6e-2)
        lower = upper = PieceInterface(length, length / 2, 0.0, (MATERIALS[kinds[0]],) * 2)
        tilt = float(f"{length * curvature * r.uniform(-0.2, 0.2):.5g}")
        load = wide(1, 100)
    if kind == "step" or (kind == "skin" and r.random() < 0.5):
        step = (
            wide(2e-8, 2e-6) * float(r.choice([-1, 1])),
            float(f"{length * r.uniform(-0.35, 0.35):.5g}"),
        )
        tilt = float(f"{tilt / 3:.5g}")
    if kind == "skin":
        skin = wide(1e12, 1e15)
    if kind == "ends":
        lower = PieceInterface(
            float(f"{length * r.uniform(1.2, 2):.5g}"), height, lower.thickness, lower.layers
        )
    return Scene(
        length,
        wide(2e-3, 5e-2),
        str(r.choice(["strain", "stress"])),
        lower,
        upper,
        load,
        tilt,
        curvature or 0.0,
        step,
        skin,
    )


def text_of(scene: Scene) -> str:
    """The scene as the program reads it."""

    def material(young, nu):
        return f'{{young = "{young:.9g} Pa", poisson = {nu:.9g}, density = "5000 kg/m^3"}}'

    rows = [
        "[contact]",
        f'length = "{scene.length!r} m"',
        f'width = "{scene.width!r} m"',
        f'height = "{scene.lower.height!r} m"',
        f'load = "{scene.load!r} N"',
        f'plane = "{scene.plane}"',
        f"substrate = {material(*scene.lower.layers[1])}",
    ]
    for name, body in (("lower", scene.lower), ("upper", scene.upper)):
        rows += [
            f"[contact.{name}]",
            f'length = "{body.length!r} m"',
            f"substrate = {material(*body.layers[1])}",
        ]
        rows.append(
            f'coating = {{material = {material(*body.layers[0])}, thickness = "{body.thickness!r} m"}}'
            if body.thickness
            else 'coating = "none"'
        )
    rows += ["[contact.tilt]", f'angle = "{scene.tilt!r} rad"']
    if scene.curvature:
        rows += ["[contact.crown]", f'radius = "{1 / scene.curvature!r} m"']
    if scene.step:
        rows += ["[contact.step]", f'height = "{scene.step[0]!r} m"', f'at = "{scene.step[1]!r} m"']
    if scene.skin:
        rows += [
            "[contact.asperities]",
            'law = "linear"',
            f'normal_stiffness = "{scene.skin!r} Pa/m"',
        ]
    return "\n".join(rows) + "\n"


def found(scene: Scene, tolerance: float) -> dict:
    """The run of a scene: measures as name -> (value, error), warnings, CPU seconds."""
    import patchfem as pf

    begin = time.process_time()
    run = pf.run(text_of(scene), **{"accuracy.tolerance": tolerance})
    return {
        "seconds": time.process_time() - begin,
        "warnings": list(run.warnings),
        "measures": {
            name: (float(m.value), float(m.error))
            for name, m in run.measures.items()
            if name in JUDGED and m.value is not None
        },
    }


def line(seed: int, tolerances=TOLERANCES, fine: float = 5e-4) -> dict:
    """A scene beside its truth: what `--read` reads."""
    scene = drawn(seed)
    begin = time.process_time()
    truth, own = answer(scene, fine)
    return {
        "seed": seed,
        "kind": KINDS[seed % len(KINDS)],
        "reference_seconds": time.process_time() - begin,
        "truth": {name: (float(truth[name]), float(own[name])) for name in JUDGED},
        "runs": {repr(one): found(scene, one) for one in tolerances},
    }


def run_again(path: str, other: str) -> None:
    """Run the scenes of the file `path` with the importable version of patchfem and write the file `other`."""
    with open(path, encoding="utf-8") as rows, open(other, "w", encoding="utf-8") as file:
        for row in map(json.loads, rows):
            scene = drawn(row["seed"])
            row["runs"] = {tolerance: found(scene, float(tolerance)) for tolerance in row["runs"]}
            print(json.dumps(row), file=file, flush=True)


KNOWN = 3.0  # times narrower than a bar must the truth be known that is to judge it


def missed(value: float, error: float, truth: float, own: float) -> bool:
    """Whether a bar, with the reference's own uncertainty, does not reach a truth that is known well enough, or lies so
    far off that no truth is."""
    off = abs(value - truth)
    return off > error + own + 1e-9 * abs(truth) and (
        KNOWN * own <= error or off > error + KNOWN * own
    )


def floors(scene_truth: dict, name: str) -> float:
    """Of quantities that are zero by symmetry: a millionth of what they are a difference of."""
    half = scene_truth["contact_half_width"][0]
    return {"pressure_centre": 1e-6 * half}.get(name, 0.0)


def judged(one: dict):
    """(tolerance, name, value, error, truth, own) of every measure of a line."""
    for tolerance, run in one["runs"].items():
        for name, (value, error) in run["measures"].items():
            truth, own = one["truth"][name]
            yield float(tolerance), name, value, error, truth, max(own, floors(one["truth"], name))


def wider(one: dict) -> list:
    """(name, tolerance) of the bars that are wider than at the looser tolerance before."""
    out, runs = [], sorted(one["runs"].items(), key=lambda item: -float(item[0]))
    for (_, loose), (tolerance, tight) in pairwise(runs):
        out += [
            (name, float(tolerance))
            for name, (_, error) in tight["measures"].items()
            if name in loose["measures"] and error > loose["measures"][name][1] * (1 + 1e-6) + 1e-14
        ]
    return out


def read(path: str) -> None:
    lines = [json.loads(row) for row in open(path, encoding="utf-8")]
    rows = [(one["kind"], *row) for one in lines for row in judged(one)]
    for title, place in (("tolerance", 1), ("measure", 2), ("kind", 0)):
        for which in sorted({row[place] for row in rows}, key=str):
            mine = [row for row in rows if row[place] == which]
            out = [row for row in mine if missed(*row[3:])]
            far = [
                row[4] / max(abs(row[3] - row[5]), 1e-300)
                for row in mine
                if abs(row[3] - row[5]) > KNOWN * row[6] + 1e-9 * abs(row[5])
            ]
            known = sum(KNOWN * row[6] <= row[4] for row in mine)
            share = 100 - 100 * len(out) / max(known, 1)
            print(
                f"{title} {which!s:22} {len(mine):5} bars {known:5} judged {len(out):4} outside {share:6.2f} %  "
                f"bar over error: median {np.median(far) if far else 0:.3g}"
            )
    for one in lines:
        for tolerance, name, value, error, truth, own in judged(one):
            if missed(value, error, truth, own):
                print(
                    f"  outside: seed {one['seed']} {one['kind']} {tolerance:g} {name} {value:.9g} +- {error:.3g}, "
                    f"{truth:.9g} +- {own:.2g}: {abs(value - truth) / error:.2f} bars"
                )
        for name, tolerance in wider(one):
            print(f"  wider: seed {one['seed']} {one['kind']} {name} at {tolerance:g}")
    print(
        "reference CPU s",
        sum(one["reference_seconds"] for one in lines),
        *(
            f"run at {t}: {np.median([one['runs'][t]['seconds'] for one in lines]):.2f}"
            for t in lines[0]["runs"]
        ),
    )


if __name__ == "__main__":
    if sys.argv[1] == "--read":
        read(sys.argv[2])
    elif sys.argv[1] == "--again":
        run_again(*sys.argv[2:])
    else:
        with open(sys.argv[3], "a", encoding="utf-8") as file:
            for seed in range(int(sys.argv[1]), int(sys.argv[1]) + int(sys.argv[2])):
                print(
                    json.dumps(line(seed, tuple(map(float, sys.argv[4:])) or TOLERANCES)),
                    file=file,
                    flush=True,
                )
