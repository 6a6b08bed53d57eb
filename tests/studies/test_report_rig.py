"""The tests of the rig: sweeps below 5 g, stepped levels, ringing loops and runaway."""

import numpy as np
import pytest
from study_module import assert_contains, load_study, make_study_fixture

import patchfem as pf

figure = make_study_fixture("report/figure_8.py")


def test_figure_8_peak_spring_force_agrees_with_closed_form(figure):
    """Up to 20 Hz the peak force in the load cell agrees with the closed form within 0.2 %.

    The friction force on the piece stays at Coulomb's limit.
    """
    for frequency in (5.0, 10.0, 20.0):
        loop = figure.loop(frequency)
        assert loop.peak == pytest.approx(figure.ring(frequency), rel=2e-3)
        assert np.abs(loop.friction).max() == pytest.approx(figure.LIMIT, rel=1e-12)
        assert_contains(
            figure.ANSWER,
            *[f"{loop.peak:.2f} times the friction force at 10 Hz"] * (frequency == 10),
        )


def test_figure_8_loop_area_equals_the_friction_work(figure):
    """The loop area equals the friction work per cycle and agrees with the closed form."""
    loop = figure.loop(10.0)
    area = abs(np.trapezoid(loop.friction, loop.slip)) / (4 * figure.LIMIT * figure.STROKE)
    assert area == pytest.approx(loop.work, rel=2e-3)
    assert loop.work == pytest.approx(1 - figure.LIMIT / figure.STIFFNESS / figure.STROKE, rel=5e-3)


def test_figure_8_piece_sticks_on_almost_every_swing(figure):
    """With static friction above kinetic the last of six cycles has all its events, of more than 1600 in the run."""
    kinetic = figure.loop(2.0, 0.33)
    assert_contains(figure.__doc__, f"the cell shows {kinetic.peak:.2f}")
    assert kinetic.sticks > 50 > 10 > figure.loop(2.0).sticks


@pytest.mark.slow
def test_figure_8_study_gives_its_stated_figures(figure, tmp_path, capsys):
    """Peaks, static friction coefficient and length from the loops are those stated in the study."""
    loops = {loop.frequency: loop for loop in figure.main(tmp_path / "x.svg")}
    assert_contains(
        figure.ANSWER, f"{loops[10].peak:.2f} times the", f"{loops[20].peak:.2f} times at 20 Hz"
    )
    as_rigid = {f: figure.read_as_rigid(loops[f]) for f in (2.0, 10.0)}
    assert all(
        f"{static:.3f}" == "0.300" and abs(length * 1e6 - 3.5) < 0.06
        for static, length in as_rigid.values()
    )
    assert figure.LIMIT / figure.STIFFNESS == pytest.approx(3.5e-6, rel=0.01)
    assert_contains(
        figure.__doc__,
        f"{figure.ring(10):.3f} at 10 Hz, {figure.ring(40):.3f} at 40",
        f"{loops[40].peak:.3f})",
        f"{loops[10].swings} swings a stroke at 10 Hz and {loops[20].swings}",
        f"is {loops[10].work:.2f} of that",
    )
    assert figure.ANSWER in capsys.readouterr().out
    assert "load cell" in (tmp_path / "x.svg").read_text()


@pytest.mark.parametrize("model", ["rigid block", "grooves"])
def test_sweeps_are_distorted_only_above_the_stated_levels(model):
    """The acceleration is distorted at 4.5 g at every frequency above 136 Hz, and at 4.1 g at none."""
    sweeps = load_study("report/sweeps.py")
    for level, is_distorted in ((4.1, False), (4.5, True)):
        sweep = sweeps.sweep_level(model, level)
        distortion = sweep.distortion[sweep.frequency > 136]
        assert ((distortion > sweeps.DISTORTION_LIMIT) == is_distorted).all()


