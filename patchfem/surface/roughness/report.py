"""Roughness parameters of one measured trace or scan, with the treatment that led to them."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal, find_scan_spikes
from ..profile import Profile, find_spikes, resample_evenly
from ..quantity import Quantity
from .areal import AREAL, compute_areal_parameters
from .filter import filter_surface
from .form import subtract_form
from .parameters import (
    MIN_SAMPLES,
    MIN_SECTIONS,
    PROFILE,
    ROUND_OFF,
    compute_parameters,
    estimate_errors,
)
from .spectrum import BAND, Spectrum, estimate_spectrum

# Standard cut-offs [m]: those of ISO 21920-3 and one more at each end.
STANDARD_CUTOFFS = (25e-6, 80e-6, 250e-6, 800e-6, 2.5e-3, 8e-3, 25e-3)
# Smallest length of a trace in cut-offs: five are evaluated, and the filter trims one in total.
SECTIONS_PER_TRACE = 6
CONFIDENCE_TAIL = 0.05  # probability of a true value below, and above, the interval of a parameter


class Sampling(NamedTuple):
    """Length, step [m] and numbers of samples of a surface; measured: of a trace before resampling."""

    length: float
    step: float
    shape: tuple[int, ...]
    measured: int | None = None


class Treatment(NamedTuple):
    """Form removal, filters and window that were applied to a surface.

    form: name of the least-squares form; short: nesting index of the S-filter; cutoff: between
    waviness and roughness, for a scan the nesting index of the L-filter; window: first and last
    position, for a scan in x and then in y; all in m.
    """

    form: str
    short: float | None
    cutoff: float | None
    window: tuple[float, ...] | None


class TraceParts(NamedTuple):
    """Primary profile, waviness, roughness and spectrum of a trace after form removal."""

    primary: Profile
    waviness: Profile | None
    roughness: Profile | None
    spectrum: Spectrum


@dataclass(frozen=True, eq=False)
class RoughnessReport:
    """Roughness parameters of one measured surface.

    values: Quantity of each parameter, with its name, and the code of the reason where it has no
    value; notes: sentences about the file and its treatment; surface: what the parameters are read
    from; heights: those of the Abbott curve (n,) [m].
    """

    source: str
    sampling: Sampling
    treatment: Treatment
    values: tuple[Quantity, ...]
    notes: tuple[str, ...]
    surface: TraceParts | Areal
    heights: np.ndarray

    @property
    def kind(self) -> str:
        """Kind of the surface, "profile" or "areal"."""
        return "areal" if isinstance(self.surface, Areal) else "profile"

    def __getitem__(self, name: str) -> Quantity:
        """Return the roughness parameter with a given name."""
        return next(value for value in self.values if value.name == name)


def make_report(
    surface: Profile | Areal,
    cutoff: float | None = None,
    window: tuple[float, ...] | None = None,
    form: int | str = 1,
    short: float | None = None,
) -> RoughnessReport:
    """Compute the roughness parameters of a trace or a scan.

    Parameters
    ----------
    surface : Profile or Areal
        Of at least 16 samples.
    cutoff : float, optional
        Cut-off or nesting index [m]; without it there is the primary profile or the S-F surface
        alone.
    window : tuple of float, optional
        Positions [m] of the first and the last sample, of a scan in x, then in y.
    form : int or str
        1 (a line or a plane) or "circle".
    short : float, optional
        Nesting index [m] of the S-filter.
    """
    part = surface if window is None else crop(surface, *window)
    is_scan = isinstance(part, Areal)
    whole = part if is_scan else _require_samples(resample_evenly(_require_samples(part)))
    primary, form_name = subtract_form(whole, form)
    if short is not None:
        # The filter changes the plane or line, so the form is subtracted again after it.
        primary = subtract_form(filter_surface(primary, short)[0], form)[0]
    heights = primary.z[~primary.missing]
    if heights.size and np.ptp(heights) <= ROUND_OFF * np.nanmax(np.abs(whole.z)):
        primary = replace(primary, z=frozen_array(primary.z * 0.0))
    waviness = None
    roughness = None
    if cutoff is not None:
        waviness, roughness = filter_surface(primary, cutoff)

    evaluated = primary if roughness is None else roughness
    heights = evaluated.z[~evaluated.missing]
    notes = whole.notes + _describe_spikes(part)
    if is_scan:
        quantities, more = _measure_scan(evaluated)
        parts = evaluated
    else:
        spectrum = estimate_spectrum(primary.z, whole.step)
        parts = TraceParts(primary, waviness, roughness, spectrum)
        quantities, more = _measure_trace(parts, cutoff)
    size = Sampling(
        length=float(whole.x[-1] - whole.x[0]),
        step=float(whole.x[-1] - whole.x[0]) / (whole.x.size - 1),
        shape=whole.z.shape,
        measured=None if is_scan else part.x.size,
    )
    treatment = Treatment(form_name, short, cutoff, window)
    return RoughnessReport(
        whole.source, size, treatment, tuple(quantities), notes + more, parts, heights
    )


def _measure_trace(
    parts: TraceParts, cutoff: float | None
) -> tuple[list[Quantity], tuple[str, ...]]:
    """Return the parameters of the primary profile and of the roughness profile, and notes on the sections."""
    primary = parts.primary
    values = compute_parameters(primary.z, primary.step)
    del values["z"]  # of one section, which is Pt
    quantities = [
        _name_value(f"P{name}", value, PROFILE[name], "the levelled trace")
        for name, value in values.items()
    ]
    quantities += _measure_waves(primary, parts.spectrum)
    rough = parts.roughness
    if rough is None:
        return quantities, ()

    errors = estimate_errors(rough.z, primary.step, cutoff)
    n_sections = rough.z.size // round(cutoff / primary.step)
    for name, value in compute_parameters(rough.z, primary.step, cutoff).items():
        long_name = name if name.startswith("Mr") else f"R{name}"
        quantity = _name_value(long_name, value, PROFILE[name], "the roughness profile")
        quantities.append(_add_interval(quantity, errors.get(name), n_sections))
    notes = ()
    remaining = f"{format_length(rough.length)}"
    if n_sections < MIN_SECTIONS:
        notes += (
            f"{primary.source}: the {remaining} within half a cut-off of the ends hold {n_sections} sections of "
            f"{format_length(cutoff)}, and intervals need {MIN_SECTIONS}: evaluate at least "
            f"{format_length((MIN_SECTIONS + 1) * cutoff)}, or take a shorter cut-off",
        )
    if rough.length < cutoff * (1 - 1e-9):
        notes += (
            f"{primary.source}: half a cut-off is trimmed at each end, and the {remaining} that remain are shorter "
            f"than one section of {format_length(cutoff)}, the least that ISO 21920 needs; do not use these "
            "roughness parameters: evaluate a longer part, or take a shorter cut-off",
        )
    return quantities, notes


def _measure_scan(scan: Areal) -> tuple[list[Quantity], tuple[str, ...]]:
    """Return the parameters of a scan, and a note on missing heights."""
    if scan.missing.all():
        raise PatchfemError(
            f"{scan.source}: no measured height is left within half a cut-off of the borders"
        )
    steps = tuple(float(axis[-1] - axis[0]) / (axis.size - 1) for axis in (scan.y, scan.x))
    quantities = []
    for name, value in compute_areal_parameters(scan.z, steps).items():
        reason = value if isinstance(value, str) else ""
        number = None if reason else value
        quantities.append(Quantity(number, None, None, *AREAL[name], reason, name))
    count = int(scan.missing.sum())
    if not count:
        return quantities, ()
    note = f"{scan.source}: {count} of {scan.z.size} heights are missing and are left out"
    return quantities, (note,)


def _measure_waves(primary: Profile, spectrum: Spectrum) -> list[Quantity]:
    """Return the dominant wavelength, and the amplitude of the waves of the band."""
    low, high = BAND
    text = (
        "amplitude of a sine with the mean square of the waves from {} to {}, of the levelled trace"
    )
    definition = ("m", text.format(format_length(low), format_length(high)))
    wave = ("m", "wavelength of the octave with the largest mean square height")
    out = [
        _name_value("dominant_wavelength", spectrum.dominant_wavelength, wave, "the levelled trace")
    ]
    if 2 * high > primary.length or low < 2 * primary.step:
        return [*out, Quantity(None, None, None, *definition, "band", "band_amplitude")]
    amplitude = spectrum.band_amplitude(low, high)
    return [*out, Quantity(amplitude, None, None, *definition, name="band_amplitude")]


def _name_value(name: str, value, definition: tuple[str, str], of: str) -> Quantity:
    unit, text = definition
    reason = "" if value is not None else "undetermined"
    return Quantity(value, None, None, unit, f"{text}, of {of}", reason, name)


def _add_interval(quantity: Quantity, error: float | None, n_sections: int) -> Quantity:
    """Add the 90 % interval of a mean over sections by Student's t of its logarithm; without errors, the reason."""
    from scipy.special import stdtrit

    if error is None and n_sections < MIN_SECTIONS and not quantity.reason:
        return quantity._replace(reason="sections")
    if not quantity.value or not error:
        return quantity
    width = float(stdtrit(n_sections - 1, 1 - CONFIDENCE_TAIL)) * error / quantity.value
    low, high = quantity.value * np.exp([-width, width])
    # a material ratio is at most 1
    high = min(high, 1.0) if quantity.name.startswith("Mr") else high
    return quantity._replace(low=float(low), high=float(high))


