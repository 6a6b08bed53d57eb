"""Friction along the prescribed slide of a bench, as the Solution of a motion, and the fields of its interface."""

import numpy as np

from ...core import Outcome
from ..bench import bench, engine
from ..bench.engine import Numerics
from ..results.patch_rows import Arrays
from ..results.result import Settings, SlipRule, make_interface_frames
from .evaluation import Solution


def solve_slide(
    model, numerics: Numerics, patch, n_frames: int = 0, say=None, progress=None
) -> Solution:
    """Compute the friction of a bench along its prescribed slide, as the Solution of a motion.

    Its response has the histories of the whole path (`bench.BenchRun`), and its window those of the last cycle.

    Parameters
    ----------
    model : Model
        Model of a bench.
    numerics : Numerics
        Steps per cycle, and methods of bond summation and of shear.
    patch : Patch or None
        None for a single point.
    n_frames : int
        Number of frames of the fields.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    return make_slide_solution(
        model, bench.follow_slide(model, numerics, patch, n_frames, say, progress)
    )


def make_slide_solution(model, run: bench.BenchRun) -> Solution:
    """Return the Solution of a run along a prescribed slide."""
    work = np.diff(run.ledger[0])
    book = {
        "passed": float(np.abs(work).sum()),
        "created": run.values["energy_created"],
        "join_error": run.join_error,
        "peak_load": float(run.load.max()),
    }
    return Solution(
        values=run.values,
        response=run,
        window=run.last_cycle,
        outcome=Outcome.DONE,
        snapshots=(),
        book=book,
        seconds=run.seconds,
        contact=run.contact,
        settings=Settings(engine.name_engine(model, run.numerics.choice)),
        bond_summation=run.numerics.choice,
    )


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
    is_exact = model.partial_slip and engine.uses_parallel_elements(model)
    limit = None
    if is_exact and model.patch.area is None:
        limit = model.friction.static * patch.pressure.sigma_n
    return make_interface_frames(
        patch,
        run.time[run.frames],
        run.tau,
        run.local,
        run.slide[run.frames],
        SlipRule(limit, starts_at_rest=True),
    )
