"""Friction laws as differential equations between events, for `motion_reference`.

A law has the parameters of one interface; its state is s (k,). Its mode is +-1, the sign of the
relative velocity, or 0 if the interface sticks (Coulomb) or deforms elastically (elastic-plastic).
Nothing is imported from the package.
"""

from itertools import pairwise

import numpy as np
from scipy.special import gamma, gammainc


class Law:
    """Base class of the laws.

    - force(s, v, t): friction force [N]
    - rate(s, v, t): rate of the state
    - reversible(s): reversible part of the relative displacement [m]
    - split(s, v, t): rate of its irreversible part [m/s]
    - energy(s): stored energy [J]; None if the law has none
    - guards(s, v, t): values whose decrease through zero is an event
    - apply_event: changes mode and state at an event
    """

    # `splits` states whether the law distinguishes slip from the reversible displacement, `relaxes` whether its state
    # relaxes over the displacement `scale`; `speed_key` names the key of a speed on which its force depends.
    size = 1
    relaxes = False
    speed_key = ""
    set_valued = False
    split_by_mode = False
    splits = True

    def __init__(self, limit: float, **keys):
        self.limit = limit
        self.mode = 1
        self.keys = keys
        self.side = 1  # Side of the law's second switching surface, if it has one.
        self.turns = []  # Reversals, if the law keeps them.

    def set_initial_mode(self, v: float, accel: float) -> None:
        """Set the mode for a motion that begins with velocity v and acceleration accel."""
        self.mode = 1 if (v if v != 0 else accel) >= 0 else -1

    def set_initial_side(self, s) -> None:
        """Set `side` for a motion that begins in a state s other than 0."""

    def guards(self, s, v, t) -> list:
        """Return the event functions: values whose decrease through zero is an event."""
        return [self.mode * v]

    def apply_event(self, k: int, s, v, accel: float):
        """Change the mode at event k and return the state."""
        # The mode changes here, not by the sign of the velocity, which round-off may keep.
        self.mode = -self.mode
        return s

    def scale(self) -> float:
        """Return the displacement [m] that reverses the state."""
        return (
            self.keys.get("bond_length", 1.0)
            if "stiffness" not in self.keys
            else self.limit / self.keys["stiffness"]
        )

    def unit(self):
        """Return the typical size of the state, or of each of its numbers."""
        return self.scale()

    def energy(self, s):
        """Return the stored energy [J]; None if the law has none."""
        return None

    def reversible(self, s) -> float:
        """Return the reversible part of the relative displacement [m]."""
        return s[0] if self.size else 0.0


class TanhLaw(Law):
    """F = mu N tanh(v/v_0)."""

    size = 0
    speed_key = "reference_speed"

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.limit * np.tanh(v / self.keys["reference_speed"])

    def rate(self, s, v, t):
        """Return the rate of the state, which is empty."""
        return np.zeros(0)

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return v


class ElasticPlasticLaw(Law):
    """F' = mu N v/eps, |F| <= mu N: elastic in mode 0, slipping in modes +-1."""

    split_by_mode = True

    def set_initial_mode(self, v, accel):
        """Begin in the elastic mode."""
        self.mode = 0

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.limit * s[0] / self.keys["bond_length"]

    def rate(self, s, v, t):
        """Return the rate of the stretch."""
        return np.array([v if self.mode == 0 else 0.0])

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return 0.0 if self.mode == 0 else v

    def guards(self, s, v, t):
        """Return the margins to yield in the elastic mode, and the slip velocity in slip."""
        eps = self.keys["bond_length"]
        return [eps - s[0], eps + s[0]] if self.mode == 0 else [self.mode * v]

    def apply_event(self, k, s, v, accel):
        """Yield, or return to the elastic mode."""
        if self.mode:
            self.mode = 0
            return s
        self.mode = 1 - 2 * k
        return np.array([self.mode * self.keys["bond_length"]])

    def energy(self, s):
        """Return the stored energy [J]."""
        return 0.5 * self.limit * s[0] ** 2 / self.keys["bond_length"]


