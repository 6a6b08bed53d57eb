"""The studies of the report's figures: their stated figures, computed again."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from study_module import assert_contains, load_study
from vibration_forms import decay_rest, sliding_amplitude


def test_figures_2_and_3_amplitudes_of_one_block(capsys):
    """The amplitudes agree with the closed form of sliding and with independent computations."""
    figure = load_study("report/figures_2_3.py")
    rows, stopped = figure.main(None)
    by_level = {(r.onset, r.level): r for r in rows}
    for onset in figure.ONSETS:  # closed form of sliding without a stop
        for level in (6.0, 7.0, 8.0):
            assert by_level[onset, level].q == pytest.approx(
                sliding_amplitude(1.0, onset / level, 0.003), rel=1e-9
            )
        assert by_level[onset, 4.0].outcome == "stuck" and by_level[onset, 4.0].q < 1e-18
    # from a time march with 40 digits
    assert by_level[4.0, 5.0].q == pytest.approx(0.28704671337871602, rel=1e-9)
    # from shooting over half a cycle with D = 0.828
    assert by_level[4.14, 5.0].q == pytest.approx(0.150075, abs=2e-6)
    five = by_level[4.14, 5.0]
    eight = by_level[4.14, 8.0]
    assert_contains(
        figure.ANSWER,
        f"q is {five.q:.3f}",
        f"is {five.acceleration / 5:.2f} times that of the input",
        f"{by_level[4.0, 5.0].q:.3f} and {by_level[4.0, 5.0].acceleration / 5:.2f}",
        f"to {eight.acceleration:.0f} g",
        f"moves by {by_level[4.14, 6.0].mil:.0f} and {by_level[4.14, 7.0].mil:.0f} mil",
    )
    loose, tight = (np.ptp(run.displacement) / 2 for run in stopped.values())
    assert_contains(
        " ".join(figure.__doc__.split()),
        f"{five.mil:.3f} mil for 0.23",
        f"{five.acceleration:.2f} g for 6.0",
        f"q is {loose:.3f}",
        f"0.21 q is {tight:.3f}",
        f"the onset, {4.14 * 4 / np.pi:.2f} g",
        f"acceleration {np.abs(stopped[figure.STICK_SPEED].absolute).max():.2f}; below",
    )
    assert figure.ANSWER in capsys.readouterr().out


def test_figures_2_and_3_last_stop_and_jump_of_acceleration():
    """Stops end at 5.3 g; the exact motion jumps in acceleration and the report's in velocity."""
    figure = load_study("report/figures_2_3.py")
    assert figure.steady(4.14, 5.28).stuck > 0 == figure.steady(4.14, 5.31).stuck
    assert_contains(figure.ANSWER, "from 5.3 g on")
    assert_contains(figure.VERDICT, "in part", "4.14 g", "5.3 g")
    exact = figure.exact_cycle(4.14)
    stopped = figure.newmark_run(figure.STICK_SPEED)
    step = 2 * np.pi / (figure.CURVE - 1)
    jump = np.abs(np.diff(exact.relative)).max()
    assert jump == pytest.approx(0.704, abs=2 * step)
    assert np.abs(np.diff(exact.velocity)).max() < step * np.abs(exact.relative).max() * 1.01
    assert 0.15 < np.abs(np.diff(stopped.velocity)).max() < figure.STICK_SPEED + step
    assert exact.friction.max() == pytest.approx(
        0.828, rel=1e-12
    ) and stopped.friction.max() == pytest.approx(0.8)


def rates_with_moving_frame(time, state):
    """Return the rates of displacement and velocity by equations 2.4 and 2.5, with the frame at sin 0.1 t."""
    x, v = state
    return np.array([v, -x - 0.04 * v + 0.1 * np.tanh((0.1 * np.cos(0.1 * time) - v) / 0.01)])


