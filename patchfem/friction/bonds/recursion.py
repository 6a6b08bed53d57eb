"""The stretch reading for p = 1, summed exactly by a bond state that never grows, along a line or in a plane.

With k = exp(-int dR/eps) the surviving share of a bond, u its stretch and 1/eps frozen when it forms, the sums over all
bonds

    m = sum sigma k dL/eps,   z = sum sigma k u dL/eps,   s2 = sum sigma k u^2 dL/eps        [Pa, Pa m, Pa m2]

obey, per unit of path in the direction e, m' = (sigma - m)/eps, z' = m e - z/eps, s2' = 2 z.e - s2/eps; the traction is
mu_s z/eps_0. The step is exact for a bond length held over it. Stored energy mu_s s2/(2 eps_0) and dissipation
mu_s s2/(2 eps_0 eps) per path are never negative: passive for every path, pressure and bond length, and for every part
of the path that is counted as damaging.

Directions. A line is a plane with one component: u and z are vectors of d = 1 or 2 components, the part of z along the
increment steps as on a line and the part across it decays. Bonds are arrays (d + 2, m) of m, the components of z, s2.

Breakaway (on a line). The path counts only where the slide drags its elastic range along
(`parameters.elastic_part`); inside it z' = m e and s2' = 2 z.e. With a share b of the bond length, a dither of the
force by less than 2 b mu_s sigma from end to end drifts in its first cycle only, b = 0 is Dahl's law and b -> 1 the
elastic-plastic one.

Load. Where the load falls at rest, the bonds that carry nothing, the last formed, are let go first: the force stays as
long as a population with the moments (m, z, s2) exists, m >= z^2/s2. Beyond that all stretches shrink, and no point
keeps more than mu_s sigma. Where it rises, unstressed bonds come in the density m_0. Neither gives energy.

Compiled twins: `point_kernels` for one point of a line.
"""

from dataclasses import dataclass
from math import factorial
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...effects import not_supported_message
from ..protocol import Step
from .parameters import Bonds, elastic_part, grow


class BondState(NamedTuple):
    """bonds (d + 2, m): m [Pa], z [Pa m], s2 [Pa m2]; eps: bond length [m], common or one per point (m,); play [1] of
    `parameters.elastic_part`."""

    bonds: np.ndarray
    eps: float | np.ndarray
    play: float | np.ndarray = 0.0


def shape_functions(x):
    """(f1, f2, exp(-x)) [1] with f1 = (1 - exp(-x))/x, f2 = (1 - f1)/x for x >= 0 of any shape, without cancellation.

    Below x = 0.03 both are series of seven terms. Compiled twin: `point_kernels.shape`.
    """
    x = np.asarray(x, float)
    small = x < 0.03
    safe = np.where(small, 1.0, x)
    f1 = -np.expm1(-safe) / safe
    f2 = (1 - f1) / safe
    series = 1 / 2 - x * (
        1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))
    )
    f2 = np.where(small, series, f2)
    f1 = np.where(small, 1 - x * f2, f1)
    return f1, f2, np.exp(-x)


def moments(x, e):
    """Integrals from 0 to x of y exp(-y), of y^2 exp(-y) and of the latter once more, without cancellation.

    x >= 0 of any shape; e = exp(-x). Compiled twin: `point_kernels.moments`.
    """
    series = sum((-1) ** k * x**k / (factorial(k) * (k + 4)) for k in range(13))
    c = np.where(x < 0.5, x**4 * series, 6 - e * (x**3 + 3 * x * x + 6 * x + 6))
    third = (c + x**3 * e) / 3
    return (third + x * x * e) / 2, third, x * third - c


def direction(dq) -> tuple:
    """(length [m], unit vector (d,)) of an increment (d,) [m]; the vector is 0 where nothing moves."""
    path = float(abs(dq[0]) if len(dq) == 1 else np.hypot(*dq))
    return path, np.asarray(dq, float) / path if path > 0 else np.zeros(len(dq))


def advance(bonds, dq, sigma, eps):
    """New bonds (3, m), path-mean stretch zbar (m,) [Pa m], its slope (m,) [Pa], integral of s2 dR/eps (m,) [Pa m2] of
    an increment along a line.

    bonds (3, m), dq scalar or (m,) [m], sigma (m,) [Pa] the pressure that forms the new bonds, eps [m].
    """
    m, z, s2 = bonds
    path = np.abs(dq)
    g = np.sign(dq)
    x = path / eps
    f1, f2, e = shape_functions(x)
    a1, young = x * f1, sigma - m
    with np.errstate(over="ignore", invalid="ignore"):
        a2, a3, a4 = moments(x, e)
    mean = z * f1 + g * eps * x * (sigma * f2 - young * (f1 - f2))
    slope = g * z * (f2 - f1) / eps + sigma * (f1 - f2) - young * (f2 - x * (f1 - f2))
    slope = np.where(path > 0, slope, m / 2)  # the mean of the two sides
    out = np.stack(
        [
            sigma - young * e,
            z * e + g * eps * (sigma * a1 - young * x * e),
            e * (s2 + 2 * g * z * path + m * path**2) + sigma * eps**2 * a3,
        ]
    )
    dissipated = s2 * a1 + 2 * g * z * eps * a2 + m * eps**2 * a3 + sigma * eps**2 * a4
    return out, mean, slope, dissipated


def stretch(bonds, dq):
    """Bonds (3, m) that all stretch by dq [m] along a line and neither break nor form.

    m stays, z' = z + m dq, s2' = s2 + dq (2 z + m dq).
    """
    m, z, s2 = bonds
    return np.stack([m, z + m * dq, s2 + dq * (2 * z + m * dq)])


