"""Errors of a bench due to its steps, its mesh and its sum over bonds, from coarse passes.

In: the fine pass and patches on nested meshes. Out: errors by measure name for each kind.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...effects import is_bond_list, law_has_trait
from ...response.coarser import CoarserRuns, estimate_errors, find_open_kinds, make_coarser_space
from ...response.errors import (
    FrictionScale,
    convergence_errors,
    finer_errors,
    friction_errors,
    step_errors,
)
from ...slip import shear_modes
from . import bench, rigid, shear
from .engine import LIST_METHODS, Method, slips_by_elements
from .law import estimate_tail_loss
from .ledger import PassOptions

# tolerance that sets the steps of passes on coarser meshes; elements follow any path exactly
MESH_TOL = 1e-2
FINER_MERGE_FACTOR = 0.5  # factor of the merge width in the pass that shows the error of merging


class Pass(NamedTuple):
    """Settings of a coarse pass of a bench along its path.

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
    """Errors of a bench from coarse passes.

    - errors: errors by measure name, one dict per kind.
    - seconds: CPU seconds.
    - open_kinds: see `coarser.find_open_kinds`.
    """

    errors: list
    seconds: float
    open_kinds: dict


def estimate_pass_errors(model, patches: list, fine, steps: int, say=None) -> PassErrors:
    """Estimate the errors of a bench from coarse passes along its path.

    Parameters
    ----------
    model : Model
    patches : list of Patch
        The patch on nested meshes, fine to coarse; [None] without a patch.
    fine : BenchRun
        The pass itself.
    steps : int
        Its steps per cycle.
    say : callable, optional
        Callback for a line of text.
    """

    def solve(variant: Pass):
        """Return the BenchRun of a Pass."""
        watch = PassOptions(variant.choice, say, springs=variant.springs, modes=variant.modes)
        return bench.run(model, patches[variant.level], variant.steps, watch=watch)

    ladder = list_coarse_passes(model, patches, fine, steps)
    coarse_passes = {}
    errors, seconds = estimate_errors(solve, fine.values, ladder, coarse_passes)
    kinds = [coarser.of for coarser in ladder]
    if sum_error(model, fine.engine):
        errors = [*errors, _sum_errors(model, fine)]
        kinds = [*kinds, "bonds"]
    runs = [fine.values, *(coarse_passes[run].values for run in ladder[0].runs)]
    return PassErrors(errors, seconds, find_open_kinds(kinds, errors, runs))


def list_coarse_passes(model, patches: list, fine, steps: int) -> list:
    """Return the coarse passes of a bench, as `CoarserRuns`.

    They have half and a quarter of the steps; at a quarter of them also the coarser mesh, another
    number of shear modes, merged cells of a density of sliders, or narrower strips of a merged list
    of bonds. Parallel elements are run on all coarser meshes, with steps that do not depend on the
    tolerance.

    Parameters
    ----------
    model : Model
    patches : list of Patch
    fine : BenchRun
    steps : int
        Steps per cycle of the fine pass.
    """
    choice = fine.engine.choice
    half = Pass(max(4, steps // 8 * 4), 0, choice)
    few = Pass(max(4, steps // 16 * 4), 0, choice)
    # elements follow any path exactly, so that the sampling affects the harmonics only
    rule = convergence_errors if slips_by_elements(model) else partial(step_errors, steps=steps)
    out = [CoarserRuns((half, few), rule, of="steps")]
    meshed = len(patches) > 1
    patch = patches[0]
    if meshed and slips_by_elements(model):
        length = model.friction.bond_length
        same = model.slide.steps(MESH_TOL, model.accuracy.steps_per_cycle, length)
        out.append(shear.coarser_elements(len(patches) - 1, few._replace(steps=same)))
    elif meshed:
        # the number of modes is fixed, so that only the mesh changes
        count = shear.count_shear_modes(model, patch) if model.partial_slip else None
        out.append(make_coarser_space(few._replace(level=1, modes=count), few))
        if count:
            out.append(
                make_coarser_space(
                    few._replace(modes=shear_modes.comparison_mode_count(count)), few, "modes"
                )
            )
    if law_has_trait(model.friction.law, "cells") and fine.engine.method is Method.ELEMENTS:
        out.append(rigid.coarser_cells(few))
    if fine.engine.method in LIST_METHODS and choice.merge > 0:
        narrow = few._replace(choice=replace(choice, merge=FINER_MERGE_FACTOR * choice.merge))
        out.append(CoarserRuns((narrow,), finer_errors, few, "bonds"))
    return out


def sum_error(model, engine) -> float:
    """Return the error bound of the sum over bonds over the friction limit [1]; 0 without a sum."""
    if engine.method in LIST_METHODS:
        return engine.choice.error
    if engine.method in (Method.STEPPED, Method.PLANE) and is_bond_list(model.friction):
        return estimate_tail_loss(model)
    return 0.0


def _sum_errors(model, fine) -> dict:
    """Return the errors of the measures of a pass due to its sum over bonds, by name."""
    work = np.abs(np.diff(fine.ledger[0]))
    friction = model.friction
    scale = FrictionScale(
        friction.static,
        friction.static * float(fine.load.max()),
        friction.bond_length,
        float(work.sum()),
        float(work[fine.first :].sum()),
    )
    return friction_errors(fine.values, sum_error(model, fine.engine), scale)