def fitting_cutoff(length: float, step: float) -> float | None:
    """Return the longest standard cut-off [m] that a trace of this length and step [m] allows."""
    fitting = [
        cutoff
        for cutoff in STANDARD_CUTOFFS
        if SECTIONS_PER_TRACE * cutoff <= length * (1 + 1e-9) and cutoff >= 4 * step
    ]
    return max(fitting, default=None)


def crop(surface: Profile | Areal, *ends: float) -> Profile | Areal:
    """Cut out the part of a surface between given positions [m].

    As between the cursors of an instrument, it runs from the last sample at or before the first
    position to the last at or before the second. Raises PatchfemError for a window that is reversed
    or not within the surface.
    """
    source = surface.source
    is_scan = isinstance(surface, Areal)
    if len(ends) != (4 if is_scan else 2):
        needed = (
            "four positions: from and to in x, from and to in y" if is_scan else "two positions"
        )
        raise PatchfemError(f"{source}: a window of this surface needs {needed}")
    columns = _find_part(source, "x", surface.x, ends[:2])
    if not is_scan:
        return replace(surface, x=surface.x[columns], z=surface.z[columns])
    rows = _find_part(source, "y", surface.y, ends[2:])
    return replace(surface, x=surface.x[columns], y=surface.y[rows], z=surface.z[rows, columns])


