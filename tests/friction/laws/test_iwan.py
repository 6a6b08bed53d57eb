"""Segalman's four-parameter model: its numbers, its dissipation in micro-slip, and one law in every run."""

import numpy as np
import pytest
from law_runs import LOAD, bench_along, shrinking
from scene_texts import COATED, mistakes, only

from patchfem.friction import max_yield_displacement
from patchfem.friction.laws.iwan import slider_cells

LAW = 'law = "iwan"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nchi = -0.4\nbeta = 0.3\n'
FORCE, STIFFNESS, CHI, BETA = 0.31 * LOAD, 1.3e7, -0.4, 0.3


def density(force, stiffness, chi, beta):
    """(R, S, phi_max) of rho = R phi^chi + S delta(phi - phi_max)."""
    top = force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))
    r = stiffness * (chi + 1) / ((1 + beta) * top ** (chi + 1))
    return r, beta * r * top ** (chi + 1) / (chi + 1), top


def loading(slide, force, stiffness, chi, beta):
    """Force of a first loading to slide, int rho min(phi, u)."""
    r, s, top = density(force, stiffness, chi, beta)
    u = np.minimum(slide, top)
    return r * u ** (chi + 2) / (chi + 2) + u * (
        r * (top ** (chi + 1) - u ** (chi + 1)) / (chi + 1) + s
    )


@pytest.mark.parametrize("chi, beta", [(-0.4, 0.3), (-0.9, 0.0), (0.0, 2.0), (-0.99, 0.01)])
def test_exact_the_four_parameters(chi, beta):
    k, most = slider_cells(3.0, 2e6, chi, beta)
    assert (k > 0).all() and (np.diff(most) > 0).all() and most[0] > 0
    assert k.sum() == pytest.approx(2e6, rel=1e-14) and k @ most == pytest.approx(3.0, rel=1e-14)
    assert max_yield_displacement(3.0, 2e6, chi, beta) == pytest.approx(
        density(3.0, 2e6, chi, beta)[2], rel=1e-14
    )
    slide = np.linspace(0.0, 1.2, 1000) * max_yield_displacement(3.0, 2e6, chi, beta)
    assert np.minimum.outer(slide, most) @ k == pytest.approx(
        loading(slide, 3.0, 2e6, chi, beta), abs=2e-6 * 3.0
    )


@pytest.mark.parametrize("chi", [-0.7, -0.4, 0.0])
def test_order_dissipation_of_micro_slip_is_chi_plus_three(chi):
    """A cycle of slide amplitude u loses 4 R u^(chi + 3)/((chi + 2)(chi + 3)); the force is nearly as the slide."""
    law = LAW.replace("-0.4", str(chi))
    r, _, top = density(FORCE, STIFFNESS, chi, BETA)
    forces = []
    losses = []
    for share in (1e-3, 1e-2):
        u = share * top
        time = np.arange(801) / 40000
        found = bench_along(law, time, u * np.sin(2 * np.pi * 100 * time))
        losses.append(found.ledger[2, -1] - found.ledger[2, 400])
        forces.append(np.abs(found.force).max())
        assert losses[-1] == pytest.approx(
            4 * r * u ** (chi + 3) / ((chi + 2) * (chi + 3)), rel=2e-3
        )
    assert np.log(losses[1] / losses[0]) / np.log(forces[1] / forces[0]) == pytest.approx(
        chi + 3, abs=0.1
    )


def test_exact_a_bench_loop_is_the_density_itself():
    """A slide with open minor loops against the density by quadrature, each of its 200 000 sliders clipped."""
    time, slide = shrinking()
    found = bench_along(LAW, time, slide)
    r, s, top = density(FORCE, STIFFNESS, CHI, BETA)
    count = 200_000
    phi = top * ((np.arange(count) + 0.5) / count) ** (1 / (CHI + 1))  # alike in stiffness
    weight = r * top ** (CHI + 1) / (CHI + 1) / count
    stretch = np.zeros(count)
    last = 0.0
    force = [0.0]
    for dq in np.diff(slide):
        stretch = np.clip(stretch + dq, -phi, phi)
        last = min(max(last + dq, -top), top)
        force.append(weight * stretch.sum() + s * last)
    assert np.abs(found.force).max() == pytest.approx(FORCE, rel=1e-9)  # all slips once
    assert np.abs(found.force - force).max() <= 1e-6 * FORCE
    book = found.ledger
    assert (
        book[0, -1] == pytest.approx(book[1, -1] + book[2, -1], rel=1e-12)
        and np.diff(book[2]).min() >= -1e-18
    )
    assert not book[3].any()


def test_refuses_shapes_on_the_lower_piece_and_a_varying_load_of_a_bench():
    slide = '[slide]\nkind = "sine"\namplitude = "1 um"\nfrequency = "1 Hz"\n'
    bench = "[friction]\n" + LAW + slide
    tilt = '[contact.tilt]\nangle = "0.01 mrad"\non = "lower"\n'
    assert "put the shapes on the upper" in only(COATED + tilt + bench)
    varying = '[normal]\nload = "100 N"\namplitude = "10 N"\nfrequency = "5 Hz"\n'
    assert "normal.amplitude: not supported yet with law 'iwan'" in mistakes(varying + bench)[0]
