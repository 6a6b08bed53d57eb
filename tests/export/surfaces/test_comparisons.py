"""Answer of a comparison of surfaces: sentences of every code, compare.json, curves and maps, and the page."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import read_json, read_page
from comparisons import FINDINGS, VERDICTS, compare_pair, compare_traces
from page_data import (
    find_strange_curves,
    find_wrong_numbers,
    read_charts,
    read_measures,
    read_tiles,
)

from patchfem.export import netcdf, page, quantities, store
from patchfem.export.answer import Quantity
from patchfem.export.surfaces import compare, shared

# what the first sentence must state for each code of the verdict
STATED = {
    "worn": "Worn depth 500.0 nm (495.9 to 504.2), the mean of the lost material over the common length.",
    "no_wear": "No wear is shown: the mean worn depth over the common length is at most 12 nm.",
    "grown": "40 um^2 stand above the first surface, 0 um^2 are lost",
    "worn_and_grown": "the mean of the lost material over the common length, and material grew: 35 um^2 lost",
    "growth_at_ends": "a scar of 2 um over the rest of the surface, or 2.1 um of material that grew at the ends: both are",
    "scar_or_bow": "Either a scar over all of the surface, up to 2 um deep on average, or a bent datum",
    "scar_or_step": "Either a scar of 200 nm that reaches beyond the end of the traces, or a jump of the datum",
    "scar_or_drift": "Either wear of 20 nm, the mean over the",
    "elsewhere": "Not comparable: no common part of both surfaces is found",
    "no_datum": "too few heights agree (0.12 of all)",
    "mirror_finish": "(rms height 2 nm) hardly exceed the noise (3 nm)",
    "identical": "both files hold the same heights",
}


@pytest.fixture(scope="module", params=["traces", "scans"])
def written(request, tmp_path_factory):
    """Return the answer of a comparison and the folder with its files and page."""
    answer = compare.make_comparison_answer(compare_pair(request.param == "scans"))
    folder = tmp_path_factory.mktemp(request.param)
    store.write_answer(answer, folder)
    page.write_report(folder)
    return answer, folder


def parse(entry: dict) -> Quantity:
    """Return the quantity of an object of a JSON file."""
    return Quantity(**{name: entry.get(name) for name in ("value", "unit", "low", "high")})


@pytest.mark.parametrize("code", VERDICTS)
def test_exact_headline_of_each_verdict(code):
    """The headline states what the code means with its numbers in at most 30 words, in at most four sentences."""
    answer = compare.make_comparison_answer(
        compare_traces(code, has_place=code not in ("elsewhere", "identical"))
    )
    assert STATED[code] in answer.verdict[0]
    assert len(answer.verdict[0].split()) <= 30
    assert 1 <= len(answer.verdict) <= 4
    assert all(re.match(r"[A-Z0-9].*[.?]$", text) for text in answer.verdict)
    assert answer.details["code"] == code


def test_exact_sentence_says_of_how_many_tracks_it_states_the_longest():
    """Of several worn tracks the sentence states the longest with their number, of a single one it states no number."""
    one = compare_traces()
    two = replace(one, tracks=(*one.tracks, *one.tracks))
    single, longest = (compare.make_comparison_answer(found).verdict[1] for found in (one, two))
    assert "A track from" in single and "longest" not in single
    assert "The longest of 2 tracks, from" in longest and "of the second trace, is" in longest


@pytest.mark.parametrize("code", FINDINGS)
def test_exact_each_finding_has_a_sentence_with_its_numbers(code):
    """A finding becomes one sentence of the verdict, the warnings or the notes, and all its numbers stand in it."""
    plain, answer = (
        compare.make_comparison_answer(compare_traces(findings=found))
        for found in ({}, {code: FINDINGS[code]})
    )
    texts = [*answer.verdict, *answer.remarks.warnings, *answer.remarks.notes]
    known = [*plain.verdict, *plain.remarks.warnings, *plain.remarks.notes]
    (sentence,) = [text for text in texts if text not in known]
    assert sentence in answer.details["sentences"]
    for name, number in FINDINGS[code].items():
        digits = f"{number:.4e}".rstrip("0") if isinstance(number, float) else str(number)
        mantissa = digits.partition("e")[0].rstrip("0").rstrip(".").replace(".", "")
        assert mantissa in sentence.replace(".", ""), (name, sentence)
    assert "{" not in sentence and shared.MISSING_NUMBER_TEXT not in sentence


def test_exact_compare_json_has_the_keys_of_the_contract(written):
    """compare.json has the names that scripts read, each number with value, low, high and unit, or with a reason."""
    answer, folder = written
    evidence = compare_pair("worn_volume" in answer.quantities).evidence
    data = read_json(folder / "compare.json")
    assert data == answer.details
    names = {"worn_depth_max", "worn_depth_mean", "amplitude_ratio", "slope_ratio", "hidden_wear"}
    names |= (
        {"worn_volume", "grown_volume", "worn_share"}
        if "worn_volume" in data
        else {"shift", "worn_area"}
    )
    for name in names:
        assert {"value", "low", "high", "unit"} <= data[name].keys()
        assert (data[name]["value"] is None) == ("reason" in data[name])
    assert data["hidden_wear"]["reason"] == shared.MISSING_VALUE_REASONS["no_limit"]
    place = data["registration"]
    if "worn_volume" in data:
        assert place.keys() >= {"shift_x", "shift_y", "rotation", "mirrored"}
        assert place["mirrored"] is True and data["track"] is None
        assert data["roughness"]["reason"] == shared.MISSING_VALUE_REASONS["scans"]
    else:
        sizes = {"from", "to", "depth_mean", "depth_floor", "area_net", "area_gross", "pile_up"}
        assert sizes <= data["track"].keys()
        assert place.keys() >= {"shift", "mirrored"}
        assert tuple(data["removed"].values()) == evidence.removed
        roughness = evidence.roughness["inside"]["after"]["Ra"].value
        assert data["roughness"]["inside"]["after"]["Ra"]["value"] == roughness > 0
    assert data["reference"] == "place" and data["before"] == "before.csv"


@pytest.mark.parametrize(
    "numbers, text",
    [
        ((0.9999980, 0.9999931, 1.0000028), "0.9999980 (0.9999931 to 1.0000028)"),
        ((1 + 2e-9, 1 - 1e-9, 1 + 5e-9), "1.0000000020 (0.9999999990 to 1.0000000050)"),
        ((1.0, 0.93, 1.066), "1.000 (0.930 to 1.066)"),
        ((1.0, 1 - 1e-12, 1 + 1e-12), "1 (1 to 1)"),
    ],
)
def test_exact_ends_of_an_interval_have_the_last_digit_of_the_value(numbers, text):
    """Value and ends end at the second digit of the half-width, also where an end has one digit more than the value."""
    value, low, high = numbers
    assert (
        quantities.format_quantity("amplitude_ratio", Quantity(value, low=low, high=high)) == text
    )


def test_curves_are_in_csv_and_netcdf():
    """depth.csv and result.nc hold x, both heights and the depth of the comparison, and the ends of its track."""
    comparison = compare_traces()
    answer = compare.make_comparison_answer(comparison)
    rows = list(csv.reader(store.format_curves(answer)["depth.csv"].splitlines()))
    assert rows[0] == ["x [m]", "before [m]", "after [m]", "depth [m]"]
    table = np.array(rows[1:], float)
    curves = comparison.evidence.curves
    for column, truth in zip(table.T, (curves.x, *curves.heights, curves.depth), strict=True):
        assert (column == truth).all()
    assert table[:, 1] - table[:, 2] == pytest.approx(table[:, 3], abs=1e-15)
    data = netcdf.to_dataset(answer)
    ends = [comparison.track.values[name].value for name in ("from", "to")]
    assert data.track_end.values == pytest.approx(ends)
    assert ends == pytest.approx([1.5e-3, 2.5e-3], abs=5e-6)
    band = float((data.depth_high - data.depth).mean())
    assert band == pytest.approx(1.96 * curves.noise.mean(), rel=1e-3)
    worn = data.state.values == 2  # not used, unworn, worn, grown
    assert (worn == curves.masks.worn).all()
    # a fifth of the heights, each of which stands for 1 of n parts, lie below the material ratio of 80 %
    for side, heights in zip(("before", "after"), curves.heights):
        truth = np.sort(heights)[round(0.2 * heights.size - 0.5)]
        assert float(data[f"abbott_{side}"][160]) == pytest.approx(truth, abs=2e-9)


def test_exact_page_is_made_again_and_shows_the_files(written):
    """The page is made again byte for byte; its verdict and its tiles are the texts of the numbers in summary.json."""
    _, folder = written
    text = read_page(folder)
    page.write_report(folder)
    assert read_page(folder) == text
    summary = read_json(folder / "summary.json")
    for sentence in summary["verdict"]:
        assert f"<p>{sentence}</p>" in text
    tiles = read_tiles(text)
    assert next(iter(tiles)) == "worn depth mean" and 3 <= len(tiles) <= 10
    for label, shown in tiles.items():
        name = label.replace(" ", "_")
        assert quantities.format_quantity(name, parse(summary["measures"][name])) == shown
        assert f'<div title="{quantities.describe_quantity(name, "compare")}">' in text
    shown = read_measures(text)
    assert len(shown) > 5 and find_wrong_numbers(shown, summary["measures"], 5e-3) == []
    assert read_charts(text) and find_strange_curves(text, folder / "result.nc") == []
