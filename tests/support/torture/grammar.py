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
    "breakaway": (0.01, 0.9, ""),
    "spread": (1e-6, 1e-4, "m"),
}
LENGTH, WIDTH, HEIGHT = (5e-3, 3e-2), (5e-3, 3e-2), (2e-3, 1e-2)
SUBSTRATES = (
    "Ti-8Al-1Mo-1V",
    "steel",
    "WC-Co",
    {"young": "70 GPa", "poisson": 0.33, "density": "2700 kg/m^3"},
)


def quantity(trial: Trial, low: float, high: float, unit: str) -> str:
    """Return a quantity as text, such as "0.0012 m", with a log-uniform value."""
    return f"{trial.wide(low, high)!r} {unit}"


def scene(trial: Trial, kind: str = "") -> dict:
    """Return a random scene; kind: patch, bench, rig, masses or linear, drawn if empty."""
    kind = kind or trial.draw(
        "patch", "patch", "bench", "bench", "rig", "rig", "rig", "masses", "linear"
    )
    out = {"title": f"{kind} of chance"}
    if kind in ("patch", "bench", "rig"):
        out |= (
            {"contact": patch(trial)}
            if kind == "patch" or trial.chance(0.35)
            else {"normal": point(trial)}
        )
    if kind in ("bench", "rig"):
        out["friction"] = friction(trial, "width" in out.get("normal", {}) or "contact" in out)
    if kind == "bench":
        out["slide"] = slide(trial)
        if trial.chance(0.1):
            out["wear"] = {
                "coefficient": quantity(trial, 1e-16, 1e-13, "m^2/N"),
                "cycles": trial.wide(10, 1e5),
            }
    if kind in ("rig", "linear"):
        out["structure"] = modes(trial, kind)
    if kind == "masses":
        out["structure"] = masses(trial)
    if kind not in ("patch", "bench"):
        out["drive"] = drive(trial, out["structure"])
    out["accuracy"] = accuracy(trial, kind)
    return out


def patch(trial: Trial) -> dict:
    """Return [contact] with some of its tables."""
    length = trial.wide(*LENGTH)
    out = {
        "length": f"{length!r} m",
        "width": quantity(trial, *WIDTH, "m"),
        "height": quantity(trial, *HEIGHT, "m"),
        "substrate": trial.draw(*SUBSTRATES),
        "load": quantity(trial, 5, 500, "N"),
    }
    if trial.chance(0.8):
        out["element_size"] = f"{length / trial.r.integers(8, 40):.4g} m"
    tables = {
        "coating": lambda: {"material": "WC-Co", "thickness": quantity(trial, 2e-5, 4e-4, "m")},
        "tilt": lambda: {
            "angle": quantity(trial, 1e-6, 1e-3, "rad"),
            "on": trial.draw("upper", "lower"),
        },
        "load_line": lambda: {"offset": f"{length * trial.r.uniform(-0.6, 0.6):.4g} m"},
        "holder": lambda: {trial.draw("rotational_stiffness", "tangential_stiffness"): ""},
        "crown": lambda: {"radius": quantity(trial, 0.05, 50, "m")},
        "step": lambda: {
            "height": quantity(trial, 1e-8, 1e-5, "m"),
            "at": f"{length * trial.r.uniform(-0.5, 0.5):.4g} m",
        },
        "asperities": lambda: asperities(trial),
        "shear": dict,
        "strips": lambda: {
            "count": int(trial.r.integers(1, 5)),
            "roll": quantity(trial, 1e-7, 1e-3, "rad"),
        },
        "grooves": lambda: grooves(trial),
        "upper": lambda: {trial.draw("height", "length"): quantity(trial, 3e-3, 1e-2, "m")},
        "lower": lambda: {trial.draw("chamfer", "end_radius"): quantity(trial, 1e-5, 5e-4, "m")},
        "approach": lambda: {"distance": quantity(trial, 1e-8, 1e-6, "m")},
    }
    for name, made in tables.items():
        if trial.chance(0.12):
            out[name] = made()
    for key, unit in (("rotational_stiffness", "N m/rad"), ("tangential_stiffness", "N/m")):
        if key in out.get("holder", {}):
            out["holder"][key] = quantity(trial, 1e3, 1e7, unit)
    if "approach" in out:
        del out["load"]
    return out


