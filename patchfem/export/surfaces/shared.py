"""Parts of the answers on surfaces: sentences of a comparison, quantities, bands, maps, and the record itself.

There is a table of codes each for verdicts, findings and reasons. A sentence is a template whose fields are the numbers of
the record as text; no sentence is read back.
"""

from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...surface.compare.records import Comparison, Track
from ...surface.quantity import CONFIDENCE_LEVEL, Quantity
from .. import answer, quantities
from ..answer import JsonObject, Remarks, Variables
from ..rows import make_variables
from ..surface_definitions import name_in_track

MAX_MAP_POINTS = 400  # largest number of rows and of columns of a stored map
SURFACE_NAMES = ("before", "after")  # keys of the two compared surfaces or runs
# Numbers of compare.json that the page and the screen show under another name: those of the longest track in both traces.
SHOWN_ELSEWHERE = (
    "worn_depth_within",
    "worn_from_before",
    "worn_from_after",
    "worn_to_before",
    "worn_to_after",
)
RATIO_ROUND_OFF = 1e-6  # largest difference of a ratio from 1 that is round-off
MAX_VERDICT_SENTENCES = 4  # largest number of sentences of a verdict
INTERVALS_SENTENCE = (
    "Numbers in brackets are 95 % intervals for the measured place; another place on the surface may differ by "
    "more."
)
# Headline for each code of the verdict. {mean}: worn depth with its interval; {region}: what it is the mean of.
VERDICT_HEADLINES = {
    "worn": "Worn depth {mean}, the mean of the lost material over {region}.",
    "no_wear": "No wear is shown: the mean worn depth over {region} is at most {at_most}.",
    "grown": "Material grew: {grown} stand above the first surface, {lost} are lost; deposits, or files in the wrong order.",
    "worn_and_grown": "Worn depth {mean}, the mean of the lost material over {region}, and material grew: {lost} lost, "
    "{grown} grown.",
    "growth_at_ends": "Either a scar of {scar_depth} over the rest of the surface, or {growth_height} of material that "
    "grew at the ends: both are possible.",
    "scar_or_bow": "Either a scar over all of the surface, up to {scar_depth} deep on average, or a bent datum of the "
    "instrument: both are possible.",
    "scar_or_step": "Either a scar of {scar_depth} that reaches beyond the end of the traces, or a jump of the datum of the "
    "instrument by this height: both are possible.",
    "scar_or_drift": "Either wear of {scar_depth}, the mean over {region}, or drift of the instrument: both are possible.",
    "elsewhere": "Not comparable: no common part of both surfaces is found, and no unworn flanks of a track show a depth.",
    "no_datum": "No worn depth: the place is the same, but too few heights agree ({unworn} of all) to measure depths from.",
    "mirror_finish": "Not comparable: the short waves of the surface (rms height {rq}) hardly exceed the noise ({noise}).",
    "identical": "No wear: both files hold the same heights; was the same file given twice?",
}
# Second sentence where there is no worn depth: what would be seen, or what to do.
NO_DEPTH_ADVICE = {
    "no_wear": "A track over the middle third with unworn flanks is found from a mean depth of {detection_limit} on.",
    "elsewhere": "Measure the same place again, or across the whole track with unworn surface on both sides.",
    "no_datum": "Measure a longer part, so that more of the unworn surface is on both traces.",
    "mirror_finish": "Measure with less noise; for traces, the start may be marked on the part and its shift given.",
    "growth_at_ends": "Measurements that end on unworn surface on both sides would decide.",
    "scar_or_drift": "The unworn parts drift so much that one of many places may look as deep; comparing two measurements "
    "of the worn surface would show the drift alone.",
    "scar_or_step": "Traces with unworn surface on both sides of the scar, or a second measurement, would decide.",
    "scar_or_bow": "Longer traces with unworn surface on both sides, or a datum that is known to be straight, would decide.",
}
# Headline and advice of scans where they differ; flanks are those of a track in a trace.
SCAN_VERDICTS = {
    "elsewhere": (
        "Not comparable: no part of the first scan is found in the second one.",
        "Measure the same place again, with more of the unworn surface beside the track.",
    ),
    "no_wear": (
        VERDICT_HEADLINES["no_wear"],
        "A worn square as large as those that are tested, up to 25 x 25 points, is not seen below a mean depth of "
        "{detection_limit}.",
    ),
}
# Sentences on findings: further sentences of the verdict, warnings, and notes.
VERDICT_FINDINGS = {
    "no_old_surface_left": "From {from} to {to} nothing of the first surface is left; the depth is measured below "
    "the unworn flanks.",
    "bow_subtracted": "A bow of {height} over the common length was subtracted, because a bent datum and wear of this shape "
    "look alike; it would be a worn area of {area}.",
    "hidden_even_wear": "Wear that is even or wedge-shaped over all of {region}{limit} looks like a shift or tilt of the "
    "datum and is not in these depths.",
    "worn_tops": "Only the tops are lost; the valleys between them are those of the first surface.",
}
FINDING_WARNINGS = {
    "other_gain": "All heights after wear are {gain} times those before, as another gain of the instrument would make "
    "them, and wear does not; calibrate z of both measurements.",
    "likely_place": "The place is likely, not sure: there the surfaces agree by {significance} standard deviations more "
    "than at other places, and more than {sure} make a place sure; compare their curves.",
    "drift": "The datum drifts by {height} (rms), more than the noise of neighbouring depths ({noise}); the intervals "
    "contain this error.",
}
FINDING_NOTES = {
    "left_out": "{before} heights before wear and {after} after it are spikes, dropouts or dust and are left out; "
    "--keep-spikes keeps them.",
    "mirrored": "The second surface was measured in the opposite direction; it was mirrored, so that its x counts from "
    "the other end.",
    "other_length": "Lengths in the second trace are {scale} ({low} to {high}) times those in the first.",
}
MISSING_NUMBER_TEXT = "any amount"  # stands for a missing number
# Why a quantity has no value.
MISSING_VALUE_REASONS = {
    "elsewhere": "no common part of both surfaces is found",
    "no_wear": "no wear is shown",
    "no_track": "no track is shown",
    "cut_off": "the track leaves the part that both surfaces show",
    "noise": "the noise is as large as the roughness",
    "short_track": "the track, or the surface beside it, is too short for a standard cut-off",
    "scans": "only that of traces is compared",
    "unresolved": "it is shorter than two steps, which do not resolve it",
    "not_falling": "the autocorrelation does not fall to 0.2 within half of each side",
    "no_limit": "even or wedge-shaped wear of any size looks like an offset or tilt of the datum",
    "not_hidden": "unworn parts show where the datum is, so that no wear can hide",
    "identical": "both files hold the same heights",
    "no_datum": "too few heights agree to measure depths from",
    "mirror_finish": "the short waves of the surface hardly exceed the noise",
    "growth_at_ends": "a scar and growth at the ends are both possible",
    "scar_or_bow": "a scar and a bent datum are both possible",
    "scar_or_step": "a scar and a jump of the datum are both possible",
    "scar_or_drift": "wear and drift of the instrument are both possible",
    "flat": "the surface is flat",
    "undetermined": "the heights do not determine it",
    "band": "the surface is too short, or its step too long, for the waves of the band",
    "sections": "no interval from fewer than five sections",
    "few_files": "no interval from so few files",
}
# SI units of the numbers of findings other than lengths; of areas between traces, and of volumes between scans
RATIO_NUMBERS = ("unworn", "scale", "low", "high", "gain", "significance", "sure")
FINDING_NUMBER_UNITS = dict.fromkeys(RATIO_NUMBERS, "1")
AREA_OR_VOLUME_NUMBERS = ("grown", "lost", "area")


