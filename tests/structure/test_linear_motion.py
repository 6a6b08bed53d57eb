"""Steps of a linear motion, and measures of a linear rig, compared with closed forms and another integrator."""

from itertools import pairwise

import numpy as np
import pytest
from scene_texts import MODE
from scipy.integrate import solve_ivp

import patchfem as pf
from patchfem.core import InitialState, ModalBasis, SineDrive
from patchfem.structure import LinearRig
from patchfem.structure.drives import RecordedDrive, SweepDrive

PHASE = 2 * np.pi / 16


def make_coupled_modes(seed: int) -> ModalBasis:
    """Return three coordinates whose dampers couple them; one is rigid, and one is overdamped."""
    rng = np.random.default_rng(seed)
    shape = rng.normal(size=(3, 3))
    ones = np.ones(3)
    return ModalBasis(
        names=("a", "b", "c"),
        omega=np.array([0.0, 300.0, 900.0]),
        zeta=np.zeros(3),
        slide=ones,
        base=rng.normal(size=3),
        output=rng.normal(size=3),
        mass=1.3,
        damping=40.0 * shape @ shape.T,
    )


DRIVES = {
    "sine": (SineDrive(9.0, 700.0), [0.0, 0.03]),
    "sweep": (SweepDrive(50.0, 200.0, 0.02, acceleration=9.0), [0.0, 0.02, 0.03]),
    "record": (
        RecordedDrive(np.array([0.0, 0.004, 0.011, 0.02]), np.array([0.0, 9.0, -5.0, 3.0]), 0.01),
        [0.0, 0.004, 0.011, 0.02, 0.03],
    ),
}


@pytest.mark.parametrize("name", DRIVES)
def test_exact_steps_agree_with_another_integrator(name):
    """States at the ends, at Gauss points and between them agree with the dense output of DOP853 to 1e-8."""
    drive, borders = DRIVES[name]
    modes = make_coupled_modes(11)
    rng = np.random.default_rng(12)
    start = InitialState(1e-3 * rng.normal(size=3), rng.normal(size=3))
    blocks = list(LinearRig(modes, PHASE).follow(drive, start, np.array(borders)))
    places = np.sort(rng.uniform(0, 0.03, 30))
    found = np.concatenate(
        [b.evaluate(places[(places >= b.times[0]) & (places < b.times[-1])]) for b in blocks]
    )

    def find_rates(t, y):
        """Return the rates of the state (6,)."""
        push = modes.base * drive.values(np.array([t]))[0]
        return np.append(y[3:], -push - modes.damping_matrix @ y[3:] - modes.omega**2 * y[:3])

    state = np.append(start.z, start.v)
    expected = []
    for begin, end in pairwise(borders):
        inside = places[(places >= begin) & (places < end)]
        # A drive jumps at its borders, which the integrator must not evaluate from the other side.
        at = np.append(inside, end)
        run = solve_ivp(
            find_rates, (begin, np.nextafter(end, begin)), state, "DOP853", np.minimum(at, np.nextafter(end, begin)),
            rtol=1e-12, atol=1e-15,
        )  # fmt: skip
        expected.append(run.y[:, :-1].T)
        state = run.y[:, -1]
    scale = np.abs(found).max(axis=0)
    assert np.abs((found - np.concatenate(expected)) / scale).max() < 1e-8


LINEAR = MODE.replace("damping = 0.003", "damping = {damping}")
DRIVE = '[drive]\nkind = "base"\nfrequency = "{frequency} Hz"\nacceleration = "5 g"\ncycles = {cycles}\n'


def test_exact_measures_of_a_linear_rig_agree_with_closed_forms():
    """The amplitude from rest at resonance without damping, and the steady one with damping, are those of closed forms.

    From rest z = -a/(2 w^2) (sin wt - wt cos wt), whose extremes of the last cycle are those at wt = n pi.
    """
    omega = 2 * np.pi * 143.0
    acceleration = 5 * 9.80665
    text = LINEAR.format(damping=0) + DRIVE.format(frequency=143, cycles=10)
    result = pf.run(text)
    assert result.settings.engine == "linear" and result.outcome == "grows"
    expected = acceleration / omega**2 * np.pi * (20 + 19) / 4
    assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
        expected, rel=1e-9
    )

    text = LINEAR.format(damping=0.2) + DRIVE.format(frequency=100, cycles=60)
    result = pf.run(text)
    drive = 2 * np.pi * 100.0
    expected = acceleration / abs(omega**2 - drive**2 + 0.4j * omega * drive)
    measure = result.measures["relative_displacement_amplitude"]
    assert measure.value == pytest.approx(expected, rel=1e-10)
    assert measure.error < 1e-8 * expected


def test_exact_linear_rig_ends_at_its_travel():
    """A rig that grows ends where |z| = a/(2 w^2) |sin wt - wt cos wt| reaches the travel, at that time."""
    travel = '[structure]\ntravel = "0.5 mm"'
    text = LINEAR.format(damping=0).replace("[structure]", travel, 1)
    result = pf.run(text + DRIVE.format(frequency=143, cycles=100))
    assert result.outcome == "exceeds_travel"
    phase = 2 * np.pi * 143.0 * result.response.time[-1]
    size = 5 * 9.80665 / (2 * np.pi * 143.0) ** 2 / 2
    assert size * abs(np.sin(phase) - phase * np.cos(phase)) == pytest.approx(5e-4, rel=1e-9)
