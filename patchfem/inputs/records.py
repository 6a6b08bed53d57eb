"""Channels of a measurement, selected by name and converted to SI."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import Missing, PatchfemError, frozen_array
from .damage import list_some, shorten
from .tables import require_increasing_time
from .units import CHANNEL_UNITS, SI_UNITS, find_unit_factor

# Largest size of a file of records or of a MATLAB file in bytes
MAX_RECORD_FILE_BYTES = 512 * 2**20
_REQUEST_PATTERN = re.compile(r"\s*(\w+)\s*=\s*(.+?)\s*(?:\[\s*([^\[\]]+?)\s*\])?\s*", re.S)


class Channel(NamedTuple):
    """One channel as a file contains it.

    - name: its text in the file.
    - place: node and direction, such as "12:+x", or "".
    - quantity: key of `units.CHANNEL_UNITS`, or "" if the file does not state it.
    - unit: unit as written in the file, or "".
    - values (k,): in this unit.
    - time (k,): [s], or None if time is a channel of its own.
    - factor: factor to SI if the file states it apart from the unit, else None.
    """

    name: str
    place: str
    quantity: str
    unit: str
    values: np.ndarray
    time: np.ndarray | None = None
    factor: float | None = None


class RequestedChannel(NamedTuple):
    """A channel that the user requests with ``--map quantity=source [unit]``.

    - quantity: what the channel is, such as "force".
    - source: name of the channel, its number from 1, or its place.
    - unit: unit of the values, or "" for that of the file.
    """

    quantity: str
    source: str
    unit: str


class Records(NamedTuple):
    """Channels in SI with a common time axis.

    - values: values (k,) of each quantity by name, with `time` [s] first if there is one.
    - notes: sentences on what was not read as it stands.
    - channel_list: all channels of the file in words.
    """

    values: dict[str, np.ndarray]
    notes: list[str]
    channel_list: str


def check_file(path: Path, remedy: str) -> None:
    """Raise Missing if the file does not exist, and PatchfemError if it is too large.

    Parameters
    ----------
    path : Path
        File to read.
    remedy : str
        What to do with a file that is too large.
    """
    if not path.is_file():
        raise Missing(f"{path}: there is no such file")
    if path.stat().st_size > MAX_RECORD_FILE_BYTES:
        raise PatchfemError(f"{path}: more than {MAX_RECORD_FILE_BYTES >> 20} MiB; {remedy}")


def parse_requests(texts: Iterable) -> list[RequestedChannel]:
    """Parse texts of requests such as "force=Load cell [lbf]", separated by commas.

    Raises PatchfemError for a text that is no request, for an unknown quantity or unit, and for a
    quantity that is requested twice.
    """
    requests = {}
    parts = [part for text in texts for part in re.split(r",(?=\s*\w+\s*=)", text)]
    for part in parts:
        match = _REQUEST_PATTERN.fullmatch(part)
        if match is None:
            raise PatchfemError(
                f"--map {part}: NAME=CHANNEL or NAME=CHANNEL [unit] is needed, such as "
                '"force=Load cell [lbf]"'
            )
        name, source, unit = match.groups("")
        if name not in CHANNEL_UNITS:
            raise PatchfemError(f"--map {name}: unknown; use one of {', '.join(CHANNEL_UNITS)}")
        if unit:
            find_unit_factor(name, unit, "--map ")
        if name in requests:
            raise PatchfemError(f"--map {name}: given twice")
        requests[name] = RequestedChannel(name, source, unit)
    return list(requests.values())


def select_channels(
    path: Path, channels: list[Channel], requests: list[RequestedChannel], notes: list[str]
) -> Records:
    """Select the requested channels, or by default those for which the file states a quantity.

    Parameters
    ----------
    path : Path
        File, for error messages.
    channels : list of Channel
        Channels of the file.
    requests : list of RequestedChannel
        Channels that the user asks for.
    notes : list of str
        Notes of the records.

    Returns
    -------
    Records

    Raises
    ------
    PatchfemError
        If two channels are one quantity, if no channel but time is left, if a unit is missing, or if the
        channels have different times.
    """
    channel_list = describe_channels(channels)
    # A unit that the user states overrules that of the file.
    if requests:
        selected = []
        for quantity, source, unit in requests:
            channel = find_channel(path, channels, source)._replace(quantity=quantity)
            selected.append(channel._replace(unit=unit, factor=None) if unit else channel)
    else:
        selected = [channel for channel in channels if channel.quantity]

    # Each quantity comes from one channel.
    names = [channel.quantity for channel in selected]
    duplicates = sorted({name for name in names if names.count(name) > 1})
    if duplicates:
        name = duplicates[0]
        raise PatchfemError(
            f"{path}: {names.count(name)} channels contain {name}; choose one with --map "
            f"{name}=CHANNEL among {channel_list}"
        )
    if not set(names) - {"time"}:
        raise PatchfemError(
            f"{path}: no channel label names a quantity; choose channels with --map force=CHANNEL [N], "
            f"displacement=CHANNEL [mm] among {channel_list}"
        )

    # All channels share the times of one.
    values = {channel.quantity: _convert_to_si(path, channel) for channel in selected}
    time = values.pop("time", None)
    if time is None:
        time = _find_shared_time(path, selected, channels if requests else [], channel_list)
    if time is not None:
        values = {"time": time, **values}
    _check_values(path, values)
    frozen = {name: frozen_array(column) for name, column in values.items()}
    return Records(frozen, notes, channel_list)


def find_channel(path, channels: list[Channel], source: str) -> Channel:
    """Find a channel by name, by degree of freedom such as 12:+x, or by number, counted from 1.

    Parameters
    ----------
    path : Path
        File, for error messages.
    channels : list of Channel
        Channels of the file.
    source : str
        Name, place or number, as the user writes it.

    Returns
    -------
    Channel

    Raises
    ------
    PatchfemError
        If there is no such channel, or several.
    """
    for key in ("name", "place"):
        matches = [channel for channel in channels if getattr(channel, key) == source]
        if len(matches) == 1:
            return matches[0]
        if matches:
            raise PatchfemError(
                f"{path}: {len(matches)} channels have the name '{source}'; choose one by its number, "
                f"among {describe_channels(channels)}"
            )
    if source.isdecimal() and 1 <= int(source) <= len(channels):
        return channels[int(source) - 1]
    raise PatchfemError(
        f"{path}: no channel '{shorten(source, 60)}'; the file has {describe_channels(channels)}"
    )


def describe_channels(channels: list[Channel]) -> str:
    """Return a list of the channels as text, with number, name, degree of freedom and unit."""
    texts = []
    for number, channel in enumerate(channels, 1):
        place = f" at {channel.place}" if channel.place else ""
        unit = f" [{shorten(channel.unit, 20)}]" if channel.unit else ""
        texts.append(f"{number} '{shorten(channel.name)}'{place}{unit}")
    return list_some(texts) or "no channel of numbers"


def _check_values(path, values: dict[str, np.ndarray]) -> None:
    """Raise PatchfemError unless channels [SI] by quantity can be the records of a file.

    They must have the same length, at least two samples and finite values, and times must rise. `path` is that of the
    file.
    """
    sizes = {name: len(column) for name, column in values.items()}
    if len(set(sizes.values())) > 1:
        raise PatchfemError(
            f"{path}: the channels have different lengths: "
            f"{', '.join(f'{name} {size}' for name, size in sizes.items())}"
        )
    if min(sizes.values()) < 2:
        raise PatchfemError(f"{path}: at least two samples are needed")

    # Values that no program can compute with.
    for name, column in values.items():
        wrong = np.flatnonzero(~np.isfinite(column))
        if wrong.size:
            raise PatchfemError(
                f"{path}: {name} of sample {wrong[0] + 1} is {column[wrong[0]]}, not a finite number; "
                "correct it, or remove the sample"
            )

    if "time" in values:
        require_increasing_time(f"{path}: sample ", values["time"], second_row=2)


def shift_to_zero(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Subtract the first row from time [s] and displacement [m], as a prescribed displacement requires.

    `values` are arrays (k,) by quantity. Other quantities are not changed.
    """
    return {
        name: column - column[0] if name in ("time", "displacement") else column
        for name, column in values.items()
    }


