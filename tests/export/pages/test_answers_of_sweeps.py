"""What a page of a sweep answers: which input matters most, how far drawn answers scatter, where the resonance is."""

import json

import numpy as np
import pytest
from command_line import cli
from page_data import swept_key, swept_measure, swept_table
from scene_texts import COULOMB, POINT, SHORT

from patchfem.campaigns.sweeps.ranking import SobolIndex
from patchfem.export import summarise_sweep
from patchfem.export.pages import limits, peaks, ranked
from patchfem.export.pages.sweep import page_html
from patchfem.export.sweeps.page import read_table
from patchfem.scene import read_template

RIG = POINT + COULOMB + SHORT


AMPLITUDE = "relative_displacement_amplitude"


def key(name, values, texts=None):
    return swept_key(name, values, "Hz", texts or [f"{value:.12g} Hz" for value in values])


def curve(x, centre, damping):
    return 1e-6 / np.sqrt((1 - (x / centre) ** 2) ** 2 + (2 * damping * x / centre) ** 2)


@pytest.mark.parametrize("damping", [0.02, 0.05])
def test_exact_the_peak_and_width_of_a_resonance(damping):
    """Of one mode: peak at w sqrt(1 - 2 z^2), half-power width 2 z w to the order of z^2."""
    x = np.linspace(80, 120, 161)
    both = np.concatenate([curve(x, 100, damping), curve(x, 95, damping)])
    keys = [
        key("drive.frequency", np.tile(x, 2)),
        key("drive.acceleration", np.repeat([1.0, 2.0], 161), ["1 g"] * 161 + ["2 g"] * 161),
    ]
    found = find_peaks(keys, both)
    for peak, centre in zip(found, (100, 95)):
        # squares of the half-power frequencies over the centre
        square = 1 - 2 * damping**2 + 2 * damping * np.sqrt(1 - damping**2) * np.array([1, -1])
        truth = (
            centre * np.sqrt(1 - 2 * damping**2),
            1e-6 / (2 * damping * np.sqrt(1 - damping**2)),
            -np.diff(centre * np.sqrt(square))[0],
        )
        swept = peak.swept
        for (value, error), true in zip(
            (swept.frequency, swept.height, swept.half_power_width), truth
        ):
            assert abs(value - true) <= error + 1e-9 * true and error < 1e-6 * true
    sentence = peaks.peaks_sentence(found)
    assert "with drive.acceleration 1 g" in sentence and "with drive.acceleration 2 g" in sentence
    assert "(cases lie 0.25 Hz apart)" in sentence
    found = find_peaks(keys, np.where(np.abs(np.tile(x, 2) - 99.6) < 0.4, np.nan, both))
    first, second = (peak.swept for peak in found)
    assert np.isnan(first.height.value)  # no value beside this peak
    assert second.frequency.value == pytest.approx(95 * np.sqrt(1 - 2 * damping**2), abs=1e-3)
    sentence = peaks.peaks_sentence(found)
    assert "; where it peaks with drive.acceleration 1 g is not known" in sentence
    assert "not known" in peaks.peaks_table(found)
    assert peaks.peaks_sentence(found[:1]).startswith("Where relative displacement am")


def test_always_a_peak_at_an_end_is_none_and_a_side_that_stays_up_has_no_width():
    x = np.linspace(80, 120, 41)
    keys = [key("drive.frequency", x)]
    for values in (x, -x + 200, np.where(x < 99, np.nan, curve(x, 98, 0.05))):
        assert find_peaks(keys, values) == []
    assert peaks.find_peaks(keys, {}, {}, True) == []
    narrow = x[(x > 97) & (x < 130)]
    (peak,) = find_peaks([key("drive.frequency", narrow)], curve(narrow, 100, 0.05))
    assert np.isnan(peak.swept.half_power_width.value)
    assert "width" not in peaks.peaks_sentence([peak])
    # cases that have not settled count by their estimate of the steady amplitude
    settled = {AMPLITUDE: x < 90, f"{AMPLITUDE}_steady": np.ones(41, bool)}
    measures = {
        AMPLITUDE: (np.where(x < 90, curve(x, 100, 0.05), 1.0), 0 * x, "m"),
        f"{AMPLITUDE}_steady": (np.where(x < 90, np.nan, curve(x, 100, 0.05)), 0 * x, "m"),
    }
    (peak,) = peaks.find_peaks(keys, measures, settled, True)
    assert peak.swept.frequency.value == pytest.approx(99.75, abs=0.02)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    out = tmp_path_factory.mktemp("drawn")
    (out / "rig.toml").write_text(RIG, encoding="utf-8")
    answer = cli(
        "sweep",
        out / "rig.toml",
        "--over",
        "friction.static=0.25..0.3",
        "--over",
        "drive.acceleration=8 g..9 g",
        "--over",
        "structure.mode.0.damping=0.05..0.1",
        "--set",
        "drive.cycles=150",
        "--sobol",
        "64",
        "-o",
        out / "swept",
    )
    assert answer.code == 0
    return out / "swept", answer


