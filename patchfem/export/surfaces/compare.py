"""Comparison of two surfaces, before and after wear, as text, as a dict and as a page."""

from dataclasses import replace
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...campaigns.compare import SurfaceRuns
from ...campaigns.compare import surface_runs_to_dict as pressed_data
from ...disk.atomic_write import write_text
from ...formatting import format_length
from ...surface.areal import level_plane
from ...surface.compare.compare import Comparison
from ...surface.compare.predicted import PredictedWear
from ...surface.compare.track_roughness import TrackRoughness, measure_track_roughness
from ...surface.profile import Profile, level, resample_evenly
from ...surface.quantity import LEVEL
from ...surface.roughness.spectrum import BAND
from ...surface.scans.change import Change, refuse_hidden_wear
from ..pages.document import (
    Section,
    document_html,
    figure_html,
    sentence_html,
    table_html,
    warning_box,
)
from ..pages.sentences import format_with_error
from . import pictures
from .areal import write_columns, write_x3p
from .pictures import Picture
from .predicted import predicted_data, predicted_picture, predicted_table
from .quantities import (
    MISSING,
    QuantityTable,
    Row,
    choose_common_unit,
    format_quantity,
    quantity_data,
)

QUANTITY_LABELS = {
    "shift": "shift",
    "tilt": "tilt",
    "scale": "scale of x",
    "worn_depth_max": "worn depth, largest",
    "worn_depth_mean": "worn depth, mean",
    "worn_area": "worn area (volume per width)",
    "amplitude_ratio": "amplitude ratio",
    "slope_ratio": "slope ratio",
    "worn_from_before": "start of the worn part, x in the first trace",
    "worn_to_before": "end of the worn part, x in the first trace",
    "worn_from_after": "start of the worn part, x in the second trace",
    "worn_to_after": "end of the worn part, x in the second trace",
    "worn_depth_within": "worn depth, mean over the worn part",
    "track_from": "start of the track",
    "track_to": "end of the track",
    "track_direction": "track, direction",
    "track_length": "track length",
    "track_volume": "track, area times length",
    "track_width": "track width",
    "track_depth": "track depth, mean",
    "track_step": "track, step height",
    "track_pile_up_left": "track, pile-up at its beginning",
    "track_pile_up_right": "track, pile-up at its end",
    "track_depth_floor": "track depth, floor",
    "track_area_gross": "track, lost area",
    "track_pile_up": "track, pile-up",
    "track_area_net": "track, lost area minus pile-up",
    "hidden_wear": "mean wear that a tilt may hide",
    "worn_volume": "worn volume",
    "grown_volume": "grown volume",
    "worn_share": "fraction of the common region that is worn",
    "shift_x": "shift along x",
    "shift_y": "shift along y",
    "rotation": "rotation",
}
ROUGHNESS_NAMES = ("Ra", "Rq", "slope")
TABLE_HEADS = ("quantity", "value", "95 %", "unit")
SIDES = ("before", "after")
# Largest number of heights in a histogram or an Abbott curve; larger scans are thinned.
MAX_DRAWN_HEIGHTS = 1_000_000
PAGE_NOTE = (
    "All intervals are 95 % intervals. The intervals of shift, depth and area hold for the "
    "measured place and come from the noise of the unworn heights. A track or worn part begins "
    "where the flank that is fitted to its depths leaves the unworn surface. The flank is a "
    "parabola, or a step where a step fits clearly better. The intervals of both ends, of the "
    "width and of the mean depth within hold for flanks that leave the surface at an angle or in a "
    "step, as those of a parabola or a box do; a flank that runs out flat begins farther outside "
    "than its interval says. They hold for the ends on these traces: at another place a ragged track "
    "has another width. The intervals of ratios hold for the whole surface and assume "
    "Gaussian heights with the same statistics everywhere. If both traces are of the same place, "
    "their heights vary together, and the intervals are narrower."
)


