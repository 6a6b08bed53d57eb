"""Answer of the roughness of one or several measured surfaces: parameters, profiles, Abbott curve and spectrum."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...core import PatchfemError
from ...formatting import format_length
from ...surface.files.read import read_surface
from ...surface.quantity import CONFIDENCE_LEVEL, Quantity
from ...surface.roughness import peaks, report
from ...surface.roughness.parameters import abbott_curve
from ...surface.roughness.report import RoughnessReport
from ...surface.spectrum import WAVE_BAND
from ..answer import Answer, JsonObject, Remarks, Variables
from ..quantities import format_value
from ..rows import make_details, make_variables
from . import shared
from .shared import make_maps

ROUGHNESS_INPUT_WORDS = {"profile": "traces", "areal": "scans"}
# Probability of the interval of a parameter of a single trace, from 5 to 95 %
TRACE_INTERVAL_PROBABILITY = 0.9
# parameters in the headline: those of a scan, of a trace with a cut-off, and of one without
HEADLINE_PARAMETERS = (("Sa", "Sq", "Sz"), ("Ra", "Rq", "Rz"), ("Pa", "Pq", "Pt"))
INTERVAL_NOTE = (
    "Intervals of a single trace are 90 % intervals (5 to 95 %) by the jackknife: each section as long as the cut-off is "
    "left out in turn, and Student's t of the logarithm takes the changes of the parameter."
)
MEANS_NOTE = (
    "Means have equal weights, and 95 % intervals by Student's t from the scatter of the files, where these determine the "
    "mean within a factor of two; an error that all files share, such as calibration, is not included."
)
SIZES_NOTE = "The files differ in length or step, so that the means of extremes and slopes mix different quantities."
TWICE_NOTE = "One file is given twice, so that it counts twice in the means."


class Mean(NamedTuple):
    """Mean of a parameter over several files.

    - mean: with its interval
    - scatter: standard deviation of the files about it, in the unit of the mean
    """

    mean: Quantity
    scatter: float


def answer_files(paths: list[Path], units: tuple[str, str] | None = None, **options) -> Answer:
    """Measure the roughness of one or several traces or scans.

    Parameters
    ----------
    paths : list of Path
        Files of traces or scans.
    units : tuple of str, optional
        Units of x (and y) and of z, for files that state none.
    **options
        `cutoff`, `window`, `form`, `short` of `surface.roughness.report.make_report`.

    Returns
    -------
    Answer

    Raises
    ------
    PatchfemError
        If a file cannot be read or evaluated.
    """
    return make_roughness_answer(
        [report.make_report(read_surface(path, units), **options) for path in paths]
    )


def make_roughness_answer(reports: list[RoughnessReport]) -> Answer:
    """Return the answer of the reports of one or several surfaces."""
    # Traces and scans have different parameters, so that each kind has its own headline.
    quantities, means, headlines, cautions = {}, [], [], []
    for kind, name in ROUGHNESS_INPUT_WORDS.items():
        members = [report for report in reports if report.kind == kind]
        if not members:
            continue
        values = {value.name: value for value in members[0].values}
        state = ""
        # Several surfaces of one kind give means, with a caution where these are of limited use.
        if len(members) > 1:
            averages = _average_parameters(members)
            caution = _find_caution(members)
            cautions += caution
            means.append(_means_to_dict(kind, len(members), averages, caution))
            values = {key: mean.mean for key, mean in averages.items()}
            state = f"Mean of {len(members)} {name}: "
        headlines.append(f"{state}{_format_main_parameters(values, members)}.")
        quantities |= shared.convert_quantities(values)

    # A treatment that several surfaces share is named once, after the headlines.
    notes = [text for report in reports for text in report.notes]
    if any(value.low is not None for report in reports for value in report.values):
        notes.append(INTERVAL_NOTE)
    profiles = [report_to_dict(report) for report in reports]
    treatments = dict.fromkeys(describe_treatment(report) for report in reports)
    return Answer(
        kind="profile",
        title="Roughness of " + ", ".join(Path(report.source).name for report in reports),
        verdict=(*headlines, *treatments)[: shared.MAX_VERDICT_SENTENCES],
        quantities=quantities,
        data=_make_data(reports),
        remarks=Remarks(tuple(cautions), (*notes, *([MEANS_NOTE] if means else []))),
        details={"patchfem": __version__, "profiles": profiles, "means": means},
        origin={"patchfem": __version__},
    )


def _average_parameters(members: list[RoughnessReport]) -> dict[str, Mean]:
    """Return the means of the parameters that all files have, with 95 % intervals from the scatter of the files.

    Student's t of the logarithm keeps the interval of a positive parameter above 0. An interval that is wider than
    a factor of two either way, such as that of most pairs of files, is left out with the reason.
    """
    from scipy.special import stdtrit

    count = len(members)
    student = stdtrit(count - 1, (1 + CONFIDENCE_LEVEL) / 2)
    means = {}
    for quantity in members[0].values:
        name = quantity.name
        values = [each[name].value for each in members]
        if None in values:
            continue
        mean = np.mean(values)
        scatter = np.std(values, ddof=1)
        error = student * scatter / np.sqrt(count)

        # A skewness may have either sign.
        ends = (mean - error, mean + error)
        reason = ""
        if not name.endswith("sk") and mean > 0:
            factor = np.exp(error / mean)
            ends = (mean / factor, mean * factor)
            # Largest ratio of the end of an interval of a mean to the mean that says something.
            if factor > 2.0:
                ends = (None, None)
                reason = "few_files"
        averaged = quantity._replace(value=mean, low=ends[0], high=ends[1], reason=reason)
        means[name] = Mean(averaged, scatter)
    return means


def _find_caution(members: list[RoughnessReport]) -> list[str]:
    """Return the sentence on why the means of these files are of limited use; [] if they are not."""
    if len({report.source for report in members}) < len(members):
        return [TWICE_NOTE]
    sizes = np.array([(report.sampling.length, report.sampling.step) for report in members])
    # Ratio of lengths or steps of several files, above which their means mix quantities.
    is_mixed = (sizes.max(axis=0) > 1.001 * sizes.min(axis=0)).any()
    return [SIZES_NOTE] if is_mixed else []


def _means_to_dict(kind: str, count: int, means: dict[str, Mean], notes: list[str]) -> JsonObject:
    """Return the means of one kind of files as an object of profile.json.

    `count` is the number of files, `means` are by name of the parameter, and `notes` say what the means are worth.
    """
    measures = {}
    for name, mean in means.items():
        measures[name] = shared.to_answer(mean.mean).as_json() | {"scatter": mean.scatter}
    content = {"kind": kind, "files": count, "confidence": CONFIDENCE_LEVEL, "notes": notes}
    return content | {"measures": measures}


def _format_main_parameters(values: dict[str, Quantity], members: list[RoughnessReport]) -> str:
    """Return the parameters of the headline as text; a mean without an interval has the range of the files."""
    parts = []
    names = next(names for names in HEADLINE_PARAMETERS if names[0] in values)
    for name in names:
        if not shared.is_known(values.get(name)):
            continue
        text = f"{name} {shared.format_value(name, values[name])}"
        if values[name].reason == "few_files":
            mean_values = [each[name].value for each in members]
            ends = [format_value(end, "m", 3) for end in (min(mean_values), max(mean_values))]
            text += f" ({ends[0]} to {ends[1]} in the files)"
        parts.append(text)
    return ", ".join(parts)


def describe_treatment(roughness: RoughnessReport) -> str:
    """Return the sentence on size, form, window and filters of a measured surface."""
    size, treatment = roughness.sampling, roughness.treatment
    shape = " x ".join(map(str, size.shape))
    text = f"{shape} heights over {format_length(size.length)}, every {format_length(size.step)}"
    text += f", about the least-squares {treatment.form}"
    if treatment.window is not None:
        text += f", window {', '.join(map(format_length, treatment.window))}"
    if treatment.short:
        text += f", S-filter {format_length(treatment.short)}"
    if treatment.cutoff is not None:
        return (
            f"{text}, cut-off {format_length(treatment.cutoff)} (half of it trimmed at each end)."
        )
    if roughness.kind == "areal":
        return f"{text}, no L-filter."

    # the trace is longer than its last position by one sampling interval
    fitting = report.fitting_cutoff(size.length + size.step, size.step)
    advice = f'the longest standard one is --cutoff "{format_length(fitting)}"' if fitting else ""
    return f"{text}; without a cut-off there is no roughness profile{advice and ', '}{advice}."


def report_to_dict(roughness: RoughnessReport) -> JsonObject:
    """Return the roughness of a surface as an object of profile.json."""
    has_interval = any(value.low is not None for value in roughness.values)
    content = make_details(
        "profile",
        roughness,
        confidence=TRACE_INTERVAL_PROBABILITY if has_interval else None,
        measures=shared.convert_quantities({value.name: value for value in roughness.values}),
    )
    if roughness.kind == "areal":
        return content
    return content | {"band": WAVE_BAND, "asperities": _find_moments(roughness)}


def _find_moments(roughness: RoughnessReport) -> dict | None:
    """Return what an asperity law needs of the waves below the cut-off: rms height, slope and curvature; None if flat."""
    cutoff = roughness.treatment.cutoff
    try:
        moments = peaks.trace_moments(roughness.surface.primary, cutoff)
    except PatchfemError:
        return None
    values = {f"rms_{name}": value for name, value in moments.fine._asdict().items()}
    notes = [*moments.dust, *filter(None, [moments.not_gaussian])]
    return {"cutoff": cutoff, **values, "notes": notes}


def _make_data(reports: list[RoughnessReport]) -> Variables:
    """Return the Abbott curves of all files, and the profiles, map and spectrum of a single file."""
    curves = [abbott_curve(report.heights) for report in reports]
    data = make_variables(
        "surface",
        file=[report.source for report in reports],
        material_ratio=curves[0][0],
        abbott=[height for _, height in curves],
    )
    # Only Abbott curves can be compared over files.
    if len(reports) > 1:
        return data

    surface = reports[0].surface
    if reports[0].kind == "areal":
        return data | make_maps(surface.x, surface.y, height_map=surface.z)
    data |= make_variables("surface", x=surface.primary.x, primary=surface.primary.z)
    if surface.roughness is not None:
        rough = surface.roughness
        data |= make_variables(
            "surface", x_rough=rough.x, roughness=rough.z, waviness=surface.waviness.z
        )
    spectrum = surface.spectrum
    return data | make_variables("surface", wavelength=spectrum.waves, density=spectrum.density)
