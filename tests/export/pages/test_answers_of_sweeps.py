"""What a page of a sweep answers: which input matters most, how far drawn answers scatter, where the resonance is."""

import json

import numpy as np
import pytest
from command_line import cli
from scene_texts import COULOMB, POINT, SHORT

from patchfem.campaigns.sweeps.ranking import Share
from patchfem.export.pages import peaks, ranked
from patchfem.export.pages.lead import lead_of
from patchfem.export.sweeps.page import read_table

RIG = POINT + COULOMB + SHORT


def key(name, values, texts=None):
    return {"name": name, "values": np.asarray(values, float), "unit": "Hz", "log": False, "words": False,
            "texts": texts or [f"{one:.12g} Hz" for one in values]}


def curve(x, centre, damping):
    return 1e-6 / np.sqrt((1 - (x / centre)**2)**2 + (2 * damping * x / centre)**2)


@pytest.mark.parametrize("damping", [0.02, 0.05])
def test_exact_the_peak_and_width_of_a_resonance(damping):
    """Of one mode: peak at w sqrt(1 - 2 z^2), half-power width 2 z w to the order of z^2."""
    x = np.linspace(80, 120, 161)
    both = np.concatenate([curve(x, 100, damping), curve(x, 95, damping)])
    keys = [key("drive.frequency", np.tile(x, 2)), key("drive.acceleration", np.repeat([1.0, 2.0], 161), ["1 g"] * 161
                                                       + ["2 g"] * 161)]
    name = "relative_displacement_amplitude"
    found = peaks.found(keys, {name: (both, 0 * both, "m")}, {name: np.ones(322, bool)}, True)
    for one, centre in zip(found, (100, 95)):
        square = 1 - 2 * damping**2 + 2 * damping * np.sqrt(1 - damping**2) * np.array([1, -1])  # of f over the centre
        truth = centre * np.sqrt(1 - 2 * damping**2), 1e-6 / (2 * damping * np.sqrt(1 - damping**2)), \
            -np.diff(centre * np.sqrt(square))[0]
        for (value, error), true in zip((one.frequency, one.height, one.width), truth):
            assert abs(value - true) <= error + 1e-9 * true and error < 1e-6 * true
    said = peaks.sentence(found)
    assert "with drive.acceleration 1 g" in said and "with drive.acceleration 2 g" in said
    assert "(cases lie 0.25 Hz apart)" in said
    some = np.where(np.abs(np.tile(x, 2) - 99.6) < 0.4, np.nan, both)  # beside the first peak alone
    found = peaks.found(keys, {name: (some, 0 * both, "m")}, {name: np.ones(322, bool)}, True)
    assert np.isnan(found[0].height[0])
    assert found[1].frequency[0] == pytest.approx(95 * np.sqrt(1 - 2 * damping**2), abs=1e-3)
    assert "; where it peaks with drive.acceleration 1 g is not known" in peaks.sentence(found)
    assert "not known" in peaks.table(found) and peaks.sentence(found[:1]).startswith("Where relative displacement am")


def test_exact_a_largest_value_on_the_edge_of_the_swept_frequencies_is_told():
    x, name = np.linspace(80, 120, 41), "relative_displacement_amplitude"
    keys = [key("drive.frequency", np.tile(x, 2)),
            key("drive.acceleration", np.repeat([1.0, 2.0], 41), ["1 g"] * 41 + ["2 g"] * 41)]

    def edge(*centres):
        both = np.concatenate([curve(x, centre, 0.02) for centre in centres])
        return peaks.edge(keys, {name: (both, 0 * both, "m")}, {name: np.ones(82, bool)}, True)

    assert edge(130, 121) == (
        f"The largest relative displacement amplitude, {1e6 * curve(120, 121, 0.02):.4g} um, lies at drive.frequency "
        "120 Hz, drive.acceleration 2 g, at the edge of the swept frequencies; it may be larger outside this range.")
    assert edge(100, 95) == ""


def test_always_a_peak_at_an_end_is_none_and_a_side_that_stays_up_has_no_width():
    name, x = "relative_displacement_amplitude", np.linspace(80, 120, 41)
    for values in (x, -x + 200, np.where(x < 99, np.nan, curve(x, 98, 0.05))):
        assert peaks.found([key("drive.frequency", x)], {name: (values, 0 * x, "m")}, {name: np.ones(41, bool)},
                           True) == []
    narrow = x[(x > 97) & (x < 130)]
    found, = peaks.found([key("drive.frequency", narrow)], {name: (curve(narrow, 100, 0.05), 0 * narrow, "m")},
                         {name: np.ones(narrow.size, bool)}, True)
    assert np.isnan(found.width[0]) and "width" not in peaks.sentence([found])
    assert peaks.found([key("drive.frequency", x)], {}, {}, True) == []
    unsettled = {name: x < 90, f"{name}_steady": np.ones(41, bool)}  # by its steady estimate
    steady = {name: (np.where(x < 90, curve(x, 100, 0.05), 1.0), 0 * x, "m"),
              f"{name}_steady": (np.where(x < 90, np.nan, curve(x, 100, 0.05)), 0 * x, "m")}
    found, = peaks.found([key("drive.frequency", x)], steady, unsettled, True)
    assert found.frequency[0] == pytest.approx(99.75, abs=0.02)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    out = tmp_path_factory.mktemp("drawn")
    (out / "rig.toml").write_text(RIG, encoding="utf-8")
    answer = cli("sweep", out / "rig.toml", "--over", "friction.static=0.25..0.3", "--over",
                 "drive.acceleration=8 g..9 g", "--over", "structure.mode.0.damping=0.05..0.1", "--set",
                 "drive.cycles=150", "--sobol", "128", "-o", out / "swept")
    assert answer.code == 0
    return out / "swept", answer


