"""The engines of a rig as records: what each cannot do, how it solves, how a run of it can be coarser, what it costs.

`engine_of` takes the engine that the scene names, or the first that can. What a named engine does not take the rules of
the scene have refused, `scene.rules.methods`.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from math import inf
from typing import NamedTuple

import numpy as np

from ...effects import has
from ...model.model import Model
from ...response.coarser import Rung, space_rung
from ...response.errors import cells_error, change, jumps_error, pieces_error, step_error, tolerance_error
from ...scene.rules import methods
from ...scene.rules.draft import acts, pinned
from ..effort import too_long
from .pieces.costs import pieces, seconds_of_pieces, seconds_of_steps
from .smooth.choice import not_smooth
from .solution import gauged

FINER, MERGED = 0.5, 2.0  # merge width of the run that shows what merging does, and times its change
LOOSE = 1e-2  # tail over the tolerance from which it is checked by a run with less; unpinned it is a tenth of that
LESS = 0.1  # tail of that run
WORTH = 5.0  # seconds that an exact motion may take where steps would take less, and be off by their bars
MOST_PIECES = 1e5  # of a period, up to which a steady motion is found by the map of its yields


class Variant(NamedTuple):
    """A coarser run of a rig: its Numerics and the Patch that it takes, None under [normal]."""

    numerics: object
    patch: object


CLOSED = 1e-8  # gap of an energy balance that is kept to round-off: a billion steps leave less


class Engine(NamedTuple):
    """One engine of a rig.

    lacks(model) -> why it has no answer to a model that names no engine, "" where it has; solve: "module function" of
    this folder, function(model, numerics, patch, frames, say, progress) -> Solution; in_time(model, numerics, patch)
    and in_space(model, numerics, patch, coarse, solution) -> Rungs of its error; least: relative error that stays;
    closes: gap of the energy balance beyond which a run has not converged, None where the engine's own error of the
    balance says it, infinite of methods that are shown with what they lose.
    """

    name: str
    lacks: Callable
    solve: str
    in_time: Callable
    in_space: Callable
    least: float = 1e-9
    closes: float | None = CLOSED

    @property
    def run(self) -> Callable:
        """The function that solves, imported when it is first wanted."""
        module, function = self.solve.split()
        solve = getattr(import_module(f"patchfem.runs.rig.{module}"), function)
        return lambda model, *given: gauged(model, solve(model, *given))


def no_closed_form(model: Model, steady: bool = False) -> str:
    """Why a run has no exact solution; empty where it has one. steady: under the sine of a curve, not the drive's own
    waveform."""
    return methods.no_closed_form(*_met(model, steady))


def no_pieces(model: Model) -> str:
    """Why a run is not linear from yield to yield; empty where it is."""
    return methods.no_pieces(*_met(model))


def _met(model: Model, steady: bool = False) -> tuple:
    """What a model confronts an exact engine with, as `scene.rules.methods` asks."""
    rig = model.rig
    laws = [one.numbers.law for one in rig.interfaces]
    spring = "[structure.stiffening]" if rig.cubic is not None else \
        "structure.bonded.wavelength" if rig.interlock is not None else \
        f"[{model.grooves.key}]" if model.grooves is not None else ""
    waveform = "" if steady or rig.kind == "free" else rig.waveform
    return (laws, model.soft, "under a load that changes" if rig.load_varies else "", rig.strips_slide_apart, waveform,
            spring)


def steady_by(model: Model) -> str:
    """How the steady motion of a model is found: by the map of "events" or of "yields", which are exact, by a "balance"
    of harmonics, or, over grooves where no balance knows the law, by a "march" that is brought to repeat.

    A scene that names its harmonics has its balance. So has one whose springs ring without end between yields.
    """
    if not no_closed_form(model, steady=True):
        return "events"
    if model.grooves is not None and (model.soft or not methods.balances_over_grooves(model.friction)):
        return "march"
    named = model.accuracy.harmonics is not None
    return "balance" if named or no_pieces(model) or pieces(model) > MOST_PIECES else "yields"


def dearer_pieces(model: Model) -> str:
    """Why the march is to run a model: it is not linear from yield to yield, the scene names its steps, or its yields
    cost more than steps and more than WORTH."""
    if reason := no_pieces(model):
        return reason
    if model.accuracy.steps_per_cycle is not None:
        return "its steps are named"
    dear = seconds_of_pieces(model) > max(seconds_of_steps(model), WORTH)
    return "its yields cost more than steps" if dear else ""


def _not_exact(model: Model) -> str:
    """Why a run is better not exact; empty where it has an exact solution that costs no more than it is worth."""
    return no_closed_form(model) or too_long(model)


def set_valued(model: Model, numerics) -> bool:
    """Whether a march meets Coulomb's law as it stands, without a compliance of pieces, skin or holder in series."""
    laws, patch = [one.numbers.law for one in model.rig.interfaces], model.patch
    gives = patch is not None and bool(patch.gives_way or patch.slide_spring)
    return numerics.engine == "march" and not gives and any(has(law, "set-valued") for law in laws)


