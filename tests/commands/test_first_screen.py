"""What a run says: the verdict first, numbers as people read them, nothing where it is to be quiet."""

import json
import re
import shlex
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import cli
from scene_texts import BENCH, JOINT_SHAKEN, POINT

import patchfem as pf
from patchfem.__main__ import VERB_GROUPS, app, register_verbs
from patchfem.commands import shared
from patchfem.core import Measure, Outcome
from patchfem.export.pages.sentences import (
    EXACT_NOTE,
    GROUPS,
    format_measures,
    format_with_error,
    format_zero,
    headline_sentence,
    measure_group,
    tolerance_sentence,
    verdict_sentence,
)
from patchfem.export.summary import loop_entry
from patchfem.response.outcome import OPEN_LOOP
from patchfem.response.rows import ROWS as MOTION
from patchfem.runs.results.patch_rows import ROWS as STATIC
from patchfem.scene.keys.quantities import UNIT_FACTORS
from patchfem.scene.starting import read_template

UNIT = {"g": 9.80665, "%": 0.01, "deg": UNIT_FACTORS["angle"]["deg"]}


def run(tmp_path, kind, *words, **keys):
    path = tmp_path / f"{kind}.toml"
    path.write_text(read_template(kind), "utf-8")
    sets = [
        word
        for key, value in keys.items()
        for word in ("--set", f"{key.replace('__', '.')}={value}")
    ]
    return cli("run", path, "-o", tmp_path / "out", "--no-page", *sets, *words)


def in_si(text: str) -> float:
    """The value of a text such as 14.80 ± 0.05 um."""
    number, _, unit = re.fullmatch(r"(\S+)( ± \S+)?(?: (\S.*))?", text.split(", ")[0]).groups()
    known = {
        name: scale
        for units in UNIT_FACTORS.values()
        for name, scale in units.items()
        if name != "g"
    } | UNIT
    return float(number) * known.get(
        unit, {"mJ": 1e-3, "uJ": 1e-6, "J": 1.0, "mN": 1e-3, None: 1.0}.get(unit, 1.0)
    )


def test_exact_the_numbers_are_those_of_the_summary(tmp_path):
    """Each within what its last digit hides; the title, the outcome and the headline stand above the groups."""
    answer = run(tmp_path, "rig")
    lines = answer.out.splitlines()
    measures = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["measures"]
    assert lines[0] == "A rubbing block on flexures, shaken at one frequency"
    assert lines[1] == f"steady: {Outcome.STEADY.sentence}"
    amplitude = format_with_error(
        "relative_displacement_amplitude", measures["relative_displacement_amplitude"]
    )
    assert lines[2].startswith(
        f"Displacement amplitude at the output {amplitude} (half peak-to-peak); peak acceleration "
    )
    assert (
        lines[3] == f"Every measure with an error estimate meets the tolerance 0.001; {EXACT_NOTE}."
    )
    shown = dict(line.split(None, 1) for line in lines if line.startswith("  "))
    assert set(shown) == set(measures)
    for name, text in shown.items():
        one = measures[name]
        if one["value"] is None:
            assert text == f"- ({one['reason']})"
            continue
        assert in_si(text) == pytest.approx(
            one["value"], rel=1e-5, abs=max((one["error"] or 0) / 10, format_zero(name))
        )
    assert [line for line in lines if line in GROUPS] == ["motion", "friction", "energy"]


def test_always_every_measure_has_its_group():
    assert {row.group for row in (*MOTION, *STATIC)} == set(GROUPS)
    assert (
        measure_group("normal_load") == "patch"
        and measure_group("normal_load", pressed=False) == "friction"
    )
    assert (
        measure_group("pressure_peak") == "patch"
        and measure_group("slip_amplitude_2") == "friction"
    )
    assert (
        measure_group("worn_volume") == "wear"
        and measure_group("loop_area") == "energy"
        and measure_group("level_9") == "motion"
    )
    found = {"value": 1.0, "unit": "1", "error": None}
    assert format_measures({"loop_area": found | {"reason": "stuck"}, "pressure_peak": found}) == [
        "energy",
        "  loop_area      - (stuck)",
        "patch",
        "  pressure_peak  1 (error unknown)",
    ]


