"""Quasi-static backbones against closed forms and eigenvalue problems."""

from types import SimpleNamespace

import numpy as np
import pytest
from modal_bases import make_shaken_modes

from patchfem.core import PatchfemError
from patchfem.dynamics import LawGroup
from patchfem.dynamics.harmonic import quasi_static
from patchfem.dynamics.harmonic.laws import FlowLaw, Jenkins
from patchfem.friction.laws import tanh

ONE = make_shaken_modes([700.0], [0.002], [1.0], [1.0])
STIFF, LIMIT = np.array([2e4, 1e4, 3e4]), np.array([1e-4, 2e-4, 4e-4])


def test_exact_backbone_of_one_mode_agrees_with_closed_form():
    """With elastic-plastic elements omega^2 = omega_0^2 + F(A)/(m A) and zeta = zeta_0
    omega_0/omega + loss/(2 pi m omega^2 A^2), within 1e-12."""
    group = LawGroup(ONE, Jenkins(STIFF, LIMIT))
    a = np.geomspace(3e-5, 3e-3, 9)
    force = (STIFF * np.minimum(a[:, None], LIMIT)).sum(axis=1)
    loss = (4 * STIFF * LIMIT * np.maximum(a[:, None] - LIMIT, 0)).sum(axis=1)
    omega = np.sqrt(700.0**2 + force / (0.5 * a))
    motions = quasi_static.find_static_motions(ONE, group, 0, a, ONE.output)
    assert [motion.omega for motion in motions] == pytest.approx(omega, rel=1e-12)
    assert [motion.zeta for motion in motions] == pytest.approx(
        0.002 * 700 / omega + loss / (2 * np.pi * 0.5 * (omega * a) ** 2), rel=1e-12
    )
    from_loops = quasi_static.find_static_motions_from_loops(
        ONE,
        ONE.slide,
        0,
        a,
        [quasi_static.StaticLoops(*motion) for motion in zip(force, loss)],
    )
    assert [motion.omega for motion in from_loops] == pytest.approx(omega, rel=1e-12)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_exact_amplitude_without_equilibrium_gives_nan():
    """An amplitude without an equilibrium gives NaN and does not change the results at other
    amplitudes."""
    group = LawGroup(ONE, Jenkins(STIFF, LIMIT))
    a = np.geomspace(3e-5, 3e-3, 4)
    expected = quasi_static.find_static_motions(ONE, group, 0, a, ONE.output)
    a[2] = np.inf
    motions = quasi_static.find_static_motions(ONE, group, 0, a, ONE.output)
    assert np.isnan(motions[2].omega) and np.isnan(motions[2].zeta)
    assert [motions[k].omega for k in (0, 1, 3)] == pytest.approx(
        [expected[k].omega for k in (0, 1, 3)], rel=1e-12
    )


def test_exact_two_modes_satisfy_secant_eigenproblem():
    """The motion of two modes satisfies the eigenvalue problem with the secant stiffness within
    1e-9, and tends to the free mode at large amplitudes."""
    modes = make_shaken_modes([700.0, 2500.0], [0.002, 0.01], [1.0, 0.6], [1.0, -0.3])
    group = LawGroup(modes, Jenkins(STIFF, LIMIT))
    amplitudes = [3e-4, 3.0]
    motion, large_motion = quasi_static.find_static_motions(
        modes, group, 0, amplitudes, modes.output
    )
    slide = float(modes.slide @ motion.z)
    secant = STIFF @ np.minimum(slide, LIMIT) / slide
    stiffness = np.diag(modes.omega**2) + secant / 0.5 * np.outer(modes.slide, modes.slide)
    assert stiffness @ motion.z == pytest.approx(motion.omega**2 * motion.z, rel=1e-9)
    assert modes.output @ motion.z == pytest.approx(3e-4, rel=1e-12)
    assert large_motion.omega == pytest.approx(700.0, rel=1e-4)
    loops = [quasi_static.find_loops(group.laws[0], slide, 4096)]
    [from_loops] = quasi_static.find_static_motions_from_loops(
        modes, modes.slide, 0, [slide], loops
    )
    assert (from_loops.omega, from_loops.zeta) == pytest.approx(
        (motion.omega, motion.zeta), rel=1e-9
    )


def test_refuses_rate_dependent_friction():
    """Friction that depends on the sliding speed has no quasi-static backbone and is refused."""
    friction = SimpleNamespace(static=0.3, reference_speed=1e-3)
    group = LawGroup(ONE, FlowLaw(tanh.from_keys(friction, 1.0).element(9.0)))
    with pytest.raises(PatchfemError, match="sliding speed"):
        quasi_static.find_static_motions(ONE, group, 0, [1e-4], ONE.output)
