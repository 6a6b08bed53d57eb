"""Random scenes of rigs, with every law, drive and structure, for program and reference.

`draw_spec(seed)` draws the numbers, `write_scene(spec, folder)` writes the scene and the record of its drive.
"""

import numpy as np

from patchfem.scene import format_scene

LAWS = (
    "coulomb",
    "coulomb",
    "weakening",
    "weakening",
    "elastic-plastic",
    "elastic-plastic",
    "iwan",
    "tanh",
    "bouc-wen",
    "lugre",
    "stretch",
    "stretch",
    "growing",
    "order",
    "report",
    "convolution",
)
DRIVES = (
    "sine",
    "sine",
    "sine",
    "sine",
    "force",
    "force",
    "step",
    "sweep",
    "levels",
    "file",
    "free",
    "free",
)


def draw_log_uniform(r, low: float, high: float) -> float:
    """Draw from a log-uniform distribution."""
    return float(np.exp(r.uniform(np.log(low), np.log(high))))


def draw_spec(seed: int) -> dict:
    """Return the numbers of the random scene of a seed by name, in SI units."""
    r = np.random.default_rng(seed)
    law = str(r.choice(LAWS))
    drive = str(r.choice(DRIVES))
    natural_frequency = draw_log_uniform(r, 20, 400)
    mass = draw_log_uniform(r, 0.2, 2)
    omega = 2 * np.pi * natural_frequency
    size = draw_log_uniform(r, 5, 80)
    out = {
        "seed": seed,
        "law": law,
        "drive": drive,
        "mass": mass,
        "size": size,
        "frequency": natural_frequency * float(r.choice([1.0, r.uniform(0.5, 1.6)])),
        "tolerance": float(r.choice([1e-3, 1e-2])),
        "cycles": int(r.choice([12, 20, 40])),
        "seeded": omega,
    }
    out["modes"] = _draw_modes(r, natural_frequency)
    base = out["modes"][0]["base"]
    out["load"] = mass * size * base / 0.3 * draw_log_uniform(r, 0.15, 1.1)
    reach = size * base / omega**2
    out |= draw_law_keys(r, law, out["load"], reach, reach * omega)
    _draw_structure(r, out, omega)
    _draw_drive(r, out, natural_frequency, reach)
    _draw_contact(r, out)
    if (
        drive in ("sine", "force", "free", "step")
        and law in ("coulomb", "weakening")
        and r.random() < 0.15
        and not out["several"]
    ):
        out["method"] = "march"
    if (
        drive in ("sine", "force")
        and law not in ("order", "report", "growing", "weakening")
        and r.random() < 0.15
        and not (out["several"] or out["patch"] or out.get("cubic") or out.get("load_amplitude"))
    ):
        out["method"] = "harmonic"
    return out


def _draw_modes(r, frequency: float) -> list:
    """Draw the modes of a rig whose first natural frequency is `frequency` [Hz]."""
    count = int(r.choice([1, 1, 2, 3, 4]))
    out = []
    base_remainder = 1.0
    for k in range(count):
        base = float(r.uniform(0.65, 0.9) if k == 0 else r.uniform(-0.25, 0.25))
        base_remainder -= base**2
        out.append(
            {
                "frequency": frequency if k == 0 else frequency * draw_log_uniform(r, 0.4, 4),
                "base": base,
                "damping": float(
                    r.choice([0.003, 0.01, 0.05, 0.2] + [0.0] * (k == 0 and count == 1))
                ),
                "slide": 1.0 if k == 0 else float(r.uniform(-0.4, 0.4)),
                "output": 1.0 if k == 0 else float(r.uniform(-0.5, 0.5)),
            }
        )
    return out