def _nothing(model: Model) -> str:
    return ""


def _no_rungs(*_) -> list:
    return []


def sampled(values: dict) -> dict:
    """Errors by name of the measures that are read off 400 samples a cycle."""
    loops = ("loop_area", "equivalent_stiffness", "equivalent_damping", "slip_amplitude", "friction_force_peak")
    return {name: 1e-4 * abs(value) if name in loops else 0.005 if name in ("stick_fraction", "slip_start_phase")
            else 1e-9 * abs(value) for name, value in values.items()}


def _exact_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """Rungs of the exact engine: the mesh, where the loads of strips or the limit of an averaged law come from it.

    Strips that slide apart are read off 400 samples a cycle besides, by the trapezoidal rule.
    """
    averaged = model.friction is not None and has(model.friction.law, "averaged")
    meshed = coarse is not None and (model.rig.strips_slide_apart or averaged)
    samples = [Rung((), sampled)] if model.rig.strips_slide_apart else []
    return [*samples, space_rung(Variant(numerics, coarse))] if meshed else samples


def _pieces_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """Rungs of the engine of pieces: the mesh, where its nodes make the elements, and half the cells of a density."""
    out = [Rung((Variant(numerics, coarse),), pieces_error, of="mesh")] if coarse is not None and model.soft else []
    cells = any(has(one.numbers.law, "cells") for one in model.rig.interfaces)
    if not cells:
        return out
    return [*out, Rung((Variant(replace(numerics, pairs=numerics.pairs + 1), patch),), cells_error, of="cells")]


