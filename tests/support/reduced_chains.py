"""Random chains of masses reduced to two boundary coordinates and a few modes, against runs with the full matrices.

Campaign `reduced` of `campaigns`. The stated error of the full run is the uncertainty of the
reference. Seeds below 7000 were used in development.
"""

from pathlib import Path

import numpy as np
from campaigns import measure_rows, strip_number
from random_rigs import LEFT_OUT

import patchfem as pf

LAWS = {
    "elastic-plastic": 'bond_length = "{length!r} m"',
    "coulomb": "",
    "iwan": 'stiffness = "{stiffness!r} N/m"\nchi = -0.4\nbeta = 0.5',
    "tanh": 'reference_speed = "{speed!r} m/s"',
    "bouc-wen": 'stiffness = "{stiffness!r} N/m"\nexponent = 1.5',
}
# Laws solved by harmonic balance; the others are solved by events.
SMOOTH = ("iwan", "tanh", "bouc-wen")
REDUCED = """\
[structure.reduced]
stiffness = "whole.npz"
mass = "whole.npz"
damping = "whole.npz"
boundary = {boundary}
modes = {modes}
method = "{method}"
"""
REST = """\
[[structure.interface]]
between = [{rubs}, 0]
law = "{law}"
static = 0.3
load = "{load!r} N"
{keys}
[drive]
kind = "{drive}"
frequency = "{frequency!r} Hz"
{size}
cycles = 60
"""


def draw_chain(seed: int) -> dict:
    """Return the matrices and parameters of a random chain of 16 to 60 masses.

    One mass has friction, another is the output.
    """
    r = np.random.default_rng(seed)
    n = int(r.integers(16, 61))
    k = 1e7 * 10 ** r.uniform(-0.3, 0.3, n)
    m = 0.02 * 10 ** r.uniform(-0.3, 0.3, n)
    K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    M = np.diag(m)
    omega, shapes = np.linalg.eigh(K / np.sqrt(np.outer(m, m)))
    omega = np.sqrt(omega)
    mode = int(r.integers(0, 2))
    rubs, seen = (
        int(mass_number) for mass_number in r.choice(np.arange(n // 4, n), 2, replace=False)
    )
    alpha = 2 * r.uniform(0.003, 0.03) * omega[0]
    frequency = omega[mode] * r.uniform(0.85, 1.15)
    force = 10 ** r.uniform(0, 2)
    stiff = 1 / np.linalg.inv(K)[rubs, rubs]
    # At resonance, a modal force F gives a displacement of F shape^2/(2 zeta omega^2).
    shape = shapes[:, mode] / np.sqrt(m)
    reach = float(
        force * abs(shape[seen] * shape[rubs]) / (max(alpha / omega[mode], 0.05) * omega[mode] ** 2)
    )
    load = stiff * reach * 10 ** r.uniform(-1.5, 0.3) / 0.3
    law = str(r.choice(list(LAWS)))
    drive = str(r.choice(["base", "force"]))
    sizes = {"length": float(reach * 10 ** r.uniform(-2, -0.5))}
    sizes["speed"] = float(reach * frequency * 10 ** r.uniform(-2, -1))
    sizes["stiffness"] = float(0.3 * load / sizes["length"])
    return {
        "seed": seed,
        "M": M,
        "K": K,
        "C": alpha * M + 1e-7 * K,
        "rubs": rubs,
        "seen": seen,
        "law": law,
        "drive": drive,
        "load": float(load),
        "keys": LAWS[law].format(**sizes),
        "frequency": float(frequency / (2 * np.pi)),
        "force": float(force),
        "acceleration": float(force * abs(shape[seen] / (shape @ m))),
        "modes": int(r.integers(2, 9)),
        "method": str(r.choice(["craig-bampton", "free-interface"])),
    }


def format_scenes(s: dict) -> tuple:
    """Return the scenes of the reduced and the full chain, in this order."""
    out = []
    exact = "" if s["law"] not in SMOOTH else '[accuracy]\nmethod = "harmonic"\n'
    for is_full in (False, True):
        friction_mass, output_mass = (s["rubs"] + 1, s["seen"] + 1) if is_full else (1, 2)
        size = (
            f'acceleration = "{s["acceleration"]!r} m/s^2"'
            if s["drive"] == "base"
            else f'force = "{s["force"]!r} N"\nmass = {output_mass}'
        )
        head = (
            '[structure]\nfile = "whole.npz"\n'
            if is_full
            else "[structure]\noutput_mass = 2\n"
            + REDUCED.format(
                boundary=[s["rubs"] + 1, s["seen"] + 1], modes=s["modes"], method=s["method"]
            )
        )
        out.append(head + REST.format(**s | {"rubs": friction_mass, "size": size}) + exact)
    return tuple(out)


def compare_chain(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the reduced chain of a seed with the full one; see `campaigns`."""
    s = draw_chain(seed)
    line = {"group": f"{s['law']}, {s['drive']}", "engine": s["method"], "rows": []}
    np.savez(
        folder / "whole.npz", M=s["M"], K=s["K"], C=s["C"], output=np.eye(len(s["M"]))[s["seen"]]
    )
    results = []
    for text in format_scenes(s):
        path = folder / "scene.toml"
        path.write_text(text)
        try:
            results.append(pf.run(path))
        except pf.PatchfemError as error:
            return line | {"refused": str(error)}
    reduced, full = results
    if full.outcome != reduced.outcome or full.outcome in ("grows", "not_converged"):
        return line | {"refused": f"reduced {reduced.outcome}, whole {full.outcome}"}
    measures = {
        name: measure
        for name, measure in full.measures.items()
        if None not in (measure.value, measure.error) and strip_number(name) not in LEFT_OUT
    }
    values = {name: measure.value for name, measure in measures.items()}
    uncertainties = {name: measure.error for name, measure in measures.items()}
    return line | {"rows": measure_rows(reduced.measures, values, uncertainties)}
