"""Friction laws of one interface for the comparison methods: each depends on that interface alone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from patchfem import compiled
from patchfem.core import ModalBasis, PatchfemError
from patchfem.dynamics.interfaces.dispatch import COULOMB, number_of
from patchfem.friction.protocol import Element

HEAD = 4  # numbers of a row before those of its law
# what has a force at the end
SMOOTH = tuple(f"friction.laws.{law}_kernels" for law in ("elastic_plastic", "tanh"))
RAISED = 0.005  # of a static friction, by which a stick speed that is proposed raises it


@dataclass(frozen=True, slots=True)
class Coulomb:
    """Coulomb friction kinetic sgn(v) [N], with a stick speed.

    stick_speed [m/s]: below it the force is what holds the interface, up to `static` [N]. 0: there is no such branch,
    the force is +-kinetic (0 at rest) and nothing ever sticks.
    """

    static: float
    kinetic: float
    stick_speed: float = 0.0
    compliance = steepness = 0.0  # it neither stretches nor feels the speed

    @property
    def limit(self) -> float:
        """Largest force [N]."""
        return self.static

    @property
    def kernels(self) -> str:
        """Module of its compiled form."""
        return COULOMB

    def row(self, stick_speed: float | None = None) -> np.ndarray:
        """Numbers (HEAD,) for the compiled loops; stick_speed [m/s] overrides the law's own."""
        return np.array(
            [
                0.0,
                self.static,
                self.kinetic,
                self.stick_speed if stick_speed is None else stick_speed,
            ]
        )


NO_FRICTION = Coulomb(1e-300, 1e-300)  # of an interface that bears nothing


@dataclass(frozen=True, eq=False, slots=True)
class Smooth:
    """A law that has one force at the end of a step, of the force before, the slide in between and the speed there.

    element: the law under its load. printed: eq. 3.12 word for word: once at the limit the force stays there for ever.
    """

    element: Element
    printed: bool = False

    @property
    def limit(self) -> float:
        """Largest force [N], or the size of the force where none is largest."""
        return self.element.limit

    @property
    def kernels(self) -> str:
        """Module of its compiled form."""
        return self.element.kernels

    @property
    def compliance(self) -> float:
        """Elastic slide per force [m/N], 0 of a law that does not stretch."""
        return self.element.length / self.limit

    @property
    def steepness(self) -> float:
        """Force per speed at rest [N s/m], 0 of a law that does not feel the speed."""
        return self.limit * self.element.numbers[2] if self.element.form == "speed" else 0.0

    def row(self, stick_speed: float | None = None) -> np.ndarray:
        """Numbers (HEAD + k,) for the compiled loops; a stick speed is not used."""
        return np.array([1.0, self.limit, 0.0, float(self.printed), *self.element.numbers])


def rows(laws, interfaces: int, stick_speed: float | None = None) -> np.ndarray:
    """Numbers of the laws for the compiled loops, (i, HEAD + k).

    PatchfemError where they do not fit the number of interfaces, are not finite or positive, or kinetic exceeds static.
    """
    if len(laws) != interfaces:
        raise PatchfemError(
            f"{len(laws)} friction laws for {interfaces} interfaces: give one law for each interface"
        )
    found, number = [law.row(stick_speed) for law in laws], number_of(SMOOTH)
    out = np.zeros((len(laws), max([HEAD + 1, *(len(row) for row in found)])))
    for k, (law, row) in enumerate(zip(laws, found)):
        smooth = row[0] > 0
        if (
            not np.all(np.isfinite(row))
            or row[1] <= 0
            or np.any(row < 0)
            or (smooth and np.any(row[HEAD + 1 :] == 0))
        ):
            raise PatchfemError(
                f"{law}: the numbers of the friction law must be finite and above zero"
            )
        if not smooth and row[2] > row[1]:
            raise PatchfemError(f"{law}: friction.kinetic must not be above friction.static")
        out[k, : len(row)] = row
        out[k, HEAD] = number[law.kernels]
    return out


def loops():
    """Return the compiled loops of the methods, for all their laws, from the folder of compiled code."""
    text = Path(__file__).with_name("loops_kernels.py").read_text("utf-8")
    return compiled.written(f"report_methods_{compiled.digest(text)}", text)


def added_static(modes: ModalBasis, face, stick_speed: float, h: float) -> float:
    """Force [N] by which the stick speed raises the static friction of a released interface in steps of h [s].

    It is the force over the kinetic friction that gives the interface the stick speed within a step. With less the
    interface is caught again, so it acts as static friction that grows as the step falls.
    """
    return 2 * modes.mass * stick_speed / (h * float(np.sum(np.asarray(face) ** 2)))


def low_speed(modes: ModalBasis, face, static: float, h: float) -> float:
    """Stick speed [m/s] that raises a static friction [N] by RAISED of it, in steps of h [s] (`added_static`)."""
    return RAISED * static / added_static(modes, face, 1.0, h)


def elastic_rates(modes: ModalBasis, laws) -> list:
    """Circular frequencies [rad/s] at which the interfaces that stretch would vibrate on their springs alone."""
    return [
        float(np.sqrt(np.sum(face**2) / modes.mass / one.compliance))
        for one, face in zip(laws, modes.interfaces)
        if one.compliance
    ]


def sticking_warnings(modes: ModalBasis, laws, h: float, stick_speed: float | None = None) -> list:
    """Sentences on what the laws by themselves get wrong in steps of h [s]: those that never stick, and 3.12 as
    printed."""
    out = []
    for law, face in zip(laws, modes.interfaces, strict=True):
        if isinstance(law, Coulomb):
            if not law.row(stick_speed)[3] and law != NO_FRICTION:
                out.append(
                    "with a stick speed of 0 Coulomb friction never sticks in this method: the force is always "
                    "plus or minus the kinetic friction, so an interface that should stick chatters and creeps; "
                    "set accuracy.stick_speed = "
                    f'"{low_speed(modes, face, law.static, h):.2g} m/s"'
                )
        elif law.steepness:
            speed = float(np.arctanh(0.5)) * law.limit / law.steepness
            out.append(
                "the law limit*tanh(v/v_0) never sticks: under a constant force of half the friction limit the "
                f"interface creeps at {speed:.3g} m/s"
            )
        elif law.printed:
            out.append(
                "with eq. 3.12 as printed in the report, the force stays at the friction limit once this limit "
                "is reached, even if the motion reverses; use printed = false"
            )
    return list(dict.fromkeys(out))
