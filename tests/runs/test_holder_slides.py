"""The tangential spring of the holder in series with the patch: Jenkins element, series stiffness,
rig."""

import numpy as np
import pytest
from scene_runs import find_sentences
from scene_texts import BENCH, PATCH, RIG

from patchfem.core import PatchfemError
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


# ---- sudden slip of bonds whose length falls with the slip

GROWING = """\
[friction]
law = "nonlocal"
static = 0.3
kinetic = 0.15
bond_length = "0.615 um"
rest_growth = "2e-5 m/s^2"
slip_growth = "1 um"
rest_speed = "1 um/s"
"""
DWELL = (
    '[slide]\nkind = "dwell"\ndistance = "30 um"\nspeed = "0.1 mm/s"\nhold = "1 s"\ndistance_after = "30 um"\n'
    "[accuracy]\ntolerance = 1e-2\n"
)
GROWING_BENCH = PATCH.replace('"26 lbf"', '"8 kN"') + GROWING + DWELL


def _run_behind_holder(stiffness: float, *sets):
    """Return the result of the bench of growing bonds behind a holder spring [N/m]."""
    holder = f"contact.holder.tangential_stiffness={stiffness!r} N/m"
    return run(loads(GROWING_BENCH, "a.toml", [holder, *sets]), estimate=False)


def test_exact_holder_softer_than_measured_fall_of_friction_is_refused():
    """The refusal of a sudden slip has the steepest fall of the force that a bench with a rigid holder shows."""
    sets = ["slide.hold=0 s", "accuracy.steps_per_cycle=20000"]
    rigid = run(loads(GROWING_BENCH, "a.toml", sets), estimate=False).response
    steepest = -float((np.diff(rigid.force) / np.diff(rigid.slide)).min())
    with pytest.raises(PatchfemError, match="slip suddenly"):
        _run_behind_holder(0.99 * steepest)
    assert not find_sentences(_run_behind_holder(1.01 * steepest, *sets).warnings, "jumps")


def test_patch_with_gentle_fall_of_friction_runs_with_shear():
    """Pieces in shear that are stiffer than the steepest fall of friction are not refused."""
    result = run(loads(GROWING_BENCH, "a.toml", ["contact.shear={}"]), estimate=False)
    assert result.response.force.max() > 0.15 * 8e3


def test_jump_of_contact_after_rest_is_reported():
    """After a rest friction falls more steeply than in the first slip, so that the contact jumps behind a soft holder."""
    soft = find_sentences(_run_behind_holder(2.3e8).warnings, "jumps")
    assert len(soft) == 1 and "limit 10 times" in soft[0] and "holder stiffer" in soft[0]
    assert not find_sentences(_run_behind_holder(4e8).warnings, "jumps")
