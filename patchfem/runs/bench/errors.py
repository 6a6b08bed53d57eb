"""What a bench leaves open: its steps, its mesh and its sum over bonds."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...effects import is_bond_list, law_has_trait
from ...response.coarser import CoarserRuns, coarser_space, estimate, left_open
from ...response.errors import (
    FrictionScale,
    convergence_errors,
    finer_errors,
    friction_errors,
    step_errors,
)
from ...slip import shear_modes
from . import bench, rigid, shear
from .engine import ELEMENTS, LIST, LISTS, PLANE, STEPPED, slips_by_elements
from .law import tail_of
from .ledger import Watch

MESH_TOL = 1e-2  # tolerance whose steps show what a mesh changes; elements follow any path exactly
FINER = 0.5  # merge width of the run that shows what merging does


class Pass(NamedTuple):
    """A pass beside: steps per cycle, number of the coarser mesh, 0 of that of the run, how bonds are summed, springs
    and modes of a `Watch`."""

    steps: int
    level: int
    choice: object
    springs: Callable | None = None
    modes: int | None = None


def errors_of(model, patches: list, fine, steps: int, say=None) -> tuple:
    """([error by measure name, ...], seconds, `left_open`) of the pass `fine` at `steps` per cycle on the ladder of
    `ladder_of`; patches: the patch on nested meshes, fine to coarse, [None] without a patch."""

    def solve(variant: Pass):
        on = patches[variant.level]
        watch = Watch(variant.choice, say, springs=variant.springs, modes=variant.modes)
        return bench.run(model, on, variant.steps, watch=watch)

    ladder, made = ladder_of(model, patches, fine, steps), {}
    errors, seconds = estimate(solve, fine.values, ladder, made)
    kinds = [one.of for one in ladder]
    if sum_error(model, fine.engine):
        errors, kinds = [*errors, _sum_errors(model, fine)], [*kinds, "bonds"]
    runs = [fine.values, *(made[one].values for one in ladder[0].runs)]
    return errors, seconds, left_open(kinds, errors, runs)


def ladder_of(model, patches: list, fine, steps: int) -> list:
    """The coarser runs of a bench: half and a quarter of the steps; at a quarter of them the coarser mesh, where there
    is one, other shear modes behind which bonds slide, fewer cells of a density of sliders, and for a merged list of
    bonds narrower strips. Parallel elements run on all coarser meshes, at steps that no tolerance changes."""
    choice = fine.engine.choice
    half, few = Pass(max(4, steps // 8 * 4), 0, choice), Pass(max(4, steps // 16 * 4), 0, choice)
    # elements follow any path exactly, so samples of it change harmonics alone
    rule = convergence_errors if slips_by_elements(model) else partial(step_errors, steps=steps)
    out, meshed, patch = [CoarserRuns((half, few), rule, of="steps")], len(patches) > 1, patches[0]
    if meshed and slips_by_elements(model):
        length = model.friction.bond_length
        same = model.slide.steps(MESH_TOL, model.accuracy.steps_per_cycle, length)
        out.append(shear.coarser_elements(len(patches) - 1, few._replace(steps=same)))
    elif meshed:
        count = shear.modes_of(model, patch) if model.partial_slip else None  # one change at a time
        out.append(coarser_space(few._replace(level=1, modes=count), few))
        if count:
            out.append(
                coarser_space(few._replace(modes=shear_modes.comparison_count(count)), few, "modes")
            )
    if law_has_trait(model.friction.law, "cells") and fine.engine.kind == ELEMENTS:
        out.append(rigid.coarser_cells(few))
    if fine.engine.kind in (LIST, LISTS) and choice.merge > 0:
        narrow = few._replace(choice=replace(choice, merge=FINER * choice.merge))
        out.append(CoarserRuns((narrow,), finer_errors, few, "bonds"))
    return out


def sum_error(model, engine) -> float:
    """Bound of the error of the sum over bonds, as a share of the friction limit [1]; 0 without such a sum."""
    if engine.kind in (LIST, LISTS):
        return engine.choice.error
    return (
        tail_of(model) if engine.kind in (STEPPED, PLANE) and is_bond_list(model.friction) else 0.0
    )


def _sum_errors(model, fine) -> dict:
    """Return `friction_errors` of the sum over bonds of a pass."""
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
