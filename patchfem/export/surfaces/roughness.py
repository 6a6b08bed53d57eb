"""Roughness of one or several surfaces on paper: lines of text, plain data, a page that stands alone."""

from html import escape
from pathlib import Path

import numpy as np

from ... import __version__
from ...core import PatchfemError, say
from ...disk.whole import write_rows, write_text
from ...scales import LADDERS, plain, step_of
from ...surface.quantity import Mean, Quantity
from ...surface.roughness import means, peaks
from ...surface.roughness.report import RoughnessReport, fitting_cutoff
from ..pages.document import Section, document, figure, prose, table, warned
from . import asperities, pictures
from .areal import write_columns, write_profile, write_x3p

ALONG = ("PSm", "RSm", "dominant_wavelength", "Sal")  # lengths along the surface; all others are heights
AREAL = ("Interval: 90 % interval (from 5 % to 95 %) of the mean over all scans of this size, for a surface with "
         "Gaussian heights and the spectrum of this scan. A kurtosis above 3 makes the interval wider. The interval "
         "holds neither for a surface that differs from place to place nor for waves longer than the scan.")
MEANS = ("Interval: 95 % interval of the mean, by Student's t from the scatter of the files, each with equal weight. "
         "The interval does not include an error common to all files, such as calibration. Scatter: standard "
         "deviation of the values of "
         "single files.")
INTERVAL = ("Interval: 90 % interval (from 5 % to 95 %) of the mean over all traces of this length, for a surface with "
            "Gaussian heights and the spectrum of this trace. A kurtosis above 3 makes the interval wider. The "
            "interval does not hold for a surface that differs from place to place.")


def shown(one: Quantity, unit: tuple | None = None) -> tuple:
    """Value, interval and unit as texts; no interval is an empty text.

    unit: (name, scale) for a length, None for the one that suits the value. An angle is in degrees.
    """
    name, scale = ("", 1.0) if one.unit == "1" else ("deg", np.degrees(1.0)) if one.unit == "rad" else \
        unit or step_of(LADDERS[one.unit], one.value or 0.0)
    if one.value is None:
        return "none", "", ""
    interval = "" if one.low is None else f"{plain(one.low * scale, 3)} .. {plain(one.high * scale, 3)}"
    return plain(one.value * scale, 5), interval, name


def units_of(report: RoughnessReport) -> dict:
    """One unit (name, scale) for all heights of a report and one for all lengths along it, by parameter."""
    root = report["Sq" if report.kind == "areal" else "Pq"].value
    along = [one.value for one in report.values if one.name in ALONG and one.value is not None]
    units = step_of(LADDERS["m"], max(along, default=1e-3)), step_of(LADDERS["m"], 3 * root)
    return {one.name: units[one.name not in ALONG] for one in report.values}


def heading(report: RoughnessReport) -> str:
    """What was measured and how it was treated, in one line."""
    shape = " x ".join(str(count) for count in report.shape)
    text = f"{shape} heights" if report.measured in (None, report.shape[-1]) else \
        f"{report.measured} heights, resampled to {shape}"
    text += f", {say(report.length)} long, every {say(report.step)}"
    if report.window is not None:
        ends = [f"{say(low)} to {say(high)}" for low, high in zip(report.window[::2], report.window[1::2])]
        text += f", window {' in x, '.join(ends)}{' in y' * (len(ends) > 1)}"
    text += f", about the least-squares {report.form}"
    short = report.settings.short
    if report.kind == "areal":
        return text + _areal_filters(short, report.cutoff, bool(np.isnan(report.scan.z).any()))
    if report.cutoff is None:
        fits = fitting_cutoff(report.length + report.step, report.step)  # a step for each sample
        text += "; no cut-off, so no roughness profile" + (
            f' (--cutoff "{say(fits)}" is the longest standard cut-off of which five fit into the trace once half a '
            'cut-off is trimmed at each end)' if fits else
            "; no standard cut-off fits five times into the trace once half of it is trimmed at each end")
        return text + (f"; S-filter at {say(short)}, half this length trimmed at each end" if short else "")
    return (f"{text}; Gaussian filter at {say(report.cutoff)}, half this length trimmed at each end, "
            + (f"S-filter at {say(short)}, half this length trimmed at each end" if short else
               "no filter for short waves"))