class ElementsLaw(Law):
    """Springs in parallel, each with a slider; the state holds their stretches, the mode a tuple of their sides."""

    def __init__(self, limit, elements, **keys):
        super().__init__(limit, **keys)
        self.stiffness, self.stretches = map(np.array, elements)
        self.limits = self.stiffness * self.stretches
        self.size = self.stretches.size
        self.mode = (0,) * self.size

    def set_initial_mode(self, v, accel):
        """Begin with elements that stick."""

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.stiffness @ s

    def rate(self, s, v, t):
        """Return the rates of the stretches."""
        return np.where(self.mode, 0.0, v)

    def reversible(self, s):
        """Return the mean stretch [m], weighted by the limits of the elements."""
        return self.limits @ s / self.limits.sum()

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return v - self.reversible(self.rate(s, v, t))

    def guards(self, s, v, t):
        """Return the margins to yield of elements that stick, and the slip velocity of others."""
        margins = self.stretches - np.abs(s)
        return [side * v if side else margin for side, margin in zip(self.mode, margins)]

    def apply_event(self, k, s, v, accel):
        """Let an element slip or stick."""
        mode = list(self.mode)
        s = s.copy()
        mode[k] = 0 if mode[k] else int(np.sign(s[k]))
        if mode[k]:
            s[k] = mode[k] * self.stretches[k]
        self.mode = tuple(mode)
        return s

    def scale(self):
        """Return the smallest stretch [m]."""
        return self.stretches.min()


class PressedSpringsLaw(Law):
    """Elastic-plastic springs whose density comes and goes with the load N(t), and vanishes while the pieces are apart.

    States: force over mu, density [N] and reversible displacement [m]. The mode is the direction of slip. The side is 1
    while the density grows with the load, -1 while slip breaks the springs that exceed the load, and 0 while the pieces
    are apart.
    """

    size = 3

    def __init__(self, load, mu: float, length: float, mean: float):
        super().__init__(mu * mean)
        self.load = load  # Function t -> load [N], its rate [N/s].
        self.mu = mu
        self.length = length
        self.mean = mean
        self.side = 1 if load(0.0)[0] >= 0 else 0

    def start(self):
        """Return the initial state."""
        return np.array([0.0, max(self.load(0.0)[0], 0.0), 0.0])

    def set_initial_mode(self, v, accel):
        """Begin without slip."""
        self.mode = 0

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.mu * (self.mode * self.load(t)[0] if self.mode else s[0]) * abs(self.side)

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        if self.side == 0:
            return v
        gained = max(self.load(t)[1], 0.0)
        return v - self.mode * gained * self.length / max(s[1], 1e-300) if self.mode else 0.0

    def rate(self, s, v, t):
        """Return the rates of force, density and reversible displacement."""
        load, gained = self.load(t)
        slip = self.split(s, v, t)
        if self.side == 0:
            return np.zeros(3)
        broken = max(s[1] - load, 0.0) * max(self.mode * slip, 0.0) / self.length
        growth = gained * (self.side > 0) - broken
        pulled = self.mode * gained if self.mode else s[1] * v / self.length
        return np.array([pulled, growth, v - slip])

    def reversible(self, s):
        """Return the reversible part of the relative displacement [m]."""
        return s[2]

    def guards(self, s, v, t):
        """Return the margins to lift-off, to a change of growth, and to slip or its end."""
        load, gained = self.load(t)
        if self.side == 0:
            return [-load, 1.0, 1.0]
        growth = gained if self.side > 0 else s[1] - load
        end = self.mode * s[1] * v / self.length - gained if self.mode else load - abs(s[0])
        return [load, growth, end]

    def apply_event(self, k, s, v, accel):
        """Lift off or touch, let the density grow or break, slip or stick."""
        s = s.copy()
        if k == 0:
            self.side = 0 if self.side else 1
            self.mode = 0
            s[:2] = 0.0
        elif k == 1:
            self.side = -self.side
        else:
            self.mode = 0 if self.mode else int(np.sign(s[0]))
        return s

    def scale(self):
        """Return the displacement [m] that reverses the force."""
        return self.length

    def unit(self):
        """Return the typical size of each state."""
        return np.array([self.mean, self.mean, self.length])