def test_always_drawn_cases_are_ranked_and_their_scatter_told(drawn):
    out, answer = drawn
    told = json.loads((out / "sweep.json").read_text())
    shares = told["ranking"]["loop_area"]
    assert {one["key"] for one in shares} == {
        "friction.static",
        "drive.acceleration",
        "structure.mode.0.damping",
    }
    assert all(
        set(one) == {"key", "first", "total", "low", "high"}
        and one["low"] <= one["total"] <= one["high"]
        for one in shares
    )
    assert "depends most on" in told["answer"]
    assert "90 % of the 64 random cases have" in told["answer"]
    page = (out / "report.html").read_text("utf-8")
    assert "Keys that matter most" in page
    assert "Scatter of the answers" in page
    assert "<svg viewBox" in page
    again = summarise_sweep(read_table(out)).said  # what `patchfem report` draws from the files
    head, count, *_ = answer.out.splitlines()
    assert head == f"{again.rank.rstrip('.')}; {again.scatter}" == told["answer"]
    assert count == "64 cases: 64 steady"
    loops = read_table(out)["measures"]["loop_area"]["values"]
    low, _, high = summarise_sweep(read_table(out)).spread["loop_area"][1]
    # the quantiles lie between the fourth and the fifth value from either end
    assert np.count_nonzero((loops >= low) & (loops <= high)) == 64 - 2 * 4


def test_exact_quantiles_are_those_of_all_cases_that_have_a_value():
    """Without the 12 smallest of 40, whose bars are wide, the 5 % quantile was 2.3 times as large."""
    values = np.append(np.arange(1.0, 41), np.nan)
    loop = swept_measure(values, np.where(values < 13, 0.5 * values, 0.0), "J")
    outcome = ["steady"] * 40 + ["failed"]
    table = drawn_table([key("normal.load", values)], {"loop_area": loop}, outcome=outcome)
    found = ranked.measure_quantiles(table, {"loop_area": np.append(values[:-1] > 12, True)})
    unit, ends, count, misses = found["loop_area"]
    assert (unit, count, misses) == ("J", 40, 12)
    assert ends == pytest.approx(np.quantile(np.arange(1.0, 41), (0.05, 0.5, 0.95)))
    assert (
        "(12 of 40 miss the tolerance and are included with their values)"
        in ranked.describe_scatter(found, 41)
    )
    assert "40 of 41 random cases that have a value" in ranked.describe_scatter(found, 41, False)


def test_always_a_sweep_of_which_no_case_has_settled_says_so_first(drawn):
    """Their numbers then count as they ended; 256 such cases were told as if they had settled."""
    table = read_table(drawn[0])
    count = len(table["outcome"])
    said = "o case has settled, so this answer describes the end of each run"
    assert said not in "".join(summarise_sweep(table).sentences())
    lead = summarise_sweep(table | {"outcome": ["transient"] * (count - 2) + ["failed", ""]})
    assert lead.sentences()[0] == lead.answer() and lead.answer().endswith(
        f" (1 of {count} cases has no result yet and is left out; n{said})."
    )
    assert "settled" not in lead.said.scatter and not any(
        said in one for one in lead.sentences()[1:]
    )
    assert summarise_sweep(table | {"outcome": ["failed"] * count}).said.left == ""


@pytest.mark.parametrize(
    "count, has_motion, ending",
    [
        (3, False, "; 3 cases that miss the tolerance are included."),
        (1, False, "; 1 case that misses the tolerance is included."),
        (1, True, "; 1 case that has not settled is included with its last value."),
        (3, True, "; 3 cases that have not settled are included with their last values."),
    ],
)
def test_exact_cases_that_do_not_count_are_named_by_their_reason(count, has_motion, ending):
    """Patches only miss the tolerance: nothing of them has to settle."""
    ranks = {"pressure_peak": [SobolIndex("contact.load", 0.8, 0.9, 0.8, 1.0)]}
    assert ranked.ranking_sentence(ranks, count, has_motion).endswith(ending)


