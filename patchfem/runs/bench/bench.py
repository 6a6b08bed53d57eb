"""Law bench: prescribe the displacement of an interface and compute the friction loop.

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
from .closed import slide_in_closed_form
from .engine import BenchEngine, Method, bench_engine
from .ledger import DEFAULT_OPTIONS, PassOptions, Slide, SlideHistories
from .stepped import slide_in_plane, slide_step_by_step


@dataclass(frozen=True, eq=False, slots=True)
class BenchRun:
    """Histories, fields and measures of an interface along a prescribed path of k samples.

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
    """Compute the friction histories of a model along its bench path.

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
    histories, lateral = _compute_histories(Slide(model, patch, time, slide, frames, engine, watch))
    loops = [(slide, histories.force)]
    if lateral:
        loops.append((lateral["lateral"], lateral["lateral_force"]))
    jumps = reversal_evaluation(model) == "jumps"
    values = _compute_measures(model, time, slide, histories, first)
    values |= _compute_loop_measures(model, time, slide, histories, first, omega) if omega else {}
    values["work_check"] = work_difference(histories.ledger[0], loops, jumps)
    span = time[-1]  # Division by the span avoids overflow for an extremely slow motion.
    rate = np.zeros(time.size)
    if time.size > 2:
        rate = np.gradient(slide, time / span) / span
    return BenchRun(
        time, slide, rate, *histories, values, perf_counter() - begin, first, engine, **lateral
    )


def _compute_histories(task: Slide) -> tuple[SlideHistories, dict]:
    """Compute the friction histories along a bench path, and a dict of lateral histories."""
    if task.model.slide.across is not None:
        return slide_in_plane(task)
    if task.model.partial_slip:
        return shear.slide_in_shear(task), {}
    if task.engine.method is Method.STEPPED:
        return slide_step_by_step(task), {}
    if task.engine.method is Method.CLOSED:
        return slide_in_closed_form(task), {}
    return rigid.slide_rigidly(task), {}


def _compute_measures(model, time, slide, histories: SlideHistories, first: int) -> dict:
    """Return the measures of a bench run as a dict, except those of its friction loop."""
    force = histories.force
    load = histories.load
    # The friction ratio refers to the applied load: friction is lost where the piece slides off the
    # pressure.
    applied = load if model.load_varies else np.full_like(load, load[0])
    is_loaded = applied > 1e-3 * applied.max(initial=0.0)
    ratio = np.divide(force, applied, out=np.zeros_like(force), where=is_loaded)
    work, stored, dissipated, created = histories.ledger
    exchanged = np.abs(np.diff(work)).sum()
    imbalance = abs(work[-1] - (stored[-1] - stored[0]) - dissipated[-1] + created[-1])
    balance = 0.0
    if exchanged > 0:
        balance = float(imbalance / (exchanged + np.abs(stored).max()))
    return {
        "normal_load": float(model.point.load if model.load_varies else load[0]),
        "friction_force_peak": float(np.abs(force).max()),
        "friction_ratio_end": float(ratio[-1]),
        "friction_ratio_peak": float(np.abs(ratio).max()),
        "slip_amplitude": float(histories.slip[first:].max() - histories.slip[first:].min()) / 2,
        "energy_balance": balance,
        **compute_ledger_measures(histories.ledger),
    }


def _compute_loop_measures(
    model, time, slide, histories: SlideHistories, first: int, omega: float
) -> dict:
    """Return the measures of the friction loop of the last cycle as a dict.

    The last cycle starts at sample `first`.
    """
    time = time[first:]
    slide = slide[first:]
    force = histories.force[first:]
    work = histories.ledger[0, first:]
    weight = np.zeros(time.size)
    weight[1:] += np.diff(time) / 2
    weight[:-1] += np.diff(time) / 2
    moves = np.diff(slide)
    mean_force = (force[1:] + force[:-1]) / 2
    means = np.divide(np.diff(work), moves, out=mean_force, where=moves != 0)
    reversals = find_reversals(
        time,
        slide,
        np.zeros(time.size),
        force,
        time[-1] - time[0],
        reversal_evaluation(model),
    )
    measures = interface_loop(
        mean_half_range(reversals),
        compute_harmonic(time, weight, slide - slide.mean(), omega),
        compute_step_harmonic(time, means, omega),
        work[-1] - work[0],
        0.0,
    )
    secant = secant_stiffness(reversals)
    if secant is not None:
        measures["secant_stiffness"] = secant
    return measures | {"drift_per_cycle": float(slide[-1] - slide[0])}