def _convert_to_si(path, channel: Channel) -> np.ndarray:
    """Return the values (k,) of a channel of the file `path` in SI."""
    quantity = channel.quantity
    factor = channel.factor
    if factor is None:
        if not channel.unit and "" not in CHANNEL_UNITS[quantity]:
            raise PatchfemError(
                f"{path}: '{shorten(channel.name)}' has no unit; write --map "
                f'"{quantity}=CHANNEL [{SI_UNITS[quantity]}]"'
            )
        factor = find_unit_factor(quantity, channel.unit, f"{path}: ")
    return np.asarray(channel.values, float) * factor


def _find_shared_time(
    path, selected: list[Channel], channels: list[Channel], channel_list: str
) -> np.ndarray | None:
    """Return the time [s] of the selected channels, or of the only channel that contains times.

    `path` and `channel_list`, all channels in words, are for messages. `channels` are all of the file. The selected
    channels must have the same times. The result is None if no channel contains times, or more than one does.
    """
    times = [channel.time for channel in selected if channel.time is not None]
    if not times:
        clocks = [channel for channel in channels if channel.quantity == "time"]
        return _convert_to_si(path, clocks[0]) if len(clocks) == 1 else None
    for channel in selected:
        if channel.time is None or not np.array_equal(channel.time, times[0]):
            raise PatchfemError(
                f"{path}: '{shorten(channel.name)}' is sampled at other times than "
                f"'{shorten(selected[0].name)}'; use --map to choose channels that have the same "
                f"times; the channels are {channel_list}"
            )
    return times[0]
