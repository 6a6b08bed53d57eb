"""Method and sizes of a bench run.

In: a model with [slide]. Out: `BenchEngine`, steps per cycle and `BenchSizes`. A law without memory has a closed form, and
parallel elements obey Masing's rules; contact points and lists of bonds use the compiled kernels of the rigs.
"""

from dataclasses import dataclass, replace
from math import ceil
from typing import NamedTuple

import numpy as np

from ...effects import law_has_trait, law_supports
from ...friction.bonds import engines as bond_engines
from . import contact_points

MAX_GROOVE_STEPS = 200_000  # Largest number of steps per cycle over grooves.
N_GROOVE_SAMPLES_PER_RADIAN = 20  # Number of samples per radian of the groove phase.


# Names of methods of computing the friction force. Summaries and plans print them, and the code compares with them.
CLOSED_FORM = "closed form"
PARALLEL_ELEMENTS = "parallel elements"
CONTACT_POINTS = "contact points"


@dataclass(frozen=True, slots=True)
class BenchEngine:
    """Engine of a bench run: its computation method and settings.

    - method: method of computing the friction force.
    - choice: engine of bond summation with its settings; None for other methods.
    - has_half_cells: whether an Iwan model has half of its cells, to estimate their error.
    """

    method: str
    choice: "bond_engines.EngineChoice | None" = None
    has_half_cells: bool = False

    @property
    def name(self) -> str:
        """Name of the engine in summaries and plans."""
        return f"bench, {self.method}"


def choose_bench_engine(
    model, slide, choice: "bond_engines.EngineChoice | None" = None
) -> BenchEngine:
    """Choose the method that computes the friction force of a bench run.

    Parameters
    ----------
    model : Model
        Model of a bench, whose friction law decides.
    slide : (k,)
        Relative displacement [m].
    choice : EngineChoice, optional
        Method of the sum over bonds, if it is known.
    """
    f = model.friction
    if law_has_trait(f.law, "memoryless") and not model.partial_slip:
        return BenchEngine(CLOSED_FORM)
    if uses_parallel_elements(model):
        return BenchEngine(PARALLEL_ELEMENTS)
    if not contact_points.sums_over_lists(model):
        return BenchEngine(CONTACT_POINTS)

    choice = choice or choose_bond_summation(model, slide)
    kind = "bond lists" if model.partial_slip or model.side == "lower" else "bond list"
    return BenchEngine(f"{choice.engine} {kind}", choice)


def steps_per_cycle(model) -> int:
    """Return the number of steps per cycle of a bench run, as given or from the tolerance.

    The path over grooves needs at least N_GROOVE_SAMPLES_PER_RADIAN samples per radian of their phase.
    """
    slide = model.slide
    accuracy = model.accuracy
    steps = slide.steps(accuracy.tolerance, accuracy.steps_per_cycle, model.friction.bond_length)
    if model.grooves is None or accuracy.steps_per_cycle is not None:
        return steps
    path = float(np.abs(np.diff(slide.samples(steps)[1])).sum()) / max(1.0, slide.cycles or 1.0)
    phase = model.grooves.wave_number * path
    return max(steps, min(4 * ceil(N_GROOVE_SAMPLES_PER_RADIAN * phase / 4), MAX_GROOVE_STEPS))


def has_changing_pressure(model) -> bool:
    """Return whether the pressure at a point of the upper piece changes during the motion.

    It changes if the load varies, or if the pressure distribution is fixed to the lower piece.
    """
    return model.load_varies or model.side == "lower"


def choose_bond_summation(model, slide) -> "bond_engines.EngineChoice":
    """Choose the method of bond summation for an interface whose points all slide alike.

    The method is chosen as in a rig. Its error refers to the largest force, which is small for
    strokes that are short compared with the bond length. `slide` (k,) [m] is the relative
    displacement.
    """
    law = model.bonds
    accuracy = model.accuracy
    stroke, steps = mean_stroke(slide)
    stroke = max(stroke / law.length, 1e-9)
    goal = accuracy.tolerance * min(1.0, stroke)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    requested = bond_engines.RequestedEngine(find_requested_engine(model), tail, accuracy.merge)
    return bond_engines.choose_engine(law, goal, stroke, steps, requested)


