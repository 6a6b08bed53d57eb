"""Answer of a comparison of surfaces: sentences of every code, compare.json, curves and maps, and the page."""

import csv
import json
import re
from dataclasses import replace

import comparisons
import numpy as np
import pytest
import xarray
from comparisons import FINDINGS, VERDICTS, compare_scans, compare_traces

from patchfem.export import netcdf, page, quantities, store
from patchfem.export import surface_definitions as definitions
from patchfem.export.answer import Quantity
from patchfem.export.surfaces import compare, sentences

# what the first sentence must state for each code of the verdict
STATED = {
    "worn": "Worn depth 600.0 nm (596.0 to 604.0), the mean over the common length.",
    "no_wear": "No wear is shown: the mean worn depth over the common length is at most 12 nm.",
    "grown": "40 um^2 stand above the first surface, 0 um^2 are lost",
    "worn_and_grown": "(596.0 to 604.0), the mean over the common length, and material grew: 35 um^2 lost",
    "growth_at_ends": "a scar of 2 um over nearly all of the surface, or 2.1 um of material that grew at the ends: both are",
    "scar_or_bow": "Either a scar over all of the surface, up to 2 um deep on average, or a bent datum",
    "elsewhere": "Not comparable: the two surfaces have no part in common",
    "no_datum": "too few heights agree (0.12 of all)",
    "mirror_finish": "(rms height 2 nm) hardly exceed the noise (3 nm)",
    "identical": "both files hold the same heights",
}


@pytest.fixture(scope="module", params=["traces", "scans"])
def written(request, tmp_path_factory):
    """Return the answer of a comparison and the folder with its files and page."""
    comparison = compare_traces() if request.param == "traces" else compare_scans()
    answer = compare.make_answer(comparison)
    folder = tmp_path_factory.mktemp(request.param)
    store.write(answer, folder)
    page.write_page(folder)
    return answer, folder


def parse(entry: dict) -> Quantity:
    """Return the quantity of an object of a JSON file."""
    return Quantity(**{name: entry.get(name) for name in ("value", "unit", "low", "high")})


@pytest.mark.parametrize("code", VERDICTS)
def test_exact_headline_of_each_verdict(code):
    """The headline states what the code means with its numbers in at most 30 words, in at most four sentences."""
    answer = compare.make_answer(
        compare_traces(code, has_place=code not in ("elsewhere", "identical"))
    )
    assert STATED[code] in answer.verdict[0]
    assert len(answer.verdict[0].split()) <= 30
    assert 1 <= len(answer.verdict) <= 4
    assert all(re.match(r"[A-Z0-9].*[.?]$", text) for text in answer.verdict)
    assert answer.details["code"] == code


