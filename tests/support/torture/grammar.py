"""Cheap random scenes of every kind of run, table, law, drive and method, as nested dicts.

Most of them run; combinations that are not permitted are refused by the program.
"""

from patchfem.effects import LAWS, WAVEFORMS

from .trial import Trial

OF_LAWS = {  # Key -> (low, high, unit) for a rig with a motion of about 50 um and 30 N of friction.
    "kinetic": (0.1, 0.3, ""),
    "reference_speed": (1e-4, 1e-2, "m/s"),
    "bond_length": (1e-7, 5e-5, "m"),
    "stiffness": (1e6, 1e8, "N/m"),
    "beta": (0.1, 4.0, ""),
    "exponent": (0.5, 3.0, ""),
    "shape": (0.5, 1.0, ""),
    "stribeck_speed": (1e-4, 1e-2, "m/s"),
    "micro_damping": (1.0, 100.0, "N s/m"),
    "viscous": (0.1, 10.0, "N s/m"),
    "order": (0.5, 2.0, ""),
    "rest_growth": (0.1, 100.0, "m/s^2"),
    "slip_growth": (1e-8, 1e-6, "m"),
    "rest_speed": (1e-6, 1e-4, "m/s"),
    "initial_bonds": (0.1, 1.0, ""),
    "spread": (1e-6, 1e-4, "m"),
}
LENGTH, WIDTH, HEIGHT = (5e-3, 3e-2), (5e-3, 3e-2), (2e-3, 1e-2)
SUBSTRATES = (
    "Ti-8Al-1Mo-1V",
    "steel",
    "WC-Co",
    {"young": "70 GPa", "poisson": 0.33, "density": "2700 kg/m^3"},
)


def draw_quantity(trial: Trial, low: float, high: float, unit: str) -> str:
    """Return a quantity as text, such as "0.0012 m", with a log-uniform value."""
    return f"{trial.log_uniform(low, high)!r} {unit}"


def draw_scene(trial: Trial, kind: str = "") -> dict:
    """Return a random scene; kind: patch, bench, rig, masses or linear, drawn if empty."""
    kind = kind or trial.draw(*"patch patch bench bench rig rig rig masses linear".split())
    out = {"title": f"{kind} of chance"}
    if kind in ("patch", "bench", "rig"):
        out |= (
            {"contact": draw_patch(trial)}
            if kind == "patch" or trial.chance(0.35)
            else {"normal": draw_point(trial)}
        )
    if kind in ("bench", "rig"):
        out["friction"] = draw_friction(trial, "width" in out.get("normal", {}) or "contact" in out)
    if kind == "bench":
        out["slide"] = draw_slide(trial)
        if trial.chance(0.1):
            out["wear"] = {
                "coefficient": draw_quantity(trial, 1e-16, 1e-13, "m^2/N"),
                "cycles": trial.log_uniform(10, 1e5),
            }
    if kind in ("rig", "linear"):
        out["structure"] = draw_modes(trial, kind)
    if kind == "masses":
        out["structure"] = draw_masses(trial)
    if kind not in ("patch", "bench"):
        out["drive"] = draw_drive(trial, out["structure"])
    out["accuracy"] = draw_accuracy(trial, kind)
    return out


def draw_patch(trial: Trial) -> dict:
    """Return [contact] with some of its tables."""
    length = trial.log_uniform(*LENGTH)
    out = {
        "length": f"{length!r} m",
        "width": draw_quantity(trial, *WIDTH, "m"),
        "height": draw_quantity(trial, *HEIGHT, "m"),
        "substrate": trial.draw(*SUBSTRATES),
        "load": draw_quantity(trial, 5, 500, "N"),
    }
    if trial.chance(0.8):
        out["element_size"] = f"{length / trial.r.integers(8, 40):.4g} m"
    tables = {
        "coating": lambda: {
            "material": "WC-Co",
            "thickness": draw_quantity(trial, 2e-5, 4e-4, "m"),
        },
        "tilt": lambda: {
            "angle": draw_quantity(trial, 1e-6, 1e-3, "rad"),
            "on": trial.draw("upper", "lower"),
        },
        "load_line": lambda: {"offset": f"{length * trial.r.uniform(-0.6, 0.6):.4g} m"},
        "holder": lambda: {trial.draw("rotational_stiffness", "tangential_stiffness"): ""},
        "crown": lambda: {"radius": draw_quantity(trial, 0.05, 50, "m")},
        "step": lambda: {
            "height": draw_quantity(trial, 1e-8, 1e-5, "m"),
            "at": f"{length * trial.r.uniform(-0.5, 0.5):.4g} m",
        },
        "asperities": lambda: draw_asperities(trial),
        "shear": dict,
        "strips": lambda: {
            "count": int(trial.r.integers(1, 5)),
            "roll": draw_quantity(trial, 1e-7, 1e-3, "rad"),
        },
        "grooves": lambda: draw_grooves(trial),
        "upper": lambda: {trial.draw("height", "length"): draw_quantity(trial, 3e-3, 1e-2, "m")},
        "lower": lambda: {
            trial.draw("chamfer", "end_radius"): draw_quantity(trial, 1e-5, 5e-4, "m")
        },
        "approach": lambda: {"distance": draw_quantity(trial, 1e-8, 1e-6, "m")},
    }
    for name, draw_table in tables.items():
        if trial.chance(0.12):
            out[name] = draw_table()
    for key, unit in (("rotational_stiffness", "N m/rad"), ("tangential_stiffness", "N/m")):
        if key in out.get("holder", {}):
            out["holder"][key] = draw_quantity(trial, 1e3, 1e7, unit)
    if "approach" in out:
        del out["load"]
    return out