def test_always_drawn_cases_are_ranked_and_their_scatter_told(drawn):
    out, answer = drawn
    told = json.loads((out / "sweep.json").read_text())
    shares = told["ranking"]["loop_area"]
    assert {one["key"] for one in shares} == {"friction.static", "drive.acceleration", "structure.mode.0.damping"}
    assert all(set(one) == {"key", "first", "total", "low", "high"} and one["low"] <= one["total"] <= one["high"]
               for one in shares)
    assert "depends most on" in told["answer"] and "90 % of the 128 random cases have" in told["answer"]
    page = (out / "report.html").read_text("utf-8")
    assert "Keys that matter most" in page and "Scatter of the answers" in page and "<svg viewBox" in page
    from patchfem.export.sweeps.page import read_table

    again = lead_of(read_table(out))  # what `patchfem report` draws from the files
    head, count, *_ = answer.out.splitlines()
    assert head == f"{again.rank.rstrip('.')}; {again.scatter}" == told["answer"] and count == "128 cases: 128 steady"
    loops = read_table(out)["measures"]["loop_area"]["values"]
    low, _, high = again.spread["loop_area"][1]
    assert np.mean((loops >= low) & (loops <= high)) == pytest.approx(0.9, abs=0.02)


def test_always_a_scatter_that_unsettled_cases_hide_is_not_told():
    found = {"loop_area": ("J", np.array([1.0, 2.0, 3.0]), 60, 0)}
    assert "is not known" in ranked.scatter(found, 100) and "40 of 100" in ranked.scatter(found, 100)
    assert ranked.scatter(found, 60).startswith("90 % of the 60 random cases have a loop area from 1 J to 3 J")
    assert ranked.scatter({}, 100) == ""
    some = found | {"equivalent_damping": ("1", np.array([0.1, 0.2, 0.3]), 40, 3)}  # those that stick have none
    assert ranked.scatter(some, 100).startswith("40 of 100 random cases have not settled")
    assert ranked.scatter(some, 60).endswith("an equivalent damping from 0.1 to 0.3 (in the 40 that have one; 3 of 40 "
                                             "miss the tolerance and are included with their values).")


def test_exact_quantiles_are_those_of_all_cases_that_have_a_value():
    """Without the 12 smallest of 40, whose bars are wide, the 5 % quantile was 2.3 times as large."""
    values = np.append(np.arange(1.0, 41), np.nan)
    one = {"values": values, "errors": np.where(values < 13, 0.5 * values, 0.0), "unit": "J"}
    table = {"outcome": ["steady"] * 40 + ["failed"], "drawn": True, "measures": {"loop_area": one}}
    found = ranked.quantiles(table, {"loop_area": np.append(values[:-1] > 12, True)})
    unit, ends, count, misses = found["loop_area"]
    assert (unit, count, misses) == ("J", 40, 12)
    assert ends == pytest.approx(np.quantile(np.arange(1.0, 41), (0.05, 0.5, 0.95)))
    assert "(12 of 40 miss the tolerance and are included with their values)" in ranked.scatter(found, 41)
    assert "40 of 41 random cases that have a value" in ranked.scatter(found, 41, False)


def test_always_a_sweep_of_which_no_case_has_settled_says_so_first(drawn):
    """Their numbers then count as they ended; 256 such cases were told as if they had settled."""
    table = read_table(drawn[0])
    count = len(table["outcome"])
    said = "o case has settled, so this describes the end of each run"
    assert said not in "".join(lead_of(table).sentences())
    lead = lead_of(table | {"outcome": ["transient"] * (count - 2) + ["failed", ""]})
    assert lead.sentences()[0] == lead.answer() and lead.answer().endswith(
        f" (1 of {count} cases has no result yet and is left out; n{said}).")
    assert "settled" not in lead.scatter and not any(said in one for one in lead.sentences()[1:])
    assert lead_of(table | {"outcome": ["failed"] * count}).left == ""


def test_static_cases_are_not_said_to_move():
    """Of patches that only miss the tolerance nothing has to settle."""
    ranks = {"pressure_peak": [Share("contact.load", 0.8, 0.9, 0.8, 1.0)]}
    assert ranked.sentence(ranks, 3, False).endswith("; 3 cases that miss the tolerance are included.")
    assert ranked.sentence(ranks, 3).endswith("; 3 cases that have not settled are included with their last values.")
