"""Everything that a trace or an areal scan tells about its roughness, in one frozen record."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..profile import Profile, even, spikes
from ..quantity import Quantity, refused
from ..spikes import spikes_of
from . import rows
from .areal import Surface, lacking
from .areal_intervals import areal_intervals
from .filter import filtered, filtered_scan
from .form import degree_of, without_form
from .intervals import LATERAL, SIZES, Intervals
from .parameters import Heights, abbott
from .spectrum import BAND, amplitude_of, refuse_band, spectrum_of
from .tip import Tip, tip_check

FEWEST = 16  # samples of a trace with a report
UNTOLD = "a single trace gives no interval for this parameter"
UNEVEN = ("an interval from a single trace assumes Gaussian heights, but these heights are not Gaussian; use the "
          "scatter of several traces")
UNDETERMINED = "the heights of the trace do not determine this parameter"
CUTOFFS = (25e-6, 80e-6, 250e-6, 800e-6, 2.5e-3, 8e-3, 25e-3)  # [m] of ISO 21920-3, and one more at each end
SECTIONS = 6  # cut-offs in a trace: five that count and one that the filter takes
ROUND = 1e-14  # of the largest height: what levelling leaves of a straight line
LONG = ("the trace is shorter than four wavelengths of its strongest wave, so a longer trace would give a different "
        "value")
class Settings(NamedTuple):
    """What is taken off a surface before its parameters are read, and where two of them are read.

    form: degree of a polynomial or "cylinder" (`without_form`); short [m]: nesting index of the S-filter, None for
    none; level [m] and ratios [1] of the material ratio and of the height between two (`Heights`).
    """

    form: int | str = 1
    short: float | None = None
    level: float = 0.0
    ratios: tuple = (0.1, 0.9)


NOTHING = Settings()


@dataclass(frozen=True, eq=False)
class RoughnessReport:
    """What `report_of` found.

    values: tuple of Quantity, each with its name; length [m]; shape: samples, along y first; step [m] between samples;
    form: the name of what was subtracted first; cutoff, window [m] or None; band: wavelengths [m] of band_amplitude;
    notes: sentences about the file and what was done to it; tip: the stylus against the valleys, or None;
    abbott: (ratio, height) of the roughness, of the primary without one, of the scan, and its core. Of
    traces only: primary, the trace without form; waviness, roughness, None without a cut-off; spectrum of the primary.
    scan: the areal scan that the parameters are read from. measured: heights of a trace before it was resampled.
    """

    source: str
    kind: str
    length: float
    shape: tuple
    step: float
    values: tuple
    notes: tuple
    form: str
    settings: Settings
    cutoff: float | None = None
    window: tuple | None = None
    band: tuple = BAND
    tip: Tip | None = None
    primary: Profile | None = None
    waviness: Profile | None = None
    roughness: Profile | None = None
    abbott: tuple | None = None
    core: tuple | None = None
    spectrum: object | None = None
    scan: Areal | None = None
    measured: int | None = None

    def __getitem__(self, name: str) -> Quantity:
        """The parameter of this name."""
        return next(one for one in self.values if one.name == name)


def report_of(surface: Profile | Areal, cutoff: float | None = None, window: tuple | None = None,
              tip: float | None = None, band: tuple = BAND, settings: Settings = NOTHING) -> RoughnessReport:
    """Parameters of a trace or of an areal scan with the intervals that one measurement of its size allows.

    cutoff [m]: between waviness and roughness, of a scan the nesting index of its L-filter; without it there is the
    primary profile or the S-F surface alone. window: (first, last) [m] on the x axis of the file, as cursors, of a scan
    (first, last, first, last) on x and y (`windowed`). tip [m]: radius of the stylus, by default that of the file. band
    [m]: wavelengths of band_amplitude. A trace of a million samples: 1.2 s. PatchfemError for fewer than 16 samples, a
    window beyond the trace, a cut-off that does not fit, or a window of a scan with less than four places.
    """
    if isinstance(surface, Areal):
        return _of_scan(surface if window is None else windowed(surface, *window), cutoff, settings, window)
    cut = surface if window is None else windowed(surface, *window)
    trace = _enough(even(_enough(cut)))
    primary, form, found = _primary(trace, band, settings)
    heights, spectrum = found.heights, found.spectrum
    values = [_value(row, row.of(heights), found) for row in rows.PRIMARY]
    values += [_waves(row, trace.source, found) for row in rows.WAVES]
    waviness = roughness = rough = None
    if cutoff is not None:
        waviness, roughness = filtered(primary, cutoff)
        rough = replace(heights, z=roughness.z, section=cutoff)
        inner = Intervals(rough, None)
        values += [_value(row, row.of(rough), inner) for row in rows.ROUGH]
    if window is not None:
        values += [_value(row, _ends(trace) if row.of is None else row.of(heights), found) for row in rows.WINDOW]
    shown, radius = rough or heights, surface.tip_radius if tip is None else tip
    stylus = None if radius is None else tip_check(heights, radius)
    notes = trace.notes + _resampled(cut, trace, primary, settings) + _spiky(cut)
    notes += () if roughness is None else _short(roughness, cutoff)
    return RoughnessReport(
        trace.source, "profile", trace.length, (trace.x.size,), heights.step, tuple(values), notes, form, settings,
        cutoff, window, band, stylus, primary, waviness, roughness, abbott(shown), shown.core,
        spectrum, measured=cut.x.size)


def fitting_cutoff(length: float, step: float) -> float | None:
    """The longest standard cut-off [m] with five sections in a trace of this length [m] and step [m], or None."""
    return max((one for one in CUTOFFS if SECTIONS * one <= length * (1 + 1e-9) and one >= 4 * step), default=None)


def windowed(surface: Profile | Areal, *ends: float) -> Profile | Areal:
    """The part of a trace between two cursors [m], of a scan between two along x and two along y, as an instrument
    takes it: from the last sample at or before the one to the last at or before the other, both included.

    PatchfemError for a window that turns back or does not lie within the trace or scan.
    """
    scan = isinstance(surface, Areal)
    if len(ends) != (4 if scan else 2):
        raise PatchfemError(f"{surface.source}: a window of " + (
            "an areal scan needs four "
            "positions: from and to in x, from and to in y" if scan else "a trace needs two positions: from and to"))
    parts = [_between(surface.source, axis, *ends[2 * k:2 * k + 2], "xy"[k] if scan else "")
             for k, axis in enumerate((surface.x, surface.y) if scan else (surface.x,))]
    axes = {name: getattr(surface, name)[one] for name, one in zip("xy", parts)}
    return replace(surface, z=surface.z[tuple(parts[::-1])], **axes)


def _between(source: str, axis, first: float, last: float, name: str) -> slice:
    near = 1e-6 * float(axis[-1] - axis[0]) / (axis.size - 1)
    if not first < last or first < axis[0] - near or last > axis[-1] + near:
        what = f"scan runs in {name}" if name else "trace runs"
        raise PatchfemError(f"{source}: the window runs from {say(first)} to {say(last)}, but the {what} from "
                            f"{say(axis[0])} to {say(axis[-1])}")
    low, high = (max(int(np.searchsorted(axis, at + near, "right")) - 1, 0) for at in (first, last))
    return slice(low, high + 1)


def interval_of(name: str, profile: Profile, cutoff: float | None = None, band: tuple = BAND) -> Quantity:
    """One parameter of a trace with its interval; names as in `rows`, those of the roughness need a cut-off [m]."""
    row = rows.TABLE.get(name)
    if row is None or row in rows.AREAL or row in rows.WINDOW:
        known = ", ".join(each.name for each in (*rows.PRIMARY, *rows.WAVES, *rows.ROUGH))
        raise PatchfemError(f"'{name}' is not a parameter of a trace; use one of {known}")
    trace = _enough(even(_enough(profile)))
    if row not in rows.ROUGH:
        found = _primary(trace, band)[2]
        return _waves(row, trace.source, found) if row in rows.WAVES else _value(row, row.of(found.heights), found)
    if cutoff is None:
        raise PatchfemError(f"{profile.source}: {name} belongs to the roughness profile and needs a cut-off")
    heights = Heights(filtered(_primary(trace, band)[0], cutoff)[1].z, trace.length / (trace.x.size - 1), cutoff)
    return _value(row, row.of(heights), Intervals(heights, None))


def _enough(trace: Profile) -> Profile:
    if trace.x.size < FEWEST:
        count = f"{trace.x.size} sample{'s' * (trace.x.size != 1)}"
        raise PatchfemError(f"{trace.source}: {count}; the parameters need at least {FEWEST}")
    return trace


def _primary(trace: Profile, band: tuple, settings: Settings = NOTHING) -> tuple:
    """The trace without form and without the waves of the S-filter, the name of the form, and its `Intervals`.

    A Gaussian filter keeps a polynomial one of its degree, so that the form may go first and again behind it.
    """
    flat, form = without_form(trace, settings.form)
    if settings.short is not None:
        flat = without_form(filtered(flat, settings.short)[0], settings.form)[0]
    if np.ptp(flat.z) <= ROUND * np.abs(trace.z).max():
        flat = replace(flat, z=frozen_array(np.zeros(flat.z.size)))
    heights = Heights(flat.z, trace.length / (trace.x.size - 1), None, settings.level, settings.ratios)
    spectrum = spectrum_of(heights.z, heights.step)
    return flat, form, Intervals(heights, degree_of(settings.form), spectrum, band)


def _value(row, value, found: Intervals) -> Quantity:
    low, high = found.of(row, value)
    reason = ""
    if value is None:
        flat = found.heights.power == 0
        reason = "the trace is flat" if flat else "the trace is shorter than one cut-off" \
            if found.heights.section is not None and not len(found.heights.sections) else UNDETERMINED
    elif row.kind == "wave" and low is not None and not (
            found.heights.step <= low <= value <= high <= found.heights.length):
        low, high, reason = None, None, UNTOLD
    if value is not None and low is None and not reason and found.heights.power:
        reason = UNEVEN if found.uneven and row.kind not in ("", *LATERAL) else \
            LONG if found.long and row.kind in SIZES else UNTOLD
    return Quantity(value, low, high, row.unit, _text(row, found.heights), reason, row.name)


def _text(row, heights: Heights | Surface) -> str:
    first, second = (f"{100 * one:g} %" for one in heights.ratios)
    return row.text.format(level=say(heights.level), first=first, second=second)


def _waves(row, source: str, found: Intervals) -> Quantity:
    if row.name == "dominant_wavelength":
        return _value(row, found.spectrum.dominant, found)
    low, high = found.band
    text = row.text.replace("the band", f"{say(low)} to {say(high)}")
    try:
        refuse_band(source, low, high, found.heights.length - found.heights.step, found.heights.step)
    except PatchfemError as error:
        return refused(row.unit, text, str(error))._replace(name=row.name)
    return _value(row._replace(text=text), amplitude_of(found.spectrum, low, high), found)


def _ends(trace: Profile) -> float:
    return float(trace.z[-1] - trace.z[0])


def _spiky(surface: Profile | Areal) -> tuple:
    """What is to be said of the spikes of a trace or of a scan, () for nothing."""
    found = spikes_of(surface) if isinstance(surface, Areal) else spikes(surface)
    if not found.any():
        return ()
    *row, column = np.argwhere(found)[0]
    place = f"x = {say(surface.x[column])}" + "".join(f", y = {say(surface.y[k])}" for k in row)
    what, counts = (f"is a spike (at {place}),", "which counts") if found.sum() == 1 else \
        (f"are spikes (the first at {place}),", "which count")
    return (f"{surface.source}: {found.sum()} of {found.size} heights {what} {counts} in every parameter",)


def _resampled(cut: Profile, trace: Profile, primary: Profile, settings: Settings) -> tuple:
    """By how much the mean heights hang on the resampling of an uneven trace, () of an even or S-filtered one.

    Straight lines between samples cut tops and valleys off: beside them stand the file's own heights, each weighted by
    the length that it stands for, about the same form.
    """
    if trace.x.size == cut.x.size or settings.short is not None:
        return ()
    there = ~cut.missing
    x, z = cut.x[there], cut.z[there]
    weight, z = np.gradient(x), z - np.interp(x, trace.x, trace.z - primary.z)
    weight, z = weight / weight.sum(), z - weight @ z / weight.sum()
    own = {"Pa": float(weight @ np.abs(z)), "Pq": float(np.sqrt(weight @ z**2))}
    here = {"Pa": float(np.abs(primary.z).mean()), "Pq": float(np.sqrt(np.mean(primary.z**2)))}
    if min(own.values()) <= 0:
        return ()
    told = " and ".join(f"{name} by {100 * abs(here[name] / own[name] - 1):.2g} %" for name in own)
    return (f"{trace.source}: resampling changes {told}, compared with the heights of the file weighted by the length "
            "that each stands for; no interval includes this error",)


def _short(roughness: Profile, cutoff: float) -> tuple:
    """What is to be said of a roughness profile that is shorter than one section, () where it is not."""
    if roughness.length >= cutoff * (1 - 1e-9):
        return ()
    return (f"{roughness.source}: half a cut-off is trimmed at each end, and the {say(roughness.length)} that remain "
            f"are shorter than one section of {say(cutoff)}, the least that ISO 21920 needs; do not use these "
            "roughness parameters: evaluate a longer part, or take a shorter cut-off",)


def _of_scan(scan: Areal, cutoff: float | None, settings: Settings, window=None) -> RoughnessReport:
    flat, form = without_form(scan, settings.form)
    if settings.short is not None:
        flat = without_form(filtered_scan(flat, settings.short)[0], settings.form)[0]
    if cutoff is not None:
        flat = filtered_scan(flat, cutoff)[1]
    if np.isnan(flat.z).all():
        raise PatchfemError(f"{scan.source}: no measured height is left within half a cut-off of the borders")
    if np.nanmax(flat.z) - np.nanmin(flat.z) <= ROUND * np.nanmax(np.abs(scan.z)):
        flat = replace(flat, z=frozen_array(flat.z * 0.0))
    steps = tuple(float(axis[-1] - axis[0]) / (axis.size - 1) for axis in (flat.y, flat.x))
    surface = Surface(flat.z, steps, settings.level, settings.ratios)
    found = {row.name: row.of(surface) for row in rows.AREAL}
    bounds, uneven = areal_intervals(flat.z, found)
    values = tuple(Quantity(found[name], *bounds[name], row.unit, _text(row, surface),
                            lacking(surface, name) if found[name] is None else
                            "" if bounds[name][0] is not None or not surface.heights.power else
                            (UNEVEN if uneven else UNTOLD).replace("trace", "scan"), name)
                   for row in rows.AREAL for name in (row.name,))
    lost = int(np.isnan(flat.z).sum())
    notes = scan.notes + _spiky(scan)
    if lost:
        notes += (f"{scan.source}: {lost} of {flat.z.size} heights are missing and are left out",)
    return RoughnessReport(scan.source, "areal", float(scan.x[-1] - scan.x[0]), scan.z.shape, steps[1], values, notes,
                           form, settings, cutoff, window, abbott=abbott(surface.heights), core=surface.heights.core,
                           scan=flat)
