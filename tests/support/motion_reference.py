"""Independent integrator for `motion_scenes`: DOP853 between located events.

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


def plant_of(s: dict) -> ModalSystem:
    """Return the modal system of a spec."""
    if s["several"]:
        m = s["masses"]
        K = np.zeros((2, 2))
        C = np.zeros((2, 2))
        for (i, j), k, c in zip(([1, 0], [2, 1], [2, 0]), m["stiffness"], m["damper"]):
            row = _row(i, j)
            K = K + k * np.outer(row, row)
            C = C + c * np.outer(row, row)
        M = np.diag(m["mass"])
        output = np.array([1.0, 0.0])
        faces = np.array([_row(*pair) for pair in m["pairs"]])
        base = -s["mass"] * output if forced(s) else np.array(m["mass"])
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
        base = -mass * output if forced(s) else mass * column["base"]
        first = mass * (omega[0] / column["slide"][0]) ** 2
    fastest = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(M, K)).max()) / (2 * np.pi)
    return ModalSystem(M, C, K, base, faces, output, first, s.get("cubic", 0.0), float(fastest))


def forced(s: dict) -> bool:
    """Return whether a force drives the rig of a spec, rather than its base."""
    return s.get("forced", s["drive"] == "force")


def _row(i: int, j: int) -> np.ndarray:
    """Return the row of the displacement of mass i relative to mass j; 0 is the base."""
    out = np.zeros(3)
    out[i] += 1
    out[j] -= 1
    return out[1:]


def drive_of(s: dict):
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
            not forced(s),
        )
    if kind == "levels":
        length = s["cycles"] / s["frequency"]
        last = len(s["levels"]) - 1

        def value(t):
            """Return the base acceleration of a drive with several levels."""
            return s["levels"][min(int(t / length * (1 + 1e-12)), last)] * np.sin(omega * t)

        return value, [length * (k + 1) for k in range(last)], True
    if kind == "file":
        time, value = map(np.array, s["record"])
        return (
            (lambda t: float(np.interp(t, time, value, right=0.0))),
            time[1:].tolist(),
            not forced(s),
        )
    return (lambda t: size * np.sin(omega * t)), [], kind != "force"


class TooLong(Exception):
    """Raised if a motion takes more steps than are permitted."""


def stretched(
    motion, t: float, y, stop: float, guards, tolerances: tuple, most: float = np.inf
) -> tuple:
    """Integrate from t [s] to the first event function that decreases through zero, or to `stop` [s].

    The event functions are evaluated LOOKS times in every step, on its dense output; a value that
    decreases and increases between two evaluations is not noticed.
    """
    first, (rtol, atol) = motion.longest(y, motion.slope(t, y)), tolerances
    solver = DOP853(
        motion.slope, t, y, stop, rtol=rtol, atol=atol, first_step=min(first / 50, stop - t)
    )
    times = [t]
    parts = []
    before = np.array([guard[2](t, y) for guard in guards])
    while solver.status == "running":
        solver.max_step = motion.longest(solver.y, solver.f)
        assert solver.step() is None, "the integrator gave up"
        part = solver.dense_output()
        begin = solver.t_old
        parts.append(part)
        for at in np.linspace(begin, solver.t, LOOKS + 1)[1:]:
            after = np.array([guard[2](at, part(at)) for guard in guards])
            fell = np.flatnonzero((before > 0) & (after <= 0) | (before == 0) & (after < 0))
            if fell.size:
                roots = [
                    brentq(
                        lambda x, g=guards[k][2], y=part: g(x, y(x)),
                        begin,
                        at,
                        xtol=4e-16,
                        rtol=4e-15,
                    )
                    if before[k] > 0
                    else begin
                    for k in fell
                ]
                hit = max(min(roots), np.nextafter(times[-1], np.inf))
                return OdeSolution([*times, hit], parts), guards[fell[int(np.argmin(roots))]]
            before = after
            begin = at
        times.append(solver.t)
        if len(times) > most:
            raise TooLong("steps without end")
    return OdeSolution(times, parts), None


class Stretch(NamedTuple):
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
        self.s = s
        self.plant = plant_of(s)
        self.share = share
        self.drive, self.breaks, self.moving = drive_of(s)
        loads = s["masses"]["loads"] if s["several"] else [s["load"]]
        self.laws = [LAWS[s["law"]](s["keys"]["static"] * load, **s["keys"]) for load in loads]
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

    def pull(self, t, y):
        """Return the modal forces without friction."""
        p = self.plant
        x = y[: self.n]
        v = y[self.n : 2 * self.n]
        out = -p.K @ x - p.C @ v - p.base * self.drive(t)
        return out - p.cubic * (p.output @ x) ** 3 * p.output if p.cubic else out

    def forces(self, t, y, pull=None):
        """Return the friction forces of all interfaces [N]."""
        pull = self.pull(t, y) if pull is None else pull
        rates = self.plant.faces @ y[self.n : 2 * self.n]
        if not self.laws[0].set_valued:
            return np.array(
                [law.force(y[part], v, t) for law, part, v in zip(self.laws, self.parts, rates)]
            )
        out = np.array([law.mode * law.kinetic for law in self.laws])
        stuck = [k for k, law in enumerate(self.laws) if not law.mode]
        if stuck:
            rows = self.plant.faces[stuck]
            rest = pull - self.plant.faces.T @ out
            out[stuck] = np.linalg.solve(rows @ self.inverse @ rows.T, rows @ self.inverse @ rest)
        return out

    def slope(self, t, y):
        """Return the time derivative of the state."""
        pull = self.pull(t, y)
        v = y[self.n : 2 * self.n]
        force = self.forces(t, y, pull)
        rates = self.plant.faces @ v
        out = np.empty_like(y)
        out[: self.n] = v
        out[self.n : 2 * self.n] = self.inverse @ (pull - self.plant.faces.T @ force)
        for law, part, rate in zip(self.laws, self.parts, rates):
            out[part] = law.rate(y[part], rate, t)
        out[-1] = force @ rates
        return out

    def accelerations(self, t, y):
        """Return the relative accelerations at the interfaces."""
        return self.plant.faces @ self.slope(t, y)[self.n : 2 * self.n]

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
                                law.limit - side * self.forces(t, y)[k]
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

    def choose(self, t, y, active) -> None:
        """Choose the modes of the set-valued interfaces in `active`, none of which slides.

        It is the first consistent choice.
        """
        for option in sorted(
            product((0, 1, -1), repeat=len(active)), key=lambda c: sum(map(abs, c))
        ):
            for k, mode in zip(active, option):
                self.laws[k].mode = mode
            force = self.forces(t, y)
            accel = self.accelerations(t, y)
            scale = max(law.limit for law in self.laws) * 1e-9
            if all(
                abs(force[k]) <= self.laws[k].limit + scale
                if not self.laws[k].mode
                else self.laws[k].mode * accel[k] * self.plant.M[0, 0] > -scale
                for k in active
            ):
                return
        raise AssertionError("no choice")

    def longest(self, y, slope) -> float:
        """Return the longest step [s] of the integrator from a state y with its derivative.

        It is a fraction of the shortest period. The displacement, or the change of the velocity, is
        limited to the scale over which a law relaxes, because with longer steps the dense output
        has errors of 1e-4.
        """
        out = self.share / max(self.plant.fastest, self.s["frequency"])
        n = self.n
        speed = np.abs(self.plant.faces @ y[n : 2 * n]).max()
        gain = np.abs(self.plant.faces @ slope[n : 2 * n]).max() + 1e-300
        if self.s["law"] in ("stretch", "growing", "bouc-wen", "lugre", "report"):
            # Limit of the displacement |v| h + |a| h^2/2 in a step.
            way = 30 * self.share * min(law.scale() for law in self.laws)
            out = min(out, 2 * way / (speed + np.sqrt(speed**2 + 2 * gain * way)))
        if self.s["law"] in ("tanh", "lugre"):
            unit = self.s["keys"][
                "reference_speed" if self.s["law"] == "tanh" else "stribeck_speed"
            ]
            out = min(out, max(speed - 5 * unit, 12 * self.share * unit) / gain)
        return out

    def run(self, end: float, rtol: float, start=None, most: float = np.inf) -> list:
        """Return the smooth pieces of the motion from 0 to `end` [s].

        Parameters
        ----------
        end : float
        rtol : float
            Relative error of a step.
        start : array, optional
            Initial state; by default that of the scene.
        most : float
            Number of steps above which TooLong is raised.
        """
        t = 0.0
        y = self.start() if start is None else np.append(start, 0.0)
        out = []
        n = self.n
        stops = [b for b in self.breaks if 0 < b < end * (1 - 1e-12)] + [end]
        reach = self.s["size"] / self.s["seeded"] ** 2
        atol = np.full(y.size, rtol * 1e-3 * reach)
        atol[n : 2 * n] *= self.s["seeded"]
        for law, part in zip(self.laws, self.parts):
            atol[part] = rtol * 1e-2 * (1.0 if self.s["law"] == "bouc-wen" else law.scale())
        atol[-1] = rtol * 1e-2 * reach * self.laws[0].limit
        rates = self.plant.faces @ y[n : 2 * n]
        for law, v, a in zip(self.laws, rates, np.zeros(len(self.laws))):
            law.begin(v, a)
        if not self.laws[0].set_valued:
            for law, v, a in zip(self.laws, rates, self.accelerations(t, y)):
                law.begin(v, a)
            for law, part in zip(self.laws, self.parts):
                law.resume(y[part])
        else:
            self.choose(t, y, [k for k, law in enumerate(self.laws) if law.mode == 0])
        same = count = 0
        for stop in stops:
            while t < stop:
                guards = self.guards()
                modes = tuple((law.mode, law.side) for law in self.laws)
                state = [list(law.turns) for law in self.laws if hasattr(law, "turns")]
                done, hit = stretched(self, t, y, stop, guards, (rtol, atol), most - count)
                out.append(Stretch(modes, state, done, done.ts))
                count += done.ts.size
                if count > most:
                    raise TooLong
                same = same + 1 if done.t_max - t < 1e-9 / self.s["frequency"] else 0
                # Such a motion would stick: the printed law of order 0 that starts from rest.
                if same >= 50:
                    raise TooLong("events without end")
                t = float(done.t_max)
                y = done(t)
                if hit is not None:
                    self.turn(t, y, *hit[:2])
                elif self.laws[0].set_valued and t < end:
                    self.choose(t, y, [k for k, law in enumerate(self.laws) if law.mode == 0])
        return out

    def turn(self, t, y, k: int, g: int) -> None:
        """Apply event g of interface k to the modes and the state."""
        law = self.laws[k]
        n = self.n
        face = self.plant.faces[k]
        if law.set_valued and law.mode == 0:
            law.mode = g
            others = [j for j, one in enumerate(self.laws) if one.mode == 0 and j != k]
            if others:
                self.choose(t, y, others)
            return
        v = y[n : 2 * n]
        if law.set_valued:
            v -= self.inverse @ face * (face @ v) / (face @ self.inverse @ face)
            law.mode = 0
            self.choose(t, y, [j for j, one in enumerate(self.laws) if one.mode == 0])
            return
        accel = self.accelerations(t, y)[k]
        y[self.parts[k]] = law.turned(g, y[self.parts[k]], face @ v, accel)
