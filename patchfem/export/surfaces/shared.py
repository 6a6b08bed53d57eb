"""Parts of the answers on surfaces: sentences of a comparison, quantities, bands, maps, and the record itself.

sentences.toml has the sentences of verdicts, findings and reasons by their codes; no sentence is read back.
"""

import tomllib
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...surface.compare.records import Comparison, Track
from ...surface.quantity import CONFIDENCE_LEVEL, Quantity
from ...surface.spectrum import WAVE_BAND
from .. import answer, quantities
from ..answer import JsonObject, Remarks, Variables
from ..rows import make_variables
from ..surface_definitions import name_in_track

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
_SENTENCES = tomllib.loads(Path(__file__).with_name("sentences.toml").read_text(encoding="utf-8"))
# measures of both runs that stand beside each other
COMPARED_MEASURES: list[str] = _SENTENCES["measures"]
MISSING_VALUE_REASONS: dict[str, str] = _SENTENCES["reasons"]
MISSING_NUMBER_TEXT = "any amount"  # stands for a missing number
# SI units of the numbers of findings other than lengths; of areas between traces, and of volumes between scans
FINDING_NUMBER_UNITS = dict.fromkeys(
    ("unworn", "scale", "low", "high", "gain", "significance", "sure"), "1"
)
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
    # Largest number of rows and of columns of a stored map
    rows, columns = (slice(None, None, -(-axis.size // 400)) for axis in (y, x))
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


def convert_quantities(values: dict[str, Quantity]) -> answer.Quantities:
    """Convert measured quantities by name."""
    return {name: to_answer(quantity) for name, quantity in values.items()}


def format_value(name: str, quantity: Quantity) -> str:
    """Return a measured quantity as text with its interval, as on a page."""
    return quantities.format_quantity(name, to_answer(quantity))


def is_known(quantity: Quantity | answer.Quantity | None) -> bool:
    """Return whether a quantity exists and has a value."""
    return quantity is not None and quantity.value is not None


def compare_measures(
    quantities_by_side: dict[str, answer.Quantities],
) -> dict[str, dict[str, answer.Quantity | None]]:
    """Return the COMPARED_MEASURES that a run before or after wear has, by name and side; None where one has no value."""
    measures = {}
    for name in COMPARED_MEASURES:
        found = {side: quantities_by_side.get(side, {}).get(name) for side in SURFACE_NAMES}
        pair = {side: one if is_known(one) else None for side, one in found.items()}
        if any(pair.values()):
            measures[name] = pair
    return measures


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
    texts = {}
    for kind in ("headlines", "advice"):
        own = _SENTENCES["scans"][kind] if comparison.is_areal else {}
        texts[kind] = own.get(code, _SENTENCES[kind].get(code, "")).format_map(fields)

    # The headline, then advice if no depth is known, or the loss.
    verdict = [texts["headlines"]]
    if texts["advice"]:
        # the limit of a track that would be found may be unknown
        if code != "no_wear" or numbers.get("detection_limit") is not None:
            verdict.append(texts["advice"])
    elif is_known(values.get("worn_depth_max")):
        verdict.append(_describe_loss(comparison))
    verdict += describe_waves(values.get("amplitude_ratio"))

    # The code of a finding tells whether it is a warning, a note or a sentence of the verdict.
    found = {"verdict": verdict, "warnings": [], "notes": []}
    for code, numbers in comparison.findings:
        fields = _format_numbers(numbers, comparison.is_areal)
        fields["region"] = describe_region(comparison)
        for kind, sentences in _SENTENCES["findings"].items():
            if code in sentences:
                found[kind].append(sentences[code].format_map(fields))
    notes = [*verdict[MAX_VERDICT_SENTENCES:], *found["notes"]]
    if any(is_known(quantity) and quantity.low is not None for quantity in values.values()):
        notes.append(INTERVALS_SENTENCE)
    return Words(tuple(verdict[:MAX_VERDICT_SENTENCES]), tuple(found["warnings"]), tuple(notes))


def _describe_loss(comparison: Comparison) -> str:
    """Return the sentence on the lost volume, the track and the deepest place."""
    values = comparison.values
    parts = [f"{format_value('worn_depth_max', values['worn_depth_max'])} at the deepest place"]
    for name in ("worn_depth_max_at", "worn_depth_max_x", "worn_depth_max_y"):
        if is_known(values.get(name)):
            axis = "y" if name.endswith("y") else "x"
            parts[0] += f", {axis} = {quantities.format_value(values[name].value, 'm')}"
    if comparison.track is not None:
        parts.insert(0, _describe_track(comparison.track, len(comparison.tracks)))
    if is_known(values.get("worn_volume")):
        parts.insert(0, f"{format_value('worn_volume', values['worn_volume'])} are lost")
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _describe_track(track: Track, n_tracks: int) -> str:
    """Return the clause on place, width and mean depth of a track, the longest of `n_tracks`."""
    places = ["the beginning of the common part", "the end of the common part"]
    for side, name in enumerate(("from", "to")):
        end = track.values[name]
        if is_known(end) and not track.cut[side]:
            places[side] = quantities.format_value(end.value, "m", digits=5)
    width, depth = (format_value(name, track.values[name]) for name in ("width", "depth_mean"))
    which = f"the longest of {n_tracks} tracks," if n_tracks > 1 else "a track"
    where = f"from {places[0]} to {places[1]} of the second trace{',' * (n_tracks > 1)}"
    return f"{which} {where} is {width} wide and {depth} deep on average"


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
    shortest, longest = (1e6 * wave for wave in WAVE_BAND)
    return [
        f"On the whole surface the waves from {shortest:g} to {longest:g} um have {text} times their amplitude before "
        f"wear: {change}."
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
        **convert_quantities(values),
        "track": convert_quantities(track) or None,
    }

    return answer.Answer(
        kind="compare",
        title=" and ".join(Path(source).name for source in sources),
        verdict=words.verdict,
        quantities=convert_quantities(shown),
        data=data,
        remarks=Remarks(words.warnings, words.notes),
        details=content | details,
        origin={"patchfem": __version__},
    )
