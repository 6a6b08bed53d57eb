"""Roughness parameters of one measured trace or scan, with the treatment that led to them."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import special

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
    WITHOUT_INTERVAL,
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
    quantities = [_name_value("P", name, value) for name, value in values.items()]
    quantities += _measure_waves(primary, parts.spectrum)
    rough = parts.roughness
    if rough is None:
        return quantities, ()

    errors = estimate_errors(rough.z, primary.step, cutoff)
    n_sections = rough.z.size // round(cutoff / primary.step)
    for name, value in compute_parameters(rough.z, primary.step, cutoff).items():
        quantity = _name_value("R", name, value)
        quantities.append(_add_interval(quantity, errors.get(name), n_sections))
    if n_sections >= MIN_SECTIONS:
        return quantities, ()
    advice = (
        f"evaluate at least {format_length((MIN_SECTIONS + 1) * cutoff)}, or take a shorter cut-off"
    )
    if not n_sections:
        advice = (
            f"do not use these roughness parameters, as ISO 21920 needs a whole section: {advice}"
        )
    plural = "s" * (n_sections != 1)
    note = (
        f"{primary.source}: without half a cut-off at each end, {format_length(rough.length)} are left, which hold "
        f"{n_sections} section{plural} of {format_length(cutoff)}, and intervals need {MIN_SECTIONS}: {advice}"
    )
    return quantities, (note,)


def _measure_scan(scan: Areal) -> tuple[list[Quantity], tuple[str, ...]]:
    """Return the parameters of a scan, and a note on missing heights."""
    if scan.missing.all():
        raise PatchfemError(
            f"{scan.source}: no measured height is left within half a cut-off of the borders"
        )
    steps = tuple(float(axis[-1] - axis[0]) / (axis.size - 1) for axis in (scan.y, scan.x))
    quantities = []
    for name, value in compute_areal_parameters(scan.z, steps).items():
        number, reason = (None, value) if isinstance(value, str) else (value, "")
        quantities.append(Quantity(number, None, None, *AREAL[name], reason, name))
    count = int(scan.missing.sum())
    note = f"{scan.source}: {count} of {scan.z.size} heights are missing and are left out"
    return quantities, (note,) if count else ()


def _measure_waves(primary: Profile, spectrum: Spectrum) -> list[Quantity]:
    """Return the dominant wavelength, and the amplitude of the waves of the band."""
    low, high = BAND
    amplitude = None
    if 2 * high <= primary.length and low >= 2 * primary.step:
        amplitude = spectrum.band_amplitude(low, high)
    of_band = (
        f"amplitude of a sine with the mean square of the waves from {format_length(low)} to "
        f"{format_length(high)}, of the levelled trace"
    )
    of_octave = (
        "wavelength of the octave with the largest mean square height, of the levelled trace"
    )
    rows = (
        ("dominant_wavelength", spectrum.dominant_wavelength, of_octave, "undetermined"),
        ("band_amplitude", amplitude, of_band, "band"),
    )
    quantities = []
    for name, value, text, reason in rows:
        reason = "" if value is not None else reason
        quantities.append(Quantity(value, None, None, "m", text, reason, name))
    return quantities


def _name_value(letter: str, name: str, value: float | None) -> Quantity:
    """Return a parameter of the primary profile "P", or of the roughness profile "R", by its name in PROFILE."""
    unit, text = PROFILE[name]
    profile = "the levelled trace" if letter == "P" else "the roughness profile"
    long_name = name if name.startswith("Mr") and letter == "R" else f"{letter}{name}"
    reason = "" if value is not None else "undetermined"
    return Quantity(value, None, None, unit, f"{text}, of {profile}", reason, long_name)


def _add_interval(quantity: Quantity, error: float | None, n_sections: int) -> Quantity:
    """Add the 90 % interval of a mean over sections by Student's t of its logarithm; without errors, the reason."""
    has_interval = quantity.name[1:] not in WITHOUT_INTERVAL
    if error is None and n_sections < MIN_SECTIONS and has_interval and not quantity.reason:
        return quantity._replace(reason="sections")
    if not quantity.value or not error:
        return quantity
    width = float(special.stdtrit(n_sections - 1, 1 - CONFIDENCE_TAIL)) * error / quantity.value
    low, high = quantity.value * np.exp([-width, width])
    # A material ratio is at most 1.
    high = min(high, 1.0) if quantity.name.startswith("Mr") else high
    return quantity._replace(low=float(low), high=float(high))


def fitting_cutoff(length: float, step: float) -> float | None:
    """Return the longest standard cut-off [m] that a trace of this length and step [m] allows."""
    longest = length * (1 + 1e-9) / SECTIONS_PER_TRACE
    return max((each for each in STANDARD_CUTOFFS if 4 * step <= each <= longest), default=None)


def crop(surface: Profile | Areal, *ends: float) -> Profile | Areal:
    """Cut out the part of a surface between given positions [m].

    As between the cursors of an instrument, it runs from the last sample at or before the first
    position to the last at or before the second. Raises PatchfemError for a window that is reversed
    or not within the surface.
    """
    names = "xy" if isinstance(surface, Areal) else "x"
    if len(ends) != 2 * len(names):
        raise PatchfemError(
            f"{surface.source}: a window needs a first and a last position along {' and along '.join(names)}"
        )
    parts = {}
    for name, pair in zip(names, (ends[:2], ends[2:])):
        parts[name] = _find_part(surface.source, name, getattr(surface, name), pair)
    axes = {name: getattr(surface, name)[part] for name, part in parts.items()}
    return replace(surface, **axes, z=surface.z[tuple(parts[name] for name in reversed(names))])


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
