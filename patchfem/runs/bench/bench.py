"""Law bench: slide an interface along a prescribed path; compute the loop and its measures.

In: a model with [slide] and its pressed patch, or none for a single point. Out: a `BenchRun`,
with or without the shear compliance of the pieces.
"""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...response.loops import (
    find_reversals,
    interface_loop,
    mean_half_range,
    reversal_evaluation,
    secant_stiffness,
)
from ...response.measures import (
    compute_harmonic,
    compute_ledger_measures,
    compute_step_harmonic,
    work_difference,
)
from . import rigid, shear
from . import stepped as stepping
from .closed import closed_form
from .engine import CLOSED, STEPPED, BenchEngine, bench_engine
from .ledger import DEFAULT_OPTIONS, PassOptions
from .stepped import slide_step_by_step


@dataclass(frozen=True, eq=False, slots=True)
class BenchRun:
    """One pass along the path, at k samples.

    - time, slide, rate, force, load, slip (k,): [s], [m], [m/s], [N], [N], [m].
    - ledger (4, k): work, stored, dissipated and created energy [J]; all but the stored energy are
      cumulative.
    - frames (f,): samples at which fields are kept.
    - tau, local (f, m): traction [Pa] and slip [m] of the nodes in the frames.
    - values: measures by name.
    - seconds: CPU seconds.
    - first: sample at which the last cycle starts.
    - engine: how the slide was computed.
    - lateral, lateral_force, yaw_moment (k,): of a slide in two directions [m], [N], [N m]; else
      None.
    """

    time: np.ndarray
    slide: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    ledger: np.ndarray
    frames: np.ndarray
    tau: np.ndarray
    local: np.ndarray
    values: dict
    seconds: float
    first: int
    engine: BenchEngine
    lateral: np.ndarray | None = None
    lateral_force: np.ndarray | None = None
    yaw_moment: np.ndarray | None = None


def run(
    model, patch, steps: int, frames: int = 0, path=None, watch: PassOptions = DEFAULT_OPTIONS
) -> BenchRun:
    """Slide the interface of a model along its path.

    Parameters
    ----------
    model : Model
    patch : Patch or None
        None for [normal].
    steps : int
        Steps per cycle.
    frames : int
        Number of frames of the fields.
    path : tuple, optional
        Path in the form of `SlidePath.samples` that replaces that of the model.
    watch : PassOptions
        Options and callbacks of the pass.

    Returns
    -------
    BenchRun
    """
    begin = perf_counter()
    time, slide, first, omega = model.slide.samples(steps) if path is None else path
    if model.load_varies:
        start = time[first]
        time, slide = model.point.refine_samples(model.slide, time, slide, steps)
        first = int(np.searchsorted(time, start))
    engine = bench_engine(model, slide, 1 if patch is None else patch.x.size, watch.choice)
    out, more = _slid(model, patch, (time, slide), frames, engine, watch)
    values = _values(model, time, slide, out, first, omega) | {
        "work_check": work_difference(
            out.ledger[0],
            [(slide, out.force), *more.pop("pairs", ())],
            reversal_evaluation(model) == "jumps",
        )
    }
    span = time[-1]  # the division by the span avoids overflow for an extremely slow slide
    rate = np.gradient(slide, time / span) / span if time.size > 2 else np.zeros(time.size)
    return BenchRun(time, slide, rate, *out, values, perf_counter() - begin, first, engine, **more)


def _slid(model, patch, path: tuple, frames: int, engine: BenchEngine, watch: PassOptions) -> tuple:
    """Return the SlideHistories of a pass along (time, slide), and histories of the lateral direction."""
    if model.slide.across is not None:
        return stepping.run_plane(model, patch, *path, frames, watch)
    if model.partial_slip:
        return shear.with_shear(model, patch, *path, frames, watch, engine), {}
    if engine.kind == STEPPED:
        return slide_step_by_step(model, patch, *path, frames, watch), {}
    if engine.kind == CLOSED:
        return closed_form(model, patch, path, frames, watch), {}

    return rigid.rigid(model, patch, path, frames, engine, watch), {}


def _values(model, time, slide, out, first, omega) -> dict:
    """Return the measures of a pass by name."""
    # the ratio refers to the applied load: friction is lost where the piece slides off the pressure
    applied = out.load if model.load_varies else np.full_like(out.load, out.load[0])
    ratio = np.divide(
        out.force,
        applied,
        out=np.zeros_like(out.force),
        where=applied > 1e-3 * applied.max(initial=0.0),
    )
    work, stored, dissipated, created = out.ledger
    power = np.abs(np.diff(work)).sum()
    miss = abs(work[-1] - (stored[-1] - stored[0]) - dissipated[-1] + created[-1])
    found = {
        "normal_load": float(model.point.load if model.load_varies else out.load[0]),
        "friction_force_peak": float(np.abs(out.force).max()),
        "friction_ratio_end": float(ratio[-1]),
        "friction_ratio_peak": float(np.abs(ratio).max()),
        "slip_amplitude": float(out.slip[first:].max() - out.slip[first:].min()) / 2,
        "energy_balance": float(miss / (power + np.abs(stored).max())) if power > 0 else 0.0,
        **compute_ledger_measures(out.ledger),
    }
    if omega:
        t = time[first:]
        q = slide[first:]
        f = out.force[first:]
        weight = np.zeros(t.size)
        weight[1:] += np.diff(t) / 2
        weight[:-1] += np.diff(t) / 2
        means = np.divide(
            np.diff(work[first:]), np.diff(q), out=(f[1:] + f[:-1]) / 2, where=np.diff(q) != 0
        )
        turns = find_reversals(t, q, np.zeros(t.size), f, t[-1] - t[0], reversal_evaluation(model))
        found |= interface_loop(
            mean_half_range(turns),
            compute_harmonic(t, weight, q - q.mean(), omega),
            compute_step_harmonic(t, means, omega),
            work[-1] - work[first],
            0.0,
        )
        secant = secant_stiffness(turns)
        found |= {"secant_stiffness": secant} if secant is not None else {}
        found["drift_per_cycle"] = float(q[-1] - q[0])
    return found