def _quantities_table(comparison: Comparison) -> QuantityTable:
    """Return the table of the quantities of a comparison of two surfaces."""
    rows = []
    for name, quantity in comparison.values.items():
        words = QUANTITY_LABELS[name]
        if name == "worn_depth_mean" and quantity.value is not None:
            words = f"{words} over {comparison.mean_region}"
        meaning = quantity.text if quantity.value is not None else f"{quantity.text}: not available"
        rows.append(Row(words, quantity, meaning=meaning))
    return QuantityTable(TABLE_HEADS, rows)


class ComputedParts(NamedTuple):
    """Results of runs that are shown beside a comparison, each None if it was not requested.

    pressed: a scene with each of the two surfaces; predicted: the wear of a run, fitted to the
    measured one.
    """

    pressed: SurfaceRuns | None = None
    predicted: PredictedWear | None = None


NOTHING_COMPUTED = ComputedParts()


def add_predicted_sentence(verdict: tuple, predicted: PredictedWear | None) -> tuple:
    """Return headline and sentences, to which a sentence on the computed wear is appended."""
    if predicted is None:
        return verdict
    headline, sentences = verdict
    return headline, [*sentences, predicted.sentence]


def format_comparison(
    parts: list, verdict: tuple, computed: ComputedParts = NOTHING_COMPUTED
) -> list:
    """Return the comparison of two surfaces as lines of text.

    Parameters
    ----------
    parts : list of Comparison
        One for each direction.
    verdict : tuple
        Headline and sentences.
    computed : ComputedParts
        Results of runs.

    Returns
    -------
    list of str
    """
    headline, sentences = verdict
    surface_runs = computed.pressed
    out = [headline, *(f"  {text}" for text in sentences), ""]
    for part in parts:
        direction = f", along {part.direction}" if part.direction else ""
        out.append(f"{part.before.source} -> {part.after.source}{direction}")
        out += _quantities_table(part).lines()
        roughness = measure_track_roughness(part)
        if roughness.regions:
            table = _roughness_table(roughness)
            out += ["", table.heads[0], *table.lines()]
    if computed.predicted is not None:
        table = predicted_table(computed.predicted)
        out += ["", table.heads[0], *table.lines()]
    if surface_runs is not None:
        out += ["", f"{surface_runs.title}, pressed with each surface"]
        rows = []
        for name, words, first, second in surface_runs.measure_rows():
            rows.append((words, _format_measure(name, first), _format_measure(name, second)))
        out += sides_lines(rows)
        out += [f"  {text}" for text in (*surface_runs.failed, *surface_runs.lacking)]
    return out


def sides_lines(rows: list) -> list:
    """Return the measures before and after wear as lines of a table.

    `rows` holds the name, the text before and the text after of each measure.
    """
    out = []
    for words, first, second in [("", *SIDES), *rows]:
        out.append(f"  {words:<38} {first:>24} {second:>24}")
    return out


def _format_measure(name: str, measure) -> str:
    """Format a measure with its error, or return a dash if it has no value."""
    if measure is None or measure.value is None:
        return MISSING
    return format_with_error(
        name, {"value": measure.value, "error": measure.error, "unit": measure.unit}
    )


def _roughness_table(roughness: TrackRoughness) -> QuantityTable:
    """Return the table of the roughness inside and outside a track, before and after wear."""
    rows = []
    for name in ROUGHNESS_NAMES:
        for region, sides in roughness.regions.items():
            quantities = [sides[side][name] for side in SIDES]
            unit = choose_common_unit(quantities)
            after = format_quantity(quantities[1], unit)
            row = Row(f"{name} {region} the track", quantities[0], unit, after[:2])
            rows.append(row._replace(meaning=quantities[0].text))
    cutoff = format_length(roughness.cutoff)
    name = f"roughness inside and outside the track, cut-off {cutoff}"
    heads = (name, "before", "95 %", "after", "95 %", "unit")
    return QuantityTable(heads, rows)


