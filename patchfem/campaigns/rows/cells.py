"""Readings of a table of measured responses, and the logarithm of computed over measured."""

from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np

from ...core import PatchfemError, frozen_array
from ...inputs.measured import read_table
from ...scene.keys.quantities import parse_quantity

# Smallest displacement [m] in a ratio: the last printed digit of the displacements, 0.01 mil.
MIN_DISPLACEMENT = 0.01 * 25.4e-6
# Largest absolute log ratio; a motion that grows without bound or is zero gets this value.
MAX_LOG_RATIO = log(1e3)
EQUAL_TOL = 1e-9  # Relative difference below which two inputs are the same condition.
CONDITION_COLUMNS = {"frequency": "frequency", "input": "acceleration"}


@dataclass(frozen=True, eq=False, slots=True)
class Readings:
    """Measured readings of a table of responses, row by row.

    The acceleration of a row comes before its displacement.

    Attributes
    ----------
    path : Path
    rows : tuple of MeasuredRow
        All rows, also those without a reading (`inputs.measured`).
    row : (n,) array
        Number of the row of each reading.
    felt : (n,) array
        Whether a reading is an acceleration.
    measured : (n,) array
        Accelerations [m s-2] and displacements [m].
    unstable : (n,) array
        Whether the row of a reading is flagged U.
    conditions : (c, 2) array
        Distinct frequencies [Hz] and inputs [m s-2] of rows with a reading, ascending.
    condition : (n,) array
        Number of the condition of each reading.
    """

    path: Path
    rows: tuple
    row: np.ndarray
    felt: np.ndarray
    measured: np.ndarray
    unstable: np.ndarray
    conditions: np.ndarray
    condition: np.ndarray

    @property
    def runs(self) -> list:
        """Names of the rows, made of their frequency and whether they are repeats."""
        return [f"{row.frequency:.6g} Hz" + " repeat" * ("R" in row.flag) for row in self.rows]

    @property
    def empty(self) -> list:
        """Numbers of the rows without any reading."""
        return sorted(set(range(len(self.rows))) - set(self.row.tolist()))

    def column(self, name: str) -> list:
        """Return the values (n,) of a table column for all readings.

        PatchfemError for a column other than "frequency", "input", "flag" and "run".
        """
        if name == "run":
            runs = self.runs
            return [runs[k] for k in self.row]
        if name not in ("frequency", "input", "flag"):
            raise PatchfemError(
                f"{self.path}: there is no column {name} by which rows can be held out or left out; "
                "use frequency, input, flag or run"
            )
        return [getattr(self.rows[k], name) for k in self.row]

    def select(self, selector: str) -> np.ndarray:
        """Return a mask (n,) of the readings that a selector such as "column=value" selects.

        The text is like "frequency=135 Hz,150 Hz" or "run=143 Hz repeat". PatchfemError for a value
        without its unit, and for a value that no row has.
        """
        name, equals, values = (part.strip() for part in selector.partition("="))
        if not equals or not values:
            raise PatchfemError(
                f"--hold {selector}: write column=value,value, for example frequency=135 Hz,150 Hz"
            )
        column = self.column(name)
        selected = np.zeros(self.row.size, bool)
        for text in map(str.strip, values.split(",")):
            is_equal = np.array([_equals(name, value, text) for value in column])
            if not is_equal.any():
                known = ", ".join(dict.fromkeys(_format_cell(name, value) for value in column))
                raise PatchfemError(
                    f"--hold {name}={text}: none of the rows of {self.path.name} that hold a reading "
                    f"has {text} in the column {name}; the values of this column are {known}"
                )
            selected |= is_equal
        return selected

    def group_readings(self, name: str, selected) -> dict:
        """Group selected readings by the distinct values of a column.

        The result maps the value as text to a mask (n,).

        Only the readings in the mask `selected` (n,) count; the values are in the order of the
        rows.
        """
        column = self.column(name)
        groups = {}
        for value in dict.fromkeys(column):
            readings = np.array([other == value for other in column]) & selected
            if readings.any():
                groups[_format_cell(name, value)] = readings
        return groups

    def logs(self, acceleration, displacement) -> np.ndarray:
        """Return the log ratios ln(computed/measured) (n,) of all readings.

        It is NaN if nothing was computed, and MAX_LOG_RATIO if a motion is not finite.

        Parameters
        ----------
        acceleration, displacement : (c,) array
            Accelerations [m s-2] and displacement amplitudes [m] at the conditions.
        """
        at_conditions = np.array([displacement, acceleration], float)
        computed = at_conditions[self.felt.astype(int), self.condition]
        minimum = np.where(self.felt, 1e-300, MIN_DISPLACEMENT)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.log(np.maximum(computed, minimum))
            ratio -= np.log(np.maximum(self.measured, minimum))
        return np.clip(ratio, -MAX_LOG_RATIO, MAX_LOG_RATIO)


