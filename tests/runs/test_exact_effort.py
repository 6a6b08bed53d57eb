"""The expected cost of the exact engine, the choice of the engine, and the limit of the cost."""

import numpy as np
import pytest

import patchfem as pf

MODES = """[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
"""
COULOMB_POINT = '[normal]\nload = "26 lbf"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
FREQUENCY = "0.0003404368455286208 Hz"
SLOW = f'[drive]\nkind = "base"\nfrequency = "{FREQUENCY}"\nacceleration = "5 g"\ncycles = 12\n'


@pytest.mark.parametrize("kinetic", [None, 0.2])
def test_exact_spring_block_under_slow_drive(kinetic):
    """The amplitude and the loop area of a spring and block under a slow drive agree with the
    closed form, and the energy balance closes."""
    text = MODES + COULOMB_POINT + SLOW.replace(FREQUENCY, "0.01 Hz").replace("5 g", "18 g")
    result = pf.run(text, **({"friction.kinetic": str(kinetic)} if kinetic else {}))
    limit = 0.3 * 26 * 4.4482216152605
    k = 0.884 * (2 * np.pi * 143) ** 2
    expected = 0.884 * 18 * 9.80665 / k - limit / k
    if kinetic is None:
        assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
            expected, rel=1e-5
        )
        assert result.measures["loop_area"].value == pytest.approx(4 * limit * expected, rel=1e-5)
    assert result.measures["energy_balance"].value < 1e-7


def test_exact_averaged_law_with_extreme_damping_is_marched():
    """With a damping ratio of 2e9, the averaged law is too stiff for exact events. The march is
    chosen, and the friction force reaches mu_s N."""
    law = 'law = "convolution"\nbond_length = "1 nm"'
    text = (
        MODES.replace("0.003", "2e9")
        + COULOMB_POINT.replace('law = "coulomb"', law)
        + SLOW.replace("5 g", "18 g")
    )
    text = text.replace(FREQUENCY, "56.75 Hz")
    assert pf.plan(text).engine == "march"
    force = pf.run(text).measures["friction_force_peak"]
    assert abs(force.value - 0.3 * 26 * 4.4482216152605) <= force.error <= 1e-8 * force.value
