"""Answers on the page of a sweep: ranking of inputs, scatter of random cases, and resonance peaks."""

import json

import numpy as np
import pytest
from command_line import run_cli
from page_data import make_sweep_key, make_sweep_measure, make_sweep_table
from scene_texts import COULOMB, POINT, SHORT

from patchfem.campaigns.sweeps.ranking import SobolIndex
from patchfem.export import summarise_sweep
from patchfem.export.pages import limits, peaks, ranked
from patchfem.export.pages.sweep import page_html
from patchfem.export.sweeps.page import read_table
from patchfem.scene import read_template

RIG = POINT + COULOMB + SHORT


AMPLITUDE = "relative_displacement_amplitude"


def make_key(name, values, texts=None):
    """Return a swept key with its values in hertz."""
    return make_sweep_key(name, values, "Hz", texts or [f"{value:.12g} Hz" for value in values])


def resonance_amplitude(x, centre, damping):
    """Return the amplitude of a single mode with a given centre frequency and damping ratio."""
    return 1e-6 / np.sqrt((1 - (x / centre) ** 2) ** 2 + (2 * damping * x / centre) ** 2)


@pytest.mark.parametrize("damping", [0.02, 0.05])
def test_exact_resonance_peak_and_width_agree_with_closed_form(damping):
    """Frequency, height and half-power width of the peak of one mode agree with the closed form.

    The errors cover the differences and are below 1e-6 of the value.
    """
    x = np.linspace(80, 120, 161)
    amplitude = np.concatenate(
        [resonance_amplitude(x, 100, damping), resonance_amplitude(x, 95, damping)]
    )
    keys = [
        make_key("drive.frequency", np.tile(x, 2)),
        make_key("drive.acceleration", np.repeat([1.0, 2.0], 161), ["1 g"] * 161 + ["2 g"] * 161),
    ]
    peaks_found = find_amplitude_peaks(keys, amplitude)
    for peak, centre in zip(peaks_found, (100, 95)):
        # squared half-power frequencies relative to the centre frequency
        square = 1 - 2 * damping**2 + 2 * damping * np.sqrt(1 - damping**2) * np.array([1, -1])
        expected = (
            centre * np.sqrt(1 - 2 * damping**2),
            1e-6 / (2 * damping * np.sqrt(1 - damping**2)),
            -np.diff(centre * np.sqrt(square))[0],
        )
        swept = peak.swept
        for (value, error), exact_value in zip(
            (swept.frequency, swept.height, swept.half_power_width), expected
        ):
            assert (
                abs(value - exact_value) <= error + 1e-9 * exact_value
                and error < 1e-6 * exact_value
            )
    sentence = peaks.peaks_sentence(peaks_found)
    assert "with drive.acceleration 1 g" in sentence and "with drive.acceleration 2 g" in sentence
    assert "(cases lie 0.25 Hz apart)" in sentence
    peaks_found = find_amplitude_peaks(
        keys, np.where(np.abs(np.tile(x, 2) - 99.6) < 0.4, np.nan, amplitude)
    )
    first, second = (peak.swept for peak in peaks_found)
    assert np.isnan(first.height.value)  # this peak has no height because cases are missing
    assert second.frequency.value == pytest.approx(95 * np.sqrt(1 - 2 * damping**2), abs=1e-3)
    sentence = peaks.peaks_sentence(peaks_found)
    assert "; where it peaks with drive.acceleration 1 g is not known" in sentence
    assert "not known" in peaks.peaks_table(peaks_found)
    assert peaks.peaks_sentence(peaks_found[:1]).startswith("Where relative displacement am")


