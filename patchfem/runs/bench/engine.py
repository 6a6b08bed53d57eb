"""Numerical settings of a motion, and the method, steps and sizes of a bench run.

In: a model with [slide]. Out: `Numerics`, steps per cycle and `BenchSizes`. A law without memory has a closed form, and
parallel elements obey Masing's rules; contact points and lists of bonds use the compiled kernels of the rigs.
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import ceil
from typing import NamedTuple

import numpy as np

from ... import friction
from ...effects import law_has_trait, law_supports
from ...model import slide as model_slide
from ..interfaces import bond_lists

N_GROOVE_SAMPLES_PER_RADIAN = 20  # Number of samples per radian of the groove phase.
MIN_RELATIVE_STEP_ERROR = 1e-12  # Smallest relative error per step; below it round-off dominates.

# Names of methods of computing the friction force. Summaries and plans print them, and the code compares with them.
CLOSED_FORM = "closed form"
PARALLEL_ELEMENTS = "parallel elements"
CONTACT_POINTS = "contact points"
BOND_LIST = "bond list"


class SpaceSettings(NamedTuple):
    """What represents the interfaces and the structure in a run, and what is coarser or other in its comparison runs.

    - shear_modes: number of shear modes; None: set by the tolerance.
    - choice: method of bond summation; None: set by the tolerance and the steps.
    - other_rig: index of the rig with other modes of a reduced structure, or None.
    - meshed: indices of the interfaces whose patches have a coarser mesh.
    - coarse_patch: how many times the mesh of the patch of [contact] is coarser by a factor of 2.
    - stiffer_joint: whether a joint that is subtracted from bolted modes is stiffer by its error.
    - has_half_cells: whether Iwan models of time steps have half their cells.
    """

    shear_modes: int | None = None
    choice: "friction.bonds.engines.EngineChoice | None" = None
    other_rig: int | None = None
    meshed: tuple[int, ...] = ()
    coarse_patch: int = 0
    stiffer_joint: bool = False
    has_half_cells: bool = False


@dataclass(frozen=True, slots=True)
class Numerics:
    """Numerical settings of a run of a rig or a bench.

    - engine: name of the engine.
    - steps: time steps per cycle; of the engine `event_driven` the smallest number per shortest period of the drive.
    - cycles, window: number of cycles of the run, and of the window at its end.
    - space: SpaceSettings.
    - whole: whether the run stores the histories before the window, or draws the response curve beside its peak; coarse runs
      may omit them.
    - local: largest relative error per step of the engine `event_driven`.
    """

    engine: str
    steps: int
    cycles: float
    window: int
    space: SpaceSettings = field(default_factory=SpaceSettings)
    whole: bool = True
    local: float = 0.0

    def finer(self):
        """Return finer settings for the next run.

        The engine `event_driven` has a hundredth of the step error, and other engines have twice as many steps.
        """
        if self.local:
            return replace(self, local=max(0.01 * self.local, MIN_RELATIVE_STEP_ERROR))
        return replace(self, steps=2 * self.steps)

    def vary_space(self, **changes) -> "Numerics":
        """Return settings with other SpaceSettings."""
        return replace(self, space=self.space._replace(**changes))


def make_bench_numerics(
    model, steps: int, path: "model_slide.SlideSamples | None" = None
) -> Numerics:
    """Return the Numerics of a bench.

    Parameters
    ----------
    model : Model
        Model of the bench.
    steps : int
        Steps per cycle.
    path : SlideSamples, optional
        Path in place of that of the model.
    """
    choice = None
    if find_method(model).startswith(BOND_LIST):
        slide = sample_path(model, steps, path).rel_disp
        choice = bond_lists.choose_slide_summation(model, slide)
    return Numerics("bench", steps, model.slide.cycles, 1, SpaceSettings(choice=choice))


def find_method(model) -> str:
    """Return the method that computes the friction force of a bench."""
    if law_has_trait(model.friction.law, "memoryless") and not model.partial_slip:
        return CLOSED_FORM
    if uses_parallel_elements(model):
        return PARALLEL_ELEMENTS
    if not bond_lists.sums_over_lists(model):
        return CONTACT_POINTS
    return f"{BOND_LIST}s" if model.partial_slip or model.side == "lower" else BOND_LIST


def name_engine(model, choice) -> str:
    """Return the name of the engine in summaries and plans, with the EngineChoice of its bond list or None."""
    method = find_method(model)
    return f"bench, {method}" if choice is None else f"bench, {choice.engine} {method}"


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
    # Largest number of steps per cycle over grooves.
    return max(steps, min(4 * ceil(N_GROOVE_SAMPLES_PER_RADIAN * phase / 4), 200_000))


def has_changing_pressure(model) -> bool:
    """Return whether the pressure at a point of the upper piece changes during the motion.

    It changes if the load varies, or if the pressure distribution is fixed to the lower piece.
    """
    return model.load_varies or model.side == "lower"


def uses_parallel_elements(model) -> bool:
    """Return whether parallel elements compute a bench run, which they do exactly at a constant load."""
    is_constant = model.grooves is None and not has_changing_pressure(model)
    is_known = law_supports(model.friction, "shear") or not model.partial_slip
    return is_constant and is_known and law_supports(model.friction, "pieces")


def sample_path(
    model, steps: int, path: "model_slide.SlideSamples | None" = None
) -> "model_slide.SlideSamples":
    """Return the samples of a path, to which a varying load adds some, because it bends the force between them.

    Parameters
    ----------
    model : Model
        Model of a bench.
    steps : int
        Steps per cycle.
    path : SlideSamples, optional
        Path in place of that of the model.
    """
    time, slide, first, omega = path or model.slide.samples(steps)
    if model.load_varies:
        start = time[first]
        time, slide = model.point.refine_samples(model.slide, time, slide, steps)
        first = int(np.searchsorted(time, start))
    return model_slide.SlideSamples(time, slide, first, omega)


class BenchSizes(NamedTuple):
    """Sizes of a bench run.

    - engine: name of the engine.
    - unknowns: {"bond_list_about": expected number of strips of a list of bonds}, or {} without a list.
    - samples: number of samples that the run and its comparison runs keep.
    """

    engine: str
    unknowns: dict[str, int]
    samples: int


@lru_cache(8)
def count_bench_sizes(model) -> BenchSizes:
    """Count the unknowns and the samples of a bench run."""
    steps = steps_per_cycle(model)
    choice = make_bench_numerics(model, steps).space.choice
    unknowns = {}
    if choice is not None and choice.strips:
        unknowns["bond_list_about"] = int(choice.strips)
    n_samples = sample_path(model, steps).time.size
    return BenchSizes(name_engine(model, choice), unknowns, n_samples)


def compute_dimensionless_groups(model) -> dict[str, float]:
    """Return the ratio of the displacement amplitude to the bond length as a dict, if both exist."""
    length = model.friction.bond_length
    return {"amplitude_over_bond_length": model.slide.amplitude / length} if length else {}
