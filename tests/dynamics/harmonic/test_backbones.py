"""Backbones of the harmonic balance against closed forms, the modal equations and bench loops."""

import numpy as np
import pytest
from harmonic_cases import make_bond_law, make_elements, make_five_modes, make_sdof
from modal_bases import make_modal_basis
from scipy.special import ellipk

from patchfem import plan, run
from patchfem.dynamics import LawGroup, Spring, find_free_motions, make_free_balance
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.series import evaluate_series, half_range

W = 2 * np.pi * 143
MASS = 0.884
RIG = make_modal_basis(W, 0.003, mass=MASS)


def find_backbone(modes, law, amplitudes, harmonics):
    """Return the free motions of the first mode at amplitudes [m]."""
    group = LawGroup(modes, law)
    equations = make_free_balance(modes, group, 0, amplitudes[-1], harmonics)
    return [found.motion for found in find_free_motions(equations, amplitudes)]


@pytest.mark.parametrize("is_forced", [False, True])
def test_exact_free_motion_satisfies_modal_equations(is_forced):
    """With coupled damping every harmonic of the free motion satisfies the modal equations, including the negative
    damping, or the force at a point in the first harmonic, and the output has the requested half range."""
    modes = make_five_modes(np.diag(0.004 * np.arange(1, 6)) + 0.002)
    group = LawGroup(modes, Jenkins(*make_elements(20, total=0.6, limit=0.12)))
    excitation = np.outer(modes.output, modes.output) / 0.36 if is_forced else None
    equations = make_free_balance(modes, group, 1, 0.3, 5, output=modes.output)
    motions = find_free_motions(equations, [0.05, 0.3])
    assert motions[1].motion.loss > 1e-3
    if is_forced:
        forced = make_free_balance(modes, group, 1, 0.3, 5, excitation, modes.output)
        motions = find_free_motions(forced, [0.05, 0.3], starts=motions)
    for found in motions:
        motion = found.motion
        for k in range(6):
            force = excitation * (k == 1) if is_forced else np.eye(5)
            a = np.diag(modes.omega**2 - (k * motion.omega) ** 2) + 1j * k * motion.omega * (
                modes.damping_matrix - 2 * motion.zeta * motion.omega * force
            )
            residual = a @ motion.modal[k] + modes.slide * motion.forces[0, k] / modes.mass
            assert np.abs(residual).max() < 1e-9 * motion.amplitude
        assert motion.modal[1, 1] == pytest.approx(motion.amplitude, abs=1e-12)
        assert motion.slides[0] == pytest.approx(motion.modal @ modes.slide)
        output = evaluate_series(motion.modal @ modes.output, 2**16)
        assert np.ptp(output) / 2 == pytest.approx(found.amplitude, rel=1e-7)


def test_exact_backbone_of_duffing_oscillator_agrees_with_closed_form():
    """The backbone of the undamped Duffing oscillator has the period 4 K(m)/sqrt(1 + c a^2) with m
    = c a^2/(2 (1 + c a^2)), within 1e-4."""
    for motion in find_backbone(make_sdof(0.0), Spring(0.0, 0.5), [0.3, 1.0, 2.0], 15):
        c = 0.5 * half_range(motion.slides[0]) ** 2
        frequency = np.sqrt(1 + c) / (4 * ellipk(c / (2 * (1 + c))))
        assert motion.omega / (2 * np.pi) == pytest.approx(frequency, rel=1e-4)
        assert abs(motion.zeta) < 1e-9


BENCH = """\
[normal]
load = "100 N"
[friction]
{law}
[slide]
kind = "sine"
amplitude = "{amplitude} um"
frequency = "10 Hz"
cycles = 4
[accuracy]
steps_per_cycle = 600
"""


@pytest.mark.parametrize(
    "text, law",
    [
        (
            'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "2 um"',
            Jenkins([30 / 2e-6], [2e-6]),
        ),
        ('law = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"', make_bond_law(30.0, 2e-6)),
    ],
    ids=["elastic-plastic", "bonds"],
)
def test_exact_backbone_agrees_with_bench_loops(text, law):
    """With one harmonic, frequency, damping and loss of the backbone agree with the stiffness and
    the area of the loop of a bench, within 3e-4."""
    omega = W
    amplitudes = np.array([4.0])
    motions = find_backbone(RIG, law, amplitudes * 1e-6, 1)
    for motion, amplitude in zip(motions, amplitudes):
        result = run(plan(BENCH.format(law=text, amplitude=amplitude)))
        stiffness = result.measures["equivalent_stiffness"].value
        area = result.measures["loop_area"].value
        w = np.sqrt(omega**2 + stiffness / MASS)
        assert motion.omega == pytest.approx(w, rel=2e-4)
        loss = area / (2 * np.pi * MASS * w * w * (amplitude * 1e-6) ** 2)
        assert motion.zeta == pytest.approx(0.003 * omega / w + loss, rel=3e-4)
        assert motion.loss == pytest.approx(area, rel=3e-4)
