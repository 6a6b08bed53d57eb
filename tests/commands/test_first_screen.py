"""Output of a run: the verdict first, rounded numbers in readable units, and no output with -q."""

import json
import re
import shlex
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import BENCH, JOINT_SHAKEN, POINT

import patchfem as pf
from patchfem.__main__ import VERB_GROUPS, app, register_verbs
from patchfem.commands import shared
from patchfem.core import Measure, Outcome
from patchfem.export import headline_sentence, tolerance_sentence, verdict_sentence
from patchfem.export.pages.sentences import (
    EXACT_NOTE,
    GROUPS,
    format_with_error,
    format_zero,
)
from patchfem.export.summary import loop_entry
from patchfem.response import OPEN_LOOP
from patchfem.scene import UNIT_FACTORS, read_template

UNIT = {"g": 9.80665, "%": 0.01, "deg": UNIT_FACTORS["angle"]["deg"]}


def make_entry(value, error=None, unit="1", **more) -> dict:
    """Return a measure as the summary of a run stores it."""
    return {"value": value, "error": error, "unit": unit, **more}


def make_summary(kind="bench", outcome="done", measures=(), **more) -> dict:
    """Return the parts of a summary that a verdict uses."""
    return {"kind": kind, "outcome": outcome, "measures": dict(measures), **more}


def run_template(tmp_path, kind, *words, **keys):
    """Run the template of a kind of scene with settings, and return the answer."""
    path = tmp_path / f"{kind}.toml"
    path.write_text(read_template(kind), "utf-8")
    sets = [
        word
        for key, value in keys.items()
        for word in ("--set", f"{key.replace('__', '.')}={value}")
    ]
    return run_cli("run", path, "-o", tmp_path / "out", "--no-page", *sets, *words)


def parse_quantity(text: str) -> float:
    """Return the value [SI] of a text such as "14.80 ± 0.05 um"."""
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


def test_exact_printed_measures_equal_summary(tmp_path):
    """The printed measures equal those of the summary within their last digit, below title, outcome and headline."""
    answer = run_template(tmp_path, "rig")
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
        measure = measures[name]
        if measure["value"] is None:
            assert text == f"- ({measure['reason']})"
            continue
        assert parse_quantity(text) == pytest.approx(
            measure["value"], rel=1e-5, abs=max((measure["error"] or 0) / 10, format_zero(name))
        )
    assert [line for line in lines if line in GROUPS] == ["motion", "friction", "energy"]


def test_always_missed_tolerance_gives_warning(tmp_path):
    """A measure that misses the tolerance gives a warning with the setting to change."""
    answer = run_template(tmp_path, "bench", accuracy__steps_per_cycle=100)
    # with an empty cache, a line on compilation comes first
    messages = [
        line for line in answer.err.splitlines() if not line.startswith("compiling the code of")
    ]
    assert messages[0].startswith("warning: ") and "set accuracy.steps_per_cycle = " in answer.err
    assert "meets the tolerance" not in answer.out


@pytest.mark.parametrize("words, out", [(("-q",), ""), (("-q", "--json"), "{")])
def test_exact_quiet_run_prints_nothing(tmp_path, words, out):
    """A run with -q prints nothing, or only its JSON, and writes its files."""
    answer = run_template(tmp_path, "bench", *words)
    assert answer.code == 0 and answer.err == "" and answer.out[:1] == out
    assert (tmp_path / "out" / "summary.json").is_file()


def test_exact_progress_lines_estimate_remaining_time(capsys):
    """Progress lines are at least ten seconds apart and estimate the remaining time.

    The rate is measured from the first reported fraction: 15 % in 3 s, without the 8 s of
    compilation before.
    """
    times = iter([0.0, 8.0, 11.0, 15.0, 40.0])
    lines = shared.ProgressLines(lambda: next(times))
    for fraction in (0.1, 0.25, 0.3, 1.0):
        lines(fraction)
    assert capsys.readouterr().err == "25% done, about 15 s left\n100% done, about 0 s left\n"


def test_always_help_has_valid_example_of_every_command():
    """The help lists every command with an example that can be parsed, in lines of at most 80 characters."""
    screen = run_cli().out
    assert screen == run_cli("--help").out and max(map(len, screen.splitlines())) <= 80
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


