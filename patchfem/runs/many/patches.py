"""Static patches that share their pieces: pressed together, a pass per mesh for all of them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import Outcome
from ...model.model import Model
from ..patch import result as of_patch
from ..patch import static
from ..patch.meshes import geometry_of
from ..remedies import Finding, beyond_tolerance
from ..results.result import without_folders
from . import one_by_one
from .answers import Answers, joined_answers

AT_ONCE = 1000  # cases whose forces are held at once


class _Nodes(NamedTuple):
    x: np.ndarray


def refuses(model: Model) -> str:
    """Why a model is not pressed together with others; "" where it may be."""
    return static.not_together(model.patch) if model.kind == "patch" else "it is no static patch"


def group(model: Model) -> Hashable:
    """Equal for models whose patches are pressed together."""
    return geometry_of(model.patch), static.pressing_kind(model.patch), model.accuracy.tolerance


def solved_together(models: Sequence[Model]) -> list[Model]:
    """The models in their order, those whose patches press together with how they do, for what moves them then."""
    out, groups = list(models), {}
    for case, model in enumerate(models):
        if not static.not_together(model.patch):
            groups.setdefault(group(model), []).append(case)
    for cases in groups.values():
        found = static.pressed_together([models[case].patch for case in cases], models[cases[0]].accuracy.tolerance,
                                        True)
        for case, one in zip(cases, found):
            if one is not None:
                out[case] = replace(models[case], patch=replace(models[case].patch, solved=one))
    return out


def solve(models: Sequence[Model], say: Callable | None = None) -> Answers:
    """Answers of a group; cases that do not press together with the others are run by themselves."""
    begin, first, found = perf_counter(), models[0], []
    for start in range(0, len(models), AT_ONCE):
        these = [model.patch for model in models[start:start + AT_ONCE]]
        found += static.pressed_together(these, first.accuracy.tolerance)
    out, single = Answers.blank(len(models)), [case for case, one in enumerate(found) if one is None]
    area, nodes = first.patch.length * first.patch.width * first.patch.pairs, None
    for case, (model, one) in enumerate(zip(models, found, strict=True)):
        if one is None:
            continue
        nodes = nodes or {"interface_nodes": one.nodes}
        measures = of_patch.floored(model, one.measures)
        out.put(case, Outcome.DONE, measures, 0.0)
        out.numerics[case] = nodes
        warned = [*model.source.remarks, *of_patch.strained_by(model.patch, one.top, one.approach),
                *beyond_tolerance(Finding(model, measures, _Nodes(np.broadcast_to(0.0, one.nodes))))]
        if warned:
            out.warnings[case] = without_folders(warned, model.source.path)
        notes = [*of_patch.slender(model.patch, measures["normal_load"].value / area), *one.band]
        if notes:
            out.notes[case] = without_folders(notes, model.source.path)
    out.seconds[:] = (perf_counter() - begin) / len(models)
    if not single:
        return out
    return joined_answers(len(models), [(range(len(models)), out),
                                        (single, one_by_one.solve([models[case] for case in single], say))])
