"""Wear of a contact in partial slip: the final pressure in closed form."""

import numpy as np
import pytest
from contact_forms import hertz_half_width, hertz_peak
from pieces import make_bare_layers, make_refined_grid
from pressed import solve_forces
from scipy.optimize import brentq

from patchfem.core import Compliance, Interface
from patchfem.elasticity import Piece, compute_interface_compliance
from patchfem.partial_slip import make_jenkins_set
from patchfem.wear import WearProblem, make_initial_wear_state, take_jump


@pytest.mark.slow
def test_exact_wear_shakedown_of_crown_agrees_with_closed_form():
    """For a Cattaneo-Mindlin contact with Q = 0.6 mu P, the stick zone c = a0 sqrt(0.4) stays and
    finally carries the whole load.

    The pressure in the middle tends to c/a0 + 0.6 P/(pi c p0) of the Hertz peak: Hertz pressure
    under 0.4 P and a flat punch under the rest. Normal and tangential compliance are equal, as for
    two half-planes (Ciavarella and Hills, 1999).
    """
    width = 10e-3
    radius = 0.05
    line = 1e5
    mu = 0.5
    young = 121e9
    cells = 24
    half = hertz_half_width(line, radius, young / (1 - 0.32**2) / 2)
    peak = hertz_peak(line, radius, young / (1 - 0.32**2) / 2)
    stick = half * np.sqrt(0.4)
    grid = make_refined_grid(1.5 * half, half / cells, 40 * half, 20 * half, 1.15)
    nn, _, _ = compute_interface_compliance(Piece(grid, make_bare_layers((young, 0.32))))
    x = grid.x
    area = grid.tributary_lengths() * width
    gap = grid.x**2 / 2 / radius
    load = line * width
    pair = Compliance(Interface(x, area, width), 2 * nn / width, 2 * nn / width)

    def press(worn, softening):
        return solve_forces(pair.normal + np.diag(softening), x, gap + worn, np.array([load]))[0]

    def path(worn):
        limit = mu * solve_forces(pair.normal, x, gap + worn, np.array([load]))[0]
        group = make_jenkins_set(pair.tangential, limit)
        slide = brentq(
            lambda q: group.stiffness @ np.minimum(q, group.yield_displacement) - 0.6 * mu * load,
            0.0,
            group.yield_displacement[-1],
            xtol=1e-22,
        )
        shear = np.zeros(x.size)
        shear[group.points] = group.force_matrix @ np.minimum(slide, group.yield_displacement)
        slips = (limit > 0) & (shear > limit * (1 - 1e-9))
        return np.where(slips, 4 * np.abs(slide - pair.tangential @ shear), 0.0)

    problem = WearProblem(press, path, area, 1e-13, 1e9)
    state = make_initial_wear_state(problem)
    count = 0
    initial_work = state.path @ state.force
    while state.cycle < problem.cycles:
        state = take_jump(problem, state, 1e-2)
        count = count + 1
    in_stick_zone = np.abs(x) < stick
    assert count < 60
    assert (state.path[in_stick_zone] == 0).all() and not state.depth[in_stick_zone].any()
    assert state.force[in_stick_zone].sum() == pytest.approx(load, rel=1e-9)
    assert state.path @ state.force < 1e-9 * initial_work
    centre_ratio = (state.force / area)[np.argmin(np.abs(x))] / peak
    assert centre_ratio == pytest.approx(
        stick / half + 0.6 * line / (np.pi * stick * peak), abs=2e-3
    )
