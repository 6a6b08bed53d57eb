"""A number of a run by two routes, and the thresholds that several checks share."""

from typing import NamedTuple

import numpy as np

ROUND_OFF = 1e-9  # relative; sums of some hundred terms of double precision stay below 1e-12
CONTACT_RESIDUAL = 1e-6  # relative; the contact solve balances the load to 1e-9 or better
STATED_ERRORS = 10.0  # times the stated error of a measure; an error that is too small is no fault
READING = 0.01  # relative; two readings of one smooth curve on a mesh or on samples
CUBIC_QUADRATURE = 2e-3  # relative; cubics through samples, for motions of up to a radian a step
AT_MOST = "from the values of the scene at most"
AT_LEAST = "from the values of the scene at least"


class Finding(NamedTuple):
    """A number of the run, the same number by another route, and by how much the two may differ.

    route: words for the second number; phase_difference: |difference| of two complex numbers or of
    two curves, of which `found` and `expected` are the sizes.
    """

    quantity: str
    found: float
    expected: float
    threshold: float
    unit: str = ""
    route: str = "from the values of the scene"
    phase_difference: float = 0.0

    @property
    def difference(self) -> float:
        """By how much the two numbers differ."""
        return max(abs(self.found - self.expected), self.phase_difference)

    @property
    def is_failed(self) -> bool:
        """Whether the difference exceeds the threshold; a number that is not finite is left to
        other checks."""
        return bool(np.isfinite(self.difference) and self.difference > self.threshold)

    @property
    def sentence(self) -> str:
        """Sentence with both numbers for a person."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"a self-check of the run failed: {self.quantity} is {self.found:.6g}{unit}, but "
            f"{self.route} it is {self.expected:.6g}{unit}; they differ by {self.difference:.2g}{unit} (limit "
            f"{self.threshold:.2g}{unit}); do not use this result, and report it with the scene and what "
            "`patchfem doctor` prints"
        )