def _fewer(numerics, share: int):
    """Numerics with the steps divided by `share`."""
    return replace(numerics, steps=max(1, numerics.steps // share))


def _march_in_time(model: Model, numerics, patch) -> list:
    """Rungs of the march in time: half and a quarter of the steps."""
    halves = tuple(Variant(_fewer(numerics, share), patch) for share in (2, 4))
    size, f = model.rig.displacement, model.friction
    turn = f.bond_length if f is not None and has(f.law, "bonds") else 0.0
    if set_valued(model, numerics):
        return [Rung(halves, lambda *values: jumps_error(*values, numerics.steps, size), of="steps")]
    return [Rung(halves, lambda *values: step_error(*values, numerics.steps, size, turn), of="steps")]


def _march_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """Rungs of the march in space: the mesh, the number of shear modes and the sum over bonds, at a quarter of the
    steps."""
    few, varies, out = _fewer(numerics, 4), model.rig.load_varies, []
    quarter = Variant(few, patch)
    if coarse is not None and (varies or model.soft):
        out.append(space_rung(Variant(few, coarse), quarter))
    shape = getattr(getattr(solution.contact, "reduction", None), "stiffness", None)
    climbs = model.grooves is not None
    if shape is not None and (varies or climbs or (coarse is not None and has(model.friction.law, "bonds"))):
        out.append(space_rung(Variant(replace(few, shear_modes=max(1, shape.size // 2)), patch), quarter, "modes"))
    return [*out, *_summed(model, few, patch, solution)]


def _summed(model: Model, few, patch, solution) -> list:
    """Rungs of a list of bonds: its stated bound on forces and energies, and, where it merges or its tail was set
    loose, the change of the motion with narrower strips and a smaller tail, at the steps of `few`."""
    choice = solution.summed
    if choice is None or not choice.error:
        return []
    out = [Rung((), lambda fine: stated(model, patch, choice.error, fine, solution), of="bonds")]
    if choice.merge > 0 or choice.tail > LOOSE * model.accuracy.tolerance:
        finer = replace(choice, merge=FINER * choice.merge, tail=LESS * choice.tail)
        same, narrow = (Variant(replace(few, choice=one), patch) for one in (choice, finer))
        out.append(Rung((narrow,), lambda wide, fine: {name: MERGED * gap for name, gap in change(wide, fine).items()},
                        same, "bonds"))
    return out


def stated(model: Model, patch, error: float, values: dict, solution) -> dict:
    """Errors by measure name that follow from the bound of a sum over bonds, a share of the friction limit.

    error: of the sum [1]; values: measures of the run. Forces and slip have it directly, work as that share of what
    went to and fro, the store as that of a bond length at the limit, all else as a share of its value.
    """
    load = patch.pressure.load if patch is not None else model.point.load
    force, ledger = error * model.friction.static * load, solution.window.extra["ledger"][0]
    span = solution.window.time[-1] - solution.window.time[0]
    passed = error * solution.book["passed"]
    direct = {"friction_force_peak": force, "slip_amplitude": error * model.friction.bond_length, "work_check": error,
              "energy_stored": force * model.friction.bond_length, "friction_work": passed, "energy_dissipated": passed,
              "loop_area": error * float(np.abs(np.diff(ledger)).sum()) * model.rig.drive.period / max(span, 1e-300),
              "energy_balance": 0.0, "normal_load": 0.0}
    return {name: direct.get(name, error * abs(value)) for name, value in values.items()}


def _own_errors(model: Model, numerics, patch, coarse, solution) -> list:
    """Rungs of what a run itself leaves open: the residual of a balance and the change at half the harmonics, or what
    samples do not resolve."""
    return [Rung((), lambda fine: {name: solution.errors.get(name, 0.0) for name in fine})]


def _steady_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """Rungs of a steady motion: what it leaves open itself, and the mesh where its nodes make the elements."""
    meshed = _pieces_in_space(model, numerics, patch, coarse, solution) if steady_by(model) == "yields" else []
    return [*_own_errors(model, numerics, patch, coarse, solution), *meshed]


COARSER = 30.0  # times the error of a step


def _smooth_in_time(model: Model, numerics, patch) -> list:
    """Rung of the smooth engine: a run whose steps may make COARSER times the error.

    The error of a run follows that of its steps, `response.errors.tolerance_error`.
    """
    wider = Variant(replace(numerics, local=numerics.local * COARSER), patch)
    return [Rung((wider,), lambda *values: tolerance_error(*values, model.rig.displacement))]


EXACT = Engine("exact", _not_exact, "exact run_exact", _no_rungs, _exact_in_space)
PIECES = Engine("piecewise", dearer_pieces, "pieces.run run_piecewise", _no_rungs, _pieces_in_space)
MARCH = Engine("march", _nothing, "march run_march", _march_in_time, _march_in_space)
HARMONIC = Engine("harmonic", _nothing, "steady.steady run_steady", _no_rungs, _steady_in_space, 0.0, None)
COMPARED = ("duhamel", "newmark", "euler")
SMOOTH = Engine("smooth", not_smooth, "smooth.solve run_smooth", _smooth_in_time, _own_errors, 3e-8, None)
ENGINES = {one.name: one for one in (EXACT, PIECES, SMOOTH, MARCH, HARMONIC, *(
    Engine(name, _nothing, "comparison run_comparison", _march_in_time, _march_in_space, closes=inf)
    for name in COMPARED))}
AUTOMATIC = (EXACT, PIECES, SMOOTH, MARCH)  # in the order in which they are tried


def unbalanced(engine: Engine, measures: dict) -> str:
    """The sentence on an energy balance that does not close as this engine closes it; "" where it does.

    measures: by name, with their errors, of a run of the engine.
    """
    found = measures.get("energy_balance")
    if found is None or found.value is None:
        return ""
    bar = max(CLOSED, found.error or 0.0) if engine.closes is None else engine.closes
    if not found.value > bar:  # a motion that is not finite has been seen before
        return ""
    return f"the energy balance of engine {engine.name} misses {found.value:.2g} of the energy that passed, beyond " \
        f"{bar:.2g}, so a step made or lost energy"


@lru_cache(8)
def engine_of(model: Model, per_point: bool = False) -> Engine:
    """The engine that a scene names, or the first of AUTOMATIC that lacks nothing.

    per_point: bonds are followed at every node, which the smooth engine does not.
    """
    if model.accuracy.method == "exact" and no_closed_form(model):
        return PIECES
    named = ENGINES.get(model.accuracy.method)
    return named or next(one for one in AUTOMATIC if not (one.lacks(model) or (per_point and one is SMOOTH)))


def knobs_idle(model: Model, engine: str) -> list:
    """Sentences on the knobs of [accuracy] that a rig names and that the engine it is run by does not take."""
    by = engine if engine != "harmonic" else {"balance": "harmonic", "march": "march"}.get(steady_by(model), "exact")
    where = {"steps_per_cycle": f"for engine '{engine}', which has no steps,",
             "harmonics": "where the steady motion is exact from event to event"}
    plain = f"for engine '{engine}'"
    return [f"accuracy.{knob} has no meaning {where.get(knob, plain)} and is not used"
            for knob in pinned(model.accuracy) if not acts(knob, model.kind, by)]