def _find_part(source: str, name: str, axis: np.ndarray, ends: tuple[float, ...]) -> slice:
    first, last = ends
    near = 1e-6 * float(axis[-1] - axis[0]) / (axis.size - 1)
    if not first < last or first < axis[0] - near or last > axis[-1] + near:
        raise PatchfemError(
            f"{source}: the window runs from {format_length(first)} to {format_length(last)}, but the "
            f"surface along {name} from {format_length(axis[0])} to {format_length(axis[-1])}"
        )
    low, high = (max(int(np.searchsorted(axis, end + near, "right")) - 1, 0) for end in ends)
    return slice(low, high + 1)


def _require_samples(trace: Profile) -> Profile:
    if trace.x.size < MIN_SAMPLES:
        plural = "s" * (trace.x.size != 1)
        raise PatchfemError(
            f"{trace.source}: {trace.x.size} sample{plural}; the parameters need at least {MIN_SAMPLES}"
        )
    return trace


def _describe_spikes(surface: Profile | Areal) -> tuple[str, ...]:
    """Describe the spikes of a surface in a sentence, or return () if there are none."""
    is_spike = find_scan_spikes(surface) if isinstance(surface, Areal) else find_spikes(surface)
    count = int(is_spike.sum())
    if not count:
        return ()
    *row, column = np.argwhere(is_spike)[0]
    place = f"x = {format_length(surface.x[column])}"
    place += "".join(f", y = {format_length(surface.y[k])}" for k in row)
    clause = f"are spikes (the first at {place}), which count"
    if count == 1:
        clause = f"is a spike (at {place}), which counts"
    return (f"{surface.source}: {count} of {is_spike.size} heights {clause} in every parameter",)
