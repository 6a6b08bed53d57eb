"""Which engine a scene gets, and why not another: methods that it names, closed forms that exist, least steps."""

from math import ceil, sqrt

from ..core import PatchfemError
from ..effects import LAWS, has, listed
from .interfaces import acts, yaws

COMPARED = ("duhamel", "newmark", "euler")


def engine_of(scene, drive, side: str) -> str:
    """"exact" where a closed form exists, else "march", or the method that the scene names."""
    method, f, contact = scene.accuracy.method, scene.friction, scene.contact
    shear = contact.gives_way if contact is not None else ""
    if method in COMPARED:
        if shear:
            raise PatchfemError(f"{scene.where('accuracy.method')}: '{method}' takes an interface as a whole, not "
                                f"{shear}; use method = \"march\"")
        return method
    if method == "harmonic":
        return method
    why = no_closed_form(scene, drive, shear)
    if method == "exact" and why:
        raise PatchfemError(f"{scene.where('accuracy.method')}: no exact solution exists {why}; use method = \"march\"")
    if not why and method != "march":
        return "exact"
    if f is not None:
        _refuse(scene, shear, side)
    if side == "lower" and scene.accuracy.quadrature not in ("auto", "recursion"):
        raise PatchfemError(f"{scene.path}: accuracy.quadrature: '{scene.accuracy.quadrature}' with pressure on the "
                            "lower piece in the rig: not yet built; use \"recursion\" or the upper piece")
    return "march"


def no_closed_form(scene, drive, shear: str) -> str:
    """Why a run has no exact solution; empty where it has one."""
    f, structure = scene.friction, scene.structure
    laws = [one.law for one in structure.interface] or ([f.law] if f is not None else [])
    if odd := [law for law in laws if "exact" not in LAWS[law].carries.split()]:
        return f"for law '{odd[0]}'{f' with {shear}' if shear else ''}"
    if shear and laws:
        return f"with {shear}"
    if acts(scene):
        return "under a load that changes"
    if yaws(scene) and scene.drive.waveform == "levels":
        return "with strips that yaw, level by level"
    if not drive.segments:
        return f"under a drive of waveform '{scene.drive.waveform}'"
    if structure.stiffening is not None:
        return "with [structure.stiffening]"
    if structure.bonded is not None and structure.bonded.wavelength is not None:
        return "with structure.bonded.wavelength"
    return ""


def set_valued(scene, settings) -> bool:
    """Whether a march meets Coulomb's law as it stands: without the give of pieces, skin or holder."""
    f, contact = scene.friction, scene.contact
    laws = [one.law for one in scene.structure.interface] or ([f.law] if f is not None else [])
    gives = contact is not None and bool(contact.gives_way or (contact.holder and contact.holder.tangential_stiffness))
    return settings.engine == "march" and not gives and any(has(law, "set-valued") for law in laws)


def unique_steps(scene, drive) -> int:
    """Least even number of steps per cycle at which a step of bonds that weaken with speed has one solution alone:
    dt^2 k_t (eps_0/eps_k - 1)/(2 M) < 1, k_t = mu_s N/eps_0, M the mass that the interface moves; 0 for other laws."""
    f = scene.friction
    if f is None or not has(f.law, "bonds") or f.slip_growth is None or not f.kinetic or f.kinetic >= f.static:
        return 0
    from .pieces import nominal_load
    from .structure import modes_of

    modes = modes_of(scene)
    stiff = f.static * nominal_load(scene) / f.bond_length * (f.static / f.kinetic - 1)
    return 2 * ceil(0.55 * drive.period * sqrt(stiff * float((modes.slide**2).sum()) / (2 * modes.mass)))


def _refuse(scene, shear: str, side: str) -> None:
    f = scene.friction
    recursion = has(f.law, "bonds") and not listed(f)
    if side == "lower" and (shear or not recursion):
        what = shear if shear else f"law '{f.law}' other than the stretch reading with order = 1"
        raise PatchfemError(f"{scene.path}: pressure on the lower piece with {what} in the rig: not yet built; "
                            "put the shapes on the upper piece")
    if shear and listed(f):
        raise PatchfemError(f"{scene.path}: {shear} with order = {f.order:g}: not yet built; use order = 1")
