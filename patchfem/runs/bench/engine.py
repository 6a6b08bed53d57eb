"""Choice of the method that computes the friction along a bench path, and its cost.

In: a model with [slide]. Out: `BenchEngine`, steps per cycle and `Cost`. Recursion, list of
bonds and elements are the compiled ones that rigs use. A law without memory needs no loop. If
the pressure of a point changes during the slide, the law is evaluated sample by sample.
"""

from dataclasses import dataclass, replace
from enum import Enum
from math import ceil

import numpy as np

from ... import cost_model
from ...core import Missing
from ...dynamics.march import capacity
from ...effects import is_bond_list, law_has_trait
from ...friction.bonds import engines as bond_engines
from ...friction.bonds import parameters
from ...slip import shear_modes
from ..cost import MARCH_CODE, NO_CODE, SHORT_CODE, Cost, MemoryPart

MAX_GROOVE_STEPS = 200_000  # Largest number of steps per cycle over grooves.
N_SAMPLES_PER_RADIAN = 20  # Number of samples per radian of the groove phase.
BYTES_PER_SAMPLE = 250.0  # Memory of a sample of the histories [bytes].
# Ratio of the passes through a bond list per step to those in a rig. A prescribed displacement needs no search for the
# increment of the displacement.
LIST_PASS_RATIO = 1 / 3


class Method(Enum):
    """Method by which the friction force along a bench path is computed.

    The value is its name in summaries and plans.
    """

    CLOSED = "closed form"
    ELEMENTS = "parallel elements"
    POINTS = "bond points"
    RECURSION = "recursion"
    LIST = "bond list"
    LISTS = "bond lists"
    STEPPED = "law step by step"
    PLANE = "two directions"


LIST_METHODS = (Method.LIST, Method.LISTS)


@dataclass(frozen=True, slots=True)
class BenchEngine:
    """Method and settings with which a bench computes the friction along its path.

    - method: Method.
    - seconds: CPU seconds per sample.
    - choice: engine of the sum over bonds, with its settings; None without a sum.
    """

    method: Method
    seconds: float
    choice: "bond_engines.EngineChoice | None" = None

    @property
    def name(self) -> str:
        """Name of the engine in summaries and plans."""
        if self.method in LIST_METHODS:
            return f"bench, {self.choice.engine} {self.method.value}"
        return f"bench, {self.method.value}"

    @property
    def compiled_code(self):
        """Compiled code that the method needs."""
        if self.method in (Method.ELEMENTS, Method.RECURSION):
            return SHORT_CODE
        if self.method in (Method.POINTS, *LIST_METHODS):
            return MARCH_CODE
        return NO_CODE


def bench_engine(
    model, slide, points: int = 1, choice: "bond_engines.EngineChoice | None" = None
) -> BenchEngine:
    """Choose the method by which the friction force along a bench path is computed.

    Parameters
    ----------
    model : Model
    slide : (k,)
        Samples of the slide [m].
    points : int
        Nodes of the interface.
    choice : EngineChoice, optional
        Method of the sum over bonds, if it is known.

    Raises
    ------
    Missing
        If the sum over bonds would take too long.
    """
    f = model.friction
    if model.slide.across is not None:
        return BenchEngine(Method.PLANE, _predict_step_seconds(model, slide, 1))
    if model.partial_slip and (law_has_trait(f.law, "bonds") or model.grooves is not None):
        modes = model.accuracy.shear_modes or shear_modes.N_SHEAR_MODES
        varies = model.grooves is not None or has_changing_pressure(model)
        if model.grooves is None and (
            is_bond_list(f) or requested_engine(model) not in ("auto", "recursion")
        ):
            choice = choice or choose_bond_summation(model, slide)
            return _choose_sum_engine(model, slide, points, choice, points)
        seconds = cost_model.predict_shear_mode_step(points, modes, load_varies=varies)
        return BenchEngine(Method.POINTS, seconds)
    if model.partial_slip:
        return BenchEngine(
            Method.ELEMENTS, cost_model.SLIP_NODE_SECONDS * points + cost_model.SAMPLE_SECONDS
        )
    if has_changing_pressure(model) and model.grooves is None:
        return _make_stepped_engine(model, slide, points)
    if law_has_trait(f.law, "memoryless"):
        return BenchEngine(Method.CLOSED, cost_model.SAMPLE_SECONDS)
    if not law_has_trait(f.law, "bonds"):
        return BenchEngine(Method.ELEMENTS, cost_model.SAMPLE_SECONDS)
    return _choose_sum_engine(model, slide, points, choice or choose_bond_summation(model, slide))


