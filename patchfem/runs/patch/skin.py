"""Asperity layer (skin) with a smooth law between the pieces of a patch: law and solution.

In: a `PatchModel` with a skin. Out: the skin law, the pressure through it, the compliance
linearised at the operating point, and a note on the stiffness of peaks from a profile.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...contact import asperity_laws
from ...contact.edges import MIN_RELATIVE_PRESSURE
from ...contact.strip_compliance import StripCompliance
from ...contact.strips import HolderLoads, StripLayout, StripModel, press_strips
from ...core import Compliance, ContactState, PatchfemError, frozen_array
from ...formatting import format_length, format_quantity
from ...model import peaks as traces
from ...surface.roughness import peaks


def skin_law(patch_model):
    """Return the smooth pressure law of the asperity layer of a patch."""
    part = patch_model.interface.skin
    if part.law == "exponential":
        pressure = (
            part.normal_stiffness * part.decay_length if part.normal_stiffness is not None else None
        )
        return asperity_laws.ExponentialAsperities(part.decay_length, pressure)
    faces = [
        piece.coating.material if piece.coating else piece.substrate
        for piece in (patch_model.pieces.lower, patch_model.pieces.upper)
    ]
    modulus = 1 / sum((1 - face.poisson**2) / face.young for face in faces)
    return asperity_laws.HertzAsperities(part.radius, part.density, part.height_deviation, modulus)


def mean_stiffness(patch_model, pressure: float) -> float:
    """Return the normal stiffness [Pa/m] of the asperity layer under a uniform `pressure` [Pa].

    It is 0 for a smooth skin without pressure.
    """
    if patch_model.interface.skin.law == "linear":
        return patch_model.interface.skin.normal_stiffness
    law = skin_law(patch_model)
    if isinstance(law, asperity_laws.ExponentialAsperities):
        return pressure / law.u0
    return float(law.stiffness(law.separation(np.array([pressure])))[0]) if pressure > 0 else 0.0


def note_on_peak_stiffness(patch_model, pressure: float) -> list:
    """Return a sentence, as a list, on how reliable the stiffness of peaks from a profile is.

    Also for peaks from root mean squares; [] for any other skin. pressure: mean pressure [Pa].
    """
    part = patch_model.interface.skin
    if part is None or part.law != "hertz" or part.rms_height is None or not pressure > 0:
        return []
    soft, stiff = peaks.persson_stiffness(pressure, part.rms_height)
    half = ""
    told = []
    waves = f" of the waves below {format_quantity(part.cutoff, 'm', 3)}" if part.cutoff else ""
    if part.from_ is not None:
        found = traces.read_spectral_moments(Path(part.from_), part.cutoff)
        half = f" (from every second sample: {_half(patch_model, found.coarse, pressure)})"
        told = [f"contact.asperities: {one}" for one in (*found.dust, found.not_gaussian) if one]
    elif patch_model.gap.profile is not None and part.cutoff is None:
        told = [
            "contact.asperities.rms_height: the profile already contains all waves longer than "
            f"{format_length(2 * patch_model.gap.average)}; if rms_height comes from the same trace as the profile, give the rms "
            "values of the shorter waves only (patchfem profile --cutoff prints them)"
        ]
    return [
        f"contact.asperities: under the mean pressure of {format_quantity(pressure, 'Pa', 3)} the peaks{waves} have "
        f"a stiffness of {mean_stiffness(patch_model, pressure):.3g} Pa/m{half}; Persson's theory, which includes waves "
        "of all lengths, "
        f'gives {soft:.3g} to {stiff:.3g} Pa/m; to use the stiffness of that theory, set law = "exponential" and '
        f'decay_length = "{sum(peaks.PERSSON) / 2 * part.rms_height * 1e6:.3g} um"',
        *told,
    ]


def _half(patch_model, coarse, pressure: float) -> str:
    """Return the stiffness of the peaks from every second sample of the profile, as text."""
    try:
        one = peaks.gaussian_peaks(coarse) if coarse else None
    except PatchfemError:
        one = None
    if one is None:
        return "no surface of such peaks"
    new = {"radius": one.radius, "density": one.density, "height_deviation": one.deviation}
    interface = replace(
        patch_model.interface, skin=patch_model.interface.skin.model_copy(update=new)
    )
    return f"{mean_stiffness(replace(patch_model, interface=interface), pressure):.3g} Pa/m"


def cut_off_pressure(pressure) -> np.ndarray:
    """Return the pressure (..., m) [Pa] of a smooth layer, with 0 below MIN_RELATIVE_PRESSURE.

    The law never reaches 0, but the pressure that is cut off is below the residual of the load
    balance, and underflows farther out. The limit is relative to the largest pressure.
    """
    return np.where(pressure > MIN_RELATIVE_PRESSURE * pressure.max(), pressure, 0.0)


def press_through_asperities(
    patch_model, pieces: Compliance, gap, angle: float, moment, spring: float
) -> tuple:
    """Solve the contact of a pair through an asperity layer with a smooth law.

    The gap of the ContactState is the separation of the mean planes, which is negative if the skin
    is crushed.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
    gap : (m,)
        Unloaded gap [m].
    angle : float
        Initial rotation [rad].
    moment : float or None
        Moment [N m]; None if the rotation is fixed.
    spring : float
        Rotational stiffness of the holder [N m/rad].

    Returns
    -------
    tuple
        Compliance with the skin linearised at the operating point, ContactState, and StripsState of
        a single strip.
    """
    interface = pieces.interface
    by = patch_model.loading.approach
    loads = HolderLoads()
    if by is None:
        loads = HolderLoads(patch_model.loading.load, moment, spring=spring)
    layout = StripLayout(interface.x, interface.weight, np.zeros(1))
    strips = StripModel(StripCompliance(pieces.normal), layout, skin_law(patch_model))
    state = press_strips(strips, gap, loads, approach=by, rotation=angle)
    answer = ContactState(
        frozen_array(cut_off_pressure(state.pressure[0])),
        state.gap[0],
        state.delta,
        state.theta,
        state.load,
        state.moment,
        state.outcome,
        state.iterations,
        state.residuals,
    )
    stiff = np.maximum(state.stiffness[0] * interface.weight, 1e-300)
    # the lower bound keeps the compliance of unloaded nodes finite
    crush = np.diag(1 / np.maximum(stiff, MIN_RELATIVE_PRESSURE * stiff.max()))
    ratio = patch_model.interface.skin.tangential_ratio
    tangential = pieces.tangential + crush / ratio if ratio is not None else pieces.tangential
    return (
        Compliance(interface, frozen_array(pieces.normal + crush), frozen_array(tangential)),
        answer,
        state,
    )
