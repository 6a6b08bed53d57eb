"""Frequency and damping of a free decay as functions of the amplitude, from half cycles without noise."""

import numpy as np
import pytest
from scene_texts import DRIVE, KILOGRAM, POINT, make_friction_table
from scipy.integrate import solve_ivp

import patchfem as pf
from patchfem.response import (
    fit_decay_curve,
    make_half_cycles,
)

RELEASED = DRIVE[: DRIVE.index("kind")] + 'kind = "free"\ndisplacement = "2 mm"\ncycles = 30\n'


@pytest.mark.parametrize("zeta", [1e-4, 0.3])
def test_exact_viscous_decay_has_constant_damping(zeta):
    """The curve of a viscous decay has the constant damping ratio within 1e-9 and the damped frequency within 1e-12."""
    k = np.arange(30)
    own = 700.0 * np.sqrt(1 - zeta**2)
    found = fit_decay_curve(
        make_half_cycles(np.pi * k / own, (-1.0) ** k * np.exp(-zeta * 700.0 * np.pi * k / own))
    )
    assert found.damping == pytest.approx(zeta, rel=1e-9)
    assert found.frequency == pytest.approx(own / (2 * np.pi), rel=1e-12)
    assert found.amplitude.size > 6 and (np.diff(found.amplitude) < 0).all()


def test_always_decay_intervals_cover_nonlinear_damping():
    """More than 95 % of the intervals cover a damping ratio that depends on the amplitude.

    The logarithm of the amplitude falls by pi c A^p/(1 + A^p) per half cycle.

    Without the term for its change between two reversals, 68 % covered it.
    """
    held = []
    for seed in range(16):
        r = np.random.default_rng(seed)
        p = r.uniform(0.1, 1.5)
        c = 2 * 10 ** r.uniform(-3, -0.8)

        def fall(a, p=p, c=c):
            return np.pi * c * a**p / (1 + a**p)

        k = np.arange(150)
        a = np.exp(
            solve_ivp(
                lambda _, y, fall=fall: -fall(np.exp(y)),
                (0, 149),
                [0.0],
                t_eval=k,
                rtol=1e-11,
                atol=1e-12,
            ).y[0]
        )
        found = fit_decay_curve(make_half_cycles(np.pi * k, (-1.0) ** k * a)).select(slice(1, -1))
        true = fall(found.amplitude)
        held.append(np.abs(found.damping - true / np.hypot(np.pi, true)) <= found.damping_error)
    assert np.concatenate(held).mean() > 0.95


def test_exact_coulomb_decay_agrees_with_closed_form():
    """Under Coulomb friction, the decay has the natural frequency and the damping ratio 2 h/(pi a) within its errors."""
    data = pf.run(
        POINT + make_friction_table("coulomb") + KILOGRAM.replace("0.003", "0.0") + RELEASED
    ).to_xarray()
    h = 0.3 * 115.6541 / (286 * np.pi) ** 2
    a = data.decay_amplitude.values
    assert data.decay_frequency.values == pytest.approx(143.0, rel=1e-8)
    off = np.abs(data.decay_damping.values - 2 * h / (np.pi * a))
    assert a.size > 8 and (off < data.decay_damping_error.values)[1:].all()
    assert set(data.decay_time.dims) == {"decay_time"} and "decay_frequency_error" in data


TWO_MODES = """[normal]
load = "20 N"
[friction]
law = "elastic-plastic"
static = 0.3
stiffness = "30 kN/m"
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "first"
frequency = "40 Hz"
damping = 0.002
slide = 1.0
output = 1.0
[[structure.mode]]
name = "second"
frequency = "131 Hz"
damping = 0.002
slide = 0.7
output = -0.6
[drive]
kind = "free"
displacement = "2 mm"
cycles = 60
"""


def test_exact_decay_that_ends_stuck_has_stuck_eigenvalue():
    """A decay that ends stuck has frequency and damping of the eigenvalue of the stuck rig.

    They agree within 1e-9 and 1e-7, although another mode rings too.
    """
    done = pf.run(TWO_MODES)
    omega = 2 * np.pi * np.array([40.0, 131.0])
    slide = np.array([1.0, 0.7])
    matrix = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-np.diag(omega**2) - 3e4 * np.outer(slide, slide), -0.004 * np.diag(omega)],
        ]
    )
    values = np.linalg.eigvals(matrix)
    frequency = values.imag / (2 * np.pi)
    damping = -values.real / np.abs(values)
    decay = done.extra["decay"]
    ring = done.measures
    k = np.argmin(np.abs(frequency - decay.frequency[-1]))
    rings = decay.frequency == decay.frequency[-1]
    assert str(done.outcome) == "stuck" and rings.sum() > 40 and 3 < np.sum(~rings)
    assert decay.frequency[-1] == pytest.approx(frequency[k], rel=1e-9)
    assert decay.damping[-1] == pytest.approx(damping[k], rel=1e-7)
    assert np.all(decay.frequency_error < decay.frequency / 2) and np.all(
        decay.damping_error < decay.damping / 2
    )
    k = np.argmin(np.abs(frequency - ring["ring_frequency"].value))
    assert ring["ring_frequency"].value == pytest.approx(frequency[k], rel=1e-9)
    assert ring["ring_damping"].value == pytest.approx(damping[k], rel=1e-7)
    amplitude = np.ptp(done.window.output) / 2
    assert decay.amplitude[-1] < 1.2 * amplitude
