"""Probe of a plan: one run without error estimates, with its measured time.

In: a Plan. Out: a `MeasuredPlan`, whose sentences say how the time grows with each setting.
"""

from dataclasses import replace
from typing import Any, NamedTuple

from ..core import remove_interface_number
from .patch import area
from .plan import Plan
from .results.patch_rows import PATCH_TABLE
from .run import run

# Ratio of the times of the contact on twice as many cells along a face and on the cells themselves (measured: 4 to 6).
DOUBLED_CELLS_TIME_RATIO = 5
# Ratio of the times of the contact on a mesh with half the element size and on the mesh itself (measured: 3.2 to 5.8).
HALF_ELEMENT_SIZE_TIME_RATIO = 5


class MeasuredPlan(NamedTuple):
    """Measured time of a run without error estimates.

    - seconds: CPU seconds by stage, and "total".
    - static: static measures of the patches by name; {} without a patch.
    - sentences: the time, and what each setting multiplies.
    """

    seconds: dict[str, float]
    static: dict[str, float]
    sentences: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the static measures with the times and sentences, as `plan --probe --json` prints them."""
        return self.static | {"seconds": self.seconds, "sentences": list(self.sentences)}


def run_probe(plan: Plan) -> MeasuredPlan:
    """Run a plan once without error estimates and measure the time of its stages.

    Of a scene with [sweep] it is the plan and the time of the first case.

    Raises
    ------
    PatchfemError
        If the scene cannot be run.
    """
    result = run(replace(plan, n_cases=1), estimate=False)
    seconds = {name: round(float(value), 3) for name, value in result.seconds.items()}
    motion = seconds.get("march", seconds.get("bench", 0.0))
    stages = [f"{motion:.2g} s of it for the motion"] * bool(motion)
    if contact := seconds.get("contact"):
        stages.append(f"{contact:.2g} s for the contact")

    # The points of a response curve are no stage of their own; the stages are those of its peak.
    total = seconds["total"]
    curve = 2 * total - sum(seconds.values())
    if plan.engine == "harmonic" and curve > total / 2:
        motion = 0.0
        stages = [f"{curve:.2g} s of it for the response curve"]
    sentences = [", ".join([f"a run without error estimates took {total:.2g} CPU s", *stages])]
    sentences += area.describe_plane_strain(plan.model.patch)
    sentences += _describe_factors(plan, has_motion=bool(motion), has_contact=bool(contact))
    static = {}
    for name, measure in result.measures.items():
        row = PATCH_TABLE.get(remove_interface_number(name))
        if row is not None and row.group == "patch":
            static[name] = measure.value
    return MeasuredPlan(seconds, static, tuple(sentences))


def _describe_factors(plan: Plan, *, has_motion: bool, has_contact: bool) -> list[str]:
    """Describe what each setting multiplies, in clauses.

    An example is "twice drive.cycles takes up to twice the time of the motion". `has_motion` and `has_contact` tell
    whether motion and contact took measurable time.
    """
    factors = []
    if has_motion:
        key = "drive.cycles" if plan.model.slide is None else "slide.cycles"
        factors.append(f"twice {key} takes up to twice the time of the motion")
        if plan.engine == "march" or plan.model.slide is not None:
            factors.append("twice accuracy.steps_per_cycle takes twice the time of the motion")
    if has_contact:
        key = f"half contact.element_size takes about {HALF_ELEMENT_SIZE_TIME_RATIO}"
        if plan.model.area is not None:
            key = f"twice contact.area.cells takes about {DOUBLED_CELLS_TIME_RATIO}"
        factors.append(f"{key} times the time of the contact")
    if plan.model.wear is not None:
        factors.append("each jump over cycles of wear solves the contact about 20 times")
    return factors
