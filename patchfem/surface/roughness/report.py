"""Roughness report: all parameters of a trace or of an areal scan, with their intervals."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal, find_scan_spikes
from ..profile import Profile, find_spikes, resample_evenly
from ..quantity import Quantity, make_unknown

from . import rows
from .areal import Surface, missing_reason
from .filter import filter_scan, filter_trace
from .form import form_degree, subtract_form
from .intervals import LATERAL, SIZES, Intervals
from .parameters import MIN_SAMPLES, ROUND_OFF, Heights
from .rows import Parameter
from .scan_intervals import scan_intervals
from .spectrum import BAND, Spectrum, band_amplitude, refuse_band

# Standard cut-offs [m]: those of ISO 21920-3 and one more at each end.
STANDARD_CUTOFFS = (25e-6, 80e-6, 250e-6, 800e-6, 2.5e-3, 8e-3, 25e-3)
# Smallest length of a trace in cut-offs: five are evaluated, and the filter trims one in total.
SECTIONS_PER_TRACE = 6
NO_INTERVAL = "a single trace gives no interval for this parameter"
NOT_GAUSSIAN = (
    "an interval from a single trace assumes Gaussian heights, but these heights are not Gaussian; "
    "use the scatter of several traces"
)
TOO_SHORT = (
    "the trace is shorter than four wavelengths of its strongest wave, so a longer trace would "
    "give a different value"
)


class Sampling(NamedTuple):
    """Length, sample spacing and numbers of samples of a measured surface."""

    length: float
    step: float
    shape: tuple
    measured: int | None = None


class Treatment(NamedTuple):
    """Form removal, filters and window that were applied to a surface.

    form: name of the least-squares form; short: nesting index of the S-filter; cutoff: between
    waviness and roughness, for a scan the nesting index of the L-filter; window: first and last
    position, for a scan in x and then in y.
    """

    form: str
    short: float | None
    cutoff: float | None
    window: tuple | None


class TraceParts(NamedTuple):
    """Waviness, roughness and spectrum of a trace after form removal."""

    primary: Profile
    waviness: Profile | None
    roughness: Profile | None
    spectrum: Spectrum


@dataclass(frozen=True, eq=False)
class RoughnessReport:
    """Roughness parameters of one measured surface.

    values: Quantity of each parameter, with its name; notes: sentences about the file and its
    treatment; surface: what the parameters are read from, `TraceParts` or the filtered scan;
    heights: those of the Abbott curve, of the roughness if there is a cut-off.
    """

    source: str
    sampling: Sampling
    treatment: Treatment
    values: tuple
    notes: tuple
    surface: TraceParts | Areal
    heights: Heights

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
    window: tuple | None = None,
    form: int | str = 1,
    short: float | None = None,
) -> RoughnessReport:
    """Compute the roughness parameters of a trace or a scan with their intervals.

    Parameters
    ----------
    surface : Profile or Areal
        Of at least 16 samples.
    cutoff : float, optional
        Cut-off or nesting index [m]; without it there is the primary profile or the S-F surface
        alone.
    window : tuple, optional
        Positions [m] of the first and the last sample, of a scan in x, then in y (`crop`).
    form : int or str
        Form to subtract (`subtract_form`).
    short : float, optional
        Nesting index [m] of the S-filter.

    Returns
    -------
    RoughnessReport
        A trace of a million samples takes 1.2 s.
    """
    part = surface if window is None else crop(surface, *window)
    if isinstance(surface, Areal):
        return _report_scan(part, cutoff, window, form, short)
    return _report_trace(part, cutoff, window, form, short)


def _report_trace(
    part: Profile, cutoff: float | None, window: tuple | None, form: int | str, short: float | None
) -> RoughnessReport:
    trace = _require_samples(resample_evenly(_require_samples(part)))
    primary, form_name = subtract_form(trace, form)
    if short is not None:
        # The filter keeps the degree of a polynomial, so the form is subtracted again after it.
        primary = subtract_form(filter_trace(primary, short)[0], form)[0]
    if np.ptp(primary.z) <= ROUND_OFF * np.abs(trace.z).max():
        primary = replace(primary, z=frozen_array(np.zeros(primary.z.size)))
    heights = Heights(primary.z, trace.step)
    intervals = Intervals(heights, form_degree(form))
    values = [_make_quantity(row, row.compute(heights), intervals) for row in rows.PRIMARY]
    dominant, band = rows.WAVES
    values += [
        _make_quantity(dominant, intervals.spectrum.dominant_wavelength, intervals),
        _make_band_quantity(band, trace, intervals),
    ]
    waviness = None
    roughness = None
    evaluated = heights
    if cutoff is not None:
        waviness, roughness = filter_trace(primary, cutoff)
        evaluated = replace(heights, z=roughness.z, section=cutoff)
        rough_intervals = Intervals(evaluated, None)
        values += [
            _make_quantity(row, row.compute(evaluated), rough_intervals) for row in rows.ROUGH
        ]
    if window is not None:
        for row in rows.WINDOW:
            value = float(trace.z[-1] - trace.z[0]) if row.compute is None else row.compute(heights)
            values.append(_make_quantity(row, value, intervals))
    notes = trace.notes + _describe_spikes(part)
    if trace.x.size != part.x.size and short is None:
        notes += _describe_resampling(part, trace, primary)
    if roughness is not None:
        notes += _describe_short_trace(roughness, cutoff)
    return RoughnessReport(
        source=trace.source,
        sampling=Sampling(trace.length, heights.step, (trace.x.size,), part.x.size),
        treatment=Treatment(form_name, short, cutoff, window),
        values=tuple(values),
        notes=notes,
        surface=TraceParts(primary, waviness, roughness, intervals.spectrum),
        heights=evaluated,
    )


def _report_scan(
    scan: Areal, cutoff: float | None, window: tuple | None, form: int | str, short: float | None
) -> RoughnessReport:
    flat, form_name = subtract_form(scan, form)
    if short is not None:
        flat = subtract_form(filter_scan(flat, short)[0], form)[0]
    if cutoff is not None:
        flat = filter_scan(flat, cutoff)[1]
    if np.isnan(flat.z).all():
        raise PatchfemError(
            f"{scan.source}: no measured height is left within half a cut-off of the borders"
        )
    if np.nanmax(flat.z) - np.nanmin(flat.z) <= ROUND_OFF * np.nanmax(np.abs(scan.z)):
        flat = replace(flat, z=frozen_array(flat.z * 0.0))
    steps = tuple(float(axis[-1] - axis[0]) / (axis.size - 1) for axis in (flat.y, flat.x))
    surface = Surface(flat.z, steps)
    values = {row.name: row.compute(surface) for row in rows.AREAL}
    intervals = scan_intervals(flat.z, values)
    no_interval = (NOT_GAUSSIAN if intervals.is_uneven else NO_INTERVAL).replace("trace", "scan")
    quantities = []
    for row in rows.AREAL:
        value = values[row.name]
        low, high = intervals.bounds.get(row.name, (None, None))
        reason = no_interval if low is None and surface.heights.power else ""
        if value is None:
            reason = missing_reason(surface, row.name)
        quantities.append(Quantity(value, low, high, row.unit, row.text, reason, row.name))
    notes = scan.notes + _describe_spikes(scan)
    missing = int(np.isnan(flat.z).sum())
    if missing:
        notes += (
            f"{scan.source}: {missing} of {flat.z.size} heights are missing and are left out",
        )
    return RoughnessReport(
        source=scan.source,
        sampling=Sampling(float(scan.x[-1] - scan.x[0]), steps[1], scan.z.shape),
        treatment=Treatment(form_name, short, cutoff, window),
        values=tuple(quantities),
        notes=notes,
        surface=flat,
        heights=surface.heights,
    )


def fitting_cutoff(length: float, step: float) -> float | None:
    """Return the longest standard cut-off [m] that a trace of this length and step [m] allows."""
    fitting = [
        cutoff
        for cutoff in STANDARD_CUTOFFS
        if SECTIONS_PER_TRACE * cutoff <= length * (1 + 1e-9) and cutoff >= 4 * step
    ]
    return max(fitting, default=None)


def crop(surface: Profile | Areal, *ends: float) -> Profile | Areal:
    """Cut out the part of a surface between given positions.

    As between the cursors of an instrument, it runs from the last sample at or before the first
    position to the last at or before the second. Raises PatchfemError for a window that is reversed
    or not within the surface.
    """
    source = surface.source
    if isinstance(surface, Profile):
        if len(ends) != 2:
            raise PatchfemError(f"{source}: a window of a trace needs two positions: from and to")
        part = _find_part(f"{source}: the window", "the trace runs", surface.x, ends)
        return replace(surface, x=surface.x[part], z=surface.z[part])
    if len(ends) != 4:
        raise PatchfemError(
            f"{source}: a window of an areal scan needs four positions: from and to in x, from and "
            "to in y"
        )
    columns = _find_part(f"{source}: the window", "the scan runs in x", surface.x, ends[:2])
    lines = _find_part(f"{source}: the window", "the scan runs in y", surface.y, ends[2:])
    return replace(surface, x=surface.x[columns], y=surface.y[lines], z=surface.z[lines, columns])


def _find_part(window: str, extent: str, axis: np.ndarray, ends: tuple) -> slice:
    first, last = ends
    near = 1e-6 * float(axis[-1] - axis[0]) / (axis.size - 1)
    if not first < last or first < axis[0] - near or last > axis[-1] + near:
        raise PatchfemError(
            f"{window} runs from {format_length(first)} to {format_length(last)}, but {extent} from "
            f"{format_length(axis[0])} to "
            f"{format_length(axis[-1])}"
        )
    low, high = (max(int(np.searchsorted(axis, end + near, "right")) - 1, 0) for end in ends)
    return slice(low, high + 1)


def _require_samples(trace: Profile) -> Profile:
    if trace.x.size < MIN_SAMPLES:
        plural = "s" * (trace.x.size != 1)
        raise PatchfemError(
            f"{trace.source}: {trace.x.size} sample{plural}; the parameters need at least "
            f"{MIN_SAMPLES}"
        )
    return trace


def _make_quantity(row: Parameter, value: float | None, intervals: Intervals) -> Quantity:
    """Combine a value with its interval, or with the reason why there is none."""
    heights = intervals.heights
    if value is None:
        reason = "the heights of the trace do not determine this parameter"
        if heights.power == 0:
            reason = "the trace is flat"
        elif not len(heights.sections):
            reason = "the trace is shorter than one cut-off"
        return make_unknown(row.unit, row.text, reason)._replace(name=row.name)
    low, high = intervals.confidence_interval(row, value)
    if (
        row.kind == "wave"
        and low is not None
        and not (heights.step <= low <= value <= high <= heights.length)
    ):
        low = None
        high = None
    reason = ""
    if low is None and heights.power:
        reason = NO_INTERVAL
        if intervals.is_uneven and row.kind not in ("", *LATERAL):
            reason = NOT_GAUSSIAN
        elif row.kind in SIZES and intervals.is_short:
            reason = TOO_SHORT
    return Quantity(value, low, high, row.unit, row.text, reason, row.name)


def _make_band_quantity(row: Parameter, trace: Profile, intervals: Intervals) -> Quantity:
    low, high = BAND
    heights = intervals.heights
    text = row.text.replace("the band", f"{format_length(low)} to {format_length(high)}")
    try:
        refuse_band(trace.source, low, high, heights.length - heights.step, heights.step)
    except PatchfemError as error:
        return make_unknown(row.unit, text, str(error))._replace(name=row.name)
    return _make_quantity(
        row._replace(text=text), band_amplitude(intervals.spectrum, low, high), intervals
    )


def _describe_spikes(surface: Profile | Areal) -> tuple:
    """Describe the spikes of a surface in a sentence, or return () if there are none."""
    is_spike = find_scan_spikes(surface) if isinstance(surface, Areal) else find_spikes(surface)
    count = int(is_spike.sum())
    if not count:
        return ()
    *row, column = np.argwhere(is_spike)[0]
    place = f"x = {format_length(surface.x[column])}" + "".join(
        f", y = {format_length(surface.y[k])}" for k in row
    )
    if count == 1:
        clause = f"is a spike (at {place}), which counts"
    else:
        clause = f"are spikes (the first at {place}), which count"
    return (f"{surface.source}: {count} of {is_spike.size} heights {clause} in every parameter",)


def _describe_resampling(part: Profile, trace: Profile, primary: Profile) -> tuple:
    """State by how much resampling changes Pa and Pq of an uneven trace.

    Straight lines between samples cut peaks and valleys off. The reference are the heights of the
    file about the same form, each weighted by the length that it represents.
    """
    known = ~part.missing
    x = part.x[known]
    weight = np.gradient(x) / np.gradient(x).sum()
    z = part.z[known] - np.interp(x, trace.x, trace.z - primary.z)
    z = z - weight @ z
    weighted = {"Pa": weight @ np.abs(z), "Pq": np.sqrt(weight @ z**2)}
    resampled = {"Pa": np.abs(primary.z).mean(), "Pq": np.sqrt(np.mean(primary.z**2))}
    if min(weighted.values()) <= 0:
        return ()
    changes = [
        f"{name} by {100 * abs(resampled[name] / value - 1):.2g} %"
        for name, value in weighted.items()
    ]
    return (
        f"{trace.source}: resampling changes {' and '.join(changes)}, compared with the heights of "
        "the file weighted by the length that each stands for; no interval includes this error",
    )


def _describe_short_trace(roughness: Profile, cutoff: float) -> tuple:
    """State that a roughness profile is shorter than one section, or return () if it is not."""
    if roughness.length >= cutoff * (1 - 1e-9):
        return ()
    return (
        f"{roughness.source}: half a cut-off is trimmed at each end, and the "
        f"{format_length(roughness.length)} that remain are shorter than one section of {format_length(cutoff)}, the "
        "least that ISO 21920 needs; do not use these roughness parameters: evaluate a longer "
        "part, or take a shorter cut-off",
    )