def draw_law_keys(r, law: str, load: float, reach: float, speed: float) -> dict:
    """Return the keys of [friction] by name.

    The lengths are fractions of the displacement that the drive would cause without friction.
    """
    length = reach * draw_log_uniform(r, 0.01, 0.6)
    out = {"static": 0.3}
    if law == "weakening" or law in ("growing", "lugre"):
        out["kinetic"] = 0.3 * float(r.uniform(0.3, 0.95))
    if law in ("elastic-plastic", "stretch", "growing", "order", "report", "convolution"):
        out["bond_length"] = length
    if law == "tanh":
        out["reference_speed"] = speed * draw_log_uniform(r, 1e-3, 0.1)
    if law in ("iwan", "bouc-wen", "lugre"):
        out["stiffness"] = 0.3 * load / length
    if law == "iwan":
        out |= {"chi": float(r.uniform(-0.7, 0.0)), "beta": float(r.choice([0.0, 0.5, 2.0]))}
    if law == "bouc-wen":
        out |= {
            "exponent": float(r.choice([1.0, 2.0, 1.5])),
            "shape": float(r.choice([0.5, 0.8, 1.0])),
        }
    if law == "lugre":
        out |= {
            "stribeck_speed": speed * draw_log_uniform(r, 0.01, 0.3),
            "micro_damping": 0.05 * 0.3 * load / speed,
            "viscous": 0.01 * 0.3 * load / speed,
        }
    if law == "growing":
        out |= {
            "rest_growth": speed / reach * length * draw_log_uniform(r, 1, 30),
            "slip_growth": length * draw_log_uniform(r, 0.2, 2),
            "rest_speed": speed * 0.01,
        }
    if law == "order":
        out["order"] = float(r.choice([0.5, 1.5, 2.0]))
    if law == "report":
        out["order"] = float(r.choice([0.0, 1.0, 1.0, 2.0]))
    return {"keys": out}


def _draw_structure(r, out: dict, omega: float) -> None:
    """Draw the structure: modes with one interface, or two masses with an interface each.

    There may be a spring in parallel with the interface, linear or nonlinear.
    """
    out["several"] = out["law"] not in ("order", "report", "convolution") and r.random() < 0.12
    if out["several"]:
        stiff = [out["mass"] * omega**2 * draw_log_uniform(r, 0.3, 2) for _ in range(3)]
        out["masses"] = {
            "mass": [out["mass"], out["mass"] * draw_log_uniform(r, 0.3, 2)],
            "stiffness": stiff,
            "damper": [0.01 * float(np.sqrt(k * out["mass"])) for k in stiff],
            "loads": [out["load"], out["load"] * draw_log_uniform(r, 0.2, 1)],
            "pairs": [[1, 0], [2, 0] if r.random() < 0.5 else [1, 2]],
        }
        return
    if r.random() < 0.12:
        out["bonded"] = {
            "stiffness": out["mass"] * omega**2 * draw_log_uniform(r, 0.1, 2),
            "damping": out["mass"] * omega * float(r.choice([0.0, 0.01])),
        }
    if r.random() < 0.08 and out["law"] not in ("order", "report", "convolution"):
        out["cubic"] = (
            out["mass"] * omega**2 / (out["size"] / omega**2) ** 2 * draw_log_uniform(r, 0.01, 0.3)
        )


def _draw_drive(r, out: dict, frequency: float, reach: float) -> None:
    """Draw the details of the drive."""
    kind = out["drive"]
    if out["several"] and kind in ("levels",):
        kind = out["drive"] = "sine"
    if kind == "sweep":
        low = frequency * r.uniform(0.6, 0.9)
        high = frequency * r.uniform(1.1, 1.5)
        ends = (low, high) if r.random() < 0.5 else (high, low)
        out["sweep"] = {
            "from": float(ends[0]),
            "to": float(ends[1]),
            "rate": float((high - low) * frequency / 30),
        }
    elif kind == "levels":
        out["levels"] = [out["size"] * part for part in (0.4, 0.7, 1.0)]
        out["cycles"] = int(r.choice([8, 15]))
    elif kind == "file":
        time = np.arange(0, 12 / frequency, 1 / (16 * frequency))
        parts = [(r.uniform(0.3, 2) * frequency, r.uniform(0, 6), r.normal()) for _ in range(4)]
        value = sum(a * np.sin(2 * np.pi * f * time + p) for f, p, a in parts)
        out["record"] = [time.tolist(), (out["size"] * value / np.abs(value).max()).tolist()]
    elif kind == "free":
        count = 2 if out["several"] else len(out["modes"])
        out["start"] = [
            reach * float(r.uniform(2, 8)),
            *(reach * float(r.uniform(-1, 1)) for _ in range(count - 1)),
        ]


def _draw_contact(r, out: dict) -> None:
    """Draw the contact: a point with constant or varying load, or a patch.

    A patch may be elastic in shear, and tilted.
    """
    out["patch"] = None
    if out["several"]:
        return
    draw = r.random()
    varies = out["law"] in ("coulomb", "elastic-plastic", "tanh", "stretch") and "cubic" not in out
    if draw < 0.06 and varies and out["drive"] != "levels":
        out["load_amplitude"], out["load_frequency"] = (
            out["load"] * float(r.uniform(0.1, 0.6)),
            out["frequency"] / 2,
        )
    elif draw < 0.22:
        shear = out["law"] in ("coulomb", "elastic-plastic", "stretch") and r.random() < 0.6
        out["patch"] = {
            "shear": shear,
            "tilt": float(r.choice([0.0, draw_log_uniform(r, 1e-5, 2e-4)])),
            "elements": 24,
        }


