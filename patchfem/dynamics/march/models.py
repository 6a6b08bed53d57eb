"""From the results of the stages to the arrays of a contact in the compiled hub: one function per law."""

from dataclasses import dataclass

import numpy as np

RATE = 4  # kind of a force that follows the speed, as in loop_kernels


@dataclass(frozen=True, eq=False, slots=True)
class ContactModel:
    """What the hub needs to know of an interface; `build()` makes fresh arrays, so a model can be run many times.

    kind as in loop_kernels; limit: friction limit [N]; fields: keyword arrays of loop_kernels.Contact; follow:
    pressure stays on the lower piece; length: bond length for the stick criterion [m]; reduction: the JenkinsSet or
    ShearModes behind the arrays.
    """

    kind: int
    limit: float
    fields: dict
    follow: bool = False
    length: float = 0.0
    reduction: object = None

    def build(self, hub):
        """(Contact, Work) with arrays of their own."""
        empty = {name: np.zeros((0, 0)) if name in ("psi", "bonds", "bondlist") else np.zeros(0)
                 for name in hub.Contact._fields}
        empty["growth"] = np.append(np.full(5, -1.0), 0.0)
        arrays = {k: np.array(v, dtype=np.float64, order="C") for k, v in (empty | self.fields).items()}
        contact = hub.Contact(**arrays)
        r = contact.kappa.size
        scale = np.ones(1 + r)
        if r:
            scale[1:] = self.limit / np.maximum(contact.psi @ (contact.weight * contact.source), 1e-300)
            scale[1:] = np.minimum(np.abs(scale[1:]), 1 / np.sqrt((contact.psi**2).mean(axis=1)))
        work = hub.Work(np.zeros(1 + r), np.zeros(1 + r), np.zeros((1 + r, 1 + r)), np.zeros((3, contact.weight.size)),
                        np.zeros(1 + r), np.zeros(1 + r), scale, np.zeros((2, 1 + r)), np.full(1, self.length))
        return contact, work


def coulomb_model(static: float, kinetic: float) -> ContactModel:
    """Rigid Coulomb contact with static and kinetic friction force [N]."""
    return ContactModel(0, static, {"force": [static, kinetic, static]})


def rate_model(limit: float, speed: float) -> ContactModel:
    """Friction limit*tanh(v/speed) of eq. 2.4, limit [N], speed v_0 [m/s]."""
    return ContactModel(RATE, limit, {"force": [limit, speed, limit]})


def jenkins_model(stiffness, yield_slide) -> ContactModel:
    """Parallel Jenkins elements (t,) [N/m], [m]."""
    limit = float(np.dot(stiffness, yield_slide))
    fields = {"force": [limit, limit, limit], "stretch": np.zeros(len(stiffness)), "stiffness": stiffness,
              "limit": yield_slide, "now": np.zeros(3)}
    return ContactModel(1, limit, fields)


def growth_numbers(law) -> np.ndarray:
    """(a_s, l_k, v_h, eps_0, eps_k) of eq. 2.10, a_s = -1 for a constant bond length, and the breakaway share."""
    if not law.grows:
        return np.array([-1.0, 1.0, 1.0, law.length, law.length, law.breakaway])
    return np.array([law.rest_growth, law.slip_growth, law.rest_speed, law.length, law.ratio * law.length,
                     law.breakaway])


def points_model(law, area, sigma, shear=None, pattern=None) -> ContactModel:
    """Bond points (stretch reading, p = 1) on nodal areas (m,) [m2] under sigma (m,) [Pa].

    shear: ShearModes of the contact set or None for a rigid slide; pattern: (x, sigma on x) when the pressure stays on
    the lower piece, `area` and `sigma` then belong to the points of the upper one. ValueError for both together.
    """
    if shear is not None and pattern is not None:
        raise ValueError("shear modes and a pressure that stays on the lower piece cannot be combined")
    area, sigma = np.asarray(area, float), np.asarray(sigma, float)
    places = np.zeros(0) if pattern is None else pattern[0]
    if shear is not None:
        area, sigma = area[shear.points], sigma[shear.points]
    bonds = np.zeros((5 if law.breakaway else 4, area.size))
    bonds[0] = law.initial * sigma
    limit = law.static * float(area @ sigma)
    fields = {"force": [limit, limit, limit], "weight": law.static * area / law.length, "bonds": bonds,
              "source": sigma, "growth": growth_numbers(law)}
    if shear is not None:
        fields |= {"psi": np.asarray(shear.shape).T, "kappa": shear.stiffness, "b": np.zeros(shear.stiffness.size)}
    if pattern is not None:
        fields |= {"place": places, "x": pattern[0], "sigma": pattern[1]}
    return ContactModel(2, limit, fields, pattern is not None, law.length)


def list_model(law, limit: float, reach: float, merge: float) -> ContactModel:
    """One shared bond list for a rigid slide: any order, either reading; limit = mu_s N [N].

    reach: cut-off in bond lengths; merge: widest merged strip in bond lengths at zero age, 0 merges nothing.
    """
    from ...friction.bonds.bond_list import law_numbers, room, share_table

    fields = {"force": [limit, limit, (1 + law.initial) * limit], "bondlist": np.zeros((10, room(law, reach, merge))),
              "now": [0.0, 0.0, 0.0, 0.0, law.length, 0.0], "tally": np.zeros(12),
              "law": law_numbers(law, reach, merge), "table": share_table(law), "growth": growth_numbers(law)}
    return ContactModel(3, limit, fields, False, law.length)
