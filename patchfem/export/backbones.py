"""The answer of `backbone`: frequency, damping ratio and force of a mode against its amplitude."""

from collections.abc import Callable, Sequence

import numpy as np

from ..campaigns.backbone.records import (
    CURVE_METHODS,
    CURVE_QUANTITIES,
    CURVE_UNITS,
    Backbone,
    match_amplitudes,
)
from ..campaigns.backbone.request import BackboneCases, BackboneRequest, compute_cases
from ..core import PatchfemError
from ..formatting import format_number, format_quantity, rewrite_powers_of_ten
from ..model.model import Model
from ..model.source import Source
from ..scene.assignments import Axis
from . import quantities
from .answer import (
    Answer,
    JsonObject,
    Quantities,
    Quantity,
    Remarks,
    Variable,
    Variables,
    make_columns,
)
from .charts import axes
from .netcdf import from_dataset
from .rows import make_details
from .runs import make_origin

# Columns of a curve and of its band, and words for them in a sentence
CURVE_COLUMNS = (
    "amplitude",
    *(name + end for name in CURVE_QUANTITIES for end in ("", "_error")),
    "force_frequency",
)
BAND_COLUMNS = ("amplitude", "frequency_low", "frequency_high", "damping_low", "damping_high")
SENTENCE_NAMES = {"frequency": "frequency", "damping": "damping ratio"}
# Significant digits in a sentence on the change of frequency or damping
CHANGE_DIGITS = {"frequency": 5, "damping": 3}


def compute_answer(
    build: Callable[..., Model],
    request: BackboneRequest,
    progress: Callable[[str], None] | None = None,
) -> Answer:
    """Compute the backbones that a request asks for, and return them as an answer.

    Parameters
    ----------
    build : callable
        Function that builds the model of the scene with the tables of a backbone and further changed keys.
    request : BackboneRequest
        Mode, amplitudes or forces, method, and the key that is varied.
    progress : callable, optional
        Function that takes the name of the curve that is computed next.
    """
    cases = compute_cases(build, request, progress)
    if cases.axis is None:
        return make_backbone_answer(cases.backbones[0], cases.source)
    return _make_cases_answer(cases)


def make_backbone_answer(backbone: Backbone, source: Source) -> Answer:
    """Return the answer of one backbone: frequency, damping and force of a mode against its amplitude.

    `source` is the scene of the mode.
    """
    measures = _make_quantities(backbone)
    return Answer(
        kind="backbone",
        title=source.title,
        verdict=_make_verdict(backbone, measures),
        quantities=measures,
        data=_make_data([backbone]),
        remarks=Remarks(notes=(*map(_make_sentence, backbone.notes), *backbone.advice[1:])),
        details=_make_details(backbone),
        origin=make_origin(source, "backbone"),
    )


def _make_sentence(text: str) -> str:
    """Return a clause with a capital at its start, a full stop, and readable powers of ten."""
    return rewrite_powers_of_ten(f"{text[0].upper()}{text[1:].rstrip('.')}.")


def draw_backbone(dataset, ax=None):
    """Draw the Dataset of a backbone on matplotlib Axes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of `pf.backbone`.
    ax : matplotlib.axes.Axes, optional
        Axes for the frequency alone; by default those of a new figure, which also has damping ratio and force.

    Returns
    -------
    matplotlib.axes.Axes
        Axes of the frequency.

    Raises
    ------
    PatchfemError
        If the Dataset has no curve of a backbone.
    """
    axes_of_chart = axes.draw_charts(from_dataset(dataset, "backbone"), (), ax, "plot.backbone")
    if axes_of_chart is None:
        raise PatchfemError(
            "plot.backbone: a Dataset returned by pf.backbone is needed, with at least one curve"
        )
    return axes_of_chart


