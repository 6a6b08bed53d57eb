"""Files, page and text of a backbone curve: frequency and damping ratio against amplitude."""

from html import escape
from typing import NamedTuple

import numpy as np

from .. import __version__, formatting
from ..campaigns.backbone.band import PREFERRED_METHODS, Band
from ..campaigns.backbone.records import Backbone, Curve
from ..disk.atomic_write import write_rows, write_text
from .drawing import charts, pictures
from .netcdf import Contents, write_netcdf
from .pages.document import Section, document_html, sentence_html, table_html
from .results import Folder
from .summary import write_json

COLUMNS = ("amplitude", "frequency", "frequency_error", "damping", "damping_error")
CSV_HEADERS = (
    "method",
    "amplitude [m]",
    "frequency [Hz]",
    "frequency_error [Hz]",
    "damping",
    "damping_error",
)
VARIABLES = {  # unit and description of each variable of backbone.nc
    "frequency": ("Hz", "frequency"),
    "frequency_error": ("Hz", "error of the frequency"),
    "damping": ("1", "damping ratio, structure and friction together"),
    "damping_error": ("1", "error of the damping ratio"),
}
DESCRIPTIONS = {
    "balance": "The curve belongs to the periodic motion that the rig would have without a net "
    "loss of energy. A test in phase resonance follows this motion; a ring-down has its frequency, "
    "but loses amplitude faster if the joint stiffens as the amplitude falls.",
    "decay": "The curve belongs to a free decay from the largest amplitude; frequency and damping "
    "are evaluated from one turning point to the next.",
    "quasi-static": "The frequency is that with the secant stiffness of the contact between the "
    "turning points. The damping follows from the loops of the friction law.",
}
BAND_VARIABLES = {  # unit and description of each variable of the band in backbone.nc
    "frequency_low": ("Hz", "lower limit of the frequency"),
    "frequency_high": ("Hz", "upper limit of the frequency"),
    "damping_low": ("1", "lower limit of the damping ratio"),
    "damping_high": ("1", "upper limit of the damping ratio"),
}
BOLD_WIDTH = 3.2  # line width of the recommended curve
THIN_WIDTH = 1.0  # line width of the other curves
COLOURS = {"balance": "accent", "decay": "warm", "quasi-static": "#2f9e63"}
LEFT_OUT_NOTE = (
    " Frequencies with errors larger than the frequency itself are left out of the picture, not "
    "of the table."
)
MAX_LISTED_AMPLITUDES = 25  # largest number of amplitudes that are listed completely
N_LISTED_AMPLITUDES = 9  # number of amplitudes that are listed of a longer curve
# Lower end of an error bar on a logarithmic axis, relative to the smallest value.
BAR_FLOOR_FACTOR = 0.1


def backbone_data(backbone: Backbone) -> dict:
    """Return a backbone as the dict that `patchfem backbone --json` prints, in SI units."""
    frequencies = backbone.frequencies
    exponents = backbone.exponents
    curves = {
        method: {name: getattr(curve, name).tolist() for name in COLUMNS}
        for method, curve in backbone.curves.items()
    }
    return {
        "mode": backbone.mode,
        "free_frequency": frequencies.free,
        "free_frequency_error": frequencies.free_error,
        "stuck_frequency": frequencies.stuck,
        "stuck_frequency_error": frequencies.stuck_error,
        "curves": curves,
        "missing": backbone.missing,
        "exponent": {
            "micro": exponents.micro,
            "gross": exponents.gross,
            "micro_theory": exponents.micro_theory,
        },
        "flutter_amplitude": backbone.flutter,
        "notes": list(backbone.notes),
        "method": backbone.answer.band and backbone.answer.band.method,
        "band": _band_data(backbone),
        "advice": backbone.answer.advice,
    }


def _band_data(backbone: Backbone) -> dict | None:
    """Return the uncertainty band of a backbone curve as lists in SI units, or None if it has none."""
    band = backbone.answer.band
    if band is None:
        return None
    return {name: getattr(band, name).tolist() for name in ("amplitude", *BAND_VARIABLES)}


