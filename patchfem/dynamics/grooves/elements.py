"""The contact of a law of constant load, `friction.protocol.Element`, along the flanks of grooves."""

from dataclasses import dataclass

import numpy as np

from ...friction.grooves import STEADY, Grooves, Swing
from ...friction.protocol import Element
from ..contacts.arrays import Flanked
from .climbing import BEFORE, NORMAL, RAISED, VERTICAL, FlankModel
from .run import refuse_heavy

HERE = "dynamics.grooves.element_kernels"


def model_of(grooves: Grooves, load: float, static: float, element: Element, modes) -> "ElementsModel":
    """The model of a law, `element`, under the load [N]; PatchfemError as of `run.refuse_heavy`.

    modes: of the rig, None of a bench.
    """
    if modes is not None:
        refuse_heavy(grooves, static, modes)
    return ElementsModel(grooves, load, static, element)


@dataclass(frozen=True, eq=False, slots=True)
class ElementsModel(FlankModel):
    """What `march.march` needs to know: grooves under a load [N], the static coefficient [1] and the law of a contact
    under that load, which `element_kernels` takes to the normal force of the flank; swing: as of a ClimbingModel."""

    grooves: Grooves
    load: float
    static: float
    element: Element
    swing: Swing = STEADY

    @property
    def kind(self) -> tuple:
        """(contact, law): what the hub takes an instance of its loop for."""
        return HERE, self.element.kernels

    @property
    def length(self) -> float:
        """Slide over which the law stretches before it slips [m]."""
        return self.element.length

    def build(self, hub=None) -> tuple:
        """(Flanked, None) with arrays of their own, at rest at the slide 0."""
        g, law, at, begin = self.grooves, self.element, np.zeros(16), float(self.swing.about(self.load, 0.0))
        normal = begin * np.hypot(1.0, float(g.slope(0.0)))
        at[[VERTICAL, BEFORE, NORMAL, RAISED]] = begin, normal, normal, begin * g.height(0.0)
        swing = self.swing.amplitude, self.swing.omega, self.swing.phase
        flank = np.array([self.load, g.wave, g.amplitude, g.phase, g.lifted_mass, -1.0, *swing])
        bound = law.limit if law.bounded else np.inf
        return Flanked(flank, at, np.array(law.numbers[None]), np.array(law.memory[None]),
                       np.array(law.memory[None]), np.array([bound])), None

    def shown(self, contact) -> dict:
        """Nothing: all points share its stretch."""
        return {}
