"""Self-checks of a run: faults planted in the program lead to the outcome not_converged; correct runs pass all checks."""

from dataclasses import replace

import patchfem as pf
from patchfem.core import Outcome
from patchfem.dynamics.march import march
from patchfem.response import rows
from patchfem.runs.self_checks import checks
from patchfem.runs.self_checks.evidence import Evidence
from patchfem.structure import modes

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


def test_always_wrong_mode_shape_is_detected(monkeypatch):
    """Twice the sliding component of a mode leads to not_converged; the warning states the wrong
    and the right value."""
    build_basis = modes.build_basis

    def build_wrong_basis(mode_list, mass):
        """Return a modal basis with twice the sliding components."""
        basis = build_basis(mode_list, mass)
        return replace(basis, slide=2 * basis.slide)

    monkeypatch.setattr("patchfem.structure.modes.build_basis", build_wrong_basis)
    result = pf.run(SCENES["exact"].replace("8 g", "8.1 g"))
    assert result.outcome is Outcome.NOT_CONVERGED
    text = next(text for text in result.warnings if "self-check" in text)
    assert "slide of mode 1" in text and " 2," in text and "it is 1;" in text
    assert all(measure.error is None for measure in result.measures.values())


def test_always_wrong_energy_balance_is_detected(monkeypatch):
    """A friction loss that is 1e-6 too large leads to not_converged; the warning names no key,
    because no setting is a remedy."""
    energy_balance = march.Run.energy_balance
    monkeypatch.setattr(
        march.Run,
        "energy_balance",
        lambda run: (
            energy_balance(run) | {"friction": (1 + 1e-6) * energy_balance(run)["friction"]}
        ),
    )
    result = pf.run(SCENES["march"].replace("8 g", "8.1 g"))
    assert result.outcome is Outcome.NOT_CONVERGED
    text = next(text for text in result.warnings if "energy balance of engine march" in text)
    assert "the numerical method created or lost energy" in text
    assert "has an error" in text and "the limit of 1e-8" in text and "accuracy." not in text
    assert all(measure.error is None for measure in result.measures.values())


def test_always_wrong_loop_measures_are_detected(monkeypatch):
    """Loop measures that are twice too large, as by a wrong factor of the harmonics, lead to
    not_converged."""
    interface_loop = rows.interface_loop
    monkeypatch.setattr(
        rows,
        "interface_loop",
        lambda *arguments: {name: 2 * value for name, value in interface_loop(*arguments).items()},
    )
    result = pf.run(SCENES["march"])
    assert result.outcome is Outcome.NOT_CONVERGED
    assert any("loop_area" in text for text in result.warnings)
    assert any("equivalent_stiffness" in text for text in result.warnings)


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
