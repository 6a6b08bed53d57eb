"""The elastic-plastic law of eq. 3.12, extended to reversals.

As printed, eq. 3.12 sets dF/dt = 0 for |F| > mu N and so never unloads; here dF/dt is zero only while slip continues.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import Element, SteadyLoop, Step


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """Friction law of eq. 3.12: springs of stiffness mu sigma/length that slip at a traction mu sigma.

    An increase of the pressure adds unstretched springs. A decrease only lowers the limit; the springs beyond it break
    within one length of slip. So a change of the pressure creates no energy, and a force below the limit stays.

    - static: mu [1]
    - length: relative displacement [m] at which an unstretched spring slips
    """

    static: float
    length: float

    def element(self, load: float) -> Element:
        """Return the Element under a constant load N [N]: a spring mu N/eps that slips at the force mu N."""
        stiffness = self.static * load / self.length
        return parallel_element([stiffness], [self.length])._replace(length=self.length)

    def initial_state(self, sigma):
        """Return the initial state (2, m) [Pa]: traction/mu, and density of the springs.

        The springs are unstretched, of the density of the pressure sigma (m,) [Pa].
        """
        return np.stack([np.zeros_like(sigma), sigma])

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """Advance the law by an increment at the mean pressure of the step.

        The traction is a ramp that is cut at mu sigma, whose path mean is exact.

        Parameters
        ----------
        state : (2, m) array
            Traction/mu [Pa] and density of the springs [Pa].
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures [Pa] at the ends.
        dt : float
            Not used.

        Returns
        -------
        Step
        """
        # Springs stretch until y = traction/mu reaches sigma; `elastic` is that fraction of the increment
        sigma = (s0 + s1) / 2
        y0, springs = self._limit_traction(state, sigma)
        change = springs * dq / self.length
        y1 = np.clip(y0 + change, -sigma, sigma)
        elastic = np.divide(y1 - y0, change, out=np.zeros_like(y0), where=change != 0)
        mean = np.where(change != 0, elastic * (y0 + y1) / 2 + (1 - elastic) * y1, y0)

        # Springs beyond the limit break within one length of slip (class docstring)
        remaining = np.minimum(sigma, springs)
        decay = np.exp(-(1 - elastic) * abs(dq) / self.length)
        springs = remaining + (springs - remaining) * decay
        after = np.where(s1 > 0, np.stack([y1, springs]), 0.0)

        energy_gain = self.stored_energy(after) - self.stored_energy(state)
        return Step(self.static * mean, self.static * mean * dq - energy_gain, after)

    def press(self, state, s0, s1) -> Step:
        """Change the pressure at rest; energy of spring stretch beyond the new friction limit is lost.

        Parameters
        ----------
        state : (2, m) array
            Traction/mu [Pa] and density of the springs [Pa].
        s0, s1 : (m,) array
            Pressures [Pa] before and after.

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        after = np.stack(self._limit_traction(state, s1))
        return Step(
            self.traction(after), self.stored_energy(state) - self.stored_energy(after), after
        )

    def _limit_traction(self, state, sigma):
        """Return traction/mu and spring density after a pressure change, or 0 where the pressure is zero."""
        y, springs = state
        return np.clip(y, -sigma, sigma), np.where(sigma > 0, np.maximum(springs, sigma), 0.0)

    def traction(self, state):
        """Return the traction (m,) [Pa] in a state, positive against slip to +x."""
        return self.static * state[0]

    def stored_energy(self, state):
        """Return the elastic energy per area (m,) [J/m2], mu eps y^2/(2 density) with y = traction/mu."""
        y, springs = state
        energy = np.divide(y**2, 2 * springs, out=np.zeros_like(y), where=springs > 0)
        return self.static * self.length * energy


def parallel_element(stiffness, yield_displacement) -> Element:
    """Return one Element for parallel elastic-plastic elements (eq. 3.12, extended to reversals).

    Parameters
    ----------
    stiffness, yield_displacement : (t,) array_like
        Stiffness [N/m] of each element, and the stretch [m] at which it slips.

    Returns
    -------
    Element
        Its limit is the sum of the slip forces.
    """
    stiffness = np.asarray(stiffness, float)
    yield_displacement = np.asarray(yield_displacement, float)
    limit = float(stiffness @ yield_displacement)
    total = float(stiffness.sum())
    return Element(
        "",
        np.concatenate([[0.0, stiffness.size], stiffness, yield_displacement]),
        np.zeros(3 + stiffness.size),
        limit,
        limit / total if total > 0 else 0.0,
        form="parallel",
    )


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


def loop_from_keys(friction, load: float, amplitude) -> SteadyLoop:
    """Return the steady loop of the law that a [friction] table defines.

    Parameters
    ----------
    friction : model of a [friction] table
        Keys `static` [1] and `bond_length` [m].
    load : float
        Normal load [N].
    amplitude : float or array
        Amplitudes [m] of the relative displacement.

    Returns
    -------
    SteadyLoop
    """
    length = friction.bond_length
    return masing_loop(np.array([friction.static * load / length]), np.array([length]), amplitude)


def from_keys(friction, load: float) -> ElasticPlastic:
    """Return the elastic-plastic law that a [friction] table defines; load [N] is not used."""
    return ElasticPlastic(friction.static, friction.bond_length)
