"""Sweeps over cases of one mode and one point against exact motions and against the march of many points."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.core import ModalBasis, SineDrive
from patchfem.points import cases, laws, march
from patchfem.points.contacts import Contact, PointSet

OMEGA = 2 * np.pi * 143.0
LIMIT = 40.0  # friction limit [N] of 1 kg
DRIVE = SineDrive(LIMIT / 0.8, OMEGA)
MODES = ModalBasis(
    ("a",), np.array([OMEGA]), np.array([0.003]), np.ones(1), np.ones(1), np.ones(1), 1.0
)
# Amplitude of the steady stick-slip motion at resonance, zeta = 0.003 and D = 0.8, by marching to 40 digits
EXACT_AMPLITUDE = 0.28704671337871602595
EXACT_STICK = 0.2127  # fraction of the time


def make(law, drive=DRIVE, cycles=200):
    """Return a batch of one case."""
    return cases.make_case(MODES, drive, law, cycles, reference=OMEGA**2)


def test_coulomb_block_at_resonance():
    """Amplitude, stick fraction and energies of the two-stop motion with 64 steps per cycle."""
    law = laws.make_coulomb(1.0, 1.0, LIMIT)
    values = cases.march_with(make(law), 64).values
    amplitude = values["relative_displacement_amplitude"][0] * OMEGA**2 / DRIVE.acceleration
    assert amplitude == pytest.approx(EXACT_AMPLITUDE, rel=3e-5)
    assert values["stick_fraction"][0] == pytest.approx(EXACT_STICK, abs=2e-3)
    assert values["energy_balance"][0] <= 1e-6
    assert values["loop_area"][0] == pytest.approx(
        4 * LIMIT * values["slip_amplitude"][0], rel=1e-4
    )


def test_exact_stick_under_static_friction():
    """Below static friction a block at rest does not move at all."""
    run = cases.run_cases(make(laws.make_coulomb(1.3, 1.0, LIMIT)), 1e-3)
    assert run.values["relative_displacement_amplitude"][0] == 0
    assert run.values["stick_fraction"][0] == 1


def make_laws() -> dict:
    """Return one law of each kind with a limit of LIMIT."""
    keys = {
        "static": 0.5, "kinetic": 0.4, "bond_length": None, "stiffness": 2e7, "exponent": 1.5, "shape": 0.6, "chi": -0.3,
        "beta": 0.5, "stribeck_speed": 0.01, "micro_damping": 200.0, "viscous": 1.0, "reference_speed": 2e-3,
    }  # fmt: skip
    names = ("elastic-plastic", "iwan", "bouc-wen", "lugre", "tanh")
    return {
        name: laws.make_point_law(SimpleNamespace(law=name, **keys), 2 * LIMIT) for name in names
    }


@pytest.mark.parametrize("name", [name for name in make_laws() if name != "lugre"])
def test_errors_hold_and_steps_converge(name):
    """The stated errors contain the motion with 4096 steps per cycle, and shorter steps come nearer to it."""
    drives = [SineDrive(LIMIT * ratio, 0.9 * OMEGA) for ratio in np.linspace(0.9, 3.0, 20)]
    batch = cases.stack_cases([make(make_laws()[name], drive, 60) for drive in drives])
    run = cases.run_cases(batch, 1e-3)
    truth = cases.march_with(batch, 4096).values
    rough = cases.march_with(batch, 32).values
    for measure in ("relative_displacement_amplitude", "loop_area"):
        error = np.abs(run.values[measure] - truth[measure])
        assert np.mean(error <= run.errors[measure]) >= 0.85
        assert np.median(error) <= 0.7 * np.median(np.abs(rough[measure] - truth[measure]))
    assert not run.missed.size


def test_cases_agree_with_the_march_of_points():
    """The march of many points has the same amplitude and friction work per cycle, by another step."""
    law = make_laws()["elastic-plastic"]
    contact = Contact([PointSet([law], np.ones(1))])
    motion = march.march(MODES, DRIVE, contact, 60, 800)
    values = cases.march_with(make(law, cycles=60), 512).values
    low, high = motion.extremes[-1]
    # Both are the last of 60 cycles; the window of the cases has six.
    window = motion.extremes[-6:]
    amplitude = (window[:, 1].max() - window[:, 0].min()) / 2
    assert high > low
    assert values["relative_displacement_amplitude"][0] == pytest.approx(amplitude, rel=3e-4)
    assert values["friction_work"][0] == pytest.approx(motion.ledger["booked"], rel=3e-4)


def test_cases_that_miss_the_tolerance_are_listed():
    """With few steps and a small tolerance a case is listed with its values."""
    run = cases.run_cases(make(make_laws()["tanh"]), 1e-6, steps=(32,))
    assert run.missed.tolist() == [0]
    assert np.isfinite(run.values["relative_displacement_amplitude"]).all()
