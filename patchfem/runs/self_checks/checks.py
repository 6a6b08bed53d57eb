"""Table of all self-checks, and the Result of a run whose checks failed.

In: a Result. Out: its failed Findings, and the Result marked as `not_converged` if there are any.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain

from ...core import Outcome
from ...response import outcome
from ..results.result import Result
from . import motion, patch, structure
from .evidence import Evidence
from .finding import Finding

CHECKS: tuple[Callable[[Evidence], Iterator[Finding]], ...] = (
    patch.check_interface_area,
    patch.check_normal_load,
    patch.check_stiffness_bounds,
    patch.check_pressure_measures,
    structure.check_modes,
    motion.check_friction_harmonic,
    motion.check_friction_limit,
    motion.check_loop_area,
    motion.check_motion_measures,
    motion.check_energy_balance,
)


def mark_failed_checks(result: Result) -> Result:
    """Return the Result, marked as `not_converged` with a warning for each failed self-check.

    If no check fails, it is returned unchanged; otherwise its measures lose their errors and keep
    their values. A model that was changed after it was built is not compared with its scene.

    Parameters
    ----------
    result : Result

    Returns
    -------
    Result
    """
    model = result.plan.model
    if result.outcome is Outcome.NOT_CONVERGED or not model.source.describes(model):
        return result
    run = Evidence(result)
    findings = chain.from_iterable(check(run) for check in CHECKS)
    failed = [finding for finding in findings if finding.has_failed]
    if not failed:
        return result
    return replace(
        result,
        outcome=Outcome.NOT_CONVERGED,
        measures=outcome.remove_errors(result.measures),
        warnings=[*(finding.sentence for finding in failed), *result.warnings],
    )
