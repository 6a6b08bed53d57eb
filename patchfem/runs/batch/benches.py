"""Batch of benches: their patches are solved together, their slides one by one.

In: models of a group. Out: `CaseResults`.
"""

from collections.abc import Hashable, Sequence

from ...model.model import Model
from ..patch import static_batch
from . import one_by_one, patches
from .case_results import CaseResults

MAX_CASES_PER_CALL = 256  # largest number of patches in one call


def refusal_reason(model: Model) -> str:
    """Return why the patch of a bench cannot be solved together with others, or ""."""
    if (
        model.patch is None
        or model.load_varies
        or model.wear is not None
        or model.patch.mesh.edge_motion
    ):
        return "the case has no patch, or its patch or load changes during the slide"
    return static_batch.reason_not_batched(model.patch)


def group_key(model: Model) -> Hashable:
    """Return a hashable key; patches of models with equal keys can be solved together."""
    return patches.group_key(model)


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of benches."""
    return patches.solve_patches_then_motions(
        models, MAX_CASES_PER_CALL, lambda part: one_by_one.solve(part, report)
    )