def test_always_peak_needs_both_flanks():
    """A maximum at the end of the swept range is not a peak, and a peak with one flank has no half-power width."""
    x = np.linspace(80, 120, 41)
    keys = [make_key("drive.frequency", x)]
    for values in (x, -x + 200, np.where(x < 99, np.nan, resonance_amplitude(x, 98, 0.05))):
        assert find_amplitude_peaks(keys, values) == []
    assert peaks.find_peaks(keys, {}, {}, True) == []
    narrow = x[(x > 97) & (x < 130)]
    (peak,) = find_amplitude_peaks(
        [make_key("drive.frequency", narrow)], resonance_amplitude(narrow, 100, 0.05)
    )
    assert np.isnan(peak.swept.half_power_width.value)
    assert "width" not in peaks.peaks_sentence([peak])
    # cases that are not steady count with their estimate of the steady amplitude
    settled = {AMPLITUDE: x < 90, f"{AMPLITUDE}_steady": np.ones(41, bool)}
    measures = {
        AMPLITUDE: (np.where(x < 90, resonance_amplitude(x, 100, 0.05), 1.0), 0 * x, "m"),
        f"{AMPLITUDE}_steady": (
            np.where(x < 90, np.nan, resonance_amplitude(x, 100, 0.05)),
            0 * x,
            "m",
        ),
    }
    (peak,) = peaks.find_peaks(keys, measures, settled, True)
    assert peak.swept.frequency.value == pytest.approx(99.75, abs=0.02)


@pytest.fixture(scope="module")
def random_sweep(tmp_path_factory):
    """Return the results folder of a sweep of 64 random cases and the answer of the command."""
    folder = tmp_path_factory.mktemp("drawn")
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    answer = run_cli(
        "sweep",
        folder / "rig.toml",
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
        folder / "swept",
    )
    assert answer.code == 0
    return folder / "swept", answer


def test_always_random_cases_are_ranked_with_scatter(random_sweep):
    """The answer of a random sweep ranks the keys and states the range of 90 % of the cases.

    The page, sweep.json and the command line state the same.
    """
    out, answer = random_sweep
    summary = json.loads((out / "sweep.json").read_text())
    shares = summary["ranking"]["loop_area"]
    assert {index["key"] for index in shares} == {
        "friction.static",
        "drive.acceleration",
        "structure.mode.0.damping",
    }
    assert all(
        set(index) == {"key", "first", "total", "low", "high"}
        and index["low"] <= index["total"] <= index["high"]
        for index in shares
    )
    assert "depends most on" in summary["answer"]
    assert "90 % of the 64 random cases have" in summary["answer"]
    page = (out / "report.html").read_text("utf-8")
    assert "Keys that matter most" in page
    assert "Scatter of the answers" in page
    assert "<svg viewBox" in page
    # `patchfem report` makes this text from the files
    sentences = summarise_sweep(read_table(out)).texts
    head, count, *_ = answer.out.splitlines()
    assert head == f"{sentences.rank.rstrip('.')}; {sentences.scatter}" == summary["answer"]
    assert count == "64 cases: 64 steady"
    loops = read_table(out)["measures"]["loop_area"]["values"]
    low, _, high = summarise_sweep(read_table(out)).spread["loop_area"][1]
    # the quantiles lie between the fourth and the fifth value from either end
    assert np.count_nonzero((loops >= low) & (loops <= high)) == 64 - 2 * 4


def test_exact_quantiles_include_cases_that_miss_tolerance():
    """Quantiles are computed over all cases with a value, also those that miss the tolerance.

    Without the 12 smallest of 40 values the 5 % quantile was 2.3 times as large.
    """
    values = np.append(np.arange(1.0, 41), np.nan)
    loop = make_sweep_measure(values, np.where(values < 13, 0.5 * values, 0.0), "J")
    outcome = ["steady"] * 40 + ["failed"]
    table = random_table([make_key("normal.load", values)], {"loop_area": loop}, outcome=outcome)
    quantiles = ranked.measure_quantiles(table, {"loop_area": np.append(values[:-1] > 12, True)})
    unit, limits_found, count, n_missed = quantiles["loop_area"]
    assert (unit, count, n_missed) == ("J", 40, 12)
    assert limits_found == pytest.approx(np.quantile(np.arange(1.0, 41), (0.05, 0.5, 0.95)))
    assert (
        "(12 of 40 miss the tolerance and are included with their values)"
        in ranked.describe_scatter(quantiles, 41)
    )
    assert "40 of 41 random cases that have a value" in ranked.describe_scatter(
        quantiles, 41, False
    )


