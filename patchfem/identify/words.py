"""Sentences on what a fit did not determine, with the names of the values."""

import numpy as np

from ..core import Outcome
from .least_squares import MOST, Fit


def remarks(found: Fit, names) -> list:
    """Sentences on what a fit leaves open, by the names (n,) of its values.

    One each for a value on a bound, without effect, known only in a combination, or open to a bound, one for
    evaluations that failed, and one for a fit that did not converge.
    """
    out = [
        f"{names[i]} is at its {side} bound {found.values[i]:.6g}: widen the range, or try another law"
        for i, side in enumerate(found.at_bound)
        if side
    ]
    told = {i for row in found.unknown for i in np.flatnonzero(row)}
    out += [_combination(row, names) for row in found.unknown]
    for i, name in enumerate(names):
        if np.isfinite(found.intervals[i]).all():
            if found.open_ends[i].any() and not found.at_bound[i]:
                side = "low" if found.open_ends[i, 0] else "high"
                out.append(f"{name}: the data do not exclude its {side} bound")
        elif found.sensitivity[i] <= 1e-9 * max(float(np.max(found.sensitivity)), found.rms):
            out.append(f"{name} has no effect on the computed data, so its value is not determined")
        elif i not in told:
            out.append(
                f"{name} is not determined: its interval of 95 % reaches both ends of its range"
            )
    if found.failures:
        out.append(
            f"{found.failures} of {found.evaluations} evaluations failed and were skipped; the first failed "
            f"because: {found.reason}"
        )
    if found.outcome is Outcome.NOT_CONVERGED:
        out.append(
            f"not converged: the best search did not settle within {MOST} evaluations, and no search from "
            "another start ended within 1 % of the best score"
        )
    return out


def _combination(row, names) -> str:
    used = np.flatnonzero(row)
    changes = ", ".join(f"{names[i]} by {row[i]:+.3g} %" for i in used)
    known = ""
    if used.size == 2 and abs(abs(row[used[0]]) - abs(row[used[1]])) < 2e-3:
        known = f": only their {'product' if row[used[0]] * row[used[1]] < 0 else 'ratio'} is known"
    return (
        f"{' and '.join(names[i] for i in used)} cannot be determined separately (changing {changes} together has "
        f"no effect){known}"
    )
