"""Random rigs as models, computed by the march of contact points.

The rigs are those of `random_rigs.json`, with the measures of an independent program, and further ones that a seed draws,
with those of the event-driven engine. A spec becomes the model of a scene with a mass for each
mode and an interface for each face, whose modes, drive and start are then those of the spec. Parallel elements, loads that
follow the motion, and loads that oscillate at one of several faces have no keys in a scene.
"""

from dataclasses import replace
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import Row, measure_rows
from random_rigs import RIGS, ZERO

from patchfem.api import build, run
from patchfem.core import InitialState, ModalBasis, PatchfemError
from patchfem.scene import loads
from patchfem.scene.scene import SceneError
from patchfem.structure.drives import RecordedDrive

UNITS = {
    "bond_length": "m",
    "stiffness": "N/m",
    "reference_speed": "m/s",
    "stribeck_speed": "m/s",
    "micro_damping": "N s/m",
    "viscous": "N s/m",
    "rest_growth": "m/s^2",
    "slip_growth": "m",
    "rest_speed": "m/s",
}
# Relative error of the references: the round-off of a period of 7 digits in the work of a transient
REFERENCE_ERROR = 3e-5
LAWS = ("coulomb", "elastic-plastic", "tanh", "nonlocal", "iwan", "bouc-wen", "lugre")
STICKING_LAWS = ("coulomb", "elastic-plastic")
KINDS = ("sine", "sine", "tones", "record", "release")
# Measures that check a run, and those of a motion that does not repeat
CHECKS = ("energy_balance", "work_check", "drift")
# Laws whose keys name a stiffness; other keys of a spec list one that the law does not take.
STIFF_LAWS = ("elastic-plastic", "iwan", "bouc-wen", "lugre")


class Score(NamedTuple):
    """Rows of measures beside their references, CPU seconds of the run, and why it has no result."""

    rows: list[Row]
    seconds: float
    failure: str = ""


def find_missing_key(spec: dict) -> str:
    """Return why no scene has a spec; "" if there is one."""
    faces = spec["faces"]
    if any(face["keys"]["law"] == "jenkins" for face in faces):
        return "parallel elements"
    if any(face["stiffness"] for face in faces):
        return "a load that follows the motion"
    if len(faces) > 1 and any(face["amplitude"] for face in faces):
        return "a load that oscillates at one of several faces"
    if any(face["keys"].get("chi", 0.0) > 0 for face in faces):
        return "an exponent chi above 0"
    return ""


def write_keys(face: dict) -> str:
    """Return the keys of the friction law of a face as TOML; elastic-plastic springs follow the load."""
    keys = face["keys"]
    if keys["law"] == "elastic-plastic" and keys["bond_length"] is None:
        length = keys["static"] * face["load"] / keys["stiffness"]
        keys = keys | {"bond_length": length, "stiffness": None}
    lines = []
    for name, value in keys.items():
        if value is None or (name == "stiffness" and keys["law"] not in STIFF_LAWS):
            continue
        text = (
            f'"{value} {UNITS[name]}"'
            if name in UNITS
            else f'"{value}"'
            if isinstance(value, str)
            else f"{float(value)!r}"
        )
        lines.append(f"{name} = {text}\n")
    return "".join(lines)


def write_scene(spec: dict) -> str:
    """Return a scene with the laws, loads and drive of a spec, and with masses in place of its modes."""
    n = len(spec["omega"])
    text = ""
    if len(spec["faces"]) == 1:
        face = spec["faces"][0]
        text = f'[normal]\nload = "{face["load"]} N"\n'
        if face["amplitude"]:
            text += f'amplitude = "{face["amplitude"]} N"\nfrequency = "{face["omega"] / 2 / np.pi:.17g} Hz"\n'
            text += f'phase = "{face["phase"]} rad"\n'
        text += f'[friction]\n{write_keys(face)}[structure]\nmoving_mass = "1 kg"\n'
        for k in range(n):
            text += f'[[structure.mode]]\nname = "m{k}"\nfrequency = "100 Hz"\ndamping = 0.01\nslide = 0.1\n'
    else:
        text = f"[structure]\nmasses = {['1 kg'] * n}\n"
        for k in range(n):
            text += f'[[structure.spring]]\nbetween = [{k + 1}, 0]\nstiffness = "1e5 N/m"\n'
        for face in spec["faces"]:
            text += f'[[structure.interface]]\nbetween = [1, 0]\nload = "{face["load"]} N"\n'
            text += write_keys(face)
    if spec["kind"] == "release":
        text += '[drive]\nkind = "free"\ndisplacement = "1 um"\n'
    elif spec["kind"] == "tones":
        a, omega, phi = np.transpose(spec["tones"]).tolist()
        text += '[drive]\nkind = "base"\nwaveform = "tones"\n'
        text += f"frequencies = {[f'{w / 2 / np.pi:.17g} Hz' for w in omega]}\n"
        text += (
            f"accelerations = {[f'{x} m/s^2' for x in a]}\nphases = {[f'{x} rad' for x in phi]}\n"
        )
    else:
        # A record replaces the sine after the model is built.
        amplitude, omega = (spec["tones"] or [[1.0, 2 * np.pi / spec["period"]]])[0][:2]
        text += f'[drive]\nkind = "base"\nacceleration = "{amplitude} m/s^2"\nfrequency = "{omega / 2 / np.pi:.17g} Hz"\n'
    return text + f"cycles = {spec['cycles']}\n"