def find_peaks(keys: list, values):
    """Return the peaks of the amplitude over the cases of a grid, all settled and without errors."""
    measures = {AMPLITUDE: (values, 0 * values, "m")}
    return peaks.find_peaks(keys, measures, {AMPLITUDE: np.ones(values.size, bool)}, True)


def drawn_table(keys, measures, **more):
    return swept_table(keys, measures, grid=False, drawn=True, **more)


def test_exact_of_drawn_cases_the_answer_is_the_measure_that_is_asked_for_and_where_it_is_largest():
    """A damping of 30 - 400 (mu - 0.475)^2 is largest in the case next to mu = 0.475. No case of a draw is a reference
    for a limit: the sweep once began with how far friction.static may go from its least value."""
    mu = np.random.default_rng(1).permutation(np.append(np.linspace(0.1, 0.6, 60), 0.475))
    damping = 30 - 400 * (mu - 0.475) ** 2
    columns = {
        "equivalent_damping": swept_measure(damping),
        AMPLITUDE: swept_measure(1 - mu / 4, unit="m"),
    }
    table = drawn_table(
        [key("friction.static", mu, [f"{value:.6g}" for value in mu])],
        columns,
        first="equivalent_damping",
    )
    lead = summarise_sweep(table)
    low, high = np.quantile(damping, [0.05, 0.95])
    assert lead.limits == limits.Limits() and not any(
        "may reach" in said for said in lead.sentences()
    )
    assert lead.answer().startswith(
        f"Equivalent damping ratio is largest, 30, at friction.static 0.475; 90 % of the 61 random cases have an "
        f"equivalent damping ratio from {low:.3g} to {high:.3g}, "
    )
    for slope, says in ((1, "grows with"), (-1, "falls with growing")):
        columns["equivalent_damping"] = swept_measure(2 + slope * mu)
        assert (
            summarise_sweep(table)
            .answer()
            .startswith(f"Equivalent damping ratio {says} friction.static; 90 % of")
        )
    columns["equivalent_damping"] = swept_measure(np.abs(mu - 0.3) + 1)
    assert "is least, 1" in summarise_sweep(table).answer()


def test_exact_of_several_keys_the_strongest_has_a_direction_that_chance_does_not_make():
    """y = 4 a + b grows with a; noise alone has no direction."""
    rng = np.random.default_rng(2)
    a, b, noise = rng.random((3, 200))
    keys = [
        key(name, values, [f"{value:.6g}" for value in values])
        for name, values in (("a.a", a), ("b.b", b))
    ]
    settled = np.ones(200, bool)
    shares = {
        "loop_area": [SobolIndex("a.a", 0.9, 0.9, 0.9, 0.9), SobolIndex("b.b", 0.1, 0.1, 0.1, 0.1)]
    }
    for values, says in (
        (4 * a + b, "Loop area grows with a.a."),
        (b - 4 * a, "Loop area falls with growing a.a."),
        (noise, ""),
    ):
        table = drawn_table(keys, {"loop_area": swept_measure(values, unit="J")})
        assert ranked.describe_trend(table, shares, settled) == says
    table = drawn_table(keys, {"loop_area": swept_measure(b - 9 * (a - 0.5) ** 2, unit="J")})
    low, high = map(
        float,
        ranked.describe_trend(table, shares, settled)
        .removeprefix("Loop area is largest between a.a ")
        .removesuffix(".")
        .split(" and "),
    )
    assert low < 0.5 < high and np.mean((a >= low) & (a <= high)) == pytest.approx(0.2, abs=0.02)


def test_exact_too_few_settled_cases_are_no_ranking():
    """Of 64 cases 32 failed and 31 had not settled: the answer was the amplitude of the one that had."""
    rng = np.random.default_rng(3)
    keys = [key(name, rng.random(64)) for name in ("a.a", "b.b")]
    values = np.append(np.full(32, np.nan), rng.random(32))
    table = drawn_table(
        keys,
        {AMPLITUDE: swept_measure(values, unit="m")},
        outcome=["failed"] * 32 + ["transient"] * 31 + ["steady"],
    )
    lead = summarise_sweep(table)
    assert lead.answer() == (
        "Only 1 of 64 cases settled (32 failed, 31 transient), so no ranking is possible; raise drive.cycles so that "
        "the transient cases settle and correct what the messages of the failed cases name."
    )
    assert lead.said.span.startswith(
        "31 of 64 cases did not settle; their relative displacement amplitude at the end"
    )
    assert "; relative displacement amplitude of the only settled case is " in lead.said.span
    assert "throughout" not in lead.said.span and lead.said.span in lead.sentences()
    table = table | {"outcome": ["failed"] * 32 + ["transient"] * 32}
    assert (
        summarise_sweep(table)
        .answer()
        .startswith("None of 64 cases settled (32 failed, 32 transient), so no ranking")
    )
    table = table | {"outcome": ["failed"] * 40 + ["done"] * 24}
    assert "so no ranking is possible" not in "".join(summarise_sweep(table).sentences())


