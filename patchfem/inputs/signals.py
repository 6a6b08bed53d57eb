"""A recorded drive from a file: a table with units, or a time response in universal file format (dataset 58)."""

from pathlib import Path

import numpy as np

from ..core import PatchfemError
from .columns import read_columns
from .records import SI_UNITS, select_channels
from .slides import RECORD_UNITS, SLIDE_UNITS, check_rising
from .universal import read_datasets, record_channels

SPECTRUM = {
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "level": {"g^2/Hz": 9.80665**2, "m^2/s^3": 1.0, "(m/s^2)^2/Hz": 1.0},
}
KINDS = {"acceleration": 12, "force": 13}  # data types of a universal file


def read_signal(path, name: str) -> tuple:
    """Read a recorded drive: time (k,) [s] from 0 and value (k,) in SI; name: acceleration or force.

    CSV with a header like `time [s],acceleration [g]`, whose other columns of RECORDED are passed over, or .uff/.unv
    with one time response of that kind, in the unit of its label or of dataset 164, else in SI. The signal is taken
    from its first row on. PatchfemError names file and line, Missing where there is no file.
    """
    path = Path(path)
    if path.suffix.lower() in (".uff", ".unv"):
        time, value = _universal(path, name)
    else:
        header = f"time [s],{name} [{SI_UNITS[name]}]"
        table = read_columns(
            path,
            {**RECORD_UNITS, **SLIDE_UNITS},
            ("time", name),
            header,
            "a drive",
            "; drive.file is relative to the scene",
        )
        time, value = table.values["time"], table.values[name]
        check_rising(path, time)
    if not np.any(value):
        raise PatchfemError(f"{path}: {name} is 0 in every row, so nothing moves")
    return time - time[0], np.array(value)


def read_spectrum(path) -> tuple:
    """Read the spectrum of a random drive: frequency (k,) [Hz], rising from above 0, and level (k,) [m2 s-3] above 0.

    CSV with a header like `frequency [Hz],level [g^2/Hz]`. PatchfemError names file and line, Missing where there is no
    file.
    """
    table = read_columns(
        path,
        SPECTRUM,
        ("frequency", "level"),
        "frequency [Hz],level [g^2/Hz]",
        "a spectrum",
        "; drive.file is relative to the scene",
    )
    frequency, level = table.values["frequency"], table.values["level"]
    wrong = np.flatnonzero((level <= 0) | (np.diff(frequency, prepend=0.0) <= 0))
    if wrong.size:
        raise PatchfemError(
            f"{path}:{wrong[0] + 2}: frequencies must be above 0 Hz and rise, and levels must be above "
            f"0, but this row has {frequency[wrong[0]]:g} Hz and {level[wrong[0]]:g} m^2/s^3"
        )
    return frequency, level


def _universal(path: Path, name: str) -> tuple:
    notes, kinds, sets = [], (KINDS[name], 0), read_datasets(path)
    there = [
        one for one in sets if one["type"] != 58 or int(one["ordinate_spec_data_type"]) in kinds
    ]
    found = record_channels(
        path, [one | {"ordinate_spec_data_type": KINDS[name]} for one in there], notes
    )
    if len(found) != 1:
        raise PatchfemError(
            f"{path}: exactly one time response (dataset 58, function type 1) of {name} is needed; "
            f"{len(found)} of the {len(sets)} datasets match"
        )
    values = select_channels(path, found, [], notes).values
    return values["time"], values[name]
