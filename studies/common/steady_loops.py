"""Records of a steady friction loop, which a fit can follow from rest: the whole cycles come first once more."""

from pathlib import Path

import numpy as np

HEAD = "time [s],displacement [m],force [N],cycle"
HOLD = "cycle=0"  # selects the rows that are computed but not fitted
POSITION_TOL = 1e-6  # difference of equal positions, relative to the range of the displacement


def write_with_run_in(path: Path, time, displacement, force) -> int:
    """Write a record (k,) [s, m, N] after a copy of its whole cycles, labelled as cycle 0; return their number of rows.

    The cycles end at the last passage of the first displacement in the initial direction.
    """
    slide = displacement - displacement[0]
    slide = slide * np.sign(slide[np.flatnonzero(slide)[0]])
    is_behind = slide < -POSITION_TOL * np.ptp(slide)
    count = int(np.flatnonzero(is_behind[:-1] & ~is_behind[1:])[-1]) + 1

    # the record begins when the displacement returns to its first value
    part = -slide[count - 1] / (slide[count] - slide[count - 1])
    begin = time[count - 1] + part * (time[count] - time[count - 1]) - time[0]
    times = np.concatenate([time[:count] - time[0], time - time[0] + begin])
    columns = [np.concatenate([values[:count], values]) for values in (displacement, force)]
    cycle = np.arange(times.size) >= count
    rows = np.column_stack([times, *columns, cycle])
    np.savetxt(path, rows, "%.17g", ",", header=HEAD, comments="")
    return count
