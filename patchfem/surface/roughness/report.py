"""Roughness parameters of one measured trace or scan, with the treatment that led to them."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import special

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal, find_scan_spikes
from ..profile import Profile, find_spikes, measure_step, resample_evenly
from ..quantity import Quantity
from ..spectrum import WAVE_BAND, WaveSpectrum, wave_spectrum
from .areal import AREAL_DEFINITIONS, compute_areal_parameters
from .filter import filter_surface
from .form import subtract_form
from .parameters import (
    HEIGHT_ROUND_OFF,
    MIN_SECTIONS,
    MIN_TRACE_SAMPLES,
    PARAMETERS_WITHOUT_INTERVAL,
    PROFILE_DEFINITIONS,
    WAVES_DEFINITIONS,
    compute_parameters,
    estimate_errors,
)

# Standard cut-offs [m]: those of ISO 21920-3 and one more at each end.
STANDARD_CUTOFFS = (25e-6, 80e-6, 250e-6, 800e-6, 2.5e-3, 8e-3, 25e-3)


class Sampling(NamedTuple):
    """Length [m], step [m] and numbers of samples (`shape`) of a surface, after resampling."""

    length: float
    step: float
    shape: tuple[int, ...]


class Treatment(NamedTuple):
    """Form removal, filters and window that were applied to a surface.

    - form: name of the least-squares form.
    - short: nesting index of the S-filter [m].
    - cutoff: cut-off between waviness and roughness [m], or for a scan the nesting index of the L-filter.
    - window: first and last position [m], for a scan in x and then in y.
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
    spectrum: WaveSpectrum


