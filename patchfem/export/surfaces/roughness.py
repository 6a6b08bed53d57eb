"""Roughness of one or several surfaces as lines of text, as a dict and as a page."""

from html import escape
from pathlib import Path

import numpy as np

from ... import __version__
from ...core import PatchfemError
from ...disk.atomic_write import write_rows, write_text
from ...formatting import UNIT_LADDERS, choose_unit, format_length, format_number
from ...surface.roughness.means import KINDS, Means, average_reports
from ...surface.roughness.peaks import TraceMoments, trace_moments
from ...surface.roughness.report import RoughnessReport, fitting_cutoff
from ...surface.roughness.spectrum import BAND
from ..pages.document import (
    Section,
    document_html,
    figure_html,
    sentence_html,
    table_html,
    warning_box,
)
from . import asperities, pictures
from .areal import write_columns, write_profile, write_x3p
from .pictures import Picture
from .quantities import QuantityTable, Row, csv_columns, format_quantity

# Parameters that are lengths along the surface; all other lengths are heights.
LATERAL_PARAMETERS = (
    "PSm",
    "RSm",
    "dominant_wavelength",
    "Sal",
)
INTERVAL_NOTE = (
    "Interval: 90 % interval (from 5 % to 95 %) of the mean over all {} of this {}, for a surface with Gaussian "
    "heights and the spectrum of this {}. A kurtosis above 3 makes the interval wider. The interval does not hold for "
    "a surface that differs from place to place."
)
SCAN_INTERVAL_NOTE = INTERVAL_NOTE.format("scans", "size", "scan")
TRACE_INTERVAL_NOTE = INTERVAL_NOTE.format("traces", "length", "trace")
MEANS_NOTE = (
    "Interval: 95 % interval of the mean, by Student's t from the scatter of the files, each with "
    "equal weight. The interval does not include an error common to all files, such as "
    "calibration. Scatter: standard deviation of the values of single files."
)


def _parameter_units(report: RoughnessReport) -> dict:
    """Return the unit (name, scale) of each roughness parameter.

    All heights have the same unit, and so have all lengths along the surface.
    """
    rms = report["Sq" if report.kind == "areal" else "Pq"].value
    lengths = [
        value.value
        for value in report.values
        if value.name in LATERAL_PARAMETERS and value.value is not None
    ]
    lateral = choose_unit(UNIT_LADDERS["m"], max(lengths, default=1e-3))
    vertical = choose_unit(UNIT_LADDERS["m"], 3 * rms)
    units = {}
    for value in report.values:
        units[value.name] = lateral if value.name in LATERAL_PARAMETERS else vertical
        if value.unit == "1":
            units[value.name] = ("", 1.0)
    return units


def _parameters_table(report: RoughnessReport) -> QuantityTable:
    """Return the table of the roughness parameters of a surface."""
    units = _parameter_units(report)
    rows = []
    for value in report.values:
        reason = value.reason if value.value is None else ""
        rows.append(Row(value.name, value, units[value.name], remark=reason, meaning=reason))
    return QuantityTable(("parameter", "value", "90 %: from .. to", "unit"), rows)


def describe_surface(report: RoughnessReport) -> str:
    """Describe the size, window and filters of a measured surface in one line."""
    size = report.sampling
    treatment = report.treatment
    shape = " x ".join(map(str, size.shape))
    text = f"{shape} heights"
    if size.measured not in (None, size.shape[-1]):
        text = f"{size.measured} heights, resampled to {shape}"
    text += f", {format_length(size.length)} long, every {format_length(size.step)}"
    if treatment.window is not None:
        ends = [
            f"{format_length(low)} to {format_length(high)}"
            for low, high in zip(treatment.window[::2], treatment.window[1::2])
        ]
        text += (
            f", window {ends[0]}" if len(ends) == 1 else f", window {ends[0]} in x, {ends[1]} in y"
        )
    text += f", about the least-squares {treatment.form}"
    if report.kind == "areal":
        return text + _areal_filters(
            treatment.short, treatment.cutoff, has_holes=bool(np.isnan(report.surface.z).any())
        )
    s_filter = (
        f"S-filter at {format_length(treatment.short)}, half this length trimmed at each end"
        if treatment.short
        else ""
    )
    if treatment.cutoff is not None:
        cutoff = f"Gaussian filter at {format_length(treatment.cutoff)}, half this length trimmed at each end"
        return f"{text}; {cutoff}, {s_filter or 'no filter for short waves'}"
    # The trace is longer than its last position by one sampling interval.
    fitting = fitting_cutoff(size.length + size.step, size.step)
    advice = "; no standard cut-off fits five times into the trace once half of it is trimmed at each end"
    if fitting:
        advice = (
            f' (--cutoff "{format_length(fitting)}" is the longest standard cut-off of which five fit '
            "into the trace once half a cut-off is trimmed at each end)"
        )
    return f"{text}; no cut-off, so no roughness profile{advice}" + (
        f"; {s_filter}" if s_filter else ""
    )