def backbone_contents(backbone: Backbone, title: str = "") -> Contents:
    """Return the contents of backbone.nc: the curve of each method over its amplitudes."""
    variables = {}
    coordinates = {}
    for method, curve in backbone.curves.items():
        prefix = method.replace("-", "_")
        dimension = f"{prefix}_amplitude"
        description = {"units": "m", "long_name": "half the peak-to-peak motion at the output"}
        coordinates[dimension] = (dimension, curve.amplitude, description)
        for name, (unit, text) in VARIABLES.items():
            description = {"units": unit, "long_name": f"{text}, by {method}"}
            variables[f"{prefix}_{name}"] = (dimension, getattr(curve, name), description)
    band = backbone.answer.band
    if band is not None:
        description = {"units": "m", "long_name": "half the peak-to-peak motion at the output"}
        coordinates["band_amplitude"] = ("band_amplitude", band.amplitude, description)
        for name, (unit, text) in BAND_VARIABLES.items():
            description = {"units": unit, "long_name": f"{text} that tests measure"}
            variables[f"band_{name}"] = ("band_amplitude", getattr(band, name), description)
    attributes = {"title": title, "patchfem": __version__, "mode": backbone.mode}
    if backbone.missing:
        reasons = [f"{method}: {text}" for method, text in backbone.missing.items()]
        attributes["missing"] = "; ".join(reasons)
    numbers = {
        "free_frequency": backbone.frequencies.free,
        "stuck_frequency": backbone.frequencies.stuck,
        "exponent_micro": backbone.exponents.micro,
        "exponent_gross": backbone.exponents.gross,
        "flutter_amplitude": backbone.flutter,
        "notes": list(backbone.notes),
        "method": band and band.method,
        "advice": backbone.answer.advice or None,
    }
    attributes |= {name: value for name, value in numbers.items() if value is not None}
    return Contents(variables, coordinates, attributes)


def write_backbone(
    backbone: Backbone, title: str, resolved: str, folder: Folder, with_page: bool = True
) -> dict:
    """Write the files of a backbone into an open results folder.

    Returns the dict of `backbone_data`.

    Parameters
    ----------
    backbone : Backbone
    title : str
        Title of the scene.
    resolved : str
        Text of the scene in SI units.
    folder : Folder
    with_page : bool
    """
    answer = backbone_data(backbone)
    rows: list = [CSV_HEADERS]
    for method, curve in backbone.curves.items():
        columns = np.column_stack([getattr(curve, name) for name in COLUMNS])
        rows += [[method, *map(repr, row)] for row in columns.tolist()]
    write_rows(folder.path / "backbone.csv", rows)
    write_netcdf(backbone_contents(backbone, title), folder.path / "backbone.nc")
    write_json(answer, folder.path / "backbone.json")
    write_text(folder.path / "scene.resolved.toml", resolved)
    if backbone.curves:
        write_text(
            folder.path / "backbone.svg",
            pictures.draw_charts(backbone_charts(backbone.curves, backbone.answer.band)),
        )
    if with_page:
        write_text(folder.path / "report.html", page_html(backbone, title))
    return answer


def backbone_charts(curves: dict, band: Band | None = None) -> list:
    """Return charts of frequency and damping ratio of a backbone against amplitude, with errors.

    The recommended curve is bold and lies in its band; the others are thin. A frequency whose error
    is larger than itself would stretch the axis, so it is left out.

    Parameters
    ----------
    curves : dict of Curve
        By method.
    band : Band, optional
        None: no curve is recommended, and all have error bars.
    """
    amplitudes = np.concatenate([curve.amplitude for curve in curves.values()])
    unit, scale = formatting.choose_axis_unit(amplitudes, "m")
    amplitude_axis = charts.make_axis("amplitude at the output", unit, True)
    is_log = all((curve.damping > 0).all() for curve in curves.values())
    frequency = []
    damping = []
    if band is not None:
        frequency.append(_band_mark(band, scale, "frequency"))
        damping.append(
            _band_mark(band, scale, "damping", floor=_damping_floor(curves, is_log=is_log))
        )
    # The recommended curve is drawn last, over the others.
    recommended = band.method if band is not None else ""
    for method, curve in sorted(curves.items(), key=lambda item: item[0] == recommended):
        x = curve.amplitude * scale
        has_small_error = _has_small_error(curve)
        style = _curve_style(method, band)
        frequency += _curve_marks(
            style,
            x[has_small_error],
            curve.frequency[has_small_error],
            curve.frequency_error[has_small_error],
            False,
        )
        damping += _curve_marks(style, x, curve.damping, curve.damping_error, is_log)
    return [
        charts.make_chart(
            "Frequency", amplitude_axis, charts.make_axis("frequency", "Hz"), frequency
        ),
        charts.make_chart(
            "Damping ratio", amplitude_axis, charts.make_axis("damping ratio", "", is_log), damping
        ),
    ]


def _damping_floor(curves: dict, *, is_log: bool) -> float:
    """Return the lower limit of error bars and bands of the damping ratio, or -inf on a linear axis."""
    if not is_log:
        return -np.inf
    return BAR_FLOOR_FACTOR * min(float(curve.damping.min()) for curve in curves.values())