@pytest.mark.parametrize("code", FINDINGS)
def test_exact_each_finding_has_a_sentence_with_its_numbers(code):
    """A finding becomes one sentence of the verdict, the warnings or the notes, and all its numbers stand in it."""
    plain, answer = (
        compare.make_answer(compare_traces(findings=found))
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
    assert "{" not in sentence and sentences.NO_LIMIT not in sentence


def test_exact_finding_without_a_limit_says_so():
    """Hidden wear without a limit, and no track that would be found, are stated without a number."""
    answer = compare.make_answer(compare_traces(findings={"hidden_even_wear": {"limit": None}}))
    assert answer.verdict[3].startswith(
        "Wear that is even or wedge-shaped over all of the common length looks like a shift or tilt"
    )
    comparison = compare_traces("no_wear")
    comparison.verdict.numbers["detection_limit"] = None
    try:
        assert not any("would be found" in text for text in compare.make_answer(comparison).verdict)
    finally:
        comparison.verdict.numbers["detection_limit"] = 5e-9


def test_always_more_findings_than_fit_become_notes():
    """The verdict of a comparison with all findings keeps four sentences; every finding is still stated once."""
    answer = compare.make_answer(compare_traces(findings=FINDINGS))
    assert len(answer.verdict) == 4 and answer.verdict[1].startswith("A track from 1 mm to 2 mm")
    stated = [*answer.verdict, *answer.remarks.warnings, *answer.remarks.notes]
    assert len(stated) == len(set(stated)) == 3 + len(FINDINGS) + 1
    assert len(answer.remarks.warnings) == len(sentences.WARNINGS)


def test_exact_numbers_in_the_sentences_are_those_of_the_json(written):
    """The depths, width and volume in the verdict are the texts of the numbers in compare.json."""
    answer, folder = written
    data = json.loads((folder / "compare.json").read_text("utf-8"))
    names = ["worn_depth_mean", "worn_depth_max", "track_width", "track_depth", "amplitude_ratio"]
    names += ["worn_volume"] if "worn_volume" in data else []
    for name in names:
        assert quantities.format_quantity(name, parse(data[name])) in " ".join(answer.verdict)
    assert data["worn_depth_mean"]["over"] in answer.verdict[0]
    assert data["sentences"][: len(answer.verdict) - 1] == list(answer.verdict[1:])


def test_exact_compare_json_has_the_keys_of_the_contract(written):
    """compare.json has the names that scripts read, each number with value, low, high and unit, or with a reason."""
    answer, folder = written
    data = json.loads((folder / "compare.json").read_text("utf-8"))
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
    assert data["hidden_wear"]["reason"] == sentences.REASONS["not_hidden"]
    assert {"from", "to", "depth_mean", "depth_floor", "area_net", "area_gross", "pile_up"} <= data[
        "track"
    ].keys()
    place = data["registration"]
    if "worn_volume" in data:
        assert place.keys() == {"shift_x", "shift_y", "rotation", "mirrored", "turned"}
        assert place["mirrored"] is True and place["turned"] is False
    else:
        assert place.keys() == {"shift", "mirrored"} and data["removed"] == {
            "before": 2,
            "after": 0,
        }
        assert data["roughness"]["inside"]["after"]["Ra"]["value"] == 1e-7
    assert data["reference"] == "place" and data["before"] == "before.csv"


def test_exact_curves_are_in_csv_and_netcdf():
    """depth.csv and result.nc hold x, both heights and the depth of the comparison, and the ends of its track."""
    comparison = compare_traces()
    answer = compare.make_answer(comparison)
    rows = list(csv.reader(store.format_curves(answer)["depth.csv"].splitlines()))
    assert rows[0] == ["x [m]", "before [m]", "after [m]", "depth [m]"]
    table = np.array(rows[1:], float)
    curves = comparison.evidence.curves
    for column, truth in zip(
        table.T, (curves.x, curves.before, curves.after, curves.depth), strict=True
    ):
        assert (column == truth).all()
    assert table[:, 1] - table[:, 2] == pytest.approx(table[:, 3], abs=1e-15)
    data = netcdf.to_dataset(answer)
    assert data.track_end.values == pytest.approx([1e-3, 2e-3])
    assert float((data.depth_high - data.depth).mean()) == pytest.approx(1.96e-8, rel=1e-3)
    worn = data.state.values == compare.STATES.index("worn")
    assert (worn == curves.worn).all()
    # a fifth of the heights lie below the material ratio of 80 %
    for side, heights in (("before", curves.before), ("after", curves.after)):
        truth = np.sort(heights)[round(0.2 * (heights.size - 1))]
        assert float(data[f"abbott_{side}"][160]) == pytest.approx(truth, abs=2e-9)


def test_exact_maps_are_thinned_and_have_their_places(tmp_path):
    """Maps of 900 x 500 heights are stored with 300 x 250 heights at their own places; xarray reads them."""
    comparison = compare_scans((900, 500))
    store.write(compare.make_answer(comparison), tmp_path)
    with xarray.open_dataset(tmp_path / "result.nc") as data:
        assert data.depth_map.shape == (300, 250) and data.depth_map.units == "m"
        depth = comparison.evidence.curves.depth
        assert data.depth_map.values == pytest.approx(depth[::3, ::2], rel=1e-6)
        assert data.y.values == pytest.approx(comparison.evidence.curves.y[::3])
        assert data.section_depth.values == pytest.approx(depth[0])
    assert not (tmp_path / "depth.csv").exists() and (tmp_path / "section.csv").is_file()


def test_exact_traces_without_a_common_place_are_drawn_alone():
    """Without a common place the answer has both traces about their own lines, and no depth."""
    data = compare.make_answer(compare_traces("elsewhere", has_place=False)).data
    assert "depth" not in data
    x, before, depth = comparisons.draw_trace()
    for name, z in (("trace_before", before), ("trace_after", before - depth)):
        assert data[name].values == pytest.approx(z - np.polyval(np.polyfit(x, z, 1), x), abs=1e-12)


def test_exact_page_is_made_again_and_shows_the_files(written):
    """The page is made again byte for byte; its verdict and its tiles are the texts of the numbers in summary.json."""
    _, folder = written
    text = (folder / "report.html").read_text("utf-8")
    page.write_page(folder)
    assert (folder / "report.html").read_text("utf-8") == text
    summary = json.loads((folder / "summary.json").read_text("utf-8"))
    for sentence in summary["verdict"]:
        assert f"<p>{sentence}</p>" in text
    tiles = page.make_tiles(store.read(folder))
    assert tiles[0]["label"] == "worn depth mean" and 5 <= len(tiles) <= 10
    for tile in tiles:
        name = tile["label"].replace(" ", "_")
        assert quantities.format_quantity(name, parse(summary["measures"][name])) == tile["text"]
        assert f"<b>{tile['text']}</b>" in text and tile["meaning"]


def test_exact_page_draws_traces_depth_and_maps(written):
    """The page has both traces and their depth, or three maps and the section; of each chart with units and a text."""
    answer, folder = written
    text = (folder / "report.html").read_text("utf-8")
    titles = re.findall(r"<figure .*?<h\d>(.*?)</h\d>", text)
    if "depth_map" in answer.data:
        assert titles == [
            "Worn depth",
            "Surface before",
            "Surface after",
            "Mean section of the track",
            "Abbott curves",
        ]
    else:
        assert titles == ["Both traces", "Worn depth", "Abbott curves"]
        assert "Roughness inside and outside of the track" in text and "100 nm (90 to 110)" in text
        table = text[text.index("Roughness inside and outside of the track") :]
        for cell in ("100 um/mm (90 to 110)", "0.900 (0.850 to 0.950)", "80 um", "after / before"):
            assert f">{cell}<" in table, cell
    labels = re.findall(r'aria-label="(.*?)"', text)
    assert len(labels) == len(titles) and all("[" in label for label in labels)


def test_always_page_states_each_fact_once_and_in_words_of_surfaces(written):
    """The page has no number of the track twice, no words of runs, and states place, length, offset and gain."""
    answer, folder = written
    text = (folder / "report.html").read_text("utf-8")
    for words in ("folder of the scene", "area of the patch", "along the interface", "of a run"):
        assert words not in text, words
    values = [
        (quantity.value, quantity.low, quantity.high, quantity.unit)
        for quantity in answer.quantities.values()
        if quantity.value is not None
    ]
    assert len(values) == len(set(values))
    if "depth_map" in answer.data:
        assert "x = 500 um, y = 700 um" in answer.verdict[1]
    else:
        assert "x = 1.5 mm" in answer.verdict[1]
        for name in ("worn_depth_max_at", "common_length", "offset", "gain"):
            assert f'id="measure-{name}"' in text, name
        assert "worn_from_before" in answer.details and "track_pile_up" in answer.details


def test_always_band_is_named_only_where_it_is_seen():
    """The caption names the band of the depth if it is wider than a line."""
    for scale, is_seen in ((0.1, False), (1.0, True)):
        comparison = compare_traces()
        noise = scale * comparison.evidence.curves.noise
        curves = replace(comparison.evidence.curves, noise=noise)
        comparison = replace(comparison, evidence=replace(comparison.evidence, curves=curves))
        captions = compare.make_answer(comparison).details.get("captions", {})
        assert ("Band" in captions.get("Worn depth", "")) == is_seen


def test_always_every_quantity_has_a_definition():
    """All numbers of comparisons have a unit and a meaning, and the unit is that of the number."""
    for comparison in (compare_traces(), compare_scans()):
        for name, quantity in compare.make_answer(comparison).quantities.items():
            found = quantities.find_definition(name, "compare")
            assert found is not None and found.unit == quantity.unit, name
            assert len(quantities.describe(name, "compare").split()) > 2
    assert definitions.find("no_such_quantity") is None
