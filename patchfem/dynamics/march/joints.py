"""Models of interfaces and nonlinear springs that supplement or replace a patch."""

from dataclasses import dataclass

import numpy as np

from ...friction.protocol import Element
from ..interfaces.dispatch import COULOMB_LAW
from .models import IDLE_KIND, ContactModel, Joint, frictionless_model


def make_cubic_spring(port: int, stiffness: float) -> Joint:
    """Return a cubic spring on a port, whose restoring force is k_3 q^3 [N].

    stiffness: k_3 [N/m3].

    """
    return _make_spring(port, [0.0, stiffness, 0.0, 1.0], lambda q: 0.25 * stiffness * q**4)


def make_interlocking_spring(port: int, stiffness: float, wavelength: float) -> Joint:
    """Return a spring on a port whose restoring force is sinusoidal, as for interlocking peaks.

    The force is k lambda/(2 pi) sin(2 pi q/lambda) [N].

    Parameters
    ----------
    port : int
    stiffness : float
        Stiffness k at rest [N/m].
    wavelength : float
        Wavelength lambda [m].

    Returns
    -------
    Joint
    """
    turn = 2 * np.pi / wavelength
    return _make_spring(
        port,
        [0.0, 0.0, stiffness, wavelength],
        lambda q: 2 * stiffness * (np.sin(0.5 * turn * q) / turn) ** 2,
    )


def _make_spring(port: int, numbers, potential) -> Joint:
    law = "dynamics.interfaces.spring_kernels"
    return Joint(port, Element(law, np.array(numbers), np.zeros(0), 0.0, 0.0, False), potential)


@dataclass(frozen=True, eq=False, slots=True)
class JointsModel:
    """Model of friction elements and springs that supplement or replace a patch.

    A patch with set-valued friction becomes the first of the joints, because all set-valued elements are
    solved together.

    - `patch`: the contact on port 0, or None.
    - `joints`: the elements.
    - `rows` (p, n): slide of every port per modal coordinate.
    - `scale`: reference force for the residuals of springs [N].
    - `also`: modules of further laws in the loop, so that models with several sets of laws share one
      loop.
    """

    patch: ContactModel | None
    joints: tuple
    rows: np.ndarray
    scale: float
    also: tuple = ()
    loading = ""  # constant loads

    def __post_init__(self):
        if self.patch is not None and self.patch.set_valued:
            object.__setattr__(self, "joints", (Joint(0, self.patch.element), *self.joints))
            object.__setattr__(self, "patch", None)

    @property
    def limit(self) -> float:
        """Sum of the friction limits of patch and joints [N]."""
        patch_limit = self.patch.limit if self.patch is not None else 0.0
        return patch_limit + sum(joint.element.limit for joint in self.joints)

    @property
    def length(self) -> float:
        """Bond length [m] of the patch, or of the first interface if there is no patch."""
        return self.patch.length if self.patch is not None else self.joints[0].element.length

    @property
    def reduction(self):
        """Shear modes to which the patch was reduced (see `ContactModel.reduction`).

        The result is None if there is no patch.
        """
        return self.patch.reduction if self.patch is not None else None

    @property
    def set_valued(self) -> bool:
        """Return whether the patch, or the first interface if there is no patch, sticks rigidly."""
        return (
            self.patch.set_valued if self.patch is not None else not self.joints[0].element.kernels
        )

    @property
    def laws(self) -> tuple:
        """Distinct compiled law modules of the joints."""
        return tuple(
            sorted({*self.also, *(joint.element.kernels or COULOMB_LAW for joint in self.joints)})
        )

    @property
    def kind(self) -> tuple:
        """Contact module and law module of the patch (see `ContactModel.kind`).

        If there is no patch, they are those of an inactive contact.

        """
        return self.patch.kind if self.patch is not None else IDLE_KIND

    def get_plot_fields(self, contact) -> dict:
        """Return the contact memory of the patch as fields for plotting."""
        return self.patch.get_plot_fields(contact) if self.patch is not None else {}

    def allocate_contact(self):
        """Allocate the contact arrays of the patch, or of an inactive point if there is no patch."""
        return (self.patch or frictionless_model()).allocate_contact()