@dataclass(frozen=True, eq=False)
class RoughnessReport:
    """Roughness parameters of one measured surface.

    - source: name of the surface.
    - sampling: positions at which the heights were measured.
    - treatment: form removal, filters and window.
    - values: Quantity of each parameter, with its name, and the code of the reason where it has no value.
    - notes: sentences about the file and its treatment.
    - surface: the surface from which the parameters are computed.
    - heights: heights of the Abbott curve (n,) [m].
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
        A trace of at least 16 samples.
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
    even = part if is_scan else resample_evenly(part)
    # An uneven trace has more samples afterwards, and one without heights at its ends fewer.
    count = min(part.x.size, even.x.size)
    if count < MIN_TRACE_SAMPLES and not is_scan:
        raise PatchfemError(
            f"{part.source}: {count} samples; the parameters need at least {MIN_TRACE_SAMPLES}"
        )
    primary, form_name = subtract_form(even, form)
    if short is not None:
        # The filter changes the plane or line, so the form is subtracted again after it.
        primary = subtract_form(filter_surface(primary, short)[0], form)[0]
    # A straight line has heights of round-off, of which parameters would be made.
    if np.nanmax(np.abs(primary.z)) <= HEIGHT_ROUND_OFF * np.nanmax(np.abs(even.z)):
        primary = replace(primary, z=frozen_array(primary.z * 0.0))

    # Without a cut-off, the primary profile or the levelled scan is evaluated.
    waviness, roughness = (None, None) if cutoff is None else filter_surface(primary, cutoff)
    evaluated = roughness or primary
    if is_scan:
        parts = evaluated
        quantities, notes = _measure_scan(evaluated)
    else:
        parts = TraceParts(primary, waviness, roughness, wave_spectrum(primary, is_tapered=True))
        quantities, notes = _measure_trace(parts, cutoff)

    return RoughnessReport(
        source=even.source,
        sampling=Sampling(float(np.ptp(even.x)), measure_step(even.x), even.z.shape),
        treatment=Treatment(form_name, short, cutoff, window),
        values=tuple(quantities),
        notes=even.notes + _describe_spikes(part) + notes,
        surface=parts,
        heights=evaluated.z[~evaluated.missing],
    )


def _measure_trace(
    parts: TraceParts, cutoff: float | None
) -> tuple[list[Quantity], tuple[str, ...]]:
    """Return the parameters of both profiles of a trace, and a note if there are few sections.

    `parts` has the levelled (primary) profile, its spectrum, and the roughness profile for this `cutoff` [m], None
    without one.
    """
    primary = parts.primary
    values = compute_parameters(primary.z, primary.step)
    del values["z"]  # of one section, which is Pt
    quantities = [
        _name_value(f"P{name}", value, *PROFILE_DEFINITIONS[name], "levelled trace")
        for name, value in values.items()
    ]
    has_band = 2 * WAVE_BAND[1] <= primary.length and WAVE_BAND[0] >= 2 * primary.step
    amplitude = parts.spectrum.measure_band() if has_band else None
    name = "band_amplitude"
    reason = "" if has_band else "band"
    quantities.append(Quantity(amplitude, None, None, *WAVES_DEFINITIONS[name], reason, name))
    rough = parts.roughness
    if rough is None:
        return quantities, ()

    # The interval is that of a mean over sections by Student's t of its logarithm.
    errors = estimate_errors(rough.z, primary.step, cutoff)
    n_sections = rough.z.size // round(cutoff / primary.step)
    # Probability of a true value below, and above, the interval of a parameter
    student = special.stdtrit(max(n_sections - 1, 1), 1 - 0.05)
    for name, value in compute_parameters(rough.z, primary.step, cutoff).items():
        long_name = name if name.startswith("Mr") else f"R{name}"
        quantity = _name_value(long_name, value, *PROFILE_DEFINITIONS[name], "roughness profile")
        if value and errors.get(name):
            factor = float(np.exp(student * errors[name] / value))
            # A material ratio is at most 1.
            high = min(value * factor, 1.0) if name.startswith("Mr") else value * factor
            quantity = quantity._replace(low=value / factor, high=high)
        elif (
            value is not None
            and n_sections < MIN_SECTIONS
            and name not in PARAMETERS_WITHOUT_INTERVAL
        ):
            quantity = quantity._replace(reason="sections")
        quantities.append(quantity)
    if n_sections >= MIN_SECTIONS:
        return quantities, ()
    note = (
        f"{primary.source}: without half a cut-off at each end, {format_length(rough.length)} are left, which hold "
        f"{n_sections} whole sections of {format_length(cutoff)}, but ISO 21920 needs one, and intervals {MIN_SECTIONS}: "
        f"evaluate at least {format_length((MIN_SECTIONS + 1) * cutoff)}, or take a shorter cut-off"
    )
    return quantities, (note,)


def _measure_scan(scan: Areal) -> tuple[list[Quantity], tuple[str, ...]]:
    """Return the parameters of a scan, and a note on missing heights."""
    count = int(scan.missing.sum())
    if count == scan.z.size:
        raise PatchfemError(
            f"{scan.source}: no measured height is left within half a cut-off of the borders; "
            "give a shorter cut-off"
        )
    steps = (measure_step(scan.y), measure_step(scan.x))
    quantities = []
    for name, value in compute_areal_parameters(scan.z, steps).items():
        number, reason = (None, value) if isinstance(value, str) else (value, "")
        quantities.append(Quantity(number, None, None, *AREAL_DEFINITIONS[name], reason, name))
    note = f"{scan.source}: {count} of {scan.z.size} heights are missing and are left out"
    return quantities, (note,) if count else ()


def _name_value(name: str, value: float | None, unit: str, text: str, profile: str) -> Quantity:
    """Return the value of a parameter of a profile as a quantity.

    `name`, `unit` and `text` (the definition) are those of the parameter, `profile` names the profile. Where it has no
    value, the quantity has the code of the reason.
    """
    reason = "undetermined" if value is None else ""
    return Quantity(value, None, None, unit, f"{text}, of the {profile}", reason, name)


def fitting_cutoff(length: float, step: float) -> float | None:
    """Return the longest standard cut-off [m] that a trace of this length and step [m] allows."""
    # Smallest length of a trace in cut-offs: five are evaluated, and the filter trims one in total.
    longest = length * (1 + 1e-9) / 6
    return max((each for each in STANDARD_CUTOFFS if 4 * step <= each <= longest), default=None)


def crop(surface: Profile | Areal, *ends: float) -> Profile | Areal:
    """Cut out the part of a surface between given positions [m].

    As between the cursors of an instrument, it runs from the last sample at or before the first
    position to the last at or before the second. Raises PatchfemError for a window that is reversed
    or not within the surface.

    Parameters
    ----------
    surface : Profile or Areal
        Trace or scan.
    *ends : float
        First and last position [m] along x of a trace, or of a scan the same along x and then along y.

    Returns
    -------
    Profile or Areal
    """
    names = "xy" if isinstance(surface, Areal) else "x"
    if len(ends) != 2 * len(names):
        raise PatchfemError(
            f"{surface.source}: a window needs a first and a last position along {' and along '.join(names)}"
        )

    axes = {}
    parts = []
    for name, first, last in zip(names, ends[::2], ends[1::2]):
        axis = getattr(surface, name)
        near = 1e-6 * measure_step(axis)
        if not axis[0] - near <= first < last <= axis[-1] + near:
            raise PatchfemError(
                f"{surface.source}: the window runs from {format_length(first)} to {format_length(last)}, but the "
                f"surface along {name} from {format_length(axis[0])} to {format_length(axis[-1])}"
            )

        # A position that differs from a sample by round-off counts as this sample.
        low, high = np.maximum(np.searchsorted(axis, np.add((first, last), near), "right") - 1, 0)
        if low == high:
            raise PatchfemError(
                f"{surface.source}: the window contains a single sample along {name}; take a longer one"
            )
        parts.append(slice(low, high + 1))
        axes[name] = axis[parts[-1]]

    # Rows of the heights are along y.
    return replace(surface, **axes, z=surface.z[tuple(reversed(parts))])


def _describe_spikes(surface: Profile | Areal) -> tuple[str, ...]:
    """Describe the spikes of a surface in a sentence, or return () if there are none."""
    is_spike = find_scan_spikes(surface) if isinstance(surface, Areal) else find_spikes(surface)
    if not is_spike.any():
        return ()
    place = format_length(surface.x[np.argwhere(is_spike)[0][-1]])
    note = (
        f"{surface.source}: {is_spike.sum()} of {is_spike.size} heights are spikes (the first at x = {place}), which count "
        "in every parameter"
    )
    return (note,)
