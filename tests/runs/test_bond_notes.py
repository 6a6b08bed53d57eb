"""What a run says of its bonds: notes on what the law means, warnings where a number cannot be trusted."""

import numpy as np
import pytest
from list_paths import follow_list

from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.bonds.quadrature import Quadrature
from patchfem.runs.results.notes import unbounded_bonds
from patchfem.runs.run import run
from patchfem.scene.scene import loads

BENCH = '[normal]\nload = "100 N"\n[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"\n{law}[slide]\n' \
        'kind = "dwell"\nspeed = "10 mm/s"\ndistance = "200 um"\nhold = "1 ms"\ndistance_after = "20 um"\n' \
        '[accuracy]\nsteps_per_cycle = 2000\n'
GROWTH = 'kinetic = 0.06\nrest_growth = "2 m/s^2"\nslip_growth = "50 um"\nrest_speed = "10 um/s"\n'
RIG = '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\nlaw = "nonlocal"\nbond_length = "4 um"\n{law}' \
      '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n' \
      'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 10\n' \
      '[accuracy]\nsteps_per_cycle = 100\n'


def notes(text, law):
    found = run(loads(text.format(law=law)), estimate=False)
    return found, " | ".join(found.extra["notes"])


def test_exact_a_stretch_that_exceeds_mu_n_is_noted():
    """Bonds that formed at a fifth of the length hold on after a rest: a steady slide of order 3 never exceeds it."""
    found, said = notes(BENCH, GROWTH + "order = 3\n")
    ratio = found.measures["friction_ratio_peak"].value / 0.3
    assert ratio > 1.1 and f"friction force reaches {ratio:.3g} times mu_s N" in said
    assert "order = 3 and a growing" in said
    found, said = notes(BENCH, "order = 3\n")
    assert found.measures["friction_ratio_peak"].value / 0.3 <= 1 and not said


@pytest.mark.parametrize("order", [0.0, 1.0])
def test_always_growing_stretch_of_order_up_to_one_keeps_to_mu_n(order):
    """z' = m - z/eps with eps <= eps_0 and m <= 1: nothing to note."""
    path = np.concatenate([np.linspace(0, 5, 81), [5.0] * 3, 5 - np.linspace(0, 3, 81)[1:], np.linspace(2, 6, 81)])
    times = np.concatenate([np.full(80, 6e-4), [5.0] * 3, np.full(161, 6e-4)])[:path.size - 1]
    law = Bonds(1.0, 1.0, order, "stretch", 0.2, 1.0, 0.05, 1e-2)
    assert np.abs(follow_list(law, path, times).after).max() <= 1 + 1e-9


@pytest.mark.parametrize("text", [BENCH, RIG])
def test_exact_the_printed_initial_bonds_that_do_not_grow_are_noted(text):
    growth = GROWTH.replace("50 um", "0.5 um").replace("0.06", "0.2") + 'reading = "report"\n'
    assert "the initial bonds keep the bond length eps_0" in notes(text, growth)[1]
    assert "initial bonds" not in notes(text, growth + "initial_bonds = 0\n")[1]


def test_exact_initial_bonds_of_negative_order_are_warned_of_in_rigs_too():
    found, _ = notes(RIG.replace("cycles = 10", "cycles = 1"), 'reading = "report"\norder = -0.5\n')
    assert any("infinite at the first instant" in line for line in found.warnings)
    assert not unbounded_bonds(Bonds(0.3, 1e-6, -0.5, "report", initial=0.0)) and not unbounded_bonds(Bonds(0.3, 1e-6))


@pytest.mark.parametrize("order", [-0.9, -0.5, 0.0])
def test_always_friction_of_negative_order_is_bounded_after_a_rest(order):
    """Bonds formed later than the first never pull more than full-grown ones, mu_s N in all, however fine the steps:
    x^p exp(-x) falls with x, and x = R/eps is least where the bond is full-grown."""
    law, rest = Bonds(1.0, 1.0, order, "report", 0.5, 0.1, 0.05, 1e-2, 0.0), []
    for steps in (100, 400):
        path = np.concatenate([np.linspace(0, 2, steps + 1), [2.0] * 5, 2 - np.linspace(0, 0.5, steps + 1)[1:]])
        times = np.concatenate([np.full(steps, 2 / steps), np.full(5, 1e3), np.full(steps, 0.5 / steps)])
        after = follow_list(law, path, times).after
        assert np.abs(after).max() <= 1
        rest.append(after[steps + 4])
    assert rest[0] == pytest.approx(rest[1], abs=2e-3) and rest[0] > 0.8


@pytest.mark.parametrize("reading", ["stretch", "report"])
def test_exact_the_initial_bonds_have_no_sign_at_their_own_place(reading):
    """After whole cycles the slide is back to its last digit; the force of the first bonds jumps there, and its value
    is the mean of both sides, not the sign of round-off."""
    law, one = Bonds(1.0, 1.0, 0.0, reading), np.ones(1)
    path = 0.3 * np.sin(2 * np.pi * np.arange(201) / 100)
    for off in (-3e-17, 0.0, 3e-17):
        path[-1] = off
        got, state, numpy = follow_list(law, path).after[-1], Quadrature(law, 0.0).start(one), Quadrature(law, 0.0)
        for dq in np.diff(path):
            state = numpy.carried(state, dq, one, one, 1.0)
        sides = [follow_list(law, np.append(path, side)).after[-1] for side in (-1e-7, 1e-7)]
        assert got == pytest.approx(np.mean(sides), abs=1e-6) and abs(sides[1] - sides[0]) > 0.1
        assert numpy.traction(state)[0] == pytest.approx(got, abs=1e-9)
