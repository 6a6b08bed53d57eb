"""The elastic-plastic law 3.12 with its reversal.

As printed, 3.12 sets dF/dt = 0 for |F| > mu N and so never unloads; here it is zero only while sliding goes on.
"""

from dataclasses import dataclass

import numpy as np

from ..protocol import Element, Step


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """Eq. 3.12 per point: springs of stiffness mu sigma/length that slip at mu sigma.

    They are elastic again on reversal.

    Springs come unstressed where the pressure rises and go where slip breaks them, within one length of slip; a falling
    pressure only lowers the limit. So no pressure creates energy, and a force below the limit holds still.
    """

    static: float
    length: float

    def element(self, load: float) -> Element:
        """Return the Element under a constant load [N]: a spring mu N/eps that slips at mu N."""
        return parallel_element([self.static * load / self.length], [self.length])._replace(
            length=self.length
        )

    def start(self, sigma):
        """Return the initial state: traction/mu and density of springs, (2, m) [Pa].

        The springs are unstressed under a pressure sigma (m,) [Pa].
        """
        return np.stack([np.zeros_like(sigma), sigma])

    def step(self, state, dq: float, s0, s1, dt: float) -> Step:
        """Advance by a straight increment dq [m] while the pressure changes from s0 to s1 (m,) [Pa].

        dt is not used.

        The pressure of the step is the mean of its ends. The traction is a ramp cut at mu sigma, whose path mean is
        exact.
        """
        sigma = (s0 + s1) / 2
        y0, springs = self._at(state, sigma)
        move = springs * dq / self.length
        y1 = np.clip(y0 + move, -sigma, sigma)
        ramp = np.divide(y1 - y0, move, out=np.zeros_like(y0), where=move != 0)
        mean = np.where(move != 0, ramp * (y0 + y1) / 2 + (1 - ramp) * y1, y0)
        left = np.minimum(sigma, springs)
        springs = left + (springs - left) * np.exp(-(1 - ramp) * abs(dq) / self.length)
        bare = s1 <= 0  # bonds are lost where the pressure vanishes
        after = np.stack([np.where(bare, 0.0, y1), np.where(bare, 0.0, springs)])
        spent = self.static * mean * dq - (self.stored(after) - self.stored(state))
        return Step(self.static * mean, spent, after)

    def press(self, state, s0, s1) -> Step:
        """Change the pressure at rest from s0 to s1 (m,) [Pa]; stretch beyond the limit is lost.

        The mean of the Step is the traction after it.
        """
        after = np.stack(self._at(state, s1))
        return Step(self.static * after[0], self.stored(state) - self.stored(after), after)

    def _at(self, state, sigma):
        """Return traction/mu and density of springs under a changed pressure; 0 without pressure."""
        y, springs = state
        return np.clip(y, -sigma, sigma), np.where(sigma > 0, np.maximum(springs, sigma), 0.0)

    def traction(self, state):
        """Return the traction (m,) [Pa] of a state, > 0 against slip towards +x."""
        return self.static * state[0]

    def stored(self, state):
        """Return the elastic energy mu eps y^2/(2 density) (m,) [J/m2] of a state; y = traction/mu."""
        y, springs = state
        return (
            self.static
            * self.length
            * np.divide(y**2, 2 * springs, out=np.zeros_like(y), where=springs > 0)
        )


def parallel_element(stiffness, yield_displacement) -> Element:
    """Return the Element of parallel elastic-plastic elements (eq. 3.12 with reversal).

    stiffness (t,) [N/m]; yield_displacement (t,) [m], the stretch at which each slips. The Element has the sum of their slip
    forces as its limit. Kernels: `elastic_plastic_kernels`.
    """
    k, most = (np.asarray(part, float) for part in (stiffness, yield_displacement))
    limit, total = float(k @ most), float(k.sum())
    numbers = np.concatenate([[0.0, k.size], k, most])
    return Element(
        "friction.laws.elastic_plastic_kernels",
        numbers,
        np.zeros(3 + k.size),
        limit,
        limit / total if total > 0 else 0.0,
        form="parallel",
    )


def masing_loop(stiffness, yield_displacement, slide) -> tuple:
    """Return the force at the reversals [N] and the area [J] of the steady loops of elements.

    The elements (t,) are in parallel; the displacement amplitudes u [m] have any shape. An element has the force
    k min(u, w), and the area 4 k w (u - w) where it slips.
    """
    slips = np.maximum(np.asarray(slide)[..., None] - yield_displacement, 0.0)
    return slide * np.sum(stiffness) - slips @ stiffness, 4 * slips @ (
        stiffness * yield_displacement
    )


def loop_from_keys(friction, load: float, slide) -> tuple:
    """Return `masing_loop` for the law of a [friction] table under a load [N]."""
    return masing_loop(
        np.array([friction.static * load / friction.bond_length]),
        np.array([friction.bond_length]),
        slide,
    )


def from_keys(friction, load: float) -> ElasticPlastic:
    """Return the elastic-plastic law of a [friction] table; load [N] is not used."""
    return ElasticPlastic(friction.static, friction.bond_length)