def _areal_filters(short: float | None, cutoff: float | None, holes: bool) -> str:
    """The filters of a scan in words, and the name of the surface behind them."""
    parts = [f"{name}-filter at {say(one)}" for name, one in (("S", short), ("L", cutoff)) if one]
    if not parts:
        return "; no filter"
    surface = " (the S-L surface)" if short and cutoff else " (the S-F surface)" if short else ""
    lengths = "each length" if parts[1:] else "this length"
    return (f"; Gaussian {' and '.join(parts)}{surface}, half {lengths} trimmed at each border"
            + ("; near a hole the filter weights of the measured heights are scaled to a sum of one" if holes else ""))


def lines_of(report: RoughnessReport, verbose: bool = False) -> list:
    """The report as lines: a table of value, interval and unit, with definitions where asked."""
    out = [f"{report.source}: {heading(report)}"]
    out.append(f"  {'':<20} {'value':>10}  {'90 %: from .. to':<20} unit")
    units = units_of(report)
    for one in report.values:
        value, interval, unit = shown(one, units[one.name])
        tail = one.reason if one.value is None else ""
        out.append(f"  {one.name:<20} {value:>10}  {interval:<20} {unit:<4} {tail}".rstrip())
        if verbose:
            out.append(f"  {'':<20}   {one.text}")
    out += [f"  no interval of {', '.join(names)}: {reason}" for reason, names in _untold(report).items()]
    out += asperities.lines_of(_told(report), report.cutoff) if report.kind == "profile" else []
    if report.tip is not None:
        out.append(f"  {report.tip.sentence}")
    return out


def _told(report: RoughnessReport) -> peaks.Told | None:
    """What the primary profile below the cut-off tells of its peaks, None where it tells none."""
    try:
        return peaks.told_by(report.primary, report.cutoff)
    except PatchfemError:
        return None


def means_lines(reports: list) -> list:
    """The means over several files as lines, of two traces also as the faces of one contact; () without any."""
    out = []
    if len(reports) == 2 and all(one.kind == "profile" for one in reports):
        one, other = map(_told, reports)
        out = ["", "Both surfaces as the two faces of one contact:",
               *asperities.lines_of(one and other and one.beside(other), reports[0].cutoff)]
    for each in means.means_of(reports):
        out += ["", _of_many(each), f"  {'':<20} {'mean':>10}  {'95 %: from .. to':<20} {'scatter':<10} unit"]
        out += [f"  {name:<20} {value:>10}  {interval:<20} {scatter:<10} {unit}".rstrip()
                for name, value, interval, scatter, unit in _means(each)]
        out += [f"  {each.doubt}"] * bool(each.doubt)
    return out


def _of_many(each: means.Means) -> str:
    return f"Mean of {each.count} {means.KINDS[each.kind]}"


def _means(each: means.Means) -> list:
    """Name, mean, interval, scatter and unit of each mean, as texts."""
    out = []
    for name, one in each.values.items():
        unit = ("", 1.0) if one.mean.unit == "1" else step_of(LADDERS[one.mean.unit], one.mean.value)
        value, interval, _ = shown(one.mean, unit)
        out.append([name, value, interval, plain(one.scatter * unit[1], 3), unit[0]])
    return out


def means_data(reports: list) -> list:
    """The means over several files as plain data in SI."""
    def data(one: Mean) -> dict:
        value, low, high, unit = one.mean[:4]
        return {"value": value, "low": low, "high": high, "unit": unit, "scatter": one.scatter}
    return [{"kind": each.kind, "files": each.count, "confidence": 0.95, "notes": [each.doubt] * bool(each.doubt),
             "measures": {name: data(one) for name, one in each.values.items()}} for each in means.means_of(reports)]


