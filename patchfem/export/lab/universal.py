"""Histories and loops as a universal file: dataset 164 (SI), and binary datasets 58.

The datasets are binary and unevenly spaced, because only then are time and value exact to the last
bit: as text, a value has twelve digits and a time six. pyuff writes the file; it counts the bytes
of a dataset without the abscissa, and this number is corrected.
"""

from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from .series import Column, Histories, program_name

# Codes of the data types of universal dataset 58.
GENERAL = 1
DISPLACEMENT = 8
TIME = 17
TYPES = {"m": 8, "m s-1": 11, "m s-2": 12, "N": 13}  # data type by unit; GENERAL for other units
HISTORY_FUNCTION = 1  # function type "time response"
LOOP_FUNCTION = 0  # function type "general"
LABELS = {"m s-1": "m/s", "m s-2": "m/s^2"}
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


def write_histories(path: Path, histories: Histories) -> int:
    """Write histories and friction loops as universal datasets 58; return their number.

    Identification line 1 is the name of the history (for a loop, "force over slide"), line 2 the
    program, line 4 the title; the node is the number of the interface or mode, or 1, and the
    direction is +x.

    Raises
    ------
    PatchfemError
        If the folder has neither time nor loop.
    Missing
        If pyuff is not installed.
    """
    for column in histories.columns:
        if not np.isfinite(column.values).all():  # pyuff would write these values as 0
            raise PatchfemError(
                f"{path}: {column.label} has values that are not finite, which a universal file cannot "
                "contain; export .mat or .csv instead"
            )
    sets = (
        []
        if histories.time is None
        else [
            _function_dataset(
                column.label,
                Column("time", "s", histories.time, 0),
                column,
                HISTORY_FUNCTION,
                histories.title,
            )
            for column in histories.columns
        ]
    )
    sets += [
        _function_dataset(
            f"{force.label} over {slide.label}", slide, force, LOOP_FUNCTION, histories.title
        )
        for slide, force in histories.loops()
    ]
    if not sets:
        raise PatchfemError(f"{path}: contains neither times nor a loop to write")
    write_sets(path, [SI_UNITS, *sets])
    return len(sets)


def write_sets(path: Path, sets: list) -> None:
    """Write universal datasets into a new file by pyuff, with correct byte counts.

    Datasets of type 58 are binary.
    """
    try:
        import pyuff
    except ImportError:
        raise Missing(
            "writing universal files needs the package pyuff; run pip install 'patchfem[lab]'"
        ) from None
    path = Path(path)
    path.write_bytes(b"")
    file = pyuff.UFF(str(path))
    for dataset in sets:
        start = path.stat().st_size
        file.write_sets(dataset, "add")
        if dataset["type"] == 58:
            values = 2 if dataset["data"].dtype.kind == "c" else 1
            _write_byte_count(
                path, start, 8 * dataset["data"].size * (values + 1 - dataset["abscissa_spacing"])
            )


def _write_byte_count(path: Path, start: int, size: int) -> None:
    """Correct the number of bytes in the header of a universal dataset 58.

    Parameters
    ----------
    path : Path
    start : int
        Position of the dataset in the file.
    size : int
        Number of bytes.
    """
    with open(path, "r+b") as file:
        file.seek(start)
        head = file.read(200)
        # The byte count follows the byte order, the float format and the number of text lines.
        at = head.index(b"b", head.index(b"    58")) + 1 + 6 + 6 + 12
        file.seek(start + at)
        file.write(b"%12d" % size)


def _function_dataset(name: str, abscissa: Column, ordinate: Column, kind: int, title: str) -> dict:
    """Return a universal dataset 58 of one column as a function of another."""
    line = "".join(letter if " " <= letter <= "~" else "?" for letter in title)[:80].strip()
    return {
        "type": 58,
        "binary": 1,
        "func_type": kind,
        "func_id": 0,
        "ver_num": 0,
        "load_case_id": 0,
        "id1": name[:80],
        "id2": program_name(),
        "id3": "NONE",
        "id4": line or "NONE",
        "id5": "NONE",
        "rsp_ent_name": "NONE",
        "rsp_node": ordinate.number or 1,
        "rsp_dir": 1,
        "ref_ent_name": "NONE",
        "ref_node": 0,
        "ref_dir": 0,
        "abscissa_spacing": 0,
        "abscissa_spec_data_type": TIME if abscissa.name == "time" else DISPLACEMENT,
        "abscissa_axis_lab": "Time" if abscissa.name == "time" else "Displacement",
        "abscissa_axis_units_lab": abscissa.unit,
        "ordinate_spec_data_type": TYPES.get(ordinate.unit, GENERAL),
        "ordinate_axis_lab": ordinate.label[:20],
        "ordinate_axis_units_lab": LABELS.get(ordinate.unit, ordinate.unit)[:20],
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "data": np.ascontiguousarray(ordinate.values, float),
        "x": np.ascontiguousarray(abscissa.values, float),
    }
