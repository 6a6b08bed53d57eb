"""The drive signal of a run as a phrase, and the scene keys that its options --set have changed as a list."""

from pathlib import Path
from textwrap import shorten

from ..core import G_N
from ..effects import SINE_WAVEFORM, WAVEFORMS
from ..formatting import UNIT_LADDERS, choose_axis_unit

DRIVE_UNITS = {
    "m/s^2": ("g", 1 / G_N),
    "m/s": ("mm/s", 1e3),
    "Hz": ("Hz", 1.0),
    "m^2/s^3": ("g^2/Hz", G_N**-2),
}


def format_resolved(text) -> str:
    """Format a quantity of a resolved scene in a usual unit, such as "5 g"."""
    value, _, unit = str(text).partition(" ")
    name = unit
    scale = 1.0
    if unit in DRIVE_UNITS:
        name, scale = DRIVE_UNITS[unit]
    elif unit in UNIT_LADDERS:
        name, scale = choose_axis_unit([float(value)], unit)
    return f"{float(value) * scale:.4g} {name}".strip()


def describe_drive(resolved: dict) -> str:
    """Describe the drive signal of a run in a phrase, or return "" if it has none.

    resolved: the scene with all defaults, as nested tables.
    """
    if "drive" in resolved:
        return _describe_waveform(resolved["drive"])
    return _describe_slide(resolved["slide"]) if "slide" in resolved else ""


def _describe_waveform(keys: dict) -> str:
    """Describe the drive signal with the phrase for its waveform."""
    if keys["kind"] == "free":
        start = (
            f" released {format_resolved(keys['displacement'])} from rest"
            if "displacement" in keys
            else ""
        )
        return f"free motion{start}"
    waveform = WAVEFORMS[keys.get("waveform", SINE_WAVEFORM.name)]
    values = _format_drive_values(keys)
    try:
        return waveform.phrase.format_map(values) or _describe_by_level(waveform.name, values)
    except KeyError:  # the scene does not set a key that the phrase contains
        return _describe_by_level(waveform.name, values)


def _format_drive_values(keys: dict) -> dict:
    """Return the values that are inserted into the phrase for a waveform, as text."""
    values = {key: _format_drive_value(key, value) for key, value in keys.items()}
    values["seed"] = keys.get("seed", 0)
    sized = next((name for name in ("displacement", "acceleration", "force") if name in keys), None)
    if sized is not None:
        values["level"] = values[sized]
    is_force = keys["kind"] == "force"
    values["what"] = "force" if is_force else f"base {sized or 'acceleration'}"
    values["place"] = f" on mass {keys['mass']}" if is_force and "mass" in keys else ""
    if "levels" in keys:
        values |= {
            "count": len(keys["levels"]),
            "first": format_resolved(keys["levels"][0]),
            "last": format_resolved(keys["levels"][-1]),
        }
    if "file" in keys or "spectrum" in keys:
        density = (
            f"with the spectrum of {values['file']}"
            if "file" in keys
            else f"of {values['spectrum']}"
        )
        values["density"] = density + "".join(
            f" {end} {values[end]}" for end in ("from", "to") if end in keys
        )
    return values


def _format_drive_value(key: str, value) -> str:
    """Return the value of a key of [drive] in a usual unit."""
    if key == "file":
        return Path(value).name
    if isinstance(value, (list, tuple)):
        return " and ".join(format_resolved(part) for part in value)
    return (
        format_resolved(value)
        if isinstance(value, str) and value[:1] in "+-.0123456789"
        else str(value)
    )


def _describe_by_level(name: str, values: dict) -> str:
    """Describe a drive signal by its waveform, and by its amplitude and frequency if the scene sets them."""
    level = f" of {values['level']}" if "level" in values else ""
    frequency = f" at {values['frequency']}" if "frequency" in values else ""
    return f"{values['what']}{level}{frequency}{values['place']} (waveform '{name}')"


def _describe_slide(keys: dict) -> str:
    """Describe the displacement that is prescribed on a bench in a phrase."""
    kind = keys["kind"]
    if kind == "file":
        return f"the slide of {Path(keys['file']).name}"
    if kind == "sine":
        return f"a sine slide of ±{format_resolved(keys['amplitude'])} at {format_resolved(keys['frequency'])}"
    if kind == "triangle":
        return f"a triangle slide of ±{format_resolved(keys['amplitude'])} at {format_resolved(keys['speed'])}"
    hold_text = (
        f", held for {format_resolved(keys['hold'])}" if kind == "dwell" and "hold" in keys else ""
    )
    return f"a slide of {format_resolved(keys['distance'])} at {format_resolved(keys['speed'])}{hold_text}"


def format_changed_keys(sets: tuple) -> str:
    """Return the scene keys that the options --set have changed, with their values, such as "load = 4 kN".

    sets: ``table.key=value`` strings; a list of more than 160 characters is cut.
    """
    return shorten(
        ", ".join(
            f"{key} = {value}"
            for key, _, value in (assignment.partition("=") for assignment in sets)
        ),
        160,
    )