def comparison_data(
    parts: list, verdict: tuple, directions: list, computed: ComputedParts = NOTHING_COMPUTED
) -> dict:
    """Return the comparison of two surfaces as a dict, in SI units.

    The first direction is at the top level.

    Parameters
    ----------
    parts : list of Comparison
    verdict : tuple
        Headline and sentences.
    directions : list
        (when, amplitude ratio, slope ratio) of x over y.
    computed : ComputedParts
        Results of runs.

    Returns
    -------
    dict
    """
    out = {
        "patchfem": __version__,
        "verdict": verdict[0],
        "sentences": verdict[1],
        "confidence": LEVEL,
    }
    out |= {
        "band": list(BAND),
        **_part_data(parts[0]),
        "notes": [text for part in parts for text in part.notes],
    }
    if len(parts) > 1:
        out["directions"] = {part.direction: _part_data(part) for part in parts}
        out["anisotropy"] = {}
        for state, amplitude, slope in directions:
            ratios = {
                "amplitude_ratio": quantity_data(amplitude),
                "slope_ratio": quantity_data(slope),
            }
            out["anisotropy"][state] = ratios
    if computed.pressed is not None:
        out["pressed"] = pressed_data(computed.pressed)
    if computed.predicted is not None:
        out["predicted"] = predicted_data(computed.predicted)
        out["notes"] += computed.predicted.notes
    return out


def _part_data(part: Comparison) -> dict:
    """Return the sources, quantities and alignment of one direction as a dict."""
    out = {"before": part.before.source, "after": part.after.source}
    out |= {"direction": part.direction or None, "reference": part.basis or None}
    out |= _values_data(part.values)
    if isinstance(part.before, Profile):
        if part.worn.mean.value is not None:
            out["worn_depth_mean"]["over"] = part.mean_region.removeprefix("the ")
        out["registration"] = {
            "shift": quantity_data(part.motion.shift),
            "mirrored": part.is_mirrored,
        }
        sizes, *other_sizes = (
            _values_data(track_sizes) for track_sizes in (part.tracks.sizes, *part.tracks.others)
        )
        out |= {
            "track": sizes or None,
            "other_tracks": other_sizes,
            "removed": dict(zip(SIDES, part.removed)),
            "roughness": _roughness_data(measure_track_roughness(part)),
        }
    elif part.change is not None:
        out |= _scans_data(part.change)
    return out


def _roughness_data(roughness: TrackRoughness) -> dict:
    """Return the roughness inside and outside a track as a dict, with a reason if it is unknown."""
    out = {"cutoff": roughness.cutoff, "inside": None, "outside": None}
    if not roughness.regions:
        return {**out, "reason": roughness.reason}
    for region, sides in roughness.regions.items():
        out[region] = {side: _values_data(values) for side, values in sides.items()}
    return out


def _values_data(values: dict) -> dict:
    """Convert quantities to a dict of their names and values."""
    return {name: quantity_data(quantity) for name, quantity in values.items()}


def _scans_data(change: Change) -> dict:
    """Return the alignment of two scans, their track and the number of removed heights."""
    placement = None if change.alignment is None else change.alignment.placement
    registration = _values_data(change.registration)
    registration |= {
        "mirrored": bool(placement and placement.mirrored),
        "turned": bool(placement and placement.is_inverted),
    }
    track = None
    if change.track is not None:
        track = {"reason": change.track.why}
        if not change.track.why:
            track = {"sections": change.track.sections}
            for name, quantity in change.track.values.items():
                track[name] = {**quantity_data(quantity), "scatter": change.track.scatter.get(name)}
    return {
        "registration": registration,
        "hidden_wear": quantity_data(refuse_hidden_wear(change)),
        "track": track,
        "removed": dict(zip(SIDES, change.removed)),
    }


def pressed_traces(comparison: Comparison) -> tuple:
    """Return the traces before and after wear that a scene presses, limited to their common part.

    Without a common part they are returned completely.

    x is measured from the middle, and heights are levelled by least squares, as the scene does.
    """
    alignment = comparison.alignment
    if alignment is None:
        traces = (comparison.before, comparison.after)
    else:
        second = alignment.first - alignment.worn_depth
        traces = (
            Profile(alignment.x, alignment.first, comparison.before.source),
            Profile(alignment.x, second, comparison.after.source),
        )
    return tuple(level(resample_evenly(trace)) for trace in traces)


