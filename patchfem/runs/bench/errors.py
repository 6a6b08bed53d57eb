"""Errors of a bench run due to time steps, mesh and bond summation, from coarser runs.

In: a BenchRun and patches on nested meshes. Out: error estimates by measure for each
discretization.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import friction, slip
from ...effects import law_has_trait
from ...response.errors import (
    CoarserRuns,
    StepRun,
    convergence_errors,
    edge_errors,
    estimate_errors,
    finer_errors,
    friction_errors,
    list_step_runs,
    second_order_errors,
)
from ..results.patch_rows import Values
from . import bench
from .engine import CONTACT_POINTS, uses_parallel_elements

# Tolerance that sets the steps of runs on coarser meshes. It differs from that of the run, because
# parallel elements follow any path exactly.
COARSE_MESH_STEPS_TOL = 1e-2
# Ratio of the merge width in the comparison run to that of the finest run.
FINER_MERGE_WIDTH_FACTOR = 0.5


class CoarseRun(NamedTuple):
    """Settings of a coarser bench run for an error estimate.

    - steps: steps per cycle.
    - level: index of the mesh; 0 is the finest one.
    - choice: engine of bond summation with its settings.
    - modes: number of shear modes of the pieces; None: set by the scene or the tolerance.
    - has_half_cells: whether an Iwan model has half of its cells.
    """

    steps: int
    level: int
    choice: "friction.bonds.engines.EngineChoice"
    modes: int | None = None
    has_half_cells: bool = False


class BenchErrors(NamedTuple):
    """Error estimates of the measures of a bench run.

    - errors: pairs of the coarsened discretization and the errors by measure, see
      `estimate_errors`.
    - seconds: CPU time of the coarser runs [s].
    - step_runs: StepRun of the run and of each run with fewer steps, from fine to coarse.
    """

    errors: list[tuple[str, Values]]
    seconds: float
    step_runs: list[StepRun]


def estimate_bench_errors(model, patches, fine_run, steps: int, say=None) -> BenchErrors:
    """Estimate the errors of a bench run from coarser runs.

    Parameters
    ----------
    model : Model
        Model of the run.
    patches : list of Patch
        Patches on nested meshes, from fine to coarse; [None] without a patch.
    fine_run : BenchRun
        Run whose errors are estimated.
    steps : int
        Number of steps per cycle of this run.
    say : callable, optional
        Callback for a line of text.
    """

    def solve(variant: CoarseRun):
        """Run the bench with the coarser steps, mesh, bond summation or shear modes of a comparison run."""
        coarse_model = model
        if variant.modes is not None:
            accuracy = model.accuracy.model_copy(update={"shear_modes": variant.modes})
            coarse_model = replace(model, accuracy=accuracy)
        settings = {"choice": variant.choice, "has_half_cells": variant.has_half_cells, "say": say}
        return bench.run_bench(coarse_model, patches[variant.level], variant.steps, **settings)

    # The runs are stored by their settings, because several estimates share one run.
    coarser_runs = list_coarser_runs(model, patches, fine_run, steps)
    bench_runs = {}
    errors = estimate_errors(solve, fine_run.values, coarser_runs, bench_runs)
    if _find_bond_sum_error(fine_run):
        errors.append(("bonds", _estimate_bond_sum_errors(model, fine_run)))

    # The history of step numbers serves the accuracy curve of the report.
    step_runs = list_step_runs(steps, fine_run, coarser_runs, bench_runs)
    seconds = sum(run.seconds for run in bench_runs.values())
    return BenchErrors(errors, seconds, step_runs)


def list_coarser_runs(model, patches, fine_run, steps: int) -> list[CoarserRuns]:
    """List the coarser runs from which the errors of a bench run are estimated.

    Two runs have half and a quarter of the steps. Further runs with a quarter of the steps have,
    where it applies, a coarser mesh, another number of shear modes, merged slider cells, or
    narrower strips of a merged bond list. Parallel elements are computed on all coarser meshes with
    a number of steps that does not depend on the tolerance.

    Parameters
    ----------
    model : Model
        Model of the run.
    patches : list of Patch
        Patches on nested meshes, from fine to coarse; [None] without a patch.
    fine_run : BenchRun
        Run whose errors are estimated.
    steps : int
        Number of steps per cycle of `fine_run`.
    """
    choice = fine_run.engine.choice
    halved = CoarseRun(max(4, steps // 8 * 4), 0, choice)
    quarter = CoarseRun(max(4, steps // 16 * 4), 0, choice)
    # Parallel elements follow any path exactly, so that the steps affect only the harmonics.
    is_exact = model.partial_slip and uses_parallel_elements(model)
    sampled_steps = None if is_exact else steps
    rule = partial(convergence_errors, steps=sampled_steps)
    out = [CoarserRuns((halved, quarter), rule, source="steps")]

    has_coarser_mesh = len(patches) > 1
    if has_coarser_mesh and is_exact:
        length = model.friction.bond_length
        steps_on_coarse_mesh = model.slide.steps(
            COARSE_MESH_STEPS_TOL, model.accuracy.steps_per_cycle, length
        )
        reference = quarter._replace(steps=steps_on_coarse_mesh)
        runs = tuple(reference._replace(level=level) for level in range(1, len(patches)))
        out.append(CoarserRuns(runs, convergence_errors, reference, "mesh"))
    elif has_coarser_mesh:
        # Both runs have the same number of modes, so that only the mesh changes.
        count = fine_run.shear_modes
        coarser = quarter._replace(level=1, modes=count)
        is_irregular = model.side == "lower" or model.patch.area is not None
        rule = edge_errors if is_irregular else second_order_errors
        out.append(CoarserRuns((coarser,), rule, quarter, "mesh"))
        if count:
            coarser = quarter._replace(modes=slip.shear_modes.comparison_mode_count(count))
            out.append(CoarserRuns((coarser,), second_order_errors, quarter, "modes"))

    # The cells of an Iwan model represent its continuous density to order 2.
    if law_has_trait(model.friction.law, "cells") and fine_run.engine.method == CONTACT_POINTS:
        halved = quarter._replace(has_half_cells=True)
        out.append(CoarserRuns((halved,), second_order_errors, quarter))

    # A merged bond list converges to the full list as its strips become narrower.
    if choice is not None and choice.merge > 0:
        narrow = quarter._replace(
            choice=replace(choice, merge=FINER_MERGE_WIDTH_FACTOR * choice.merge)
        )
        out.append(CoarserRuns((narrow,), finer_errors, quarter, "bonds"))
    return out


def _find_bond_sum_error(fine_run) -> float:
    """Return the error of the bond summation of a BenchRun relative to the friction limit; 0 without bonds."""
    choice = fine_run.engine.choice
    return 0.0 if choice is None else choice.find_error(fine_run.join_error)


def _estimate_bond_sum_errors(model, fine_run) -> Values:
    """Estimate the errors of the measures of a BenchRun due to bonds that the sum leaves out or merges."""
    work = np.abs(np.diff(fine_run.ledger[0]))
    return friction_errors(
        fine_run.values,
        _find_bond_sum_error(fine_run),
        model.friction,
        float(fine_run.load.max()),
        (float(work.sum()), float(work[fine_run.first :].sum())),
    )
