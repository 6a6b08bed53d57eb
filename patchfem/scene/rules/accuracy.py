"""Rules of [accuracy]: an engine of the sum over bonds must be able to sum the law of the run."""

from ...effects import has
from .draft import Draft
from .limits import NOT_YET_BUILT


def _quadrature(draft: Draft, kind: str) -> None:
    """An engine of the sum over bonds must be able to sum the law, and the run must have such a sum."""
    accuracy, law, contact = draft.tables.accuracy, draft.tables.friction, draft.tables.contact
    engine = accuracy and accuracy.quadrature
    if engine in (None, "auto") or f"accuracy.quadrature={engine}" in NOT_YET_BUILT:
        return
    if law is None or not has(law.law, "bonds") or kind not in ("bench", "rig"):
        draft.remark(f"accuracy.quadrature = '{engine}' has no meaning without law 'nonlocal' and is not used")
        return
    alone = law.reading == "stretch" and law.order == 1
    key, shear = "accuracy.quadrature", contact.gives_way if contact is not None else ""
    if engine == "recursion" and not alone:
        draft.say(key, "'recursion' sums reading 'stretch' with order = 1 alone; use 'auto' or 'merged'")
    elif engine != "recursion" and shear:
        draft.say(key, f"'{engine}' beside {shear}: every point has its own path there; use 'recursion' or 'auto'")
