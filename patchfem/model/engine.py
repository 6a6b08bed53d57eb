"""Which engine a scene gets, and why not another: methods that it names, closed forms that exist, least steps."""

from math import ceil, sqrt

from ..core import PatchfemError
from ..effects import LAWS, has, listed
from .model import Model

COMPARED = ("duhamel", "newmark", "euler")


def engine_of(model: Model) -> str:
    """"exact" where a closed form exists, else "march", or the method that the scene names."""
    method, soft = model.accuracy.method, model.soft
    if method in COMPARED:
        if soft:
            raise PatchfemError(f"'{method}' takes an interface as a whole, not {soft}; use method = \"march\"",
                                "accuracy.method")
        return method
    if method == "harmonic":
        return method
    why = no_closed_form(model)
    if method == "exact" and why:
        raise PatchfemError(f"no exact solution exists {why}; use method = \"march\"", "accuracy.method")
    if not why and method != "march":
        return "exact"
    if model.friction is not None:
        _refuse(model)
    if model.side == "lower" and model.accuracy.quadrature not in ("auto", "recursion"):
        raise PatchfemError(f"accuracy.quadrature: '{model.accuracy.quadrature}' with pressure on the lower piece in "
                            "the rig: not yet built; use \"recursion\" or the upper piece", "")
    return "march"


def no_closed_form(model: Model, steady: bool = False) -> str:
    """Why a run has no exact solution; empty where it has one. steady: under the sine of a curve, not the drive's own
    waveform."""
    rig, soft = model.rig, model.soft
    laws = [one.numbers.law for one in rig.interfaces]
    if odd := [law for law in laws if "exact" not in LAWS[law].carries.split()]:
        return f"for law '{odd[0]}'{f' with {soft}' if soft else ''}"
    if soft and laws:
        return f"with {soft}"
    if rig.load_varies:
        return "under a load that changes"
    if rig.strips_slide_apart and rig.waveform == "levels":
        return "with strips that yaw, level by level"
    if not steady and not rig.drive.segments:
        return f"under a drive of waveform '{rig.waveform}'"
    if rig.cubic is not None:
        return "with [structure.stiffening]"
    if rig.interlock is not None:
        return "with structure.bonded.wavelength"
    return ""


def set_valued(model: Model, numerics) -> bool:
    """Whether a march meets Coulomb's law as it stands: without the give of pieces, skin or holder."""
    laws, patch = [one.numbers.law for one in model.rig.interfaces], model.patch
    gives = patch is not None and bool(patch.gives_way or patch.slide_spring)
    return numerics.engine == "march" and not gives and any(has(law, "set-valued") for law in laws)


def unique_steps(model: Model) -> int:
    """Least even number of steps per cycle at which a step of bonds that weaken with speed has one solution alone:
    dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1, k_t = mu_s N/eps_0, M the mass that the interface moves; 0 for other laws."""
    f, modes = model.friction, model.rig.modes
    if f is None or not has(f.law, "bonds") or f.slip_growth is None or not f.kinetic or f.kinetic >= f.static:
        return 0
    load = model.nominal_load
    stiff = f.static * load / f.bond_length * (f.static / f.kinetic - 1)
    return 2 * ceil(0.55 * model.rig.drive.period * sqrt(stiff * float((modes.slide**2).sum()) / (2 * modes.mass)))


def _refuse(model: Model) -> None:
    f, soft, lower = model.friction, model.soft, model.side == "lower"
    recursion = has(f.law, "bonds") and not listed(f)
    if lower and (soft or not recursion):
        what = soft if soft else f"law '{f.law}' other than the stretch reading with order = 1"
        raise PatchfemError(f"pressure on the lower piece with {what} in the rig: not yet built; put the shapes on the "
                            "upper piece", "")
    if soft and listed(f):
        raise PatchfemError(f"{soft} with order = {f.order:g}: not yet built; use order = 1", "")