LOOP = {"loop_area": make_entry(2e-3, 1e-4, "J")}
RATIO = {"friction_ratio_peak": make_entry(0.3)}
DEPTH = {
    "worn_depth_max": make_entry(2.58e-7, 1e-9, "m"),
    "worn_volume": make_entry(1e-12, 1e-14, "m3"),
}
HEADLINES = [  # summary of a run, number of cycles, expected headline
    (
        make_summary(measures=RATIO | LOOP),
        None,
        "Friction ratio peaks at 0.3; 2.00 ± 0.10 mJ dissipated per cycle.",
    ),
    (
        make_summary(measures=LOOP | DEPTH),
        2.0,
        "258.0 ± 1.0 nm worn off at the deepest place; 2.00 ± 0.10 mJ dissipated per cycle.",
    ),
    (
        make_summary("rig", "transient", LOOP),
        10.0,
        "2.00 ± 0.10 mJ dissipated per cycle (mean of the last cycles).",
    ),
    (
        make_summary(measures=LOOP, warnings=[f"{OPEN_LOOP}: it misses"]),
        10.0,
        "Friction work of the last cycle 2.00 ± 0.10 mJ.",
    ),
]


@pytest.mark.parametrize("summary, cycles, headline", HEADLINES)
def test_exact_headline_of_summary(summary, cycles, headline):
    """The headline sentence of each summary is the expected one."""
    assert headline_sentence({"warnings": [], "effects": []} | summary, cycles) == headline


def tolerance_text(tolerance=1e-2, outcome=Outcome.STEADY, **measures):
    """Return the sentence on the tolerance for a run of 2 s with these measures."""
    plan = SimpleNamespace(model=SimpleNamespace(accuracy=SimpleNamespace(tolerance=tolerance)))
    response = SimpleNamespace(time=[0.0, 2.0])
    return tolerance_sentence(
        SimpleNamespace(plan=plan, measures=measures, outcome=outcome, response=response)
    )


def test_exact_largest_error_belongs_to_visible_value():
    """The largest relative error in the sentence belongs to a measure above its floor."""
    small = Measure(1.0, "J", 2e-3, 0.0)
    large = Measure(1.0, "N", 8e-3, 1.0)
    said = tolerance_text(
        loop_area=small, friction_force_peak=large, moment=Measure(1e-12, "N m", 5e-3, 1e-2)
    )
    assert (
        "; the largest error is 0.008 of the value (friction_force_peak, 1.0000 ± 0.0080 N)" in said
    )
    assert "moment" not in said and EXACT_NOTE not in said.split(";")[0]
    unknown = tolerance_text(
        loop_area=Measure(1.0, "J", 0.0), friction_work=Measure(1.0, "J", None)
    )
    assert unknown.endswith(f"; {EXACT_NOTE}, except where the error is unknown.")


@pytest.mark.parametrize(
    "more, part, limit",
    [
        ({}, "it", "."),
        (
            {"contact_fraction": make_entry(1.0, 0.0)},
            "the patch",
            " beyond the error of this mesh; a slip zone smaller than an element cannot be detected.",
        ),
    ],
)
@pytest.mark.parametrize(
    "loop, slip, said",
    [
        ((1.6583e-6, 1.6e-9), (1e-9, 1e-12), "1.6583 ± 0.0016 uJ per cycle"),
        ((1e-9, 2e-9), (1e-9, 1e-12), "by 1.0000 ± 0.0010 nm"),
        ((1e-9, 2e-9), (1e-9, 2e-9), ""),
        ((1e-18, 0.0), (0.0, 0.0), ""),
    ],
)
def test_always_partial_slip_is_reported(loop, slip, said, more, part, limit):
    """Partial slip of a sticking interface is reported by its work per cycle or its slip.

    Each counts if it exceeds its error estimate.
    """
    measures = {
        "loop_area": make_entry(*loop, "J", floor=1e-10),
        "slip_amplitude": make_entry(*slip, "m", floor=1e-10),
        "friction_force_peak": make_entry(100.0, 0.0, "N", floor=1e-10),
        "relative_displacement_amplitude": make_entry(4e-7, 0.0, "m", floor=1e-10),
        **more,
    }
    sentence = f"The interface as a whole sticks, but part of {part} slips ({said})."
    if not said:
        sentence = f"The interface sticks: no slip in the last cycles{limit}"
    assert verdict_sentence(make_summary("rig", "stuck", measures)) == sentence