def test_always_answer_states_that_no_case_is_steady(random_sweep):
    """If no case of a sweep reached its steady state, the first sentence of the answer states this."""
    table = read_table(random_sweep[0])
    count = len(table["outcome"])
    warning = "o case has settled, so this answer describes the end of each run"
    assert warning not in "".join(summarise_sweep(table).sentences())
    summary = summarise_sweep(table | {"outcome": ["transient"] * (count - 2) + ["failed", ""]})
    assert summary.sentences()[0] == summary.answer() and summary.answer().endswith(
        f" (1 of {count} cases has no result yet and is left out; n{warning})."
    )
    assert "settled" not in summary.texts.scatter and not any(
        warning in sentence for sentence in summary.sentences()[1:]
    )
    assert summarise_sweep(table | {"outcome": ["failed"] * count}).texts.qualification == ""


def find_amplitude_peaks(keys: list, values):
    """Return the peaks of the amplitude over the cases of a grid, all steady and without errors."""
    measures = {AMPLITUDE: (values, 0 * values, "m")}
    return peaks.find_peaks(keys, measures, {AMPLITUDE: np.ones(values.size, bool)}, True)


def random_table(keys, measures, **more):
    """Return the table of a sweep of random cases."""
    return make_sweep_table(keys, measures, grid=False, drawn=True, **more)


def test_exact_answer_of_random_sweep_names_requested_maximum():
    """The answer states the maximum of the requested measure, 30 - 400 (mu - 0.475)^2, at mu = 0.475.

    Random cases give no limit of a key, because none of them is a reference.
    """
    mu = np.random.default_rng(1).permutation(np.append(np.linspace(0.1, 0.6, 60), 0.475))
    damping = 30 - 400 * (mu - 0.475) ** 2
    columns = {
        "equivalent_damping": make_sweep_measure(damping),
        AMPLITUDE: make_sweep_measure(1 - mu / 4, unit="m"),
    }
    table = random_table(
        [make_key("friction.static", mu, [f"{value:.6g}" for value in mu])],
        columns,
        first="equivalent_damping",
    )
    summary = summarise_sweep(table)
    low, high = np.quantile(damping, [0.05, 0.95])
    assert summary.limits == limits.Limits() and not any(
        "may reach" in sentence for sentence in summary.sentences()
    )
    assert summary.answer().startswith(
        f"Equivalent damping ratio is largest, 30, at friction.static 0.475; 90 % of the 61 random cases have an "
        f"equivalent damping ratio from {low:.3g} to {high:.3g}, "
    )
    for slope, trend in ((1, "grows with"), (-1, "falls with growing")):
        columns["equivalent_damping"] = make_sweep_measure(2 + slope * mu)
        assert (
            summarise_sweep(table)
            .answer()
            .startswith(f"Equivalent damping ratio {trend} friction.static; 90 % of")
        )
    columns["equivalent_damping"] = make_sweep_measure(np.abs(mu - 0.3) + 1)
    assert "is least, 1" in summarise_sweep(table).answer()


def test_exact_trend_of_strongest_key():
    """The trend of y = 4 a + b is that it grows with a; a measure that is only noise has no trend."""
    rng = np.random.default_rng(2)
    a, b, noise = rng.random((3, 200))
    keys = [
        make_key(name, values, [f"{value:.6g}" for value in values])
        for name, values in (("a.a", a), ("b.b", b))
    ]
    settled = np.ones(200, bool)
    indices = {
        "loop_area": [SobolIndex("a.a", 0.9, 0.9, 0.9, 0.9), SobolIndex("b.b", 0.1, 0.1, 0.1, 0.1)]
    }
    for values, sentence in (
        (4 * a + b, "Loop area grows with a.a."),
        (b - 4 * a, "Loop area falls with growing a.a."),
        (noise, ""),
    ):
        table = random_table(keys, {"loop_area": make_sweep_measure(values, unit="J")})
        assert ranked.describe_trend(table, indices, settled) == sentence
    table = random_table(keys, {"loop_area": make_sweep_measure(b - 9 * (a - 0.5) ** 2, unit="J")})
    low, high = map(
        float,
        ranked.describe_trend(table, indices, settled)
        .removeprefix("Loop area is largest between a.a ")
        .removesuffix(".")
        .split(" and "),
    )
    assert low < 0.5 < high and np.mean((a >= low) & (a <= high)) == pytest.approx(0.2, abs=0.02)


