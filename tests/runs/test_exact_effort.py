"""The expected cost of the exact engine, the choice of the engine, and the limit of the cost."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.core import Missing

CHAIN = """[structure]
masses = ["1 kg", "2 kg"]
output_mass = 2
[[structure.spring]]
between = [1, 0]
stiffness = "4e5 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "3e5 N/m"
[[structure.damper]]
between = [2, 1]
coefficient = "900 N s/m"
[[structure.interface]]
between = [2, 0]
law = "coulomb"
static = 0.3
load = "20 N"
[drive]
kind = "base"
frequency = "{} Hz"
acceleration = "5 g"
cycles = 3
"""
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
SWEEP = (
    '[drive]\nkind = "base"\nwaveform = "sweep"\nfrom = "120 Hz"\nto = "150 Hz"\nrate = "60 Hz/s"\n'
    'acceleration = "7 g"\n'
)


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


def test_always_undamped_rig_under_slow_drive_is_marched():
    """The free vibration of an undamped rig never decays; under a slow drive the exact engine is
    too expensive and the march is chosen."""
    text = MODES.replace("0.003", "0") + COULOMB_POINT + SLOW.replace("5 g", "18 g")
    plan = pf.plan(text)
    assert plan.engine == "march"


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


def test_refuses_exact_run_with_unlimited_cost():
    """An exact run that would practically never end is refused with the keys to change."""
    slow = SLOW.replace(FREQUENCY, "0.00003 Hz").replace("5 g", "18 g")
    text = MODES.replace("0.003", "0") + COULOMB_POINT + slow + '[accuracy]\nmethod = "exact"\n'
    with pytest.raises(Missing, match=r'drive\.cycles .* accuracy\.method = "march"'):
        pf.run(text)