def _areal_filters(short_length: float | None, cutoff: float | None, *, has_holes: bool) -> str:
    """Return the names of the filters of a scan and of the surface that results from them."""
    parts = [
        f"{name}-filter at {format_length(length)}"
        for name, length in (("S", short_length), ("L", cutoff))
        if length
    ]
    if not parts:
        return "; no filter"
    surface = ""
    if short_length:
        surface = " (the S-L surface)" if cutoff else " (the S-F surface)"
    lengths = "each length" if len(parts) > 1 else "this length"
    holes = (
        "; near a hole the filter weights of the measured heights are scaled to a sum of one"
        if has_holes
        else ""
    )
    return (
        f"; Gaussian {' and '.join(parts)}{surface}, half {lengths} trimmed at each border{holes}"
    )


def format_roughness(report: RoughnessReport, *, verbose: bool = False) -> list:
    """Return the report as lines: a table of the parameters, with their definitions if verbose."""
    out = [f"{report.source}: {describe_surface(report)}", *_parameters_table(report).lines()]
    if verbose:
        out += [f"  {value.name}: {value.text}" for value in report.values]
    out += [
        f"  no interval of {', '.join(names)}: {reason}"
        for reason, names in _names_by_reason(report).items()
    ]
    return out + _asperity_lines(report)


def _profile_moments(report: RoughnessReport) -> TraceMoments | None:
    """Return the moments of the primary profile below the cut-off, or None if there are none."""
    try:
        return trace_moments(report.surface.primary, report.treatment.cutoff)
    except PatchfemError:
        return None


def _asperity_lines(report: RoughnessReport) -> list:
    """Return the asperities of a trace as lines of text."""
    if report.kind == "areal":
        return []
    return asperities.format_asperities(_profile_moments(report), report.treatment.cutoff)


def means_lines(reports: list) -> list:
    """Return the means of the parameters over several files as lines of text.

    For two traces they include the asperities of both faces combined.
    """
    out = []
    if len(reports) == 2 and all(report.kind == "profile" for report in reports):
        first, second = map(_profile_moments, reports)
        both = first.combine(second) if first and second else None
        out = ["", "Both surfaces as the two faces of one contact:"]
        out += asperities.format_asperities(both, reports[0].treatment.cutoff)
    for means in average_reports(reports):
        out += ["", _means_heading(means), *_means_table(means).lines()]
        if means.caution:
            out.append(f"  {means.caution}")
    return out


def _means_heading(means: Means) -> str:
    """Return the heading of the means of the parameters over several files."""
    return f"Mean of {means.count} {KINDS[means.kind]}"


def _means_table(means: Means) -> QuantityTable:
    """Return the table of the means of the parameters over several files."""
    rows = []
    for name, average in means.values.items():
        unit = ("", 1.0)
        if average.mean.unit != "1":
            unit = choose_unit(UNIT_LADDERS[average.mean.unit], average.mean.value)
        rows.append(Row(name, average.mean, unit, (format_number(average.scatter * unit[1], 3),)))
    return QuantityTable(("parameter", "mean", "95 %: from .. to", "scatter", "unit"), rows)


def means_data(reports: list) -> list:
    """Return the means of the parameters over several files as a list of dicts in SI units."""
    out = []
    for means in average_reports(reports):
        measures = {}
        for name, average in means.values.items():
            value, low, high, unit = average.mean[:4]
            measures[name] = {
                "value": value,
                "low": low,
                "high": high,
                "unit": unit,
                "scatter": average.scatter,
            }
        notes = [means.caution] if means.caution else []
        out.append(
            {
                "kind": means.kind,
                "files": means.count,
                "confidence": 0.95,
                "notes": notes,
                "measures": measures,
            }
        )
    return out