def draw_asperities(trial: Trial) -> dict:
    """Return [contact.asperities] with the keys of its law."""
    law = trial.draw("linear", "exponential", "hertz")
    keys = {
        "linear": {"normal_stiffness": draw_quantity(trial, 1e11, 1e14, "Pa/m")},
        "exponential": {
            "normal_stiffness": draw_quantity(trial, 1e11, 1e14, "Pa/m"),
            "decay_length": draw_quantity(trial, 1e-8, 1e-6, "m"),
        },
        "hertz": {
            "radius": draw_quantity(trial, 1e-6, 1e-4, "m"),
            "density": draw_quantity(trial, 1e8, 1e11, "1/m^2"),
            "height_deviation": draw_quantity(trial, 1e-8, 1e-6, "m"),
        },
    }[law]
    return (
        {"law": law}
        | keys
        | ({"tangential_ratio": trial.log_uniform(0.1, 1.0)} if trial.chance(0.3) else {})
    )


def draw_grooves(trial: Trial) -> dict:
    """Return [contact.grooves] or [normal.grooves]."""
    return {
        "wavelength": draw_quantity(trial, 2e-5, 2e-4, "m"),
        "amplitude": draw_quantity(trial, 1e-7, 1e-5, "m"),
    }


def draw_point(trial: Trial) -> dict:
    """Return [normal]; in about one of eight scenes the load varies."""
    load = trial.log_uniform(5, 500)
    out = {"load": f"{load!r} N"}
    if trial.chance(0.12):
        out |= {
            "amplitude": f"{load * trial.r.uniform(0.1, 1.5):.4g} N",
            "frequency": draw_quantity(trial, 20, 300, "Hz"),
        }
    if trial.chance(0.1):
        out["width"] = draw_quantity(trial, 1e-3, 1e-2, "m")
    if trial.chance(0.08):
        out["grooves"] = draw_grooves(trial)
    return out


def draw_friction(trial: Trial, spread: bool = False, law: str = "") -> dict:
    """Return [friction], or the same keys of an interface: a law with its required and some optional keys."""
    law = law or trial.draw(*LAWS)
    required, optional = (words.replace("|stiffness", "").split() for words in LAWS[law].keys)
    out = {"law": law, "static": round(float(trial.r.uniform(0.3, 0.8)), 3)}
    grows = trial.chance(0.3)
    for key in (*required, *(key for key in optional if trial.chance(0.25))):
        if (
            key in OF_LAWS
            and key not in ("rest_growth", "slip_growth")
            and (key != "spread" or spread)
        ):
            low, high, unit = OF_LAWS[key]
            out[key] = (
                draw_quantity(trial, low, high, unit) if unit else trial.log_uniform(low, high)
            )
    if "chi" in required:
        out["chi"] = round(-float(trial.r.uniform(0, 0.9)), 3)
    if grows and "rest_growth" in (*required, *optional):
        out |= {key: draw_quantity(trial, *OF_LAWS[key]) for key in ("rest_growth", "slip_growth")}
    if "reading" in optional and trial.chance(0.2):
        out["reading"] = "report"
    return out


def draw_slide(trial: Trial) -> dict:
    """Return [slide] of any kind except a file."""
    kind = trial.draw("constant", "sine", "triangle", "dwell")
    reach = {"distance": draw_quantity(trial, 1e-6, 1e-4, "m")}
    speed = {"speed": draw_quantity(trial, 1e-4, 1e-2, "m/s")}
    swing = {
        "amplitude": draw_quantity(trial, 1e-6, 1e-4, "m"),
        "cycles": int(trial.r.integers(1, 4)),
    }
    more = {
        "constant": reach | speed,
        "sine": swing | {"frequency": draw_quantity(trial, 1, 200, "Hz")},
        "triangle": swing | speed,
        "dwell": reach | speed | {"hold": draw_quantity(trial, 1e-3, 0.1, "s")},
    }[kind]
    return {"kind": kind} | more


