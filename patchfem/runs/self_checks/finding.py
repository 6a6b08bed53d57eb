"""Comparison of a number of the run with a second computation, and common thresholds."""

from typing import NamedTuple

import numpy as np

# Relative round-off error; sums of some hundred terms of double precision stay below 1e-12.
ROUND_OFF_TOL = 1e-9
# Relative load residual; the contact solver balances the load to 1e-9 or better.
CONTACT_RESIDUAL_TOL = 1e-6
# Factor on the stated error of a measure, because an error stated slightly too small is no fault.
STATED_ERROR_FACTOR = 10.0
# Relative difference of two evaluations of one smooth curve on a mesh or on samples.
EVALUATION_TOL = 0.01
# Relative error of cubics through samples, for motions of up to a radian per step.
CUBIC_QUADRATURE_TOL = 2e-3
ROUTE_OF_UPPER_BOUND = "from the values of the scene at most"
ROUTE_OF_LOWER_BOUND = "from the values of the scene at least"


class Finding(NamedTuple):
    """Comparison of a measure of a run with an independent computation of the same quantity.

    - quantity: name of the number.
    - found, expected: number of the run, and the second one.
    - threshold: largest difference in a correct run.
    - unit: unit of the numbers.
    - route: description of the second computation.
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
        """Difference between the measure and its independent computation."""
        return max(abs(self.found - self.expected), self.phase_difference)

    @property
    def has_failed(self) -> bool:
        """Whether the difference exceeds the threshold.

        It is False for a number that is not finite, which other checks report.

        Such a number is left to other checks.
        """
        return bool(np.isfinite(self.difference) and self.difference > self.threshold)

    @property
    def sentence(self) -> str:
        """Sentence that states both values and their difference."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"a self-check of the run failed: {self.quantity} is {self.found:.6g}{unit}, but "
            f"{self.route} it is {self.expected:.6g}{unit}; they differ by {self.difference:.2g}{unit} (limit "
            f"{self.threshold:.2g}{unit}); do not use this result, and report it with the scene and what "
            "`patchfem doctor` prints"
        )