def write_csv(path: Path, reports: list) -> None:
    """Write a row for each file: its parameters with the ends of their intervals in SI, "" for what it has not."""
    names = {one.name: one.unit for report in reports for one in report.values}
    rows = [["file", *(f"{name}{end} [{unit}]" for name, unit in names.items() for end in ("", "_low", "_high"))]]
    for report in reports:
        own = {one.name: one[:3] for one in report.values}
        rows.append([report.source, *("" if value is None else repr(value) for name in names
                                      for value in own.get(name, (None, None, None)))])
    write_rows(path, rows)


def write_surfaces(folder: Path, reports: list) -> None:
    """Write the heights that the parameters are read from into `surfaces`: of a trace `primary.csv`, with a cut-off
    also `roughness.csv`, of a scan `surface.x3p` and `surface.csv`; of several files with its number behind the name.
    """
    folder = folder / "surfaces"
    folder.mkdir()
    for number, one in enumerate(reports, 1):
        tail = f"-{number}" * (len(reports) > 1)
        for name in ("primary", "roughness"):
            if (trace := getattr(one, name)) is not None:
                write_profile(folder / f"{name}{tail}.csv", trace.x, trace.z)
        if (scan := one.scan) is not None:
            write_x3p(folder / f"surface{tail}.x3p", scan.x, scan.y, scan.z, f"{Path(one.source).name}: {heading(one)}")
            write_columns(folder / f"surface{tail}.csv", scan.x, scan.y, scan.z)


def _untold(report: RoughnessReport) -> dict:
    """The parameters without an interval, by the reason."""
    out: dict = {}
    for one in report.values:
        if one.value is not None and one.low is None and one.reason:
            out.setdefault(one.reason, []).append(one.name)
    return out


def data_of(report: RoughnessReport) -> dict:
    """The report as plain data in SI."""
    measures = {}
    for one in report.values:
        measures[one.name] = {"value": one.value, "low": one.low, "high": one.high, "unit": one.unit}
        if one.reason:
            measures[one.name]["reason"] = one.reason
    out = {"file": report.source, "kind": report.kind, "length": report.length, "step": report.step,
           "shape": list(report.shape), "cutoff": report.cutoff,
           "window": None if report.window is None else list(report.window), "form": report.form,
           "s_filter": report.settings.short, "confidence": 0.9, "measures": measures,
           "notes": list(report.notes)}
    if report.kind == "profile":
        out["band"] = list(report.band)
        out["asperities"] = asperities.data_of(_told(report), report.cutoff)
    if report.tip is not None:
        out["tip"] = {"radius": report.tip.radius, "valley_radius": report.tip.valleys,
                      "narrow_share": report.tip.share, "text": report.tip.sentence}
    return out


def page(reports: list) -> str:
    """The page of one or several surfaces, nothing fetched."""
    title = "Roughness of " + ", ".join(Path(one.source).name for one in reports)
    sections = [_mean_section(one) for one in means.means_of(reports)]
    sections += [_section(number, one) for number, one in enumerate(reports)]
    return document(title, f"<p class=soft>patchfem {escape(__version__)}</p>", sections)


def write_page(path: Path, reports: list) -> None:
    """Write the page."""
    write_text(path, page(reports))


def _mean_section(each: means.Means) -> Section:
    rows = table(("parameter", ">mean", ">95 %: from .. to", ">scatter", "unit"), _means(each))
    doubt = warned([f"{each.doubt[0].upper()}{each.doubt[1:]}."]) if each.doubt else ""
    return Section(f"mean-{each.kind}", _of_many(each), f"{doubt}{rows}<p class=soft>{prose(MEANS)}</p>")


def _section(number: int, report: RoughnessReport) -> Section:
    parts = [f"<p class=verdict>{verdict(report)}</p>", f"<p class=soft>{escape(heading(report))}.</p>"]
    told = [*report.notes, *([report.tip.sentence] if report.tip is not None and not report.tip.reaches else [])]
    parts.append(warned([f"{text}." for text in told]))
    if report.tip is not None and report.tip.reaches:
        parts.append(f"<p class=soft>Stylus: {prose(report.tip.sentence)}.</p>")
    parts += [figure(f"{number}{place}", *one) for place, one in enumerate(figures(report))]
    parts += [_table(report), _definitions(report)]
    if report.kind == "profile":
        parts.append(f"<pre>{escape(chr(10).join(asperities.lines_of(_told(report), report.cutoff)))}</pre>")
    return Section(f"surface{number}", report.source, "\n".join(parts))