def _band_mark(band: Band, scale: float, name: str, floor: float = -np.inf) -> dict:
    """Return the chart mark of the uncertainty band of the frequency or of the damping ratio."""
    low = np.maximum(getattr(band, f"{name}_low"), floor)
    high = getattr(band, f"{name}_high")
    colour = COLOURS[band.method]
    return charts.make_mark("band", colour, "band", x=band.amplitude * scale, low=low, high=high)


class CurveStyle(NamedTuple):
    """Colour, legend and line width of a curve; if the width is None, points and error bars are drawn."""

    method: str
    legend: str
    width: float | None


def _curve_style(method: str, band: Band | None) -> CurveStyle:
    """Return the style of the curve of a method: bold if the method is recommended, thin if another one is."""
    if band is None:
        return CurveStyle(method, method, None)
    if method == band.method:
        return CurveStyle(method, f"{method} (use this)", BOLD_WIDTH)
    return CurveStyle(method, method, THIN_WIDTH)


def _curve_marks(style: CurveStyle, x, y, errors, is_log: bool) -> list:
    """Return the chart marks of a backbone curve: a line, and error bars if the style has no line width."""
    colour = COLOURS[style.method]
    if style.width is not None:
        return [charts.make_line(x, y, colour, style.legend, width=style.width)]
    dots = {"shape": "circle", "errors": errors}
    if is_log:
        dots["floor"] = BAR_FLOOR_FACTOR * float(y.min(initial=1.0))
    return [charts.make_line(x, y, colour, style.legend), charts.make_dots(x, y, colour, **dots)]


def _has_small_error(curve: Curve) -> np.ndarray:
    """Return whether the frequency of each point (k,) of a curve exceeds its error.

    All values are True if no frequency does.
    """
    is_small = curve.frequency_error <= curve.frequency
    return is_small | (not is_small.any())


def page_html(backbone: Backbone, title: str) -> str:
    """Return the HTML page of a backbone."""
    page_charts = []
    if backbone.curves:
        page_charts = [
            chart | {"anchor": f"chart{k}"}
            for k, chart in enumerate(backbone_charts(backbone.curves, backbone.answer.band))
        ]
    first, *more = summarise_backbone(backbone)
    paragraphs = "".join(f"<p>{sentence_html(text)}</p>" for text in more)
    lead = f"<div class=verdict><b>{sentence_html(first)}</b>{paragraphs}</div>"
    sections = [
        Section(
            "curves", "Frequency and damping against amplitude", _charts_html(backbone, page_charts)
        ),
        Section("ways", "How the curves were computed", _methods_html(backbone)),
        Section("values", "Values", _values_table(backbone)),
    ]
    heading = f"Mode {backbone.mode}: frequency and damping against amplitude"
    if title:
        heading = f"{heading}: {title}"
    data = {"charts": page_charts} if page_charts else None
    scripts = ("figures.js", "curves.js") if page_charts else ()
    return document_html(heading, lead, sections, data, scripts)


def _charts_html(backbone: Backbone, page_charts: list) -> str:
    """Return the HTML elements of the charts of a backbone, with a caption."""
    if not page_charts:
        return "<p>No curve was found.</p>"
    cells = "".join(
        f'<div id="{chart["anchor"]}" class=chart role=img aria-label="{escape(chart["title"])}"></div>'
        for chart in page_charts
    )
    caption = "The bars show the numerical errors."
    if backbone.answer.band is not None:
        tests = ""
        if backbone.answer.band.ring_down is not None:
            tests = " and what the other kinds of test read"
        caption = (
            f"Use the bold curve. The band around it contains the numerical errors{tests}; the thin "
            "curves are the other methods."
        )
    if not all(_has_small_error(curve).all() for curve in backbone.curves.values()):
        caption += LEFT_OUT_NOTE
    return f"<figure><div class=row>{cells}</div><figcaption>{caption}</figcaption></figure>"


def _methods_html(backbone: Backbone) -> str:
    """Return the HTML table that describes the methods of a backbone, and the notes."""
    rows = []
    for method, text in DESCRIPTIONS.items():
        if method in backbone.curves:
            rows.append([escape(method), sentence_html(text)])
        elif method in backbone.missing:
            rows.append([escape(method), sentence_html(f"not known: {backbone.missing[method]}")])
    notes = "".join(
        f"<p>{sentence_html(text[0].upper() + text[1:])}.</p>" for text in backbone.notes
    )
    return table_html(("", ""), rows) + notes


def _values_table(backbone: Backbone) -> str:
    """Return the HTML table of all points of a backbone with their errors."""
    rows = []
    for method, curve in backbone.curves.items():
        for k in range(curve.amplitude.size):
            rows.append([method, *(escape(text) for text in _format_point(curve, k))])
    return table_html(("method", ">amplitude", ">frequency", ">damping ratio"), rows)


