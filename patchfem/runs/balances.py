"""Balances of a finished run: equilibrium of a pressed patch, and energy of a bench.

In: a Result. Out: the Result, marked as `not_converged` if a balance does not hold. The march of a rig checks its energy
balance itself.
"""

from collections.abc import Iterator
from dataclasses import replace

from ..core import Outcome
from ..response import outcome
from .results.result import Result

# Largest relative residual of the load; the contact solver reaches 1e-9 or less.
LOAD_TOL = 1e-6
# Largest residual of the energy of a bench relative to the exchanged energy. All terms are integrated by the same rule,
# so that the residual falls with the number of steps.
ENERGY_TOL = 0.01


def mark_unbalanced(result: Result) -> Result:
    """Return the Result, marked as `not_converged` with a warning for each balance that does not hold.

    Its measures then lose their errors and keep their values.
    """
    if result.outcome is Outcome.NOT_CONVERGED:
        return result
    warnings = [*_check_load(result), *_check_bench_energy(result)]
    if not warnings:
        return result
    return replace(
        result,
        outcome=Outcome.NOT_CONVERGED,
        measures=outcome.remove_errors(result.measures),
        warnings=[*warnings, *result.warnings],
    )


def _check_load(result: Result) -> Iterator[str]:
    """Compare the load of the scene with the integral of the pressure over the interface."""
    model = result.plan.model
    patch = result.patch
    if patch is None or model.load_varies or not model.patch.loading.load:
        return
    if Outcome.NO_CONTACT in (patch.pressure.outcome, result.outcome):
        return
    load = model.patch.loading.load
    total = float(patch.pressure.sigma_n @ patch.pieces.interface.weight)
    if abs(total - load) > LOAD_TOL * load:
        yield (
            f"equilibrium: the integral of the normal stress is {total:.6g} N, but the load is {load:.6g} N; they differ "
            f"by {abs(total - load) / load:.2g} of the load (limit {LOAD_TOL:g}); do not use this result, and report it "
            "with the scene and what `patchfem doctor` prints"
        )


def _check_bench_energy(result: Result) -> Iterator[str]:
    """Compare the residual of the energy balance of a bench with zero.

    Work = change of the stored energy + dissipated - created.
    """
    residual = result.measures.get("energy_balance")
    if result.plan.model.rig is not None or residual is None or residual.value is None:
        return
    if abs(residual.value) > ENERGY_TOL:
        yield (
            f"energy balance: {abs(residual.value):.2g} of the exchanged energy is missing or was created (limit "
            f"{ENERGY_TOL:g}); do not use this result, and report it with the scene and what `patchfem doctor` prints"
        )
