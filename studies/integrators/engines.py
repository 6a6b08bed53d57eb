"""Every engine of the work-precision study as one callable: (problem, knob) to the slide at the problem's times.

An engine of ours more is one entry in `OURS`; a peer answers from a child process and brings its own CPU seconds.
"""

from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
import problems
from scipy.integrate import solve_ivp
from switched import PROBLEMS, follow

from patchfem.compiled import load
from patchfem.core import ModalBasis, NotConverged, Start
from patchfem.dynamics.comparison import duhamel, euler, newmark
from patchfem.dynamics.comparison.point_laws import Coulomb, Smooth
from patchfem.dynamics.march import march as marching
from patchfem.dynamics.march import models
from patchfem.dynamics.one_mode import sdof, sdof_kernels
from patchfem.dynamics.one_mode.sdof_samples import position
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.tanh import Rate
from patchfem.model.model import build
from patchfem.runs.patch.ladder import solve_all
from patchfem.runs.rig.interface import contact_model
from patchfem.runs.rig.numerics import choose
from patchfem.scene import scene
from patchfem.structure.drives import release

HERE = Path(__file__).parent
POINTS = 20  # per cycle at which slides are compared
TRUTH = 204800  # steps per cycle of the march that stands for the truth of the patch


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """limit [N] of one Coulomb interface, or `elements` (stiffness [N/m], yield slide [m]); `numbers`: the same for a
    peer, as `switched` names them; size: of a state, for absolute tolerances; longest: step a peer may take, in cycles,
    lest it pass over an event; last: cycles over which the error is taken; truth (k,) [m]: the slide at `times`."""

    name: str
    modes: ModalBasis
    drive: object
    limit: float
    cycles: int
    numbers: dict
    elements: tuple | None = None
    size: float = 1.0
    longest: float = 1 / 8
    last: int = 5
    start: Start | None = None
    truth: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def times(self) -> np.ndarray:
        """Instants of the last cycles."""
        return (self.cycles - self.last + np.arange(1, self.last * POINTS + 1) / POINTS) * self.drive.period

    def error(self, slide) -> float:
        """Largest error of the slide over its largest value."""
        return float(np.abs(slide - self.truth).max() / np.abs(self.truth).max())


@cache
def problem(name: str) -> Problem:
    """"decay", "block", "two" or "patch"."""
    if name == "decay":
        rest, half = Start(np.array([11.5]), np.zeros(1)), np.pi
        made = Problem(name, problems.PLAIN, release(2 * half), 1.0, 16,
                       {"limit": 1.0, "xi": 0.0, "size": 0.0, "place": 11.5}, last=16, start=rest)
        done = np.minimum(np.floor(made.times / half), 6)  # 3.11 with N0 rounded up
        return replace(made, truth=np.where(done < 6, (10.5 - 2 * done) * np.cos(made.times) + (-1)**done, -0.5))
    if name == "block":
        made = Problem(name, problems.SDOF, problems.SDOF_DRIVE, problems.SDOF_LIMIT, 60,
                       {"limit": problems.SDOF_LIMIT, "xi": 0.003})
        return replace(made, truth=exact(made, 0))
    if name == "two":
        made = Problem(name, problems.TWO, problems.TWO_DRIVE, problems.TWO_LIMIT, 20,
                       {"limit": problems.TWO_LIMIT, "omega": 1.14})
        return replace(made, truth=exact(made, 0))
    model = build(scene.load(HERE / "patch.toml"))
    modes, drive = model.rig.modes, model.rig.drive
    contact = contact_model(model, choose(model), solve_all(model.patch, model.accuracy.tolerance, False)[0])
    k, y = contact.element.numbers[2:].reshape(2, -1)
    numbers = {"omega": modes.omega, "zeta": modes.zeta, "slide": modes.slide, "base": modes.base, "mass": modes.mass,
               "drive": drive.acceleration, "drive_omega": drive.omega, "stiffness": k, "yields": y}
    made = Problem(name, modes, drive, contact.limit, 20,
                   {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in numbers.items()},
                   (np.array(k), np.array(y)), 1e-5, 1 / 100)
    return replace(made, truth=march(made, TRUTH))