def _equals(name: str, value, text: str) -> bool:
    """Return whether a value of a table column equals that of a selector."""
    if name not in CONDITION_COLUMNS:
        return text in value if name == "flag" else text == value
    try:
        selected = parse_quantity(text, CONDITION_COLUMNS[name])
    except ValueError as error:
        raise PatchfemError(f"--hold {name}={text}: {error}") from None
    return abs(value - selected) <= EQUAL_TOL * abs(selected)


def _format_cell(name: str, value) -> str:
    """Format a value of a table column with its unit."""
    unit = {"frequency": " Hz", "input": " m/s^2"}.get(name)
    return f"{value:.6g}{unit}" if unit else str(value) or "(none)"


def read_readings(path: Path) -> Readings:
    """Read the readings from a CSV file of measured responses (`inputs.measured.read_table`).

    Repeats of a condition remain separate readings. PatchfemError names what is wrong with the
    file.
    """
    rows = tuple(read_table(path))
    row_numbers = []
    felt = []
    measured = []
    for k, row in enumerate(rows):
        if not (row.frequency > 0 and row.input > 0):
            raise PatchfemError(f"{path}: row {k + 1}: frequency and input must be above zero")
        if row.acceleration == 0:
            raise PatchfemError(
                f"{path}: row {k + 1}: the acceleration is 0, but the fit takes its logarithm; leave "
                "the cell empty"
            )
        for value, is_felt in ((row.acceleration, True), (row.displacement, False)):
            if value is not None:
                row_numbers.append(k)
                felt.append(is_felt)
                measured.append(value)
    if not row_numbers:
        raise PatchfemError(
            f"{path}: no row has an acceleration or a displacement, so nothing can be fitted"
        )
    inputs = np.array([(rows[k].frequency, rows[k].input) for k in row_numbers])
    conditions = _distinct_conditions(inputs)
    condition = [int(np.argmin(np.abs(conditions / pair - 1).max(axis=1))) for pair in inputs]
    unstable = [("U" in rows[k].flag) for k in row_numbers]
    return Readings(
        Path(path),
        rows,
        frozen_array(row_numbers, np.int64),
        frozen_array(felt, bool),
        frozen_array(measured),
        frozen_array(unstable, bool),
        frozen_array(conditions),
        frozen_array(condition, np.int64),
    )


def _distinct_conditions(inputs) -> np.ndarray:
    """Return the distinct pairs (c, 2) of frequency and input, ascending.

    The same input written in two units differs by round-off, but is one condition.
    """
    conditions: list = []
    for pair in sorted(set(map(tuple, inputs.tolist()))):
        if not conditions or not np.allclose(pair, conditions[-1], rtol=EQUAL_TOL, atol=0):
            conditions.append(pair)
    return np.array(conditions)


def scores(cells: Readings, log_ratios, selected) -> dict | None:
    """Return the root mean square of the log ratios of selected readings, by kind.

    It is None if no reading is selected.

    Parameters
    ----------
    cells : Readings
    log_ratios : (n,) array
        ln(computed/measured).
    selected : (n,) bool
        Readings that count.

    Returns
    -------
    dict or None
        By "acceleration", "displacement" and "all"; None if there is no such reading, or if one of
        them is NaN because it was not predicted.
    """
    if not np.any(selected):
        return None
    log_ratios = np.asarray(log_ratios)
    every = np.ones(len(log_ratios), bool)
    kinds = {"acceleration": cells.felt, "displacement": ~cells.felt, "all": every}
    out: dict = {}
    for name, of_kind in kinds.items():
        selected_logs = log_ratios[of_kind & selected]
        is_known = selected_logs.size and not np.isnan(selected_logs).any()
        out[name] = float(np.sqrt(np.mean(selected_logs**2))) if is_known else None
    return out
