"""The Bouc-Wen law: limit, stiffness and closed loops."""

import numpy as np
import pytest
from law_runs import LOAD, run_bench_along_path, shrinking_sine
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from patchfem.friction.laws.bouc_wen import loop_from_keys
from patchfem.scene import Friction

LAW = 'law = "bouc-wen"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\n'
LIMIT, EPS = 0.31 * LOAD, 0.31 * LOAD / 1.3e7


def integrate_rate_equation(slide, exponent, shape):
    """Return the variable z along straight legs of the displacement, integrated from the rate equation."""
    z = [0.0]
    for dq in np.diff(slide):

        def rate_of_z(_, y, v=dq):
            return v / EPS * (1 - np.abs(y) ** exponent * (shape * np.sign(v * y) + 1 - shape))

        z.append(
            solve_ivp(rate_of_z, (0, 1), z[-1:], method="DOP853", rtol=1e-12, atol=1e-14).y[0, -1]
        )
    return np.array(z)


@pytest.mark.share(0, 2, 3, 4)
@pytest.mark.parametrize(
    "exponent, shape", [(1.0, 0.5), (2.0, 0.8), (1.5, 0.2), (4.0, 1.0), (0.5, 0.9)]
)
def test_exact_bench_loop_agrees_with_rate_equation(exponent, shape):
    """Force and stored energy on the bench agree with the integrated rate equation, and the energy balance closes."""
    time, slide = shrinking_sine(60)
    law = LAW + f"exponent = {exponent}\nshape = {shape}\n"
    result = run_bench_along_path(law, time, slide)
    z = integrate_rate_equation(slide, exponent, shape)
    assert np.abs(result.force - LIMIT * z).max() <= 1e-6 * LIMIT
    work, stored, dissipated, created = result.ledger
    # The root of z that an exponent of 1/2 has at 0 is resolved by graded pieces.
    tolerance = 1e-9 if exponent >= 1 else 1e-8
    assert stored == pytest.approx(LIMIT * EPS * z**2 / 2, abs=tolerance * LIMIT * EPS)
    assert work[-1] == pytest.approx(stored[-1] + dissipated[-1] - created[-1], rel=1e-12)
    assert created[-1] == 0 if shape >= 0.5 else created[-1] > 1e-3 * dissipated[-1]


@pytest.mark.parametrize("exponent, shape", [(0.3, 0.5), (1.5, 0.2)])
def test_exact_steady_loop_agrees_with_rate_equation(exponent, shape):
    """The peak force and the area of steady loops agree with the rate equation, for amplitudes of 0.5 to 40 lengths."""
    keys = Friction.model_construct(static=0.31, stiffness=1.3e7, exponent=exponent, shape=shape)
    slides = np.array([[0.5, 3.0], [12.0, 40.0]]) * EPS
    peak_forces, areas = loop_from_keys(keys, LOAD, slides)
    for u, force, loss in zip(slides.flat, peak_forces.flat, areas.flat):

        def integrate_stroke(z, u=u):
            """Return z and its integral over the displacement [m] after a displacement of 2 u from z."""

            def rate_of_z(x, y):
                return [
                    (1 - np.abs(y[0]) ** exponent * (shape * np.sign(y[0]) + 1 - shape)) / EPS,
                    y[0],
                ]

            return solve_ivp(
                rate_of_z,
                (0, 2 * u),
                [z, 0.0],
                method="DOP853",
                rtol=1e-10,
                atol=[1e-12, 1e-12 * u],
                max_step=0.5 * EPS,
            ).y[:, -1]

        z_peak = brentq(lambda z: integrate_stroke(-z)[0] - z, 0.0, 1.0, xtol=1e-13)
        assert force == pytest.approx(LIMIT * z_peak, rel=1e-7)
        assert loss == pytest.approx(2 * LIMIT * integrate_stroke(-z_peak)[1], rel=1e-7)
