"""report.html: a self-contained page on a run, which begins with the verdict."""

from collections.abc import Callable
from html import escape
from typing import NamedTuple

import numpy as np

from .. import formatting
from ..effects import list_displayed_absent_effects
from ..runs.results.result import Result
from .drawing import accuracy, charts, pictures
from .page_data import RunData, collect_run_data
from .pages.document import Section, document_html, sentence_html, table_html, warning_box
from .pages.driven import list_changed_keys
from .pages.sentences import (
    EXACT_NOTE,
    G,
    display_units,
    format_imperial,
    format_value_and_error,
    format_with_error,
    headline_sentence,
    measure_link,
    order_measures,
    record_interval,
)
from .results import MAX_INTERFACES

SETTLED_OUTCOMES = ("steady", "stuck", "done")
EN_DASH = "&ndash;"
# Largest number of characters for the numbers of all charts; with the library, the page stays below
# 3 MB.
MAX_CHART_CHARACTERS = 700_000
RESULT_FILES = (
    (
        "fields.vtkhdf",
        "fields of both pieces and their interface, frame by frame (ParaView 5.13 or newer)",
    ),
    ("interfaces", "fields, in the same format, of every interface that has a patch of its own"),
    ("summary.json", "measures, outcome, warnings, effects and numerics"),
    ("result.nc", "histories and fields along the interface (xarray, MATLAB, ncdump)"),
    ("scene.resolved.toml", "the scene in SI units, with all default values"),
)


def verdict_html(data: RunData) -> str:
    """Return the results of a run in a few sentences of HTML, with the error of each number."""
    verdict = data.verdict
    outcome_html = f"<b>{escape(verdict.summary['outcome'])}</b>: {sentence_html(verdict.sentence)}"
    text = headline_sentence(
        verdict.summary,
        verdict.cycles,
        lambda number, name: measure_link(number, name, " class=v"),
        verdict.released,
    )
    return f"{outcome_html}{escape(charts.regime_sentence(verdict.steady))} {text}".strip()


def page_html(data: RunData) -> str:
    """Return the HTML page of a run."""
    summary = data.verdict.summary
    title = summary["title"] or data.source.name or "patchfem run"
    # The title of a scene may not describe the values that were set by the user.
    scene_text = f"Scene: {escape(title)} &middot; " if data.source.sets else ""
    title = list_changed_keys(data.source.sets) if scene_text else title
    motion = f" &middot; {escape(data.source.driven)}" if data.source.driven else ""
    lead = [
        f"<p class=soft>{scene_text}patchfem {escape(summary['patchfem'])} &middot; {escape(summary['kind'])}{motion} "
        f"&middot; engine {escape(data.verdict.engine or 'static')} &middot; "
        f"computed in {summary['seconds'].get('total', 0):.2f} s</p>",
        f"<p class=verdict>{verdict_html(data)}</p>",
    ]
    warnings = [w for w in summary["warnings"] if w != data.verdict.sentence]
    lead.append(warning_box(warnings, "Warnings"))
    lead += [f"<p class=soft>Note: {sentence_html(text)}</p>" for text in summary["notes"]]
    chart_data, figures = draw_figures(data)
    chart_data = charts.limit_characters(chart_data, MAX_CHART_CHARACTERS)
    sections = [Section("pictures", "Pictures", figures)] if chart_data else []
    if data.measured is not None:
        sections += _measured_section(data)
    if data.evaluations.levels is not None:
        sections.append(_levels_section(data.evaluations.levels))
    sections += [_measures_section(data), _cost_section(data), _origin_section(data)]
    scripts = ("figures.js", "curves.js") if chart_data else ()
    return document_html(title, "".join(lead), sections, {"charts": chart_data}, scripts)


