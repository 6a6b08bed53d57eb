"""What the static model of a patch leaves out, said beside its numbers: plane state, lever arms, couplings, holds."""

import numpy as np

from ...core import Outcome, say
from ...mesh.nested import plan_of
from .kept import band

COUPLED = 0.02  # of the tangential compliance; the closing by shear is said from there on
BENT = 0.02  # of the load under which a tall piece buckles; as much is missing from its sideways motion
WHOLE = 1 - 1e-6  # share of a far face that counts as all of it: printed digits of a mesh file


def left_out(model, patch, coarse) -> list:
    """Notes on a pressed patch that hold whatever then moves it.

    coarse: the patches of the error estimate, None for those that were not wanted; without the first no plane band is
    computed.
    """
    asked = model.patch
    out = [*drawn_otherwise(patch.pair), *slender(asked, patch.pressure.load / patch.pieces.interface.weight.sum())]
    if patch.sharper and patch.averaging is not None:
        out.append(f"static measures come from points {say(patch.averaging, 3)} apart, whose short waves are those of "
                   "layers without ends, where these have the smaller errors; the mesh of "
                   f"{patch.x.size} interface points serves fields and motion")
    elif patch.sharper:
        out.append("static measures come from Gauss-Lobatto cells of order 4 where these have the smaller errors; the "
                   f"bilinear mesh of {patch.x.size} interface points serves fields and motion")
    elif patch.averaging is not None and not asked.gap.rough:
        out.append(f"the profile is averaged over {say(patch.averaging, 3)} where it bears; what another length "
                   "changes stands in the errors")
    if patch.strips is not None:
        out.append(patch.strips.note)
    if patch.pair.coupling > COUPLED and model.kind != "patch":
        out.append("the pieces are unlike: the coupling between shear and normal closing is left out; it is "
                   f"{patch.pair.coupling:.2g} of the tangential compliance")
    if model.kind == "patch":
        out += frictionless(asked, patch)
    if coarse[0] is not None and patch.pressure.outcome is not Outcome.NO_CONTACT:
        # a mesh of any cells has no coarser one: its second patch is finer than its first
        out += band(asked, patch if coarse[-1] is None else coarse[0])
    return out


def frictionless(asked, patch) -> list:
    """A note on pieces that are unlike: Dundurs' beta of their faces, and what perfect stick would change.

    Unlike faces slide on each other as they are pressed. Stick holds shear stresses against that, which stiffen the
    contact.
    """
    pair, held = patch.pair, np.flatnonzero(patch.active)
    if not pair.closing.any() or not held.size:
        return []
    here, one = np.ix_(held, held), np.ones(held.size)
    normal, cross = patch.pieces.normal[here], pair.closing[here]
    stuck = normal - cross @ np.linalg.solve(patch.pieces.tangential[here], cross.T)
    more = one @ np.linalg.solve(stuck, one) / (one @ np.linalg.solve(normal, one)) - 1
    beta = abs(_dundurs(asked))
    return [f"the pieces are unlike (Dundurs' beta {beta:.2g} at the interface) and the pressure is that of a "
            "frictionless contact, whose faces slide on each other as they are pressed; perfect stick would raise "
            f"normal_stiffness by {100 * more:.2g} %, friction by less"]


def _dundurs(asked) -> float:
    """Dundurs' beta of the two faces."""
    shear, kappa = [], []
    for piece in (asked.lower, asked.upper):
        face = piece.coating.material if piece.coating else piece.substrate
        shear.append(face.young / (2 + 2 * face.poisson))
        kappa.append(3 - 4 * face.poisson if asked.plane == "strain" else (3 - face.poisson) / (1 + face.poisson))
    (a, b), (k, q) = shear, kappa
    return (a * (q - 1) - b * (k - 1)) / (a * (q + 1) + b * (k + 1))


def drawn_otherwise(pair) -> list:
    """Notes for each piece whose far face the mesh file holds in part, or that has holes inside."""
    out = []
    for side, body in (("lower", pair.grid), ("upper", pair.upper_grid)):
        if plan_of(body) is not None:  # whole, and all of its last row is held
            continue
        from ...mesh.recognise import held_share, holes

        count, area = holes(body)
        if count:
            out.append(f"contact.mesh: the {side} piece has {count} hole{'s' * (count > 1)} inside, {area:.3g} m2 in "
                       "all; draw the cells that are missing if none was meant")
        held, whole = held_share(body)
        if held < WHOLE * whole:
            out.append(f"contact.mesh: {side}_far holds {held:.6g} m of a face of {whole:.6g} m, {held / whole:.3g} of "
                       "its length; the rest of it is free")
    return out


def slender(asked, mean: float) -> list:
    """A note for each piece so tall that its bending moves the load sideways: the lever arm that grows with it is left
    out.

    The measure is the load over that under which the piece buckles, clamped at the holder and free at the patch (Euler,
    pi^2 E' L^2/48 H^2 as a mean pressure); what the motion lacks is about that share. A piece no taller than long bends
    too little. mean [Pa]: pressure over the whole interface.
    """
    out = []
    for side in ("lower", "upper"):
        piece = getattr(asked, side)
        young, nu = piece.substrate.young, piece.substrate.poisson
        stiff = young / (1 - nu**2) if asked.plane == "strain" else young
        share = mean / (np.pi**2 * stiff * asked.length**2 / (48 * piece.height**2))
        if piece.height > asked.length and share > BENT:
            out.append(f"the {side} piece is {piece.height / asked.length:.3g} times as tall as long and bears "
                       f"{share:.2g} of the load under which it buckles sideways (limit {BENT:g}); the lever arm that "
                       "grows as it bends is left out")
    return out
