"""The modal tests of Figures 26 and 27: stated figures, and estimates against closed forms."""

import re

import numpy as np
import pytest
from study_module import assert_contains, load_study


def test_always_damping_at_high_level_agrees_with_linearisation():
    """At 20 g rms the damping ratio agrees with stochastic linearisation of Coulomb friction within 10 %.

    Its damper is sqrt(2/pi) mu N/(m sigma_v) for a normally distributed velocity.
    """
    figure = load_study("report/figure_27.py")
    row = figure.row("rigid block", 20.0, 10.0)
    assert row.damping == pytest.approx(figure.linearised_damping(row.speed), rel=0.1)
    assert row.frequency == pytest.approx(143, rel=5e-3)


def test_figure_26_steady_transmissibility_agrees_with_closed_form():
    """The steady transmissibility agrees with the sum over modes, and its peak is stated."""
    figure = load_study("report/figure_26.py")
    free = figure.curve()
    omega = 2 * np.pi * np.array([143.0, 73.0, 129.0])
    participation = np.array([0.99, 0.01, 0.0025])
    w = 2 * np.pi * free.f[:, None]
    exact = 1 + np.sum(participation * w**2 / (omega**2 - w**2 + 0.006j * omega * w), axis=1)
    np.testing.assert_allclose(free.h, exact, rtol=1e-12)
    assert_contains(figure.ANSWER, f"at {free.peak[0]:.2f} Hz, with {free.peak[1]:.0f} times")
    assert_contains(
        figure.__doc__,
        f"{free.f.size} points",
        f"transmits {np.abs(free.h[free.f < 80]).max():.1f} times",
    )
    frequencies = np.linspace(60, 210, 121)
    assert frequencies[np.argmax(np.abs(figure.transmissibility(frequencies)))] == 142.5
    assert np.abs(figure.transmissibility([142.5]))[0] / free.peak[1] == pytest.approx(
        2 / 3, abs=0.02
    )


@pytest.mark.slow
def test_figure_26_random_test_gives_stated_frequency_and_damping(tmp_path, capsys):
    """The random test gives the frequency, the damping ratio and the peak stated in the answer."""
    figure = load_study("report/figure_26.py")
    free, estimate, (frequency, damping, _) = figure.main(tmp_path / "x.svg")
    deficit = 1 - np.abs(estimate.h).max() / free.peak[1]
    assert_contains(
        figure.ANSWER,
        f"finds this peak at {frequency:.2f} Hz",
        f"ratio of {damping:.5f} (true value 0.003)",
        f"{100 * deficit:.1f} % too low",
    )
    assert figure.VERDICT == "yes" and "axial 143 Hz" in (tmp_path / "x.svg").read_text()


@pytest.mark.slow
def test_figure_27_models_give_stated_frequencies_and_slip(tmp_path, capsys):
    """Frequencies, damping ratios and slip of the three models are those stated in the study.

    The motion on grooves depends on the step tolerance: by 1.3 Hz, 0.02 in damping and 0.02 mil.
    """
    figure = load_study("report/figure_27.py")
    rows = {(r.model, r.level): r for r in figure.main(tmp_path / "x.svg")}
    records = {
        case: [rows[case], *(figure.row(*case, seed=seed) for seed in (2, 3, 4))]
        for case in (("grooves", 4.5), ("grooves", 5.1))
    }
    rigid = rows["rigid block", 4.2]
    second = rows["second path", 5.1]
    assert np.isnan(rows["rigid block", 1.0].damping)
    assert all(0.9 < r.damping < 1.1 for r in (rigid, second))
    slides = [r.slide for r in (rigid, second, *records["grooves", 5.1])]
    frequencies = [[r.frequency for r in records[case]] for case in records]
    dampings = [r.damping for r in records["grooves", 5.1]]
    for place, values, allowed in (
        (r"slides by ([\d.]+) to ([\d.]+) mil", slides, 0.07),
        (r"at 4.5 g rms: (\d+) to (\d+) Hz", frequencies[0], 1.8),
        (r"at (\d+) to (\d+) Hz for a block that climbs", frequencies[1], 1.8),
        (r"ratio is ([\d.]+) to ([\d.]+)\. The block", dampings, 0.025),
    ):
        stated = re.search(place, " ".join(figure.__doc__.split())).groups()
        assert (min(values), max(values)) == pytest.approx(tuple(map(float, stated)), abs=allowed)
    assert_contains(
        figure.ANSWER,
        f"at {rigid.frequency:.0f} Hz for a rigid",
        f"{second.frequency:.0f} Hz with",
    )
    assert_contains(
        figure.__doc__,
        f"{rows['rigid block', 6.0].frequency:.0f} Hz at 6 g rms",
        f"{rows['rigid block', 12.0].frequency:.0f} Hz at 12 g",
        f"slide of {rigid.slide:.1f} mil rms is {rigid.slide / 0.08:.0f} times",
    )
    assert {f"{r.damping:.1f}" for r in records["grooves", 4.5]} == {"1.3"}
    assert figure.row("second path", 3.0).frequency == pytest.approx(260, rel=0.02)
    spring = (148 / 143) ** 2 - 1
    assert_contains(
        figure.__doc__,
        f"{spring:.3f} of the flexures'",
        f"by {4 * 0.47825 / spring:.0f} mil",
        f"{4 * 0.47825 / spring / 0.08:.0f} times what was",
    )
    assert_contains(figure.VERDICT, "in part", "148 Hz", "1.3", "yaw")
    assert "148 Hz" in (tmp_path / "x.svg").read_text() and figure.ANSWER in capsys.readouterr().out