NAMES = {
    "weakening": "coulomb",
    "stretch": "nonlocal",
    "growing": "nonlocal",
    "order": "nonlocal",
    "report": "nonlocal",
}


def make_tables(s: dict, signal: str) -> dict:
    """Return the tables of the scene of a spec; signal: name of the file of a recorded drive."""
    law = {"law": NAMES.get(s["law"], s["law"])} | s["keys"]
    if s["law"] == "report":
        law["reading"] = "report"
    structure = _make_masses(s, law) if s["several"] else _make_modes(s)
    if s["drive"] == "free":
        structure["start"] = {"displacement": s["start"]}
    tables = {} if s["several"] else _make_contact(s) | {"friction": law}
    method = {"method": s["method"]} if "method" in s else {}
    return tables | {
        "structure": structure,
        "drive": _make_drive(s, signal),
        "accuracy": {"tolerance": s["tolerance"]} | method,
    }


def _make_contact(s: dict) -> dict:
    """Return the table of the patch, or of the load of a point."""
    if s["patch"] is not None:
        contact = {
            "length": "12.7 mm",
            "width": "12.7 mm",
            "height": "6.35 mm",
            "load": s["load"],
            "substrate": "Ti-8Al-1Mo-1V",
            "element_size": 12.7e-3 / s["patch"]["elements"],
        }
        contact |= {"shear": {}} if s["patch"]["shear"] else {}
        contact |= {"tilt": {"angle": s["patch"]["tilt"]}} if s["patch"]["tilt"] else {}
        return {"contact": contact}
    normal = {"load": s["load"]}
    if "load_amplitude" in s:
        normal |= {"amplitude": s["load_amplitude"], "frequency": s["load_frequency"]}
    return {"normal": normal}


def _make_modes(s: dict) -> dict:
    """Return the structure of modes."""
    out = {"moving_mass": s["mass"]}
    if "bonded" in s:
        out["bonded"] = s["bonded"]
    if "cubic" in s:
        out["stiffening"] = {"cubic": s["cubic"]}
    names = ("frequency", "damping", "slide", "base", "output")
    modes = [
        {"name": f"m{k}"} | {key: mode[key] for key in names} for k, mode in enumerate(s["modes"])
    ]
    return out | {"mode": modes}


def _make_masses(s: dict, law: dict) -> dict:
    """Return the structure of two masses."""
    m = s["masses"]
    links = list(zip(([1, 0], [2, 1], [2, 0]), m["stiffness"], m["damper"]))
    return {
        "masses": m["mass"],
        "spring": [{"between": pair, "stiffness": k} for pair, k, _ in links],
        "damper": [{"between": pair, "coefficient": c} for pair, _, c in links],
        "interface": [
            {"between": pair, "load": load} | law for pair, load in zip(m["pairs"], m["loads"])
        ],
    }


def _make_drive(s: dict, signal: str) -> dict:
    """Return the table of the drive."""
    kind = s["drive"]
    size = {"acceleration": s["size"]}
    cycles = {"cycles": s["cycles"]}
    if kind == "free":
        return {"kind": "free"} | cycles
    frequency = {"frequency": s["frequency"]}
    if kind == "force":
        driven_mass = {"mass": 1} if s["several"] else {}
        force = {"kind": "force", "force": s["mass"] * s["size"]}
        return force | frequency | driven_mass | cycles
    return {"kind": "base"} | {
        "step": lambda: {"waveform": "step"} | size | cycles,
        "sweep": lambda: {"waveform": "sweep"} | s["sweep"] | size,
        "levels": lambda: {"waveform": "levels", "levels": s["levels"]} | frequency | cycles,
        "file": lambda: {"waveform": "file", "file": signal},
        "sine": lambda: frequency | size | cycles,
    }[kind]()


def format_record(s: dict) -> str:
    """Return the table of a recorded drive as text."""
    return "time [s],acceleration [m/s^2]\n" + "".join(
        f"{t!r},{a!r}\n" for t, a in zip(*s["record"])
    )


def write_scene(s: dict, folder):
    """Write the scene of a spec and its recorded drive; return the path of the scene."""
    path = folder / f"scene{s['seed']}.toml"
    if "record" in s:
        (folder / f"signal{s['seed']}.csv").write_text(format_record(s), "utf-8")
    path.write_text(format_scene(make_tables(s, f"signal{s['seed']}.csv")), "utf-8")
    return path
