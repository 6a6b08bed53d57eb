"""Parameters of evenly sampled heights: ISO 21920-2 of profiles, ISO 13565-2 of the Abbott curve.

Heights are measured from the mean line or surface. A parameter that the heights do not determine is
None.
"""

import numpy as np

from ..quantity import read_definitions

# Smallest number of samples in a trace; fewer give neither a spectrum nor a curvature.
MIN_TRACE_SAMPLES = 16
# Largest heights of a straight line after levelling, relative to those before
HEIGHT_ROUND_OFF = 1e-12
MIN_SECTIONS = 5  # smallest number of sections whose scatter gives intervals
# Parameters without an interval: extremes and high moments of a whole trace depend on single heights, so that the
# scatter of sections does not show their errors.
PARAMETERS_WITHOUT_INTERVAL = ("t", "sk", "ku")

# Unit and definition of each parameter of a trace, by name
PROFILE_DEFINITIONS = read_definitions("profile")
# Unit and definition of each amplitude of waves, by name
WAVES_DEFINITIONS = read_definitions("waves")


def compute_parameters(z, step: float, section: float | None = None) -> dict[str, float | None]:
    """Compute the parameters of a profile, by the names in PROFILE_DEFINITIONS.

    Parameters
    ----------
    z : (n,) array [m]
        Heights.
    step : float
        Sampling interval [m].
    section : float, optional
        Length [m] over which peaks and valleys are sought, which is the cut-off; by default the whole
        trace. Sections that do not lie wholly in the trace are left out.
    """
    size = z.size if section is None else round(section / step)
    sections = z[: z.size // size * size].reshape(-1, size)
    values = dict.fromkeys(PROFILE_DEFINITIONS) | compute_moments(z) | compute_core(z)
    if len(sections):
        peaks = sections.max(axis=1)
        valleys = sections.min(axis=1)
        values |= {"p": float(peaks.mean()), "v": float(-valleys.mean())}
        values["z"] = float((peaks - valleys).mean())
    values["t"] = float(np.ptp(z))
    values["dq"] = float(np.sqrt(np.mean(np.diff(z) ** 2)) / step)
    rough = values["t"] if values["z"] is None else values["z"]
    return values | {"Sm": _compute_element_length(z, step, rough, section or 0.0)}


def compute_moments(z) -> dict[str, float | None]:
    """Compute mean, root mean square [m], skewness and kurtosis [1] of heights z (n,) [m].

    The keys are "a", "q", "sk" and "ku", as in Ra. "a" is the mean of the absolute heights.
    """
    rms = np.sqrt(np.mean(z**2))
    out = {"a": float(np.abs(z).mean()), "q": float(rms), "sk": None, "ku": None}
    if rms > 0:
        out |= {"sk": float(np.mean((z / rms) ** 3)), "ku": float(np.mean((z / rms) ** 4))}
    return out


def _compute_element_length(z, step: float, rough: float, section: float) -> float | None:
    """Compute Sm, the mean length of the profile elements [m], or None if the trace contains no whole element.

    An element reaches from a rise through the mean line to the next rise, or from a fall to the next
    fall. Hills and dales that are too low or too narrow are left out, and neighbours of one sign between which
    others are left out are one hill or dale.

    Parameters
    ----------
    z : (n,) array
        Heights above the mean line [m].
    step : float
        Sampling interval [m].
    rough : float
        Rz [m], of which a hill or dale must have a tenth.
    section : float
        Length of a section [m], of which a hill or dale must have a hundredth.
    """
    above = z > 0
    starts = np.flatnonzero(above[1:] != above[:-1])  # the last sample before each crossing
    if not starts.size:
        return None
    places = (starts + z[starts] / (z[starts] - z[starts + 1])) * step
    first = np.append(0, starts + 1)
    extent = np.maximum.reduceat(np.abs(z), first)
    width = np.diff(places, prepend=-np.inf, append=np.inf)  # the ends of the trace cut two off
    is_kept = (extent >= 0.10 * rough) & (width >= 0.01 * section)
    kept_indices = np.flatnonzero(is_kept)
    # A hill or dale begins at the crossing before it.
    ends = places[kept_indices[1:][np.diff(above[first[kept_indices]])] - 1]
    return float((ends[2:] - ends[:-2]).mean()) if ends.size > 2 else None


def compute_core(z) -> dict[str, float | None]:
    """Compute Rk, Rpk, Rvk, Mr1 and Mr2 from the Abbott curve of heights z (n,) [m] (ISO 13565-2).

    The core is the least-squares line of that 40 % of the curve whose secant falls least. The second
    filter stage of ISO 13565-1 is not used.
    """
    z = np.sort(z)[::-1]
    n = z.size
    if n < 5 or z[0] == z[-1]:
        return dict.fromkeys(("k", "pk", "vk", "Mr1", "Mr2"))

    # The flattest 40 % of the curve, and the line through it.
    # Fraction of the length under the secant of the core (ISO 13565-2)
    size = max(round(0.40 * n), 2)
    start = int(np.argmin(z[: n - size + 1] - z[size - 1 :]))
    part = z[start : start + size]
    ratio = (np.arange(start, start + size) + 0.5) / n
    slope, top = np.polyfit(ratio, part, 1).tolist()
    bottom = top + slope

    # What is above and below the core becomes triangles of the same area.
    levels = np.array((top, bottom))
    first, second = np.interp(-levels, -z, (np.arange(n) + 0.5) / n, 0.0, 1.0).tolist()
    peaks = 2 * float(np.maximum(z - top, 0.0).sum()) / n
    valleys = 2 * float(np.maximum(bottom - z, 0.0).sum()) / n
    return {
        "k": -slope,
        "pk": peaks / first if first > 0 else 0.0,
        "vk": valleys / (1 - second) if second < 1 else 0.0,
        "Mr1": first,
        "Mr2": second,
    }


def abbott_curve(z, count: int = 501) -> tuple[np.ndarray, np.ndarray]:
    """Compute the Abbott curve of heights z [m]: material ratio (count,) from 0 to 1, and height [m]."""
    ratio = np.linspace(0.0, 1.0, count)
    return ratio, np.interp(ratio, (np.arange(z.size) + 0.5) / z.size, np.sort(z)[::-1])


def estimate_errors(z, step: float, section: float) -> dict[str, float]:
    """Estimate the standard errors of the roughness parameters by the jackknife over sections.

    The heights z (n,) [m] lie at equal steps `step` [m], and `section` [m] is the length of a section, one cut-off.
    Errors are by name, in the units of the parameters, or {} for fewer than MIN_SECTIONS sections.
    """
    size = round(section / step)
    count = z.size // size
    if count < MIN_SECTIONS:
        return {}
    sections = z[: count * size].reshape(count, size)
    remainders = [
        compute_parameters(np.delete(sections, k, 0).ravel(), step, section) for k in range(count)
    ]
    errors = {}
    for name in PROFILE_DEFINITIONS:
        values = [values[name] for values in remainders]
        if None not in values and name not in PARAMETERS_WITHOUT_INTERVAL:
            errors[name] = float(np.sqrt((count - 1) * np.var(values)))
    return errors
