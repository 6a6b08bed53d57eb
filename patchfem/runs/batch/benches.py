"""Benches on patches, of a study of many: pressed together, each slides by itself."""

from collections.abc import Hashable, Sequence

from ...model.model import Model
from ..patch import static
from . import one_by_one, patches
from .case_results import CaseResults

TOGETHER = 256  # cases that are pressed at once


def refuses(model: Model) -> str:
    """Why a bench does not share its pressing; "" where it does."""
    if (
        model.patch is None
        or model.load_varies
        or model.wear is not None
        or model.patch.mesh.edge_motion
    ):
        return "the case has no patch, or its patch or load changes during the slide"
    return static.not_together(model.patch)


def group(model: Model) -> Hashable:
    """Equal for models whose patches are pressed together."""
    return patches.group(model)


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Answers of models of a group."""
    return patches.pressed_first(models, TOGETHER, lambda part: one_by_one.solve(part, say))