def draw_figures(data: RunData) -> tuple:
    """Return the charts of a run, and the HTML of the elements that contain them."""
    chart_data = []
    figures = []
    for picture in (find_picture(name, data) for name in PICTURES):
        if picture is None:
            continue
        charts_of_picture = [
            chart | {"anchor": f"chart{len(chart_data) + number}"}
            for number, chart in enumerate(picture.charts(*picture.values))
        ]
        cells = "".join(
            f'<div id="{chart["anchor"]}" class=chart role=img aria-label="{escape(chart["title"])}"></div>'
            for chart in charts_of_picture
        )
        figures.append(
            f"<figure><div class=row>{cells}</div><figcaption>{sentence_html(picture.caption)}</figcaption></figure>"
        )
        chart_data += charts_of_picture
    return chart_data, "\n".join(figures)


class Picture(NamedTuple):
    """Picture of a run: drawing function, its arguments and a caption."""

    charts: Callable
    values: tuple
    caption: str


def find_picture(name: str, data: RunData) -> Picture | None:
    """Return the picture with a given name, or None if the run has no data for it."""
    return PICTURES[name](data)


def _curve_picture(data: RunData) -> Picture | None:
    """Return the picture of a curve of steady motions."""
    curve = data.evaluations.curve
    if curve is None:
        return None
    caption = charts.curve_caption(curve)
    if text := data.source.driven:
        caption += f" {text[0].upper()}{text[1:]}."
    return Picture(charts.curve_charts, (curve,), caption)


def _spectra_picture(data: RunData) -> Picture | None:
    """Return the picture of the spectra under random excitation."""
    if data.evaluations.spectra is None:
        return None
    measures = data.verdict.summary["measures"]
    peak_frequency = measures.get("response_frequency", {}).get("value")
    peak_note = (
        ""
        if peak_frequency is None
        else (
            " The peak of H1 is marked by a ring. It is the peak of a mode at {} ({}) with a damping ratio of {} ({}), "
            "friction included.".format(
                *record_interval("response_frequency", measures),
                *record_interval("response_damping", measures),
            )
        )
    )
    return Picture(
        charts.spectra_charts,
        (data.evaluations.spectra, peak_frequency),
        "One-sided spectral densities of output and drive, and the "
        "frequency response H1 (displacement of the output divided "
        "by acceleration of the base). H1 is drawn "
        f"faint where the coherence is below {charts.MIN_COHERENCE:g}.{peak_note}",
    )


def _decay_picture(data: RunData) -> Picture | None:
    """Return the picture of frequency and damping of a decay."""
    if data.evaluations.decay is None:
        return None
    return Picture(
        charts.decay_charts,
        (data.evaluations.decay,),
        "Frequency and damping ratio (structure and friction together) of "
        "the released output against half its peak-to-peak motion; bars "
        "show the errors of the evaluation and of the computation.",
    )


def _levels_picture(data: RunData) -> Picture | None:
    """Return the picture of the amplitude at the end of each level of a stepped drive signal."""
    if data.evaluations.levels is None:
        return None
    return Picture(
        charts.levels_chart,
        (data.evaluations.levels,),
        "Amplitude at the end of every level; each level starts from the "
        "final state of the previous level; arrows show the order of the "
        f"test.{_drive_sentence(data)}",
    )


def _wear_picture(data: RunData) -> Picture | None:
    """Return the picture of the wear of a patch."""
    wear = data.evaluations.wear
    if wear is None:
        return None
    states = wear.states
    history = wear.history
    depth = states["worn_depth"]
    mean = depth.mean(axis=1) if depth.ndim == 3 else depth
    profiles = (states["time"] / wear.period, states["normal_stress"], mean)
    return Picture(
        charts.wear_charts,
        (data.patch.x, *profiles, history),
        f"Wear of the patch over {formatting.format_number(history['cycle'][-1], 4)} cycles: pressure and worn depth "
        f"of both pieces together{', means over the width' if depth.ndim == 3 else ''}, and measures of "
        "patch and motion divided by their values on the unworn patch. All other pictures show the worn "
        "patch."
        f"{_edge_peaks_sentence(history)}",
    )


