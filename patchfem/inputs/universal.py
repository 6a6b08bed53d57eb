"""Records over time in a universal file (dataset 58), read by the package pyuff.

The unit of a record is that of its label, else that of dataset 164, else SI. A record with a constant
step states the step with six digits; its times are as accurate as that. Binary records (58b) have full
precision.
"""

from pathlib import Path
from typing import Any

import numpy as np

from ..core import Missing, PatchfemError
from .damage import refuse_damage, shorten
from .records import Channel, check_file
from .units import CHANNEL_UNITS, normalize_unit

Dataset = dict[str, Any]  # dataset of a universal file as pyuff returns it
DIRECTION_NAMES = ("x", "y", "z", "rx", "ry", "rz")  # directions 1 to 6 of a node
TIME_ABSCISSA_TYPE = 17  # type code of the abscissa "time"
GENERAL_FUNCTION_TYPE = 0  # function type of a dataset 58 that may be anything
TIME_RESPONSE_TYPE = 1  # function type of a time response in dataset 58
# Quantity of each data type of dataset 58 that is read; 9 is the force of an excitation.
ORDINATE_QUANTITIES = {
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
}
UNKNOWN_ORDINATE_TYPE = 0  # data type of values that may be any quantity


def read_datasets(path) -> list[Dataset]:
    """Read the datasets 55, 58 and 164 of a universal file in order, as pyuff returns them.

    Parameters
    ----------
    path : path-like
        File to read.

    Returns
    -------
    list of dict

    Raises
    ------
    Missing
        If there is no file, or if pyuff is not installed.
    PatchfemError
        If the file is too large or damaged, or has no such dataset.
    """
    try:
        import pyuff
    except ImportError:
        raise Missing(
            "reading universal files needs the package pyuff; run pip install 'patchfem[lab]'"
        ) from None

    # Only these three kinds of datasets are read. Files of other programs contain many more.
    path = Path(path)
    check_file(path, "export fewer channels or a part of the record")
    remedy = "; export it anew, with datasets 55, 58 or 164"
    with refuse_damage(f"{path}: cannot be read as a universal file", remedy):
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
        numbers = [number for number, kind in enumerate(types) if kind in (55, 58, 164)]
        datasets = [file.read_sets(number) for number in numbers]
    if not datasets:
        raise PatchfemError(
            f"{path}: no dataset 55 (modes) or 58 (records, frequency responses); its datasets: "
            f"{', '.join(map(str, types)) or 'none'}"
        )
    return datasets


def make_channels(
    path, datasets: list[Dataset], notes: list[str], default_quantity: str = ""
) -> list[Channel]:
    """Return the time records among the datasets as channels.

    A record along a negative axis is reversed, so that it points along the positive one.

    Parameters
    ----------
    path : Path
        File, for error messages.
    datasets : list of dict
        Datasets from `read_datasets`.
    notes : list of str
        Receives a sentence on each record that is not read as it stands.
    default_quantity : str
        Quantity of records for which the file states none.

    Returns
    -------
    list of Channel

    Raises
    ------
    PatchfemError
        If a record or the factors of dataset 164 cannot be used.
    """
    factors = find_unit_factors(path, datasets)
    functions = [dataset for dataset in datasets if dataset["type"] == 58]
    quantities = {UNKNOWN_ORDINATE_TYPE: default_quantity, **ORDINATE_QUANTITIES}
    channels = []
    for number, dataset in enumerate(functions, 1):
        kind = int(dataset["func_type"])
        is_over_time = int(dataset["abscissa_spec_data_type"]) == TIME_ABSCISSA_TYPE
        if kind == TIME_RESPONSE_TYPE or (kind == GENERAL_FUNCTION_TYPE and is_over_time):
            quantity = quantities.get(int(dataset["ordinate_spec_data_type"]), "")
            channels.append(_make_channel(path, number, dataset, quantity, factors, notes))
    return channels


def find_unit_factors(path, datasets: list[Dataset]) -> Dataset | None:
    """Return dataset 164 of a file, which has the unit factors of its numbers, or None without it.

    Its entry `length` is the number of units of length in a metre, and `force` that of units of force in a newton.
    PatchfemError is raised if one of them is not above 0; `path` names the file in the message.
    """
    factors = next((dataset for dataset in datasets if dataset["type"] == 164), None)
    if factors is not None and not min(factors["length"], factors["force"]) > 0:
        raise PatchfemError(
            f"{path}: the unit factors of dataset 164 must be > 0, not {factors['length']:g} and "
            f"{factors['force']:g}"
        )
    return factors


def _make_channel(
    path,
    number: int,
    dataset: Dataset,
    quantity: str,
    factors: Dataset | None,
    notes: list[str],
) -> Channel:
    """Make a channel of a record from a dataset of a universal file.

    Its factor to SI is that of its unit label if this is a unit of its quantity, else that of dataset 164, else 1.

    Parameters
    ----------
    path : Path
        File, for messages.
    number : int
        Number of the record, for messages.
    dataset : dict
        Dataset 58.
    quantity : str
        What it contains, or "" if this is not known.
    factors : dict or None
        Unit factors of dataset 164, if the file has one.
    notes : list of str
        Receives sentences on what was not read as it stands.

    Returns
    -------
    Channel
        Values in the unit of the file.
    """
    location = f"{path}: record {number}"
    values = np.asarray(dataset["data"])
    time = np.asarray(dataset["x"], float)
    if np.iscomplexobj(values):
        raise PatchfemError(
            f"{location}: the values are complex, but a record over time must be real"
        )
    if values.size != int(dataset["num_pts"]) or time.size != values.size:
        raise PatchfemError(
            f"{location}: {values.size} values, but {dataset['num_pts']} are announced; the file is damaged"
        )

    # A channel whose label states a unit of its quantity needs no factor. Dataset 164 gives the length (force) in the unit
    # of the file that equals one SI unit.
    unit = normalize_unit(_clean_text(dataset["ordinate_axis_units_lab"]))
    factor = None
    if quantity and unit not in CHANNEL_UNITS[quantity]:
        factor = 1.0
        remedy = "its values are read as SI; if they are in another unit, name this unit with --map"
        if factors is not None:
            factor = 1 / factors["force" if quantity == "force" else "length"]
            remedy = "the unit of dataset 164 is used"
        if unit or factors is None:
            reason = f"its unit '{shorten(unit)}' is not known" if unit else "it has no unit"
            notes.append(f"record {number} ({quantity}): {reason}; {remedy}")

    # Place of the record; along a negative axis it is reversed.
    direction = int(dataset["rsp_dir"])
    is_known = 1 <= abs(direction) <= len(DIRECTION_NAMES)
    axis = DIRECTION_NAMES[abs(direction) - 1] if is_known else "?"
    if direction < 0:
        notes.append(f"record {number} points along -{axis}, so its sign is reversed here")
        values = -values
    name = _clean_text(dataset["id1"]) or f"record {number}"
    place = f"{int(dataset['rsp_node'])}:+{axis}" if direction else ""
    return Channel(name, place, quantity, unit, values, time, factor)


def _clean_text(value) -> str:
    """Return the text of a label (`value`), or "" for the word NONE, which stands for an empty one."""
    text = str(value or "").strip()
    return "" if text.upper() == "NONE" else text