def test_always_tilted_joint_reports_partial_slip(tmp_path):
    """A tilted joint that touches over a hundredth of its length is reported as stuck with partial slip."""
    scene = tmp_path / "joint.toml"
    scene.write_text(JOINT_SHAKEN + '[contact.tilt]\nangle = "10 mrad"\n', "utf-8")
    answer = run_cli(
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


STIFFNESS = {"equivalent_stiffness": make_entry(2e6, 2e3, "N m-1", floor=1.0)}
STICKS = f"{Outcome.DONE.sentence} The interface sticks: no slip in the last cycle."


@pytest.mark.parametrize(
    "slip, sentence",
    [
        (
            (1.5e-6, 1e-9),
            f"{Outcome.DONE.sentence} Slip amplitude (half the peak-to-peak slip, averaged over the interface): "
            "1.5000 ± 0.0010 um.",
        ),
        ((1e-12, 2e-12), STICKS),
        ((1e-11, None), STICKS),
        (None, Outcome.DONE.sentence),
    ],
)
def test_always_bench_reports_stick_or_slip(slip, sentence):
    """A bench is reported as sticking if its mean slip is below its error or the round-off of the slide."""
    measures = {"slip_amplitude": make_entry(*slip, "m", floor=1e-10)} if slip else {}
    assert verdict_sentence(make_summary(measures=measures)) == sentence


@pytest.mark.parametrize(
    "factor, error, said",
    [
        (0.5, 0.01, "of 0.500 ± 0.010 (equivalent damping ratio 0.2500 ± 0.0050)."),
        (0.01, 0.02, "of at most 0.03 (equivalent damping ratio at most 0.015)."),
    ],
)
def test_exact_bench_verdict_gives_loss_factor(factor, error, said):
    """The verdict on a bench with a stiffness gives amplitude, equivalent stiffness and loss factor."""
    loop = {"slide_amplitude": 2e-6, "loss_factor": factor, "error": error}
    assert verdict_sentence(make_summary(measures=STIFFNESS, loop=loop)) == (
        "At a slide amplitude of 2 um the interface has an equivalent stiffness of 2.0000 ± 0.0020 N/um and a loss "
        f"factor {said}"
    )


def test_exact_loss_factor_agrees_with_parallelogram_loop():
    """The loss factor of an elastic-plastic bench agrees with the closed form of its loop within its error.

    For a parallelogram of force mu N, stiffness k and slide A, the work is W = 4 mu N (A - mu N/k);
    the first harmonic of the force in phase with the slide is k A (a - sin(a) cos(a))/pi with
    cos(a) = 1 - 2 mu N/(k A).
    """
    law = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nstiffness = "10 N/um"\n'
    result = pf.run(
        POINT
        + law
        + '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\ncycles = 2\n'
    )
    slide = result.plan.model.slide.amplitude
    friction_limit = result.plan.model.friction.static * result.measures["normal_load"].value
    k = 1e7
    a = np.arccos(1 - 2 * friction_limit / (k * slide))
    work = 4 * friction_limit * (slide - friction_limit / k)
    stiffness = k * (a - np.sin(a) * np.cos(a)) / np.pi
    found = loop_entry(result)["loop"]
    truth = work / (np.pi * stiffness * slide**2)
    assert abs(found["loss_factor"] - truth) <= found["error"] + 1e-9 * truth
    assert found["error"] < 1e-2 * truth
    assert (
        loop_entry(pf.run(BENCH)) == {}
    )  # a rigid bench has no stiffness to which a loss factor could refer


def test_always_large_damping_ratio_gives_note(tmp_path):
    """A damping ratio of 0.5 or more gives a note that 1 means critical damping."""
    path = tmp_path / "rig.toml"
    path.write_text(read_template("rig"), "utf-8")
    checks = [
        run_cli("check", path, "--set", f"structure.mode.axial.damping={value}")
        for value in ("0.49", "0.5", "1")
    ]
    assert [check.code for check in checks] == [0, 0, 0] and checks[0].err == ""
    assert checks[1].err.endswith(
        "structure.mode.axial.damping = 0.5 is a damping ratio: 1 means critical damping, and "
        "1 % is written 0.01\n"
    )
    assert "damping = 1 is a damping ratio: 1 means critical" in checks[2].err