def write_csv(path: Path, reports: list) -> None:
    """Write a row for each file: its parameters and their bounds in SI, with "" for missing numbers."""
    tables = [{value.name: value._asdict() for value in report.values} for report in reports]
    columns = csv_columns(tables)
    lines = [["file", *columns.heads]]
    for report, cells in zip(reports, columns.cells):
        lines.append([report.source, *cells])
    write_rows(path, lines)


def write_surfaces(folder: Path, reports: list) -> None:
    """Write the heights from which the parameters are computed into `surfaces`.

    For a trace these are `primary.csv` and, with a cut-off, `roughness.csv`; for a scan
    `surface.x3p` and `surface.csv`. With several files the number of the file is appended to the
    name.
    """
    folder = folder / "surfaces"
    folder.mkdir()
    for number, report in enumerate(reports, 1):
        suffix = f"-{number}" if len(reports) > 1 else ""
        surface = report.surface
        if report.kind == "areal":
            title = f"{Path(report.source).name}: {describe_surface(report)}"
            write_x3p(folder / f"surface{suffix}.x3p", surface.x, surface.y, surface.z, title)
            write_columns(folder / f"surface{suffix}.csv", surface.x, surface.y, surface.z)
            continue
        write_profile(folder / f"primary{suffix}.csv", surface.primary.x, surface.primary.z)
        if surface.roughness is not None:
            write_profile(
                folder / f"roughness{suffix}.csv", surface.roughness.x, surface.roughness.z
            )


def _names_by_reason(report: RoughnessReport) -> dict:
    """Group the roughness parameters that have no interval by the reason."""
    out: dict = {}
    for value in report.values:
        if value.value is not None and value.low is None and value.reason:
            out.setdefault(value.reason, []).append(value.name)
    return out


def roughness_data(report: RoughnessReport) -> dict:
    """Return the roughness of a surface as a dict in SI units."""
    measures = {}
    for value in report.values:
        measures[value.name] = {
            "value": value.value,
            "low": value.low,
            "high": value.high,
            "unit": value.unit,
        }
        if value.reason:
            measures[value.name]["reason"] = value.reason
    treatment = report.treatment
    out = {
        "file": report.source,
        "kind": report.kind,
        "length": report.sampling.length,
        "step": report.sampling.step,
        "shape": list(report.sampling.shape),
        "cutoff": treatment.cutoff,
        "window": None if treatment.window is None else list(treatment.window),
        "form": treatment.form,
        "s_filter": treatment.short,
        "confidence": 0.9,
        "measures": measures,
        "notes": list(report.notes),
    }
    if report.kind == "profile":
        out["band"] = list(BAND)
        out["asperities"] = asperities.asperity_data(_profile_moments(report), treatment.cutoff)
    return out


def page_html(reports: list) -> str:
    """Return the self-contained page of one or several surfaces."""
    title = "Roughness of " + ", ".join(Path(report.source).name for report in reports)
    sections = [_means_section(means) for means in average_reports(reports)]
    sections += [_surface_section(number, report) for number, report in enumerate(reports)]
    return document_html(title, f"<p class=soft>patchfem {escape(__version__)}</p>", sections)


def write_page(path: Path, reports: list) -> None:
    """Write the page of one or several surfaces."""
    write_text(path, page_html(reports))


def _means_section(means: Means) -> Section:
    """Return the page section with the means of the parameters over several files."""
    caution = (
        warning_box([f"{means.caution[0].upper()}{means.caution[1:]}."]) if means.caution else ""
    )
    body = f"{caution}{_means_table(means).html()}<p class=soft>{sentence_html(MEANS_NOTE)}</p>"
    return Section(f"mean-{means.kind}", _means_heading(means), body)