def write_trace(path: Path, trace: Profile) -> Path:
    """Write a trace as text that a scene reads with heights = "surface"."""
    middle = (trace.x[0] + trace.x[-1]) / 2
    lines = [f"{x:.6f},{z:.6f}" for x, z in zip((trace.x - middle) * 1e6, trace.z * 1e6)]
    write_text(path, "\n".join(["x [um],z [um]", *lines, ""]))
    return path


def write_difference(folder: Path, comparison: Comparison) -> None:
    """Write the worn depth of two aligned scans as difference.x3p and difference.csv."""
    change = comparison.change
    if change is None or change.alignment is None:
        return
    scan = (change.before.x, change.before.y, change.alignment.depth)
    text = "worn depth: height before minus height after, once the surfaces are aligned"
    write_x3p(folder / "difference.x3p", *scan, text)
    write_columns(folder / "difference.csv", *scan)


class SurfacePage(NamedTuple):
    """Page on two surfaces: title, verdict (headline and sentences) and notes."""

    title: str
    verdict: tuple
    notes: list

    def html(self, sections: list) -> str:
        """Return the self-contained HTML page on two surfaces with given sections."""
        headline, sentences = self.verdict
        lead = f"<p class=soft>patchfem {escape(__version__)}</p><div class=verdict>"
        lead += f"<b>{sentence_html(headline[0].upper() + headline[1:])}.</b>"
        lead += "".join(f"<p>{sentence_html(text)}</p>" for text in sentences)
        lead += f"</div>{warning_box(self.notes)}"
        return document_html(f"{self.title}: before and after", lead, sections)


def write_page(
    path: Path,
    parts: list,
    verdict: tuple,
    directions: list = (),
    computed: ComputedParts = NOTHING_COMPUTED,
) -> None:
    """Write the HTML page of a comparison of two surfaces.

    Parameters
    ----------
    path : Path
    parts, verdict, directions, computed
        As in `comparison_data`.
    """
    write_text(path, page_html(parts, verdict, directions, computed))


def page_html(
    parts: list,
    verdict: tuple,
    directions: list = (),
    computed: ComputedParts = NOTHING_COMPUTED,
) -> str:
    """Return the HTML page of a comparison of two surfaces, with the verdict first.

    Parameters
    ----------
    parts, verdict, directions, computed
        As in `comparison_data`.

    Returns
    -------
    str
    """
    names = [Path(surface.source).name for surface in (parts[0].before, parts[0].after)]
    surface_runs = computed.pressed
    sections = []
    if computed.predicted is not None:
        sections.append(_predicted_section(computed.predicted))
    if directions:
        ratios = []
        for state, amplitude, _ in directions:
            ratios.append(f"{state} {' '.join(format_quantity(amplitude)[:2])}")
        crossed = figure_html(
            "xy",
            pictures.draw_directions(parts, directions),
            "Left: spectra of both directions. Right: amplitude of the band along x divided by "
            "that along y, and slope along x divided by that along y, with their 95 % intervals; "
            "the value 1 means that the surface is equally rough in both directions.",
            f"Waves along x divided by waves along y: amplitude {'; '.join(ratios)}",
        )
        sections.append(Section("directions", "x over y", crossed))
    for number, part in enumerate(parts):
        heading = "What changed"
        if part.change is not None:
            heading = "Changes of depth at each place, and changes of the waves"
        elif part.direction and parts[0].change is not None:
            heading = "Waves"
        if part.direction:
            heading += f" along {part.direction}"
        body = [
            figure_html(f"{number}{place}", *picture)
            for place, picture in enumerate(_draw_pictures(part))
        ]
        body += [_quantities_table(part).html(), f"<p class=soft>{sentence_html(PAGE_NOTE)}</p>"]
        roughness = measure_track_roughness(part)
        if roughness.regions:
            body.append(_roughness_table(roughness).html())
        sections.append(Section(f"changes{number}", heading, "\n".join(body)))
    if surface_runs is not None:
        sections.append(
            Section(
                "pressed",
                f"{surface_runs.title}, pressed with each surface",
                _pressed_html(surface_runs),
            )
        )
    notes = [f"{text}." for part in parts for text in part.notes]
    if computed.predicted is not None:
        notes += [f"{text}." for text in computed.predicted.notes]
    return SurfacePage(f"{names[0]} and {names[1]}", verdict, notes).html(sections)


