"""Channels of a measurement, chosen by name and turned into SI, and what they must hold to be used."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError, frozen_array
from .slides import RECORD_UNITS
from .slides import SLIDE_UNITS as PATHS

MAX_BYTES = 256 * 2**20  # bytes of a file
UNITS = {"time": PATHS["time"] | {"min": 60.0}, **RECORD_UNITS}
SI_UNITS = {
    name: next(unit for unit, factor in units.items() if factor == 1.0 and unit)
    for name, units in UNITS.items()
}
_ASKED = re.compile(r"\s*(\w+)\s*=\s*(.+?)\s*(?:\[\s*([^\[\]]+?)\s*\])?\s*", re.S)
_SAME = {
    "sec": "s",
    "seconds": "s",
    "newton": "N",
    "newtons": "N",
    "µm": "um",
    "μm": "um",
    "µs": "us",
    "μs": "us",
}
_SECONDS = re.compile(r"(\w+) ?(?:/ ?s(?:ec)?(?:\^|\*\*)?2|/ ?s²| s-2| s\^-2)")
_RATE = re.compile(r"(\w+) ?(?:/ ?s(?:ec)?| s-1| s\^-1)")


class Channel(NamedTuple):
    """One channel as a file holds it.

    name: its text in the file; place: node and direction such as "12:+x", or ""; quantity: a key of UNITS, or "" where
    the file does not say; unit: as the file writes it, or ""; values: (k,) in that unit; time: (k,) [s] or None where
    the table has a column of it; factor: to SI where the file gives it apart from the unit, else None.
    """

    name: str
    place: str
    quantity: str
    unit: str
    values: np.ndarray
    time: np.ndarray | None = None
    factor: float | None = None


class RequestedChannel(NamedTuple):
    """A channel asked for: what it is (a key of UNITS), which of the file (name, number from 1 or place), its unit or
    ""."""

    quantity: str
    source: str
    unit: str


@dataclass(frozen=True, eq=False, slots=True)
class Records:
    """Channels in SI over one time.

    values: quantity -> (k,), `time` [s] first where there is one; notes: sentences on what was read otherwise than it
    stands; there: all channels of the file in words, as of `listed`.
    """

    path: Path
    values: dict
    notes: list = field(default_factory=list)
    there: str = ""


def parse_requests(texts, names=UNITS) -> list:
    """`RequestedChannel` of texts such as "force=Load cell [lbf]"; several may stand in one text, separated by commas.

    names: those that may be asked for.

    PatchfemError for a text that is none, for an unknown quantity or unit, and for a quantity asked for twice.
    """
    found = []
    for text in (part for whole in texts for part in re.split(r",(?=\s*\w+\s*=)", whole)):
        parts = _ASKED.fullmatch(text)
        if parts is None:
            raise PatchfemError(
                f"--map {text}: NAME=CHANNEL or NAME=CHANNEL [unit] is needed, such as "
                '"force=Load cell [lbf]"'
            )
        name, source, unit = parts[1], parts[2], parts[3] or ""
        if name not in names:
            raise PatchfemError(f"--map {name}: unknown; use one of {', '.join(names)}")
        if unit and name in UNITS:
            unit_factor(name, unit, "--map ")
        if name in [one.quantity for one in found]:
            raise PatchfemError(f"--map {name}: given twice")
        found.append(RequestedChannel(name, source, unit))
    return found


def unit_factor(quantity: str, unit: str, where: str = "") -> float:
    """Factor to SI of a unit of a quantity; PatchfemError, which starts with `where`, for one that is not known."""
    known, plain = UNITS[quantity], normalize_unit(unit)
    if plain not in known:
        raise PatchfemError(
            f"{where}{quantity} [{unit[:40]}]: unknown unit; use one of "
            f"{', '.join(one for one in known if one)}"
        )
    return known[plain]


def normalize_unit(text: str) -> str:
    """A unit as the tables spell it: "m/s2", "m s-2" and "m/s²" are m/s^2, "µm" is um."""
    text = " ".join(text.split())
    text = _SAME.get(text.lower(), _SAME.get(text, text))
    for pattern, end in ((_SECONDS, "/s^2"), (_RATE, "/s")):
        found = pattern.fullmatch(text)
        if found:
            return _SAME.get(found[1], found[1]) + end
    return text


def select_channels(path: Path, channels: list, asked: list, notes: list) -> Records:
    """The channels asked for, or without a wish those whose quantity the file says, in SI.

    PatchfemError where two are one quantity, where nothing is left, where a unit is lacking, where times differ.
    """
    picked = [
        (one.quantity, find_channel(path, channels, one.source), one.unit) for one in asked
    ] or [(one.quantity, one, "") for one in channels if one.quantity]
    names = [name for name, _, _ in picked]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise PatchfemError(
            f"{path}: {names.count(twice[0])} channels contain {twice[0]}; choose one with --map "
            f"{twice[0]}=CHANNEL among {describe_channels(channels)}"
        )
    if not set(names) - {"time"}:
        raise PatchfemError(
            f"{path}: no channel label names a quantity; choose channels with --map force=CHANNEL [N], "
            f"displacement=CHANNEL [mm] among {describe_channels(channels)}"
        )
    values = {name: _in_si(path, name, one, unit) for name, one, unit in picked}
    if "time" not in values:
        values = _shared_time(path, [one for _, one, _ in picked], channels, bool(asked)) | values
    order = sorted(values, key=lambda name: name != "time")
    return replace(
        make_records(path, {name: values[name] for name in order}, notes),
        there=describe_channels(channels),
    )


def find_channel(path, channels: list, source: str) -> Channel:
    """The channel of a name, a place such as 12:+x or a number from 1; PatchfemError where there is none or several."""
    for key in ("name", "place"):
        same = [one for one in channels if getattr(one, key) == source]
        if len(same) == 1:
            return same[0]
        if same:
            raise PatchfemError(
                f"{path}: {len(same)} channels have the name '{source}'; choose one by its number, "
                f"among {describe_channels(channels)}"
            )
    if source.isdecimal() and 1 <= int(source) <= len(channels):
        return channels[int(source) - 1]
    raise PatchfemError(
        f"{path}: no channel '{source[:60]}'; the file has {describe_channels(channels)}"
    )


def describe_channels(channels: list) -> str:
    """The channels as a person names them: number, name, place, unit."""
    texts = [
        f"{number} '{one.name[:40]}'"
        + (f" at {one.place}" if one.place else "")
        + (f" [{one.unit[:20]}]" if one.unit else "")
        for number, one in enumerate(channels[:12], 1)
    ]
    return ", ".join(texts) + (f" and {len(channels) - 12} more" if len(channels) > 12 else "")


def make_records(path, values: dict, notes: list) -> Records:
    """`Records` of arrays in SI; PatchfemError for unlike lengths, fewer than two rows, a value that is not finite or a
    time that does not rise."""
    sizes = {name: len(column) for name, column in values.items()}
    if len(set(sizes.values())) > 1:
        raise PatchfemError(
            f"{path}: the channels have different lengths: "
            f"{', '.join(f'{n} {k}' for n, k in sizes.items())}"
        )
    if min(sizes.values()) < 2:
        raise PatchfemError(f"{path}: at least two samples are needed")
    for name, column in values.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise PatchfemError(
                f"{path}: {name} of sample {bad[0] + 1} is {column[bad[0]]}, not a finite number"
            )
    back = np.flatnonzero(np.diff(values["time"]) <= 0) if "time" in values else np.zeros(0)
    if back.size:
        k = back[0]
        raise PatchfemError(
            f"{path}: time {values['time'][k + 1]:.9g} s of sample {k + 2} is not later than "
            f"{values['time'][k]:.9g} s of the sample before; times must strictly rise"
        )
    return Records(
        Path(path), {name: frozen_array(column) for name, column in values.items()}, notes
    )


def _in_si(path, name: str, one: Channel, unit: str) -> np.ndarray:
    if unit or one.factor is None:
        text = unit or one.unit
        if not text and "" not in UNITS[name]:
            raise PatchfemError(
                f"{path}: '{one.name[:40]}' has no unit; write --map \"{name}=CHANNEL [{SI_UNITS[name]}]\""
            )
        return np.asarray(one.values, float) * unit_factor(name, text, f"{path}: ")
    return np.asarray(one.values, float) * one.factor


def _shared_time(path, picked: list, channels: list, asked: bool) -> dict:
    """{"time": (k,)} of the channels themselves, or of the one column that is a time; {} where there is none."""
    times = [one.time for one in picked if one.time is not None]
    if times:
        for one in picked:
            if (
                one.time is None
                or one.time.size != times[0].size
                or not np.array_equal(one.time, times[0])
            ):
                raise PatchfemError(
                    f"{path}: '{one.name[:40]}' is sampled at other times than "
                    f"'{picked[0].name[:40]}'; use --map to choose channels that have the same "
                    f"times; the channels are {describe_channels(channels)}"
                )
        return {"time": times[0]}
    columns = [one for one in channels if one.quantity == "time"] if asked else []
    return {"time": _in_si(path, "time", columns[0], "")} if len(columns) == 1 else {}


def shift_to_zero(values: dict) -> dict:
    """The channels with time and displacements counted from their first row, as a slide wants them."""
    return {
        name: column - column[0] if name in ("time", "displacement", "lateral") else column
        for name, column in values.items()
    }
