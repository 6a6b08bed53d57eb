"""Balances of a finished run: equilibrium of a pressed patch, and energy of a bench or a march.

In: a Result. Out: the Result, marked as `not_converged` if a balance does not hold.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import inf

from .. import response
from ..core import Outcome
from .results.result import Result

# Largest relative residual of the load; the contact solver reaches 1e-9 or less.
LOAD_BALANCE_TOL = 1e-6
# Largest residual of the energy of a bench relative to the exchanged energy. All terms are integrated by the same rule,
# so that the residual falls with the number of steps.
BENCH_ENERGY_TOL = 0.01
# The same of a march, whose energies differ by round-off only. A billion steps have less.
MARCH_ENERGY_TOL = 1e-8


def mark_unbalanced(result: Result) -> Result:
    """Return the Result, marked as `not_converged` with a warning for each balance that does not hold.

    Its measures then lose their errors and keep their values.
    """
    if result.outcome is Outcome.NOT_CONVERGED:
        return result
    warnings = [*_check_load(result), *_check_energy(result)]
    if not warnings:
        return result
    return replace(
        result,
        outcome=Outcome.NOT_CONVERGED,
        measures=response.outcome.remove_errors(result.measures),
        warnings=[*warnings, *result.warnings],
    )


def _check_load(result: Result) -> Iterator[str]:
    """Yield a warning if the integral of the pressure over the interface differs from the load of the scene.

    Both are in [N], and LOAD_BALANCE_TOL is the largest difference relative to the load. A load that varies has no single
    integral, and is not checked.
    """
    model = result.plan.model
    patch = result.patch
    if patch is None or model.load_varies or not model.patch.loading.load:
        return
    if Outcome.NO_CONTACT in (patch.pressure.outcome, result.outcome):
        return
    load = model.patch.loading.load
    total = float(patch.pressure.sigma_n @ patch.pieces.interface.weight)
    if abs(total - load) > LOAD_BALANCE_TOL * load:
        yield (
            f"equilibrium: the integral of the normal stress is {total:.6g} N, but the load is {load:.6g} N; they differ "
            f"by {abs(total - load) / load:.2g} of the load (limit {LOAD_BALANCE_TOL:g}); do not use this result, and "
            "report it with the scene and what `patchfem doctor` prints"
        )


def _check_energy(result: Result) -> Iterator[str]:
    """Yield a warning if energy is missing or was created in a bench or in a run with equal time steps.

    The measure `energy_balance` is |work - change of the stored energy - dissipated energy|, divided by the exchanged
    and the largest stored energy [1]. In the other engines it is no check, because it enters the errors of the
    measures.
    """
    residual = result.measures.get("energy_balance")
    if residual is None or residual.value is None:
        return
    limit = BENCH_ENERGY_TOL
    if result.plan.model.rig is not None:
        limit = MARCH_ENERGY_TOL if result.settings.steps_per_cycle else inf
    if abs(residual.value) > limit:
        yield (
            f"energy balance: {abs(residual.value):.2g} of the exchanged energy is missing or was created (limit "
            f"{limit:g}); do not use this result, and report it with the scene and what `patchfem doctor` prints"
        )