@pytest.mark.slow
def test_sweeps_give_stated_critical_levels(tmp_path, capsys):
    """The critical levels and accelerations of the three models are those stated in the study."""
    sweeps = load_study("report/sweeps.py")
    levels = sweeps.main(tmp_path / "x.svg")
    expected = {
        "rigid block": ("in the model of a rigid block", 0),
        "grooves": ("in the model with grooves", 136),
        "second path": ("in the model with a second load path", 136),
    }
    for model, (words, min_frequency) in expected.items():
        words = "{:.2f} to {:.2f} g " + words
        of_model = [sweep for sweep in levels if sweep.model == model]
        level = sweeps.critical(of_model)[of_model[0].frequency > min_frequency]
        assert_contains(sweeps.ANSWER, words.format(level.min(), level.max()))
        transmissibility = of_model[-1].acceleration[of_model[-1].frequency > 131] / 4.75
        if model != "second path":
            assert_contains(
                sweeps.__doc__, f"{transmissibility.min():.2f} to {transmissibility.max():.2f}"
            )
            assert of_model[-1].level == 4.75
    stuck = next(sweep for sweep in levels if sweep.model == "grooves" and sweep.level == 3.0)
    assert_contains(
        sweeps.__doc__,
        f"reads {stuck.displacement[stuck.frequency < 135].max():.2f} mil at 3 g where it reads "
        f"{stuck.displacement[stuck.frequency > 140].max():.2f} at most",
    )
    assert (
        f"{sweeps.critical([sweep for sweep in levels if sweep.model == 'grooves']).min():.1f}"
        == "4.0"
    )
    assert sweeps.ANSWER in capsys.readouterr().out


@pytest.mark.slow
def test_always_stepped_levels_reach_the_steady_motion():
    """The time march through increasing levels ends each level in the steady motion of harmonic balance."""
    steps = load_study("report/steps.py")
    for step in steps.steps(143.0, steps.raise_levels(143.0))[1:]:
        result = pf.run(
            steps.text(),
            **{"measured.file": str(steps.TABLE), "drive.acceleration": step.level * steps.G},
        )
        amplitude = result.measures["relative_displacement_amplitude"].value / steps.MIL
        peak = result.measures["absolute_acceleration_peak"].value / steps.G
        assert step.gauge == pytest.approx(
            amplitude, abs=5e-3
        ) and step.acceleration == pytest.approx(peak, rel=0.02)


@pytest.mark.slow
def test_steps_give_stated_gain_and_scores(tmp_path, capsys):
    """The gain, its interval and the scores of the stepped levels are those stated in the study."""
    steps = load_study("report/steps.py")
    found, fits = steps.main(tmp_path / "x.svg")
    all_steps = [step for row in found.values() for step in row]
    stable = [
        np.log(step.read[1] / step.gauge)
        for step in all_steps
        if step.read[1] and not step.unstable
    ]
    assert_contains(steps.ANSWER, f"are {np.exp(np.mean(stable)):.2f} times")
    gain, (low, high) = fits[True].fit.values[3], fits[True].fit.intervals.ends[3]
    assert_contains(steps.ANSWER, f"{gain:.2f} ({low:.2f} to {high:.2f})")
    for part, words in (
        ("fitted", "143 Hz ({:.3f} instead of {:.3f})"),
        ("held_out", "other frequencies ({:.3f} instead of {:.3f})"),
    ):
        scores = [
            fits[free].comparison.compute_scores(fits[free])[part]["all"] for free in (True, False)
        ]
        assert_contains(steps.ANSWER, words.format(*scores))
    for row in found.values():
        *first, last = [f"{step.gauge:.3f}" for step in row]
        assert_contains(steps.__doc__, f"{', '.join(first)} and {last} V")
    assert steps.ANSWER in capsys.readouterr().out


def test_always_friction_off_the_axis_causes_runaway_at_135_hz():
    """At 7.25 g grooves alone are stable; with 0.30 radii of gyration of yaw they run away at 135 Hz."""
    study = load_study("report/runaways.py")
    for name, expected in (("grooves", [False, False]), ("grooves, yaw 0.30", [True, False])):
        assert [study.motion(name, f, 7.25)[0] for f in (135.0, 143.0)] == expected