def _edge_peaks_sentence(history: dict) -> str:
    """State after which wear cycles the peak pressure lies at the edge of the contact."""
    above = np.asarray(history.get("pressure_peak_at_edge", ()))
    if not (above > 0).any():
        return ""
    cycles = ", ".join(
        formatting.format_number(cycle, 4) for cycle in np.asarray(history["cycle"])[above > 0]
    )
    largest = formatting.format_quantity(float(above.max()), "Pa", 2)
    return (
        f" After {cycles} cycles the peak pressure is that of a node at the edge of the contact; it stands up to "
        f"{largest} above all pressures farther inside and has an error of this size."
    )


def _worn_map_picture(data: RunData) -> Picture | None:
    """Return the map of the worn depth over strips."""
    wear = data.evaluations.wear
    if wear is None:
        return None
    depth = wear.states["worn_depth"][-1]
    if depth.ndim < 2 or not depth.any():
        return None
    return Picture(
        charts.worn_map_chart,
        (data.patch.x, data.patch.width, depth),
        "Worn depth of both pieces together after "
        f"{formatting.format_number(wear.history['cycle'][-1], 4)} cycles, in every strip over the width.",
    )


def _interface_picture(data: RunData) -> Picture | None:
    """Return the picture of the stresses on the interface."""
    if not data.patch.touches():
        return None
    fields = data.patch.fields
    caption = "Normal stress of the pressed pieces"
    if np.any(fields.get("shear_stress", 0.0)):
        whole_cycle = data.verdict.summary["kind"] == "rig" and not data.verdict.is_part_of_cycle()
        span = "the last cycle" if whole_cycle else "the run"
        caption += (
            f"; shear stress at {len(fields['time']) - 1} instants of {span}; the instant with the largest "
            "resultant force is in colour"
        )
    if charts.contact_range(data.patch.x, fields["normal_stress"][0]):
        length, scale = formatting.choose_axis_unit(data.patch.x, "m")
        caption += (
            ". Only the part in contact is drawn; the whole length is "
            f"{(data.patch.x[-1] - data.patch.x[0]) * scale:.4g} {length}"
        )
    caption += f".{_peak_pressure_sentence(data)}"
    return Picture(charts.interface_charts, (data.patch.x, fields), caption)


def _peak_pressure_sentence(data: RunData) -> str:
    """State why the largest pressure drawn for a static patch is not `pressure_peak`; "" if both are equal."""
    summary = data.verdict.summary
    peak = summary["measures"].get("pressure_peak")
    if summary["kind"] != "patch" or peak is None or peak["value"] is None:
        return ""
    drawn = float(np.max(data.patch.fields["normal_stress"]))
    largest = formatting.format_quantity(drawn, "Pa", 4)
    estimate = formatting.format_quantity(peak["value"], "Pa", 4)
    if largest == estimate:
        return ""
    strips = any(effect["effect"] == "contact.strips" for effect in summary["effects"])
    return (
        f" The drawn pressures are means over the elements beside a node{' and over the strips' * strips}, at most "
        f"{largest}; the measure pressure_peak, {estimate}, is the estimated maximum of the continuous pressure."
    )


def _faces_picture(data: RunData) -> Picture | None:
    """Return the picture of the stresses on interfaces that have a patch."""
    touching = [face for face in data.patch.faces if np.any(face[1]["normal_stress"][0] > 0)]
    is_partial = any(
        charts.contact_range(x, fields["normal_stress"][0]) for x, fields, _ in touching
    )
    has_shear = any(np.any(fields.get("shear_stress", 0.0)) for _, fields, _ in touching)
    shear_note = (
        "; shear stress at several instants of the last cycle; the instant with the largest resultant force is "
        "in colour"
        if has_shear
        else ""
    )
    return (
        Picture(
            charts.faces_charts,
            (touching[:MAX_INTERFACES],),
            f"Normal stress of the pressed patch of each interface{shear_note}."
            f"{' Only the part in contact is drawn.' * is_partial}{_omitted_charts_sentence(touching)}",
        )
        if touching
        else None
    )


