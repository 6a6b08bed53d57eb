"""A table of measured responses: frequency, input, acceleration, displacement and flag."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..exceptions import PatchfemError
from ..scene.keys.quantities import UNIT_FACTORS
from .damage import shorten
from .tables import TableFormat, find_factors, parse_number, read_text

# Factors to SI by unit, for each column of numbers in a table of measured responses
COLUMN_UNITS = {
    "frequency": UNIT_FACTORS["frequency"],
    "input": UNIT_FACTORS["acceleration"],
    "acceleration": UNIT_FACTORS["acceleration"],
    "displacement": UNIT_FACTORS["length"],
}
# Columns that a table of measured responses may have
TABLE_FORMAT = TableFormat(
    COLUMN_UNITS,
    ("frequency", "input"),
    "frequency [Hz],input [g],acceleration [g],displacement [um],flag",
    "a measured table",
)
# Meanings of the letters in the column `flag` of a table of measured responses
FLAG_MEANINGS = {"U": "unstable", "*": "the gauge gave no reading", "R": "repeat run"}


@dataclass(frozen=True, slots=True)
class MeasuredRow:
    """One measured condition in SI.

    A missing value is None.

    - frequency: frequency of the drive [Hz], >= 0.
    - input: amplitude of the drive [m s-2], >= 0.
    - acceleration, displacement: measured amplitudes [m s-2] and [m], >= 0.
    - flag: letters of `FLAG_MEANINGS`, which may be empty.
    """

    frequency: float
    input: float
    acceleration: float | None
    displacement: float | None
    flag: str


def read_table(path: Path) -> list[MeasuredRow]:
    """Read a table of measured responses with a header like ``frequency [Hz],input [g],flag``.

    Every row has frequency and input; other cells may be empty.

    Parameters
    ----------
    path : Path
        CSV file.

    Returns
    -------
    list of MeasuredRow

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the file is not such a table; the message names the line.
    """
    table = read_text(path, TABLE_FORMAT.contents)
    factors = find_factors(table, TABLE_FORMAT)
    unknown = [name for name in table.names if name not in (*COLUMN_UNITS, "flag")]
    if unknown:
        raise PatchfemError(
            f"{path}:1: column '{shorten(unknown[0])}' is unknown; possible columns are flag and "
            f"{', '.join(COLUMN_UNITS)}"
        )
    rows = []
    for number, cells in table.iterate_rows(skips_blank=True):
        rows.append(_parse_row(f"{path}:{number}: ", dict(zip(table.names, cells)), factors))
    return rows


def _parse_row(location: str, cells: dict[str, str], factors: dict[str, float]) -> MeasuredRow:
    """Parse one row of a table of measured responses.

    `location` is file and line for messages, `cells` are the texts by column, and `factors` the factors to SI by
    column.
    """
    flag = cells.get("flag", "")
    if set(flag) - set(FLAG_MEANINGS):
        raise PatchfemError(
            f"{location}flag '{shorten(flag)}' is unknown; possible letters are {', '.join(FLAG_MEANINGS)}"
        )
    values = dict.fromkeys(COLUMN_UNITS)
    for name, factor in factors.items():
        if cells[name]:
            values[name] = parse_number(location + name, cells[name], factor)
            if values[name] < 0:
                raise PatchfemError(f"{location}{name}: '{shorten(cells[name])}' is below 0")
    if values["frequency"] is None or values["input"] is None:
        raise PatchfemError(f"{location}frequency and input are needed in every row")
    return MeasuredRow(**values, flag=flag)


@lru_cache(64)
def is_readable(path: Path) -> bool:
    """Return whether the file `path` is a table of measured responses that can be read.

    The answer is kept, because the models of a sweep name the same table.
    """
    try:
        read_table(path)
    except PatchfemError:
        return False
    return True
