"""Records of a .mat file by an explicit map: a variable, a field of a structure or a column of either for each
quantity, with its unit."""

import re
from pathlib import Path

from ...core import Missing, PatchfemError
from ..matlab import content, variables
from .records import LARGEST, Records, Wanted, checked, factor_of

_COLUMN = re.compile(r"([\w.]+)\(:,\s*([1-9][0-9]*)\)")


def read(path: Path, asked: list) -> Records:
    """`Records` of a .mat file; asked: `Wanted`, each with a variable such as `F`, `data(:,2)` or `run.load.F`.

    Only real arrays are read; nothing in the file is run or unpickled. PatchfemError names what is not there,
    Missing where there is no file.
    """
    path = Path(path)
    if not path.is_file():
        raise Missing(f"{path}: there is no such file")
    if path.stat().st_size > LARGEST:
        raise PatchfemError(f"{path}: more than {LARGEST >> 20} MiB; save fewer variables or a part of the record")
    arrays = {name: one for name, one in variables(path, content(path)).items() if one.kind == "number"}
    held = ", ".join(f"{name} {'x'.join(map(str, one.shape))}" for name, one in list(arrays.items())[:20]) or \
        "no array of numbers (objects and structures of several elements are not read)"
    if not asked:
        raise PatchfemError(f"{path}: say what its variables are, such as --map \"time=t [s]\" --map \"force=F [N]\"; "
                            f"it holds {held}")
    return checked(path, {one.quantity: _values(path, arrays, one, held) for one in
                          sorted(asked, key=lambda one: one.quantity != "time")}, [])


def _values(path, arrays: dict, one: Wanted, held: str):
    found = _COLUMN.fullmatch(one.source)
    name, column = (found[1], int(found[2]) - 1) if found else (one.source, None)
    if name not in arrays:
        raise PatchfemError(f"{path}: no variable '{name[:40]}'; it holds {held}")
    if not one.unit:
        raise PatchfemError(f"--map {one.quantity}={one.source}: a .mat file holds no units; write the unit, such as "
                            f"\"{one.quantity}={one.source} [unit]\"")
    values = arrays[name].values()
    if column is None:
        if values.ndim != 2 or min(values.shape) != 1:
            raise PatchfemError(f"{path}: {name} is {'x'.join(map(str, values.shape))}; choose a column such as "
                                f"{name}(:,1)")
        values = values.ravel()
    elif values.ndim != 2 or column >= values.shape[1]:
        raise PatchfemError(f"{path}: {name} is {'x'.join(map(str, values.shape))}; it has no column {column + 1}")
    else:
        values = values[:, column]
    return values * factor_of(one.quantity, one.unit)