def _omitted_charts_sentence(drawn_interfaces: list) -> str:
    """Return a sentence about omitted charts for the end of a caption, or "" if none are omitted."""
    return (
        f" Only the first {MAX_INTERFACES} of {len(drawn_interfaces)} interfaces are shown."
        if len(drawn_interfaces) > MAX_INTERFACES
        else ""
    )


def _loop_picture(data: RunData) -> Picture | None:
    """Return the picture of the friction loop."""
    motion = data.motion
    if motion is None or not np.any(motion.loop["force"]) or np.ptp(motion.loop["slide"]) == 0:
        return None
    loop = motion.loop
    is_whole_run = motion.window is None or data.verdict.is_part_of_cycle()
    count = 0.0 if is_whole_run else (loop["time"][-1] - loop["time"][0]) / motion.period
    span = "the whole run"
    if not is_whole_run:
        span = f"the last {count:.3g} cycles" if count > 1 + 1e-6 else "one cycle"
    open_loop = data.verdict.is_part_of_cycle() or data.verdict.cycles is None
    title = "Friction force against slide" if open_loop else "Friction loop"
    name, *measured_loop = motion.recorded or ("",)
    measured_note = f" Grey: the force measured in {name}." if measured_loop else ""
    if interface_loops := loop.get("each"):
        return Picture(
            charts.loop_charts,
            (interface_loops[:MAX_INTERFACES],),
            f"Friction force against the slide of each interface, over {span}."
            f"{_drive_sentence(data)}{_omitted_charts_sentence(interface_loops)}",
        )
    return Picture(
        charts.loop_chart,
        (loop["slide"], loop["force"], title, tuple(measured_loop) or None),
        f"Resultant friction force against the slide of the interface, over {span}.{_drive_sentence(data)}{measured_note}",
    )


def _histories_picture(data: RunData) -> Picture | None:
    """Return the picture of the histories."""
    motion = data.motion
    if motion is None:
        return None
    history = motion.history
    period = motion.period
    if motion.window is None:
        force = " and friction force" if np.any(history["force"]) else ""
        return Picture(
            charts.history_charts,
            (history, None, None),
            f"Slide{force} over the whole run.{_drive_sentence(data)}"
            + (" Grey: the measured force." if "measured" in history else ""),
        )
    run_window = motion.window
    is_shown = run_window["time"] >= run_window["time"][-1] - 3 * period * (1 + 1e-9)
    window = {k: v[is_shown] for k, v in run_window.items()}
    count = (window["time"][-1] - window["time"][0]) / period
    title = (
        f"The run's {count:.2g} cycles"
        if count >= data.verdict.cycles - 1e-6
        else f"Last {count:.2g} cycles"
    )
    title = f"The run: {count:.2g} of a cycle" if data.verdict.is_part_of_cycle() else title
    bodies = "output and base" if np.any(window["base"]) else "the output"
    caption = (
        "Displacement over the whole run. At the end of the run: displacement, and acceleration of "
        f"{bodies}.{_drive_sentence(data)}"
    )
    first_complete = charts.first_complete_time(history["time"], period, run_window["time"][0])
    swings = bool(data.verdict.released)
    n_kept = int(np.sum(history["time"] < first_complete))
    if n_kept:
        remark = f"{n_kept} of the samples {'was' if n_kept == 1 else 'were'} kept."
        if swings:
            remark = "turning points and stops were kept, joined by lines."
        elif n_kept * period > first_complete:
            remark = "reversals were kept, drawn as a band from the lowest to the highest value of each cycle."
        unit, scale = formatting.choose_axis_unit(history["time"], "s")
        caption += f" Before {first_complete * scale:.4g} {unit} only {remark}"
    # A decay has no envelope per cycle: its stored reversals are joined by lines.
    return Picture(charts.history_charts, (history, window, period, title, swings), caption)