def exact(one: Problem, _) -> np.ndarray:
    """The event engine of any modes, plain Python."""
    return problems.sampled(one.modes, one.drive, one.limit, one.cycles, one.times, one.start).slide


def one_mode(one: Problem, _, kernels=None) -> np.ndarray:
    """The compiled event engine of one mode."""
    kernels = kernels or load("dynamics.one_mode.event_kernels")
    made = sdof.scene_of(one.modes, one.drive, one.limit, one.limit, one.cycles * one.drive.period)
    rows, state, none = np.zeros((16 * one.cycles, sdof_kernels.ROW)), np.zeros(9), np.empty((0, 2))
    z, v = (0.0, 0.0) if one.start is None else (float(one.start.z[0]), float(one.start.v[0]))
    kernels.enter(state, made.segments, 0, 0.0, 0.0, z, v, 1.0, *made.friction, made.w**2)
    code, used = kernels.march((made.w, made.decay), made.friction, made.segments, (one.drive.period, np.inf, 0.0, 0.0),
                               state, rows, none, np.zeros(10))
    if code != 1:
        raise NotConverged(f"the event engine ended with code {code}")
    times = one.times
    owner = np.searchsorted(rows[:used, 0], times, side="right") - 1
    return made.slide * position(np.clip(times - rows[owner, 0], 0.0, rows[owner, 2]), rows, owner, made)


