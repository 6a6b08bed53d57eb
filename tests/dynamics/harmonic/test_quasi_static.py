"""Backbones by statics, against closed forms and minimised energies."""

from types import SimpleNamespace

import numpy as np
import pytest
from modal_bases import basis_of
from scipy.optimize import minimize

from patchfem.core import ModalBasis, PatchfemError
from patchfem.dynamics import LawGroup, Spring
from patchfem.dynamics.harmonic import quasi_static
from patchfem.dynamics.harmonic.laws import Jenkins, SpeedLaw
from patchfem.friction.laws import tanh


def modes_of(omega, zeta, slide, output) -> ModalBasis:
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
        held(ONE, group),
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


def test_exact_two_modes_hold_at_the_least_energy():
    """At a share q of the shape the coordinates make the energy of modes and elements least."""
    modes = modes_of([700.0, 2500.0], [0.002, 0.01], [1.0, 0.6], [1.0, -0.3])
    group = LawGroup(modes, Jenkins(STIFF, LIMIT))
    share = 3e-4
    omega, shape = held(modes, group)
    [found] = quasi_static.find_static_motions(modes, group, [share], (omega, shape))

    def energy(z):
        u = abs(modes.slide @ z)
        slips = np.maximum(u - LIMIT, 0)
        return 0.25 * np.sum((modes.omega * z) ** 2) + float(
            STIFF @ ((u - slips) ** 2 / 2 + LIMIT * slips)
        )

    across = np.array([-shape[1], shape[0]])
    least = minimize(
        lambda x: 1e3 * energy(share * shape + x[0] * share * across), [0.0], tol=1e-14
    )
    assert found.z == pytest.approx(share * (shape + least.x[0] * across), rel=1e-5)
    assert found.amplitude == pytest.approx(share, rel=1e-12)


def test_refuses_friction_that_follows_the_speed():
    friction = SimpleNamespace(static=0.3, reference_speed=1e-3)
    group = LawGroup(ONE, SpeedLaw(tanh.from_keys(friction, 1.0).element(9.0)))
    with pytest.raises(PatchfemError, match="sliding speed"):
        quasi_static.find_static_motions(ONE, group, [1e-4], (700.0, np.ones(1)))
