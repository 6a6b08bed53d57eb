"""Sentences about parameters that a fit does not determine, failures of its search, and a further test."""

from collections.abc import Sequence

import numpy as np

from ..core import Outcome
from .descent import MAX_DESCENT_EVALUATIONS
from .least_squares import Fit


def describe_fit(fit: Fit, names: Sequence[str], bounds: Sequence[tuple[str, str]]) -> list[str]:
    """Return sentences about parameters that a fit does not determine, and failures of its search.

    The sentences report parameters that are at a bound, without effect, determined only in combination with
    others, or whose interval reaches a bound. They also report failed evaluations and a lack of convergence.

    Parameters
    ----------
    fit : Fit
        Best fit, with its intervals.
    names : sequence of str
        Names (n,) of the parameters.
    bounds : sequence of (str, str)
        Low and high bound (n,) of each parameter with its unit.

    Returns
    -------
    list of str
    """
    sentences = []
    for name, side, (low, high) in zip(names, fit.at_bound, bounds):
        if side:
            sentences.append(
                f"{name} is at its {side} bound {low if side == 'low' else high}: widen the range, or try another law"
            )

    # Parameters in an undetermined combination are reported with it, not one by one.
    intervals = fit.intervals
    sentences += [_describe_direction(row, names) for row in intervals.unknown]
    in_combination = intervals.unknown.any(axis=0)
    # Smallest sensitivity of a parameter with an effect on the residual, relative to the largest sensitivity.
    min_sensitivity = 1e-9 * max(np.max(intervals.sensitivity), fit.rms)

    # An interval that ends at a bound, no effect on the data, or an interval over the whole range.
    for i, name in enumerate(names):
        if np.isfinite(intervals.ends[i]).all():
            if intervals.open_ends[i].any() and not fit.at_bound[i]:
                side = int(intervals.open_ends[i, 1])
                sentences.append(
                    f"{name}: the data do not exclude its {('low', 'high')[side]} bound {bounds[i][side]}, at which its "
                    "interval ends: widen the range"
                )
        elif intervals.sensitivity[i] <= min_sensitivity:
            sentences.append(
                f"{name} has no effect on the computed data, so its value is not determined"
            )
        elif not in_combination[i]:
            sentences.append(
                f"{name} is not determined: its interval of 95 % reaches both ends of its range; widen it, or set the value "
                "in the scene and do not fit it"
            )

    if fit.counts.failures:
        sentences.append(
            f"{fit.counts.failures} of {fit.counts.evaluations} evaluations failed and were skipped; the first "
            f"failed because: {fit.counts.reason}"
        )

    if fit.outcome is Outcome.NOT_CONVERGED:
        sentences.append(
            f"not converged: the best search did not settle within {MAX_DESCENT_EVALUATIONS} evaluations, and no search "
            "from another start ended within 1 % of the best score"
        )
    return sentences


def _describe_direction(row, names) -> str:
    """Return a sentence about a direction in parameter space in which the residual is constant.

    `row` (n,) is the relative change of each parameter [%].
    """
    involved = np.flatnonzero(row)
    changes = ", ".join(f"{names[i]} by {row[i]:+.3g} %" for i in involved)
    known_combination = ""
    if involved.size == 2:
        first, second = row[involved]
        if abs(abs(first) - abs(second)) < 2e-3:
            known_combination = (
                f": only their {'product' if first * second < 0 else 'ratio'} is known"
            )
    return (
        f"{' and '.join(names[i] for i in involved)} cannot be determined separately (changing {changes} together has "
        f"no effect){known_combination}"
    )


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
    # Smallest decrease of an interval for which a further test is advised
    if ratio[best] > 1 - 0.1:
        return ""
    return (
        f"a further measurement {places[best]} would narrow the interval of {names[determined[widest]]} most, by about "
        f"{100 * (1 - ratio[best]):.0f} %"
    )
