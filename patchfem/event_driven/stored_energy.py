"""Energy that the friction interfaces of a case store in a state: stretched springs and bonds, and a lifted load."""

from typing import NamedTuple

import numpy as np

from .. import friction
from .cases import Case
from .laws import LAWS, masing
from .records import Face, LawNumbers, Memory


class InterfaceState(NamedTuple):
    """State of one interface.

    - p (k,): numbers of the law, in the order that its module names
    - s (j,): states of the law, in the order that its module names
    - memory (l,): row of `records.State.memory`
    - load, slide, velocity: mean normal load [N], relative displacement [m] and velocity [m/s]
    """

    p: np.ndarray
    s: np.ndarray
    memory: np.ndarray
    load: float
    slide: float
    velocity: float


def compute_stored_energy(case: Case, memory) -> float:
    """Return the energy [J] that the friction interfaces store at the start of a case.

    Parameters
    ----------
    case : Case
        Rig with the state at its start.
    memory : (M, l) array
        Memory of the interfaces at the start (`records.State.memory`).
    """
    n = case.rig.modes.shape[1]
    slides = case.rig.rows[0] @ case.y[:n]
    velocities = case.rig.rows[0] @ case.y[n : 2 * n]
    energy = 0.0
    for i, face in enumerate(case.rig.faces[: case.n_friction]):
        find_energy = ENERGY_OF_LAW.get(LAWS[int(face[Face.LAW])])
        if find_energy is None:
            continue
        first = 2 * n + int(face[Face.FIRST_STATE])
        states = case.y[first : first + int(face[Face.N_STATES])]
        numbers = face[Face.NUMBERS :]
        motion = (face[Face.MEAN], slides[i], velocities[i])
        energy += float(find_energy(InterfaceState(numbers, states, memory[i], *motion)))
    return energy


def _stretch_elements(now: InterfaceState) -> float:
    """Return the energy [J] of parallel elements, whose stretches follow from the reversals that the law remembers."""
    p = now.p
    if p[1] >= 0:
        stiffness = p[2] * (1 + p[1]) / (p[1] + (p[0] + 1) / (p[0] + 2)) / p[3]
        stiffness, limit = friction.laws.iwan.slider_cells(p[2], stiffness, p[0], p[1])
    else:
        stiffness, limit = masing.list_elements(LawNumbers("masing", p))

    count = int(now.memory[Memory.COUNT])
    reversals = now.memory[Memory.STACK :: 2][:count]
    stretch = np.zeros(limit.size)
    for step in np.diff([0.0, *reversals, now.slide - now.memory[Memory.ORIGIN]]):
        stretch = np.clip(stretch + step, -limit, limit)
    return 0.5 * stiffness @ stretch**2


def _lift_load(now: InterfaceState) -> float:
    """Return the potential energy [J] of the load on the flanks of grooves, and the kinetic energy of what they lift."""
    amplitude, wave_number, phase, mass = now.p[3:7]
    angle = wave_number * now.slide - phase
    climb = amplitude * wave_number * np.sin(angle) * now.velocity
    return now.load * amplitude * (1 - np.cos(angle)) + 0.5 * mass * climb**2


# The spring of Bouc-Wen's law has the stiffness mu N/eps, the bristles of LuGre's law N c, and bonds mu N/eps_0; the
# springs that come with the load have mu s/eps and the force mu y.
ENERGY_OF_LAW = {
    "masing": _stretch_elements,
    "bouc_wen": lambda now: 0.5 * now.p[0] * now.load * now.p[1] * now.s[0] ** 2,
    "lugre": lambda now: 0.5 * now.load * now.p[2] * now.s[0] ** 2,
    "bonds": lambda now: 0.5 * now.p[0] * now.load / now.p[1] * now.s[2],
    "pressed_springs": lambda now: (
        0.5 * now.p[0] * now.p[1] * now.s[0] ** 2 / max(now.s[1], 1e-300)
    ),
    "grooves": _lift_load,
    "smooth_grooves": _lift_load,
}