def test_exact_too_few_steady_cases_give_no_ranking():
    """Of 64 cases 32 failed and 31 are not steady, so the answer is that no ranking is possible.

    Earlier the answer was the amplitude of the single steady case.
    """
    rng = np.random.default_rng(3)
    keys = [make_key(name, rng.random(64)) for name in ("a.a", "b.b")]
    values = np.append(np.full(32, np.nan), rng.random(32))
    table = random_table(
        keys,
        {AMPLITUDE: make_sweep_measure(values, unit="m")},
        outcome=["failed"] * 32 + ["transient"] * 31 + ["steady"],
    )
    summary = summarise_sweep(table)
    assert summary.answer() == (
        "Only 1 of 64 cases settled (32 failed, 31 transient), so no ranking is possible; raise drive.cycles so that "
        "the transient cases settle and correct what the messages of the failed cases name."
    )
    assert "; relative displacement amplitude of the only settled case is " in summary.texts.span
    table = table | {"outcome": ["failed"] * 40 + ["done"] * 24}
    assert "so no ranking is possible" not in "".join(summarise_sweep(table).sentences())


def test_exact_swept_frequency_range_is_stored(tmp_path):
    """The answer counts a maximum at 372 Hz, the end of the sweep, also after the results are read again."""
    scene = tmp_path / "damper.toml"
    scene.write_text(read_template("damper"), "utf-8")
    answer = run_cli(
        "sweep",
        scene,
        "--set",
        "drive.to=372 Hz",
        "--over",
        "structure.interface[1].load=10 N,2 kN",
        "-o",
        tmp_path / "out",
    )
    sentence = "n 1 of 2 cases the largest response lies at an end of the swept frequencies"
    assert sentence in answer.out
    assert sentence in summarise_sweep(read_table(tmp_path / "out")).answer()


def test_exact_warning_states_drive_limit_of_friction(tmp_path):
    """Above an acceleration of 4 mu N/(pi m) = 5.067 g friction alone does not limit the motion; the run states it."""
    scene = tmp_path / "rig.toml"
    scene.write_text(read_template("rig"), "utf-8")
    arguments = ("--set", "drive.acceleration=6 g", "--no-page", "-o", tmp_path / "run")
    warning = "6 g, is larger than 5.067 g, above which friction alone does not limit the amplitude"
    assert warning in run_cli("run", scene, *arguments).out


@pytest.mark.parametrize(
    "values, is_counted", [([2e-3, 1e-6, 3e-3, 2e-6], True), ([1e-6, 2e-6, 1e-6, 3e-6], False)]
)
def test_exact_transient_cases_are_counted_in_answer(values, is_counted):
    """The answer counts cases that are not steady if their amplitudes exceed those of the steady cases."""
    measures = {AMPLITUDE: make_sweep_measure(values, unit="m")}
    outcome = ["transient", "steady"] * 2
    table = make_sweep_table(
        [make_sweep_key("normal.load", [1, 2, 3, 4], "N")], measures, outcome=outcome
    )
    start = "2 of 4 cases did not settle; their relative displacement amplitude at the end of the run is 2 mm to 3 mm; "
    answer = summarise_sweep(table).answer()
    assert answer.startswith(start) == ("did not settle" in answer) == is_counted


