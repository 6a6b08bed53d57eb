"""Random scenes of rigs, with every law, drive and structure, for program and reference.

`draw_spec(seed)` draws the numbers, `format_scene(spec)` writes the scene, and `format_record(spec)` is the table of a
drive from a file.
"""

import numpy as np

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


def format_table(name: str, values: dict) -> str:
    """Return a table of a scene as text."""
    return f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in values.items())


def format_quantity(value: float, unit: str) -> str:
    """Return a quantity as text of a scene."""
    return f'"{float(value)!r} {unit}"'


UNITS = {
    "bond_length": "m",
    "reference_speed": "m/s",
    "stiffness": "N/m",
    "stribeck_speed": "m/s",
    "micro_damping": "N s/m",
    "viscous": "N s/m",
    "rest_growth": "m/s^2",
    "slip_growth": "m",
    "rest_speed": "m/s",
}
NAMES = {
    "weakening": "coulomb",
    "stretch": "nonlocal",
    "growing": "nonlocal",
    "order": "nonlocal",
    "report": "nonlocal",
}


def format_law_keys(s: dict) -> dict:
    """Return the keys of the law as text values of a scene."""
    name = NAMES.get(s["law"], s["law"])
    out = {"law": f'"{name}"'} | ({"reading": '"report"'} if s["law"] == "report" else {})
    return out | {
        k: format_quantity(v, UNITS[k]) if k in UNITS else repr(float(v))
        for k, v in s["keys"].items()
    }


def format_scene(s: dict, signal: str = "signal.csv") -> str:
    """Return the scene of a spec as text; signal: name of the file of a recorded drive."""
    if s["several"]:
        return _format_masses(s) + _format_drive(s, signal) + _format_accuracy(s)
    parts = []
    if s["patch"] is not None:
        p = s["patch"]
        parts.append(
            format_table(
                "contact",
                {
                    "length": '"12.7 mm"',
                    "width": '"12.7 mm"',
                    "height": '"6.35 mm"',
                    "load": format_quantity(s["load"], "N"),
                    "substrate": '"Ti-8Al-1Mo-1V"',
                    "element_size": format_quantity(12.7e-3 / p["elements"], "m"),
                },
            )
        )
        parts += ["[contact.shear]\n"] * p["shear"]
        parts += [format_table("contact.tilt", {"angle": format_quantity(p["tilt"], "rad")})] * (
            p["tilt"] > 0
        )
    else:
        variation = (
            {
                "amplitude": format_quantity(s["load_amplitude"], "N"),
                "frequency": format_quantity(s["load_frequency"], "Hz"),
            }
            if "load_amplitude" in s
            else {}
        )
        parts.append(format_table("normal", {"load": format_quantity(s["load"], "N")} | variation))
    parts += [
        format_table("friction", format_law_keys(s)),
        format_table("structure", {"moving_mass": format_quantity(s["mass"], "kg")}),
    ]
    if "bonded" in s:
        parts.append(
            format_table(
                "structure.bonded",
                {
                    "stiffness": format_quantity(s["bonded"]["stiffness"], "N/m"),
                    "damping": format_quantity(s["bonded"]["damping"], "N s/m"),
                },
            )
        )
    if "cubic" in s:
        parts.append(
            format_table("structure.stiffening", {"cubic": format_quantity(s["cubic"], "N/m^3")})
        )
    for k, mode in enumerate(s["modes"]):
        parts.append(
            "["
            + format_table(
                "structure.mode",
                {"name": f'"m{k}"', "frequency": format_quantity(mode["frequency"], "Hz")}
                | {key: repr(mode[key]) for key in ("damping", "slide", "base", "output")},
            ).replace("]", "]]", 1)
        )
    return "".join(parts) + _format_drive(s, signal) + _format_accuracy(s)


def _format_masses(s: dict) -> str:
    """Return the structure of two masses as text."""
    m = s["masses"]
    parts = [
        format_table(
            "structure",
            {"masses": "[" + ", ".join(format_quantity(mass, "kg") for mass in m["mass"]) + "]"},
        )
    ]
    for pair, k, c in zip(([1, 0], [2, 1], [2, 0]), m["stiffness"], m["damper"]):
        parts.append(
            "["
            + format_table(
                "structure.spring", {"between": pair, "stiffness": format_quantity(k, "N/m")}
            ).replace("]", "]]", 1)
        )
        parts.append(
            "["
            + format_table(
                "structure.damper", {"between": pair, "coefficient": format_quantity(c, "N s/m")}
            ).replace("]", "]]", 1)
        )
    for pair, load in zip(m["pairs"], m["loads"]):
        keys = {"between": pair, "load": format_quantity(load, "N")} | format_law_keys(s)
        parts.append("[" + format_table("structure.interface", keys).replace("]", "]]", 1))
    return "".join(parts)


def _format_drive(s: dict, signal: str) -> str:
    """Return the drive as text."""
    kind = s["drive"]
    size = s["size"]
    out = ""
    force = s["mass"] * size
    driven_mass = {"mass": 1} if s["several"] else {}
    cycles = {"cycles": s["cycles"]}
    if kind == "free":
        out = format_table(
            "structure.start",
            {"displacement": "[" + ", ".join(format_quantity(x, "m") for x in s["start"]) + "]"},
        )
        return out + format_table("drive", {"kind": '"free"'} | cycles)
    if kind == "force":
        return format_table(
            "drive",
            {
                "kind": '"force"',
                "frequency": format_quantity(s["frequency"], "Hz"),
                "force": format_quantity(force, "N"),
            }
            | driven_mass
            | cycles,
        )
    if kind == "step":
        return format_table(
            "drive",
            {"kind": '"base"', "waveform": '"step"', "acceleration": format_quantity(size, "m/s^2")}
            | cycles,
        )
    if kind == "sweep":
        w = s["sweep"]
        return format_table(
            "drive",
            {
                "kind": '"base"',
                "waveform": '"sweep"',
                "from": format_quantity(w["from"], "Hz"),
                "to": format_quantity(w["to"], "Hz"),
                "rate": format_quantity(w["rate"], "Hz/s"),
                "acceleration": format_quantity(size, "m/s^2"),
            },
        )
    if kind == "levels":
        rows = "[" + ", ".join(format_quantity(level, "m/s^2") for level in s["levels"]) + "]"
        return format_table(
            "drive",
            {
                "kind": '"base"',
                "waveform": '"levels"',
                "frequency": format_quantity(s["frequency"], "Hz"),
                "levels": rows,
            }
            | cycles,
        )
    if kind == "file":
        return format_table(
            "drive", {"kind": '"base"', "waveform": '"file"', "file": f'"{signal}"'}
        )
    return format_table(
        "drive",
        {
            "kind": '"base"',
            "frequency": format_quantity(s["frequency"], "Hz"),
            "acceleration": format_quantity(size, "m/s^2"),
        }
        | cycles,
    )


def _format_accuracy(s: dict) -> str:
    """Return [accuracy] as text."""
    method = {"method": f'"{s["method"]}"'} if "method" in s else {}
    return format_table("accuracy", {"tolerance": s["tolerance"]} | method)


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
    path.write_text(format_scene(s, f"signal{s['seed']}.csv"), "utf-8")
    return path
