"""Scenes of a backbone curve: modes given separately from the scene, and tables that are ignored.

A backbone is the motion of a structure on its own. So `BackboneTables` takes [slide] out of the plain values
of a scene, adds the [drive] that a rig must have, and writes given or assumed modes into [structure].
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from ..exceptions import PatchfemError
from .keys.quantities import format_si, parse_quantity, read_percentage
from .keys.values import TomlTable

# Form of the option --modes, for messages
MODES_FORM = 'write "FREQUENCY:DAMPING" or "FREQUENCY:DAMPING:SLIDE" for each mode, such as "120 Hz:0.01, 170 Hz:0.02"'
ASSUMED_MODES = "100 Hz:0.001"  # modes of a scene that states none
ASSUMED_MASS = "1 kg"  # modal mass for the modes of a scene without [structure]
KEYS_OF_MODES = {"mode", "masses", "reduced", "file"}  # keys of [structure] that give its modes
# Names of modes that are given without names
MODE_NAMES = ("first", "second", "third", "fourth", "fifth", "sixth")


class GivenMode(NamedTuple):
    """Mode specified separately from the scene, for the rig with the contact stuck.

    Attributes
    ----------
    frequency : float
        [Hz]
    damping : float
        Damping ratio.
    slide : float or None
        Relative displacement of the contact per displacement of the output; None if it is not given.
    """

    frequency: float
    damping: float
    slide: float | None


def parse_modes(modes: str | Iterable) -> tuple[GivenMode, ...]:
    """Read modes from a text such as "120 Hz:0.01, 170 Hz:0.02", or from a list of tuples.

    Parameters
    ----------
    modes : str or iterable
        A tuple holds frequency (a text, or a number in Hz), damping ratio and optionally the slide.

    Raises
    ------
    PatchfemError
        If an item is not a mode.
    """
    if not isinstance(modes, (str, Iterable)):
        raise PatchfemError(f"modes: {modes!r}: {MODES_FORM}")
    items = modes.split(",") if isinstance(modes, str) else list(modes)
    parsed = []
    for item in items:
        try:
            parts = item.split(":") if isinstance(item, str) else list(item)
            parsed.append(_parse_mode(*parts))
        except (TypeError, ValueError) as error:
            reason = f"{error}; " if isinstance(error, ValueError) else ""
            raise PatchfemError(f"modes: {item!r}: {reason}{MODES_FORM}") from None
    return tuple(parsed)


def _parse_mode(frequency, damping, slide=None) -> GivenMode:
    """Parse frequency, damping ratio and slide of a mode.

    ValueError is raised if one has the wrong unit. Each is a number in SI or a text, such as "120 Hz", "1 %" and "0.5".
    The slide is the participation of the interface.
    """
    if isinstance(frequency, str):
        frequency = parse_quantity(frequency.strip(), "frequency")
    slide = None if slide is None else _parse_ratio(slide)
    mode = GivenMode(float(frequency), _parse_ratio(damping), slide)
    if not (0 < mode.frequency < float("inf") and -1 < mode.damping < 1 and slide != 0):
        raise ValueError(
            "a frequency above 0, a damping ratio between -1 and 1 and no slide of 0 are needed"
        )
    return mode


def _parse_ratio(value) -> float:
    """Parse a damping ratio or a slide.

    ValueError is raised if it is not a number.
    """
    try:
        return float(read_percentage(value))
    except ValueError:
        raise ValueError(f"{value!r} is neither a number nor a percentage such as '1 %'") from None


def _write_mode(number: int, mode: GivenMode) -> TomlTable:
    """Return the table [[structure.mode]] of a mode; `number` counts from 0."""
    name = MODE_NAMES[number] if number < len(MODE_NAMES) else f"mode-{number + 1}"
    return {
        "name": name,
        "frequency": format_si(mode.frequency, "frequency"),
        "damping": mode.damping,
        "slide": 1.0 if mode.slide is None else mode.slide,
        "base": 0.0,
        "output": 1.0,
    }


class BackboneTables:
    """Function that changes the raw values of a scene into those of a rig whose backbone is computed.

    Parameters
    ----------
    modes : tuple of GivenMode
        Modes that replace those of the scene; () keeps the modes of the scene.

    Attributes
    ----------
    modes : tuple of GivenMode
        Modes that were written into the scene: the given or the assumed ones; () for those of the scene.
    is_assumed : bool
        Whether the modes are assumed.
    has_frequencies_of_stuck_modes : bool
        Whether the frequencies of the modes belong to the sticking contact.
    assumes_mass : bool
        Whether the modal mass is assumed, because the scene gives none.
    ignored : list of str
        Names of the tables that are ignored.
    """

    def __init__(self, modes: tuple[GivenMode, ...] = (), *, stuck: bool = True):
        self.modes = modes
        self.is_assumed = False
        self.has_frequencies_of_stuck_modes = stuck
        self.assumes_mass = False
        self.ignored: list[str] = []

    def __call__(self, raw: TomlTable) -> None:
        """Change the raw values of a scene."""
        self.ignored = [name for name in ("slide", "drive") if name in raw]
        raw.pop("slide", None)
        structure = raw.get("structure", {})
        has_structure = not isinstance(structure, dict) or bool(KEYS_OF_MODES & structure.keys())
        if not (self.modes or has_structure) and {"contact", "normal"} & raw.keys():
            self.modes = parse_modes(ASSUMED_MODES)
            self.is_assumed = True
        if self.modes:
            self._write_modes(raw)
        if "structure" in raw:
            # A rig must have a drive, but no result of a backbone depends on it
            raw["drive"] = {"kind": "force", "frequency": "100 Hz", "force": "1 N", "cycles": 10}

    def _write_modes(self, raw: TomlTable) -> None:
        """Write the modes into the table [structure] of the plain values `raw` of a scene."""
        structure = raw.setdefault("structure", {})
        if not isinstance(structure, dict) or (KEYS_OF_MODES - {"mode"}) & structure.keys():
            raise PatchfemError(
                "modes: the scene has a structure of masses or files; leave the modes out, or leave out [structure]"
            )
        self.assumes_mass = "moving_mass" not in structure
        structure.setdefault("moving_mass", ASSUMED_MASS)
        # The key `measured` of the scene and the stiffness subtracted from its modes belong to the modes that are replaced.
        # Keys of [structure] on what is subtracted from its modes
        for name in ("measured_stiffness", "measured_stiffness_error", "measured_damper"):
            structure.pop(name, None)
        structure["measured"] = "stuck" if self.has_frequencies_of_stuck_modes else "free"
        structure["mode"] = [_write_mode(k, mode) for k, mode in enumerate(self.modes)]
