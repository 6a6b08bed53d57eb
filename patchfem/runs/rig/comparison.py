"""The report's own and other comparison methods as engines of a rig, with the warnings that they deserve."""

from dataclasses import replace
from itertools import pairwise
from time import perf_counter

import numpy as np

from ...core import Outcome
from ...dynamics.comparison import point_laws
from ...dynamics.cycles import hermite_extremes
from ...dynamics.integrated import Integrated, Run
from ...dynamics.march.models import load_kernels
from ...effects import has, module_of
from ...friction.record import law_from
from ...structure.drive_sizes import omega_of, peak_speed
from .reading import Reader, friction_works
from .solution import borne, sampled_loop

TOLERANCE = 1e-6  # of a converged step, relative, where the scene does not say


def laws_of(model, load: float) -> list:
    """A law of dynamics.point_laws per interface."""
    out, accuracy = [], model.accuracy
    for one in model.rig.interfaces:
        f, bears = one.numbers, load if one.load is None else one.load
        if has(f.law, "set-valued"):
            out.append(point_laws.Coulomb(*one.limits(bears), accuracy.stick_speed or 0.0))
        else:
            out.append(point_laws.Smooth(law_from(f, bears).element(bears)))
    return out


def run_comparison(model, numerics, patch, frames: int = 0, say=None, progress=None):
    """Solution of a comparison method (Newmark, Duhamel, Euler) at numerics.steps per cycle.

    Arguments as `march.run_march`; no interface frames. PatchfemError for a law that these methods cannot take.
    """
    load_kernels(say)
    rig, modes, drive = model.rig, model.rig.modes, model.rig.drive
    laws, begin = laws_of(model, borne(model, patch)), perf_counter()
    done = _integrated(model, numerics, laws)
    response = _with_slip(_with_interfaces(done.response(modes, drive.moving), modes), laws)
    beyond = np.flatnonzero(np.abs(response.output) > rig.travel)
    if beyond.size and 0 < beyond[0] < response.time.size - 1:  # the run ends at the first step beyond the stop
        cut = replace(numerics, cycles=response.time[beyond[0]] / drive.period)
        done = _integrated(model, cut, laws)
        response = _with_slip(_with_interfaces(done.response(modes, drive.moving), modes), laws)
    n = numerics.steps
    kept = response.at(slice(max(0, response.time.size - 1 - numerics.window * n), None))
    run = Run(response, kept, *_cycles(response, n), _book(done), _outcome(model, done, response))
    return Compared(model, numerics, patch).solution(run, perf_counter() - begin, notes=done.warnings,
                                                     prepare={"reduce": 0.0, "compiled_code": 0.0})


class Compared(Reader):
    """What a finished comparison run shows: all of it by its samples."""

    def integrated(self, run, drive) -> Integrated:
        """Friction work along the slides of all samples, and that of the ledger, which is summed in time."""
        return Integrated(books=friction_works(run.response, run.ledger["friction"]))

    def more(self, run, drive, stuck: bool) -> dict:
        """The loop by the trapezoidal rule, and the ledger."""
        w, spent = run.window, run.ledger["friction"]
        span = w.time[-1] - w.time[0]
        work = float(np.trapezoid(w.force, w.slide)) * drive.period / span if span > 0 else 0.0
        return {"loop": sampled_loop(w, drive, work), "ledger": np.array([[spent], [0.0], [spent], [0.0]])}


def _integrated(model, numerics, laws):
    accuracy, modes, drive, start = model.accuracy, model.rig.modes, model.rig.drive, model.rig.start
    duration = numerics.cycles * drive.period
    if not laws:
        laws = [point_laws.NO_FRICTION] * len(modes.interfaces)
    method = module_of(f"accuracy.method={accuracy.method}")
    if accuracy.method == "duhamel":
        criterion = accuracy.convergence or "force"
        speed, omega = peak_speed(drive, start), omega_of(drive)
        unit = {"displacement": speed / omega, "velocity": speed, "force": max(law.limit for law in laws)}[criterion]
        return method.run(modes, drive, laws, duration, numerics.steps, criterion,
                          (accuracy.convergence_tolerance or TOLERANCE) * unit, start=start)
    if accuracy.method == "newmark":
        return method.run(modes, drive, laws, duration, numerics.steps, accuracy.stick_speed, start=start)
    return method.run(modes, drive, laws, duration, numerics.steps, start)


def _with_interfaces(response, modes):
    """The response with slides, slide_rates and forces (k, i) of every interface, where there are several."""
    extra = {name: response.extra[name] for name in ("residual", "iterations")}
    if len(modes.interfaces) > 1:
        faces = modes.interfaces.T
        extra |= {"slides": response.modal @ faces, "slide_rates": response.modal_rate @ faces,
                  "forces": response.extra["forces"].T}
    return replace(response, extra=extra)


def _with_slip(response, laws):
    """The irreversible slip of elastic-plastic interfaces in place of their slide."""
    give = np.array([getattr(law, "compliance", 0.0) for law in laws])
    if not give.any():
        return response
    extra = response.extra
    if "slides" in extra:
        extra = extra | {"slips": extra["slides"] - extra["forces"] * give}
    return replace(response, slip=response.slide - response.force * give[0], extra=extra)


def _cycles(response, n: int) -> tuple:
    """Extremes (c, 2) and phasors (c,) of the output per cycle, the partial cycle first."""
    edges = np.arange(response.time.size - 1, 0, -n)[::-1]
    edges = np.concatenate([[0], edges]) if edges[0] else edges
    dt, low_high, phasors = response.time[1] - response.time[0], [], []
    for a, b in pairwise(edges):
        y, v = response.output[a:b + 1], response.output_rate[a:b + 1]
        low_high.append(hermite_extremes(y, v, dt))
        phasors.append(2 * np.mean(y[:-1] * np.exp(-2j * np.pi * np.arange(a, b) / n)))
    return np.array(low_high), np.array(phasors)


def _book(done) -> dict:
    book = {name: float(done.ledger[name]) for name in ("work_in", "viscous", "friction", "stored")}
    return book | {"power": abs(book["work_in"]) + abs(book["friction"]), "peak_stored": abs(book["stored"]),
                   "iterations": float(done.iterations.sum())}


def _outcome(model, done, response):
    if not np.isfinite(response.slide[-1]) or (model.accuracy.method == "duhamel" and done.failures):
        return Outcome.NOT_CONVERGED
    return Outcome.EXCEEDS_TRAVEL if np.abs(response.output).max() > model.rig.travel else None