@pytest.mark.slow
def test_runaways_have_stated_levels(tmp_path, capsys):
    """The levels of runaway of all load paths are those stated in the study."""
    study = load_study("report/runaways.py")
    rows = {row.name: row for row in study.main(tmp_path / "x.svg")}
    near = rows["grooves, yaw 0.25"]
    far = rows["grooves, yaw 0.30"]
    assert_contains(
        study.ANSWER,
        f"{near.levels[0]:.1f} to {far.levels[0]:.1f} g at 135",
        f"{far.levels[1]} to {near.levels[1]} g at 143",
        f"moves by {near.before[1]:.1f} to {far.before[1]:.1f} mil",
    )
    assert near.levels[2:] == far.levels[2:] == (8.0, 8.0)
    assert_contains(
        study.__doc__,
        "Grooves leave at " + ", ".join(f"{level}" for level in rows["grooves"].levels),
    )
    difference = {name: row.levels[0] - row.levels[1] for name, row in rows.items()}
    quarter = [
        name
        for name in rows
        if name.startswith("grooves")
        and name
        not in (
            "grooves worn to 10 um",
            "grooves, yaw 0.25",
            "grooves, yaw 0.30",
            "grooves, yaw 0.30 at 150 Hz",
        )
    ]
    assert len(quarter) == 6 and all(difference[name] == 0.25 for name in quarter)
    # at 143 Hz this motion is chaotic from 6.6 g on, and its slip is close to the limit of 2 mil
    assert abs(difference["grooves worn to 10 um"]) <= 0.25
    assert difference["interlocking spring"] == 0.5
    assert difference["softening spring"] == 0.25 and difference["second interface that slips"] == 0
    alone = rows["friction alone"].levels
    aside = rows["grooves, yaw 0.30 at 150 Hz"].levels
    assert alone == tuple(sorted(alone)) and alone[0] == 5.25 and alone[3] - alone[0] == 0.5
    assert min(aside) == aside[2] == 4.0
    assert not study.motion("grooves", 135.0, 8.0)[0]
    assert not study.motion("grooves, yaw 0.09", 135.0, 8.0)[0]
    # the levels are the same after 400 cycles
    for level, expected in ((5.75, False), (6.25, True)):
        assert (
            study.motion("grooves, yaw 0.30", 135.0, level, **{"drive.cycles": 400})[0] == expected
        )
    assert study.ANSWER in capsys.readouterr().out


@pytest.mark.slow
def test_engaged_contact_gives_stated_peaks_and_coherence(tmp_path, capsys):
    """Peaks of yaw and rocking and the mean coherence are those stated in the study."""
    engaged = load_study("report/engaged.py")
    turns, tests = engaged.main(tmp_path / "x.svg")
    peak = {(one.mode, one.touch, one.level): one.peak for one in turns}
    left = {
        key: value / peak[key[0], "one point on the axis", key[2]] for key, value in peak.items()
    }
    one = left["yaw", "a patch of 12.7 mm", 5.0]
    two = left["yaw", "a patch of 35 mm", 5.0]
    assert_contains(
        engaged.ANSWER,
        f"{one:.2f} with a patch of 12.7 mm",
        f"{two:.2f} with a patch of 35 mm",
    )
    assert_contains(
        engaged.__doc__,
        f"leaves {left['yaw', 'one point off it', 5.0]:.2f} of yaw",
        "Rocking falls below 0.0005 of its peak",
        f"leaves {left['rocking', 'one point off it', 5.0]:.2f} of it",
    )
    # the remaining rocking differs by a factor of 2 between records and steps of time
    assert left["rocking", "a patch of 12.7 mm", 5.0] < 5e-4
    more = [
        [
            engaged.random_turn("yaw", touch, 5.0, seed=seed).peak
            / engaged.random_turn("yaw", "one point on the axis", 5.0, seed=seed).peak
            for seed in (2, 3)
        ]
        for touch in ("a patch of 12.7 mm", "a patch of 35 mm")
    ]
    assert_contains(
        engaged.__doc__,
        *[f"{min(found):.2f} to {max(found):.2f}" for found in ([one, *more[0]], [two, *more[1]])],
    )
    coherent = {model: seen.coherence.mean() for model, (_, _, seen) in tests.items()}
    assert_contains(
        engaged.ANSWER,
        f"mean is {coherent['grooves']:.2f} to {coherent['rigid block']:.2f} if friction",
    )
    assert f"{coherent['second path']:.2f}" == "0.99" and coherent["a damper as in Fig. 27"] > 0.99
    springs = [
        tests[engaged.SPRING],
        *(
            engaged.fit_damping(engaged.SPRING, engaged.CRITICAL[engaged.SPRING], seed=seed)
            for seed in (2, 3, 4)
        ),
    ]
    f, damping = ([one[k] for one in springs] for k in (0, 1))
    assert_contains(
        engaged.__doc__,
        f"{min(f):.0f} to {max(f):.0f} Hz and {min(damping):.2f} to {max(damping):.2f} of critical",
        f"a coherence of {coherent[engaged.SPRING]:.2f}",
    )
    # stiffness of "spring and yaw" in studies/table_1, divided by that of the flexures
    fitted = 5.1e6 / (1.19396625 * (2 * np.pi * 143) ** 2)
    assert fitted / engaged.SHARE == pytest.approx(
        7, abs=0.2
    ) and engaged.SHARE / 0.0711 == pytest.approx(10, abs=0.6)
    f, damping, _ = tests[engaged.DAMPER]
    assert_contains(engaged.__doc__, f"has {damping:.1f} of critical damping at {f:.0f} Hz")
    assert engaged.ANSWER in capsys.readouterr().out
