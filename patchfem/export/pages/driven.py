"""What drives a run, in words: level and frequency of its drive or slide, and the command that runs it again."""

import shlex
from pathlib import Path
from textwrap import shorten

from ...core import G_N
from ...scales import LADDERS, axis_unit

PLAIN = {"m/s^2": ("g", 1 / G_N), "m/s": ("mm/s", 1e3), "Hz": ("Hz", 1.0), "m^2/s^3": ("g^2/Hz", G_N**-2)}


def size(text) -> str:
    """A quantity of a resolved scene, such as `49.03325 m/s^2`, in the unit of people: `5 g`."""
    value, _, unit = str(text).partition(" ")
    name, scale = PLAIN[unit] if unit in PLAIN else axis_unit([float(value)], unit) if unit in LADDERS else (unit, 1.0)
    return f"{float(value) * scale:.4g} {name}".strip()


def driven(resolved: dict) -> str:
    """What moves a run, as a part of a sentence; "" where nothing does.

    resolved: the scene with every default, as nested tables.
    """
    if "drive" in resolved:
        return _drive(resolved["drive"])
    return _slide(resolved["slide"]) if "slide" in resolved else ""


def _drive(keys: dict) -> str:
    if keys["kind"] == "free":
        start = f" released {size(keys['displacement'])} from rest" if "displacement" in keys else ""
        return f"free motion{start}"
    force = keys["kind"] == "force"
    what = next((name for name in ("displacement", "acceleration", "force") if name in keys), keys["kind"])
    what = f"{'' if force else 'base '}{'force' if force else what if what != 'base' else 'acceleration'}"
    where = f" on mass {keys['mass']}" if force and "mass" in keys else ""
    waveform = keys.get("waveform", "sine")
    if waveform == "file":
        return f"recorded {what} of {Path(keys['file']).name}{where}"
    if waveform == "levels":
        levels = keys["levels"]
        told = f"{len(levels)} levels of {what} from {size(levels[0])} to {size(levels[-1])}"
        return f"{told} at {size(keys['frequency'])}{where}"
    if waveform == "tones":
        return f"base acceleration of {' and '.join(map(size, keys['accelerations']))} at " + \
            " and ".join(map(size, keys["frequencies"]))
    if waveform == "random":
        told = f"with the spectrum of {Path(keys['file']).name}" if "file" in keys else f"of {size(keys['spectrum'])}"
        ends = "".join(f" {name} {size(keys[name])}" for name in ("from", "to") if name in keys)
        return f"random {what} {told}{ends}, record {keys.get('seed', 0)}"
    level = size(next(keys[name] for name in ("displacement", "acceleration", "force") if name in keys))
    if waveform == "step":
        return f"a step of {level} in {what}{where}"
    if waveform == "sweep":
        return f"{what} of {level} swept from {size(keys['from'])} to {size(keys['to'])}{where}"
    return f"{what} of {level} at {size(keys['frequency'])}{where}"


def _slide(keys: dict) -> str:
    kind = keys["kind"]
    if kind == "file":
        return f"the slide of {Path(keys['file']).name}"
    if kind == "sine":
        return f"a sine slide of ±{size(keys['amplitude'])} at {size(keys['frequency'])}"
    if kind == "triangle":
        return f"a triangle slide of ±{size(keys['amplitude'])} at {size(keys['speed'])}"
    held = f", held for {size(keys['hold'])}" if kind == "dwell" and "hold" in keys else ""
    return f"a slide of {size(keys['distance'])} at {size(keys['speed'])}{held}"


def changed(sets: tuple) -> str:
    """The keys that were changed beside the scene, as people read them; sets: `key=value` as given."""
    return shorten(", ".join(f"{key} = {value}" for key, _, value in (one.partition("=") for one in sets)), 160)


def command(path: Path, sets: tuple) -> str:
    """The command that runs a scene again in its own folder; sets: `key=value` as given, files by their names."""
    short = [f"{key}={Path(value).name if value.startswith('/') else value}"
             for key, _, value in (one.partition("=") for one in sets)]
    return shlex.join(["patchfem", "run", Path(path).name, *(word for one in short for word in ("--set", one))])