def _surface_section(number: int, report: RoughnessReport) -> Section:
    """Return the page section with the parameters and pictures of a surface."""
    parts = [
        f"<p class=verdict>{_verdict_sentence(report)}</p>",
        f"<p class=soft>{escape(describe_surface(report))}.</p>",
        warning_box([f"{text}." for text in report.notes]),
    ]
    drawn = _scan_pictures(report) if report.kind == "areal" else _trace_pictures(report)
    parts += [figure_html(f"{number}{place}", *picture) for place, picture in enumerate(drawn)]
    parts.append(f"<h3>Parameters</h3>{_parameters_table(report).html()}")
    if any(value.low is not None for value in report.values):
        parts.append(
            f"<p class=soft>{SCAN_INTERVAL_NOTE if report.kind == 'areal' else TRACE_INTERVAL_NOTE}</p>"
        )
    for reason, names in _names_by_reason(report).items():
        parts.append(
            f"<p class=soft>No interval of {escape(', '.join(names))}: {sentence_html(reason)}.</p>"
        )
    definitions = [[escape(value.name), sentence_html(value.text)] for value in report.values]
    parts.append(f"<h3>Definitions</h3>{table_html(('', ''), definitions)}")
    if report.kind == "profile":
        parts.append(f"<pre>{escape(chr(10).join(_asperity_lines(report)))}</pre>")
    return Section(f"surface{number}", report.source, "\n".join(parts))


def _verdict_sentence(report: RoughnessReport) -> str:
    """Return the main roughness parameters of a surface as a sentence of HTML."""
    if report.kind == "areal":
        names = ("Sa", "Sq", "Sz", "Ssk")
    else:
        names = ("Pa", "Pq", "Pt") if report.treatment.cutoff is None else ("Ra", "Rz", "RSm")
        names += ("dominant_wavelength", "band_amplitude")
    spans = [
        f"<span class=v><b>{escape(name.replace('_', ' '))}</b> "
        f"{escape(_format_parameter(report, name))}</span>"
        for name in names
        if report[name].value is not None
    ]
    return "; ".join(spans) + "."


def _format_parameter(report: RoughnessReport, name: str) -> str:
    """Format a roughness parameter with its interval."""
    return format_quantity(report[name]).long


def _scan_pictures(report: RoughnessReport) -> list:
    """Draw the pictures of a scan."""
    surface = report.surface
    heights = Picture(
        pictures.draw_scan(surface.x, surface.y, surface.z),
        "Heights from which the parameters are computed, and their distribution; the colours leave "
        "out the outermost 0.2 % of the points.",
        f"Map and histogram of the heights of {report.source}: {_format_parameter(report, 'Sq')} root mean "
        "square",
    )
    bearing = Picture(
        pictures.draw_charts([pictures.abbott_core_chart(report.heights, ("Smr1", "Smr2"))]),
        "Abbott curve of these heights; dashed: the straight line of its core.",
        f"Abbott curve of {report.source}: core height {_format_parameter(report, 'Sk')}",
    )
    return [heights, bearing]


def _trace_pictures(report: RoughnessReport) -> list:
    """Draw the pictures of a trace."""
    parts = report.surface
    cutoff = report.treatment.cutoff
    waviness = "no cut-off was given" if cutoff is None else "the waviness drawn on it"
    kind = "levelled trace" if cutoff is None else "roughness profile"
    out = [
        Picture(
            pictures.draw_trace(parts.primary, parts.waviness),
            f"Trace about the least-squares {report.treatment.form}; {waviness}.",
            f"Heights of {report.source} along x: {_format_parameter(report, 'Pt')} from the deepest valley to "
            "the highest peak",
        )
    ]
    if cutoff is not None:
        ends = (parts.primary.x[0], parts.primary.x[-1])
        out.append(
            Picture(
                pictures.draw_roughness(parts.roughness, ends, cutoff),
                f"Roughness: the trace minus the waviness, in sections of {format_length(cutoff)}; half a "
                "section is trimmed at each end.",
                f"Roughness profile: Rq {_format_parameter(report, 'Rq')}",
            )
        )
    tapers = parts.spectrum.tapers
    out.append(
        Picture(
            pictures.draw_statistics(report.heights, parts.spectrum, BAND, cutoff),
            f"Left: Abbott curve of the {kind}; dashed: the straight line of its core. Right: "
            f"spectrum of the levelled trace, the mean of {tapers} sine tapers, with its 95 % band "
            f"by chi-square of {2 * tapers} degrees of freedom.",
            "Abbott curve and power spectral density; the dominant wavelength is "
            f"{_format_parameter(report, 'dominant_wavelength')}",
        )
    )
    return out