def make_band(name: str, values: np.ndarray, half_width: np.ndarray) -> Variables:
    """Return lengths with the ends of their band as the variables NAME, NAME_low and NAME_high.

    Parameters
    ----------
    name : str
        Name of the variable.
    values, half_width : (n,) array
        Lengths, and half-widths of their band [m].
    """
    ends = {f"{name}_low": values - half_width, f"{name}_high": values + half_width}
    return make_variables("surface", **{name: values}, **ends)


def make_maps(x: np.ndarray, y: np.ndarray, **heights: np.ndarray) -> Variables:
    """Return maps (m, n) [m] at x (n,), y (m,) [m] as variables, with every k-th row and column if they are large."""
    rows, columns = (slice(None, None, -(-axis.size // MAX_MAP_POINTS)) for axis in (y, x))
    maps = {name: one[rows, columns].astype(np.float32) for name, one in heights.items()}
    return make_variables("surface", x=x[columns], y=y[rows], **maps)


class Words(NamedTuple):
    """Sentences of a comparison: verdict (at most four), warnings and notes."""

    verdict: tuple[str, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]


def to_answer(quantity: Quantity) -> answer.Quantity:
    """Convert a measured quantity to a quantity of an answer.

    The code of a reason for a missing interval or value, such as "few_files", becomes a sentence of MISSING_VALUE_REASONS.
    """
    reason = MISSING_VALUE_REASONS.get(quantity.reason, quantity.reason)
    value, low, high, unit = quantity[:4]
    return answer.Quantity(value, unit, low=low, high=high, reason=reason)


def to_answers(values: dict[str, Quantity]) -> answer.Quantities:
    """Convert measured quantities by name."""
    return {name: to_answer(quantity) for name, quantity in values.items()}


def format_value(name: str, quantity: Quantity) -> str:
    """Return a measured quantity as text with its interval, as on a page."""
    return quantities.format_quantity(name, to_answer(quantity))


def is_known(quantity: Quantity | answer.Quantity | None) -> bool:
    """Return whether a quantity exists and has a value."""
    return quantity is not None and quantity.value is not None


def describe_region(comparison: Comparison) -> str:
    """Return in words the part of the surface over which the worn depth is averaged."""
    return "the common area" if comparison.is_areal else "the common length"


def describe_comparison(comparison: Comparison) -> Words:
    """Return the sentences of a comparison."""
    values = comparison.values
    code, numbers = comparison.verdict
    fields = _format_numbers(numbers, comparison.is_areal)
    fields["region"] = describe_region(comparison)
    if is_known(values.get("worn_depth_mean")):
        fields["mean"] = format_value("worn_depth_mean", values["worn_depth_mean"])
    headline, advice = VERDICT_HEADLINES[code], NO_DEPTH_ADVICE.get(code, "")
    if comparison.is_areal:
        headline, advice = SCAN_VERDICTS.get(code, (headline, advice))

    # The headline, then advice if no depth is known, or the loss.
    verdict = [headline.format_map(fields)]
    if code in NO_DEPTH_ADVICE:
        # the limit of a track that would be found may be unknown
        if code != "no_wear" or numbers.get("detection_limit") is not None:
            verdict.append(advice.format_map(fields))
    elif is_known(values.get("worn_depth_max")):
        verdict.append(_describe_loss(comparison))
    verdict += describe_waves(values.get("amplitude_ratio"))

    # The code of a finding tells whether it is a warning, a note or a sentence of the verdict.
    warnings, notes = [], []
    for code, numbers in comparison.findings:
        fields = _format_numbers(numbers, comparison.is_areal)
        fields["region"] = describe_region(comparison)
        if code in FINDING_WARNINGS:
            warnings.append(FINDING_WARNINGS[code].format_map(fields))
        elif code in FINDING_NOTES:
            notes.append(FINDING_NOTES[code].format_map(fields))
        else:
            verdict.append(VERDICT_FINDINGS[code].format_map(fields))
    notes = [*verdict[MAX_VERDICT_SENTENCES:], *notes]
    if any(is_known(quantity) and quantity.low is not None for quantity in values.values()):
        notes.append(INTERVALS_SENTENCE)
    return Words(tuple(verdict[:MAX_VERDICT_SENTENCES]), tuple(warnings), tuple(notes))


def _describe_loss(comparison: Comparison) -> str:
    """Return the sentence on the lost volume, the track and the deepest place."""
    values = comparison.values
    parts = [f"{format_value('worn_depth_max', values['worn_depth_max'])} at the deepest place"]
    for name in ("worn_depth_max_at", "worn_depth_max_x", "worn_depth_max_y"):
        if is_known(values.get(name)):
            axis = "y" if name.endswith("y") else "x"
            parts[0] += f", {axis} = {quantities.format_value(values[name].value, 'm')}"
    if comparison.track is not None:
        parts.insert(0, _describe_track(comparison.track))
    if is_known(values.get("worn_volume")):
        parts.insert(0, f"{format_value('worn_volume', values['worn_volume'])} are lost")
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _describe_track(track: Track) -> str:
    """Return the clause on place, width and mean depth of a track."""
    places = ["the beginning of the common part", "the end of the common part"]
    for side, name in enumerate(("from", "to")):
        end = track.values[name]
        if is_known(end) and not track.cut[side]:
            places[side] = quantities.format_value(end.value, "m", digits=5)
    width, depth = (format_value(name, track.values[name]) for name in ("width", "depth_mean"))
    return f"a track from {places[0]} to {places[1]} of the second trace is {width} wide and {depth} deep on average"


def describe_waves(ratio: Quantity | None) -> list[str]:
    """Return the sentence on the amplitude of the waves of the band; [] if it is unknown."""
    if ratio is None or None in ratio[:3]:
        return []
    change = "no change is shown"
    if ratio.high < 1 - RATIO_ROUND_OFF:
        change = "they are reduced"
    elif ratio.low > 1 + RATIO_ROUND_OFF:
        change = "they are increased"
    text = format_value("amplitude_ratio", ratio)
    return [
        f"On the whole surface the waves from 60 to 110 um have {text} times their amplitude before wear: {change}."
    ]


def _format_numbers(numbers: dict[str, float | str | None], is_areal: bool) -> dict[str, str]:
    """Return the numbers of a finding as text by name; `is_areal` tells whether the surfaces are scans."""
    fields = defaultdict(lambda: MISSING_NUMBER_TEXT)
    for name, number in numbers.items():
        unit = FINDING_NUMBER_UNITS.get(name, "m")
        if name in AREA_OR_VOLUME_NUMBERS:
            unit = "m3" if is_areal else "m2"
        if isinstance(number, float):
            # a ratio of lengths differs from 1 in its last digits
            digits = 6 if name in ("scale", "low", "high") else 4
            fields[name] = quantities.format_value(number, unit, digits)
        elif number is not None:
            fields[name] = str(number)
    # without a limit there is nothing to state
    fields["limit"] = f", by up to {fields['limit']} on average," if "limit" in fields else ""
    return fields


def build_answer(
    *,
    sources: list[str],
    words: Words,
    values: dict[str, Quantity],
    track: dict[str, Quantity],
    data: Variables,
    details: JsonObject,
) -> answer.Answer:
    """Return the answer of a comparison of two surfaces or runs.

    Parameters
    ----------
    sources : list of str
        Files or folders before and after wear.
    words : Words
        Verdict, warnings and notes.
    values, track : dict of str to Quantity
        Quantities of the whole surface, and of the longest track ({} without one).
    data : dict of str to Variable
        Variables of the charts by name.
    details : dict
        Further content of compare.json.
    """
    # Values are shown once on the page; compare.json has them all.
    values = values | {name_in_track(name): value for name, value in track.items()}
    shown = {name: one for name, one in values.items() if name not in SHOWN_ELSEWHERE}

    # Head of compare.json: the verdict and all quantities. `details` follow.
    content = {
        "patchfem": __version__,
        "verdict": words.verdict[0],
        "sentences": [*words.verdict[1:], *words.warnings, *words.notes],
        "confidence": CONFIDENCE_LEVEL,
        **dict(zip(SURFACE_NAMES, sources, strict=True)),
        **to_answers(values),
        "track": to_answers(track) or None,
    }

    return answer.Answer(
        kind="compare",
        title=" and ".join(Path(source).name for source in sources),
        verdict=words.verdict,
        quantities=to_answers(shown),
        data=data,
        remarks=Remarks(words.warnings, words.notes),
        details=content | details,
        origin={"patchfem": __version__},
    )