def steps_per_cycle(model) -> int:
    """Return the steps per cycle of a bench, from the scene or else from tolerance and grooves."""
    slide = model.slide
    accuracy = model.accuracy
    steps = slide.steps(accuracy.tolerance, accuracy.steps_per_cycle, model.friction.bond_length)
    if model.grooves is None or accuracy.steps_per_cycle is not None:
        return steps
    path = float(np.abs(np.diff(slide.samples(steps)[1])).sum()) / max(1.0, slide.cycles or 1.0)
    phase = model.grooves.wave_number * path
    return max(steps, min(4 * ceil(N_SAMPLES_PER_RADIAN * phase / 4), MAX_GROOVE_STEPS))


def has_changing_pressure(model) -> bool:
    """Return whether the pressure of a point changes during the motion.

    It changes with the load, or if the point moves over the pressure distribution of the other
    piece.
    """
    return model.load_varies or model.side == "lower"


def choose_bond_summation(model, slide) -> "bond_engines.EngineChoice":
    """Choose the method that sums the forces of the bonds of a rigidly sliding interface.

    It is chosen as in a rig, except that its error is relative to the reached force, which is small
    if the stroke is short compared with the bond length. slide: samples (k,) [m].
    """
    law = model.bonds
    accuracy = model.accuracy
    stroke, steps = mean_stroke(slide)
    stroke = max(stroke / law.length, 1e-9)
    goal = accuracy.tolerance * min(1.0, stroke)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    requested = bond_engines.RequestedEngine(requested_engine(model), tail, accuracy.merge)
    return bond_engines.choose_engine(law, goal, stroke, steps, requested)


def requested_engine(model) -> str:
    """Return the engine that the scene requests for a sum over bonds, or "auto".

    "merged" replaces it if every point has its own list and bonds keep the pressure at which they
    formed while it changes, because each step then leaves a strip.
    """
    scene_engine = model.accuracy.quadrature
    f = model.friction
    rig = model.rig is not None
    has_separate_lists = (
        model.side == "lower" and (model.partial_slip or (rig and is_bond_list(f)))
    ) or (rig and model.load_varies and is_bond_list(f))
    return (
        "merged" if has_separate_lists and scene_engine in ("auto", "recursion") else scene_engine
    )


def choose_smooth_bond_summation(model, slide) -> "bond_engines.EngineChoice | None":
    """Choose a bond summation without merging, whose force varies smoothly with parameters.

    It is None for laws without bonds, or if the scene prescribes the engine or the merging. With
    merging, the force would jump by the error of the sum when a value of the scene changes, which
    disturbs a fit.
    """
    if (
        not law_has_trait(model.friction.law, "bonds")
        or model.accuracy.quadrature != "auto"
        or model.accuracy.merge is not None
    ):
        return None
    choice = choose_bond_summation(model, slide)
    if choice.engine != "merged":
        return choice
    return replace(choice, engine="truncated", merge=0.0, error=choice.tail)


def mean_stroke(slide) -> tuple:
    """Return the mean path [m] and the mean number of moving steps between two reversals."""
    moves = np.diff(slide)
    directions = np.sign(moves[moves != 0])
    count = 1 + np.count_nonzero(directions[1:] != directions[:-1])
    return float(np.abs(moves).sum()) / count, max(directions.size / count, 1.0)