def asperities(trial: Trial) -> dict:
    """Return [contact.asperities] with the keys of its law."""
    law = trial.draw("linear", "exponential", "hertz")
    keys = {
        "linear": {"normal_stiffness": quantity(trial, 1e11, 1e14, "Pa/m")},
        "exponential": {
            "normal_stiffness": quantity(trial, 1e11, 1e14, "Pa/m"),
            "decay_length": quantity(trial, 1e-8, 1e-6, "m"),
        },
        "hertz": {
            "radius": quantity(trial, 1e-6, 1e-4, "m"),
            "density": quantity(trial, 1e8, 1e11, "1/m^2"),
            "height_deviation": quantity(trial, 1e-8, 1e-6, "m"),
        },
    }[law]
    return (
        {"law": law}
        | keys
        | ({"tangential_ratio": trial.wide(0.1, 1.0)} if trial.chance(0.3) else {})
    )


def grooves(trial: Trial) -> dict:
    """Return [contact.grooves] or [normal.grooves]."""
    return {
        "wavelength": quantity(trial, 2e-5, 2e-4, "m"),
        "amplitude": quantity(trial, 1e-7, 1e-5, "m"),
    }


def point(trial: Trial) -> dict:
    """Return [normal]; in about one of eight scenes the load varies."""
    load = trial.wide(5, 500)
    out = {"load": f"{load!r} N"}
    if trial.chance(0.12):
        out |= {
            "amplitude": f"{load * trial.r.uniform(0.1, 1.5):.4g} N",
            "frequency": quantity(trial, 20, 300, "Hz"),
        }
    if trial.chance(0.1):
        out["width"] = quantity(trial, 1e-3, 1e-2, "m")
    if trial.chance(0.08):
        out["grooves"] = grooves(trial)
    return out


def friction(trial: Trial, spread: bool = False, law: str = "") -> dict:
    """Return [friction], or the same keys of an interface: a law with its required and some optional keys."""
    law = law or trial.draw(*LAWS)
    needs, may = (words.replace("|stiffness", "").split() for words in LAWS[law].keys)
    out = {"law": law, "static": round(float(trial.r.uniform(0.3, 0.8)), 3)}
    grows = trial.chance(0.3)
    for key in (*needs, *(key for key in may if trial.chance(0.25))):
        if (
            key in OF_LAWS
            and key not in ("rest_growth", "slip_growth")
            and (key != "spread" or spread)
        ):
            low, high, unit = OF_LAWS[key]
            out[key] = quantity(trial, low, high, unit) if unit else trial.wide(low, high)
    if "chi" in needs:
        out["chi"] = round(-float(trial.r.uniform(0, 0.9)), 3)
    if grows and "rest_growth" in (*needs, *may):
        out |= {key: quantity(trial, *OF_LAWS[key]) for key in ("rest_growth", "slip_growth")}
    if "reading" in may and trial.chance(0.2):
        out["reading"] = "report"
    return out


def slide(trial: Trial) -> dict:
    """Return [slide] of any kind except a file."""
    kind = trial.draw("constant", "sine", "triangle", "dwell")
    reach = {"distance": quantity(trial, 1e-6, 1e-4, "m")}
    speed = {"speed": quantity(trial, 1e-4, 1e-2, "m/s")}
    swing = {"amplitude": quantity(trial, 1e-6, 1e-4, "m"), "cycles": int(trial.r.integers(1, 4))}
    more = {
        "constant": reach | speed,
        "sine": swing | {"frequency": quantity(trial, 1, 200, "Hz")},
        "triangle": swing | speed,
        "dwell": reach | speed | {"hold": quantity(trial, 1e-3, 0.1, "s")},
    }[kind]
    return {"kind": kind} | more


