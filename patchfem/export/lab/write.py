"""Histories of a results folder as a laboratory file, whose suffix chooses the format."""

from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import write_atomically
from ...formatting import format_quantity
from ...structure.drive_sizes import MAX_STORED_SAMPLES, MIN_SAMPLES_PER_CYCLE
from . import ENDINGS, matlab, modes, table, universal
from .series import read_histories

# Smallest number of rows between two reversals if all samples are stored; fewer rows show
# that only reversals are stored.
MIN_ROWS_PER_SWING = 5
# Unit of each column of a decay, by the name of the variable without its prefix "decay_".
DECAY = {
    "time": "s",
    "amplitude": "m",
    "frequency": "Hz",
    "frequency_error": "Hz",
    "damping": "1",
    "damping_error": "1",
}


def export_histories(folder: Path, out: Path) -> str:
    """Write the histories and loops of a results folder, and return a line of text about the file.

    PatchfemError for another suffix and for a folder without histories; Missing if it does not
    exist or `out` cannot be written.
    """
    out = Path(out)
    if out.suffix.lower() not in ENDINGS:
        raise PatchfemError(f"{out}: histories are exported as {', '.join(ENDINGS)}")
    histories = read_histories(folder)
    rows = histories.columns[0].values.size
    summary = (
        f"{out}: {rows} rows of {', '.join(column.label for column in histories.columns[:8])}"
        + (f" and {len(histories.columns) - 8} more" if len(histories.columns) > 8 else "")
    )
    summary += _thinning_note(histories)
    with write_atomically(out) as partial:
        if out.suffix.lower() == ".mat":
            matlab.write_arrays(partial, histories)
        elif out.suffix.lower() == ".csv":
            table.write_columns(partial, histories.time, histories.columns)
        else:
            universal.write_histories(partial, histories)
            summary += f"; {len(histories.loops())} loops"
    return summary


def _thinning_note(histories) -> str:
    """Return a note that only the reversals of early histories are stored, or "" if all samples are stored."""
    displacement = next(
        (column.values for column in histories.columns if column.name.endswith("displacement")),
        None,
    )
    if displacement is None or histories.time is None:
        return ""
    reversals = np.flatnonzero(np.diff(np.sign(np.diff(displacement))) != 0) + 1
    thinned = np.flatnonzero(np.diff(reversals) < MIN_ROWS_PER_SWING)
    if thinned.size < MIN_ROWS_PER_SWING or thinned.size < (thinned[-1] + 1) / 2:
        return ""
    first_even = format_quantity(float(histories.time[reversals[thinned[-1] + 1]]), "s", 3)
    return (
        f"; before {first_even} the rows are turning points, stops and starts of slip alone: a release of up to "
        f"{MAX_STORED_SAMPLES // MIN_SAMPLES_PER_CYCLE} cycles (drive.cycles) has even rows all along, any other run "
        "in its last cycles"
    )


def write_table(out: Path, values: dict, units: dict) -> None:
    """Write arrays of equal length as CSV with their units.

    Parameters
    ----------
    out : Path
    values : dict
        {name: (k,) array}
    units : dict
        {name: unit}

    Raises
    ------
    Missing
        If `out` cannot be written.
    """
    columns = [table.Column(name, units[name], column, 0) for name, column in values.items()]
    with write_atomically(out) as partial:
        table.write_columns(partial, None, columns)


def write_response(out: Path, estimate, drive: str, response: str) -> None:
    """Write a frequency response as a universal file.

    Parameters
    ----------
    out : Path
    estimate : object
        As for `modes.write_response`.
    drive, response : str
        Kinds of input and output.

    Raises
    ------
    Missing
        If `out` cannot be written.
    """
    with write_atomically(out) as partial:
        modes.write_response(partial, estimate, drive, response)