def _choose_sum_engine(
    model, slide, points: int, choice: "bond_engines.EngineChoice", lists: int = 1
) -> BenchEngine:
    """Return the bench engine for a law that sums over bonds, and its predicted CPU time [s].

    lists: number of lists, one per point with shear modes, else 1.
    """
    law = model.bonds
    if choice.engine == "recursion":
        return BenchEngine(Method.RECURSION, cost_model.RECURSION_STEP_SECONDS, choice)
    if law.breakaway and lists == 1:  # A bond list cannot represent an elastic range.
        return _make_stepped_engine(model, slide, points)
    size = slide.size
    max_move = float(np.abs(np.diff(slide)).max())
    strips = min(choice.strips, size * max(1.0, 4 * max_move / law.length))
    seconds = (LIST_PASS_RATIO if lists == 1 else lists) * choice.seconds
    if choice.strips:
        seconds *= strips / choice.strips
    if size * seconds > parameters.MAX_LIST_SECONDS:
        raise Missing(
            f"the sum over the list of bonds (about {strips:.0f} entries) would need a computing time of "
            f"about {size * seconds:.0f} s, more than the limit of {parameters.MAX_LIST_SECONDS:.0f} s; lower "
            "accuracy.steps_per_cycle or slide.cycles, or raise accuracy.tail or accuracy.merge",
            "",
        )
    return BenchEngine(Method.LIST if lists == 1 else Method.LISTS, seconds, choice)


def _make_stepped_engine(model, slide, points: int) -> BenchEngine:
    """Return the bench engine that evaluates a friction law sample by sample."""
    return BenchEngine(Method.STEPPED, _predict_step_seconds(model, slide, points))


def _predict_step_seconds(model, slide, points: int) -> float:
    """Predict the CPU time [s] of one step of a NumPy law.

    The law depends on the last increment, or is a sum over the strips of the path.
    """
    f = model.friction
    if not is_bond_list(f):
        return cost_model.LAW_STEP_SECONDS
    mean_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(slide.size / 2, 40 * f.bond_length / mean_step + 64)
    return (3 if model.load_varies else 1) * (
        cost_model.PATH_STEP_SECONDS
        + cost_model.PATH_STRIP_SECONDS * strips
        + cost_model.PATH_POINT_SECONDS * strips * points
    )


def uses_parallel_elements(model) -> bool:
    """Return whether parallel elements represent the partial slip of a bench."""
    simple = model.grooves is None and model.slide.across is None
    return model.partial_slip and simple and not law_has_trait(model.friction.law, "bonds")


def predict_cost(model, points: int) -> Cost:
    """Predict the CPU time and the memory of a bench run.

    Parameters
    ----------
    model : Model
    points : int
        Nodes of the interface; 1 without a patch.
    """
    per_cycle = steps_per_cycle(model)
    time, slide = model.slide.samples(per_cycle)[:2]
    if model.load_varies:
        time, slide = model.point.refine_samples(model.slide, time, slide, per_cycle)
    engine = bench_engine(model, slide, points)
    # The run and its passes with half and a quarter of the steps take about as long as two runs; a
    # sum over bonds or cells needs a further pass.
    has_cells = law_has_trait(model.friction.law, "cells") and engine.method is Method.ELEMENTS
    passes = 3 if has_cells else 2
    steps = passes * time.size
    samples = MemoryPart(
        BYTES_PER_SAMPLE * steps / 2, f"{steps // 2} samples of the slide", _samples_key(model)
    )
    sizes = {}
    lists = ()
    if engine.choice is not None and engine.choice.strips:
        strips = int(engine.choice.strips)
        sizes = {"bond_list_about": strips}
        lists = (MemoryPart(capacity.list_bytes(strips), "the list of bonds", "accuracy.tail"),)
    motion = Cost(
        {"motion": steps * engine.seconds}, (samples, *lists), (), steps, sizes, engine.name
    )
    return motion + engine.compiled_code.cost()


def _samples_key(model) -> str:
    """Return the scene key that sets the number of samples along the bench path."""
    if model.slide.kind == "file":
        return "slide.file"
    return "accuracy.steps_per_cycle" if model.accuracy.steps_per_cycle else "slide.cycles"


def dimensionless_groups(model) -> dict:
    """Return the dimensionless ratio of displacement amplitude to bond length as a dict.

    The dict is empty without a bond length.
    """
    length = model.friction.bond_length
    return {"amplitude_over_bond_length": model.slide.amplitude / length} if length else {}
