"""The drive signal of a run as a phrase, and the scene keys that its options --set have changed as a list."""

from pathlib import Path
from textwrap import shorten

from ..core import G_N
from ..effects import SINE_WAVEFORM, WAVEFORMS
from ..formatting import UNIT_LADDERS, choose_axis_unit

# value of a scene file, and a table of them
TomlTable = dict[str, str | float | list[str]]
# drives of a bench by their kind
SLIDE_PHRASES = {
    "file": "the slide of {file}",
    "sine": "a sine slide of ±{amplitude} at {frequency}",
    "triangle": "a triangle slide of ±{amplitude} at {speed}",
    "constant": "a slide of {distance} at {speed}",
    "dwell": "a slide of {distance} at {speed}, held for {hold}",
}
DRIVE_UNITS = {
    "m/s^2": ("g", 1 / G_N),
    "m/s": ("mm/s", 1e3),
    "Hz": ("Hz", 1.0),
    "m^2/s^3": ("g^2/Hz", G_N**-2),
}


def format_resolved(text: str | float) -> str:
    """Format a quantity of a resolved scene in a usual unit, such as "5 g"."""
    value, _, unit = str(text).partition(" ")
    name = unit
    scale = 1.0
    if unit in DRIVE_UNITS:
        name, scale = DRIVE_UNITS[unit]
    elif unit in UNIT_LADDERS:
        name, scale = choose_axis_unit([float(value)], unit)
    return f"{float(value) * scale:.4g} {name}".strip()


def describe_drive(resolved: dict[str, TomlTable]) -> str:
    """Describe the drive signal of a run in a phrase, or return "" if it has none.

    resolved: the scene with all defaults, as nested tables.
    """
    if "drive" in resolved:
        return _describe_waveform(resolved["drive"])
    if "slide" not in resolved:
        return ""
    slide = resolved["slide"]
    return SLIDE_PHRASES[slide["kind"]].format_map(_format_values(slide))


def _describe_waveform(keys: TomlTable) -> str:
    """Describe the drive signal with the phrase for its waveform."""
    values = _format_drive_values(keys)
    if keys["kind"] == "free":
        start = " released {displacement} from rest" if "displacement" in keys else ""
        return f"free motion{start}".format_map(values)
    waveform = WAVEFORMS[keys.get("waveform", SINE_WAVEFORM.name)]
    try:
        return waveform.phrase.format_map(values) or _describe_by_level(waveform.name, values)
    except KeyError:  # the scene does not set a key that the phrase contains
        return _describe_by_level(waveform.name, values)


def _format_drive_values(keys: TomlTable) -> dict[str, str | int]:
    """Return the values that are inserted into the phrase for a waveform."""
    values = _format_values(keys)
    sized = next((name for name in ("displacement", "acceleration", "force") if name in keys), "")
    is_force = keys["kind"] == "force"
    values |= {
        "seed": keys.get("seed", 0),
        "what": "force" if is_force else f"base {sized or 'acceleration'}",
        "place": f" on mass {keys['mass']}" if is_force and "mass" in keys else "",
    }
    if sized:
        values["level"] = values[sized]
    if "levels" in keys:
        levels = list(map(format_resolved, keys["levels"]))
        values |= {"count": len(levels), "first": levels[0], "last": levels[-1]}

    # a random drive follows a file, or a constant density between two frequencies
    if "file" in keys:
        values["density"] = f"with the spectrum of {values['file']}"
    elif "spectrum" in keys:
        values["density"] = f"of {values['spectrum']}"
    if "density" in values:
        ends = (f" {end} {values[end]}" for end in ("from", "to") if end in keys)
        values["density"] += "".join(ends)
    return values


def _format_values(keys: TomlTable) -> dict[str, str | int]:
    """Return the values of all keys of a table in usual units."""
    return {key: _format_drive_value(key, value) for key, value in keys.items()}


def _format_drive_value(key: str, value: str | float | list[str]) -> str:
    """Return the value of a key in a usual unit."""
    if key == "file":
        return Path(value).name
    if isinstance(value, (list, tuple)):
        return " and ".join(format_resolved(part) for part in value)
    return (
        format_resolved(value)
        if isinstance(value, str) and value[:1] in "+-.0123456789"
        else str(value)
    )


def _describe_by_level(name: str, values: dict[str, str | int]) -> str:
    """Describe a drive signal by its waveform, and by its amplitude and frequency if the scene sets them."""
    level = f" of {values['level']}" if "level" in values else ""
    frequency = f" at {values['frequency']}" if "frequency" in values else ""
    return f"{values['what']}{level}{frequency}{values['place']} (waveform '{name}')"


def format_changed_keys(sets: tuple[str, ...]) -> str:
    """Return the scene keys that the options --set have changed, with their values, such as "load = 4 kN".

    sets: ``table.key=value`` strings; a list of more than 160 characters is cut.
    """
    pairs = (assignment.partition("=") for assignment in sets)
    return shorten(", ".join(f"{key} = {value}" for key, _, value in pairs), 160)
