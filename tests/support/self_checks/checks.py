"""Table of all self-checks.

In: a Result. Out: its failed Findings.
"""

from collections.abc import Callable, Iterator
from itertools import chain

from patchfem.runs.results.result import Result

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


def list_failed_checks(result: Result) -> list[Finding]:
    """Return the comparisons of a Result whose two numbers differ by more than is possible in a correct run."""
    run = Evidence(result)
    findings = chain.from_iterable(check(run) for check in CHECKS)
    return [finding for finding in findings if finding.has_failed]