def test_always_what_misses_the_tolerance_is_said_before_the_table(tmp_path):
    answer = run(tmp_path, "bench", accuracy__steps_per_cycle=100)
    # empty caches
    said = [
        line for line in answer.err.splitlines() if not line.startswith("compiling the code of")
    ]
    assert said[0].startswith("warning: ") and "set accuracy.steps_per_cycle = " in answer.err
    assert "meets the tolerance" not in answer.out


@pytest.mark.parametrize("words, out", [(("-q",), ""), (("-q", "--json"), "{")])
def test_exact_a_quiet_run_says_nothing(tmp_path, words, out):
    answer = run(tmp_path, "bench", *words)
    assert answer.code == 0 and answer.err == "" and answer.out[:1] == out
    assert (tmp_path / "out" / "summary.json").is_file()


def test_exact_progress_as_lines(capsys):
    """One line in ten seconds at most, with what is left at the pace since the first share: 15 % in 3 s. The 8 s
    before it, in which something compiles, would make 33 s of the 15 that are left."""
    times = iter([0.0, 8.0, 11.0, 15.0, 40.0])
    lines = shared.Lines(lambda: next(times))
    for share in (0.1, 0.25, 0.3, 1.0):
        lines(share)
    assert capsys.readouterr().err == "25% done, about 15 s left\n100% done, about 0 s left\n"


def test_always_the_first_screen_has_an_example_of_every_verb_that_is_read():
    screen = cli().out
    assert screen == cli("--help").out and max(map(len, screen.splitlines())) <= 80
    assert [line for line in screen.splitlines() if line in VERB_GROUPS] == [
        "Start",
        "Study",
        "Surfaces",
        "Files",
        "About",
    ]
    for verb, (_, what, example) in (
        (verb, row) for verbs in VERB_GROUPS.values() for verb, row in verbs.items()
    ):
        register_verbs([verb])
        assert f"  patchfem {verb} {example}".rstrip() in screen and what in screen
        read = app.parse_args(
            [verb, *shlex.split(example)], exit_on_error=False, print_error=False
        )[0]
        assert read.__name__.rstrip("_") == verb


