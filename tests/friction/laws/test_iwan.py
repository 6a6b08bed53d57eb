"""Segalman's four-parameter Iwan model: density of sliders, dissipation in micro-slip, and bench loops."""

import numpy as np
import pytest
from law_runs import LOAD, run_bench_along_path

from patchfem.friction import max_yield_displacement
from patchfem.friction.laws.iwan import slider_cells

LAW = 'law = "iwan"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nchi = -0.4\nbeta = 0.3\n'
FORCE, STIFFNESS, CHI, BETA = 0.31 * LOAD, 1.3e7, -0.4, 0.3


def density_parameters(force, stiffness, chi, beta):
    """Return (R, S, phi_max) of the density rho = R phi^chi + S delta(phi - phi_max)."""
    phi_max = force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))
    r = stiffness * (chi + 1) / ((1 + beta) * phi_max ** (chi + 1))
    return r, beta * r * phi_max ** (chi + 1) / (chi + 1), phi_max


def loading_force(slide, force, stiffness, chi, beta):
    """Return the force of a first loading to a displacement, the integral of rho min(phi, u)."""
    r, s, phi_max = density_parameters(force, stiffness, chi, beta)
    u = np.minimum(slide, phi_max)
    return r * u ** (chi + 2) / (chi + 2) + u * (
        r * (phi_max ** (chi + 1) - u ** (chi + 1)) / (chi + 1) + s
    )


@pytest.mark.parametrize("chi, beta", [(-0.4, 0.3), (-0.9, 0.0), (0.0, 2.0), (-0.99, 0.01)])
def test_exact_slider_cells_reproduce_model_parameters(chi, beta):
    """The sliders reproduce the stiffness, the slip force, the yield displacement and the loading curve of the model."""
    k, yield_displacement = slider_cells(3.0, 2e6, chi, beta)
    assert (k > 0).all() and (np.diff(yield_displacement) > 0).all() and yield_displacement[0] > 0
    assert k.sum() == pytest.approx(2e6, rel=1e-14) and k @ yield_displacement == pytest.approx(
        3.0, rel=1e-14
    )
    assert max_yield_displacement(3.0, 2e6, chi, beta) == pytest.approx(
        density_parameters(3.0, 2e6, chi, beta)[2], rel=1e-14
    )
    slide = np.linspace(0.0, 1.2, 1000) * max_yield_displacement(3.0, 2e6, chi, beta)
    assert np.minimum.outer(slide, yield_displacement) @ k == pytest.approx(
        loading_force(slide, 3.0, 2e6, chi, beta), abs=2e-6 * 3.0
    )


def test_exact_bench_loop_agrees_with_slider_density():
    """A bench path with 50 nested loops agrees with the density resolved by 200 000 sliders within 1e-6 of the limit.

    On the way back all of the loops close.
    """
    time = np.arange(-60, 60.01, 0.05)
    slide = 1e-5 * np.exp(0.1 * (np.abs(time) - 60)) * np.sin(2 * np.pi * time)
    result = run_bench_along_path(LAW, time + 60, slide)
    r, s, phi_max = density_parameters(FORCE, STIFFNESS, CHI, BETA)
    n_sliders = 200_000
    phi = phi_max * ((np.arange(n_sliders) + 0.5) / n_sliders) ** (
        1 / (CHI + 1)
    )  # sliders of equal stiffness
    weight = r * phi_max ** (CHI + 1) / (CHI + 1) / n_sliders
    stretch = np.zeros(n_sliders)
    end_stretch = 0.0
    force = [0.0]
    for dq in np.diff(slide):
        stretch = np.clip(stretch + dq, -phi, phi)
        end_stretch = min(max(end_stretch + dq, -phi_max), phi_max)
        force.append(weight * stretch.sum() + s * end_stretch)
    assert np.abs(result.force).max() == pytest.approx(
        FORCE, rel=1e-9
    )  # every slider slips at least once
    assert np.abs(result.force - force).max() <= 1e-6 * FORCE
    ledger = result.ledger
    assert (
        ledger[0, -1] == pytest.approx(ledger[1, -1] + ledger[2, -1], rel=1e-12)
        and np.diff(ledger[2]).min() >= -1e-18
    )
    assert not ledger[3].any()
