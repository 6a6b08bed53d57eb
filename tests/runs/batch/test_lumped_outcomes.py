"""Lumped cases of every kind, with every possible outcome, agree with single runs."""

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, MODE, POINT, SECOND, SHORT

from patchfem import build
from patchfem.runs.batch import batches, one_by_one

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


# Absolute tolerance of measures that are differences of larger terms.
ABSOLUTE_TOLERANCES = {"acceleration_distortion": 1e-13, "drift_per_cycle": 1e-16}
KINDS = {
    "wear": RIG + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n',
    "two modes": POINT + COULOMB + MODE + SECOND + DRIVE,
    "a second load path": RIG
    + '[structure.bonded]\nstiffness = "4.6e6 N/m"\ndamping = "20 N s/m"\n',
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
    "no load": replace_in_rig(("26 lbf", "0 N")),
    "no friction": replace_in_rig(("static = 0.3", "static = 0")),
    "no drive": replace_in_rig(("slide = 1.0", "slide = 1.0\nbase = 0")),
    "no output": replace_in_rig(("slide = 1.0", "slide = 1.0\noutput = 0")),
    "a gauge of its own": replace_in_rig(("slide = 1.0", "slide = 1.0\ngauge = 0.5")),
    "a mass": MASS,
    "an averaged law": replace_in_rig(
        ('law = "coulomb"', 'law = "convolution"\nbond_length = "1 um"')
    ),
}
MARCHED_CASES = {
    "a load that varies": replace_in_rig(
        ('"26 lbf"\n', '"26 lbf"\namplitude = "10 N"\nfrequency = "50 Hz"\n')
    ),
    "a spring that stiffens": RIG + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n',
    "the march by name": RIG + '[accuracy]\nmethod = "march"\n',
}
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


def assert_equal_to_single_run(model):
    """Solve a model as a batch and alone; assert equal texts and numbers that agree within 1e-10,
    and return the batch."""
    messages = []
    batch = batches.solve_models([model], report=messages.append)
    single = one_by_one.solve([model])
    assert [line for line in messages if "one by one" in line] == []
    assert batch.outcome.tolist() == single.outcome.tolist() and batch.messages == single.messages
    assert (batch.warnings, batch.notes, batch.numerics, batch.reasons) == (
        single.warnings,
        single.notes,
        single.numerics,
        single.reasons,
    )
    names = [name for name in single.values if single.has(name, 0)]
    assert {name for name in batch.values if batch.has(name, 0)} == set(names)
    for name in set(names) - {"energy_balance", "work_check"}:  # Both measures are round-off.
        abs_tol = 1e-10 * abs(single.values[name][0]) + ABSOLUTE_TOLERANCES.get(name, 0.0)
        np.testing.assert_allclose(
            batch.values[name], single.values[name], rtol=0, atol=abs_tol, err_msg=name
        )
        np.testing.assert_allclose(
            batch.errors[name], single.errors[name], rtol=1e-6, atol=abs_tol, err_msg=name
        )
    return batch


@pytest.mark.share(0, 1, 2, 3, 4, 6, 7, 8, 10, 12, 14)
@pytest.mark.parametrize("kind", KINDS)
def test_exact_batch_agrees_with_single_run_for_every_kind(kind):
    """Each kind of lumped case agrees with its single run, in a batch or not."""
    assert_equal_to_single_run(build(KINDS[kind]))


@pytest.mark.parametrize("kind", MARCHED_CASES)
def test_refuses_marched_cases_in_batches(kind):
    """Cases that need a march have no batch."""
    assert batches.choose_batch(build(MARCHED_CASES[kind])) is None


@pytest.mark.parametrize("name", OUTCOMES)
def test_exact_batch_outcomes_agree_with_single_runs(name):
    """A batch gives the outcome of a single run, whether a motion grows, settles, beats, is steady or sticks."""
    pairs, outcome, has_steady_estimate = OUTCOMES[name]
    model = build(replace_in_rig(*pairs))
    results = assert_equal_to_single_run(model)
    assert batches.choose_batch(model) is not None and results.outcome[0] == outcome
    assert ("relative_displacement_amplitude_steady" in results.values) == has_steady_estimate
    assert bool(results.warnings) == (name == "remarked on")


@pytest.mark.parametrize("name", OUTCOMES)
def test_exact_elastic_plastic_outcomes_agree_with_single_runs(name):
    """The same cases with an elastic-plastic element have the outcomes of single runs."""
    text = replace_in_rig(*OUTCOMES[name][0])
    model = build(text.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"'))
    assert batches.choose_batch(model) is not None
    assert_equal_to_single_run(model)