def test_exact_curves_that_are_largest_at_an_end_are_counted():
    """Of five curves two are largest at 372 Hz, one at 300 Hz, one inside; a motionless one is not counted."""
    height = np.array([4.0, 3, 0.2, 0.1, 0.0]) * 1e-3
    place = np.array([364.0, 372, 372 * (1 + 1e-13), 300, 300])
    columns = ((AMPLITUDE, "m", height), ("peak_frequency", "Hz", place))
    measures = {
        name: swept_measure(values, 1e-9 * values, unit, floors=np.zeros(5))
        for name, unit, values in columns
    }
    table = swept_table([swept_key("normal.load", [1, 2, 3, 4, 5], "N")], measures)
    sentence = "n 3 of 5 cases the largest response lies at an end of the swept frequencies, so that it may be no resonance"
    for ends in ((300.0, 372.0), (np.full(5, 372.0), np.full(5, 300.0))):
        assert sentence in summarise_sweep(table | {"ends": ends}).answer()
    for ends in ({}, {"ends": (200.0, 500.0)}, {"ends": (np.nan, np.nan)}):
        assert "end of the swept" not in summarise_sweep(table | ends).answer()


def test_exact_the_ends_of_swept_frequencies_are_read_back(tmp_path):
    scene = tmp_path / "damper.toml"
    scene.write_text(read_template("damper"), "utf-8")
    answer = cli(
        "sweep",
        scene,
        "--set",
        "drive.to=372 Hz",
        "--over",
        "structure.interface[1].load=10 N,2 kN",
        "-o",
        tmp_path / "out",
    )
    said = "n 1 of 2 cases the largest response lies at an end of the swept frequencies"
    assert said in answer.out
    assert said in summarise_sweep(read_table(tmp_path / "out")).answer()


def test_exact_a_drive_above_what_friction_limits_is_told_with_its_limit(tmp_path):
    """Of the shipped rig friction alone does not limit the motion above 4 mu N / (pi m) = 5.067 g."""
    scene = tmp_path / "rig.toml"
    scene.write_text(read_template("rig"), "utf-8")
    words = ("--set", "drive.acceleration=6 g", "--no-page", "-o", tmp_path / "run")
    limit = "6 g, is larger than 5.067 g, above which friction alone does not limit the amplitude"
    assert limit in cli("run", scene, *words).out


@pytest.mark.parametrize(
    "values, is_counted", [([2e-3, 1e-6, 3e-3, 2e-6], True), ([1e-6, 2e-6, 1e-6, 3e-6], False)]
)
def test_exact_unsettled_cases_that_are_no_end_of_the_key_are_counted(values, is_counted):
    measures = {AMPLITUDE: swept_measure(values, unit="m")}
    outcome = ["transient", "steady"] * 2
    table = swept_table([swept_key("normal.load", [1, 2, 3, 4], "N")], measures, outcome=outcome)
    start = "2 of 4 cases did not settle; their relative displacement amplitude at the end of the run is 2 mm to 3 mm; "
    answer = summarise_sweep(table).answer()
    assert answer.startswith(start) == ("did not settle" in answer) == is_counted


def test_exact_a_width_that_the_cases_do_not_tell_has_its_reason():
    """A peak of 1 Hz between cases 5 Hz apart, and a curve whose cases end above peak/sqrt2. Both stood as a dash."""
    x = np.linspace(80, 120, 9)
    found = find_peaks([key("drive.frequency", x)], curve(x, 102.4, 0.005))
    assert "half-power width not resolved by these cases" in peaks.peaks_sentence(found)
    assert "; add cases near 102.4 Hz" in peaks.peaks_table(found)
    x = np.linspace(98, 102, 9)
    found = find_peaks([key("drive.frequency", x)], curve(x, 100.2, 0.05))
    assert "half-power" not in peaks.peaks_sentence(found)
    assert "reaches beyond the swept frequencies" in peaks.peaks_table(found)


