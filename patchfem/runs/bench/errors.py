"""Errors of a bench due to its steps, its mesh and its sum over bonds, from coarse passes.

In: the fine pass and patches on nested meshes. Out: errors by measure name for each kind.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import process_time
from typing import NamedTuple

import numpy as np

from ...effects import is_bond_list, law_has_trait
from ...response.coarser import (
    CoarserRuns,
    StepRun,
    estimate_errors,
    make_spatial_coarsening,
)
from ...response.errors import (
    FrictionScale,
    convergence_errors,
    finer_errors,
    friction_errors,
    step_errors,
)
from ...slip import shear_modes
from . import bench, rigid, shear
from .engine import LIST_METHODS, Method, uses_parallel_elements
from .law import estimate_tail_loss
from .ledger import PassOptions

# Tolerance that sets the steps of passes on coarser meshes. Parallel elements follow any path
# exactly, so that it is not the tolerance of the run.
MESH_TOL = 1e-2
# Ratio of the merge width of the pass that shows the merging error to that of the fine pass.
FINER_MERGE_FACTOR = 0.5


class CoarsePass(NamedTuple):
    """Settings of a coarser computation along a bench path, which serves an error estimate.

    - steps: steps per cycle.
    - level: index of the coarser mesh; 0 is that of the run.
    - choice: engine of the sum over bonds, with its settings.
    - springs, modes: see `PassOptions`.
    """

    steps: int
    level: int
    choice: object
    springs: Callable | None = None
    modes: int | None = None


class PassErrors(NamedTuple):
    """Errors of the measures of a bench, estimated from coarser computations.

    - errors: what is coarser, and errors by measure name (`coarser.estimate_errors`).
    - seconds: CPU seconds.
    - step_runs: StepRuns of the bench and of its coarser computations in time, fine to coarse.
    """

    errors: list
    seconds: float
    step_runs: list


def estimate_pass_errors(model, patches: list, fine_run, steps: int, say=None) -> PassErrors:
    """Estimate the errors of a bench run from coarser computations along its path.

    Parameters
    ----------
    model : Model
    patches : list of Patch
        The patch on nested meshes, fine to coarse; [None] without a patch.
    fine_run : BenchRun
        The computation whose errors are estimated.
    steps : int
        Its number of steps per cycle.
    say : callable, optional
        Callback for a line of text.
    """

    def solve(variant: CoarsePass):
        """Run the bench with the settings of a coarse pass and return its BenchRun."""
        watch = PassOptions(variant.choice, say, springs=variant.springs, modes=variant.modes)
        begin = process_time()
        coarse_run = bench.run(model, patches[variant.level], variant.steps, watch=watch)
        cpu_seconds[variant] = process_time() - begin
        return coarse_run

    cpu_seconds = {}
    ladder = list_coarse_passes(model, patches, fine_run, steps)
    coarse_passes = {}
    errors, seconds = estimate_errors(solve, fine_run.values, ladder, coarse_passes)
    if bond_sum_error(model, fine_run.engine):
        errors.append(("bonds", _estimate_bond_sum_errors(model, fine_run)))
    step_runs = [StepRun(steps, fine_run.seconds, fine_run.values)]
    for coarse_pass in ladder[0].runs:
        values = coarse_passes[coarse_pass].values
        step_runs.append(StepRun(coarse_pass.steps, cpu_seconds[coarse_pass], values))
    return PassErrors(errors, seconds, step_runs)


def list_coarse_passes(model, patches: list, fine_run, steps: int) -> list:
    """List the coarser computations from which the errors of a bench run are estimated.

    They have half and a quarter of the steps. At a quarter of the steps they also have the coarser
    mesh, another number of shear modes, merged cells of a slider density, or narrower strips of a
    merged bond list. Parallel elements are run on all coarser meshes, with steps that do not depend
    on the tolerance.

    Parameters
    ----------
    model : Model
    patches : list of Patch
    fine_run : BenchRun
    steps : int
        Steps per cycle of the fine pass.
    """
    choice = fine_run.engine.choice
    halved = CoarsePass(max(4, steps // 8 * 4), 0, choice)
    quarter = CoarsePass(max(4, steps // 16 * 4), 0, choice)
    # Parallel elements follow any path exactly, so that the sampling affects the harmonics only.
    rule = (
        convergence_errors if uses_parallel_elements(model) else partial(step_errors, steps=steps)
    )
    out = [CoarserRuns((halved, quarter), rule, of="steps")]
    meshed = len(patches) > 1
    patch = patches[0]
    if meshed and uses_parallel_elements(model):
        length = model.friction.bond_length
        same = model.slide.steps(MESH_TOL, model.accuracy.steps_per_cycle, length)
        out.append(shear.list_coarser_element_runs(len(patches) - 1, quarter._replace(steps=same)))
    elif meshed:
        # The number of modes is fixed, so that only the mesh changes.
        count = shear.count_shear_modes(model, patch) if model.partial_slip else None
        out.append(make_spatial_coarsening(quarter._replace(level=1, modes=count), quarter))
        if count:
            out.append(
                make_spatial_coarsening(
                    quarter._replace(modes=shear_modes.comparison_mode_count(count)),
                    quarter,
                    "modes",
                )
            )
    if law_has_trait(model.friction.law, "cells") and fine_run.engine.method is Method.ELEMENTS:
        out.append(rigid.list_merged_cell_runs(quarter))
    if fine_run.engine.method in LIST_METHODS and choice.merge > 0:
        narrow = quarter._replace(choice=replace(choice, merge=FINER_MERGE_FACTOR * choice.merge))
        out.append(CoarserRuns((narrow,), finer_errors, quarter, "bonds"))
    return out


def bond_sum_error(model, engine) -> float:
    """Return the error bound of the bond summation relative to the friction limit [1].

    It is 0 for a law without such a sum.
    """
    if engine.method in LIST_METHODS:
        return engine.choice.error
    if engine.method in (Method.STEPPED, Method.PLANE) and is_bond_list(model.friction):
        return estimate_tail_loss(model)
    return 0.0


def _estimate_bond_sum_errors(model, fine_run) -> dict:
    """Return the errors of the bench measures due to the bond summation, as a dict."""
    work = np.abs(np.diff(fine_run.ledger[0]))
    friction = model.friction
    scale = FrictionScale(
        friction.static,
        friction.static * float(fine_run.load.max()),
        friction.bond_length,
        float(work.sum()),
        float(work[fine_run.first :].sum()),
    )
    return friction_errors(fine_run.values, bond_sum_error(model, fine_run.engine), scale)
