"""Histories of a run under a force, in every engine."""

import pytest

import patchfem as pf

MODES = (
    '[structure]\nmoving_mass = "2 kg"\n[[structure.mode]]\nname = "a"\nfrequency = "100 Hz"\ndamping = 0.01\n'
    "slide = 1.0\n"
)
BENCH = '[normal]\nload = "10 N"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
METHODS = [("", "exact"), ("", "march"), ("", "harmonic"), (BENCH, "exact"), (BENCH, "harmonic")]


@pytest.mark.parametrize("friction, method", METHODS)
def test_exact_base_acceleration_is_zero_under_force_drive(friction, method):
    """Under a force the base acceleration is zero in the histories of every engine.

    Earlier five engines stored force over mass.
    """
    drive = '[drive]\nkind = "force"\nfrequency = "20 Hz"\nforce = "30 N"\ncycles = 2'
    r = pf.run(f"{friction}{MODES}{drive}", **{"accuracy.method": method}).response
    assert not r.base_acceleration.any() and r.acceleration.any()
