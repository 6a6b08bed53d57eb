"""Errors of the contact patch against closed forms: Hertz, a tilted punch, a wavy surface, a layered half plane."""

import sys
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "peers"))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import hertz_pair as hertz
import strip
from halfspace import press_periodic, wave_numbers

from patchfem.closed_forms import contact as exact
from patchfem.contact.unilateral import press
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity.elasticity import Layers, assemble, interface_compliance
from patchfem.mesh.tensor import TensorGrid, graded_rows

TITANIUM, CARBIDE = (121e9, 0.32), (250e9, 0.24)
COATED = Layers(CARBIDE, TITANIUM, "strain")
COATING = 152.4e-6  # [m]
PUNCH, PUNCH_LOAD, REACH = 1e-3, 1e5, 50  # half width b [m], [N/m], half length and height of the piece over b
WAVES = (80e-6, 0.5e-3, 2e-3)  # wave lengths [m] against a coating of 152 um
SHARES, LIGHT = (0.3, 0.5, 0.9, 0.99), (0.05,)  # mean pressure over that which closes the wavy gap


@cache
def hertz_errors(cells: int = 16) -> tuple:
    """Relative errors (p(0), half width) of the crowned pair with `cells` per half width."""
    return tuple(abs(e) for e in hertz.ours(cells, "mirror").errors[:2])


def punch_error(nodes: int, offset: float = 0.25) -> float:
    """Relative error of the rotation of a rigid flat punch, its load `offset` half widths off the middle.

    The nodes under the punch stand at b sin(pi s/2), s even; rows and columns grow from the cell at the corner by
    1.1^(64/cells). Rigid and only under |x| <= b: one piece's compliance, cut to those nodes.
    """
    growth = 1.1 ** (64 / (nodes - 1))
    under = PUNCH * np.sin(np.pi / 2 * np.linspace(-1, 1, nodes))
    under = (under - under[::-1]) / 2
    first = under[1] - under[0]
    beyond = PUNCH + np.cumsum(graded_rows(first * growth, (REACH - 1) * PUNCH, growth))
    depth = np.concatenate([[0.0], np.cumsum(graded_rows(first, REACH * PUNCH, growth))])
    grid = TensorGrid(np.concatenate([-beyond[::-1], under, beyond]), depth, 0)
    normal = interface_compliance(assemble(grid.x, depth, 0, Layers(TITANIUM, TITANIUM, "strain")))[0]
    kept = slice(beyond.size, beyond.size + nodes)
    alone = frozen_array(normal[kept, kept])
    weight = frozen_array(TensorGrid(under, depth, 0).tributary())
    state = press(Compliance(Interface(under, weight, 1.0), alone, alone), np.zeros(nodes), PUNCH_LOAD,
                  moment=PUNCH_LOAD * offset * PUNCH)
    modulus = exact.combined_modulus(*TITANIUM, np.inf, 0.0)
    return float(state.rotation / exact.punch_rotation(PUNCH_LOAD, PUNCH, modulus, offset * PUNCH) - 1)


@cache
def punch_errors(counts: tuple = (17, 33, 65), offset: float = 0.25) -> tuple:
    """`punch_error` without its sign for each count of nodes."""
    return tuple(abs(punch_error(count, offset)) for count in counts)


def punch_order() -> float:
    """Observed order of the rotation in the number of cells."""
    return float(-np.polyfit(np.log([16, 32, 64]), np.log(punch_errors()), 1)[0])


def westergaard_error(points: int = 64, shares: tuple = SHARES) -> float:
    """Largest relative error of p(0) over `shares` of the closing load, half-space solver, `points` per half wave."""
    wave, high = 80e-6, 1.5e-6
    modulus = exact.combined_modulus(*CARBIDE)
    x = (np.arange(2 * points) - points) * wave / (2 * points)
    waves = np.concatenate([[0.0], 2 / (modulus * wave_numbers(2 * points, wave)[1:])])
    errors = []
    for share in shares:
        mean = share * exact.westergaard_full_pressure(wave, high, modulus)
        state = press_periodic(waves, 2 * high * np.sin(np.pi * x / wave)**2, wave, mean * wave)
        errors.append(abs(state.pressure[points] / exact.westergaard_pressure(0.0, mean, wave, high, modulus) - 1))
    return float(max(errors))


def wavy_finite_elements_error(cells: int = 64, shares: tuple = SHARES) -> float:
    """The same for finite elements with `cells` per half wave between lines of symmetry."""
    wave, high = 80e-6, 1.5e-6
    modulus = exact.combined_modulus(*CARBIDE)
    pair = strip.wavy_pair(cells, wave, CARBIDE)
    errors = []
    for share in shares:
        mean = share * exact.westergaard_full_pressure(wave, high, modulus)
        state = strip.wavy_press(pair, share, high, modulus)
        errors.append(abs(state.sigma_n[0] / exact.westergaard_pressure(0.0, mean, wave, high, modulus) - 1))
    return float(max(errors))


def layered_error(cells: int = 64) -> float:
    """Largest relative error of C(k) of the coated piece over WAVES, `cells` per half wave."""
    return max(abs(strip.harmonic_compliance(strip.strip_grid(wave, cells, COATING), COATED)
                   / exact.layered_compliance(2 * np.pi / wave, CARBIDE, TITANIUM, COATING) - 1) for wave in WAVES)
