"""Identities that the contact of any pieces must keep to round-off: partial slip from pressing, force times gap."""

import sys
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "peers"))
import hertz_pair as hertz
from contact_accuracy import COATED, COATING

from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import press
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity.elasticity import assemble, interface_compliance
from patchfem.mesh.tensor import graded_grid
from patchfem.slip.shear_modes import jenkins_set

LENGTH, HEIGHT, LOAD = 12.7e-3, 6.35e-3, 26 * 4.4482216152605
MOUNTS = (0.0, 1e-5, 1e-4, 1e-3)  # tilts [rad]


def shear_identity_error() -> float:
    """Partial slip against the contact itself where C_tt = C_nn: q = mu [f(P) - f(P - Q/mu)] at the slide
    mu [delta(P) - delta(P - Q/mu)] (Ciavarella 1998, Jaeger 1998), exact for any discrete C.

    Largest of: nodal forces of the elements of `jenkins_set` against q over the largest mu f, and the slide of sticking
    nodes against the common slide.
    """
    grid, friction, worst = hertz.grid_of(16), 0.3, 0.0
    pair, gap = hertz.condensed(grid, 1), crown(grid.x, hertz.RADIUS)
    full = press(pair, gap, hertz.LOAD)
    force = full.sigma_n * pair.interface.weight
    group = jenkins_set(pair.normal, friction * force)
    for share in (0.1, 0.4, 0.8, 0.95):
        rest = press(pair, gap, (1 - share) * hertz.LOAD)
        slide = friction * (full.approach - rest.approach)
        want = friction * (force - rest.sigma_n * pair.interface.weight)
        found = np.zeros(force.size)
        found[group.points] = group.share @ np.minimum(slide, group.yield_slide)
        stick = (pair.normal @ want)[rest.sigma_n > 0]
        worst = max(worst, np.abs(found - want).max() / (friction * force.max()), np.abs(stick / slide - 1).max())
    return float(worst)


@cache
def coated_pair(nodes: int) -> Compliance:
    """Two of the coated pieces of the rig with `nodes` at the interface."""
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / (nodes - 1), COATING)
    normal, tangential, _ = interface_compliance(assemble(grid.x, grid.depth, grid.coating_rows, COATED))
    return Compliance(Interface(grid.x, frozen_array(LENGTH * grid.tributary()), LENGTH),
                      frozen_array(2 * normal / LENGTH), frozen_array(2 * tangential / LENGTH))


def complementarity(nodes: int = 200) -> float:
    """Largest relative sum of |force * gap| over flat, tilted, crowned pieces and loads off the middle."""
    pair = coated_pair(nodes)
    x = pair.interface.x
    states = [press(pair, tilt(x, angle), LOAD, rotation=angle) for angle in MOUNTS]
    states += [press(pair, crown(x, radius), LOAD) for radius in (1.0, 10.0)]
    states += [press(pair, 0 * x, LOAD, moment=share * LENGTH * LOAD) for share in (0.2, 0.4)]
    return max(state.residuals["complementarity"] for state in states)
