"""Contact points of a rig or a bench, whose laws are functions of blocks of points."""

from ..points import contacts
from . import systems
from .step_rows_kernels import Law

PointSet = contacts.PointSet


class Contact(contacts.Contact):
    """Interfaces and springs of a rig; the fields are those of `points.contacts.Contact`, with a `laws.PointLaw` each."""

    @property
    def engine(self):
        """Module that makes the arrays and loads the kernels."""
        return systems

    def is_rigid(self, point_set) -> bool:
        """Return whether a set of points sticks without displacement."""
        return point_set.law.law == Law.COULOMB