class StretchLaw(Law):
    """z' = m v - |v| z/eps, m' = |v| (1 - m)/eps, F = mu N z/eps_0; with growth, eps follows 2.10.

    The state is the sum of the stretches z, the density m, which stays 1 if it starts there, and eps. The speed |v| has a
    lower bound in a_s/|v|.
    """

    relaxes = True

    def __init__(self, limit, **keys):
        super().__init__(limit, **keys)
        self.grows = "rest_growth" in keys
        self.size = 3 if self.grows else 2

    def start(self):
        """Return the initial state."""
        density = self.keys.get("initial_bonds", 1.0)
        return np.array([0.0, density, self.keys["bond_length"]])[: self.size]

    def length(self, s):
        """Return the bond length [m]."""
        return s[2] if self.grows else self.keys["bond_length"]

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.limit * s[0] / self.keys["bond_length"]

    def rate(self, s, v, t):
        """Return the rates of the stretch, the density and the bond length."""
        new_length = self.keys["bond_length"]
        k = self.keys
        speed = self.mode * v
        bonds = [s[1] * v - speed * s[0] / self.length(s), speed * (1 - s[1]) / self.length(s)]
        if not self.grows:
            return np.array(bonds)
        final_length = new_length * k["kinetic"] / k["static"]
        ages = k["rest_growth"] / (speed if self.side > 0 else k["rest_speed"])
        growth = ages * (new_length - s[2]) + speed * (final_length - s[2]) / k["slip_growth"]
        return np.array([*bonds, growth])

    def reversible(self, s):
        """Return the mean stretch [m]."""
        return s[0] / max(s[1], 1e-300)

    def unit(self):
        """Return the typical size of each state."""
        return np.array([self.scale(), 1.0, self.scale()])[: self.size]

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return self.mode * v * s[0] / (self.length(s) * max(s[1], 1e-300) ** 2)

    def set_initial_mode(self, v, accel):
        """Set direction and side for the start of a motion."""
        super().set_initial_mode(v, accel)
        self.side = 1 if self.grows and abs(v) > self.keys["rest_speed"] else -1

    def guards(self, s, v, t):
        """Return the slip velocity and the margin to the speed limit of ageing."""
        ageing_margins = (
            [self.side * (self.mode * v - self.keys["rest_speed"])] if self.grows else []
        )
        return [self.mode * v, *ageing_margins]

    def apply_event(self, k, s, v, accel):
        """Reverse the direction, or cross the speed limit of ageing."""
        if k:
            self.side = -self.side
            return s
        return super().apply_event(k, s, v, accel)


class BoucWenLaw(Law):
    """z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)), F = mu N z."""

    relaxes = True

    def unit(self):
        """Return the typical size of z."""
        return 1.0

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.limit * s[0]

    def rate(self, s, v, t):
        """Return the rate of z."""
        n = self.keys["exponent"]
        shape = self.keys["shape"]
        eps = self.limit / self.keys["stiffness"]
        sign = self.mode * self.side
        return np.array([v / eps * (1 - abs(s[0]) ** n * (shape * sign + 1 - shape))])

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return v - self.limit / self.keys["stiffness"] * self.rate(s, v, t)[0]

    def reversible(self, s):
        """Return the reversible part of the relative displacement [m]."""
        return self.limit / self.keys["stiffness"] * s[0]

    def guards(self, s, v, t):
        """Return the slip velocity and z, each times its sign."""
        return [self.mode * v, self.side * s[0]]

    def set_initial_mode(self, v, accel):
        """Set direction and sign of z for the start of a motion."""
        super().set_initial_mode(v, accel)
        self.side = self.mode

    def set_initial_side(self, s):
        """Set the sign of z for a start in a state other than 0."""
        if s[0]:
            self.side = 1 if s[0] > 0 else -1

    def apply_event(self, k, s, v, accel):
        """Reverse the direction, or change the sign of z."""
        if k:
            self.side = -self.side
            return s
        return super().apply_event(k, s, v, accel)


