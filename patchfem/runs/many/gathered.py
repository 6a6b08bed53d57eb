"""Patches with bonds behind shear, of a study of many: pressed together, each runs by itself, a few points in place of
all its nodes.

Nobody sees the fields of such a run, nor its histories: the cycles before the last are folded as they pass
(`dynamics.march.passing_kernels`). What its points and modes each leave out of the backbone is a thousandth of the
tolerance (`rig.interface.FEWER`), far below the bars, so no further run tells the error of the modes.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace

from ...effects import has, listed
from ...elasticity.lapack import one_thread
from ...model.model import Model
from ..rig.engines import MARCH, engine_of
from . import one_by_one, patches
from .answers import Answers

TOGETHER = 64  # cases that are pressed at once


def refuses(model: Model) -> str:
    """Why all points of a model move; "" where a few may stand for them."""
    if model.patch is None or not model.soft or model.friction is None or not has(model.friction.law, "bonds") \
            or listed(model.friction):
        return "it is no patch with bonds behind shear"
    if model.rig.load_varies or model.patch.strips is not None or model.grooves is not None or model.wear is not None:
        return "its load changes, or it wears"
    return "" if engine_of(model) is MARCH else "it does not march"


def group(model: Model) -> Hashable:
    """Equal for all: each runs by itself."""
    return None


def solve(models: Sequence[Model], say=None) -> Answers:
    """Answers of models."""
    out, few = Answers.blank(len(models)), [replace(model, patch=replace(model.patch, gathers=True))
                                            for model in models]
    for first in range(0, len(few), TOGETHER):
        with one_thread():  # more wait for each other longer than such small systems take
            part = patches.solved_together(few[first:first + TOGETHER])
            out.place(range(first, first + len(part)), one_by_one.solve(part, say))
    return out