def draw_modes(trial: Trial, kind: str = "rig") -> dict:
    """Return [structure] with one to three modes."""
    first = trial.log_uniform(40, 300)
    out = []
    for k in range(trial.draw(1, 1, 1, 2, 3)):
        mode = {
            "name": f"m{k}",
            "frequency": f"{first * (1 if k == 0 else trial.log_uniform(0.5, 3)):.4g} Hz",
            "damping": trial.draw(0.003, 0.01, 0.05, 0.2),
            "slide": 1.0 if k == 0 else 0.3,
            "base": 0.8 if k == 0 else 0.1,
        }
        if k and trial.chance(0.2):
            mode |= (
                {"pitch": draw_quantity(trial, 1, 20, "rad/m")}
                if trial.chance(0.5)
                else {"normal": 0.1}
            )
        out.append(mode)
    table = {"moving_mass": draw_quantity(trial, 0.2, 2, "kg"), "mode": out}
    if kind == "rig" and trial.chance(0.1):
        table["bonded"] = {"stiffness": draw_quantity(trial, 1e4, 1e6, "N/m")}
    if trial.chance(0.06):
        table["stiffening"] = {"cubic": draw_quantity(trial, 1e9, 1e12, "N/m^3")}
    return table


def draw_masses(trial: Trial) -> dict:
    """Return [structure] with two masses, springs, dampers and one or two interfaces."""
    between = ([1, 0], [2, 1], [2, 0])
    laws = [draw_friction(trial) for _ in range(trial.draw(1, 2))]
    return {
        "masses": [draw_quantity(trial, 0.2, 2, "kg") for _ in range(2)],
        "spring": [
            {"between": pair, "stiffness": draw_quantity(trial, 5e4, 2e6, "N/m")}
            for pair in between
        ],
        "damper": [
            {"between": pair, "coefficient": draw_quantity(trial, 1, 50, "N s/m")}
            for pair in between[:2]
        ],
        "interface": [
            {"between": between[2 * k], "load": draw_quantity(trial, 5, 200, "N")} | law
            for k, law in enumerate(laws)
        ],
    }


def draw_drive(trial: Trial, structure: dict) -> dict:
    """Return [drive] with the keys of its waveform; a release also sets the start of the structure."""
    count = len(structure.get("masses", structure.get("mode", ())))
    kind = trial.draw("base", "base", "base", "force", "free")
    if kind == "free":
        structure["start"] = {
            "displacement": [draw_quantity(trial, 1e-5, 1e-3, "m") for _ in range(count)]
        }
        return {"kind": kind, "cycles": int(trial.r.integers(3, 20))}
    wave = trial.draw(
        "sine", "sine", "sine", *(waveform for waveform in WAVEFORMS if waveform != "file")
    )
    size = (
        {"force": draw_quantity(trial, 1, 100, "N")}
        if kind == "force"
        else {trial.draw("acceleration", "acceleration", "displacement"): ""}
    )
    if kind == "base":
        size = {
            key: draw_quantity(trial, 2, 60, "m/s^2")
            if key == "acceleration"
            else draw_quantity(trial, 1e-5, 5e-4, "m")
            for key in size
        }
    out = {"kind": kind, "waveform": wave}
    if kind == "force" and "masses" in structure:
        out["mass"] = 1
    if wave == "levels":
        out["levels"] = [
            f"{a:.3g} {'N' if kind == 'force' else 'm/s^2'}"
            for a in sorted(trial.r.uniform(1, 60, trial.draw(1, 2, 4)))
        ]
    else:
        out |= size
    if wave in ("sine", "levels"):
        out["frequency"] = draw_quantity(trial, 50, 300, "Hz")
    if wave == "sweep":
        out |= {
            "from": draw_quantity(trial, 60, 120, "Hz"),
            "to": draw_quantity(trial, 130, 300, "Hz"),
            "rate": draw_quantity(trial, 300, 3000, "Hz/s"),
        }
    else:
        out["cycles"] = int(trial.r.integers(3, 20))
    return out


def draw_accuracy(trial: Trial, kind: str) -> dict:
    """Return [accuracy]: a coarse tolerance, and a method in one of five scenes."""
    out = {"tolerance": trial.draw(1e-2, 1e-2, 3e-3)}
    if kind in ("rig", "linear", "masses") and trial.chance(0.2):
        out["method"] = trial.draw("exact", "march", "harmonic")
    return out
