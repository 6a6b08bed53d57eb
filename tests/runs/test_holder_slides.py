"""The tangential spring of the holder in series with the patch: a Jenkins element, series stiffness, one more mode."""

import numpy as np
import pytest
from scene_texts import BENCH, PATCH, RIG, only
from scipy.integrate import solve_ivp

from patchfem.runs.run import run
from patchfem.scene import loads

STIFF, LIMIT = 5e6, 0.3 * 26 * 4.4482216152605
PIECE = PATCH + BENCH[BENCH.index("[friction]") :]
SPRING = ["contact.holder.tangential_stiffness=5e6 N/m", "contact.element_size=400 um"]


def bench(law, *sets):
    text = PIECE.replace('"coulomb"', law)
    return run(loads(text, "a.toml", [*SPRING, "slide.cycles=2", *sets]), estimate=False).response


def test_exact_coulomb_behind_a_spring_is_one_jenkins_element():
    found = bench('"coulomb"')
    force = []
    last = 0.0
    for step in np.diff(found.slide, prepend=0.0):
        last = min(max(last + STIFF * step, -LIMIT), LIMIT)
        force.append(last)
    assert found.force == pytest.approx(force, abs=1e-9 * LIMIT)
    assert found.force.max() == pytest.approx(LIMIT, rel=1e-12)


@pytest.mark.parametrize("law", ["elastic-plastic", "nonlocal"])
def test_exact_first_stiffness_is_that_of_the_series(law):
    """1/(1/k_h + eps/(mu N)); the limit stays mu N."""
    found = bench(f'"{law}"\nbond_length = "1 um"', "accuracy.steps_per_cycle=20000")
    series = 1 / (1 / STIFF + 1e-6 / LIMIT)
    assert found.force[1] / found.slide[1] == pytest.approx(
        series, rel=1e-12 if law != "nonlocal" else 5e-3
    )
    assert np.abs(found.force).max() == pytest.approx(
        LIMIT, rel=1e-6 if law != "nonlocal" else 5e-3
    )


def test_exact_bonds_behind_a_spring_follow_their_equation():
    """Virgin stroke of Dahl's law behind k_h: F' = (mu N - F)/eps (1 - F'/k_h), integrated on its own."""
    found = bench('"nonlocal"\nbond_length = "1 um"', "accuracy.steps_per_cycle=4000")
    rise = slice(0, 900)
    flow = solve_ivp(
        lambda q, f: (LIMIT - f) / 1e-6 / (1 + (LIMIT - f) / 1e-6 / STIFF),
        (0, found.slide[rise][-1]),
        [0.0],
        t_eval=found.slide[rise],
        rtol=1e-11,
        atol=1e-10,
    )
    assert found.force[rise] == pytest.approx(flow.y[0], abs=2e-5 * LIMIT)


def test_exact_the_spring_adds_to_the_shear_of_the_pieces():
    """In stick: compliance of the pieces and of the holder add, for the exact elements and for the modes."""
    soft = ["contact.shear={}", "accuracy.steps_per_cycle=100000", "slide.cycles=1"]
    text = PIECE.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 nm"')
    stiff = [
        run(loads(text, "a.toml", [*sets, *soft]), estimate=False).response
        for sets in (SPRING, SPRING[1:])
    ]
    first = [found.force[1] / found.slide[1] for found in stiff]
    assert 1 / first[0] == pytest.approx(1 / STIFF + 1 / first[1], rel=1e-9)


def test_exact_a_rig_feels_the_spring():
    """Stuck Coulomb in a rig: the block swings at the frequency of flexure and holder in parallel, energy closes."""
    sets = [
        *SPRING,
        "friction.static=30",
        "drive.cycles=20",
        "drive.frequency=20 Hz",
        "accuracy.steps_per_cycle=4000",
    ]
    text = RIG[: RIG.index('[[structure.mode]]\nname = "second"')] + RIG[RIG.index("[drive]") :]
    text = text.replace('"nonlocal"', '"coulomb"').replace('bond_length = "1 um"\n', "")
    text = text.replace("slide = 0.8", "slide = 1.0")
    found = run(loads(text, "a.toml", sets), estimate=False)
    mass = 0.884
    omega = 2 * np.pi * 143
    own = np.sqrt(omega**2 + STIFF / mass)
    drive = 40 * np.pi
    t = found.response.time
    z = found.response.slide
    damp = 0.003 * omega
    high = np.sqrt(own**2 - damp**2)
    gain = 1 / complex(own**2 - drive**2, 2 * damp * drive)
    steady = -5 * 9.80665 * np.imag(gain * np.exp(1j * drive * t))
    a = 5 * 9.80665 * gain.imag
    b = (5 * 9.80665 * drive * gain.real + damp * a) / high
    want = steady + np.exp(-damp * t) * (a * np.cos(high * t) + b * np.sin(high * t))
    assert z == pytest.approx(want, abs=2e-3 * np.abs(want).max())
    assert found.measures["energy_balance"].value <= 1e-10


def test_refuses_what_the_spring_cannot_stand_beside():
    said = only(RIG, SPRING[0], "friction.reading=report", "friction.order=-0.5")
    assert "contact.holder.tangential_stiffness" in said and "initial_bonds" in said
