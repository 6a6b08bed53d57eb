"""Histories, friction loops and frequency responses as a universal file: datasets 164 (SI) and binary datasets 58.

The datasets are binary and unevenly spaced, because only then are abscissa and value exact to the last bit. pyuff writes the
file; it counts the bytes of a dataset without the abscissa, and this number is corrected.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...core import Missing, PatchfemError

PROGRAM = f"patchfem {__version__}"
# type codes of dataset 58 by the unit of a quantity; 1 (general) for other units
TYPES = {"m": 8, "m s-1": 11, "m s-2": 12, "N": 13, "s": 17, "Hz": 18}
LABELS = {"m s-1": "m/s", "m s-2": "m/s^2"}
AXES = {"s": "Time", "m": "Displacement", "Hz": "Frequency"}
# function types of dataset 58
LOOP = 0
HISTORY = 1
RESPONSE = 4
COHERENCE = 6
SI_UNITS = {
    "type": 164,
    "units_code": 1,
    "units_description": "SI: Meter (newton)",
    "temp_mode": 1,
    "length": 1.0,
    "force": 1.0,
    "temp": 1.0,
    "temp_offset": 273.15,
}


class Series(NamedTuple):
    """Values with their unit, over or under the line of a dataset."""

    unit: str
    values: np.ndarray


def make_dataset(
    name: str, function: int, abscissa: Series, ordinate: Series, **entries: str | int
) -> dict:
    """Return a dataset 58.

    Parameters
    ----------
    name : str
        First line of identification.
    function : int
        LOOP, HISTORY, RESPONSE or COHERENCE.
    abscissa, ordinate : Series
    **entries
        Further entries of the dataset.
    """
    return {
        "type": 58,
        "binary": 1,
        "func_type": function,
        "id1": name[:80],
        "id2": PROGRAM,
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 0,
        "ref_dir": 0,
        "abscissa_spacing": 0,
        "abscissa_spec_data_type": TYPES[abscissa.unit],
        "abscissa_axis_lab": AXES[abscissa.unit],
        "abscissa_axis_units_lab": abscissa.unit,
        "ordinate_spec_data_type": TYPES.get(ordinate.unit, 1),
        "ordinate_axis_lab": name[:20],
        "ordinate_axis_units_lab": LABELS.get(ordinate.unit, ordinate.unit)[:20],
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "data": np.array(ordinate.values),
        "x": np.array(abscissa.values, float),
    } | entries


def write_histories(path: Path, time, columns: Sequence, loops: Sequence, title: str) -> None:
    """Write histories and friction loops.

    The first line of identification is the name of the history (of a loop, "force over slide"), the fourth the title; the
    node is the number of the interface or mode, or 1, and the direction is +x.

    Parameters
    ----------
    path : Path
    time : write.Column or None
    columns : sequence of write.Column
    loops : sequence of (write.Column, write.Column)
        Slide and force.
    title : str

    Raises
    ------
    PatchfemError
        If a value is not finite, or if there is neither time nor loop.
    Missing
        If pyuff is not installed.
    """
    for column in columns:
        if not np.isfinite(column.values).all():  # pyuff would write these values as 0
            raise PatchfemError(
                f"{path}: {column.label} has values that are not finite, which a universal file cannot contain; export "
                ".mat or .csv instead"
            )
    curves = [(column.label, HISTORY, time, column) for column in columns if time is not None]
    curves += [(f"{force.label} over {slide.label}", LOOP, slide, force) for slide, force in loops]
    if not curves:
        raise PatchfemError(f"{path}: there is neither time nor loop to write")
    line = "".join(letter if " " <= letter <= "~" else "?" for letter in title)[:80].strip()
    datasets = []
    for name, function, x, y in curves:
        ends = Series(x.unit, x.values), Series(y.unit, y.values)
        entries = {"rsp_node": y.number or 1, "id4": line or "NONE"}
        datasets.append(make_dataset(name, function, *ends, **entries))
    write_datasets(path, [SI_UNITS, *datasets])


def write_response(path: Path, estimate, drive: str, response: str) -> None:
    """Write an estimated frequency response and its coherence.

    Response and reference are at point 1 in direction +x. If the input is a force, structure.file can read the file.

    Parameters
    ----------
    path : Path
    estimate : object
        With frequency (k,) [Hz], complex value (k,) and coherence (k,) or None.
    drive, response : str
        Quantities of input and output, such as "force" and "acceleration".
    """
    units = {"displacement": "m", "velocity": "m s-1", "force": "N"}
    unit, drive_unit = (units.get(name, "m s-2") for name in (response, drive))
    abscissa = Series("Hz", estimate.frequency)
    place = {"ref_node": 1, "ref_dir": 1}
    denominator = {
        "orddenom_spec_data_type": TYPES[drive_unit],
        "orddenom_axis_units_lab": LABELS.get(drive_unit, drive_unit),
    }
    value = Series(unit, estimate.value)
    name = f"{response} over {drive}"
    datasets = [make_dataset(name, RESPONSE, abscissa, value, **place, **denominator)]
    if estimate.coherence is not None:
        name = f"coherence of {response} and {drive}"
        coherence = Series("", estimate.coherence)
        entries = place | {"ordinate_spec_data_type": 0}
        datasets.append(make_dataset(name, COHERENCE, abscissa, coherence, **entries))
    write_datasets(path, [SI_UNITS, *datasets])


def write_datasets(path: Path, datasets: list[dict]) -> None:
    """Write universal datasets into a new file by pyuff, with correct byte counts; Missing without pyuff."""
    try:
        import pyuff
    except ImportError:
        raise Missing(
            "writing universal files needs the package pyuff; run pip install 'patchfem[lab]'"
        ) from None
    path = Path(path)
    path.write_bytes(b"")
    file = pyuff.UFF(str(path))
    for dataset in datasets:
        start = path.stat().st_size
        file.write_sets(dataset, "add")
        if dataset["type"] == 58:
            _correct_byte_count(path, start, dataset["data"].nbytes + dataset["x"].nbytes)


def _correct_byte_count(path: Path, start: int, size: int) -> None:
    """Write the number of bytes of values into the header of the dataset 58 that begins at a position of the file."""
    with open(path, "r+b") as file:
        file.seek(start)
        head = file.read(200)
        # the byte count follows the byte order, the float format and the number of text lines
        position = head.index(b"b", head.index(b"    58")) + 1 + 6 + 6 + 12
        file.seek(start + position)
        file.write(b"%12d" % size)
