"""The tangential spring of the holder in series with the patch: Jenkins element, series stiffness,
rig."""

import numpy as np
import pytest
from scene_texts import BENCH, PATCH, RIG

from patchfem.runs.run import run
from patchfem.scene import loads

HOLDER_STIFFNESS, LIMIT = 5e6, 0.3 * 26 * 4.4482216152605
PIECE = PATCH + BENCH[BENCH.index("[friction]") :]
HOLDER_SPRING = ["contact.holder.tangential_stiffness=5e6 N/m", "contact.element_size=400 um"]


def run_bench(law, *sets):
    """Return the response of a bench with a friction law behind the holder spring."""
    text = PIECE.replace('"coulomb"', law)
    return run(
        loads(text, "a.toml", [*HOLDER_SPRING, "slide.cycles=2", *sets]), estimate=False
    ).response


def test_exact_coulomb_with_holder_spring_is_jenkins_element():
    """A Coulomb contact behind the holder spring has the force of a Jenkins element at every sample."""
    response = run_bench('"coulomb"')
    force = []
    spring_force = 0.0
    for step in np.diff(response.slide, prepend=0.0):
        spring_force = min(max(spring_force + HOLDER_STIFFNESS * step, -LIMIT), LIMIT)
        force.append(spring_force)
    assert response.force == pytest.approx(force, abs=1e-9 * LIMIT)
    assert response.force.max() == pytest.approx(LIMIT, rel=1e-12)


def test_exact_holder_and_shear_compliances_add():
    """In stick the compliances of the pieces and of the holder add."""
    sheared = ["contact.shear={}", "accuracy.steps_per_cycle=100000", "slide.cycles=1"]
    text = PIECE.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 nm"')
    responses = [
        run(loads(text, "a.toml", [*sets, *sheared]), estimate=False).response
        for sets in (HOLDER_SPRING, HOLDER_SPRING[1:])
    ]
    stiffness = [response.force[1] / response.slide[1] for response in responses]
    assert 1 / stiffness[0] == pytest.approx(1 / HOLDER_STIFFNESS + 1 / stiffness[1], rel=1e-9)


def test_exact_stuck_rig_vibrates_with_holder_spring():
    """A stuck rig with a Coulomb contact vibrates at the frequency of flexure and holder spring in
    parallel, and its energy balance closes."""
    sets = [
        *HOLDER_SPRING,
        "friction.static=30",
        "drive.cycles=20",
        "drive.frequency=20 Hz",
        "accuracy.steps_per_cycle=4000",
    ]
    text = RIG[: RIG.index('[[structure.mode]]\nname = "second"')] + RIG[RIG.index("[drive]") :]
    text = text.replace('"nonlocal"', '"coulomb"').replace('bond_length = "1 um"\n', "")
    text = text.replace("slide = 0.8\noutput = 0.8", "slide = 1.0")
    result = run(loads(text, "a.toml", sets), estimate=False)
    mass = 0.884
    omega = 2 * np.pi * 143
    omega_stuck = np.sqrt(omega**2 + HOLDER_STIFFNESS / mass)
    drive = 40 * np.pi
    t = result.response.time
    z = result.response.slide
    decay_rate = 0.003 * omega
    omega_damped = np.sqrt(omega_stuck**2 - decay_rate**2)
    gain = 1 / complex(omega_stuck**2 - drive**2, 2 * decay_rate * drive)
    steady = -5 * 9.80665 * np.imag(gain * np.exp(1j * drive * t))
    a = 5 * 9.80665 * gain.imag
    b = (5 * 9.80665 * drive * gain.real + decay_rate * a) / omega_damped
    expected = steady + np.exp(-decay_rate * t) * (
        a * np.cos(omega_damped * t) + b * np.sin(omega_damped * t)
    )
    assert z == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    assert result.measures["energy_balance"].value <= 1e-10