def _predicted_section(predicted: PredictedWear) -> Section:
    """Return the page section that compares the computed with the measured wear."""
    body = [figure_html("w", *predicted_picture(predicted)), predicted_table(predicted).html()]
    return Section("predicted", "Computed wear over the measured wear", "\n".join(body))


def _draw_pictures(part: Comparison) -> list:
    """Draw the pictures of a comparison in one direction."""
    out = []
    if part.alignment is not None:
        out += _aligned_pictures(part)
    elif part.change is not None and part.change.alignment is not None:
        out += _scan_pictures(part.change)
    elif isinstance(part.before, Profile):
        caption = (
            "Each trace is drawn about its own least-squares line. No common place was found in "
            "the two traces."
        )
        drawn = pictures.draw_separate(part.before, part.after)
        out.append(Picture(drawn, caption, "Traces before and after, one above the other"))
    if part.flanks is not None:
        flanks = part.flanks
        out.append(
            Picture(
                pictures.draw_depth(flanks.x, flanks.depth, ends=(flanks.start, flanks.end)),
                "The curve is the depth of the second trace (after wear) below the line through "
                "its unworn flanks.",
                f"Depth of the wear track: largest {format_quantity(part.worn.largest).short}",
            )
        )
    spectra = [size.spectrum for size in part.ratios.sizes]
    if spectra and all(spectrum.density.any() for spectrum in spectra):
        if part.alignment is None:
            heights = [_levelled_heights(surface) for surface in (part.before, part.after)]
            datum = "the least-squares line or plane of each surface"
        else:
            heights = _aligned_heights(part)
            datum = "the line of the first trace (before wear)"
        out.append(
            Picture(
                pictures.draw_both_statistics(heights, spectra, BAND),
                f"Left: Abbott curves about {datum}. Right: spectra with their 95 % bands.",
                "Abbott curves and spectra: amplitude ratio "
                f"{format_quantity(part.ratios.amplitude).value}",
            )
        )
    return out


def _aligned_heights(part: Comparison) -> tuple:
    """Return both aligned traces (n,) [m] about the least-squares line of the first."""
    alignment = part.alignment
    line = np.polyval(np.polyfit(alignment.x, alignment.first, 1), alignment.x)
    return alignment.first - line, alignment.first - alignment.worn_depth - line


def _aligned_pictures(part: Comparison) -> list:
    """Draw two aligned traces and the depth between them."""
    alignment = part.alignment
    worn = np.where(alignment.worn_depth > 3 * alignment.noise, alignment.worn_depth, 0.0)
    traces_picture = Picture(
        pictures.draw_aligned(alignment.x, *_aligned_heights(part), worn),
        "The trace measured after wear, moved by shift, tilt and offset, is drawn over the trace "
        "measured before.",
        f"Both traces after alignment: mean worn depth {format_quantity(part.worn.mean).short}",
    )
    depth = Picture(
        pictures.draw_depth(alignment.x, alignment.worn_depth, used=alignment.unworn),
        "The curve is the depth of the second trace (after wear) below the first trace (before "
        "wear). Blue: the unworn heights to which shift, tilt and offset were fitted.",
        f"Worn depth along the trace: largest {format_quantity(part.worn.largest).short}",
    )
    return [traces_picture, depth]