def moved(law: Bonds, bonds, play, dq, sigma, eps) -> tuple:
    """(new bonds (d + 2, m), path-mean stretch [Pa m], integral of s2 dR/eps (m,) [Pa m2], play) of an increment.

    dq [m]: a number along a line, where the mean is (m,) and the elastic range of the law is gone through first; (2,)
    in a plane, where the mean is (2, m). sigma (m,) [Pa] forms the new bonds; eps [m], play [1] numbers or (m,).
    """
    if len(bonds) == 3:
        free, damaging, play = elastic_part(law, play, dq, eps)
        loose = stretch(bonds, free)
        out, mean, _, dissipated = advance(loose, damaging, sigma, eps)
        if np.any(free):
            mean = free / dq * (bonds[1] + loose[1]) / 2 + damaging / dq * mean
        return out, mean, dissipated, play
    path, e = direction(dq)
    along = e @ bonds[1:3]
    across = bonds[1:3] - e[:, None] * along
    f1, _, decay = shape_functions(path / eps)
    out, mean, _, dissipated = advance(np.stack([bonds[0], along, bonds[3]]), path, sigma, eps)
    z = e[:, None] * out[1] + across * decay
    return np.stack([out[0], *z, out[2]]), e[:, None] * mean + across * f1, dissipated, play


def pressed(law: Bonds, bonds, s0, s1):
    """Bonds (3, m) after a change of the pressure from s0 to s1 (m,) [Pa] at rest; the stored energy never rises.

    Where it falls, bonds without stretch are let go first, as long as m >= z^2/s2 allows it; beyond that all stretches
    shrink. Where it rises, unstressed bonds of density m_0 (s1 - s0) come.
    """
    m, z, s2 = bonds
    falls = s1 < s0
    left = np.divide(m * s1, s0, out=np.zeros_like(m), where=s0 > 0)
    density = np.where(falls, left, m + law.initial * (s1 - s0))
    least = np.divide(z * z, s2, out=np.zeros_like(m), where=s2 > 0)
    keep = np.where(falls & (least > left), left / np.maximum(least, 1e-300), 1.0)
    bound = law.length * s1
    keep *= np.where(
        falls & (keep * np.abs(z) > bound), bound / np.maximum(keep * np.abs(z), 1e-300), 1.0
    )
    return np.stack([density, z * keep, s2 * keep])


def refuse_directions(law: Bonds, directions: int) -> None:
    """Raise PatchfemError for a law with breakaway in more than one direction: its elastic range has no form in a
    plane."""
    if directions > 1 and law.breakaway:
        raise PatchfemError(not_supported_message("breakaway in two directions", "elastic range"))


@dataclass(frozen=True, slots=True)
class Recursion:
    """Law object of the stretch reading, p = 1; the pressure may change along the increment and in time.

    Along a line increments are numbers and tractions (m,) [Pa]; in a plane they are (2,) and (2, m), positive against
    slip. Where `law` holds rest_growth and slip_growth per point (m,), every point has a bond length of its own.
    """

    law: Bonds

    def start(self, sigma, directions: int = 1) -> BondState:
        """Unstressed bonds of density m_0 on pressure sigma (m,) [Pa]; PatchfemError for a law that has no form in two
        directions."""
        refuse_directions(self.law, directions)
        bonds = np.zeros((2 + directions, np.size(sigma)))
        bonds[0] = self.law.initial * sigma
        return BondState(bonds, self.law.length)

    def step(self, state: BondState, dq, s0, s1, dt: float) -> Step:
        """One straight increment dq [m] in dt [s]; new bonds form at the mean pressure of its ends (m,) [Pa], all are
        lost where s1 = 0."""
        law = self.law
        path = direction(np.atleast_1d(dq))[0]
        speed = path / dt if dt > 0 else 0.0
        middle = grow(law, state.eps, speed, speed, path / 2, dt / 2)
        out, mean, dissipated, play = moved(law, state.bonds, state.play, dq, (s0 + s1) / 2, middle)
        scale = law.static / law.length
        spent = scale * dissipated / 2
        lost = (s1 <= 0) & (np.abs(out).sum(axis=0) > 0)
        if lost.any():
            spent = spent + np.where(lost, scale * out[-1] / 2, 0.0)
            out = np.where(lost, 0.0, out)
        return Step(
            scale * mean, spent, BondState(out, grow(law, state.eps, speed, speed, path, dt), play)
        )

    def press(self, state: BondState, s0, s1) -> Step:
        """The law at rest on a line while the pressure goes from s0 to s1 (m,) [Pa], by the rule of `pressed`.

        The mean of the Step is the traction after it; what the bonds no longer store is dissipated.
        """
        bonds = pressed(self.law, state.bonds, s0, s1)
        scale = self.law.static / self.law.length
        return Step(
            scale * bonds[1], scale / 2 * (state.bonds[2] - bonds[2]), state._replace(bonds=bonds)
        )

    def traction(self, state: BondState):
        """Traction tau = mu_s z/eps_0 [Pa] of a state, > 0 against slip: (m,) along a line, (2, m) in a plane."""
        z = state.bonds[1] if len(state.bonds) == 3 else state.bonds[1:-1]
        return self.law.static / self.law.length * z

    def stored(self, state: BondState):
        """Elastic energy per area mu_s s2/(2 eps_0) (m,) [J/m2] of the bonds of a state."""
        return self.law.static / (2 * self.law.length) * state.bonds[-1]
