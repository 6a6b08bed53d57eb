"""Friction along the prescribed slide of a bench, as the Solution of a motion, and the fields of its interface."""

from dataclasses import replace

import numpy as np

from ...core import Outcome
from ..bench import bench
from ..bench.engine import nodal_element_limit
from ..results.patch_rows import Arrays
from ..results.result import Settings, SlipRule, make_interface_frames
from .engines import Numerics
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
    if numerics.shear_modes is not None:
        accuracy = model.accuracy.model_copy(update={"shear_modes": numerics.shear_modes})
        model = replace(model, accuracy=accuracy)
    run = bench.run_bench(
        model,
        patch,
        numerics.steps,
        n_frames,
        choice=numerics.choice,
        has_half_cells=numerics.has_half_cells,
        say=say,
        progress=progress,
    )
    return make_slide_solution(run)


def make_slide_solution(run: bench.BenchRun) -> Solution:
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
        settings=Settings(run.engine.name),
        bond_summation=run.engine.choice,
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
    return make_interface_frames(
        patch,
        run.time[run.frames],
        run.tau,
        run.local,
        run.slide[run.frames],
        SlipRule(nodal_element_limit(model, patch), starts_at_rest=True),
    )