def march(one: Problem, steps: int) -> np.ndarray:
    """The march at `steps` per cycle."""
    model = models.coulomb_model(one.limit, one.limit) if one.elements is None \
        else models.jenkins_model(*one.elements)
    found = marching.march(one.modes, one.drive, model, one.cycles, steps, one.last, start=one.start)
    return found.window.slide[::steps // POINTS][1:]


def _compared(method, one: Problem, steps: int, law, **how) -> np.ndarray:
    modes, laws = one.modes, (law,)
    if one.elements is not None:
        k, y = one.elements
        laws = tuple(Smooth(ElasticPlastic(a * b, b).element(1.0)) for a, b in zip(k, y))
        modes = replace(modes, faces=np.tile(modes.slide, (k.size, 1)))
    found = method.run(modes, one.drive, laws, one.cycles * one.drive.period, steps, start=one.start, **how)
    return (found.z[-one.last * steps - 1:] @ modes.slide)[::steps // POINTS][1:]


def duhamel_report(one: Problem, steps: int) -> np.ndarray:
    """(3.10) as the report ran it: sgn(v), the velocity unchanged to 1e-4."""
    return _compared(duhamel, one, steps, Coulomb(one.limit, one.limit), convergence="velocity",
                     tolerance=1e-4 if one.elements is None else 1e-9, relax=0.1 if one.elements is None else 0.5)


def duhamel_cured(one: Problem, steps: int) -> np.ndarray:
    """(3.10) with a static branch that narrows with the step, the force to 1e-9 of its limit."""
    return _compared(duhamel, one, steps, Coulomb(one.limit, one.limit, 0.1 * one.drive.period / steps),
                     convergence="force", tolerance=1e-9 * one.limit)


def newmark_report(one: Problem, steps: int) -> np.ndarray:
    """Newmark with a stick speed of 1e-3, stopped by the speed alone."""
    return _compared(newmark, one, steps, Coulomb(one.limit, one.limit, 1e-3))


def newmark_cured(one: Problem, steps: int) -> np.ndarray:
    """Newmark, stopped where the static friction suffices below what friction takes off the speed in a step."""
    return _compared(newmark, one, steps, Coulomb(one.limit, one.limit, one.limit * one.drive.period / steps),
                     by_force=True)


def euler_tanh(one: Problem, steps: int) -> np.ndarray:
    """Explicit Euler and friction limit tanh(v/1e-3)."""
    return _compared(euler, one, steps, Smooth(Rate(one.limit, 1e-3).element(1.0)))


def advancer(tolerance: float, size: float):
    """`advance` of `switched` by scipy's DOP853 with one event."""
    def advance(rhs, event, t, y, end, longest, wanted):
        def stop(t, y):
            return event(t, y)

        stop.terminal, stop.direction = True, -1
        found = solve_ivp(rhs, (t, end), y, "DOP853", events=stop, rtol=tolerance, atol=tolerance * size,
                          max_step=longest, t_eval=wanted)
        if found.status < 0:
            raise RuntimeError(found.message)
        states = np.asarray(found.y).T if len(found.t) else []
        if found.status == 1:
            return found.t_events[0][-1], found.y_events[0][-1], states
        return end, found.y[:, -1], states

    return advance


def counted(one: Problem, tolerance: float, longest: float) -> tuple:
    """(slide, events) of scipy's DOP853 from event to event, no step longer than so many cycles."""
    return follow(PROBLEMS[KIND[one.name]](**one.numbers), advancer(tolerance, one.size), one.times, longest)


def dop853(one: Problem, tolerance: float) -> np.ndarray:
    """scipy's DOP853 from event to event."""
    return counted(one, tolerance, one.longest)[0]


KIND = {"decay": "block", "block": "block", "two": "two", "patch": "patch"}  # as `switched` names them
POINT, ALL = ("decay", "block", "two"), ("decay", "block", "two", "patch")
COARSE = (100, 200, 400, 800, 1600, 3200, 6400)
FINE = (1000, 2000, 4000, 8000, 16000, 32000)
OURS = {  # name: (callable, knobs, problems); one entry more for an engine more
    "exact": (exact, (0,), POINT),
    "exact, one mode": (one_mode, (0,), ("decay", "block")),
    "march": (march, (*COARSE, 12800, 25600), ALL),
    "duhamel, report": (duhamel_report, COARSE, POINT),
    "duhamel, static branch": (duhamel_cured, COARSE, ALL),
    "newmark, stick speed": (newmark_report, COARSE, POINT),
    "newmark, and force": (newmark_cured, COARSE, ALL),
    "euler, tanh": (euler_tanh, FINE, ALL),
    "DOP853 + events": (dop853, (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), ALL),
}


def cvode(peer, one: Problem, tolerance: float, method: str = "Adams") -> tuple:
    """(slide, CPU seconds) of SUNDIALS' CVODE with its root finder."""
    found = peer.ask(problem=KIND[one.name], numbers=one.numbers, tolerance=tolerance, scale=one.size, method=method,
                     longest=one.longest, times=one.times.tolist())
    return np.array(found["slide"]), found["seconds"]


MATRICES = {"decay": {"mass": [[1.0]], "damper": [[0.0]], "stiffness": [[1.0]], "row": [1.0], "load": [-1.0]},
            "block": {"mass": [[1.0]], "damper": [[0.006]], "stiffness": [[1.0]], "row": [1.0], "load": [-1.0]},
            "two": {"mass": [[1.0, 0.0], [0.0, 1.0]], "damper": [[0.0, 0.0], [0.0, 0.0]],
                    "stiffness": [[1.0, -1.0], [-1.0, 1.0]], "row": [0.0, 1.0], "load": [1.0, 0.0]}}


def siconos(peer, one: Problem, steps: int, theta: float = 0.5) -> tuple:
    """(slide, CPU seconds) of Siconos' Moreau-Jean steps with a relay."""
    found = peer.ask(**MATRICES[one.name], limit=one.limit, amplitude=1.0 if one.start is None else 0.0,
                     omega=2 * np.pi / one.drive.period, place=[0.0, 0.0] if one.start is None else [11.5],
                     step=one.drive.period / steps, steps=one.cycles * steps, theta=theta, every=steps // POINTS,
                     last=one.last * POINTS)
    return np.array(found["slide"]), found["seconds"]


PEERS = {  # name: (callable, knobs, problems, script, variable of its interpreter, remedy)
    "SUNDIALS CVODE": (cvode, (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), ALL, "sundials_child.py",
                       "PATCHFEM_SUNDIALS_PYTHON", "pip install scikit-sundae"),
    "Siconos, theta 1/2": (siconos, (100, 200, 400, 1000, 4000), POINT, "siconos_child.py",
                           "PATCHFEM_SICONOS_PYTHON", "apt install python3-siconos"),
}