def find_requested_engine(model) -> str:
    """Return the engine of bond summation that the scene requests, or "auto".

    A list of each point becomes "merged", if the scene does not name a sum and the bonds keep the pressure at which they
    formed: each step adds a strip to every list.
    """
    if not contact_points.sums_over_lists(model):
        return "auto"
    requested = model.accuracy.quadrature
    if requested not in ("auto", "recursion"):
        return requested
    has_separate_lists = model.side == "lower" or (model.rig is not None and model.load_varies)
    return "merged" if has_separate_lists else "auto"


def choose_smooth_bond_summation(model, slide) -> "bond_engines.EngineChoice | None":
    """Choose a bond summation without merging, so that the force is smooth in the parameters.

    With merging, the summation error jumps when a parameter changes, which disturbs a fit. The
    result is None for laws without bonds, and if the scene fixes the engine or the merging.
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


def mean_stroke(slide) -> tuple[float, float]:
    """Return the mean path [m] between two reversals of a slide (k,) [m], and the mean number of steps that move on it."""
    moves = np.diff(slide)
    directions = np.sign(moves[moves != 0])
    count = 1 + np.count_nonzero(directions[1:] != directions[:-1])
    return float(np.abs(moves).sum()) / count, max(directions.size / count, 1.0)


def uses_parallel_elements(model) -> bool:
    """Return whether parallel elements compute a bench run, which they do exactly at a constant load."""
    friction = model.friction
    is_constant = model.grooves is None and not has_changing_pressure(model)
    is_known = law_supports(friction, "shear") or not model.partial_slip
    return is_constant and is_known and law_supports(friction, "pieces")


def nodal_element_limit(model, patch):
    """Return the tractions (m,) [Pa] at which the nodes of a pressed patch slip, if parallel elements compute the slip.

    The result is None for other methods, and for the cells of a face, whose tractions are interpolated.
    """
    is_exact = model.partial_slip and uses_parallel_elements(model) and model.patch.area is None
    return model.friction.static * patch.pressure.sigma_n if is_exact else None


class SlideSamples(NamedTuple):
    """Samples of the path of a bench.

    - time, slide (k,): times [s] and displacements [m].
    - first: index of the sample at which the last cycle starts.
    - omega: circular frequency of the cycle [rad/s]; 0 for a path that is not cyclic.
    """

    time: np.ndarray
    slide: np.ndarray
    first: int
    omega: float


def sample_path(model, steps: int, path: tuple | None = None) -> SlideSamples:
    """Return the samples of a path, to which a varying load adds some.

    It bends the force between the samples of the slide.

    Parameters
    ----------
    model : Model
        Model of a bench.
    steps : int
        Steps per cycle.
    path : tuple, optional
        Path in the form of `SlidePath.samples`; default: that of the model.
    """
    time, slide, first, omega = path or model.slide.samples(steps)
    if model.load_varies:
        start = time[first]
        time, slide = model.point.refine_samples(model.slide, time, slide, steps)
        first = int(np.searchsorted(time, start))
    return SlideSamples(time, slide, first, omega)


class BenchSizes(NamedTuple):
    """Sizes of a bench run.

    - engine: name of the engine.
    - unknowns: {"bond_list_about": expected number of strips of a list of bonds}, or {} without a list.
    - samples: number of samples that the run and its comparison runs keep.
    """

    engine: str
    unknowns: dict[str, int]
    samples: int


def count_bench_sizes(model) -> BenchSizes:
    """Count the unknowns and the samples of a bench run."""
    slide = sample_path(model, steps_per_cycle(model)).slide
    engine = choose_bench_engine(model, slide)
    # The comparison runs keep their samples.
    unknowns = {}
    if engine.choice is not None and engine.choice.strips:
        unknowns["bond_list_about"] = int(engine.choice.strips)
    return BenchSizes(engine.name, unknowns, slide.size)


def compute_dimensionless_groups(model) -> dict[str, float]:
    """Return the ratio of the displacement amplitude to the bond length as a dict, if both exist."""
    length = model.friction.bond_length
    return {"amplitude_over_bond_length": model.slide.amplitude / length} if length else {}
