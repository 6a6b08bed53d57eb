"""Lumped cases of every kind, batch or not, beside single runs; and cases that end in every way that a batch knows."""

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


def changed(*pairs) -> str:
    """The rig with parts of its text replaced."""
    text = RIG
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


# digits of the larger terms they are parts of
LAST = {"acceleration_distortion": 1e-13, "drift_per_cycle": 1e-16}
KINDS = {
    "wear": RIG + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n',
    "two modes": POINT + COULOMB + MODE + SECOND + DRIVE,
    "a second load path": RIG
    + '[structure.bonded]\nstiffness = "4.6e6 N/m"\ndamping = "20 N s/m"\n',
    "a stop of the flexure": changed(("moving_mass", 'travel = "10 um"\nmoving_mass')),
    "levels": changed(('acceleration = "5 g"', 'waveform = "levels"\nlevels = ["3 g", "5 g"]')),
    "a sweep": changed(('frequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n', SWEEP)),
    "a release": changed(
        (
            'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"',
            'kind = "free"\ndisplacement = "1 mm"',
        )
    ),
    "a part of a cycle": changed(("cycles = 20", "cycles = 20.5")),
    "few cycles": changed(("cycles = 20", "cycles = 12")),
    "no load": changed(("26 lbf", "0 N")),
    "no friction": changed(("static = 0.3", "static = 0")),
    "no drive": changed(("slide = 1.0", "slide = 1.0\nbase = 0")),
    "no output": changed(("slide = 1.0", "slide = 1.0\noutput = 0")),
    "a gauge of its own": changed(("slide = 1.0", "slide = 1.0\ngauge = 0.5")),
    "a mass": MASS,
    "an averaged law": changed(('law = "coulomb"', 'law = "convolution"\nbond_length = "1 um"')),
}
MARCHED = {
    "a load that varies": changed(
        ('"26 lbf"\n', '"26 lbf"\namplitude = "10 N"\nfrequency = "50 Hz"\n')
    ),
    "a spring that stiffens": RIG + '[structure.stiffening]\ncubic = "1e12 N/m^3"\n',
    "the march by name": RIG + '[accuracy]\nmethod = "march"\n',
}
ENDS = {  # what is changed, the outcome and, where there is one, that its steady amplitude is estimated
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


def alike(model):
    """Answers of a batch, held against those of a single run: what is said, and every number to 1e-10 of its size."""
    said = []
    found = batches.solve_models([model], say=said.append)
    one = one_by_one.solve([model])
    assert [line for line in said if "one by one" in line] == []
    assert found.outcome.tolist() == one.outcome.tolist() and found.messages == one.messages
    assert (found.warnings, found.notes, found.numerics, found.reasons) == (
        one.warnings,
        one.notes,
        one.numerics,
        one.reasons,
    )
    names = [name for name in one.values if one.has(name, 0)]
    assert {name for name in found.values if found.has(name, 0)} == set(names)
    for name in set(names) - {"energy_balance", "work_check"}:  # round-off alone
        size = 1e-10 * abs(one.values[name][0]) + LAST.get(name, 0.0)
        np.testing.assert_allclose(
            found.values[name], one.values[name], rtol=0, atol=size, err_msg=name
        )
        np.testing.assert_allclose(
            found.errors[name], one.errors[name], rtol=1e-6, atol=size, err_msg=name
        )
    return found


@pytest.mark.share(0, 1, 2, 3, 4, 6, 7, 8, 10, 12, 14)
@pytest.mark.parametrize("kind", KINDS)
def test_exact_a_case_of_any_kind_is_its_single_run(kind):
    alike(build(KINDS[kind]))


@pytest.mark.parametrize("kind", MARCHED)
def test_refuses_what_is_marched(kind):
    assert batches.choose_batch(build(MARCHED[kind])) is None


@pytest.mark.parametrize("end", ENDS)
def test_exact_a_batch_ends_as_single_runs_do(end):
    pairs, outcome, estimated = ENDS[end]
    model = build(changed(*pairs))
    found = alike(model)
    assert batches.choose_batch(model) is not None and found.outcome[0] == outcome
    assert ("relative_displacement_amplitude_steady" in found.values) == estimated
    assert bool(found.warnings) == (end == "remarked on")


@pytest.mark.parametrize("end", ENDS)
def test_exact_a_batch_of_elements_ends_as_single_runs_do(end):
    """The same cases behind an elastic-plastic element, however they end."""
    text = changed(*ENDS[end][0])
    model = build(text.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"'))
    assert batches.choose_batch(model) is not None
    alike(model)
