"""Number of a run by two computations, and the thresholds that several checks share."""

from typing import NamedTuple

import numpy as np

ROUND_OFF = 1e-9  # relative; sums of some hundred terms of double precision stay below 1e-12
CONTACT_RESIDUAL = 1e-6  # relative; the contact solver balances the load to 1e-9 or better
# factor on the stated error of a measure; a stated error that is too small is no fault
STATED_ERRORS = 10.0
READING = 0.01  # relative; two evaluations of one smooth curve on a mesh or on samples
# relative; error of cubics through samples, for motions of up to a radian per step
CUBIC_QUADRATURE = 2e-3
AT_MOST = "from the values of the scene at most"
AT_LEAST = "from the values of the scene at least"


class Finding(NamedTuple):
    """Number of the run, the same number by another computation, and their largest difference.

    - quantity: name of the number.
    - found, expected: number of the run, and the second one.
    - threshold: largest difference in a correct run.
    - unit: unit of the numbers.
    - route: words for the second computation.
    - phase_difference: |difference| of two complex numbers or two curves, of which `found` and
      `expected` are the magnitudes.
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
        """Difference of the two numbers."""
        return max(abs(self.found - self.expected), self.phase_difference)

    @property
    def has_failed(self) -> bool:
        """Whether the difference exceeds the threshold; False for a number that is not finite.

        Such a number is left to other checks.
        """
        return bool(np.isfinite(self.difference) and self.difference > self.threshold)

    @property
    def sentence(self) -> str:
        """Sentence with both numbers."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"a self-check of the run failed: {self.quantity} is {self.found:.6g}{unit}, but "
            f"{self.route} it is {self.expected:.6g}{unit}; they differ by {self.difference:.2g}{unit} (limit "
            f"{self.threshold:.2g}{unit}); do not use this result, and report it with the scene and what "
            "`patchfem doctor` prints"
        )
