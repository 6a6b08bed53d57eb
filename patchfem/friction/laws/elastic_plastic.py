"""The elastic-plastic law of eq. 3.12, extended to reversals.

As printed, eq. 3.12 sets dF/dt = 0 for |F| > mu N and so never unloads; here dF/dt is zero only while slip continues.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import SteadyLoop


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """Friction law of eq. 3.12: springs of stiffness mu sigma/length that slip at a traction mu sigma.

    An increase of the pressure adds unstretched springs. A decrease only lowers the limit; the springs beyond it break
    within one length of slip. So a change of the pressure creates no energy, and a force below the limit stays.

    Under a load N(t) the stiffness K rises to mu N/length wherever N exceeds K length/mu, and stays while N falls. In
    stick F' = K q'. In slip |F| = mu N, and K' = -(K - mu N/length) v/length with the rate v >= 0 of irreversible slip.
    The slip is q - F/K. A contact that opens loses all springs.

    - static: mu [1]
    - length: relative displacement [m] at which an unstretched spring slips
    """

    static: float
    length: float

    def elements(self, load: float) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness [N/m] and yield displacement [m] (1,) under a load [N]."""
        return np.array([self.static * load / self.length]), np.array([self.length])

    def steady_loop(self, load: float, amplitude) -> SteadyLoop:
        """Return the steady loops under a load [N] at amplitudes [m] of the relative displacement."""
        return masing_loop(*self.elements(load), amplitude)


def masing_loop(stiffness, yield_displacement, amplitude) -> SteadyLoop:
    """Return the steady loops of parallel elastic-plastic elements.

    At an amplitude u, an element has the force k min(u, w), and the area 4 k w (u - w) if it slips.

    Parameters
    ----------
    stiffness, yield_displacement : (t,) array
        Stiffness k [N/m] and yield displacement w [m] of each element.
    amplitude : float or array
        Amplitudes u [m] of the relative displacement.

    Returns
    -------
    SteadyLoop
    """
    slips = np.maximum(np.asarray(amplitude)[..., None] - yield_displacement, 0.0)
    force = amplitude * np.sum(stiffness) - slips @ stiffness
    return SteadyLoop(force, 4 * slips @ (stiffness * yield_displacement))


def from_keys(friction, load: float) -> ElasticPlastic:
    """Return the elastic-plastic law that a [friction] table defines; a stiffness in it is that under the load [N]."""
    if friction.stiffness is None:
        return ElasticPlastic(friction.static, friction.bond_length)
    return ElasticPlastic(friction.static, friction.static * load / friction.stiffness)
