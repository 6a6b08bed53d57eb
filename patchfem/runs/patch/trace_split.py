"""Split of a measured trace into waves for the mesh and waves for an asperity layer.

In: a `PatchModel` with a profile that its elements do not resolve. Out: the wavelength that divides
the trace, and two tables of a scene. The mesh keeps a wave if the contact on it is at least one
element long (Westergaard's solution under the mean pressure). All shorter waves become an asperity
layer with the stiffness of Persson's theory. Read `split_trace` first.
"""

import json
from dataclasses import dataclass
from math import sqrt

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length, format_quantity
from ...model import profile
from ...surface.profile import Profile
from ...surface.roughness.peaks import DECAY_LENGTH_OVER_RMS_HEIGHT, trace_moments
from ...surface.spectrum import ELEMENTS_PER_CURVED_WAVE, NEGLIGIBLE_LOST_FRACTION, wave_spectrum

PROFILE_KEY = "contact.profile.file"


@dataclass(frozen=True)
class TraceSplit:
    """Cutoff wavelength of a split trace, and the asperity layer of the shorter waves.

    - cutoff: cutoff wavelength [m]; longer waves belong to the gap.
    - decay_length: decay length of the layer [m].
    - closing_pressure: mean pressure [Pa] that flattens the shorter waves completely.
    - element: length of the elements [m] along the interface.
    - pressure: mean pressure under the load [Pa].
    - tables: text of the tables [contact.profile] and [contact.asperities].
    """

    cutoff: float
    decay_length: float
    closing_pressure: float
    element: float
    pressure: float
    tables: str

    def describe_split(
        self, *, is_cutoff_given: bool = False, is_scene_written: bool = False
    ) -> str:
        """Return a multi-line summary of the trace split, its validity and its scene tables."""
        cutoff = format_length(self.cutoff)
        reason = (
            f"under {format_quantity(self.pressure, 'Pa', 3)} the contact on a shorter wave is shorter than an element "
            f"({format_length(self.element, 3)})"
        )
        if is_cutoff_given:
            reason = f"the elements are {format_length(self.element, 3)} long"
        command = "`patchfem profile TRACE --split SCENE -o NEW_SCENE` writes the scene. "
        table_lines = self.tables.replace("\n", "\n    ").rstrip()
        return (
            f"split the trace: waves longer than {cutoff} to [contact.profile], shorter ones to [contact.asperities]; "
            f"{reason}. Use the stiffnesses of the split. Its pressure is a mean over the short "
            "waves, and its contact_fraction counts where the layer carries, not where peaks touch. Worn depth is a mean "
            "over these waves, too: single peaks wear deeper, and the layer does not wear. The layer is too soft "
            f"where the pressure exceeds {format_quantity(self.closing_pressure, 'Pa', 2)}, which presses these waves flat, "
            "and too stiff where few of them carry. The changes at twice the cutoff and at a hundredth of the decay_length "
            f"show the error. {'' if is_scene_written else command}Tables:\n    {table_lines}"
        )