def verdict(report: RoughnessReport) -> str:
    """The answer in a sentence."""
    if report.kind == "areal":
        names = ("Sa", "Sq", "Sz", "Ssk")
    else:
        names = ("Ra", "Rz", "RSm") if report.cutoff is not None else ("Pa", "Pq", "Pt")
        names += ("dominant_wavelength", "band_amplitude")
    known = [report[name] for name in names]
    return "; ".join(f"<span class=v><b>{escape(one.name.replace('_', ' '))}</b> {escape(_said(one))}</span>"
                     for one in known if one.value is not None) + "."


def _said(one: Quantity) -> str:
    value, interval, unit = shown(one)
    return f"{value} {unit}".rstrip() + (f" ({interval})" if interval else "")


def figures(report: RoughnessReport) -> list:
    """Pictures [(svg, caption, alternative text)] of a report."""
    if report.kind == "areal":
        flat = report.scan
        return [(pictures.scan(flat.x, flat.y, flat.z), "Heights from which the parameters are computed, and their "
                                                        "distribution; the colours leave out the outermost 0.2 % of "
                                                        "the points.",
                 f"Map and histogram of the heights of {report.source}: {_said(report['Sq'])} root mean square"),
                (pictures.draw([pictures.bearing(report.abbott, report.core, ("Smr1", "Smr2"))]),
                 "Abbott curve of these heights; dashed: the straight line of its core.",
                 f"Abbott curve of {report.source}: core height {_said(report['Sk'])}")]
    lines = "the waviness drawn on it" if report.waviness is not None else "no cut-off was given"
    height = report["Pt"]
    out = [(pictures.trace(report.primary, report.waviness), f"Trace about the least-squares {report.form}; {lines}.",
            f"Heights of {report.source} along x: {_said(height)} from the deepest valley to the highest peak")]
    if report.roughness is not None:
        out.append((pictures.rough(report.roughness, (report.primary.x[0], report.primary.x[-1]), report.cutoff),
                    f"Roughness: the trace minus the waviness, in sections of {say(report.cutoff)}; half a section is "
                    "trimmed at each end.", f"Roughness profile: Rq {_said(report['Rq'])}"))
    kind = "roughness profile" if report.roughness is not None else "levelled trace"
    count, wave = report.spectrum.tapers, report["dominant_wavelength"]
    out.append((pictures.statistics(report.abbott, report.core, report.spectrum, report.band, report.cutoff),
                f"Left: Abbott curve of the {kind}; dashed: the straight line of its core. Right: spectrum of the "
                f"levelled trace, the mean of {count} sine tapers, with its 95 % band by chi-square of {2 * count} "
                "degrees of freedom.",
                f"Abbott curve and power spectral density; the dominant wavelength is {_said(wave)}"))
    return out


def _table(report: RoughnessReport) -> str:
    rows, units = [], units_of(report)
    for one in report.values:
        value, interval, unit = shown(one, units[one.name])
        rows.append([escape(one.name), *([escape(value), escape(interval), escape(unit)] if one.value is not None else
                                         [f"<td colspan=3 class=soft>{prose(one.reason)}</td>"])])
    return (f"<h3>Parameters</h3>{table(('parameter', '>value', '>90 %: from .. to', 'unit'), rows)}"
            + (f"<p class=soft>{escape(AREAL if report.kind == 'areal' else INTERVAL)}</p>"
               if any(one.low is not None for one in report.values) else "")
            + "".join(f"<p class=soft>No interval of {escape(', '.join(names))}: {prose(reason)}.</p>"
                      for reason, names in _untold(report).items()))


def _definitions(report: RoughnessReport) -> str:
    rows = [[escape(one.name), prose(one.text)] for one in report.values]
    return f"<h3>Definitions</h3>{table(('', ''), rows)}"
