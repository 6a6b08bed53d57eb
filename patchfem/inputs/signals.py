"""A recorded drive from a file: a table with units, or a time response in universal file format (dataset 58)."""

from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError
from .columns import read_columns
from .paths import RECORDED, rising

UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "acceleration": {"m/s^2": 1.0, "g": 9.80665, "mm/s^2": 1e-3},
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605},
}
KINDS = {"acceleration": 12, "force": 13}  # data types of a universal file


def read_signal(path, name: str) -> tuple:
    """Read a recorded drive: time (k,) [s] from 0 and value (k,) in SI; name: acceleration or force.

    CSV with a header like `time [s],acceleration [g]`, whose other columns of RECORDED are passed over, or .uff/.unv
    with one time response of that kind. The signal is taken from its first row on. PatchfemError names file and line,
    Missing where there is no file.
    """
    path = Path(path)
    if path.suffix.lower() in (".uff", ".unv"):
        time, value = _universal(path, name)
    else:
        header = f"time [s],{name} [{next(iter(UNITS[name]))}]"
        table = read_columns(path, {**RECORDED, **UNITS}, ("time", name), header, "a drive",
                             "; drive.file is relative to the scene")
        time, value = table.values["time"], table.values[name]
        rising(path, time)
    if not np.any(value):
        raise PatchfemError(f"{path}: {name} is 0 in every row, so nothing moves")
    return time - time[0], np.array(value)


def _universal(path: Path, name: str) -> tuple:
    import pyuff

    if not path.is_file():
        raise Missing(f"{path}: there is no such file; drive.file is relative to the scene")
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if int(kind) == 58]
    except Exception as fault:
        raise PatchfemError(f"{path}: cannot be read as a universal file: {fault}") from None
    found = [one for one in sets if int(one.get("func_type", 0)) == 1
             and int(one.get("ordinate_spec_data_type", 0)) in (KINDS[name], 0)]
    if len(found) != 1:
        raise PatchfemError(f"{path}: one time response (dataset 58, function type 1) of {name} is wanted, "
                            f"{len(found)} of {len(sets)} are")
    time, value = np.asarray(found[0]["x"], float), np.real(np.asarray(found[0]["data"])).astype(float)
    if time.size < 2 or not np.all(np.diff(time) > 0) or not np.isfinite(value).all():
        raise PatchfemError(f"{path}: at least two samples with rising times and finite values are wanted")
    return time, value
