"""Batch of benches and rigs with a patch: their patches are solved together, their motions one by one.

In: models of a group. Out: `CaseResults`.
"""

from collections.abc import Hashable, Sequence

from ...elasticity.lapack import use_one_blas_thread
from ...model.model import Model
from ..patch import static_batch
from . import one_by_one, patches
from .case_results import CaseResults, solve_in_parts

MAX_CASES_PER_CALL = 256  # largest number of patches in one call


def refusal_reason(model: Model) -> str:
    """Return why the patch of a model cannot be solved together with others, or ""."""
    if (
        model.kind == "patch"
        or model.patch is None
        or model.load_varies
        or model.wear is not None
        or model.patch.mesh.edge_motion
    ):
        return "the case has no patch in motion, or its patch or load changes during the motion"
    return static_batch.reason_not_batched(model.patch)


def group_key(model: Model) -> Hashable:
    """Return a hashable key; patches of models with equal keys can be solved together."""
    return patches.group_key(model)


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of benches or rigs."""

    def solve_part(part: Sequence[Model]) -> CaseResults:
        # for such small systems, the synchronization of BLAS threads takes longer than the solution
        with use_one_blas_thread():
            pressed = patches.attach_solved_patches(part)
            return one_by_one.solve(pressed, report)

    return solve_in_parts(models, MAX_CASES_PER_CALL, solve_part)