def _make_quantities(backbone: Backbone) -> Quantities:
    """Return the key numbers of a backbone by name.

    They are the natural frequencies, frequency, damping and force at both ends of the recommended curve, its largest
    damping, the exponents of its damping, and the amplitude above which the motion grows, each if it exists.
    """
    frequencies = backbone.frequencies
    out = {}
    curve = backbone.best
    if curve is not None:
        for name, measure in curve.list_measures().items():
            out[name] = Quantity(measure.value, measure.unit, measure.error)
        largest = int(np.argmax(curve.damping))
        # the peak of the damping lies between the neighbouring amplitudes; at an end of the curve its interval is unknown
        near = curve.amplitude[max(largest - 1, 0) : largest + 2]
        ends = near[[0, -1]] if near.size == 3 else (None, None)
        amplitude = Quantity(curve.amplitude[largest], "m", None, *ends)
        out["amplitude_of_largest_damping"] = amplitude

    # a missing frequency is shown with its reason, other missing values are left out
    out |= {
        "free_frequency": Quantity(frequencies.free, "Hz", frequencies.free_error or None),
        "stuck_frequency": Quantity(
            frequencies.stuck, "Hz", frequencies.stuck_error, reason=frequencies.reason
        ),
        "exponent_micro": Quantity(backbone.exponents.micro, error=backbone.exponents.micro_error),
        "exponent_gross": Quantity(backbone.exponents.gross, error=backbone.exponents.gross_error),
        "flutter_amplitude": Quantity(backbone.flutter, "m"),
    }
    return {name: one for name, one in out.items() if one.value is not None or one.reason}


def _make_verdict(backbone: Backbone, measures: Quantities) -> tuple[str, ...]:
    """Return the sentences of the verdict.

    They state the ends of the recommended curve, the natural frequencies, the largest damping, and which curve to use.
    """

    def show(name: str) -> str:
        """Return a quantity as text with its error, such as "143.21 ± 0.13 Hz"."""
        return quantities.format_quantity(name, measures[name])

    curve = backbone.best
    natural = (
        f"Natural frequencies of mode {backbone.mode}: without the contact {show('free_frequency')}"
    )
    if backbone.frequencies.stuck is not None:
        natural += f", with a sticking contact {show('stuck_frequency')}"
    natural += "."
    if curve is None:
        headline = f"No method found frequency and damping of mode {backbone.mode}."
        return (headline, natural, *backbone.advice[:1])

    # first and last point of the recommended curve, and the peak of the damping ratio between them
    peak = f"{show('largest_damping')} at {show('amplitude_of_largest_damping')}"
    is_range = curve.amplitude.size > 1
    has_peak = False
    changes = []
    for name, label in SENTENCE_NAMES.items():
        places = [f"{name}_at_{size}_amplitude" for size in ("smallest", "largest")]
        first, last = (measures[place] for place in places)
        low, high = map(show, places)
        top = measures["largest_damping"]
        has_peak = name == "damping" and all(_exceeds(top, end) for end in (first, last))

        # values that differ by less than their errors are equal
        if has_peak:
            changes.append(f"{label} rises from {low} to {peak} and falls to {high}")
        elif _exceeds(last, first):
            changes.append(f"{label} rises from {low} to {high}")
        elif _exceeds(first, last):
            changes.append(f"{label} falls from {low} to {high}")
        else:
            changes.append(f"{label} {'stays at' if is_range else 'is'} {low}")
    ends = [format_quantity(curve.amplitude[k], "m", 3) for k in (0, -1)]
    span = f"from {ends[0]} to {ends[1]}" if is_range else f"at {ends[0]}"
    sentences = [f"{changes[0][0].upper()}{changes[0][1:]}, {changes[1]}, {span}.", natural]

    if backbone.flutter is not None:
        sentences.append(
            f"Above {show('flutter_amplitude')} the mode gains energy: friction dissipates less than the "
            "negative damping supplies."
        )
    elif is_range and not has_peak:
        sentences.append(f"The largest damping ratio is {peak}.")
    return (*sentences, *backbone.advice[:1])


def _exceeds(quantity: Quantity, other: Quantity) -> bool:
    """Return whether a quantity is larger than another one by more than both errors."""
    errors = (quantity.error or 0.0) + (other.error or 0.0)
    return quantity.value - other.value > errors


