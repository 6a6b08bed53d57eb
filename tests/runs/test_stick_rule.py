"""The stick fraction and the phase of the first slip: one rule, by event times and by samples."""

from math import pi

import pytest

from patchfem.runs.run import run
from patchfem.scene import loads

SCENE = """\
[normal]
load = "0.8 N"
[friction]
{law}
static = 1.0
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "a"
frequency = "{own} Hz"
damping = 0.02
slide = 1.0
{more}
[drive]
kind = "force"
frequency = "{drive} Hz"
force = "1 N"
cycles = {cycles}
"""
SECOND = '[[structure.mode]]\nname = "b"\nfrequency = "0.55 Hz"\ndamping = 0.02\nslide = 0.4\nbase = 0.0\noutput = 0.2'


def text(law, omega, more="", cycles=20):
    return SCENE.format(law=law, more=more, own=0.5 / pi, drive=omega / (2 * pi), cycles=cycles)


def both(scene, steps: int) -> list:
    """(stick fraction, phase) by the engine of events and by the march, and whether the first was no march."""
    out = []
    for more in ("", f'[accuracy]\nmethod = "march"\nsteps_per_cycle = {steps}\n'):
        found = run(loads(scene + more), estimate=False)
        out.append(
            (
                found.measures["stick_fraction"].value,
                found.measures["slip_start_phase"].value,
                found.extra["engine"],
            )
        )
    assert out[0][2] != "march" == out[1][2]
    return out


@pytest.mark.share(0, 2, 4)
@pytest.mark.parametrize(
    "law, omega, more",
    [
        ('law = "coulomb"', 1.0, ""),
        ('law = "coulomb"\nkinetic = 0.5', 0.3, ""),
        ('law = "coulomb"\nkinetic = 0.2', 0.3, ""),
        ('law = "coulomb"\nkinetic = 0.7', 0.5, SECOND),
        ('law = "elastic-plastic"\nbond_length = "0.2 m"', 0.7, ""),
        ('law = "elastic-plastic"\nbond_length = "0.05 m"', 0.5, SECOND),
    ],
)
def test_order_stick_by_samples_comes_to_stick_by_events(law, omega, more):
    """By samples an event lies within its step: 1/steps of a cycle and 2 pi/steps of phase for each, four a cycle."""
    for steps in (400, 3200):
        (exact, start, _), (found, phase, _) = both(text(law, omega, more), steps)
        assert 0.02 < exact < 0.98 and abs(found - exact) < 4 / steps
        if "0.2\n" in f"{law}\n":  # it slips several times in half a cycle
            assert phase is None and start is None
            continue
        assert abs((phase - start + pi / 2) % pi - pi / 2) < 4 * pi / steps


NULLS = (
    "equivalent_stiffness",
    "secant_stiffness",
    "equivalent_damping",
    "acceleration_distortion",
    "slip_start_phase",
)


@pytest.mark.parametrize(
    "load, reason", [("0.8 N", "never sticks"), ("8 N", "the whole interface sticks throughout")]
)
def test_exact_a_phase_wants_a_slip_out_of_a_stick(load, reason):
    """Far above the limit it slides through; below it nothing slips, and the loop has no width."""
    scene = text('law = "coulomb"', 1.0).replace("0.8 N", load).replace('"1 N"', '"4 N"')
    found = run(loads(scene)).measures
    assert found["slip_start_phase"].value is None and reason in found["slip_start_phase"].reason
    held = load == "8 N"
    assert found["stick_fraction"].value == held
    for name in NULLS[:3]:
        assert (found[name].value is None) is held, name
