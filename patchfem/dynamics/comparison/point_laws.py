"""Friction laws of one interface for the comparison methods: each depends on that interface alone."""

from dataclasses import dataclass

import numpy as np

from ...core import PatchfemError


@dataclass(frozen=True, slots=True)
class Coulomb:
    """kinetic sgn(v) [N]. stick_speed [m/s]: below it the force is what holds the interface, up to `static` [N]; 0: no
    such branch, the force is +-kinetic (0 at rest) and nothing ever sticks."""

    static: float
    kinetic: float
    stick_speed: float = 0.0

    @property
    def limit(self) -> float:
        """Largest force [N]."""
        return self.static

    def row(self, stick_speed: float | None = None) -> tuple:
        """Numbers for the compiled loops; stick_speed [m/s] overrides the law's own."""
        return 0.0, self.static, self.kinetic, self.stick_speed if stick_speed is None else stick_speed


@dataclass(frozen=True, slots=True)
class Tanh:
    """limit tanh(v/speed) [N] (2.4, 2.7); speed v_0 [m/s]."""

    limit: float
    speed: float

    def row(self, stick_speed: float | None = None) -> tuple:
        """Numbers for the compiled loops."""
        return 1.0, self.limit, self.speed, 0.0


@dataclass(frozen=True, slots=True)
class ElasticPlastic:
    """F' = (limit/length) v up to +-limit [N], elastic again on reversal (3.12 as it has to be); length [m].

    printed: 3.12 word for word: once at the limit the force stays there for ever.
    """

    limit: float
    length: float
    printed: bool = False

    def row(self, stick_speed: float | None = None) -> tuple:
        """Numbers for the compiled loops."""
        return 2.0, self.limit, self.length, float(self.printed)


def rows(laws, interfaces: int, stick_speed: float | None = None) -> np.ndarray:
    """(i, 4) numbers of the laws; PatchfemError where they do not fit the interfaces or cannot be."""
    if len(laws) != interfaces:
        raise PatchfemError(f"{len(laws)} friction laws for {interfaces} interfaces: give each interface its own")
    out = np.array([law.row(stick_speed) for law in laws], float).reshape(len(laws), 4)
    for law, row in zip(laws, out):
        if not np.all(np.isfinite(row)) or row[1] <= 0 or np.any(row < 0) or (row[0] > 0 and row[2] == 0):
            raise PatchfemError(f"{law}: friction needs finite numbers above zero")
        if row[0] == 0 and row[2] > row[1]:
            raise PatchfemError(f"{law}: friction.kinetic is above friction.static")
    return out


def sticking_warnings(laws, stick_speed: float | None = None) -> list:
    """What the laws by themselves get wrong, as sentences."""
    out = []
    for law in laws:
        if isinstance(law, Tanh):
            out.append(f"limit*tanh(v/v_0) never sticks: at half of its limit the interface creeps at "
                       f"{np.arctanh(0.5) * law.speed:.3g} m/s for ever")
        elif isinstance(law, ElasticPlastic) and law.printed:
            out.append("eq. 3.12 as printed keeps the force at its limit for ever once it is there, whatever the "
                       "motion does; use printed = false")
        elif isinstance(law, Coulomb) and not law.row(stick_speed)[3]:
            out.append("Coulomb friction without a stick branch: the force is + or - kinetic, so a held interface "
                       "shakes and creeps; name accuracy.stick_speed")
    return list(dict.fromkeys(out))
