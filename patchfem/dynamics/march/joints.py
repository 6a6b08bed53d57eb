"""Interfaces and nonlinear springs in addition to the patch or in its place, in a march."""

from dataclasses import dataclass, replace

import numpy as np

from ...friction.protocol import Element
from ..interfaces.dispatch import COULOMB_LAW
from .models import IDLE_KIND, ContactModel, Joint, frictionless_model


def make_cubic_spring(port: int, stiffness: float) -> Joint:
    """Return a spring on a port with the restoring force k_3 q^3 [N]; stiffness is k_3 [N/m3]."""
    return _make_spring(port, [0.0, stiffness, 0.0, 1.0], lambda q: 0.25 * stiffness * q**4)


def make_interlocking_spring(port: int, stiffness: float, wavelength: float) -> Joint:
    """Return a spring on a port with the force k lambda/(2 pi) sin(2 pi q/lambda) [N] of interlocking peaks.

    Parameters
    ----------
    port : int
    stiffness : float
        k [N/m], at rest.
    wavelength : float
        lambda [m].

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


def pair_plane_joints(joints, planes) -> list:
    """Return joints of interfaces (i,) with those of the second directions of the ones that slide in a plane.

    They act on the ports of their numbers, and the second directions on ports from i on; planes (i,) says
    which have one.
    """
    count = len(joints)
    second = [k for k, plane in enumerate(planes) if plane]
    out = list(joints)
    for at, k in enumerate(second, count):
        out[k] = replace(joints[k], mate=at - k)
        out.append(replace(joints[k], port=at, mate=k - at))
    return out


@dataclass(frozen=True, eq=False, slots=True)
class JointsModel:
    """Elements in addition to a contact, or in its place.

    A patch with set-valued friction becomes the first of the joints, because all set-valued elements are
    solved together.

    - `patch`: the contact on port 0, or None.
    - `joints`: the elements.
    - `rows` (p, n): slide of every port per coordinate.
    - `scale`: force to which residuals of springs are compared [N].
    - `also`: modules of further laws that the loop has, so that models of several sets of laws share one
      loop.
    """

    patch: ContactModel | None
    joints: tuple
    rows: np.ndarray
    scale: float
    also: tuple = ()
    loading = ""  # the loads are constant

    def __post_init__(self):
        if self.patch is not None and self.patch.set_valued:
            object.__setattr__(self, "joints", (Joint(0, self.patch.element), *self.joints))
            object.__setattr__(self, "patch", None)

    @property
    def limit(self) -> float:
        """Friction limit of patch and joints together [N]."""
        return (self.patch.limit if self.patch is not None else 0.0) + sum(
            joint.element.limit for joint in self.joints if joint.mate >= 0
        )

    @property
    def length(self) -> float:
        """Bond length of the patch, or else of the first interface [m]."""
        return self.patch.length if self.patch is not None else self.joints[0].element.length

    @property
    def reduction(self):
        """ShearModes from which the patch was reduced (`ContactModel.reduction`).

        The result is None without patch.
        """
        return self.patch.reduction if self.patch is not None else None

    @property
    def set_valued(self) -> bool:
        """Whether the patch, or else the first interface, holds without any stretch."""
        return (
            self.patch.set_valued if self.patch is not None else not self.joints[0].element.kernels
        )

    @property
    def laws(self) -> tuple:
        """Modules of the compiled laws, each once."""
        return tuple(
            sorted({*self.also, *(joint.element.kernels or COULOMB_LAW for joint in self.joints)})
        )

    @property
    def kind(self) -> tuple:
        """Kind of the patch's contact (`ContactModel.kind`); that of an idle contact without a patch."""
        return self.patch.kind if self.patch is not None else IDLE_KIND

    def picture_fields(self, contact) -> dict:
        """Return the fields of the patch's memory for pictures (`ContactModel.picture_fields`)."""
        return self.patch.picture_fields(contact) if self.patch is not None else {}

    def build(self):
        """Return the contact of the patch with newly allocated arrays; an idle point without a patch."""
        return (self.patch or frictionless_model()).build()