def _drive_sentence(data: RunData) -> str:
    """Describe the drive signal of a run in a sentence for the end of a caption.

    With a curve, it gives the frequency of the motion that is shown.
    """
    text = data.source.driven
    if (
        text
        and data.evaluations.curve is not None
        and data.motion is not None
        and data.motion.period
    ):
        return f" The steady motion at {1 / data.motion.period:.5g} Hz; {text}."
    return f" {text[0].upper()}{text[1:]}." if text else ""


def _measured_picture(data: RunData) -> Picture | None:
    """Return the picture of computed and measured responses."""
    responses = data.measured
    measures = data.verdict.summary["measures"]
    if responses is None or not responses.is_comparable():
        return None
    points = []
    for name, gain in zip(
        ("absolute_acceleration_peak", "relative_displacement_amplitude"), responses.factors()
    ):
        measure = measures.get(name, {"value": None})
        if measure["value"] is None:
            points.append(None)
            continue
        error = None if measure["error"] is None else measure["error"] * gain
        points.append((measure["value"] * gain, error))
    factor = "".join(
        f" (computed {name} multiplied by the reading factor {gain:g})"
        for name, gain in zip(("acceleration", "displacement"), responses.gains)
        if gain != 1
    )
    if responses.reading != "peak":
        factor += f" (readings are taken as {responses.reading}, which is {responses.reading_factor:.4g} of the peak)"
    return Picture(
        charts.measured_charts,
        (responses.rows, responses.frequency, responses.input, *points),
        f"Responses measured at the drive frequency, and the computed response{factor}.{_unsettled_sentence(data)}",
    )


def _accuracy_picture(data: RunData) -> Picture | None:
    """Return the picture of accuracy against computing time."""
    curve = data.evaluations.accuracy
    if curve is None:
        return None
    return Picture(accuracy.accuracy_charts, (curve,), accuracy.accuracy_caption(curve))


# Drawing functions by picture name, in the order of the page.
PICTURES = {
    "wear": _wear_picture,
    "worn": _worn_map_picture,
    "curve": _curve_picture,
    "spectra": _spectra_picture,
    "decay": _decay_picture,
    "levels": _levels_picture,
    "pressure": _interface_picture,
    "faces": _faces_picture,
    "loop": _loop_picture,
    "history": _histories_picture,
    "measured": _measured_picture,
    "accuracy": _accuracy_picture,
}


def _unsettled_sentence(data: RunData) -> str:
    """State that a motion is not steady, or return "" if it is steady."""
    outcome = data.verdict.summary["outcome"]
    return (
        ""
        if outcome in SETTLED_OUTCOMES
        else (
            f" The run ended with the outcome '{outcome}': the computed values are not "
            "those of a steady motion."
        )
    )


def _measured_section(data: RunData) -> list:
    """Return a list with the section that compares computed and measured values."""
    responses = data.measured
    measures = data.verdict.summary["measures"]
    if not responses.is_comparable():
        return []
    rows = []
    for row in responses.rows:
        if (
            abs(row.frequency - responses.frequency) > 0.5
            or abs(row.input - responses.input) > 0.01 * responses.input
        ):
            continue
        for (name, key, scale, unit), gain in zip(
            (
                ("acceleration", "absolute_acceleration_peak", G, "g"),
                ("displacement", "relative_displacement_amplitude", 25.4e-6, "mil"),
            ),
            responses.factors(),
        ):
            value = getattr(row, name)
            computed = measures.get(key, {"value": None})["value"]
            if value is None or computed is None:
                continue
            computed = computed * gain
            kind = f"{name}{' (repeat run)' if 'R' in row.flag else ''}"
            ratio = f"{computed / value:.2f}" if value else "&ndash;"
            rows.append(
                [
                    measure_link(kind, key),
                    f"{value / scale:.3g} {unit}",
                    f"{computed / scale:.3g} {unit}",
                    ratio,
                ]
            )
    text = "<p class=soft>No measured row has this frequency and input.</p>"
    if rows:
        text = (
            table_html(("reading", ">measured", ">computed", ">ratio"), rows)
            + f"<p class=soft>{escape(_unsettled_sentence(data).strip())}</p>"
        )
    return [Section("measured", "Against the measurement", text)]


