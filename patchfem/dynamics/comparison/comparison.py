"""Shared by the comparison methods: the grid of steps, the start, the result and its ledger of energy."""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ...core import ModalBasis, PatchfemError, Response, Start

MOST_NUMBERS = 2e8  # kept by a run: 1.6 GB


@dataclass(frozen=True, eq=False, slots=True)
class Comparison:
    """Every step of a comparison method.

    time (k,) [s]; z, v (k, n) [m], [m/s]; force (i, k) [N]; residual (i, k) [N]: what the law gives at the end of the
    step less the force that the step used; iterations (k,); failures: steps that did not converge (duhamel), stops at
    the stick speed (newmark); drive (k,) [m s-2]; ledger [J]: work_in, viscous, friction, stored (change), error =
    work_in - viscous - friction - stored, by the trapezoidal rule on the steps; warnings: sentences.
    """

    time: np.ndarray
    z: np.ndarray
    v: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    failures: int
    drive: np.ndarray
    ledger: MappingProxyType
    warnings: tuple

    def slide(self, modes: ModalBasis) -> np.ndarray:
        """Slide (i, k) [m] of every interface at every step."""
        return modes.interfaces @ self.z.T

    def accelerations(self, modes: ModalBasis) -> np.ndarray:
        """Modal accelerations (k, n) [m s-2] from the equation of motion, relative to the base."""
        return -np.outer(self.drive, modes.base) - self.v @ modes.dampers.T - self.z * modes.omega**2 \
            - self.force.T @ modes.interfaces / modes.mass

    def response(self, modes: ModalBasis, moving: bool = True) -> Response:
        """Histories of every step, slide and force of the first interface; moving: the drive is that of the base.
        `extra`: "forces" (i, k) [N], "residual" (i, k) [N], "iterations" (k,)."""
        face = modes.interfaces[0]
        base = self.drive if moving else np.zeros_like(self.drive)
        accel = self.accelerations(modes) @ modes.output + base
        slide = self.z @ face
        return Response(self.time, self.z, self.v, slide, self.v @ face, self.z @ modes.output, self.v @ modes.output,
                        accel, base, self.force[0], slide,
                        {"forces": self.force, "residual": self.residual, "iterations": self.iterations})

    @property
    def worst(self) -> float:
        """Largest |residual| [N] of a step that was accepted."""
        return float(np.abs(self.residual).max(initial=0.0))


@dataclass(frozen=True, eq=False, slots=True)
class Grid:
    """Arrays of a run before it is run.

    time, drive: (k,); z, v: (k, n); force, residual: (i, k); iterations: (k,).
    """

    h: float
    time: np.ndarray
    drive: np.ndarray
    z: np.ndarray
    v: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray


def grid(modes: ModalBasis, drive, law: tuple, duration: float, steps_per_cycle: int, start: Start | None) -> Grid:
    """Equal steps of drive.period/steps_per_cycle over `duration` [s], the forces of the start in place.

    law: (rows, compiled loops) of the laws.

    PatchfemError for fewer than 4 steps per cycle, no step at all, more than memory holds, a start that does not fit or
    an interface that slides in no mode.
    """
    laws, kernels = law
    n, i = modes.omega.size, len(laws)
    if steps_per_cycle < 4:
        raise PatchfemError(f"accuracy.steps_per_cycle = {steps_per_cycle}: at least 4 steps per cycle are wanted")
    h = drive.period / steps_per_cycle
    most = MOST_NUMBERS / (2 * n + 2 * i + 3)
    if not 0.5 < duration / h <= most:
        raise PatchfemError(f"a run of {duration:g} s in steps of {h:g} s takes {duration / h:.3g} of them; 1 to "
                            f"{most:.3g} are possible: change drive.cycles or accuracy.steps_per_cycle")
    idle = np.flatnonzero(~np.any(modes.interfaces, axis=1))
    if idle.size:
        raise PatchfemError(f"interface {idle[0] + 1} slides in no mode: give it a mode with slide, or leave it out")
    steps = round(duration / h)
    time = np.arange(steps + 1) * h
    z, v = np.zeros((steps + 1, n)), np.zeros((steps + 1, n))
    if start is not None:
        if np.shape(start.z) != (n,) or np.shape(start.v) != (n,):
            raise PatchfemError(f"a start needs {n} coordinates and {n} rates, one of each per mode")
        if not np.all(np.isfinite([start.z, start.v])):
            raise PatchfemError("a start needs finite coordinates and rates")
        z[0], v[0] = start.z, start.v
    values = np.array(drive.values(time), float, order="C")
    found = Grid(h, time, values, z, v, np.zeros((i, steps + 1)), np.zeros((i, steps + 1)),
                 np.zeros(steps + 1, np.int64))
    found.force[:, 0] = first_forces(modes, laws, kernels, values[0], z[0], v[0])
    return found


