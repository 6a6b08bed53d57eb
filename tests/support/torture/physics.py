"""Random scenes whose energy must balance: in every engine, for the dissipation of every law, and with wear."""

from . import grammar
from .effort import estimate_seconds
from .results import BALANCE
from .toml import to_toml
from .trial import Trial, TrialFailure

WORK = 0.05  # Permitted difference of the trapezoidal work of coarse samples, relative to the work.
CREATED = -1e-12  # Least dissipation of a passive law, relative to the total work.
ENGINES = ("auto", "auto", "exact", "march", "harmonic")


def run_trial(trial: Trial) -> None:
    """Run a rig or bench of any law and engine; its energy must balance, and no law may create energy."""
    kind = trial.draw("rig", "rig", "rig", "bench", "masses", "linear")
    tables = grammar.draw_scene(trial, kind)
    tables.pop("wear", None)
    if kind not in ("bench", "linear"):
        tables["accuracy"]["method"] = trial.draw(*ENGINES)
    result = solve_tables(trial, tables)
    if result is None:  # In most cases the scene has no such engine.
        tables["accuracy"]["method"] = "auto"
        result = solve_tables(trial, tables)
    if result is None:
        return
    balance, work = (result.measures.get(name) for name in ("energy_balance", "work_check"))
    is_converged = result.outcome.value not in ("not_converged", "grows")
    if (
        balance is not None
        and balance.value is not None
        and is_converged
        and balance.value > max(BALANCE, balance.error or 0.0)
    ):
        raise TrialFailure(f"{result.outcome.value} with an energy balance of {balance.value:.3g}")
    if (
        work is not None
        and work.value is not None
        and is_converged
        and work.value > WORK
        and not result.warnings
    ):
        raise TrialFailure(
            f"{result.outcome.value} with a work check of {work.value:.3g} and no warning"
        )
    # Results without convergence are marked as unusable.
    if result.outcome.value != "not_converged":
        check_passivity(result, tables)


def check_passivity(result, tables: dict) -> None:
    """Raise TrialFailure if a passive law created energy over the run, or over a cycle of a periodic motion."""
    laws = (
        [tables["friction"]]
        if "friction" in tables
        else tables.get("structure", {}).get("interface", [])
    )
    if not laws or any(
        law.get("reading") == "report" or law["law"] == "convolution" for law in laws
    ):
        return
    energies = result.extra.get("book", {})
    largest_energy = max(
        (abs(value) for value in energies.values() if isinstance(value, float)), default=0.0
    )
    min_dissipation = CREATED * largest_energy
    if energies.get("friction", 0.0) < min_dissipation:
        raise TrialFailure(
            f"friction dissipated {energies['friction']:.3g} J of {largest_energy:.3g} J that passed"
        )
    area = result.measures.get("loop_area")
    if (
        area is not None
        and area.value is not None
        and result.outcome.value == "steady"
        and area.value < -(area.error or 0.0) - 1e-9 * largest_energy
    ):
        raise TrialFailure(f"a loop of {area.value:.3g} ± {area.error or 0.0:.2g} J")


def solve_tables(trial: Trial, tables: dict, max_seconds: float = 3.0, valid: bool = False):
    """Return the Result of a scene; None if it is refused, does not converge or takes more than about `max_seconds` s.

    valid: raise TrialFailure if it is refused.
    """
    from patchfem.api import NotConverged, PatchfemError, load, plan, run

    text = to_toml(tables)
    (trial.folder / "scene.toml").write_text(text, "utf-8")
    trial.tell("patchfem run scene.toml")
    try:
        scene_plan = plan(load(trial.folder / "scene.toml"))
        seconds = estimate_seconds(scene_plan)
        if seconds > max_seconds:
            return None
        trial.limit(seconds + 20.0)
        return run(scene_plan, say=lambda text: None)
    except NotConverged:
        return None
    except Exception as error:
        if isinstance(error, PatchfemError) and not valid:
            return None
        raise TrialFailure(f"{type(error).__name__}: {error}") from None
