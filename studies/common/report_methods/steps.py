"""Shared by the comparison methods: the grid of steps, the start, the result and its ledger of energy."""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from patchfem.core import InitialState, ModalBasis, PatchfemError, Response
from patchfem.dynamics.integrated import accelerations

from .point_laws import loops, rows

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
        return accelerations(modes, self.drive, self.z, self.v, self.force.T @ modes.interfaces)

    def response(self, modes: ModalBasis, moving: bool = True) -> Response:
        """Histories of every step, slide and force of the first interface; moving: the drive is that of the base.
        `extra`: "forces" (i, k) [N], "residual" (i, k) [N], "iterations" (k,)."""
        face = modes.interfaces[0]
        base = self.drive if moving else np.zeros_like(self.drive)
        accel = self.accelerations(modes) @ modes.output + base
        slide = self.z @ face
        return Response(
            self.time,
            self.z,
            self.v,
            slide,
            self.v @ face,
            self.z @ modes.output,
            self.v @ modes.output,
            accel,
            base,
            self.force[0],
            slide,
            {"forces": self.force, "residual": self.residual, "iterations": self.iterations},
        )

    @property
    def worst(self) -> float:
        """Largest |residual| [N] of a step that was accepted."""
        return float(np.abs(self.residual).max(initial=0.0))


@dataclass(frozen=True, eq=False, slots=True)
class Grid:
    """A run before it is run: step h [s]; rows of the laws and their compiled loops; rig, drive (k,), `filled` and
    `room`, as the loops take them."""

    h: float
    laws: np.ndarray
    loops: Any
    rig: tuple
    drive: np.ndarray
    filled: tuple
    room: tuple


def grid(
    modes: ModalBasis,
    drive,
    laws,
    over: tuple,
    start: InitialState | None,
    stick_speed: float | None = None,
) -> Grid:
    """Equal steps over `over`: (duration [s], steps per cycle of the drive), the forces of the start in place.

    PatchfemError for fewer than 4 steps per cycle, no step at all, more than memory holds, a start that does not fit or
    an interface that slides in no mode.
    """
    (duration, steps_per_cycle), n, i = over, modes.omega.size, len(modes.interfaces)
    table, compiled = rows(laws, i, stick_speed), loops()
    if steps_per_cycle < 4:
        raise PatchfemError(
            f"accuracy.steps_per_cycle = {steps_per_cycle}: the value must be at least 4"
        )
    h = drive.period / steps_per_cycle
    most = MOST_NUMBERS / (2 * n + 2 * i + 3)
    if not 0.5 < duration / h <= most:
        raise PatchfemError(
            f"a run over {duration:g} s of motion in steps of {h:g} s takes {duration / h:.3g} steps, "
            f"but the number of steps must lie between 1 and {most:.3g}; change drive.cycles or "
            "accuracy.steps_per_cycle"
        )
    idle = np.flatnonzero(~np.any(modes.interfaces, axis=1))
    if idle.size:
        raise PatchfemError(
            f"no mode moves interface {idle[0] + 1}; give a mode the key `slide`, or leave the "
            "interface out"
        )
    count = round(duration / h) + 1
    filled = *(np.zeros((count, size)) for size in (n, n, i, i)), np.zeros(count, np.int64)
    if start is not None:
        if np.shape(start.z) != (n,) or np.shape(start.v) != (n,):
            raise PatchfemError(
                f"the start must give {n} displacements and {n} velocities, one displacement and one "
                "velocity for each mode"
            )
        if not np.all(np.isfinite([start.z, start.v])):
            raise PatchfemError("the displacements and velocities of the start must be finite")
        filled[0][0], filled[1][0] = start.z, start.v
    values = np.array(drive.values(np.arange(count) * h), float, order="C")
    # arrays of their own: numba compiles a loop anew for one that is read-only or lies otherwise in memory
    rig = (
        *(
            np.array(one, float, order="C")
            for one in (modes.omega, modes.damping_matrix, modes.interfaces, modes.base)
        ),
        float(modes.mass),
    )
    filled[2][0] = first_forces(modes, table, compiled, values[0], filled[0][0], filled[1][0])
    return Grid(h, table, compiled, rig, values, filled, (np.zeros((5, i)), np.zeros((5, n))))


def first_forces(modes: ModalBasis, laws: np.ndarray, kernels, drive: float, z, v) -> np.ndarray:
    """Friction forces (i,) [N] of a start at coordinates z (n,) [m] and rates v (n,) [m/s].

    laws: rows of `point_laws.rows`; kernels: compiled loops; drive [m s-2] at 0 s. Elastic forces are unstrained, held
    ones hold as far as they can.
    """
    faces = modes.interfaces
    speed, force = faces @ v, np.zeros(len(laws))
    free = -modes.base * drive - modes.omega**2 * z - modes.damping_matrix @ v
    kernels.first_forces(laws, speed, force)
    held = (laws[:, 0] == 0) & (np.abs(speed) < laws[:, 3])
    if np.any(held):
        cross = faces @ faces.T / modes.mass
        need = faces @ free - cross @ force
        hold = np.linalg.lstsq(cross[np.ix_(held, held)], need[held], rcond=None)[0]
        force[held] = np.clip(hold, -laws[held, 1], laws[held, 1])
    return force


def finish(modes: ModalBasis, run: Grid, failures: int, warnings: list) -> Comparison:
    """The result of a filled grid, with its ledger.

    A warning is added where the motion is not finite or more than 1e-3 of the energy that passed through is missing.
    """
    (z, v, force, residual, iterations), m = run.filled, modes.mass
    energy = 0.5 * m * np.sum(v[[0, -1]] ** 2 + (modes.omega * z[[0, -1]]) ** 2, axis=1)
    work = np.trapezoid(-m * run.drive * (v @ modes.base), dx=run.h)
    viscous = np.trapezoid(m * np.einsum("ki,ij,kj->k", v, modes.damping_matrix, v), dx=run.h)
    friction = np.trapezoid(np.einsum("ki,ij,kj->k", force, modes.interfaces, v), dx=run.h)
    stored = energy[1] - energy[0]
    error = work - viscous - friction - stored
    flow = max(abs(work), viscous + abs(friction), abs(stored), 1e-300)
    if not np.isfinite(error):
        step = int(np.argmax(~np.isfinite(v).all(axis=1)))
        warnings = [
            *warnings,
            f"the computed velocity is infinite or undefined from time step {step} on; raise "
            "accuracy.steps_per_cycle",
        ]
    elif abs(error) > 1e-3 * flow:
        warnings = [
            *warnings,
            f"the energy balance has an error: {abs(error) / flow:.1%} of the energy exchanged in "
            f"the run is {'missing' if error > 0 else 'created by the numerical method'}",
        ]
    kept = np.arange(len(z)) * run.h, z, v, force.T, residual.T, iterations
    for array in (*kept, run.drive):
        array.setflags(write=False)
    book = {
        "work_in": work,
        "viscous": viscous,
        "friction": friction,
        "stored": stored,
        "error": error,
    }
    return Comparison(
        *kept,
        int(failures),
        run.drive,
        MappingProxyType({k: float(b) for k, b in book.items()}),
        tuple(warnings),
    )
