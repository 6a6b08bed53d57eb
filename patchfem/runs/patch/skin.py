"""Asperity layer (skin) between the pieces of a patch.

In: a `PatchModel` with a skin. Out: its pressure law, and a note on asperity stiffnesses that come from a profile.
"""

from pathlib import Path

import numpy as np

from ... import surface
from ...contact import asperity_laws
from ...formatting import format_length, format_quantity
from ...model import peaks as traces


def make_skin_law(patch_model, pressure: float):
    """Return the smooth law of pressure against separation of the asperity layer of a patch.

    The separations of an exponential law without a stiffness are measured from that under the mean `pressure` [Pa].
    """
    skin = patch_model.interface.skin
    if skin.law == "exponential":
        if skin.normal_stiffness is not None:
            pressure = skin.normal_stiffness * skin.decay_length
        return asperity_laws.ExponentialAsperities(skin.decay_length, pressure)
    return asperity_laws.HertzAsperities(
        skin.radius, skin.density, skin.height_deviation, patch_model.pieces.surface_modulus
    )


def asperity_layer_stiffness(patch_model, pressure: float) -> float:
    """Return the normal stiffness [Pa/m] of the asperity layer under a uniform pressure [Pa].

    It is 0 for a nonlinear law without pressure.
    """
    skin = patch_model.interface.skin
    if skin.law == "linear":
        return skin.normal_stiffness
    if not pressure > 0:
        return 0.0
    law = make_skin_law(patch_model, pressure)
    return float(law.stiffness(law.separation(np.array([pressure])))[0])


def note_on_asperity_stiffness(patch_model, pressure: float) -> list[str]:
    """Return a list with a note on how reliable the stiffness of Hertzian asperities is.

    The list is empty unless the asperities come from a profile or from rms values. pressure: mean
    pressure [Pa].
    """
    skin = patch_model.interface.skin
    if skin is None or skin.law != "hertz" or skin.rms_height is None or not pressure > 0:
        return []

    # Persson: stiffness = pressure / u_0, with u_0 = 0.4 to 0.5 of the rms height.
    soft, stiff = surface.roughness.peaks.persson_stiffness(pressure, skin.rms_height)

    # Dust and heights that are not Gaussian make the peaks of a trace uncertain.
    remarks = []
    waves = f" of the waves below {format_quantity(skin.cutoff, 'm', 3)}" if skin.cutoff else ""
    if skin.from_ is not None:
        moments = traces.read_spectral_moments(Path(skin.from_), skin.cutoff)
        texts = (*moments.dust, moments.not_gaussian)
        remarks = [f"contact.asperities: {text}" for text in texts if text]
    # Waves that the profile contains must not count again in the layer.
    elif patch_model.gap.profile is not None and skin.cutoff is None:
        remarks = [
            "contact.asperities.rms_height: the profile already contains all waves longer than "
            f"{format_length(2 * patch_model.gap.average)}; if rms_height comes from the same trace as the "
            "profile, give the rms values of the shorter waves only (patchfem profile --cutoff prints them)"
        ]
    return [
        f"contact.asperities: under the mean pressure of {format_quantity(pressure, 'Pa', 3)} the peaks{waves} have "
        f"a stiffness of {asperity_layer_stiffness(patch_model, pressure):.3g} Pa/m; Persson's theory, which includes "
        "waves of all lengths, "
        f'gives {soft:.3g} to {stiff:.3g} Pa/m; to use the stiffness of that theory, set law = "exponential" and '
        f'decay_length = "{sum(surface.roughness.peaks.DECAY_LENGTH_OVER_RMS_HEIGHT) / 2 * skin.rms_height * 1e6:.3g} um"',
        *remarks,
    ]