class LuGreLaw(Law):
    """z' = v - k |v| z/g, F = k z + s_1 z' + s_2 v."""

    relaxes = True
    speed_key = "stribeck_speed"

    def rate(self, s, v, t):
        """Return the rate of z."""
        k = self.keys
        g = (
            self.limit
            * (
                k["kinetic"]
                + (k["static"] - k["kinetic"]) * np.exp(-((v / k["stribeck_speed"]) ** 2))
            )
            / k["static"]
        )
        return np.array([v - k["stiffness"] * self.mode * v * s[0] / g])

    def force(self, s, v, t):
        """Return the friction force [N]."""
        k = self.keys
        return k["stiffness"] * s[0] + k["micro_damping"] * self.rate(s, v, t)[0] + k["viscous"] * v

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return v - self.rate(s, v, t)[0]


class IwanLaw(Law):
    """Segalman's sliders by Masing's rules; the state is the relative displacement, and a stack holds the reversals."""

    def __init__(self, limit, **keys):
        super().__init__(limit, **keys)
        chi = keys["chi"]
        beta = keys["beta"]
        k = keys["stiffness"]
        self.top = limit * (1 + beta) / (k * (beta + (chi + 1) / (chi + 2)))
        self.density = k * (chi + 1) / (1 + beta) / self.top ** (chi + 1)
        self.last = k * beta / (1 + beta)
        # (displacement, force, mean stretch) at reversals; the first is the virgin state.
        self.turns = [(0.0, 0.0, 0.0)]

    def initial_loading(self, u: float) -> float:
        """Return the force of the initial loading at a displacement u >= 0."""
        chi = self.keys["chi"]
        u = min(u, self.top)
        integral = u ** (chi + 2) / (chi + 2) + u * (self.top ** (chi + 1) - u ** (chi + 1)) / (
            chi + 1
        )
        return self.density * integral + self.last * u

    def mean_stretch(self, u: float) -> float:
        """Return the mean stretch of the sliders on the initial loading at u, weighted by their limits."""
        chi = self.keys["chi"]
        u = min(u, self.top)
        integral = u ** (chi + 3) / (chi + 3) + u * (self.top ** (chi + 2) - u ** (chi + 2)) / (
            chi + 2
        )
        return (self.density * integral + self.last * self.top * u) / self.limit

    def mean_stretch_rate(self, u: float) -> float:
        """Return the derivative of this mean stretch with respect to the displacement."""
        chi = self.keys["chi"]
        u = min(u, self.top)
        integral = (self.top ** (chi + 2) - u ** (chi + 2)) / (chi + 2)
        return (self.density * integral + self.last * self.top * (u < self.top)) / self.limit

    def apply_masing(self, s, function, index: int) -> float:
        """Return a function `function` of the initial loading, continued from the last reversal by Masing's rules.

        index: index of the value of this function in a reversal.
        """
        reversal = self.turns[-1]
        displacement = s[0] - self.turns[-1][0]
        if len(self.turns) == 1:
            return np.sign(s[0]) * function(abs(s[0]))
        return reversal[index] + np.sign(displacement) * 2 * function(abs(displacement) / 2)

    def force(self, s, v, t):
        """Return the friction force [N]."""
        return self.apply_masing(s, self.initial_loading, 1)

    def reversible(self, s) -> float:
        """Return the reversible part of the relative displacement [m]."""
        return self.apply_masing(s, self.mean_stretch, 2)

    def rate(self, s, v, t):
        """Return the rate of the displacement."""
        return np.array([v])

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        displacement = abs(s[0]) if len(self.turns) == 1 else abs(s[0] - self.turns[-1][0]) / 2
        return v * (1 - self.mean_stretch_rate(displacement))

    def guards(self, s, v, t):
        """Return the slip velocity and the distance to the end of the present loop."""
        out = [self.mode * v]
        if len(self.turns) > 2:  # A minor loop closes at the reversal before the last one.
            out.append(self.mode * (self.turns[-2][0] - s[0]))
        elif len(self.turns) == 2:
            # The motion joins the initial loading at the opposite end of the first stroke.
            out.append(self.mode * (-self.turns[1][0] - s[0]))
        return out

    def apply_event(self, k, s, v, accel):
        """Push a reversal onto the stack, or remove a closed loop from it."""
        if k == 0:
            # A start in the other direction is not a reversal.
            if len(self.turns) > 1 or abs(s[0]) > 1e-12 * self.top:
                self.turns.append(
                    (float(s[0]), float(self.force(s, v, 0.0)), float(self.reversible(s)))
                )
            self.mode = -self.mode
            return s
        self.turns = self.turns[:-2] if len(self.turns) > 2 else self.turns[:1]
        return s