class FormattedPoint(NamedTuple):
    """Amplitude, frequency and damping ratio of a point of a backbone as text, with errors."""

    amplitude: str
    frequency: str
    damping: str


def _format_point(curve: Curve, k: int) -> FormattedPoint:
    """Format point k of a backbone curve with its errors."""
    return FormattedPoint(
        formatting.format_quantity(curve.amplitude[k], "m", 3),
        formatting.format_value(curve.frequency[k], curve.frequency_error[k], unit="Hz"),
        formatting.format_value(curve.damping[k], curve.damping_error[k]),
    )


def _format_frequency(value: float, error: float | None) -> str:
    """Format a natural frequency [Hz] with its error [Hz], which may be 0 or None."""
    if error:
        return formatting.format_value(value, error, unit="Hz")
    return formatting.format_quantity(value, "Hz", 5)


def summarise_backbone(backbone: Backbone) -> list:
    """Return sentences on the results of a backbone, first on both ends of its best curve."""
    frequencies = backbone.frequencies
    free = _format_frequency(frequencies.free, frequencies.free_error)
    stuck = ""
    if frequencies.stuck is not None:
        text = _format_frequency(frequencies.stuck, frequencies.stuck_error)
        stuck = f", and {text} while the contact sticks"
    out = [f"The natural frequency of mode {backbone.mode} is {free} without the contact{stuck}."]
    methods = [method for method in PREFERRED_METHODS if method in backbone.curves]
    curve = backbone.curves[methods[0]] if methods else None
    if curve is not None:
        out = [_describe_ends(backbone.mode, curve), *out, *_describe_largest_damping(curve)]
    out += backbone.answer.sentences
    exponents = backbone.exponents
    theory = ""
    if exponents.micro_theory is not None:
        theory = f" (theory: {exponents.micro_theory:.3g})"
    powers = []
    if exponents.micro is not None:
        powers.append(f"to the power {exponents.micro:.3g} in micro-slip{theory}")
    if exponents.gross is not None:
        powers.append(f"to the power {exponents.gross:.3g} in gross slip (theory: 1)")
    if powers:
        out.append(
            "The energy that the contact dissipates per cycle grows with the amplitude "
            f"{' and '.join(powers)}."
        )
    if backbone.flutter is not None:
        out.append(
            f"At amplitudes above {formatting.format_quantity(backbone.flutter, 'm', 3)} the mode gains energy, "
            "because friction dissipates less than the negative damping supplies."
        )
    return out


def _describe_ends(mode: str, curve: Curve) -> str:
    """Describe frequency and damping ratio at the smallest and the largest amplitude."""
    ends = [_format_point(curve, k) for k in sorted({0, curve.amplitude.size - 1})]
    parts = [
        f"{point.amplitude}: {point.frequency}, damping ratio {point.damping}" for point in ends
    ]
    return f"Mode {mode} at {'; at '.join(parts)}."


def _describe_largest_damping(curve: Curve) -> list:
    """Return a list with a sentence on the largest damping ratio of a curve."""
    count = curve.amplitude.size
    if count < 2:
        return []
    k = int(np.argmax(curve.damping))
    amplitude = formatting.format_quantity(curve.amplitude[k], "m", 3)
    frequency = formatting.format_quantity(curve.frequency[k], "Hz", 5)
    return [
        f"Among these {count} amplitudes the damping ratio is largest at {amplitude}: "
        f"{curve.damping[k]:.3g}, with a frequency of {frequency}."
    ]


def format_backbone(backbone: Backbone) -> list:
    """Return the results of a backbone as lines of text: sentences, a table, and methods that have no curve."""
    head = f"{'method':<13}{'amplitude':>12}{'frequency':>26}{'damping ratio':>26}"
    out = [*summarise_backbone(backbone), head]
    for method, curve in backbone.curves.items():
        count = curve.amplitude.size
        n_shown = count if count <= MAX_LISTED_AMPLITUDES else N_LISTED_AMPLITUDES
        rows = np.unique(np.linspace(0, count - 1, n_shown).round().astype(int))
        for k in rows:
            amplitude, frequency, damping = _format_point(curve, k)
            out.append(f"{method:<13}{amplitude:>12}{frequency:>26}{damping:>26}")
        if rows.size < count:
            out.append(
                f"{method}: {rows.size} of {count} amplitudes are shown; backbone.csv has all"
            )
    out += [f"{method}: not known: {text}" for method, text in backbone.missing.items()]
    return out
