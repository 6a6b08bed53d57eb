"""Advice on a further test: which one would narrow the widest interval of a fit most."""

from collections.abc import Sequence

import numpy as np

from .least_squares import Fit

# Smallest decrease of an interval for which a further test is advised
MIN_INTERVAL_DECREASE_FRACTION = 0.1


def advise_test(
    fit: Fit, names: Sequence[str], information: np.ndarray, places: Sequence[str]
) -> str:
    """Return a sentence on the test that would narrow the widest interval most; "" if the gain is small.

    A test whose readings have the gradients G changes the covariance C of the parameters to (C^-1 + G^T G)^-1.

    Parameters
    ----------
    fit : Fit
        Fit of the present tests.
    names : sequence of str
        Names of the n parameters.
    information : (m, n, n) array
        G^T G of each possible test: G is the change of its readings, in standard deviations of their errors, per standard
        deviation of each parameter.
    places : sequence of str
        Words for the m tests, such as "at 143 Hz".
    """
    correlation = fit.intervals.correlation
    determined = np.flatnonzero(np.isfinite(np.diag(correlation)))
    if not determined.size or not len(places):
        return ""
    # in standard deviations of the parameters, the covariance is their correlation
    block = np.ix_(determined, determined)
    before = np.linalg.pinv(correlation[block])
    after = np.linalg.pinv(before + np.nan_to_num(information)[:, determined][:, :, determined])
    sizes = np.ptp(fit.intervals.ends, axis=1) / np.maximum(np.abs(fit.values), 1e-300)
    widest = int(np.argmax(sizes[determined]))
    ratio = np.sqrt(after[:, widest, widest])
    best = int(np.argmin(ratio))
    if ratio[best] > 1 - MIN_INTERVAL_DECREASE_FRACTION:
        return ""
    return (
        f"a further measurement {places[best]} would narrow the interval of {names[determined[widest]]} most, by about "
        f"{100 * (1 - ratio[best]):.0f} %"
    )
