"""Peaks of [contact.asperities] with law 'hertz', from a trace or from root mean squares."""

from collections.abc import Callable
from pathlib import Path

from ..core import PatchfemError
from ..scene.keys.contact import Asperities
from ..surface.files.read import read_profile
from ..surface.roughness.peaks import Moments, TraceMoments, gaussian_peaks, trace_moments
from .source import cache_by_file, name_key

ASPERITY_PREFIX = "contact.asperities."  # prefix of the keys in messages


def complete_asperities(
    table: Asperities, resolve_path: Callable[[str], Path], cutoff: float | None = None
) -> Asperities:
    """Add radius, density and height deviation of the asperity peaks to [contact.asperities].

    Parameters
    ----------
    table : Asperities
        A table with `radius` is returned as it is.
    resolve_path : callable
        Function of a file name in the scene that returns its path.
    cutoff : float, optional
        Longest wave [m] of a trace that counts; all waves by default.

    Returns
    -------
    Asperities
        With the root mean squares too if the table names a trace.

    Raises
    ------
    PatchfemError
        If no surface has these root mean squares.
    """
    if table.radius is not None:
        return table

    # The key that gives the root mean squares, for messages: a trace, or these values themselves.
    key = "rms_height"
    if table.from_ is not None:
        key = "from"
        path = Path(resolve_path(table.from_))
        moments = read_spectral_moments(path, cutoff).fine
        squares = {f"rms_{name}": value for name, value in moments._asdict().items()}
        table = table.model_copy(update={"from_": str(path), "cutoff": cutoff, **squares})

    # Peaks of an isotropic Gaussian surface with these root mean squares.
    with name_key(ASPERITY_PREFIX + key):
        peaks = gaussian_peaks(Moments(table.rms_height, table.rms_slope, table.rms_curvature))
    changes = {
        "radius": peaks.radius,
        "density": peaks.density,
        "height_deviation": peaks.deviation,
    }
    return table.model_copy(update=changes)


def read_spectral_moments(path: Path, cutoff: float | None = None) -> TraceMoments:
    """Read a trace from the file `path` and return the spectral moments of its waves below a cut-off [m].

    Raises PatchfemError, which names the key, if no isotropic Gaussian surface has these moments.
    """
    try:
        return _compute_spectral_moments(path, cutoff)
    except PatchfemError as error:
        remedy = f"; {ASPERITY_PREFIX}cutoff sets this cut-off" if "cut-off" in str(error) else ""
        raise type(error)(f"{error}{remedy}", f"{ASPERITY_PREFIX}from") from None


@cache_by_file
def _compute_spectral_moments(path: Path, cutoff: float | None) -> TraceMoments:
    """Compute the spectral moments of the trace in the file `path`, from waves below `cutoff` [m].

    Raises PatchfemError if no isotropic Gaussian surface has them.
    """
    moments = trace_moments(read_profile(path), cutoff)
    gaussian_peaks(moments.fine)
    return moments