def modes(trial: Trial, kind: str = "rig") -> dict:
    """Return [structure] with one to three modes."""
    first = trial.wide(40, 300)
    out = []
    for k in range(trial.draw(1, 1, 1, 2, 3)):
        mode = {
            "name": f"m{k}",
            "frequency": f"{first * (1 if k == 0 else trial.wide(0.5, 3)):.4g} Hz",
            "damping": trial.draw(0.003, 0.01, 0.05, 0.2),
            "slide": 1.0 if k == 0 else 0.3,
            "base": 0.8 if k == 0 else 0.1,
        }
        if k and trial.chance(0.2):
            mode |= (
                {"pitch": quantity(trial, 1, 20, "rad/m")} if trial.chance(0.5) else {"normal": 0.1}
            )
        out.append(mode)
    table = {"moving_mass": quantity(trial, 0.2, 2, "kg"), "mode": out}
    if kind == "rig" and trial.chance(0.1):
        table["bonded"] = {"stiffness": quantity(trial, 1e4, 1e6, "N/m")}
    if trial.chance(0.06):
        table["stiffening"] = {"cubic": quantity(trial, 1e9, 1e12, "N/m^3")}
    return table


def masses(trial: Trial) -> dict:
    """Return [structure] with two masses, springs, dampers and one or two interfaces."""
    between = ([1, 0], [2, 1], [2, 0])
    laws = [friction(trial) for _ in range(trial.draw(1, 2))]
    return {
        "masses": [quantity(trial, 0.2, 2, "kg") for _ in range(2)],
        "spring": [
            {"between": pair, "stiffness": quantity(trial, 5e4, 2e6, "N/m")} for pair in between
        ],
        "damper": [
            {"between": pair, "coefficient": quantity(trial, 1, 50, "N s/m")}
            for pair in between[:2]
        ],
        "interface": [
            {"between": between[2 * k], "load": quantity(trial, 5, 200, "N")} | law
            for k, law in enumerate(laws)
        ],
    }


def drive(trial: Trial, structure: dict) -> dict:
    """Return [drive] with the keys of its waveform; a release also sets the start of the structure."""
    count = len(structure.get("masses", structure.get("mode", ())))
    kind = trial.draw("base", "base", "base", "force", "free")
    if kind == "free":
        structure["start"] = {
            "displacement": [quantity(trial, 1e-5, 1e-3, "m") for _ in range(count)]
        }
        return {"kind": kind, "cycles": int(trial.r.integers(3, 20))}
    wave = trial.draw("sine", "sine", "sine", *(one for one in WAVEFORMS if one != "file"))
    size = (
        {"force": quantity(trial, 1, 100, "N")}
        if kind == "force"
        else {trial.draw("acceleration", "acceleration", "displacement"): ""}
    )
    if kind == "base":
        size = {
            key: quantity(trial, 2, 60, "m/s^2")
            if key == "acceleration"
            else quantity(trial, 1e-5, 5e-4, "m")
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
        out["frequency"] = quantity(trial, 50, 300, "Hz")
    if wave == "sweep":
        out |= {
            "from": quantity(trial, 60, 120, "Hz"),
            "to": quantity(trial, 130, 300, "Hz"),
            "rate": quantity(trial, 300, 3000, "Hz/s"),
        }
    else:
        out["cycles"] = int(trial.r.integers(3, 20))
    return out


def accuracy(trial: Trial, kind: str) -> dict:
    """Return [accuracy]: a coarse tolerance, and a method in one of five scenes."""
    out = {"tolerance": trial.draw(1e-2, 1e-2, 3e-3)}
    if kind in ("rig", "linear", "masses") and trial.chance(0.2):
        out["method"] = trial.draw("exact", "march", "harmonic")
    return out