def split_trace(
    patch_model, cutoff: float | None = None, element: float | None = None
) -> TraceSplit:
    """Split a trace at the shortest wavelength that the elements resolve, or at a given cutoff.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with a profile from a trace.
    cutoff : float, optional
        Cutoff wavelength [m]; None: chosen from the element length and the mean pressure.
    element : float, optional
        Element length [m]; None: that of the uniform mesh of the patch.

    Returns
    -------
    TraceSplit

    Raises
    ------
    PatchfemError
        If the scene has no suitable trace, or if no cutoff divides it.
    """
    loading = patch_model.loading
    gap = patch_model.gap
    if gap.profile is None or gap.is_rough or loading.load is None:
        raise PatchfemError(
            "a split needs [contact.profile] and contact.load, without [contact.asperities]",
            PROFILE_KEY,
        )

    pieces = patch_model.pieces
    element = element or patch_model.uniform_element_size
    trace = _level_trace(patch_model, element)
    pressure = loading.load / (pieces.length * pieces.width * pieces.pairs)
    modulus = patch_model.pieces.surface_modulus

    # A wave is resolved if its contact under the mean pressure is longer than an element.
    too_long = f"a cutoff of {format_length(cutoff or 0.0)} is not shorter than the trace; give a shorter one"
    if cutoff is None:
        spectrum = wave_spectrum(trace)
        cutoff = float(f"{spectrum.shortest_resolved_wave(element, pressure / modulus):.3g}")
        too_long = (
            "under this load the contact on every wave is shorter than an element of "
            f"{format_length(element, 3)}; reduce contact.element_size"
        )
    if not cutoff < trace.length:
        raise PatchfemError(f"{trace.source}: {too_long}", PROFILE_KEY)

    waves = trace_moments(trace, cutoff).fine
    if not waves.slope > 0:
        raise PatchfemError(
            f"{trace.source}: no waves are shorter than {format_length(cutoff)}, so that there is nothing to split; "
            "give a longer cut-off",
            PROFILE_KEY,
        )
    # By Westergaard's solution, a sine of this rms slope closes completely at this pressure.
    closing_pressure = modulus * waves.slope / sqrt(2)
    if closing_pressure <= pressure:
        raise PatchfemError(
            f"{trace.source}: the mean pressure presses all waves shorter than {format_length(cutoff)} flat, so that no "
            "layer represents them; reduce contact.element_size",
            PROFILE_KEY,
        )

    # By Persson's theory the layer of the short waves is exponential, with a decay length of a
    # multiple of their rms height.
    decay_length = sum(DECAY_LENGTH_OVER_RMS_HEIGHT) / 2 * waves.height
    text = _write_layer_tables(patch_model, decay_length, cutoff)
    return TraceSplit(cutoff, decay_length, closing_pressure, element, pressure, text)


def _write_layer_tables(patch_model, decay_length: float, cutoff: float) -> str:
    """Return the tables of a scene for a trace of which an asperity layer represents the waves below a cutoff.

    `decay_length` [m] is that of the exponential law of the layer, and `cutoff` [m] the longest of its waves.
    """
    gap = patch_model.gap
    tables = [
        "[contact.profile]",
        f"file = {json.dumps(str(gap.file), ensure_ascii=False)}",
        f'heights = "{"surface" if gap.material else "gap"}"',
        *(['on = "lower"'] if gap.side == "lower" else []),
        "[contact.asperities]",
        'law = "exponential"',
        f'decay_length = "{format_length(decay_length)}"',
        f'cutoff = "{format_length(cutoff)}"',
    ]
    if patch_model.interface.has_shear:
        # Ridges on equal half-planes are as stiff along x as across it.
        tables.append("tangential_ratio = 1.0")
    return "\n".join(tables) + "\n"


def _level_trace(patch_model, element: float) -> Profile:
    """Return the trace of a patch, levelled over its length; up to `element` [m] may be missing."""
    ends = np.array([-0.5, 0.5]) * patch_model.pieces.length
    return profile.level_profile(patch_model.gap.profile, ends, element, is_material=False).profile


def advise_split(patch_model, element: float) -> list[str]:
    """Return the advice to split the trace of a patch, as a list.

    It is empty if the trace cannot be split, or if the elements represent all of its waves, so that only smaller
    elements help.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with a profile from a trace.
    element : float
        Length [m] of the elements that carry load.
    """
    try:
        split = split_trace(patch_model, element=element)
    except PatchfemError:
        return []
    spectrum = wave_spectrum(_level_trace(patch_model, element), is_tapered=True)
    lost = spectrum.lost_fraction(ELEMENTS_PER_CURVED_WAVE * element)
    return [split.describe_split()] if lost > NEGLIGIBLE_LOST_FRACTION else []
