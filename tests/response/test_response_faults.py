"""Properties of measures that mutation tests showed to be unchecked."""

import numpy as np
import pytest

from patchfem.core import Outcome, Response
from patchfem.friction import LuGre
from patchfem.response import add_substep_samples, compute_step_harmonic, settling
from patchfem.response.inside_steps import N_SUBSTEPS, divide_steps


@pytest.mark.parametrize(
    ("change", "outcome"), [(0.04, Outcome.STEADY), (0.06, Outcome.GROWS), (0.9, Outcome.GROWS)]
)
def test_exact_uniform_growth_threshold(change, outcome):
    """A uniform growth counts as growing from a twentieth of the tolerance."""
    amplitudes = 1 + 1e-3 * change * np.arange(6)
    assert settling.classify(amplitudes, 1e-3) is outcome


def test_exact_first_harmonic_of_square_wave():
    """The first harmonic of a square wave with non-uniform samples is -12j/pi within 1e-14."""
    time = np.array([0.0, 0.1, 0.5, 0.8, 1.0])
    force = compute_step_harmonic(time, np.array([3.0, 3.0, -3.0, -3.0]), 2 * np.pi)
    assert force == pytest.approx(-12j / np.pi, rel=1e-14)


def test_exact_cubic_motion_is_interpolated_exactly():
    """A cubic motion is interpolated exactly inside its steps."""
    motion = np.polynomial.Polynomial([0.2, 1.5, 0.7, 0.3])
    time = np.array([0.0, 0.4, 1.1, 1.3])
    steps = divide_steps(time, motion(time), motion.deriv()(time))
    assert steps.time.shape == (3, N_SUBSTEPS)
    np.testing.assert_allclose(steps.slide, motion(steps.time), rtol=1e-14)
    np.testing.assert_allclose(steps.speed, motion.deriv()(steps.time), rtol=1e-13)


def test_exact_lugre_force_inside_step():
    """At constant speed, the bristle deflection of LuGre inside a step agrees with its exponential within 1e-9."""
    law = LuGre(0.6, 0.4, 2e5, 1e-3, micro_damping=30.0, viscous=2.0)
    speed = 5e-4
    load = 80.0
    time = np.array([0.0, 2e-3, 9e-3])
    none = np.zeros(3)
    window = Response(
        time=time, modal=none, modal_rate=none, slide=speed * time, slide_rate=speed + none,
        output=none, output_rate=none, acceleration=none, base_acceleration=none, force=none,
        slip=none,
    )  # fmt: skip
    inside = add_substep_samples(window, law, load)
    assert inside.time.size == 2 * N_SUBSTEPS + 1
    limit = 0.4 + 0.2 * np.exp(-0.25)
    fraction = np.exp(-speed * inside.time * law.stiffness / limit)
    np.testing.assert_allclose(inside.slide - inside.slip, limit / 2e5 * (1 - fraction), rtol=1e-9)
    bristle_force = limit * (1 - fraction) + 30.0 * speed * fraction
    np.testing.assert_allclose(inside.force, load * (bristle_force + 2.0 * speed), rtol=1e-9)