def test_exact_the_scatter_of_the_cases_that_settled_is_not_told_where_many_have_not():
    """Of 256 cases 116 had not settled, with motions a hundred times as large: 5 to 95 % of the others stood in the
    table as those of all, above a curve that the page did not have."""
    rng = np.random.default_rng(7)
    keys = [key(name, rng.random(100)) for name in ("a.a", "b.b")]
    late = np.arange(100) % 3 == 0
    values = 1e-6 * (1 + rng.random(100)) * np.where(late, 1e3, 1)
    table = drawn_table(keys, {AMPLITUDE: swept_measure(values, unit="m")})

    def scatter(table) -> str:
        return (
            page_html(table).partition("Scatter of the answers</h2>")[2].partition("</section>")[0]
        )

    text = scatter(table)
    assert "not known" not in text and "do not count" not in text
    table["outcome"] = np.where(late, "transient", "steady").tolist()
    text = scatter(table)
    assert text.count("not known") == 4 and "34 of 100 cases do not count" in text
    assert "curve" not in text
    assert (
        "34 of 100 cases did not settle; their relative displacement amplitude at the end of"
        in summarise_sweep(table).said.span
    )


def test_exact_keys_whose_intervals_overlap_stand_in_no_order():
    name = "loop_area"
    load = SobolIndex("contact.load", 0.5, 0.58, 0.46, 0.66)
    friction = SobolIndex("friction.static", 0.5, 0.56, 0.44, 0.6)
    damping = SobolIndex("damping", 0.01, 0.02, 0.0, 0.06)
    tilt = SobolIndex("tilt", 0.0, 0.001, 0.0, 0.04)
    said = ranked.ranking_sentence({name: [load, friction, damping, tilt]}, 56, True, 64)
    assert said.startswith(
        "56 of 64 cases have not settled; with their last values included, loop area depends most "
        "on contact.load and friction.static about equally (58 and 56 % of the variance; their "
        "intervals overlap), then on damping and tilt (at most 6 % each), where each share"
    )
    apart = ranked.ranking_sentence({name: [load, damping]}, 3, True, 64)
    assert apart == (
        "Loop area depends most on contact.load, which contributes to 58 % of the variance (46 to 66 %), "
        "then on damping (at most 6 %); 3 cases that have not settled are included with their last "
        "values."
    )
    far = SobolIndex("far", 0.3, 0.3, 0.25, 0.47)
    assert (
        "depends on contact.load and far (58 and 30 % of the variance; their"
        in ranked.ranking_sentence({name: [load, far]})
    )
    grid = [
        SobolIndex("a", 0.6, 0.6, 0.6, 0.6),
        SobolIndex("b", 0.4, 0.4, 0.4, 0.4),
        SobolIndex("c", 0.005, 0.005, 0.005, 0.005),
    ]
    assert ranked.ranking_sentence({name: grid}) == (
        "Loop area depends most on a, which contributes to 60 % of the variance, "
        "then on b (40 %), then on c (below 1 %)."
    )


def test_always_a_motionless_case_of_a_sweep_over_levels_has_no_peak_frequency(tmp_path):
    """Up to 3 g the block sticks at all frequencies: the first of them, 100.0 +- 0 Hz, was given as its peak."""
    scene = tmp_path / "rig.toml"
    scene.write_text(read_template("rig"), "utf-8")
    swept = [
        "drive.waveform=sweep",
        "drive.from=142 Hz",
        "drive.to=144 Hz",
        "drive.rate=1 Hz/s",
        "accuracy.method=harmonic",
    ]
    cli(
        "sweep",
        scene,
        *(word for one in swept for word in ("--set", one)),
        "--over",
        "drive.acceleration=2 g,6 g",
        "-o",
        tmp_path / "out",
    )
    table = read_table(tmp_path / "out")
    assert np.isnan(table["measures"]["peak_frequency"]["values"][0])
    text = (tmp_path / "out" / "report.html").read_text("utf-8")
    cases = text[text.index("id=cases") :] if "id=cases" in text else text[text.index(">Cases<") :]
    assert "peak frequency [Hz]" in cases[: cases.index("</table>")].replace("</a>", "")
    said = cli(
        "run",
        scene,
        *(word for one in swept for word in ("--set", one)),
        "--set",
        "drive.acceleration=2 g",
        "-o",
        tmp_path / "run",
    ).out
    assert (
        "peak_frequency                     - (the output does not move at any of the swept frequencies"
        in said
    )
