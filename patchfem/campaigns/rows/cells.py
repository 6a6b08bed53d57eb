"""Measured readings of a response table, and their log ratios to computed readings."""

from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np

from ...core import PatchfemError, frozen_array
from ...inputs.measured import MeasuredRow, read_table
from ..held_out import EQUAL_NUMBERS_TOL

# Lower limit of a displacement [m] in a log ratio: the resolution of the printed table, 0.01 mil.
MIN_COMPARED_DISPLACEMENT = 0.01 * 25.4e-6
# Largest absolute log ratio, which is also assigned to unbounded and to vanishing motions.
MAX_LOG_RATIO = log(1e3)


@dataclass(frozen=True, eq=False, slots=True)
class Readings:
    """Measured readings of a response table in the order of its rows.

    The acceleration of a row precedes its displacement.

    Attributes
    ----------
    path : Path
        File of the response table.
    rows : tuple of MeasuredRow
        All rows, including those without a reading (`inputs.measured`).
    row : (n,) array
        Index of the table row of each reading.
    is_acceleration : (n,) array
        Whether a reading is an acceleration; otherwise it is a displacement.
    measured : (n,) array
        Accelerations [m s-2] and displacements [m].
    unstable : (n,) array
        Whether the row of a reading is flagged U.
    conditions : (c, 2) array
        Distinct pairs of frequency [Hz] and input [m s-2] of the rows with a reading, ascending.
    condition : (n,) array
        Index of the condition of each reading.
    """

    path: Path
    rows: tuple[MeasuredRow, ...]
    row: np.ndarray
    is_acceleration: np.ndarray
    measured: np.ndarray
    unstable: np.ndarray
    conditions: np.ndarray
    condition: np.ndarray

    @property
    def empty_rows(self) -> list[int]:
        """Indices of the rows without any reading."""
        return sorted(set(range(len(self.rows))) - set(self.row.tolist()))

    @property
    def columns(self) -> dict[str, list[float | str]]:
        """Columns by which rows can be selected, with a cell for each of the n readings.

        The name of a row, in the column "run", is its frequency, followed by "repeat" for a repeated measurement.
        """
        rows = [self.rows[k] for k in self.row]
        names = [f"{row.frequency:.6g} Hz" + " repeat" * ("R" in row.flag) for row in rows]
        columns = {"run": names}
        for name in ("frequency", "input", "flag"):
            columns[name] = [getattr(row, name) for row in rows]
        return columns

    def select_computed(self, acceleration, displacement) -> np.ndarray:
        """Return the computed value (n,) of each reading.

        Parameters
        ----------
        acceleration, displacement : (c,) array
            Accelerations [m s-2] and displacement amplitudes [m] at the conditions.
        """
        at_conditions = np.array([displacement, acceleration], float)
        return at_conditions[self.is_acceleration.astype(int), self.condition]

    def compute_logs(self, computed: np.ndarray) -> np.ndarray:
        """Return the log ratio ln(computed/measured) (n,) of computed values (n,).

        The ratio is NaN if no motion was computed, and MAX_LOG_RATIO if the motion is not finite.
        """
        lower_limit = np.where(self.is_acceleration, 1e-300, MIN_COMPARED_DISPLACEMENT)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.log(np.maximum(computed, lower_limit))
            ratio -= np.log(np.maximum(self.measured, lower_limit))
        return np.clip(ratio, -MAX_LOG_RATIO, MAX_LOG_RATIO)


def _number_values(values) -> np.ndarray:
    """Return the number (n,) of each value in rising order; values within EQUAL_NUMBERS_TOL have the same number."""
    distinct, place = np.unique(values, return_inverse=True)
    is_new = np.diff(distinct, prepend=-np.inf) > EQUAL_NUMBERS_TOL * distinct
    return np.cumsum(is_new)[place]


def read_response_table(path: Path) -> Readings:
    """Read the readings from a CSV table of measured responses (`inputs.measured.read_table`).

    Repeated measurements of a condition remain separate readings. Raises PatchfemError if the
    table is invalid.

    Parameters
    ----------
    path : Path
        CSV file.

    Returns
    -------
    Readings
        A row with both acceleration and displacement has two readings.
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

        # a row has an acceleration, a displacement or both
        for value, is_felt in ((row.acceleration, True), (row.displacement, False)):
            if value is not None:
                row_numbers.append(k)
                felt.append(is_felt)
                measured.append(value)
    if not row_numbers:
        raise PatchfemError(
            f"{path}: no row has an acceleration or a displacement, so nothing can be fitted; "
            "fill in one of the two columns"
        )

    # inputs that differ only by the round-off of a unit conversion are one condition
    inputs = np.array([(rows[k].frequency, rows[k].input) for k in row_numbers])
    numbers = np.transpose([_number_values(column) for column in inputs.T])
    _, first, condition = np.unique(numbers, axis=0, return_index=True, return_inverse=True)
    return Readings(
        path=Path(path),
        rows=rows,
        row=frozen_array(row_numbers, np.int64),
        is_acceleration=frozen_array(felt, bool),
        measured=frozen_array(measured),
        unstable=frozen_array(["U" in rows[k].flag for k in row_numbers], bool),
        conditions=frozen_array(inputs[first]),
        condition=frozen_array(condition.ravel(), np.int64),
    )


def compute_rms_scores(readings: Readings, log_ratios, selected) -> dict | None:
    """Return the root mean square of ln(computed/measured) of selected readings, by kind of reading.

    Parameters
    ----------
    readings : Readings
        Readings of a table of measured responses.
    log_ratios : (n,) array
        ln(computed/measured).
    selected : (n,) bool
        Mask of the selected readings.

    Returns
    -------
    dict or None
        Scores of "acceleration", "displacement" and "all" readings. A score is None if there is no
        such reading or if one of them was not predicted (NaN). None if no reading is selected.
    """
    if not np.any(selected):
        return None
    kinds = {
        "acceleration": readings.is_acceleration,
        "displacement": ~readings.is_acceleration,
        "all": True,
    }
    out: dict[str, float | None] = {}
    for name, is_of_kind in kinds.items():
        selected_logs = log_ratios[is_of_kind & selected]
        is_known = selected_logs.size and not np.isnan(selected_logs).any()
        out[name] = np.sqrt(np.mean(selected_logs**2)) if is_known else None
    return out
