"""Friction along the prescribed slide of a bench, as the Solution of a motion, and the fields of its interface."""

import numpy as np

from ...core import Outcome
from ..bench import bench, engine
from ..results.patch_rows import Arrays
from ..results.result import SlipRule, make_interface_frames
from .evaluation import EngineRun, Solution


def make_slide_solution(run: bench.BenchRun) -> Solution:
    """Return the Solution of a run along a prescribed slide; its window is the last cycle of the path."""
    ledger = {
        "passed": float(np.abs(np.diff(run.ledger[0])).sum()),
        "created": run.values["energy_created"],
        "join_error": run.join_error,
        "peak_load": float(run.load.max()),
    }
    motion = EngineRun(run.values, run, run.last_cycle, ledger, Outcome.DONE)
    return Solution(run.values, motion, run.seconds, run.contact)


def collect_slide_frames(model, patch, run: bench.BenchRun) -> Arrays:
    """Return the fields of the interface of a bench in the frames of its run.

    A node slips in a frame where its shear stress reaches its limit, or else where its slip changes.

    Parameters
    ----------
    model : Model
        Model of a bench, whose law decides.
    patch : Patch
        Solved patch.
    run : BenchRun
        Run along the slide, with its frames.
    """
    # Parallel elements reach the limit of a node exactly, but the tractions of the cells of a face are interpolated.
    limit = None
    is_exact = model.partial_slip and engine.uses_parallel_elements(model)
    if is_exact and model.patch.area is None:
        limit = model.friction.static * patch.pressure.sigma_n
    rule = SlipRule(limit, starts_at_rest=True)
    time = run.time[run.frames]
    slide = run.slide[run.frames]
    return make_interface_frames(patch, time, run.tau, run.local, slide, rule)
