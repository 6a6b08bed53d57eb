"""Plan of a sweep: that of its first case, with the number of cases and of the values of each key."""

from ...core import PatchfemError
from ...runs.plan import SKIPPING_NOTE, plan
from .case_models import SweepScene
from .cases import Cases

MAX_PLANNED_CASES = 9  # cases that are tried until one can be planned


def plan_sweep(sweep_scene: SweepScene, cases: Cases) -> dict:
    """Return the plan of the first case that can be planned, as `Plan.as_json` does.

    In addition it has the keys and values of this `case`, the number of `cases`, and the number of
    distinct `values` by key.

    Raises
    ------
    PatchfemError
        If none of the cases that are tried can run.
    """
    first_error = None
    for number in cases.representative_case_numbers(MAX_PLANNED_CASES):
        try:
            content = plan(sweep_scene.build_model(cases.assignments(number))).as_json()
        except PatchfemError as error:
            first_error = first_error or error
            continue
        verdict = [text for text in content["verdict"] if text != SKIPPING_NOTE]
        return content | {
            "verdict": verdict,
            "case": {axis.key: text for axis, text in zip(cases.axes, cases.texts(number))},
            "cases": len(cases),
            "values": {axis.key: len(set(axis.values)) for axis in cases.axes},
        }
    raise first_error
