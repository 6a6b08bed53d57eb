"""Batch of benches with patches, which are pressed together; each bench slides by itself.

In: models of a group. Out: `CaseResults`.
"""

from collections.abc import Hashable, Sequence

from ...model.model import Model
from ..patch import static_batch
from . import one_by_one, patches
from .case_results import CaseResults

MAX_CASES_PER_CALL = 256  # largest number of patches that are solved in one call


def refuses(model: Model) -> str:
    """Return the reason why the patch of a bench cannot be solved in a batch with others, or ""."""
    if (
        model.patch is None
        or model.load_varies
        or model.wear is not None
        or model.patch.mesh.edge_motion
    ):
        return "the case has no patch, or its patch or load changes during the slide"
    return static_batch.reason_not_batched(model.patch)


def group(model: Model) -> Hashable:
    """Return a hashable key that is equal for models whose patches can be solved in one batch."""
    return patches.group(model)


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Compute the case results of a group of benches."""
    return patches.press_and_solve(
        models, MAX_CASES_PER_CALL, lambda part: one_by_one.solve(part, say)
    )