def test_always_a_plan_says_what_does_not_run_where_it_is_asked(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(read_template("rig"), "utf-8")
    short = cli("plan", path).out
    long = cli("plan", path, "-v").out
    assert (
        "\nabsent" not in short
        and long.startswith(short)
        and "\nabsent" in f"\n{long[len(short) :]}"
    )
    assert "friction.law=iwan" in long[len(short) :]
    assert "N/mm -> " in short and "the largest force of the drive" in short and "e+0" not in short


@pytest.mark.parametrize(
    "cycles, text",
    [
        (None, "Friction ratio peaks at 0.3; 2.00 ± 0.10 mJ dissipated per cycle."),
        (0.4, "In 0.4 of a cycle friction ratio peaks at 0.3."),
    ],
)
def test_exact_a_headline(cycles, text):
    measures = {
        "friction_ratio_peak": {"value": 0.3, "unit": "1", "error": None},
        "loop_area": {"value": 2e-3, "unit": "J", "error": 1e-4},
    }
    assert (
        headline_sentence({"kind": "bench", "outcome": "done", "measures": measures}, cycles)
        == text
    )


@pytest.mark.parametrize(
    "worn, text",
    [
        (
            {"worn_depth_max": (2.58e-7, 1e-9, "m"), "worn_volume": (1e-12, 1e-14, "m3")},
            "258.0 ± 1.0 nm worn off at the deepest place; 2.00 ± 0.10 mJ dissipated per cycle.",
        ),
        (
            {"worn_volume": (2.0, 0.1, "kg")},
            "2.00 ± 0.10 kg worn off; 2.00 ± 0.10 mJ dissipated per cycle.",
        ),
    ],
)
def test_exact_a_worn_run_answers_with_what_was_worn(worn, text):
    found = {"loop_area": (2e-3, 1e-4, "J"), **worn}
    measures = {
        name: {"value": value, "unit": unit, "error": error}
        for name, (value, error, unit) in found.items()
    }
    assert (
        headline_sentence({"kind": "bench", "outcome": "done", "measures": measures}, 2.0) == text
    )


def tolerance_said(tolerance=1e-2, **measures):
    """The sentence of a run with these measures."""
    plan = SimpleNamespace(model=SimpleNamespace(accuracy=SimpleNamespace(tolerance=tolerance)))
    return tolerance_sentence(SimpleNamespace(plan=plan, measures=measures, outcome=Outcome.STEADY))


def test_exact_a_level_between_two_others_does_not_claim_the_tolerance():
    """A jump at 5 g between levels 2 g apart; all that the tolerance steers is known to it."""
    jump = Measure(5 * 9.80665, "m s-2", 9.80665, 9.80665)
    fine = Measure(2.0, "J", 1e-2)
    between = " (jump_level: one step between the drive levels of the scene)"
    least = "0.005 of the value (loop_area, 2.000 ± 0.010 J)."
    meets = "Every measure with an error estimate meets the tolerance 0.01"
    assert (
        tolerance_said(jump_level=jump, loop_area=fine)
        == f"{meets}{between}; the largest of the other errors is {least}"
    )
    assert tolerance_said(jump_level=jump) == f"{meets}{between}."
    assert tolerance_said(loop_area=fine) == f"{meets}; the largest error is {least}"
    assert tolerance_said(jump_level=jump, loop_area=Measure(2.0, "J", 1.0)) == ""


def test_exact_a_limit_that_is_no_part_of_the_value_is_said_with_its_measure():
    """A phase of 4.2 deg is known to 2.1 % of itself and to .05 % of the 180 deg that it may take."""
    phase = Measure(0.0729, "rad", 0.0015, 0.0324)
    stick = Measure(0.06977, "1", 0.00070, 0.011)
    drift = Measure(2e-6, "m", 5e-7, 1e-6)
    loaded = Measure(0.0862, "1", 0.00075)
    said = tolerance_said(slip_start_phase=phase, stick_fraction=stick, loaded_fraction=loaded)
    assert said == (
        "Every measure with an error estimate meets the tolerance 0.01 (slip_start_phase: 0.01 of its range of "
        "180 deg; stick_fraction: 0.01 of its range of 100 %); the largest of the other errors is 0.0087 of the value "
        "(loaded_fraction, 8.620 ± 0.075 %)."
    )
    assert (
        "(" not in tolerance_said(0.05, slip_start_phase=phase, stick_fraction=stick).split(";")[0]
    )
    assert "(drift_per_cycle: 1.02 um)" in tolerance_said(drift_per_cycle=drift)
    # a floor of 1e-3 in radians is more than 1e-4 of the range: the limit itself is printed
    assert "(slip_start_phase: 0.0578 deg)" in tolerance_said(
        1e-4, slip_start_phase=Measure(0.0729, "rad", 9e-4, 1.001e-3)
    )


def test_exact_the_largest_error_is_that_of_a_value_that_a_reader_sees():
    """Not the one that a floor holds, nor one that reads 0."""
    small = Measure(1.0, "J", 2e-3, 0.0)
    large = Measure(1.0, "N", 8e-3, 1.0)
    said = tolerance_said(
        loop_area=small, friction_force_peak=large, moment=Measure(1e-12, "N m", 5e-3, 1e-2)
    )
    assert (
        "; the largest error is 0.008 of the value (friction_force_peak, 1.0000 ± 0.0080 N)" in said
    )
    assert "moment" not in said and EXACT_NOTE not in said.split(";")[0]
    unknown = tolerance_said(
        loop_area=Measure(1.0, "J", 0.0), friction_work=Measure(1.0, "J", None)
    )
    assert unknown.endswith(f"; {EXACT_NOTE}, except where the error is unknown.")


@pytest.mark.parametrize(
    "more, part",
    [({}, "part of it slips"), ({"contact_fraction": (1.0, 0.0, "1")}, "part of the patch slips")],
)
def test_always_what_slips_while_the_interface_holds_is_said(more, part):
    """By its work per cycle beyond what the run leaves open and beyond round-off, else by its slip."""

    def said(loop, slip):
        found = {
            "loop_area": (*loop, "J"),
            "slip_amplitude": (*slip, "m"),
            "friction_force_peak": (100.0, 0.0, "N"),
            "relative_displacement_amplitude": (4e-7, 0.0, "m"),
            **more,
        }
        return verdict_sentence(
            {
                "outcome": "stuck",
                "kind": "rig",
                "measures": {
                    name: {"value": value, "error": error, "unit": unit, "floor": 1e-10}
                    for name, (value, error, unit) in found.items()
                },
            }
        )

    holds = "The interface sticks: no slip in the last cycles" + (
        " beyond the error of this mesh; a slip zone smaller than an element cannot be detected."
        if more
        else "."
    )
    assert (
        said((1.6583e-6, 1.6e-9), (1e-9, 1e-12))
        == f"The interface as a whole sticks, but {part} (1.6583 ± 0.0016 uJ per cycle)."
    )
    assert (
        said((1e-9, 2e-9), (1e-9, 1e-12))
        == f"The interface as a whole sticks, but {part} (by 1.0000 ± 0.0010 nm)."
    )
    assert said((1e-9, 2e-9), (1e-9, 2e-9)) == holds
    assert said((1e-18, 0.0), (0.0, 0.0)) == holds  # round-off of 100 N over 400 nm
    assert said((-3e-12, 1e-12), (None, None)) == holds
    assert (
        said((1e-9, None), (0.0, None))
        == f"The interface as a whole sticks, but {part} (1 nJ per cycle)."
    )


def test_always_a_joint_that_slips_in_part_does_not_say_that_it_holds(tmp_path):
    """A tilted joint bears on a hundredth of its length, and slips in a part of that."""
    scene = tmp_path / "joint.toml"
    scene.write_text(JOINT_SHAKEN + '[contact.tilt]\nangle = "10 mrad"\n', "utf-8")
    answer = cli(
        "run", scene, "-o", tmp_path / "out", "--no-page", "--set", "accuracy.tolerance=1e-2"
    )
    lines = answer.out.splitlines()
    assert re.match(
        r"stuck: The interface as a whole sticks, .* the patch slips \(1\.6\S+ ± \S+ uJ per "
        r"cycle\)\.",
        lines[0],
    )
    shown = dict(line.split(None, 1) for line in lines if line.startswith("  "))
    assert shown["stick_fraction"].endswith("of the interface as a whole")
    assert shown["loop_area"].endswith("uJ, per cycle")
    assert shown["energy_dissipated"].endswith("uJ, over the whole run")
    assert "the whole interface sticks" in shown["slip_start_phase"]


def test_always_a_bench_says_whether_it_slipped():
    """By its mean slip, beyond what the run leaves open and the last digits of a slide."""

    def said(value, error):
        return verdict_sentence(
            {
                "outcome": "done",
                "kind": "bench",
                "measures": {
                    "slip_amplitude": {"value": value, "error": error, "unit": "m", "floor": 1e-10}
                },
            }
        )

    done = Outcome.DONE.sentence
    stiffness = {
        "equivalent_stiffness": {"value": 2e6, "error": 2e3, "unit": "N m-1", "floor": 1.0}
    }

    def looped(factor, error):
        return verdict_sentence(
            {
                "outcome": "done",
                "kind": "bench",
                "measures": stiffness,
                "loop": {"slide_amplitude": 2e-6, "loss_factor": factor, "error": error},
            }
        )

    assert looped(0.5, 0.01) == (
        "At a slide amplitude of 2 um the interface has an equivalent stiffness of 2.0000 ± 0.0020 N/um and a loss "
        "factor of 0.500 ± 0.010 (equivalent damping ratio 0.2500 ± 0.0050)."
    )
    assert "a loss factor of at most 0.03 (equivalent damping ratio at most 0.015)." in looped(
        0.01, 0.02
    )
    assert (
        said(1.5e-6, 1e-9)
        == f"{done} Slip amplitude (half the peak-to-peak slip, averaged over the interface): 1.5000 ± 0.0010 um."
    )
    for holds in ((1e-12, 2e-12), (1e-23, 1e-33), (1e-11, None)):
        assert said(*holds) == f"{done} The interface sticks: no slip in the last cycle."
    assert verdict_sentence({"outcome": "done", "kind": "bench", "measures": {}}) == done


def test_exact_the_loss_factor_of_an_elastic_plastic_bench():
    """Of a parallelogram of force mu N, stiffness k and slide A: W = 4 mu N (A - mu N/k), and the first harmonic of the
    force in phase with the slide is k A (a - sin(a) cos(a))/pi with cos(a) = 1 - 2 mu N/(k A)."""
    law = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nstiffness = "10 N/um"\n'
    result = pf.run(
        POINT
        + law
        + '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\ncycles = 2\n'
    )
    slide = result.plan.model.slide.amplitude
    pull = result.plan.model.friction.static * result.measures["normal_load"].value
    k = 1e7
    a = np.arccos(1 - 2 * pull / (k * slide))
    work = 4 * pull * (slide - pull / k)
    stiffness = k * (a - np.sin(a) * np.cos(a)) / np.pi
    found = loop_entry(result)["loop"]
    truth = work / (np.pi * stiffness * slide**2)
    assert (
        abs(found["loss_factor"] - truth) <= found["error"] + 1e-9 * truth
        and found["error"] < 1e-2 * truth
    )
    assert loop_entry(pf.run(BENCH)) == {}  # rigid: no stiffness to refer to


def test_always_a_ratio_written_as_per_cent_is_remarked(tmp_path):
    """Half of critical and more: a mode that hardly swings."""
    path = tmp_path / "rig.toml"
    path.write_text(read_template("rig"), "utf-8")
    said = [
        cli("check", path, "--set", f"structure.mode.axial.damping={value}")
        for value in ("0.49", "0.5", "1")
    ]
    assert [one.code for one in said] == [0, 0, 0] and said[0].err == ""
    assert said[1].err.endswith(
        "structure.mode.axial.damping = 0.5 is a damping ratio: 1 means critical damping, and "
        "1 % is written 0.01\n"
    )
    assert "damping = 1 is a damping ratio: 1 means critical" in said[2].err


def test_exact_a_second_interface_reads_in_the_units_of_the_first():
    one = {"value": 1.0, "error": 0.0, "unit": "1"}
    assert (
        format_with_error("stick_fraction_2", one)
        == format_with_error("stick_fraction", one)
        == "100 %"
    )


@pytest.mark.parametrize(
    "kind, outcome, warnings, text",
    [
        ("rig", "steady", [], "2.00 ± 0.10 mJ dissipated per cycle."),
        ("rig", "transient", [], "2.00 ± 0.10 mJ dissipated per cycle (mean of the last cycles)."),
        (
            "bench",
            "done",
            [f"{OPEN_LOOP}: it misses"],
            "Friction work of the last cycle 2.00 ± 0.10 mJ.",
        ),
    ],
)
def test_exact_the_work_of_a_loop_that_changes_is_told_with_its_cycles(
    kind, outcome, warnings, text
):
    measures = {"loop_area": {"value": 2e-3, "unit": "J", "error": 1e-4}}
    summary = {
        "kind": kind,
        "outcome": outcome,
        "measures": measures,
        "warnings": warnings,
        "effects": [],
    }
    assert headline_sentence(summary, 10.0) == text


@pytest.mark.parametrize(
    "outcome, there",
    [
        (Outcome.GROWS, "after 2 s: the measures describe its last cycles"),
        (Outcome.STEADY, "meets the tolerance"),
    ],
)
def test_exact_a_motion_that_grows_claims_no_tolerance(outcome, there):
    plan = SimpleNamespace(model=SimpleNamespace(accuracy=SimpleNamespace(tolerance=1e-2)))
    load = Measure(1.0, "N", 0.0, 0.0)
    said = tolerance_sentence(
        SimpleNamespace(
            plan=plan,
            measures={"normal_load": load},
            outcome=outcome,
            response=SimpleNamespace(time=[0.0, 2.0]),
        )
    )
    assert there in said and ("tolerance" in said) == (outcome is Outcome.STEADY)


def test_exact_a_release_is_not_told_of_a_drive():
    summary = {
        "kind": "rig",
        "outcome": "transient",
        "measures": {},
        "effects": [{"effect": "drive.kind=free"}],
    }
    assert "drive is periodic" not in verdict_sentence(
        summary
    ) and "came to rest" in verdict_sentence(summary)
