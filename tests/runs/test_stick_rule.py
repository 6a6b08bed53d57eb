"""Stick fraction and phase of the first slip: the same definition from event times and from
samples."""

from math import pi

import pytest
from scene_runs import run_scene
from scene_texts import COULOMB, POINT, STRUCTURE

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


def format_scene(law, omega, second_mode="", cycles=20):
    """Return the scene of a block with a friction law and a drive of angular frequency `omega`
    [rad/s]."""
    return SCENE.format(
        law=law, more=second_mode, own=0.5 / pi, drive=omega / (2 * pi), cycles=cycles
    )


def run_exact_and_march(scene, steps: int) -> list:
    """Return (stick fraction, phase, engine) by the exact engine and by the march."""
    rows = []
    for accuracy in ("", f'[accuracy]\nmethod = "march"\nsteps_per_cycle = {steps}\n'):
        result = run(loads(scene + accuracy), estimate=False)
        rows.append(
            (
                result.measures["stick_fraction"].value,
                result.measures["slip_start_phase"].value,
                result.settings.engine,
            )
        )
    assert rows[0][2] != "march" == rows[1][2]
    return rows


@pytest.mark.share(2, 4)
@pytest.mark.parametrize(
    "law, omega, second_mode",
    [
        ('law = "coulomb"', 1.0, ""),
        ('law = "coulomb"\nkinetic = 0.5', 0.3, ""),
        ('law = "coulomb"\nkinetic = 0.2', 0.3, ""),
        ('law = "coulomb"\nkinetic = 0.7', 0.5, SECOND),
        ('law = "elastic-plastic"\nbond_length = "0.2 m"', 0.7, ""),
        ('law = "elastic-plastic"\nbond_length = "0.05 m"', 0.5, SECOND),
    ],
)
def test_order_of_stick_fraction_from_samples(law, omega, second_mode):
    """Each event is uncertain by one step: the stick fraction from samples agrees within four steps
    per cycle with that from events, and the phase within 4 pi/steps."""
    for steps in (400, 3200):
        (exact, start, _), (sampled, phase, _) = run_exact_and_march(
            format_scene(law, omega, second_mode), steps
        )
        assert 0.02 < exact < 0.98 and abs(sampled - exact) < 4 / steps
        if "0.2\n" in f"{law}\n":  # The block slips several times per half cycle.
            assert phase is None and start is None
            continue
        assert abs((phase - start + pi / 2) % pi - pi / 2) < 4 * pi / steps


@pytest.mark.parametrize(
    "level, reason", [("40 g", "never sticks"), ("0.1 g", "sticks throughout")]
)
def test_exact_slip_phase_needs_stick_and_slip(level, reason):
    """A motion that never sticks, or never slips, has no phase of the first slip."""
    phase = run_scene(POINT + COULOMB + STRUCTURE, f"drive.acceleration={level}").measures[
        "slip_start_phase"
    ]
    assert phase.value is None and reason in phase.reason, phase