def make_model(spec: dict, accuracy: str = ""):
    """Return the model of a spec; `accuracy` are keys of [accuracy]."""
    model = build(loads(f"{write_scene(spec)}[accuracy]\n{accuracy}"))
    names = ("omega", "zeta", "base", "output", "slides")
    omega, zeta, base, output, slides = (np.array(spec[name], float) for name in names)
    modes = ModalBasis(
        tuple(f"m{k}" for k in range(omega.size)),
        omega,
        zeta,
        slides[0],
        base,
        output,
        spec["mass"],
        faces=None if len(slides) == 1 else slides,
    )
    frequencies = omega / (2 * np.pi)
    rig = replace(
        model.rig, modes=modes, structure=replace(model.rig.structure, frequencies=frequencies)
    )
    if spec["rows"] is not None:
        drive = RecordedDrive(*map(np.array, spec["rows"]), spec["period"])
        rig = rig.with_signal(drive)
    if spec["kind"] == "release":
        rig = replace(rig, start=InitialState(np.array(spec["z"]), np.array(spec["v"])))
        drive = replace(rig.drive.signal, period=spec["period"])
        rig = rig.with_signal(drive)
    return replace(model, rig=rig)


def score_run(model, truths: dict, doubts: dict) -> Score:
    """Return the rows of a run of a model beside references."""
    begin = process_time()
    try:
        result = run(model, say=lambda line: None)
    except Exception as error:  # a fault of the program is a row of the report
        return Score([], process_time() - begin, f"{type(error).__name__}: {error}")
    return Score(measure_rows(result.measures, truths, doubts), process_time() - begin)


def score_rig(name: str, tolerance: float = 1e-2) -> Score:
    """Return the rows of a stored random rig beside its references.

    The amplitude of a release and the sticking of a law that creeps have another definition in the references.
    """
    spec = RIGS[name]["spec"]
    true = {key: value for key, value in RIGS[name]["true"].items() if key != "drift_per_cycle"}
    if spec["kind"] == "release":
        true = {
            key: value
            for key, value in true.items()
            if not key.startswith(("relative_displacement", "stick_fraction"))
        }
    sizes = {"absolute_acceleration_peak": spec["acceleration"]}
    doubts = {
        key: REFERENCE_ERROR * abs(value) + ZERO * sizes.get(key, 1.0)
        for key, value in true.items()
    }
    model = make_model(spec, f'tolerance = {tolerance}\nmethod = "march"\n')
    return score_run(model, true, doubts)


def score_drawn_rig(spec: dict, tolerance: float = 1e-2) -> Score | None:
    """Return the rows of a spec beside the measures of the event-driven engine; None if it cannot compute the spec."""
    try:
        exact = make_model(spec, 'tolerance = 1e-4\nmethod = "exact"\n')
        measures = run(exact, say=lambda line: None).measures
    except (SceneError, PatchfemError):
        return None
    known = {
        name: measure
        for name, measure in measures.items()
        if None not in (measure.value, measure.error) and not name.startswith(CHECKS)
    }
    truths = {name: measure.value for name, measure in known.items()}
    doubts = {name: measure.error for name, measure in known.items()}
    model = make_model(spec, f'tolerance = {tolerance}\nmethod = "march"\n')
    return score_run(model, truths, doubts)


# ---- drawn rigs


