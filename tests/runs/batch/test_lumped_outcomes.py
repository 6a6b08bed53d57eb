"""Lumped cases of every kind, with every possible outcome, agree with single runs."""

import numpy as np
import pytest
from point_cases import compare_answers
from scene_texts import COULOMB, DRIVE, MODE, POINT, SECOND, SHORT

from patchfem import build
from patchfem.runs.batch import batches, lumped, one_by_one

RIG = POINT + COULOMB + SHORT
SWEEP = (
    'waveform = "sweep"\nfrom = "120 Hz"\nto = "150 Hz"\nrate = "100 Hz/s"\nacceleration = "5 g"\n'
)
MASS = """\
[structure]
masses = ["1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "4e5 N/m"
[[structure.interface]]
between = [1, 0]
law = "coulomb"
static = 0.3
load = "60 N"
[drive]
kind = "force"
force = "60 N"
frequency = "90 Hz"
cycles = 20
"""


def replace_in_rig(*pairs) -> str:
    """Return the text of the rig with parts replaced."""
    text = RIG
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


LAWS = {
    "coulomb": 'law = "coulomb"',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "1 um"',
}
KINDS = {
    "wear": RIG + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n',
    "two modes": POINT + COULOMB + MODE + SECOND + DRIVE,
    "a stop of the flexure": replace_in_rig(("moving_mass", 'travel = "10 um"\nmoving_mass')),
    "levels": replace_in_rig(
        ('acceleration = "5 g"', 'waveform = "levels"\nlevels = ["3 g", "5 g"]')
    ),
    "a sweep": replace_in_rig(('frequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n', SWEEP)),
    "a release": replace_in_rig(
        (
            'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"',
            'kind = "free"\ndisplacement = "1 mm"',
        )
    ),
    "a part of a cycle": replace_in_rig(("cycles = 20", "cycles = 20.5")),
    "few cycles": replace_in_rig(("cycles = 20", "cycles = 12")),
    "no drive": replace_in_rig(("slide = 1.0", "slide = 1.0\nbase = 0")),
    "no output": replace_in_rig(("slide = 1.0", "slide = 1.0\noutput = 0")),
    "a gauge of its own": replace_in_rig(("slide = 1.0", "slide = 1.0\ngauge = 0.5")),
    "a mass": MASS,
    "an averaged law": replace_in_rig(
        ('law = "coulomb"', 'law = "convolution"\nbond_length = "1 um"')
    ),
    "a load that varies": replace_in_rig(
        ('"26 lbf"\n', '"26 lbf"\namplitude = "10 N"\nfrequency = "50 Hz"\n')
    ),
    "a spring that stiffens": RIG + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n',
    "the march by name": RIG + '[accuracy]\nmethod = "march"\n',
}
SINGLE_CASES = {
    "no load": replace_in_rig(("26 lbf", "0 N")),
    "no friction": replace_in_rig(("static = 0.3", "static = 0")),
}
STEADY = "relative_displacement_amplitude_steady"
OUTCOMES = {  # Name: (replacements in the rig, outcome, whether the steady amplitude is estimated).
    "grows": ((("0.003", "0"), ("26 lbf", "1 lbf")), "grows", False),
    "settles": (
        (("cycles = 20", "cycles = 60"), ("0.003", "0.01"), ("26 lbf", "12 lbf")),
        "transient",
        True,
    ),
    "beats": (
        (
            ("cycles = 20", "cycles = 200"),
            ('"5 g"', '"40 g"'),
            ("26 lbf", "1 lbf"),
            ('frequency = "143 Hz"\nacc', 'frequency = "120 Hz"\nacc'),
        ),
        "transient",
        True,
    ),
    "steady": ((("0.003", "0.3"),), "steady", False),
    "stuck": ((('"5 g"', '"0.1 g"'),), "stuck", False),
    "remarked on": ((("cycles = 20", 'cycles = 20\nonset_length = "0.01 mil"'),), "steady", True),
}


@pytest.mark.share(0, 1, 2, 3, 4, 6, 7, 8, 10, 12, 14)
@pytest.mark.parametrize("kind", KINDS)
def test_refuses_other_kinds_of_motion(kind):
    """Each kind that is not one mode with one point under a sine is refused with a reason."""
    assert lumped.refusal_reason(build(KINDS[kind]))


@pytest.mark.parametrize("kind", SINGLE_CASES)
def test_exact_cases_without_motion_equal_single_runs(kind):
    """Cases without load, friction or drive equal their single runs to the last bit."""
    model = build(SINGLE_CASES[kind])
    batch, single = batches.solve_models([model], n_study_cases=64), one_by_one.solve([model])
    assert batch.numerics == single.numerics and batch.outcome.tolist() == single.outcome.tolist()
    for name, values in single.values.items():
        np.testing.assert_array_equal(batch.values[name], values)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", OUTCOMES)
def test_always_outcomes_agree_with_single_runs(name, law):
    """A batch gives the outcome of a single run, whether a motion grows, settles, beats, is steady or sticks.

    It has the same measures, reasons and warnings, except those on the size of errors, which are other numbers; values
    agree within the sum of both errors.
    """
    pairs, outcome, has_steady_estimate = OUTCOMES[name]
    model = build(replace_in_rig(*pairs).replace('law = "coulomb"', LAWS[law]))
    assert batches.find_group(model, 64).key
    batch, single = batches.solve_models([model], n_study_cases=64), one_by_one.solve([model])
    assert batch.outcome.tolist() == single.outcome.tolist()
    texts = [text for text in single.warnings.get(0, ()) if "has an estimated error" not in text]
    assert list(batch.warnings.get(0, ())) == texts and batch.reasons == single.reasons
    names = {measure for measure in batch.values if batch.has(measure, 0)}
    missing = names ^ {measure for measure in single.values if single.has(measure, 0)}
    # The extrapolation of a motion that has almost settled is a measure if its error is large enough.
    assert missing <= ({STEADY} if law != "coulomb" else set())
    assert all(row.holds for row in compare_answers(batch, single)[0] if row.name not in missing)
    if law == "coulomb":
        assert batch.outcome[0] == outcome
        assert ("relative_displacement_amplitude_steady" in batch.values) == has_steady_estimate
        assert bool(batch.warnings) == (name == "remarked on")
