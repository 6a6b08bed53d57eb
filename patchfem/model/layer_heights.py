"""Heights of the rough layer of [contact.asperities] that wears, from a trace or an areal scan."""

from pathlib import Path

import numpy as np

from ..surface.areal import Areal, find_scan_spikes, level
from ..surface.files.read import read_surface
from ..surface.profile import remove_spikes, resample_evenly
from ..surface.roughness.filter import filter_surface
from ..surface.spectrum import MIN_ELEMENTS_PER_WAVE
from .patch import PatchModel
from .profile import list_short_wave_heights
from .source import cache_by_file, name_key


def read_layer_heights(patch: PatchModel) -> np.ndarray:
    """Return the heights (k,) [m] of the rough layer of a patch at equal distances; larger heights are more material.

    They are those of the file that the layer names, or else those of the short waves of the profile.

    Raises
    ------
    PatchfemError
        If a file cannot be read, or is shorter than the cut-off.
    """
    skin = patch.interface.skin
    if skin.heights is not None:
        with name_key("contact.asperities.heights"):
            return read_heights(Path(skin.heights), skin.cutoff)
    gap = patch.gap
    ends = np.array([-0.5, 0.5]) * patch.pieces.length
    cutoff = MIN_ELEMENTS_PER_WAVE * gap.average
    return list_short_wave_heights(gap.profile, ends, cutoff, is_material=gap.material)


@cache_by_file
def read_heights(path: Path, cutoff: float | None = None) -> np.ndarray:
    """Return the levelled heights (k,) [m] of a trace or a scan without spikes, of waves below a cut-off [m] or of all.

    Raises PatchfemError if the file cannot be read, or is shorter than the cut-off.
    """
    surface = read_surface(path)
    if isinstance(surface, Areal):
        heights = np.where(find_scan_spikes(surface), np.nan, surface.z)
        surface = level(Areal(surface.x, surface.y, heights, surface.source, surface.notes))
    else:
        surface = level(resample_evenly(remove_spikes(surface)))
    if cutoff is not None:
        surface = filter_surface(surface, cutoff)[1]
    return surface.z[np.isfinite(surface.z)]