LEVEL_COLUMNS = (
    ("relative_displacement_amplitude", "m"),
    ("absolute_acceleration_peak", "m s-2"),
    ("absolute_acceleration_fundamental", "m s-2"),
    ("acceleration_distortion", "1"),
)


def _levels_section(levels: list) -> Section:
    """Return the section on all drive levels.

    A row has drive, amplitude, acceleration, distortion, the outcome if it is known, and whether
    the interface sticks.
    """
    rows = []
    has_outcomes = any(level.get("outcome") for level in levels)
    for number, one in enumerate(levels, 1):
        cells = []
        for name, unit in LEVEL_COLUMNS:
            value = one["values"].get(name)
            error = one["errors"].get(name)
            has_value = value is not None and np.isfinite(value)
            cells.append(
                format_with_error(name, measure_entry(value, unit, error)) if has_value else EN_DASH
            )
        drive = f"{one['drive']:.4g} N" if one.get("unit") == "N" else f"{one['drive'] / G:.4g} g"
        rows.append(
            [
                str(number),
                drive,
                *cells,
                *([escape(one["outcome"])] if has_outcomes else []),
                "stuck" if one["stuck"] else "slips",
            ]
        )
    drive_name = (
        "force" if any(level.get("unit") == "N" for level in levels) else "base acceleration"
    )
    texts = (
        "half the peak-to-peak motion",
        "peak acceleration",
        "its first harmonic",
        "third / first harmonic",
    )
    heads = [
        ">level",
        f">{drive_name}",
        *(f">{measure_link(text, name)}" for text, (name, _) in zip(texts, LEVEL_COLUMNS)),
        *(["outcome"] if has_outcomes else []),
        "interface",
    ]
    return Section("levels", "Levels", table_html(heads, rows))


def measure_entry(value: float, unit: str, error: float | None) -> dict:
    """Return a measure in the form of an entry of the summary.

    Parameters
    ----------
    value : float
        In SI.
    unit : str
        SI unit.
    error : float or None
        In SI.
    """
    return {"value": value, "unit": unit, "error": error, "floor": 0.0}


def _measures_section(data: RunData) -> Section:
    """Return the section with all measures, their errors and definitions."""
    rows = []
    definitions = data.verdict.means
    measures = data.verdict.summary["measures"]
    for name, measure in order_measures(measures).items():
        value, error = format_value_and_error(name, measure)
        cells = [f"<td id='measure-{escape(name)}'>{escape(name)}</td>", value]
        if measure["value"] is None:
            cells.append(
                f"<td class=soft colspan=3>{sentence_html(measure.get('reason', ''))}</td>"
            )
        else:
            unit = display_units(name, measure["value"], measure["unit"], measure["error"])[0][0]
            error = error or ("unknown" if measure["error"] is None else EN_DASH)
            cells += [
                error,
                f"<td class=v>{escape(unit)}</td>",
                escape(format_imperial(name, measure)),
            ]
        others_lie = record_interval(name, measures)[1]
        text = definitions.get(name, "") + (
            f"; {others_lie} for other records of the random drive" if others_lie else ""
        )
        rows.append([*cells, f"<td class=soft>{sentence_html(text)}</td>"])
    note = (
        (
            f"<p class=soft>The run covers only {data.verdict.cycles:.2g} of a cycle, so measures per cycle do not "
            "cover a "
            "whole cycle.</p>"
        )
        if data.verdict.is_part_of_cycle()
        else ""
    )
    heads = ("measure", ">value", ">error (±)", "unit", "in customary units", "what it is")
    return Section(
        "measures",
        "Measures",
        table_html(heads, rows, "across many")
        + f"<p class=soft>Value and error have the same unit; {EXACT_NOTE.replace('±', 'error')}. summary.json "
        f"has all digits in SI.</p>{note}",
    )


