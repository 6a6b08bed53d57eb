"""Random scenes whose energy must balance: in every engine, for the dissipation of every law, and with wear."""

from . import grammar
from .results import BALANCE
from .toml import text_of
from .trial import Trial, Wrong

WORK = 0.05  # Permitted difference of the trapezoidal work of coarse samples, relative to the work.
CREATED = -1e-12  # Least dissipation of a passive law, relative to the total work.
ENGINES = ("auto", "auto", "exact", "march", "harmonic")


def energy(trial: Trial) -> None:
    """Run a rig or bench of any law and engine; its energy must balance, and no law may create energy."""
    kind = trial.draw("rig", "rig", "rig", "bench", "masses", "linear")
    tables = grammar.scene(trial, kind)
    tables.pop("wear", None)
    if kind not in ("bench", "linear"):
        tables["accuracy"]["method"] = trial.draw(*ENGINES)
    found = solved(trial, tables)
    if found is None:  # In most cases the scene has no such engine.
        tables["accuracy"]["method"] = "auto"
        found = solved(trial, tables)
    if found is None:
        return
    balance, work = (found.measures.get(name) for name in ("energy_balance", "work_check"))
    settled = found.outcome.value not in ("not_converged", "grows")
    if (
        balance is not None
        and balance.value is not None
        and settled
        and balance.value > max(BALANCE, balance.error or 0.0)
    ):
        raise Wrong(f"{found.outcome.value} with an energy balance of {balance.value:.3g}")
    if (
        work is not None
        and work.value is not None
        and settled
        and work.value > WORK
        and not found.warnings
    ):
        raise Wrong(f"{found.outcome.value} with a work check of {work.value:.3g} and no warning")
    # Results without convergence are marked as unusable.
    if found.outcome.value != "not_converged":
        passive(found, tables)


def passive(found, tables: dict) -> None:
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
    book = found.extra.get("book", {})
    passed = max((abs(value) for value in book.values() if isinstance(value, float)), default=0.0)
    least = CREATED * passed
    if book.get("friction", 0.0) < least:
        raise Wrong(f"friction dissipated {book['friction']:.3g} J of {passed:.3g} J that passed")
    area = found.measures.get("loop_area")
    if (
        area is not None
        and area.value is not None
        and found.outcome.value == "steady"
        and area.value < -(area.error or 0.0) - 1e-9 * passed
    ):
        raise Wrong(f"a loop of {area.value:.3g} ± {area.error or 0.0:.2g} J")


def solved(trial: Trial, tables: dict, most: float = 3.0, valid: bool = False):
    """Return the Result of a scene; None if it is refused, does not converge or is planned above `most` seconds.

    valid: raise TrialFailure if it is refused.
    """
    from patchfem.api import NotConverged, PatchfemError, load, plan, run

    text = text_of(tables)
    (trial.folder / "scene.toml").write_text(text, "utf-8")
    trial.tell("patchfem run scene.toml")
    try:
        read = load(trial.folder / "scene.toml")
        seconds = plan(read).seconds
        if seconds > most:
            return None
        trial.limit(seconds + 10.0)
        return run(read, say=lambda text: None)
    except NotConverged:
        return None
    except Exception as error:
        if isinstance(error, PatchfemError) and not valid:
            return None
        raise Wrong(f"{type(error).__name__}: {error}") from None
