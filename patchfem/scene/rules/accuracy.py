"""Rules of [accuracy]: methods, what each of them can do, and the keys that a method does not use."""

from ...effects import WAVEFORMS, carries, has, waves
from .draft import Draft
from .limits import NOT_YET_BUILT


def _method(draft: Draft, kind: str) -> None:
    accuracy, law, contact = draft.tables.accuracy, draft.tables.friction, draft.tables.contact
    method = accuracy and accuracy.method
    if method in method_unused(kind):
        draft.remark(f"accuracy.method = '{method}' has no meaning in a {kind} scene and is not used")
    if method == "harmonic" and kind in ("rig", "linear"):
        _harmonic(draft)
    if method != "exact" or kind != "rig" or law is None or law.law is None:
        return
    shear = contact.gives_way if contact is not None else ""
    if not carries(law, "exact") or shear:
        beside = f" beside {shear}" if shear else ""
        draft.say("accuracy.method", f"no exact solution exists for law '{law.law}'{beside}; use 'march' or leave "
                                     "method out")  # fmt: skip


def _harmonic(draft: Draft) -> None:
    """A steady motion needs a drive that repeats, and one way to find it for every force in the scene."""
    drive, structure, law = draft.tables.drive, draft.tables.structure, draft.tables.friction
    once = drive is not None and drive.waveform in WAVEFORMS and not waves(drive.waveform, "steady")
    if drive is not None and (drive.kind == "free" or once):
        draft.say("accuracy.method", "'harmonic' finds the steady motion under a sine, or its curve over a sweep or "
                                     "over levels; use 'march' or leave method out")  # fmt: skip
    elif drive is not None and drive.kind == "base" and drive.waveform == "sweep" and drive.displacement is not None:
        draft.say("accuracy.method", "'harmonic' keeps the acceleration over a sweep; give drive.acceleration")
    if structure is None:
        return
    bends = "[structure.stiffening]" if structure.stiffening is not None else ""
    if structure.bonded is not None and structure.bonded.wavelength is not None:
        bends = "structure.bonded.wavelength"
    laws = [one.law for one in (law, *structure.interface) if one is not None]
    if bends and any(has(one, "set-valued") for one in laws):
        draft.say("accuracy.method", f"'harmonic' with a law that jumps beside {bends}: use 'march', or law "
                                     "'elastic-plastic' with a short bond_length; not yet built")  # fmt: skip


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


def method_unused(kind: str) -> tuple[str, ...]:
    """Methods that a kind of run gives no meaning: without a time integration there is nothing to choose."""
    return ("exact", "march") if kind in ("patch", "bench") else ()
