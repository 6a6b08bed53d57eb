"""Asperities of a measured surface as a table [contact.asperities] to paste into a scene."""

import numpy as np

from ...contact.asperity_laws import HertzAsperities
from ...core import PatchfemError
from ...formatting import format_length, format_quantity
from ...surface.roughness.peaks import (
    PERSSON,
    Peaks,
    TraceMoments,
    gaussian_peaks,
    persson_stiffness,
)

# Pressure at which stiffnesses are stated, relative to the combined modulus; 1.2 MPa for steel.
PRESSURE_FRACTION = 1e-5


def asperity_data(moments: TraceMoments | None, cutoff: float | None) -> dict | None:
    """Return the spectral moments of a trace and its asperities as a dict, in SI units.

    The result is None for a flat trace.

    `stiffness` is the ratio of stiffness to pressure [1/m], and `stiffness_half_sampled` the same
    from every second sample. If no surface has such moments, `reason` replaces them.

    Parameters
    ----------
    moments : TraceMoments or None
    cutoff : float or None
        Largest wavelength that counts [m]; None for all.
    """
    if moments is None:
        return None
    out = {"cutoff": cutoff}
    for name, value in moments.fine._asdict().items():
        out[f"rms_{name}"] = value
    try:
        peaks = gaussian_peaks(moments.fine)
    except PatchfemError as error:
        return out | {"reason": str(error)}
    notes = [*moments.dust, *([moments.not_gaussian] if moments.not_gaussian else [])]
    out |= {"radius": peaks.radius, "density": peaks.density, "height_deviation": peaks.deviation}
    out |= {"stiffness": _stiffness_ratio(peaks), "notes": notes, "stiffness_half_sampled": None}
    if moments.coarse is not None:
        try:
            out["stiffness_half_sampled"] = _stiffness_ratio(gaussian_peaks(moments.coarse))
        except PatchfemError:
            pass  # the value stays None if no surface fits every second sample
    return out


def format_asperities(moments: TraceMoments | None, cutoff: float | None) -> list:
    """Return the asperities of a trace as lines of text, with a table to paste into a scene."""
    data = asperity_data(moments, cutoff)
    if data is None:
        return []
    if "reason" in data:
        return [f"  the trace gives no table [contact.asperities]: {data['reason']}"]
    fine = moments.fine
    soft, stiff = persson_stiffness(1.0, fine.height)
    decay = sum(PERSSON) / 2 * fine.height
    half = data["stiffness_half_sampled"]
    if half is None:
        sampled = (
            "with every second sample of the trace, height, slope and curvature do not fit any "
            "Greenwood-Williamson surface"
        )
    else:
        change = 100 * (half / data["stiffness"] - 1)
        sampled = (
            f"with every second sample of the trace the ratio is {_per_um(half)}, "
            f"a change of {change:+.2g} %"
        )
    out = [
        "  paste this into a scene if the other face is smooth (Greenwood-Williamson: peaks of "
        f"radius {format_quantity(data['radius'], 'm', 3)}, {1e-6 * data['density']:.3g} of them per mm^2):",
        "    [contact.asperities]",
        '    law = "hertz"',
        f'    rms_height = "{fine.height * 1e6:.5g} um"',
        f"    rms_slope = {fine.slope:.5g}",
        f'    rms_curvature = "{fine.curvature:.5g} 1/m"',
    ]
    if cutoff:
        out.append(f'    cutoff = "{format_length(cutoff)}"')
    out += [
        f"  At a pressure of {PRESSURE_FRACTION:g} of the combined modulus the ratio of stiffness "
        f"to pressure is {_per_um(data['stiffness'])}; {sampled}. Waves shorter than two samples "
        "are not included.",
        f"  Persson's theory, which includes waves of all lengths, gives {_per_um(soft)} to "
        f"{_per_um(stiff)}, as does "
        f'law = "exponential" with decay_length = "{decay * 1e6:.3g} um".',
        f"  {_describe_split(cutoff)}",
    ]
    out += [f"  In this table {text}." for text in moments.dust]
    return out + ([f"  Not Gaussian: {moments.not_gaussian}."] if moments.not_gaussian else [])


def _describe_split(cutoff: float | None) -> str:
    """Describe which waves of a trace are represented by its table of asperities."""
    if cutoff is None:
        return (
            "This table describes all waves of the trace. If [contact.profile] takes the same "
            "trace, split the trace with --cutoff; otherwise the long waves count twice."
        )
    return (
        f"This table describes only waves below the cut-off of {format_length(cutoff)}. If [contact.profile] "
        "takes the same trace, the gap follows the longer waves, so that no wave counts twice."
    )


def _stiffness_ratio(peaks: Peaks) -> float:
    """Compute the contact stiffness of asperities divided by the pressure [1/m].

    The pressure is PRESSURE_FRACTION of the combined modulus.
    """
    law = HertzAsperities(*peaks, 1.0)
    separation = law.separation(np.array([PRESSURE_FRACTION]))
    return float(law.stiffness(separation)[0] / PRESSURE_FRACTION)


def _per_um(value: float) -> str:
    """Format a value [1/m] in 1/um."""
    return f"{value * 1e-6:.3g} 1/um"
