"""Comparison of a number of the run with a second computation, and the common thresholds."""

from typing import NamedTuple

import numpy as np

# Largest relative round-off error; sums of some hundred terms in double precision stay below 1e-12.
ROUND_OFF_TOL = 1e-9
# Largest relative residual of the load; the contact solver reaches 1e-9 or less.
CONTACT_RESIDUAL_TOL = 1e-6
# Factor on the error estimate of a measure, because a slightly too small estimate is no fault.
STATED_ERROR_FACTOR = 10.0
# Largest relative difference of two evaluations of a smooth curve on a mesh or on samples.
EVALUATION_TOL = 0.01
# Largest relative error of cubics through samples, for motions of up to a radian per step.
CUBIC_QUADRATURE_TOL = 2e-3
ROUTE_OF_UPPER_BOUND = "from the values of the scene at most"
ROUTE_OF_LOWER_BOUND = "from the values of the scene at least"


class Finding(NamedTuple):
    """Comparison of a number of a run with an independent computation of the same quantity.

    - quantity: name of the quantity.
    - found, expected: number of the run, and that of the second computation.
    - threshold: largest difference in a correct run.
    - unit: unit of the numbers.
    - route: description of the second computation.
    - phase_difference: absolute difference of two complex numbers or of two curves, whose
      magnitudes are `found` and `expected`; 0 for real numbers.
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
        """Absolute difference between the number of the run and the second computation."""
        return max(abs(self.found - self.expected), self.phase_difference)

    @property
    def has_failed(self) -> bool:
        """Whether the difference exceeds the threshold.

        It is False for a difference that is not finite, because other checks report such numbers.
        """
        return bool(np.isfinite(self.difference) and self.difference > self.threshold)

    @property
    def sentence(self) -> str:
        """Warning that gives both numbers, their difference and the threshold."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"a self-check of the run failed: {self.quantity} is {self.found:.6g}{unit}, but "
            f"{self.route} it is {self.expected:.6g}{unit}; they differ by {self.difference:.2g}{unit} (limit "
            f"{self.threshold:.2g}{unit}); do not use this result, and report it with the scene and what "
            "`patchfem doctor` prints"
        )
