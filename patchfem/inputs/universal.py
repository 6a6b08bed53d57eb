"""Records over time of a universal file: dataset 58 in the units of its labels or of dataset 164, read by pyuff.

An even record holds its step with six digits; its times are as good as that. Binary records (58b) hold every bit.
"""

from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError
from .records import MAX_BYTES, UNITS, Channel, normalize_unit

# ordinate types
KINDS = {
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
}
AXES = ("x", "y", "z", "rx", "ry", "rz")
GENERAL, TIME, TIMES = 0, 1, 17  # function types, abscissa type


def read_datasets(path, where: str = "") -> list:
    """Datasets 55, 58 and 164 of a universal file as pyuff reads them, in their order.

    PatchfemError, which starts with `where`, for a file that is too large or damaged or holds none of them, Missing
    where there is no file or no pyuff.
    """
    try:
        import pyuff
    except ImportError:
        raise Missing(
            f"{where}reading universal files needs the package pyuff; run pip install "
            "'patchfem[lab]'"
        ) from None
    path = Path(path)
    if not path.is_file():
        raise Missing(f"{where}{path}: there is no such file")
    if path.stat().st_size > MAX_BYTES:
        raise PatchfemError(
            f"{where}{path}: more than {MAX_BYTES >> 20} MiB; export fewer channels or a part of the "
            "record"
        )
    try:
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
        sets = [
            file.read_sets(number) for number, kind in enumerate(types) if kind in (55, 58, 164)
        ]
    except Exception as fault:  # pyuff raises plain Exception for whatever is wrong in a file
        raise PatchfemError(
            f"{where}{path}: cannot be read as a universal file ({fault})"
        ) from None
    if not sets:
        raise PatchfemError(
            f"{where}{path}: no dataset 55 (modes) or 58 (records, frequency responses); its datasets: "
            f"{', '.join(map(str, types)) or 'none'}"
        )
    return sets


def record_channels(path, sets: list, notes: list) -> list:
    """`Channel`s of the records over time among the datasets; what is read otherwise than it stands goes to notes.

    The unit is that of the label where it is one of the quantity, else that of dataset 164, else SI. A channel that
    points along a negative axis is turned to the positive one.
    """
    scale = next(((one["length"], one["force"]) for one in sets if one["type"] == 164), None)
    if scale is not None and not min(scale) > 0:
        raise PatchfemError(
            f"{path}: the unit factors of dataset 164 must be > 0, not {scale[0]:g} and {scale[1]:g}"
        )
    functions = [one for one in sets if one["type"] == 58]
    return [
        _channel(path, number, one, scale, notes)
        for number, one in enumerate(functions, 1)
        if _is_record(one)
    ]


def _is_record(one: dict) -> bool:
    kind = int(one["func_type"])
    return kind == TIME or (kind == GENERAL and int(one["abscissa_spec_data_type"]) == TIMES)


def _channel(path, number: int, one: dict, scale, notes: list) -> Channel:
    what = f"{path}: record {number}"
    values, time = np.asarray(one["data"]), np.asarray(one["x"], float)
    if np.iscomplexobj(values):
        raise PatchfemError(f"{what}: the values are complex, but a record over time must be real")
    if values.size != int(one["num_pts"]) or time.size != values.size:
        raise PatchfemError(
            f"{what}: {values.size} values, but {one['num_pts']} are announced; the file is damaged"
        )
    quantity = KINDS.get(int(one["ordinate_spec_data_type"]), "")
    label = normalize_unit(_text(one["ordinate_axis_units_lab"]))
    factor = None
    if quantity and label not in UNITS[quantity]:
        factor = 1.0 if scale is None else 1.0 / scale[1 if quantity == "force" else 0]
        if label or scale is None:
            notes.append(
                f"record {number} ({quantity}): "
                + (f"its unit '{label[:20]}' is not known" if label else "it has no unit")
                + (
                    "; the unit of dataset 164 is used"
                    if scale is not None
                    else "; its values are read as SI; if they are in another unit, name this "
                    "unit with --map"
                )
            )
    direction = int(one["rsp_dir"])
    if direction < 0:
        notes.append(
            f"record {number} points along -{_axis(direction)}, so its sign is reversed here"
        )
        values = -values
    name = _text(one["id1"]) or f"record {number}"
    return Channel(
        name,
        f"{int(one['rsp_node'])}:+{_axis(direction)}" if direction else "",
        quantity,
        label,
        values,
        time,
        factor,
    )


def _axis(direction: int) -> str:
    return AXES[abs(direction) - 1] if 1 <= abs(direction) <= len(AXES) else "?"


def _text(value) -> str:
    text = str(value or "").strip()
    return "" if text.upper() == "NONE" else text
