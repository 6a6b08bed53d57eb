"""Second computations of the results of a run find planted faults and agree with correct runs; balances end a wrong run."""

import re
from dataclasses import replace

import pytest
from self_checks import checks
from self_checks.evidence import Evidence

import patchfem as pf
from patchfem.core import Outcome
from patchfem.model import structure
from patchfem.points import time_march
from patchfem.response import rows
from patchfem.runs.bench import bench

PATCH = """
[contact]
length = "14 mm"
width = "7.5 mm"
height = "10 mm"
load = "700 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.coating]
material = "WC-Co"
thickness = "0.25 mm"
[contact.tilt]
angle = "0.05 mrad"
"""
POINT = """
[normal]
load = "100 N"
"""
COULOMB = """
[friction]
law = "coulomb"
static = 0.3
"""
PLASTIC = """
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "20 um"
"""
BONDS = """
[friction]
law = "nonlocal"
static = 0.3
bond_length = "20 um"
"""
SLIDE = """
[slide]
kind = "sine"
amplitude = "5 um"
frequency = "50 Hz"
cycles = 2
"""
RIG = """
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.01
slide = 1.0
base = 0.9
[[structure.mode]]
name = "yaw"
frequency = "170 Hz"
damping = 0.01
slide = 0.4
output = 0.7
base = 0.3
[drive]
kind = "base"
frequency = "85 Hz"
acceleration = "8 g"
cycles = 20
"""
COARSE = """
[accuracy]
steps_per_cycle = 100
"""
SCENES = {
    "static": PATCH,
    "bench": PATCH + "[contact.shear]\n" + COULOMB + SLIDE,
    "point": POINT + PLASTIC + SLIDE.replace("5 um", "60 um"),
    "exact": POINT + COULOMB + RIG,
    "march": POINT
    + BONDS
    + RIG.replace("cycles = 20", "cycles = 10")
    + COARSE
    + 'method = "march"\n',
    "balance": POINT
    + PLASTIC
    + RIG
    + COARSE.replace("steps_per_cycle = 100", 'method = "harmonic"'),
}


def test_always_correct_runs_pass_all_self_checks():
    """Each scene keeps its outcome, and together the scenes exercise every self-check."""
    exercised = set()
    for text in SCENES.values():
        result = pf.run(text)
        assert result.outcome is not Outcome.NOT_CONVERGED
        evidence = Evidence(result)
        for check in checks.CHECKS:
            findings = list(check(evidence))
            assert not any(finding.has_failed for finding in findings)
            exercised |= {check} if findings else set()
    assert exercised == set(checks.CHECKS)


@pytest.mark.parametrize(
    ("owner", "name", "fault", "scene", "sentences"),
    [
        (  # the warning states the wrong and the right value
            structure,
            "_build_listed_modes",
            lambda basis: replace(basis, slide=2 * basis.slide),
            SCENES["exact"].replace("8 g", "8.1 g"),
            ["slide of mode 1.* 2,.*it is 1;"],
        ),
        (  # as by a wrong factor of the harmonics
            rows,
            "interface_loop",
            lambda loop: {name: 2 * value for name, value in loop.items()},
            SCENES["march"],
            ["loop_area", "equivalent_stiffness"],
        ),
        (
            rows,
            "compute_peak",
            lambda peak: 0.8 * peak,
            SCENES["march"],
            ["absolute_acceleration_peak"],
        ),
    ],
    ids=["mode shape", "loop measures", "acceleration peak"],
)
def test_always_wrong_numbers_are_detected(monkeypatch, owner, name, fault, scene, sentences):
    """A wrong result of a function is found by a second computation, which states both numbers."""
    function = getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *arguments: fault(function(*arguments)))
    failed = [finding.sentence for finding in checks.list_failed_checks(pf.run(scene))]
    for text in sentences:
        assert any(re.search(text, sentence, re.S) for sentence in failed), failed


@pytest.mark.parametrize(
    ("owner", "name", "fault", "scene", "warning"),
    [
        (  # the warning names no key, because no setting is a remedy
            time_march.March,
            "find_ledger",
            lambda balance: balance | {"friction": (1 + 1e-6) * balance["friction"]},
            SCENES["march"].replace("8 g", "8.1 g"),
            "energy balance of engine march(?!.*accuracy\\.).*has an error.*the limit of 1e-8"
            ".*the numerical method created or lost energy",
        ),
        (
            bench,
            "_compute_measures",
            lambda values: values | {"energy_balance": 0.5},
            SCENES["point"].replace("60 um", "61 um"),
            "energy balance: 0.5 of the exchanged energy is missing or was created",
        ),
    ],
    ids=["march", "bench"],
)
def test_always_lost_energy_ends_run_as_not_converged(
    monkeypatch, owner, name, fault, scene, warning
):
    """Energy that a run lost or created leads to not_converged, and the measures have no errors."""
    function = getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *arguments: fault(function(*arguments)))
    result = pf.run(scene)
    assert result.outcome is Outcome.NOT_CONVERGED
    assert any(re.search(warning, text, re.S) for text in result.warnings), result.warnings
    assert all(measure.error is None for measure in result.measures.values())


def test_always_self_checks_support_base_displacement():
    """The check of the force balance supports a drive by base displacement, which states no
    acceleration."""
    text = (
        '[normal]\nload = "275 N"\n[friction]\nlaw = "bouc-wen"\nstatic = 0.8\nstiffness = "9e6 N/m"\n'
        '[structure]\nmoving_mass = "0.8 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "40 Hz"\n'
        'damping = 0.003\nslide = 1.0\nbase = 0.8\n[drive]\nkind = "base"\ndisplacement = "0.2 mm"\n'
        'frequency = "77 Hz"\ncycles = 6\n[accuracy]\ntolerance = 0.01\nmethod = "harmonic"\n'
    )
    assert pf.run(text).measures["loop_area"].value > 0