class ReportLaw(Law):
    """Eq. 2.17 as printed: F = mu N int (R/eps)^p exp(-R/eps) sgn(u) dR/eps.

    u is the displacement since a bond formed. Between reversals of the path u changes its sign at
    most once, so each stroke is a difference of incomplete gamma functions. The state is
    (displacement, path); reversals of both are kept as long as they matter.
    """

    size = 2
    relaxes = True
    splits = False

    def __init__(self, limit, **keys):
        super().__init__(limit, **keys)
        self.order = keys.get("order", 1.0)
        self.turns = [(0.0, 0.0)]

    def force(self, s, v, t):
        """Return the friction force [N]."""
        q = s[0]
        path = s[1]
        eps = self.keys["bond_length"]
        p = self.order
        points = np.array([*self.turns, (path, q)])
        rho = (path - points[:, 0]) / eps
        u = q - points[:, 1]
        sums = gammainc(p + 1, np.maximum(rho, 0.0))
        # Age of the bond that formed at the present position, if the stroke passed it.
        crossing_age = rho[:-1] - np.abs(u[:-1]) / eps
        is_crossed = u[:-1] * u[1:] < 0
        middle = np.where(is_crossed, gammainc(p + 1, np.maximum(crossing_age, 0.0)), sums[1:])
        sign = np.where(u[:-1] != 0, np.sign(u[:-1]), np.sign(u[1:]))
        total = sign @ (sums[:-1] - middle) + np.sign(u[1:]) @ (middle - sums[1:])
        initial_bonds = (path / eps) ** p * np.exp(-path / eps) / gamma(p + 1) * np.sign(q)
        return self.limit * (total + initial_bonds)

    def rate(self, s, v, t):
        """Return the rates of displacement and path."""
        return np.array([v, self.mode * v])

    def split(self, s, v, t):
        """Return 0; slip is not distinguished in this law."""
        return 0.0

    def apply_event(self, k, s, v, accel):
        """Store a reversal and drop those that are too old to matter."""
        turns = [*self.turns, (float(s[1]), float(s[0]))]
        oldest_path = s[1] - 60 * self.keys["bond_length"]
        self.turns, self.mode = (
            [a for a, b in pairwise(turns) if b[0] > oldest_path] + turns[-1:],
            -self.mode,
        )
        return s


class CoulombLaw(Law):
    """|F| <= static while sticking; the kinetic force against the velocity while slipping."""

    size = 0
    set_valued = True
    split_by_mode = True

    def __init__(self, limit, **keys):
        super().__init__(limit, **keys)
        self.kinetic = limit * keys.get("kinetic", keys["static"]) / keys["static"]
        self.mode = 0

    def set_initial_mode(self, v, accel):
        """Begin in the direction of the velocity, or stuck."""
        self.mode = int(np.sign(v))

    def rate(self, s, v, t):
        """Return the rate of the state, which is empty."""
        return np.zeros(0)

    def split(self, s, v, t):
        """Return the rate of the irreversible displacement [m/s]."""
        return v if self.mode else 0.0


LAWS = {
    "coulomb": CoulombLaw,
    "weakening": CoulombLaw,
    "convolution": CoulombLaw,
    "elastic-plastic": ElasticPlasticLaw,
    "jenkins": ElementsLaw,
    "iwan": IwanLaw,
    "tanh": TanhLaw,
    "bouc-wen": BoucWenLaw,
    "lugre": LuGreLaw,
    "nonlocal": StretchLaw,
    "stretch": StretchLaw,
    "growing": StretchLaw,
    "report": ReportLaw,
}
