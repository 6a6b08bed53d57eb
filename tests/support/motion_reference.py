"""Independent integrator for `motion_scenes` and `hybrid_rigs`: DOP853 between located events.

It reads the numbers of a spec, not the scene, and imports nothing from the package. Energies are
integrated with the motion. `motion_read` evaluates the measures by their definitions: harmonics and
means by a Gauss rule on every step of the integrator, peaks from its dense output.
"""

from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from motion_laws import LAWS
from scipy.integrate import DOP853, OdeSolution
from scipy.optimize import brentq

LOOKS = 4  # Evaluations of the event functions per step of the integrator.


class ModalSystem(NamedTuple):
    """M x'' + C x' + K x = -base a(t) - faces^T F.

    output: (n,); first: stiffness of the first mode at the interface [N/m]; cubic: coefficient of
    the nonlinear spring [N/m3]; fastest: largest natural frequency [Hz].
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    base: np.ndarray
    faces: np.ndarray
    output: np.ndarray
    first: float
    cubic: float
    fastest: float


def make_system(s: dict) -> ModalSystem:
    """Return the modal system of a spec."""
    if s["several"]:
        m = s["masses"]
        K = np.zeros((2, 2))
        C = np.zeros((2, 2))
        for (i, j), k, c in zip(([1, 0], [2, 1], [2, 0]), m["stiffness"], m["damper"]):
            row = _difference_row(i, j)
            K = K + k * np.outer(row, row)
            C = C + c * np.outer(row, row)
        M = np.diag(m["mass"])
        output = np.array([1.0, 0.0])
        faces = np.array([_difference_row(*pair) for pair in m["pairs"]])
        base = -s["mass"] * output if is_driven_by_force(s) else np.array(m["mass"])
        first = 0.0
    else:
        column = {key: np.array([mode[key] for mode in s["modes"]]) for key in s["modes"][0]}
        omega = 2 * np.pi * column["frequency"]
        mass = s["mass"]
        M = mass * np.eye(omega.size)
        output = column["output"]
        faces = column["slide"][None]
        K = np.diag(mass * omega**2)
        C = np.diag(2 * mass * column["damping"] * omega)
        b = s.get("bonded", {"stiffness": 0.0, "damping": 0.0})
        K = K + b["stiffness"] * faces.T @ faces
        C = C + b["damping"] * faces.T @ faces
        base = -mass * output if is_driven_by_force(s) else mass * column["base"]
        first = mass * (omega[0] / column["slide"][0]) ** 2
    fastest = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(M, K)).max()) / (2 * np.pi)
    return ModalSystem(M, C, K, base, faces, output, first, s.get("cubic", 0.0), float(fastest))


def is_driven_by_force(s: dict) -> bool:
    """Return whether a force drives the rig of a spec, rather than its base."""
    return s.get("forced", s["drive"] == "force")


def _difference_row(i: int, j: int) -> np.ndarray:
    """Return the row of the displacement of mass i relative to mass j; 0 is the base."""
    out = np.zeros(3)
    out[i] += 1
    out[j] -= 1
    return out[1:]


def make_drive(s: dict):
    """Return the drive of a spec.

    Returns
    -------
    tuple
        a(t) [m s-2], times at which it is not smooth [s], and whether the base moves.
    """
    kind = s["drive"]
    size = s["size"]
    omega = 2 * np.pi * s["frequency"]
    if kind == "free":
        return (lambda t: 0.0), [], False
    if kind == "step":
        return (lambda t: size), [], True
    if kind == "sweep":
        w = s["sweep"]
        slope = np.sign(w["to"] - w["from"]) * w["rate"]
        return (
            (lambda t: size * np.sin(2 * np.pi * (w["from"] * t + slope * t * t / 2))),
            [],
            not is_driven_by_force(s),
        )
    if kind == "levels":
        length = s["cycles"] / s["frequency"]
        last = len(s["levels"]) - 1

        def acceleration_at(t):
            """Return the base acceleration of a drive with several levels."""
            return s["levels"][min(int(t / length * (1 + 1e-12)), last)] * np.sin(omega * t)

        return acceleration_at, [length * (k + 1) for k in range(last)], True
    if kind == "file":
        time, acceleration_at = map(np.array, s["record"])
        return (
            (lambda t: float(np.interp(t, time, acceleration_at, right=0.0))),
            time[1:].tolist(),
            not is_driven_by_force(s),
        )
    return (lambda t: size * np.sin(omega * t)), [], kind != "force"


class TooManySteps(Exception):
    """Raised if a motion takes more steps than are permitted."""


def integrate_to_event(
    motion, t: float, y, stop: float, guards, tolerances: tuple, max_steps: float = np.inf
) -> tuple:
    """Integrate from t [s] to the first event function that decreases through zero, or to `stop` [s].

    The event functions are evaluated LOOKS times in every step, on its dense output; a value that
    decreases and increases between two evaluations is not noticed.
    """
    first_max_step, (rtol, atol) = motion.max_step(y, motion.derivative(t, y)), tolerances
    solver = DOP853(
        motion.derivative,
        t,
        y,
        stop,
        rtol=rtol,
        atol=atol,
        first_step=min(first_max_step / 50, stop - t),
    )
    times = [t]
    parts = []
    # Of two events at the same time the second one begins the next piece with a value of 0 or just below.
    previous = np.maximum([guard[2](t, y) for guard in guards], 0.0)
    while solver.status == "running":
        solver.max_step = motion.max_step(solver.y, solver.f)
        assert solver.step() is None, "the integrator gave up"
        part = solver.dense_output()
        begin = solver.t_old
        parts.append(part)
        for time in np.linspace(begin, solver.t, LOOKS + 1)[1:]:
            values = np.array([guard[2](time, part(time)) for guard in guards])
            decreased = np.flatnonzero(
                (previous > 0) & (values <= 0) | (previous == 0) & (values < 0)
            )
            if decreased.size:
                roots = [
                    brentq(
                        lambda x, g=guards[k][2], y=part: g(x, y(x)),
                        begin,
                        time,
                        xtol=4e-16,
                        rtol=4e-15,
                    )
                    if previous[k] > 0
                    else begin
                    for k in decreased
                ]
                hit = max(min(roots), np.nextafter(times[-1], np.inf))
                return OdeSolution([*times, hit], parts), guards[decreased[int(np.argmin(roots))]]
            previous = values
            begin = time
        times.append(solver.t)
        if len(times) > max_steps:
            raise TooManySteps("steps without end")
    return OdeSolution(times, parts), None


class SmoothPiece(NamedTuple):
    """Smooth piece of a motion between events: modes, reversals, dense solution, times of its steps."""

    modes: tuple
    turns: list
    solution: object
    times: np.ndarray


class Motion:
    """Equations of a spec; the state is (x, x', states of the laws, friction work).

    share: longest step / shortest period.
    """

    def __init__(self, s: dict, share: float = 0.04):
        loads = s["masses"]["loads"] if s["several"] else [s["load"]]
        laws = [LAWS[s["law"]](s["keys"]["static"] * load, **s["keys"]) for load in loads]
        self.set_equations(s, make_system(s), make_drive(s), laws, share)

    def set_equations(
        self, s: dict, plant: ModalSystem, drive: tuple, laws: list, share: float
    ) -> None:
        """Set the spec, the modal system, the drive as of `make_drive`, and the law of each interface."""
        self.s = s
        self.plant = plant
        self.share = share
        self.drive, self.breaks, self.moving = drive
        self.laws = laws
        self.n = self.plant.M.shape[0]
        self.inverse = np.linalg.inv(self.plant.M)
        ends = np.cumsum([2 * self.n, *(law.size for law in self.laws)])
        self.parts = [slice(a, b) for a, b in pairwise(ends)]
        self.size = int(ends[-1])

    def start(self) -> np.ndarray:
        """Return the initial state."""
        y = np.zeros(self.size + 1)
        if self.s["drive"] == "free":
            x = np.array(self.s["start"])
            y[: self.n] = x
        for law, part in zip(self.laws, self.parts):
            if hasattr(law, "start"):
                y[part] = law.start()
        return y

    def force_without_friction(self, t, y):
        """Return the modal forces without friction."""
        p = self.plant
        x = y[: self.n]
        v = y[self.n : 2 * self.n]
        out = -p.K @ x - p.C @ v - p.base * self.drive(t)
        return out - p.cubic * (p.output @ x) ** 3 * p.output if p.cubic else out

    def load_ratios(self, t, y) -> np.ndarray:
        """Return the load of every interface divided by its mean."""
        return np.ones(len(self.laws))

    def find_resting(self) -> list:
        """Return the numbers of the set-valued interfaces that stick."""
        return [k for k, law in enumerate(self.laws) if law.set_valued and not law.mode]

    def friction_forces(self, t, y, force_without=None):
        """Return the friction forces of all interfaces [N]."""
        force_without = (
            self.force_without_friction(t, y) if force_without is None else force_without
        )
        rates = self.plant.faces @ y[self.n : 2 * self.n]
        out = self.load_ratios(t, y) * [
            law.mode * law.kinetic if law.set_valued else law.force(y[part], v, t)
            for law, part, v in zip(self.laws, self.parts, rates)
        ]
        stuck = self.find_resting()
        if stuck:
            # Rows that depend on each other share the force by least squares.
            out[stuck] = 0.0
            rows = self.plant.faces[stuck]
            unbalanced = force_without - self.plant.faces.T @ out
            matrix = rows @ self.inverse @ rows.T
            out[stuck] = np.linalg.lstsq(matrix, rows @ self.inverse @ unbalanced, rcond=1e-12)[0]
        return out

    def derivative(self, t, y):
        """Return the time derivative of the state."""
        pull = self.force_without_friction(t, y)
        v = y[self.n : 2 * self.n]
        force = self.friction_forces(t, y, pull)
        rates = self.plant.faces @ v
        out = np.empty_like(y)
        out[: self.n] = v
        out[self.n : 2 * self.n] = self.inverse @ (pull - self.plant.faces.T @ force)
        for law, part, rate in zip(self.laws, self.parts, rates):
            out[part] = law.rate(y[part], rate, t)
        out[-1] = force @ rates
        return out

    def interface_accelerations(self, t, y):
        """Return the relative accelerations at the interfaces."""
        return self.plant.faces @ self.derivative(t, y)[self.n : 2 * self.n]

    def guards(self) -> list:
        """Return the event functions of the present modes.

        They are tuples (number of the interface, number of the event, function).
        """
        out = []
        for k, law in enumerate(self.laws):
            face = self.plant.faces[k]
            part = self.parts[k]
            if law.set_valued and law.mode == 0:
                for side in (1, -1):
                    out.append(
                        (
                            k,
                            side,
                            lambda t, y, k=k, side=side, law=law: (
                                law.limit * self.load_ratios(t, y)[k]
                                - side * self.friction_forces(t, y)[k]
                            ),
                        )
                    )
            elif law.set_valued:
                out.append(
                    (
                        k,
                        0,
                        lambda t, y, face=face, law=law: law.mode * (face @ y[self.n : 2 * self.n]),
                    )
                )
            else:
                count = len(law.guards(np.zeros(max(law.size, 1)) + 1e-30, 0.0, 0.0))
                for g in range(count):
                    out.append(
                        (
                            k,
                            g,
                            lambda t, y, face=face, part=part, law=law, g=g: law.guards(
                                y[part], face @ y[self.n : 2 * self.n], t
                            )[g],
                        )
                    )
        return out

    def choose_modes(self, t, y, active) -> None:
        """Choose the modes of the set-valued interfaces in `active`, none of which slides.

        It is the first consistent choice.
        """
        for option in sorted(
            product((0, 1, -1), repeat=len(active)), key=lambda c: sum(map(abs, c))
        ):
            for k, mode in zip(active, option):
                self.laws[k].mode = mode
            force = self.friction_forces(t, y)
            accel = self.interface_accelerations(t, y)
            scale = max(law.limit for law in self.laws) * 1e-9
            ratios = self.load_ratios(t, y)
            if all(
                abs(force[k]) <= self.laws[k].limit * ratios[k] + scale
                if not self.laws[k].mode
                else self.laws[k].mode * accel[k] * self.plant.M[0, 0] > -scale
                for k in active
            ):
                return
        raise AssertionError("no choice")

    def max_step(self, y, slope) -> float:
        """Return the longest step [s] of the integrator from a state y with its derivative.

        It is a fraction of the shortest period. The displacement, or the change of the velocity, is
        limited to the scale over which a law relaxes, because with longer steps the dense output
        has errors of 1e-4.
        """
        out = self.share / max(self.plant.fastest, self.s["frequency"])
        n = self.n
        speeds = np.abs(self.plant.faces @ y[n : 2 * n])
        accelerations = np.abs(self.plant.faces @ slope[n : 2 * n]) + 1e-300
        for law, speed, acceleration in zip(self.laws, speeds, accelerations):
            if law.relaxes:
                # Limit of the displacement |v| h + |a| h^2/2 in a step.
                reach = 30 * self.share * law.scale()
                out = min(out, 2 * reach / (speed + np.sqrt(speed**2 + 2 * acceleration * reach)))
            if law.speed_key:
                slow = law.keys[law.speed_key]
                out = min(out, max(speed - 5 * slow, 12 * self.share * slow) / acceleration)
        return out

    def run(self, end: float, rtol: float, start=None, max_steps: float = np.inf) -> list:
        """Return the smooth pieces of the motion from 0 to `end` [s].

        Parameters
        ----------
        end : float
        rtol : float
            Relative error of a step.
        start : array, optional
            Initial state; by default that of the scene.
        max_steps : float
            Number of steps above which TooLong is raised.
        """
        t = 0.0
        y = self.start() if start is None else np.append(start, 0.0)
        pieces = []
        n = self.n
        stops = [b for b in self.breaks if 0 < b < end * (1 - 1e-12)] + [end]
        reach = self.s["size"] / self.s["seeded"] ** 2
        atol = np.full(y.size, rtol * 1e-3 * reach)
        atol[n : 2 * n] *= self.s["seeded"]
        for law, part in zip(self.laws, self.parts):
            atol[part] = rtol * 1e-2 * law.unit()
        atol[-1] = rtol * 1e-2 * reach * self.laws[0].limit
        rates = self.plant.faces @ y[n : 2 * n]
        for law, v in zip(self.laws, rates):
            law.set_initial_mode(v, 0.0)
        self.choose_modes(t, y, self.find_resting())
        accelerations = self.interface_accelerations(t, y)
        for law, part, v, a in zip(self.laws, self.parts, rates, accelerations):
            if not law.set_valued:
                law.set_initial_mode(v, a)
                law.set_initial_side(y[part])
        n_short_pieces = count = 0
        for stop in stops:
            while t < stop:
                guards = self.guards()
                modes = tuple((law.mode, law.side) for law in self.laws)
                state = [list(law.turns) for law in self.laws]
                solution, hit = integrate_to_event(
                    self, t, y, stop, guards, (rtol, atol), max_steps - count
                )
                pieces.append(SmoothPiece(modes, state, solution, solution.ts))
                count += solution.ts.size
                if count > max_steps:
                    raise TooManySteps
                n_short_pieces = (
                    n_short_pieces + 1 if solution.t_max - t < 1e-9 / self.s["frequency"] else 0
                )
                # Such a motion would stick: the printed law of order 0 that starts from rest.
                if n_short_pieces >= 50:
                    raise TooManySteps("events without end")
                t = float(solution.t_max)
                y = solution(t)
                if hit is not None:
                    self.apply_event(t, y, *hit[:2])
                elif t < end:
                    self.choose_modes(t, y, self.find_resting())
        return pieces

    def apply_event(self, t, y, k: int, g: int) -> None:
        """Apply event g of interface k to the modes and the state."""
        law = self.laws[k]
        n = self.n
        face = self.plant.faces[k]
        if law.set_valued and law.mode == 0:
            law.mode = g
            self.choose_modes(t, y, self.find_resting())
            return
        v = y[n : 2 * n]
        if law.set_valued:
            v -= self.inverse @ face * (face @ v) / (face @ self.inverse @ face)
            law.mode = 0
            self.choose_modes(t, y, self.find_resting())
            return
        accel = self.interface_accelerations(t, y)[k]
        y[self.parts[k]] = law.apply_event(g, y[self.parts[k]], face @ v, accel)
