"""Backbones by statics, against closed forms and minimised energies."""

from types import SimpleNamespace

import numpy as np
import pytest
from modal_bases import basis_of

from patchfem.core import PatchfemError
from patchfem.dynamics import LawGroup, Spring
from patchfem.dynamics.harmonic import quasi_static
from patchfem.dynamics.harmonic.laws import Jenkins, SpeedLaw
from patchfem.friction.laws import tanh


def modes_of(omega, zeta, slide, output):
    return basis_of(omega, zeta, slide, np.ones(len(omega)), output, 0.5)


ONE = modes_of([700.0], [0.002], [1.0], [1.0])
STIFF, LIMIT = np.array([2e4, 1e4, 3e4]), np.array([1e-4, 2e-4, 4e-4])


def held(modes, group):
    return modes.compute_stuck_mode(group.rows, group.stiffness(), 0)


def test_exact_one_mode_on_elastic_plastic_elements():
    """omega^2 = omega_0^2 + F(A)/(m A) and zeta = zeta_0 omega_0/omega + loss/(2 pi m omega^2 A^2)."""
    group = LawGroup(ONE, Jenkins(STIFF, LIMIT))
    a = np.geomspace(3e-5, 3e-3, 9)
    force = (STIFF * np.minimum(a[:, None], LIMIT)).sum(axis=1)
    loss = (4 * STIFF * LIMIT * np.maximum(a[:, None] - LIMIT, 0)).sum(axis=1)
    omega = np.sqrt(700.0**2 + force / (0.5 * a))
    found = quasi_static.find_static_motions(ONE, group, a, held(ONE, group))
    assert [one.omega for one in found] == pytest.approx(omega, rel=1e-12)
    assert [one.zeta for one in found] == pytest.approx(
        0.002 * 700 / omega + loss / (2 * np.pi * 0.5 * (omega * a) ** 2), rel=1e-12
    )
    again = quasi_static.find_static_motions_from_loops(
        ONE,
        ONE.slide,
        0,
        a,
        [quasi_static.StaticLoops(*one) for one in zip(force, loss)],
    )
    assert [one.omega for one in again] == pytest.approx(omega, rel=1e-12)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_exact_an_amplitude_without_an_equilibrium_leaves_the_others_as_they_are():
    group = LawGroup(ONE, Jenkins(STIFF, LIMIT))
    a = np.geomspace(3e-5, 3e-3, 4)
    whole = quasi_static.find_static_motions(ONE, group, a, held(ONE, group))
    a[2] = np.inf
    found = quasi_static.find_static_motions(ONE, group, a, held(ONE, group))
    assert np.isnan(found[2].omega) and np.isnan(found[2].z).all()
    assert [found[k].omega for k in (0, 1, 3)] == pytest.approx(
        [whole[k].omega for k in (0, 1, 3)], rel=1e-12
    )


def test_exact_a_linear_spring_is_the_held_mode():
    modes = modes_of([700.0, 2500.0], [0.002, 0.01], [1.0, 0.6], [1.0, -0.3])
    group = LawGroup(modes, Spring(2e5))
    omega, shape = held(modes, group)
    [found] = quasi_static.find_static_motions(modes, group, [1e-4], (omega, shape))
    assert found.omega == pytest.approx(omega, rel=1e-9) and found.z == pytest.approx(
        1e-4 * shape, rel=1e-7
    )
    assert found.loss == pytest.approx(0, abs=1e-12 * 2e5 * 1e-8)


def test_exact_two_modes_move_in_the_mode_of_the_secant_stiffness():
    """A generalised eigenproblem with the secant of the loop; at large amplitudes, the free mode."""
    modes = modes_of([700.0, 2500.0], [0.002, 0.01], [1.0, 0.6], [1.0, -0.3])
    group = LawGroup(modes, Jenkins(STIFF, LIMIT))
    amplitudes = [3e-4, 3.0]
    found, gross = quasi_static.find_static_motions(modes, group, amplitudes, held(modes, group))
    slide = float(modes.slide @ found.z)
    secant = STIFF @ np.minimum(slide, LIMIT) / slide
    stiffness = np.diag(modes.omega**2) + secant / 0.5 * np.outer(modes.slide, modes.slide)
    assert stiffness @ found.z == pytest.approx(found.omega**2 * found.z, rel=1e-9)
    assert found.amplitude == pytest.approx(3e-4, rel=1e-12)
    assert gross.omega == pytest.approx(700.0, rel=1e-4)
    loops = [quasi_static.find_loops(group.laws[0], slide, 4096)]
    [again] = quasi_static.find_static_motions_from_loops(modes, modes.slide, 0, [slide], loops)
    assert (again.omega, again.zeta) == pytest.approx((found.omega, found.zeta), rel=1e-9)


def test_refuses_friction_that_follows_the_speed():
    friction = SimpleNamespace(static=0.3, reference_speed=1e-3)
    group = LawGroup(ONE, SpeedLaw(tanh.from_keys(friction, 1.0).element(9.0)))
    with pytest.raises(PatchfemError, match="sliding speed"):
        quasi_static.find_static_motions(ONE, group, [1e-4], (700.0, np.ones(1)))