def draw_spec(seed: int, laws: tuple = LAWS, counts: tuple = (1, 1, 2, 3, 4)) -> dict:
    """Return the spec of a random rig: 1 to 5 modes, driven or released, a number of faces from `counts` with these laws."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    n_faces = int(rng.choice(counts))
    omega = 2 * np.pi * np.sort(rng.uniform(60, 400, n))
    kind = KINDS[rng.integers(len(KINDS))]
    drive = omega[0] * rng.uniform(0.6, 1.4)
    acceleration = rng.uniform(5, 60)
    mass = rng.uniform(0.3, 3)
    travel = acceleration / drive**2
    cycles = int(rng.integers(8, 20))
    base = rng.uniform(-0.5, 0.5, n)
    output = rng.uniform(-0.5, 0.8, n)
    base[0], output[0] = rng.uniform(0.5, 0.9), 1.0
    loads = rng.uniform(0.1, 1.2, n_faces) * mass * acceleration / 0.4 / n_faces
    faces = [_draw_face(rng, laws, load, travel, drive, can_vary=n_faces == 1) for load in loads]

    # The first tone is the drive of a sine; a record has four rows per cycle.
    period = 2 * np.pi / (omega[0] if kind == "release" else drive)
    tones = [[acceleration, drive, 0.0]]
    if kind == "tones":
        speeds = drive * np.append(1.0, rng.uniform(1.5, 3, 2))
        tones = np.transpose(
            [acceleration * np.array([0.5, 0.4, 0.4]), speeds, rng.uniform(0, 6, 3)]
        )
    rows = None
    if kind == "record":
        time = np.arange(4 * cycles + 1) * period / 4
        rows = [time, np.append(0.0, 1.5 * acceleration * rng.uniform(-1, 1, 4 * cycles))]
    start = np.zeros(n)
    if kind == "release":
        start[0] = travel * rng.uniform(1, 6)
    return {
        "omega": omega, "zeta": rng.uniform(1e-3, 0.03, n), "mass": mass, "base": base, "output": output,
        "slides": rng.uniform(-1, 1, (n_faces, n)), "kind": kind, "period": period, "cycles": cycles, "rows": rows,
        "tones": np.asarray(tones).tolist() if kind in ("sine", "tones") else [], "z": start, "v": 0 * start,
        "length": travel, "acceleration": acceleration, "faces": faces,
    }  # fmt: skip


def _draw_face(rng, laws: tuple, load: float, travel: float, drive: float, *, can_vary) -> dict:
    """Return a face of a random law of `laws`; its load may oscillate if it `can_vary`."""
    law = laws[rng.integers(len(laws))]
    static = rng.uniform(0.15, 0.8)
    speed = drive * travel
    stretch = travel * 10 ** rng.uniform(-2, -0.3)
    keys = {"law": law, "static": static, "kinetic": None, "bond_length": None}
    keys["stiffness"] = static * load / stretch
    weaker = static * rng.uniform(0.6, 1)
    has_more = rng.random() < 0.5
    if law == "coulomb" and has_more:
        keys["kinetic"] = weaker
    elif law == "tanh":
        keys["reference_speed"] = speed * 10 ** rng.uniform(-2, -0.3)
    elif law == "nonlocal":
        keys |= {"bond_length": stretch, "initial_bonds": float(rng.random() < 0.5)}
        if has_more:
            keys |= {"kinetic": weaker, "rest_growth": 10 ** rng.uniform(-1, 1)}
            keys |= {"slip_growth": stretch, "rest_speed": speed * 10 ** rng.uniform(-3, -1)}
    elif law == "iwan":
        keys |= {"chi": rng.uniform(-0.9, -0.05), "beta": rng.uniform(0, 3)}
    elif law == "bouc-wen":
        keys |= {"exponent": rng.uniform(1, 3), "shape": rng.uniform(0.3, 1)}
    elif law == "lugre":
        damping = static * load / speed * rng.uniform(0, 0.2)
        keys |= {"kinetic": weaker, "stribeck_speed": speed * 10 ** rng.uniform(-1, 0)}
        keys |= {"micro_damping": damping, "viscous": 0.1 * damping}
    face = {
        "keys": keys,
        "load": load,
        "amplitude": 0.0,
        "omega": 0.0,
        "phase": 0.0,
        "stiffness": 0.0,
    }
    if can_vary and rng.random() < 0.6:
        face["amplitude"] = load * rng.choice([0.2, 0.5, 0.8, 1.3])
        face["omega"] = drive * rng.choice([0.5, 1, 1.37, 2])
        face["phase"] = rng.uniform(0, 2 * np.pi)
    return face