def _cost_section(data: RunData) -> Section:
    """Return the section on the computed effects, their equations and the CPU time."""
    summary = data.verdict.summary
    rows = [
        [escape(e["effect"]), escape(e["equations"]), f"{e['seconds']:.3f}"]
        for e in summary["effects"]
    ]
    parts = ", ".join(f"{k} {v:.3f} s" for k, v in summary["seconds"].items())
    shared = (
        " The friction law and the modes are computed in one loop; the row of the law gives the time of this "
        "loop."
        if summary["kind"] == "rig"
        else ""
    )
    missing_curve = ""
    if data.evaluations.accuracy is None:
        missing_curve = (
            "<p class=soft>There is no picture of accuracy against time, because the number of time steps does "
            "not limit the accuracy of this run; <code>patchfem cost SCENE</code> measures time and errors at "
            "several tolerances.</p>"
        )
    absent = list_displayed_absent_effects(
        summary["not_in_scene"], summary.get("numerics", {}).get("engine")
    )
    text = (
        table_html(("effect", "equations", ">seconds"), rows)
        + f"<p class=soft>Wall-clock seconds: {escape(parts)}.{shared}</p>{missing_curve}"
        "<details><summary>Effects not in the scene, which are neither imported nor computed</summary>"
        f"<p class=soft>{escape(', '.join(absent))}.</p></details>"
    )
    return Section("cost", "What was computed, and the computing time", text)


def _origin_section(data: RunData) -> Section:
    """Return the section on scene, files and versions from which a run came."""
    versions = ", ".join(f"{k} {v}" for k, v in data.versions.items())
    lacks = ["fields.vtkhdf"] * (data.patch.x is None) + ["interfaces"] * (not data.patch.faces)
    file_entries = [file_entry for file_entry in RESULT_FILES if file_entry[0] not in lacks]
    files = "".join(
        f"<li><a href={name}>{name}</a>: {description}</li>" for name, description in file_entries
    )
    repeat_html = (
        ""
        if not data.source.command
        else f"<p>To repeat the run, in the folder of its scene:</p><pre>{escape(data.source.command)}</pre>"
    )
    return Section(
        "origin",
        "Scene and files",
        f"{repeat_html}<p>Files beside this page:</p><ul>{files}</ul>"
        f"<details><summary>Scene</summary><pre>{escape(data.source.text)}</pre></details>"
        "<details><summary>Scene in SI, with the value of every default</summary><pre>"
        f"{escape(data.source.resolved)}</pre></details><details><summary>Versions</summary>"
        f"<p class=soft>patchfem {escape(data.verdict.summary['patchfem'])}, {escape(versions)}</p></details>",
    )


def run_page(result: Result) -> str:
    """Return the HTML page of a run."""
    return page_html(collect_run_data(result))


def draw_axes(result: Result, names: tuple, onto=None):
    """Draw the first of the named pictures for which the run has data, as matplotlib Axes.

    Parameters
    ----------
    result : Result
    names : tuple of str
        Keys of PICTURES.
    onto : Axes or None
        Where to draw the first panel; by default a new figure with all panels.

    Returns
    -------
    Axes or None
        None if the run has nothing to show.
    """
    data = collect_run_data(result)
    picture = next(
        (one for one in (find_picture(name, data) for name in names) if one is not None), None
    )
    if picture is None:
        return None
    if onto is None:
        return pictures.draw_charts.figure(picture.charts(*picture.values)).axes[0]
    pictures.draw_charts.figure(picture.charts(*picture.values), axes_to_use=onto)
    return onto