def test_exact_missing_half_power_width_has_reason():
    """The page states why a half-power width is missing: cases too far apart, or a peak wider than the sweep."""
    x = np.linspace(80, 120, 9)
    peaks_found = find_amplitude_peaks(
        [make_key("drive.frequency", x)], resonance_amplitude(x, 102.4, 0.005)
    )
    assert "half-power width not resolved by these cases" in peaks.peaks_sentence(peaks_found)
    assert "; add cases near 102.4 Hz" in peaks.peaks_table(peaks_found)
    x = np.linspace(98, 102, 9)
    peaks_found = find_amplitude_peaks(
        [make_key("drive.frequency", x)], resonance_amplitude(x, 100.2, 0.05)
    )
    assert "half-power" not in peaks.peaks_sentence(peaks_found)
    assert "reaches beyond the swept frequencies" in peaks.peaks_table(peaks_found)


def test_exact_scatter_is_unknown_with_many_transient_cases():
    """If a third of the cases is not steady, the page states that the scatter is not known.

    Earlier it gave the scatter of the steady cases as that of all.
    """
    rng = np.random.default_rng(7)
    keys = [make_key(name, rng.random(100)) for name in ("a.a", "b.b")]
    transient = np.arange(100) % 3 == 0
    values = 1e-6 * (1 + rng.random(100)) * np.where(transient, 1e3, 1)
    table = random_table(keys, {AMPLITUDE: make_sweep_measure(values, unit="m")})

    def scatter_section(table) -> str:
        """Return the section of the page about the scatter."""
        return (
            page_html(table).partition("Scatter of the answers</h2>")[2].partition("</section>")[0]
        )

    text = scatter_section(table)
    assert "not known" not in text and "do not count" not in text
    table["outcome"] = np.where(transient, "transient", "steady").tolist()
    text = scatter_section(table)
    assert text.count("not known") == 4 and "34 of 100 cases do not count" in text
    assert "curve" not in text
    assert (
        "34 of 100 cases did not settle; their relative displacement amplitude at the end of"
        in summarise_sweep(table).texts.span
    )


def test_exact_keys_with_overlapping_intervals_rank_equally():
    """Keys whose sensitivity intervals overlap are ranked equally.

    Indices of a grid have no intervals.
    """
    name = "loop_area"
    load = SobolIndex("contact.load", 0.5, 0.58, 0.46, 0.66)
    friction = SobolIndex("friction.static", 0.5, 0.56, 0.44, 0.6)
    damping = SobolIndex("damping", 0.01, 0.02, 0.0, 0.06)
    tilt = SobolIndex("tilt", 0.0, 0.001, 0.0, 0.04)
    sentence = ranked.ranking_sentence({name: [load, friction, damping, tilt]}, 56, True, 64)
    assert sentence.startswith(
        "56 of 64 cases have not settled; with their last values included, loop area depends most "
        "on contact.load and friction.static about equally (58 and 56 % of the variance; their "
        "intervals overlap), then on damping and tilt (at most 6 % each), where each share"
    )
    short_sentence = ranked.ranking_sentence({name: [load, damping]}, 3, True, 64)
    assert short_sentence == (
        "Loop area depends most on contact.load, which contributes to 58 % of the variance (46 to 66 %), "
        "then on damping (at most 6 %); 3 cases that have not settled are included with their last "
        "values."
    )
    force = SobolIndex("far", 0.3, 0.3, 0.25, 0.47)
    assert (
        "depends on contact.load and far (58 and 30 % of the variance; their"
        in ranked.ranking_sentence({name: [load, force]})
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


def test_always_stuck_case_has_no_peak_frequency(tmp_path):
    """A block that sticks at all frequencies has no peak frequency.

    Earlier the first frequency, 100 Hz, was given without an error.
    """
    scene = tmp_path / "rig.toml"
    scene.write_text(read_template("rig"), "utf-8")
    settings = [
        "drive.waveform=sweep",
        "drive.from=142 Hz",
        "drive.to=144 Hz",
        "drive.rate=1 Hz/s",
        "drive.acceleration=2 g",
        "accuracy.method=harmonic",
    ]
    words = [word for setting in settings for word in ("--set", setting)]
    output = run_cli("run", scene, *words, "--no-page", "-o", tmp_path / "run").out
    assert (
        "peak_frequency                     - (the output does not move at any of the swept frequencies"
        in output
    )
