"""A measured friction loop: displacement and force row by row, with time and labels where the table has them."""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from .columns import read_columns
from .slides import FORCE_UNITS, SLIDE_UNITS, check_rising

LOOP_HEADER = "time [s],displacement [um],force [N]"
# names in `patchfem export`
EXPORTED_NAMES = {
    "displacement": ("slide", "relative_displacement"),
    "force": ("friction_force",),
}


@dataclass(frozen=True, eq=False, slots=True)
class Loop:
    """A measured friction loop.

    time: (k,) [s] or None; displacement: (k,) [m], 0 in the first row; reading: (k,), `quantity` says "force" [N] or
    "friction_ratio" [1]; labels: name -> k texts of the other columns, such as `run` or `frequency [Hz]`.
    """

    path: Path
    time: np.ndarray | None
    displacement: np.ndarray
    reading: np.ndarray
    quantity: str
    labels: dict

    def rows_of(self, hold: str) -> np.ndarray:
        """Rows (k,) bool whose label is among those of `column=value,value`; numbers are compared as numbers.

        PatchfemError for a column that is not there and for a value that no row has.
        """
        name, equals, text = (part.strip() for part in hold.partition("="))
        wanted = [one.strip() for one in text.split(",")]
        if not equals or not all(wanted):
            raise PatchfemError(f"--hold {hold}: column=value,value is needed, such as cycle=1,2")
        if name not in self.labels:
            known = ", ".join(self.labels) or "none"
            raise PatchfemError(
                f"--hold {name}: {self.path} has no column of labels with this name (it has: {known}); "
                "add a column of labels, such as `run`, because rows cannot be chosen by time, "
                "displacement or force"
            )
        there = [_plain(cell) for cell in self.labels[name]]
        absent = [one for one in wanted if _plain(one) not in there]
        if absent:
            known = ", ".join(dict.fromkeys(self.labels[name]))
            raise PatchfemError(
                f"--hold {name}={','.join(absent)}: no row of {self.path} has this value (it has: "
                f"{known[:200]})"
            )
        kept = {_plain(one) for one in wanted}
        return np.array([cell in kept for cell in there])


def read_loop(path, units: Mapping = SLIDE_UNITS) -> Loop:
    """Read a friction loop from a CSV whose header is like `time [s],displacement [um],force [N]`.

    time may be absent; a column friction_ratio stands in for force. Where there is no displacement or no force, the
    column of `patchfem export` stands for it (`OWN`). The displacement is counted from its first row.
    PatchfemError names file and line of a mistake, Missing where there is no file.
    """
    path = Path(path)
    known = {**FORCE_UNITS, **units}
    known |= {name: known[quantity] for quantity, names in EXPORTED_NAMES.items() for name in names}
    wanted = " ".join(("displacement", *EXPORTED_NAMES["displacement"]))
    found = read_columns(path, known, (wanted,), LOOP_HEADER, "a measured loop", labels=True)
    values = {standard_name(name, found.values): column for name, column in found.values.items()}
    read = [name for name in FORCE_UNITS if name in values]
    if len(read) != 1:
        raise PatchfemError(
            f"{path}:1: "
            + (
                "there are columns force and friction_ratio: keep only one of the two"
                if read
                else f"no column force; write a header like `{LOOP_HEADER}` (or friction_ratio for the force)"
            )
        )
    place, time = values["displacement"], values.get("time")
    if time is not None:
        check_rising(path, time)
    if not np.ptp(place):
        raise PatchfemError(f"{path}: displacement is the same in every row, so nothing slides")
    if not values[read[0]].any():
        raise PatchfemError(f"{path}: {read[0]} is 0 in every row, so there is nothing to fit")
    return Loop(path, time, place - place[0], values[read[0]], read[0], found.labels)


def standard_name(name: str, names: Container, known: Mapping = EXPORTED_NAMES) -> str:
    """What a column of `patchfem export` is called in a measured loop, where none of `names` is called so or comes
    first; any other name as it is. known: quantity -> the names that stand for it, the first that is there."""
    for quantity, own in known.items():
        if quantity not in names and name == next((one for one in own if one in names), None):
            return quantity
    return name


def _plain(text: str):
    try:
        return float(text)
    except ValueError:
        return text
