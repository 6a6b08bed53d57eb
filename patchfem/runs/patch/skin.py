"""Smooth skins of asperities between the pieces of a scene: the law, the pressed state, its linearised compliance."""

import numpy as np

from ...contact import skin, skin_laws
from ...core import Compliance, Pressure, frozen_array
from ...model.pieces import piece_of

BEARING = 1e-13  # share of the largest pressure from which a node of a smooth skin counts as in contact


def skin_law(contact):
    """The smooth law of a scene's asperities: ExponentialSkin or HertzSkin."""
    part = contact.asperities
    if part.law == "exponential":
        pressure = part.normal_stiffness * part.decay_length if part.normal_stiffness is not None else None
        return skin_laws.ExponentialSkin(part.decay_length, pressure)
    faces = [coat.material if coat else substrate for _, substrate, coat in
             (piece_of(contact, side) for side in ("lower", "upper"))]
    modulus = 1 / sum((1 - face.poisson**2) / face.young for face in faces)
    return skin_laws.HertzSkin(part.radius, part.density, part.height_deviation, modulus)


def mean_stiffness(contact, pressure: float) -> float:
    """Normal stiffness [Pa/m] of the scene's skin under the even `pressure` [Pa]; 0 for a smooth skin without one."""
    if contact.asperities.law == "linear":
        return contact.asperities.normal_stiffness
    law = skin_law(contact)
    if isinstance(law, skin_laws.ExponentialSkin):
        return pressure / law.u0
    return float(law.stiffness(law.separation(np.array([pressure])))[0]) if pressure > 0 else 0.0


def borne(pressure) -> np.ndarray:
    """Pressure (..., m) [Pa] of a smooth skin without the nodes below BEARING of the largest: the law never ends, but
    what it leaves there is less than the balance of the load is solved to, and further out less than any number."""
    return np.where(pressure > BEARING * pressure.max(), pressure, 0.0)


def behind_skin(contact, pieces: Compliance, gap, angle: float, moment, spring: float) -> tuple:
    """(Compliance with the skin linearised at the operating point, Pressure, SkinState) of a smooth skin.

    The gap of the Pressure is the separation of the mean planes, below zero where the skin is crushed.
    """
    interface = pieces.interface
    by = contact.approach.distance if contact.approach is not None else None
    load = contact.load if by is None else None
    state = skin.solve(skin_law(contact), pieces.normal, interface.x, interface.weight, gap, load,
                       moment if by is None else None, by, angle, spring=spring if by is None else 0.0)
    answer = Pressure(frozen_array(borne(state.pressure)), state.separation, state.delta, state.theta, state.load,
                      state.moment, state.outcome, state.iterations, state.residuals)
    stiff = np.maximum(state.stiffness * interface.weight, 1e-300)
    crush = np.diag(1 / np.maximum(stiff, BEARING * stiff.max()))  # nodes that carry nothing stay finite
    ratio = contact.asperities.tangential_ratio
    tangential = pieces.tangential + crush / ratio if ratio is not None else pieces.tangential
    return Compliance(interface, frozen_array(pieces.normal + crush), frozen_array(tangential)), answer, state