def _scan_pictures(change: Change) -> list:
    """Draw two aligned scans, their heights and the mean cross-section of a track."""
    x = change.before.x
    y = change.before.y
    first = level_plane(change.before).z
    depth = change.volumes.filled
    second = first - depth
    out = [
        Picture(
            pictures.draw_maps(x, y, (first, second, depth)),
            "Left and middle: the first scan (before wear) and the second scan (after wear), "
            "aligned with the first; heights are measured from the reference plane of the first "
            "scan; white: no height. Right: depth of the second scan below the first; missing "
            "depths are taken from their neighbours; white: outside the second scan.",
            "Maps of both scans and of the worn depth: worn volume "
            f"{format_quantity(change.volumes.values['worn_volume']).short}",
        )
    ]
    finite_points = np.flatnonzero(np.isfinite(depth) & np.isfinite(first))
    finite_points = finite_points[:: -(-finite_points.size // MAX_DRAWN_HEIGHTS)]
    heights = (first.ravel()[finite_points], second.ravel()[finite_points])
    out.append(
        Picture(
            pictures.draw_both_heights(heights),
            "Left: fraction of the heights in each class. Right: Abbott curves. Heights are those "
            "of the region common to both scans, measured from the reference plane of the first "
            "scan (before wear).",
            "Histograms and Abbott curves of the heights before and after",
        )
    )
    if change.track is not None and not change.track.why:
        values = change.track.values
        out.append(
            Picture(
                pictures.draw_mean_section(change.track, values["from"].value, values["to"].value),
                f"Mean of {change.track.sections} sections across the track. The band extends one "
                "standard deviation of the sections above and below the mean. The track lies "
                "between the lines.",
                f"Mean section of the track: width {format_quantity(values['width']).short}",
            )
        )
    return out


def _levelled_heights(surface) -> np.ndarray:
    """Return the heights (k,) [m] of a surface about its least-squares line or plane."""
    if isinstance(surface, Profile):
        return level(resample_evenly(surface)).z
    step = max(int(np.sqrt(surface.z.size / MAX_DRAWN_HEIGHTS)), 1)
    thinned = replace(
        surface, x=surface.x[::step], y=surface.y[::step], z=surface.z[::step, ::step]
    )
    z = level_plane(thinned).z
    return z[~np.isnan(z)]


def _pressed_html(surface_runs: SurfaceRuns) -> str:
    """Return the measures and pressures of a scene, pressed with each surface, as HTML."""
    runs = zip(SIDES, (surface_runs.before, surface_runs.after))
    runs = [(name, run) for name, run in runs if run is not None]
    warnings = [f"{name}: {text}" for name, run in runs for text in run.warnings]
    parts = [warning_box([*surface_runs.failed, *warnings])]
    if runs:
        peaks = []
        for name, run in runs:
            peak = run.measures.get("pressure_peak")
            peaks.append(f"{name} {_format_measure('pressure_peak', peak)}")
        drawn = pictures.draw_pressures(
            [pictures.PressedSide(run.x, run.stress, name) for name, run in runs]
        )
        caption = (
            "Normal stress of the patch, pressed once with each of the two surfaces; all other "
            "settings of the scene are the same."
        )
        parts.append(
            figure_html(
                "p", drawn, caption, f"Pressure along the patch, largest: {', '.join(peaks)}"
            )
        )
        rows = []
        for name, words, first, second in surface_runs.measure_rows():
            texts = (
                words,
                _format_measure(name, first),
                _format_measure(name, second),
                _format_ratio(first, second),
            )
            rows.append([escape(text) for text in texts])
        parts.append(table_html(("measure", ">before", ">after", ">after / before"), rows))
    parts += [f"<p class=soft>{sentence_html(text)}.</p>" for text in surface_runs.lacking]
    return "\n".join(parts)


def _format_ratio(first, second) -> str:
    """Format the ratio of the second to the first measure, or return "" if it is unknown."""
    values = [None if measure is None else measure.value for measure in (first, second)]
    if None in values or values[0] == 0:
        return ""
    return f"{values[1] / values[0]:#.3g}"