def _make_data(backbones: Sequence[Backbone], axis: Axis | None = None) -> Variables:
    """Return frequency, damping ratio and force of each method over the amplitude as variables.

    Names begin with that of the method, such as balance_frequency, and end in _low and _high for the interval of the
    recommended method. A single backbone has this interval also as band_frequency_low and so on. Several backbones, one
    for each value of the key `axis`, have the recommended curves alone, on the union of their amplitudes; NaN stands where
    a backbone has no motion.
    """
    data = {}
    if axis is not None:
        data["case"] = Variable(("case",), np.array(axis.texts), "", axis.key)
    all_bands = [backbone.band for backbone in backbones]
    # Each method has its own amplitudes. Of several backbones only the recommended curves are shown.
    for method in CURVE_METHODS:
        bands = [band if band and band.method == method else None for band in all_bands]
        curves = [backbone.curves.get(method) for backbone in backbones]
        if axis is not None:
            curves = [curve if band else None for curve, band in zip(curves, bands, strict=True)]
        known_amplitudes = [curve.amplitude for curve in curves if curve is not None]
        if not known_amplitudes:
            continue

        # a row for each backbone
        amplitude = np.unique(np.concatenate(known_amplitudes))
        prefix = method.replace("-", "_")
        columns = {f"{prefix}_amplitude": (amplitude, "m")}
        for name in CURVE_COLUMNS[1:] + BAND_COLUMNS[1:]:
            records = bands if name in BAND_COLUMNS else curves
            values = np.full((len(records), amplitude.size), np.nan)
            for row, record in zip(values, records, strict=True):
                if record is not None:
                    row[np.searchsorted(amplitude, record.amplitude)] = getattr(record, name)
            if any(records):
                values = values[0] if axis is None else values
                columns[f"{prefix}_{name}"] = (values, _find_unit(name))
        data |= make_columns(f"case {prefix}_amplitude", columns)

    band = backbones[0].band
    if axis is None and band is not None:
        columns = {f"band_{name}": (getattr(band, name), _find_unit(name)) for name in BAND_COLUMNS}
        data |= make_columns("band_amplitude", columns)
    return data


def _find_unit(name: str) -> str:
    """Return the SI unit of a column of a curve, whose name may end in "_low", "_high" or "_error"."""
    return CURVE_UNITS["frequency" if name == "force_frequency" else name.partition("_")[0]]


def _make_details(backbone: Backbone) -> JsonObject:
    """Return the content of backbone.json in SI units."""
    band = backbone.band
    curves = {}
    for method, curve in backbone.curves.items():
        curves[method] = {name: getattr(curve, name) for name in CURVE_COLUMNS}

    # A backbone without a band has None in place of its method and columns
    return make_details(
        "backbone",
        backbone,
        curves=curves,
        band=band and {name: getattr(band, name) for name in BAND_COLUMNS},
        advice=" ".join(backbone.advice),
    )


def _make_cases_answer(cases: BackboneCases) -> Answer:
    """Return the answer of the backbones for several values of a key: all curves, and what the change does."""
    axis = cases.axis
    verdict, measures = _compare_ends(cases)
    # The page compares the ends of the values. The file has measures and curves of each value.
    return Answer(
        kind="backbone",
        title=cases.source.title,
        verdict=verdict,
        quantities=measures,
        data=_make_data(cases.backbones, axis),
        remarks=Remarks(notes=tuple(_list_notes(cases))),
        details={
            "key": axis.key,
            "values": axis.texts,
            "mode": cases.backbones[0].mode,
            "cases": [
                {"value": text, "measures": _make_quantities(one)} | _make_details(one)
                for text, one in zip(axis.texts, cases.backbones, strict=True)
            ],
        },
        origin=make_origin(cases.source, "backbone"),
    )


def _list_notes(cases: BackboneCases) -> list[str]:
    """Return the notes of all backbones; a note that not all of them have begins with the value of the key."""
    axis = cases.axis
    notes_by_case = [case_backbone.notes for case_backbone in cases.backbones]
    shared = [note for note in notes_by_case[0] if all(note in notes for notes in notes_by_case)]
    notes = [*map(_make_sentence, shared)]
    for text, backbone in zip(axis.texts, cases.backbones):
        case_notes = [note for note in backbone.notes if note not in shared]
        case_notes += [f"method {name}: {reason}" for name, reason in backbone.missing.items()]
        notes += [f"{axis.key} = {text}: {note.rstrip('.')}." for note in case_notes]
    return notes