def test_figure_5_ringing_agrees_with_integrated_equations():
    """The motions agree with LSODA and with Euler's method written out; the answer has their peaks."""
    figure = load_study("report/figure_5.py")
    exact, euler = figure.main((0.04, 0.1, 0.2), path=None)
    span = 16 * np.pi * 10
    solution = solve_ivp(
        rates_with_moving_frame,
        (0, span),
        [0.0, 0.0],
        method="LSODA",
        rtol=1e-9,
        atol=1e-12,
        max_step=0.5,
        t_eval=np.minimum(span - 20 * np.pi + exact.time, span),
    )
    np.testing.assert_allclose(exact.block, solution.y[0], atol=3e-7)
    np.testing.assert_allclose(exact.frame, np.sin(0.1 * exact.time), atol=2e-7)
    steps = round(20 * np.pi / 0.1)
    (x, v, frame), track, h = (0.0, 0.0, 0.1), [0.0], 20 * np.pi / steps
    for k in range(8 * steps):  # Euler's method for block and frame
        friction = 0.1 * np.tanh((frame - v) / 0.01)
        x, v, frame = (
            x + h * v,
            v + h * (friction - x - 0.04 * v),
            frame - h * 0.01 * np.sin(0.1 * k * h),
        )
        track.append(x)
    np.testing.assert_allclose(euler[0.1].block, track[-steps - 1 :], atol=2e-8)
    ratio = figure.swings(exact)[2] / figure.swings(exact)[1]
    assert ratio == pytest.approx(np.exp(-0.02 * np.pi), rel=2e-3)
    assert_contains(
        figure.ANSWER,
        f"amplitude of {exact.peak:.3f} a0",
        f"swing has {ratio:.3f} times",
        f"{euler[0.1].peak:.3f} a0 with a time step of 0.1/w0",
        f"{euler[0.2].peak:.3f} a0 with a time step of 0.2/w0",
    )
    assert_contains(
        figure.__doc__, f"for {100 * figure.carried_time_fraction(exact):.0f} % of the time"
    )
    # the damping of 2 % is cancelled by Euler's method
    assert figure.swings(euler[0.04])[2] == pytest.approx(figure.swings(euler[0.04])[1], rel=3e-3)
    assert figure.turns(exact).size == 18 and figure.VERDICT == "yes"


def test_figures_10_to_12_amplitudes_of_two_masses():
    """At resonance and above it, two masses agree with a single harmonic; the docstring has the figures."""
    figure = load_study("report/figures_10_12.py")
    rows = {r.ratio: r for r in figure.main((0.3, 0.4, 0.5), path=None)}
    slow, resonant, fast = (rows[ratio] for ratio in figure.FIGURES.values())
    # closed form with a single harmonic
    assert resonant.amplitude == pytest.approx(
        (0.4 / np.pi / 0.04, (1 - 0.4 / np.pi) / 0.04), rel=1e-3
    )
    first = np.abs(np.fft.rfft(fast.x1[:-1])[2]) / 800
    assert first == pytest.approx(0.4 / np.pi / abs(1 - 25 + 0.2j), rel=3e-3)
    text = " ".join(figure.__doc__.split())
    assert_contains(
        text,
        f"reverses its motion about {slow.turns[0]:.0f} times a cycle",
        "each mass reverses about twice a cycle",
        f"{slow.amplitude[0]:.3f} and {slow.amplitude[1]:.3f} at 0.1 w0",
        f"{resonant.amplitude[0]:.2f} and {resonant.amplitude[1]:.2f} at w0",
        f"{fast.amplitude[0]:.4f} and {fast.amplitude[1]:.4f} at 5 w0",
        f"{100 * rows[0.3].distortion[0]:.0f} % of the rubbed",
        f"takes {100 * resonant.friction:.0f} % of",
        f"{100 * slow.friction:.0f} % at 0.1 w0 and {100 * fast.friction:.0f} % at 5 w0",
    )
    assert slow.distortion[1] < 0.05 and resonant.distortion[0] < 0.002
    assert slow.turns[1] == 2 and rows[0.4].turns[0] > 2
    assert all(rows[ratio].turns == (2, 2) for ratio in (0.5, 1.0, 5.0)) and figure.VERDICT == "yes"