def taken(modes: ModalBasis) -> tuple:
    """(omega, dampers, interfaces, base, mass) of modes as the compiled loops take them: arrays of their own, for numba
    compiles a loop anew for one that is read-only or lies otherwise in memory."""
    return *(np.array(one, float, order="C") for one in (modes.omega, modes.dampers, modes.interfaces, modes.base)), \
        float(modes.mass)


def first_forces(modes: ModalBasis, laws: np.ndarray, kernels, drive: float, z, v) -> np.ndarray:
    """Friction forces (i,) [N] of a start at coordinates z (n,) [m] and rates v (n,) [m/s].

    laws: rows of `point_laws.rows`; kernels: compiled loops; drive [m s-2] at 0 s. Elastic forces are unstrained, held
    ones hold as far as they can.
    """
    faces = modes.interfaces
    speed, force = faces @ v, np.zeros(len(laws))
    free = -modes.base * drive - modes.omega**2 * z - modes.dampers @ v
    kernels.first_forces(laws, speed, force)
    held = (laws[:, 0] == 0) & (np.abs(speed) < laws[:, 3])
    if np.any(held):
        cross = faces @ faces.T / modes.mass
        need = faces @ free - cross @ force
        hold = np.linalg.lstsq(cross[np.ix_(held, held)], need[held], rcond=None)[0]
        force[held] = np.clip(hold, -laws[held, 1], laws[held, 1])
    return force


def ledger(modes: ModalBasis, found: Grid) -> MappingProxyType:
    """Energies [J] of a finished run by the trapezoidal rule, by the names of `Comparison.ledger`."""
    m, v = modes.mass, found.v
    energy = 0.5 * m * np.sum(v[[0, -1]]**2 + (modes.omega * found.z[[0, -1]])**2, axis=1)
    work = np.trapezoid(-m * found.drive * (v @ modes.base), dx=found.h)
    viscous = np.trapezoid(m * np.einsum("ki,ij,kj->k", v, modes.dampers, v), dx=found.h)
    friction = np.trapezoid(np.einsum("ik,ij,kj->k", found.force, modes.interfaces, v), dx=found.h)
    book = {"work_in": work, "viscous": viscous, "friction": friction, "stored": energy[1] - energy[0]}
    book["error"] = work - viscous - friction - book["stored"]
    return MappingProxyType({name: float(value) for name, value in book.items()})


def finish(modes: ModalBasis, found: Grid, failures: int, warnings: list) -> Comparison:
    """The result of a filled grid, with its ledger.

    A warning is added where the motion is not finite or more than 1e-3 of the energy that passed through is missing.
    """
    book = ledger(modes, found)
    flow = max(abs(book["work_in"]), book["viscous"] + abs(book["friction"]), abs(book["stored"]), 1e-300)
    if not np.isfinite(book["error"]):
        step = int(np.argmax(~np.isfinite(found.v).all(axis=1)))
        warnings = [*warnings, f"the motion is not finite from step {step} on; raise accuracy.steps_per_cycle"]
    elif abs(book["error"]) > 1e-3 * flow:
        warnings = [*warnings, f"the energy does not balance: {abs(book['error']) / flow:.1%} of what passed "
                               f"through is {'missing' if book['error'] > 0 else 'made by the method'}"]
    for array in (found.time, found.z, found.v, found.force, found.residual, found.iterations, found.drive):
        array.setflags(write=False)
    return Comparison(found.time, found.z, found.v, found.force, found.residual, found.iterations, int(failures),
                      found.drive, book, tuple(warnings))
