"""The peaks of a measured surface as a table [contact.asperities] to paste, and how far they can be trusted."""

import numpy as np

from ...contact.skin_laws import HertzSkin
from ...core import PatchfemError, say
from ...scales import short
from ...surface.roughness.peaks import PERSSON, Told, peaks_of

LIGHT = 1e-5  # of the combined modulus, the pressure at which stiffnesses are told: 1.2 MPa on steel


def data_of(told: Told | None, cutoff: float | None) -> dict | None:
    """Root mean squares of the waves of a trace below a cut-off [m] (None: of all) and their peaks in SI, with the
    stiffness over the pressure [1/m] at LIGHT; of every second sample that alone. A reason where no surface has such
    peaks, None of a flat trace."""
    if told is None:
        return None
    out = {"cutoff": cutoff, **{f"rms_{name}": one for name, one in told.fine._asdict().items()}}
    try:
        one = peaks_of(told.fine)
    except PatchfemError as error:
        return out | {"reason": str(error)}
    out |= {"radius": one.radius, "density": one.density, "height_deviation": one.deviation, "stiffness": _steep(one),
            "notes": [*told.walls, *[told.doubt] * bool(told.doubt)]}
    try:
        return out | {"stiffness_half_sampled": None if told.coarse is None else _steep(peaks_of(told.coarse))}
    except PatchfemError:
        return out | {"stiffness_half_sampled": None}


def lines_of(told: Told | None, cutoff: float | None) -> list:
    """`data_of` as lines of text, ready to paste."""
    one = data_of(told, cutoff)
    if one is None:
        return []
    if "reason" in one:
        return [f"  the trace gives no table [contact.asperities]: {one['reason']}"]
    fine = told.fine
    soft, stiff = (1 / (share * fine.height) for share in reversed(PERSSON))
    decay = sum(PERSSON) / 2 * fine.height
    half = one["stiffness_half_sampled"]
    sampled = ("with every second sample of the trace, height, slope and curvature do not fit any Greenwood-Williamson "
               "surface") if half is None else \
        f"with every second sample of the trace the ratio is {_per(half)}, a change of " \
        f"{100 * (half / one['stiffness'] - 1):+.2g} %"
    return ["  paste this into a scene if the other face is smooth (Greenwood-Williamson: peaks of radius "
            f"{short(one['radius'], 'm', 3)}, {1e-6 * one['density']:.3g} of them per mm^2):",
            "    [contact.asperities]", '    law = "hertz"', f'    rms_height = "{fine.height * 1e6:.5g} um"',
            f"    rms_slope = {fine.slope:.5g}", f'    rms_curvature = "{fine.curvature:.5g} 1/m"',
            *([f'    cutoff = "{say(cutoff)}"'] if cutoff else []),
            f"  At a pressure of {LIGHT:g} of the combined modulus the ratio of stiffness to pressure is "
            f"{_per(one['stiffness'])}; {sampled}. Waves shorter than two samples are not included.",
            f"  Persson's theory, which includes waves of all lengths, gives {_per(soft)} to {_per(stiff)}, as does "
            f'law = "exponential" with decay_length = "{decay * 1e6:.3g} um".', f"  {_split(cutoff)}",
            *[f"  In this table {one}." for one in told.walls],
            *([f"  Not Gaussian: {told.doubt}."] if told.doubt else [])]


def _split(cutoff: float | None) -> str:
    """Which waves of a trace its peaks are, and which are left to the profile."""
    if cutoff is None:
        return ("This table describes all waves of the trace. If [contact.profile] takes the same trace, split the "
                "trace with --cutoff; otherwise the long waves count twice.")
    return (f"This table describes only waves below the cut-off of {say(cutoff)}. If [contact.profile] takes the same "
            "trace, the gap follows the longer waves, so that no wave counts twice.")


def _steep(one) -> float:
    """Stiffness over pressure [1/m] of peaks under LIGHT of their modulus."""
    law = HertzSkin(*one, 1.0)
    return float(law.stiffness(law.separation(np.array([LIGHT])))[0] / LIGHT)


def _per(value: float) -> str:
    """A number per length as text."""
    return f"{value * 1e-6:.3g} 1/um"
