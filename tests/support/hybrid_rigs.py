"""Random rigs for the engine `hybrid`: a recipe, and the case of the engine that a spec describes.

A spec is a dict of plain numbers: modes, faces, drive, start and number of cycles. `hybrid_campaign` integrates the
same spec by `motion_reference`.

Recipe. 1 to 5 modes of 60 to 400 Hz with damping ratios of 0.1 to 3 %; 1 to 4 interfaces, each with one of the laws; 8 to 20
cycles. The drive is a sine (half of the rigs), three tones, a record of rows, or a release from a displacement. A third of
the rigs whose laws allow it have loads that oscillate or follow the motion, of which a third lift off.
"""

from types import SimpleNamespace

import numpy as np

from patchfem.core import ModalBasis
from patchfem.hybrid import cases, drives
from patchfem.hybrid.laws import make_law, masing
from patchfem.hybrid.records import LawNumbers

LAWS = ("coulomb", "tanh", "elastic-plastic", "iwan", "jenkins", "bouc-wen", "lugre", "nonlocal")
VARYING = ("coulomb", "tanh", "elastic-plastic")
GRAVITY = 9.80665


def draw_spec(seed: int, n_modes: int | None = None) -> dict:
    """Draw a spec; `n_modes` fixes the number of modes."""
    rng = np.random.default_rng(seed)
    n = n_modes or int(rng.choice([1, 1, 2, 3, 5]))
    m = int(min(rng.choice([1, 1, 2, 3, 4]), n + 1))
    frequencies = np.sort(rng.uniform(60.0, 400.0, n))
    omega = 2 * np.pi * frequencies
    mass = float(rng.uniform(0.3, 3.0))
    output = np.append(1.0, rng.uniform(-0.6, 0.6, n - 1))
    base = np.append(rng.uniform(0.6, 1.0), rng.uniform(-0.4, 0.4, n - 1))
    slides = rng.uniform(0.3, 1.0, (m, n)) * rng.choice([-1, 1], (m, n))
    kind = str(rng.choice(["sine", "sine", "sine", "tones", "record", "release"]))
    frequency = float(frequencies[0] * rng.uniform(0.7, 1.2))
    acceleration = float(rng.uniform(1.0, 8.0) * GRAVITY)
    length = acceleration / omega[0] ** 2  # static displacement of the first mode
    spec = {
        "seed": seed, "omega": omega, "zeta": rng.uniform(1e-3, 3e-2, n), "mass": mass, "output": output,
        "base": base, "slides": slides, "kind": kind, "period": 1 / frequency, "cycles": int(rng.integers(8, 21)),
        "tones": [(acceleration, 2 * np.pi * frequency, 0.0)], "rows": None, "z": np.zeros(n), "v": np.zeros(n),
        "length": length, "acceleration": acceleration,
    }  # fmt: skip
    if kind == "tones":
        ratios = np.array([1.0, *rng.uniform(1.1, 3.7, 2)])
        spec["tones"] = [
            (
                acceleration * rng.uniform(0.3, 0.7),
                2 * np.pi * frequency * ratio,
                rng.uniform(0, 2 * np.pi),
            )
            for ratio in ratios
        ]
    elif kind == "record":
        time = np.arange(0, spec["cycles"] + 0.51, 0.25) / frequency
        spec["rows"] = (time, np.append(0.0, rng.normal(0, 0.7 * acceleration, time.size - 1)))
        spec["tones"] = []
    elif kind == "release":
        spec["tones"] = []
        spec["period"] = 2 * np.pi / omega[0]
        spec["z"][0] = length * rng.uniform(2.0, 8.0)
    varies = bool(rng.random() < 0.35)
    faces = []
    for _ in range(m):
        laws = VARYING if varies else LAWS
        faces.append(_draw_face(rng, str(rng.choice(laws)), spec, n, m, varies=varies))
    return spec | {"faces": faces}


