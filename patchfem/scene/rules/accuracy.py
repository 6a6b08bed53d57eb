"""Rules of [accuracy]: an engine of the sum over bonds must be able to sum the law of the run, a knob must act."""

from ...effects import LAWS, has, listed
from .methods import Motion, motion
from .scene_draft import KNOBS, Draft, acts, pinned


def _quadrature(draft: Draft, kind: str) -> None:
    """An engine of the sum over bonds must be able to sum the law, and the run must have such a sum."""
    accuracy, law, contact = draft.tables.accuracy, draft.tables.friction, draft.tables.contact
    engine = accuracy and accuracy.quadrature
    if engine in (None, "auto"):
        return
    if law is None or not has(law.law, "bonds") or kind not in ("bench", "rig"):
        draft.remark(
            f"accuracy.quadrature = '{engine}' has no meaning without law 'nonlocal' and is not used"
        )
        return
    alone = law.reading == "stretch" and law.order == 1
    key, shear = "accuracy.quadrature", contact.gives_way if contact is not None else ""
    if engine == "recursion" and not alone:
        draft.say(
            key,
            "'recursion' can be used only with reading = 'stretch' and order = 1; use 'auto' or 'merged'",
        )
    elif engine != "recursion" and shear and alone:
        draft.say(
            key,
            f"'{engine}' cannot be used with {shear}, because each point of the interface then slips "
            "differently; use 'recursion' or 'auto'",
        )


def _knobs(draft: Draft, kind: str) -> None:
    """Remarks on the knobs that are named and change nothing in this scene."""
    if not kind or draft.tables.accuracy is None or not pinned(draft.tables.accuracy):
        return
    for knob, where in knobs_unused(draft.tables, kind).items():
        draft.remark(f"accuracy.{knob} is not used, because it has no effect {where}")


def knobs_unused(tables, kind: str) -> dict[str, str]:
    """The knobs of [accuracy] that are named and act on nothing in a kind of run, with where that is so, in words."""
    accuracy, out = tables.accuracy, {}
    method = "bench" if kind == "bench" else accuracy.method or "auto"
    for knob in pinned(accuracy):
        if kind not in KNOBS[knob].kinds.split():
            out[knob] = f"in a {kind} scene"
        elif not acts(knob, kind, method):
            out[knob] = f"for method '{method}'" if kind != "bench" else "in a bench scene"
        elif reason := _beside_laws(
            knob, accuracy, motion(tables, "rig" if kind == "bench" else kind)
        ):
            out[knob] = reason
    return out


def _beside_laws(knob: str, accuracy, found: Motion) -> str:
    """Why a knob acts on none of the laws of a run, or on nothing that gives way; "" where it does."""
    trait = KNOBS[knob].law
    if trait and not any(has(one.law, trait) for one in found.laws):
        return f"without law '{next(name for name in LAWS if has(name, trait))}'"
    if knob in ("tail", "merge"):
        engine = accuracy.quadrature
        if engine in ("direct", "recursion") or (engine, knob) == ("truncated", "merge"):
            return f"for quadrature '{engine}'"
        return (
            ""
            if engine != "auto" or any(map(listed, found.laws))
            else "for a law that is summed by recursion"
        )
    if knob == "shear_modes":
        if not found.soft:
            return "for pieces that are rigid in shear"
        changes = (
            found.varies
            or found.spring.endswith("grooves]")
            or any(has(one.law, "bonds") for one in found.laws)
        )
        return (
            ""
            if changes
            else (
                f"for law '{found.laws[0].law}' under a constant load (this case is solved exactly "
                "without the key)"
            )
        )
    return ""