def test_figure_15_time_of_rest_agrees_with_closed_form():
    """The time and the position at which a released block comes to rest agree with the closed form."""
    figure = load_study("report/figure_15.py")
    rows, (time, x, failed) = figure.main(None)
    # The tolerance of a step is 1e-12.
    assert max(r.error for r in rows) <= 1e-11
    for r in rows:
        assert (r.stop, r.place) == pytest.approx(
            decay_rest(1.0, 1 / r.ratio, r.omega), rel=1e-11, abs=1e-11
        )
        # the amplitude falls by 2 F/k at each reversal until the spring force is below F
        sizes = 1 - 2 * np.arange(30) / r.ratio
        count = np.argmax(sizes <= 1 / r.ratio)
        assert r.stop == pytest.approx(np.pi * count / r.omega)
        assert abs(r.place) == pytest.approx(sizes[count], abs=1e-12)
    first, second, third = rows
    assert first.moving == pytest.approx(-0.125) and first.stop > first.printed == pytest.approx(
        3.5 * np.pi
    )
    assert_contains(
        figure.ANSWER,
        f"w0 = 2 ({second.stop:.3f})",
        f"1.414 ({third.stop:.3f})",
        f"a time of {first.printed:.3f}",
        f"to rest at the time {first.stop:.3f}",
        "4e-12 of x0",
    )
    before = time < first.stop
    after = time > first.stop + 0.5
    exact = (1 - (2 * (n := np.floor(time / np.pi)) + 1) / 8) * np.cos(time) + (-1.0) ** n / 8
    error = np.abs(x - exact)[before].max()
    swing = np.ptp(x[after]) / 2
    assert_contains(
        " ".join(figure.__doc__.split()),
        f"3.11 to {error:.3f} x0",
        f"swing by {swing:.3f} x0",
        f"{100 * failed:.0f} % of them do not converge",
    )
    assert figure.VERDICT.startswith("in part: ")


@pytest.mark.slow
def test_figures_30_and_31_counts_over_all_sets(tmp_path):
    """The counts and ranges over all sets of traces are those stated in the study."""
    figure = load_study("report/figures_30_31.py")
    six, twelve = figure.main(path=tmp_path / "x.svg").values()
    x, y, less, earlier = figure.counts(six[0])
    assert_contains(
        figure.ANSWER, f"In {x} of 20 such sets", f"lower; in {y} sets", f"In {less} sets the"
    )
    text, (a, b, c, before) = " ".join(figure.__doc__.split()), figure.counts(twelve[0])
    assert earlier == before == 1 and not any(
        part.verdict.code == "worn" for set_of_traces in six[0] for part in set_of_traces.parts
    )
    assert_contains(
        text,
        f"the counts are {a}, {b} and {c}",
        f"to {twelve[1].after[0]:.2f} and {twelve[1].after[1]:.2f}, the",
        f"in {figure.count_held(*six)} and {figure.count_held(*twelve)} of 40 cases",
    )
    new, old = (1e6 * figure.heights(six[0], when) for when in (0, 1))
    assert_contains(
        text,
        f"{new.min():.0f} to {new.max():.0f} um before and {old.min():.0f} to {old.max():.0f} um after",
    )
    (x_before, x_after), (y_before, y_after) = (
        figure.totals(six[0], direction) for direction in (0, 1)
    )
    both = [1e6 * np.concatenate(pair) for pair in ((x_before, y_before), (x_after, y_after))]
    assert_contains(
        text,
        f"have {both[0].min():.0f} to {both[0].max():.0f} um before and {both[1].min():.0f} to "
        f"{both[1].max():.0f} um after",
        f"is {figure.spread(x_after / x_before, 2)} along x and "
        f"{figure.spread(y_after / y_before, 2)} along y",
    )
    at_second_stroke = [
        np.divide(*figure.totals(twelve[0], direction)[::-1]) for direction in (0, 1)
    ]
    assert_contains(
        text,
        f"At 12.8 um they are {figure.spread(at_second_stroke[0], 2)} and {figure.spread(at_second_stroke[1], 2)}",
    )
    assert_contains(
        (tmp_path / "x.svg").read_text(),
        "along x, 95 % of one set",
        "Fig. 31, after, along y: waves",
    )