def _draw_face(rng, law: str, spec: dict, n: int, m: int, *, varies: bool) -> dict:
    """Draw an interface: keys of its law as in a table [friction], and its load."""
    limit = spec["mass"] * spec["acceleration"] * rng.uniform(0.1, 0.7) / m
    mu = float(rng.uniform(0.15, 0.8))
    load = limit / mu
    length = spec["length"] * float(10 ** rng.uniform(-1.3, 0.0))
    keys = {
        "law": law,
        "static": mu,
        "kinetic": None,
        "bond_length": None,
        "stiffness": limit / length,
    }
    speed = (
        spec["acceleration"] / spec["tones"][0][1] if spec["tones"] else length * spec["omega"][0]
    )
    if law == "coulomb" and rng.random() < 0.6:
        keys["kinetic"] = mu * float(rng.uniform(0.5, 1.0))
    elif law == "tanh":
        keys["reference_speed"] = speed * float(10 ** rng.uniform(-1.5, -0.3))
    elif law == "iwan":
        keys |= {"chi": float(rng.uniform(-0.8, 0.6)), "beta": float(rng.uniform(0.05, 3.0))}
    elif law == "jenkins":
        count = int(rng.integers(2, 7))
        keys["elements"] = (
            limit / length * rng.dirichlet(np.ones(count)),
            np.sort(length * rng.uniform(0.2, 2, count)),
        )
    elif law == "bouc-wen":
        keys |= {"exponent": float(rng.uniform(1.0, 2.5)), "shape": float(rng.uniform(0.4, 0.9))}
    elif law == "lugre":
        keys |= {
            "kinetic": mu * float(rng.uniform(0.7, 1.0)), "stribeck_speed": speed * float(rng.uniform(0.05, 0.5)),
            "micro_damping": 0.02 * limit / speed, "viscous": 0.01 * limit / speed,
        }  # fmt: skip
    elif law == "nonlocal":
        keys |= {
            "bond_length": length, "kinetic": mu * float(rng.uniform(0.6, 1.0)), "reading": "stretch", "order": 1,
            "initial_bonds": float(rng.choice([0.0, 1.0])), "rest_growth": None,
            "slip_growth": None, "rest_speed": None,
        }  # fmt: skip
        if rng.random() < 0.5:
            keys |= {
                "rest_growth": speed * spec["omega"][0] * float(rng.uniform(0.01, 0.2)),
                "slip_growth": length * float(rng.uniform(0.3, 2.0)), "rest_speed": speed * float(rng.uniform(0.02, 0.2)),
            }  # fmt: skip
    face = {
        "keys": keys,
        "load": load,
        "amplitude": 0.0,
        "omega": 0.0,
        "phase": 0.0,
        "stiffness": 0.0,
        "heave": np.zeros(n),
    }
    if varies:
        face["omega"] = (
            2 * np.pi / spec["period"] * float(rng.choice([1.0, 2.0, rng.uniform(0.5, 2.5)]))
        )
        face["phase"] = float(rng.uniform(0, 2 * np.pi))
        face["amplitude"] = load * float(rng.choice([0.3, 0.8, 1.3]))
        if law != "elastic-plastic" and rng.random() < 0.4:
            heave = rng.uniform(-0.3, 0.3, n)
            face |= {
                "heave": heave,
                "stiffness": load / spec["length"] * float(rng.uniform(0.2, 1.0)),
            }
            face["amplitude"] *= 0.5
    return face


def make_basis(spec: dict) -> ModalBasis:
    """Return the modal basis of a spec."""
    names = tuple(map(str, range(spec["omega"].size)))
    return ModalBasis(
        names, spec["omega"], spec["zeta"], spec["slides"][0], spec["base"], spec["output"], spec["mass"],
        faces=spec["slides"],
    )  # fmt: skip


def make_interface_law(face: dict) -> LawNumbers:
    """Return the law of an interface for the engine."""
    keys = face["keys"]
    if keys["law"] == "jenkins":
        return masing.from_elements(*keys["elements"])
    varies = face["amplitude"] != 0 or face["stiffness"] != 0
    return make_law(SimpleNamespace(**keys), face["load"], 1.0, varies=varies)


def make_case(
    spec: dict,
    rtol: float = cases.DEFAULT_RTOL,
    n_steps: float = cases.MIN_STEPS,
) -> cases.Case:
    """Return the case of a spec."""
    modes = make_basis(spec)
    if spec["rows"] is not None:
        signal = drives.make_record(*spec["rows"], spec["period"])
    else:
        repeat = 1 if len(spec["tones"]) == 1 else 0
        signal = drives.make_tones(spec["tones"], spec["period"], repeat)
    interfaces = []
    for face, slide in zip(spec["faces"], spec["slides"]):
        load = cases.Load(
            face["load"],
            face["amplitude"],
            face["omega"],
            face["phase"],
            face["stiffness"],
            tuple(face["heave"]),
        )
        interfaces.append(cases.Interface(make_interface_law(face), load, slide))
    size = spec["length"]
    options = cases.Options(spec["kind"] != "release", rtol=rtol, n_steps=n_steps)
    rig = cases.make_rig(modes, signal, interfaces, (size, size * spec["omega"][0]), options)
    window = int(max(1, min(10, spec["cycles"] // 10)))
    schedule = cases.make_schedule(spec["cycles"], spec["period"], window)
    start = cases.make_start(rig, interfaces, SimpleNamespace(z=spec["z"], v=spec["v"]))
    return cases.Case(rig, start, *schedule, np.zeros(0), len(interfaces))