def _compare_ends(cases: BackboneCases) -> tuple[tuple[str, ...], Quantities]:
    """Return the sentences on what the change of the key from its first to its last value does, and the changes.

    They hold at the amplitude with the largest change of frequency and damping.
    """
    axis = cases.axis
    first, last = cases.backbones[0], cases.backbones[-1]
    subject = f"{axis.key} from {axis.texts[0]} to {axis.texts[-1]}{_describe_change(axis.values)}"
    if first.best is None or last.best is None:
        missing = axis.texts[0] if first.best is None else axis.texts[-1]
        return (f"No method found frequency and damping for {axis.key} = {missing}.",), {}
    # Indices of the amplitudes that both curves have.
    here, there = match_amplitudes(first.best, last.best)
    if not here.size:
        return (f"{subject}: the curves have no common amplitude.",), {}

    # differences at the common amplitudes, and the largest one
    start, end = first.best.at(here), last.best.at(there)
    changes = {}
    for name in CURVE_QUANTITIES:
        error = getattr(end, f"{name}_error") + getattr(start, f"{name}_error")
        changes[name] = getattr(end, name) - getattr(start, name), error
    point = _find_largest_change([changes[name] for name in SENTENCE_NAMES])
    if point is None:
        sentence = "changes frequency and damping ratio by less than their numerical errors"
        return (f"{subject} {sentence}.", *last.advice[:1]), {}

    # The changes at this amplitude as quantities, each with the sum of both errors.
    amplitude = start.amplitude[point]
    measures = {"compared_amplitude": Quantity(amplitude, "m")}
    for name, (step, error) in changes.items():
        measures[f"{name}_change"] = Quantity(step[point], CURVE_UNITS[name], error[point])

    ends = {
        name: [getattr(curve, name)[point] for curve in (start, end)] for name in CURVE_QUANTITIES
    }
    parts = [
        _describe_step(name, measures[f"{name}_change"], ends[name]) for name in SENTENCE_NAMES
    ]
    sentences = [f"{subject}, at {format_quantity(amplitude, 'm', 3)}, {parts[0]} and {parts[1]}."]
    if None not in ends["force"]:
        texts = [format_quantity(force, "N", 3) for force in ends["force"]]
        sentences.append(f"The force at the output there goes from {texts[0]} to {texts[1]}.")
    return (*sentences, *last.advice[:1]), measures


def _find_largest_change(changes: list[tuple[np.ndarray, np.ndarray]]) -> int | None:
    """Return the point with the largest sum of changes, each over its maximum.

    Each pair has the changes (k,) of a value, and the sums (k,) of the errors of both values. The result is None if all
    changes are within their errors.
    """
    score = 0.0
    for step, error in changes:
        is_known = np.abs(step) > error
        if is_known.any():
            score = score + np.where(is_known, np.abs(step) / np.abs(step).max(), 0.0)
    return int(np.argmax(score)) if np.any(score) else None


def _describe_step(name: str, step: Quantity, values: list[float]) -> str:
    """Return the change of the frequency or of the damping ratio between two values as a clause.

    `name` is "frequency" or "damping", `step` the change with its error, and `values` are the first and the last
    value [SI].
    """
    texts = [format_quantity(value, CURVE_UNITS[name], CHANGE_DIGITS[name]) for value in values]
    if abs(step.value) <= step.error:
        return f"keeps the {SENTENCE_NAMES[name]} at {texts[0]}"
    verb = "raises" if step.value > 0 else "lowers"
    size = f" by {format_quantity(abs(step.value), step.unit, 2)}" if name == "frequency" else ""
    return f"{verb} the {SENTENCE_NAMES[name]}{size} from {texts[0]} to {texts[1]}"


def _describe_change(values: Sequence[float | str]) -> str:
    """Return the relative change from the first to the last value, such as " (20 % more)"; "" without one."""
    first, last = values[0], values[-1]
    if not (isinstance(first, float) and isinstance(last, float) and first > 0):
        return ""
    change = last / first - 1
    # Largest relative change of a key that is said in percent.
    if abs(change) > 0.995:
        return f" ({format_number(last / first, 3)} times as much)"
    return f" ({format_number(100 * abs(change), 3)} % {'more' if change > 0 else 'less'})"
