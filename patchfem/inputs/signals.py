"""A recorded drive signal, or the spectrum of a random one, from a table or a universal file."""

from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..scene.keys.quantities import UNIT_FACTORS
from ..scene.keys.tables import UNIVERSAL_EXTENSIONS
from .records import select_channels
from .tables import TableFormat, read_columns
from .units import CHANNEL_UNITS, SI_UNITS
from .universal import make_channels, read_datasets

# Columns of the table of a spectrum
SPECTRUM_FORMAT = TableFormat(
    {
        "frequency": UNIT_FACTORS["frequency"],
        "level": UNIT_FACTORS["acceleration spectrum"],
    },
    ("frequency", "level"),
    "frequency [Hz],level [g^2/Hz]",
    "a spectrum",
)


def read_signal(path, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Read a recorded drive signal.

    Parameters
    ----------
    path : path-like
        CSV file with a header like ``time [s],acceleration [g]`` or ``time [s],base_acceleration [g]``, or a universal file
        with one time response of the quantity, in the unit of its label, of dataset 164 or in SI.
    quantity : {"acceleration", "force"}
        What the record contains.

    Returns
    -------
    time : (k,) numpy.ndarray
        Times [s], the first of which is 0.
    value : (k,) numpy.ndarray
        Values in SI.

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file does not contain such a record.
    """
    path = Path(path)
    if path.suffix.lower() in UNIVERSAL_EXTENSIONS:
        time, value = _read_universal(path, quantity)
    else:
        base_name = f"base_{quantity}"
        table = TableFormat(
            CHANNEL_UNITS,
            ("time", f"{quantity} {base_name}"),
            f"time [s],{quantity} [{SI_UNITS[quantity]}]",
            "a drive",
        )
        values = read_columns(path, table).values
        time = values["time"]
        value = values.get(quantity, values.get(base_name))
    if not np.any(value):
        raise PatchfemError(f"{path}: {quantity} is 0 in every row, so nothing moves")
    return time - time[0], np.array(value)


def read_spectrum(path) -> tuple[np.ndarray, np.ndarray]:
    """Read the spectrum of a random drive signal from a table, `path`, of frequency and level.

    Returns
    -------
    frequency : (k,) numpy.ndarray
        Rising frequencies above 0 [Hz].
    level : (k,) numpy.ndarray
        Power spectral density above 0 [m2 s-3].

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the table is not a spectrum; the message names the line.
    """
    values = read_columns(path, SPECTRUM_FORMAT).values
    frequency = values["frequency"]
    level = values["level"]
    wrong = np.flatnonzero((level <= 0) | (np.diff(frequency, prepend=0.0) <= 0))
    if wrong.size:
        row = wrong[0]
        raise PatchfemError(
            f"{path}:{row + 2}: frequencies must be above 0 Hz and rise, and levels must be above "
            f"0, but this row has {frequency[row]:g} Hz and {level[row]:g} m^2/s^3"
        )
    return frequency, level


def _read_universal(path: Path, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Read time [s] and values of the only time response of a quantity in the universal file `path`.

    Datasets for which the file states this quantity, or none, count.
    """
    notes = []
    datasets = read_datasets(path)
    channels = make_channels(path, datasets, notes, quantity)
    channels = [channel for channel in channels if channel.quantity == quantity]
    if len(channels) != 1:
        raise PatchfemError(
            f"{path}: exactly one time response (dataset 58, function type 1) of {quantity} is needed; "
            f"{len(channels)} of the {len(datasets)} datasets match"
        )
    values = select_channels(path, channels, [], notes).values
    return values["time"], values[quantity]
