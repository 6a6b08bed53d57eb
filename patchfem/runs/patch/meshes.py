"""SharedMeshes that all cases of a sweep share: fine wherever the pressure of one of them ends.

A mesh of a case is graded to its own contact. That of a family has at every place the cells of the case that wants the
shortest there, and its ladder of nested meshes is climbed until the hardest case meets the tolerance. Pieces that pin
their elements, or come from a file, have the same meshes in every case anyway.
"""

from dataclasses import replace
from hashlib import sha256
from itertools import pairwise

import numpy as np

from ...core import PatchfemError
from ...mesh.grading import Layout
from ...mesh.tensor import TensorGrid
from ...model.patch import SharedMeshes
from . import grids, ladder
from .condensed import condensed, keep_pairs
from .measures import measures, missed
from .press import pressed
from .static import missed_on, patches_on

MAX_CASES = 48  # cases that a mesh is chosen by; of more, those that lie farthest apart are taken
CLIMBED_CASES = 5  # so many of them climb their own ladders where a patch slips part by part
# each search for the contacts has columns that are graded to what the one before found
MAX_SEARCHES = 4
MAX_NODES = 400  # nodes of the finest interface; a finer mesh would slow every case down
MAX_ORDER = 3.0  # order by which errors of static measures fall at most: meshes too coarse by it are not tried
# The cells of the coarsest mesh are so many times those that a case asks for. The longest are tried first, because
# their meshes take least time; those that are too long by what the last try says are passed over.
CELL_FACTORS = (4.0, 2.8, 2.0, 1.5, 1.0)
MAX_CELL_RATIO = 2.0  # ratio of the cells of neighbouring cases up to which one band holds what lies between them


def geometry_of(asked) -> tuple:
    """What the meshes and the pieces of a `PatchModel` depend on beside its load and shapes; equal for patches that may
    share them."""
    mesh = asked.mesh
    gap = asked.gap
    file = mesh.file
    changed = file.stat().st_mtime_ns if file is not None and file.exists() else 0
    return (
        asked.pieces,
        mesh.element_size,
        mesh.is_static,
        mesh.edge_motion,
        file,
        changed,
        mesh.tolerance,
        gap.jumps,
        gap.profile,
        gap.average,
    )


def shared_meshes(patches, tolerance: float, all_: bool = True) -> SharedMeshes | None:
    """Meshes for `PatchModel`s of one geometry, whatever their order; None where no case can be pressed.

    tolerance: relative error of the static measures that all of them are to meet; all_: there are no other cases that
    the meshes have to serve.
    """
    asked = patches[0]
    if not asked.mesh.is_automatic:
        return with_digest(ladder.meshes_of_file(asked))
    cases, every = farthest_apart(patches)
    swept = [
        one.with_loading(load=share * one.loading.load)
        for one in cases
        if one.mesh.edge_motion == "load" and one.loading.load is not None
        for share in grids.SWING
    ]
    slips = any(one.interface.partial_slip for one in patches)
    halvings = _halvings(cases, tolerance) if slips else {}
    common = min(halvings.values(), default=0)  # what all of them halve are levels of the ladder
    layout = _layout(
        [*cases, *swept], not (every and all_), {key: one - common for key, one in halvings.items()}
    )
    # a contact that moves on the way, or slips part by part, has measures that its first state tells nothing of
    shares, own = CELL_FACTORS[-1:] if asked.mesh.edge_motion or slips else CELL_FACTORS, None
    if layout is None:
        return None
    while True:
        share, shares = shares[0], shares[1:]
        bodies = grids.grids_of(asked, layout.scale_cells(share))
        if shares:
            own = own or grids.grids_of(asked, layout)
            if bodies[0].x.size >= own[0].x.size:  # both have the most columns
                continue
        pairs, missed_by = _climbed(
            cases, bodies, tolerance, bool(shares), grids.MIN_LEVELS + common
        )
        if missed_by <= 1 or not shares:
            found = with_digest(
                [(one.grid, None if one.upper is one.piece else one.upper_grid) for one in pairs]
            )
            keep_pairs(cases[0], found, pairs)
            return found
        # times the cells, above which no mesh meets it
        enough = share * missed_by ** (-1 / MAX_ORDER)
        shares = tuple(one for one in shares if one <= max(enough, CELL_FACTORS[-1]))


def with_digest(levels) -> SharedMeshes:
    """Meshes with the hash of their content."""
    digest = sha256()
    for body in (body for level in levels for body in level):
        arrays = (
            ()
            if body is None
            else (body.x, body.depth)
            if isinstance(body, TensorGrid)
            else (
                body.points,
                body.triangles,
                body.quads,
                body.is_coating,
                body.interface,
                body.far,
            )
        )
        for array in arrays:
            digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
        digest.update(repr(getattr(body, "coating_rows", None)).encode())
    return SharedMeshes(tuple(levels), digest.hexdigest()[:32])


def farthest_apart(patches, most: int = MAX_CASES) -> tuple:
    """(the patches that lie farthest apart in what presses and shapes them, `most` at most, whatever their order;
    whether these are all)."""
    rows = {_numbers(one): one for one in patches}
    keys = sorted(rows)
    if len(keys) <= most:
        return [rows[key] for key in keys], True
    sizes = np.array(keys)
    scale = np.abs(sizes).min(axis=0, where=sizes != 0, initial=np.inf)
    at = np.arcsinh(np.divide(sizes, scale, out=np.zeros_like(sizes), where=np.isfinite(scale)))
    at = at / np.maximum(np.ptp(at, axis=0), 1e-300)
    picked = [int(np.argmin(at.sum(axis=1)))]
    apart = np.full(len(keys), np.inf)
    while len(picked) < most:
        apart = np.minimum(apart, np.abs(at - at[picked[-1]]).max(axis=1))
        picked.append(int(np.argmax(apart)))
    return [rows[keys[k]] for k in sorted(picked)], False


def _numbers(asked) -> tuple:
    """What tells the contacts of two patches of one geometry apart, as numbers."""
    shapes = [
        float(value)
        for _, part in asked.gap.shapes
        for _, value in part
        if isinstance(value, (int, float))
    ]
    skin = [
        float(value or 0.0)
        for _, value in asked.interface.skin or ()
        if isinstance(value, (int, float)) or value is None
    ]
    own = (
        asked.loading.load,
        asked.loading.approach,
        asked.loading.offset,
        asked.loading.line_moment,
        asked.loading.can_rotate,
        asked.loading.rotational_stiffness,
        *(asked.mesh.slip or ()),
        *(asked.interface.strips or ()),
    )
    return (*(float(value or 0.0) for value in own), *shapes, *skin)


def _halvings(cases: list, tolerance: float) -> dict:
    """Return how often the run of a case by itself halves its cells beyond the fewest levels, by `_numbers`.

    CLIMBED_CASES cases are tried.
    """
    out = {}
    for one in farthest_apart(cases, CLIMBED_CASES)[0]:
        try:
            out[_numbers(one)] = (
                len(ladder.climb(one, one.mesh.tolerance or tolerance)) - grids.MIN_LEVELS
            )
        except PatchfemError:  # its own run says why
            continue
    return out


def _layout(cases: list, between: bool, halvings: dict) -> Layout | None:
    """The layout of the coarsest grids, that no case wants finer; None where no case can be pressed.

    between: there are more cases than these, and their contacts end between those of neighbouring ones; halvings: as
    `_halvings`, beyond those of all of them; the cells of these cases are so much shorter from the first level on.
    """
    first, along = cases[0], grids.EDGE_CELLS[cases[0].mesh.is_static]
    layout = None
    for _ in range(MAX_SEARCHES):
        pair = (
            condensed(first, *grids.grids_of(first, layout)) if layout else grids.search_pair(first)
        )
        known = patches_on(cases, pair)
        seen = [
            (one, found)
            for one, patch in zip(cases, known)
            if (found := _loaded(one, pair, patch)) is not None
        ]
        if not seen:
            return None
        layout = _merged(
            [
                grids.layout_of(one, [found]).scale_cells(0.5 ** halvings.get(_numbers(one), 0))
                for one, found in seen
            ],
            between,
        )
        if max(found.cell / found.wide for _, found in seen) <= 1 / (along - 1):
            break
    return layout


def _loaded(asked, pair, patch):
    """The contact of a case, pressed with others as `patch` or by itself; None of one that cannot be pressed: its own
    run says why."""
    try:
        return grids.contact_extent(patch or pressed(asked, pair), asked.mesh.slip)
    except PatchfemError:
        return None


def _merged(layouts: list, between: bool) -> Layout:
    """The layout whose cells are nowhere longer than those of any of `layouts`."""
    bands = {band for one in layouts for band in (*one.bands, (*one.span, one.max_loaded_length))}
    if between:
        bands |= set(_filled(layouts))
    first, bands = layouts[0], sorted(bands, key=lambda band: (band[2], band))
    out = Layout(
        first.start,
        first.stop,
        (),
        (first.start, first.stop),
        *2 * [min(one.max_length for one in layouts)],
        min(one.slope for one in layouts),
    )
    low, high, _ = np.array(bands).T
    places = np.linspace(low, high, 5, axis=1)
    # of the bands that are kept: those that others make needless are many
    size, kept = (
        out.size(places),
        [],
    )
    for k, band in enumerate(bands):
        if (size[k] > band[2] * (1 + 1e-9)).any():
            kept.append(band)
            size = np.minimum(size, replace(out, bands=(band,)).cell_lengths(places))
    return replace(out, bands=tuple(kept))


def _filled(layouts: list) -> list:
    """Bands from each edge of a contact to that of the next case, with cells between those of both."""
    out, half = [], max(one.stop for one in layouts)
    for side in (-1, 1):
        ends = sorted(
            {
                (low, least)
                for one in layouts
                for low, high, least in one.bands
                if low == high and low * side >= 0 and abs(low) < half
            }
        )
        for (low, a), (high, b) in pairwise(ends):
            count = (
                1 if high == low else int(np.ceil(abs(np.log(a / b)) / np.log(MAX_CELL_RATIO))) or 1
            )
            places, sizes = np.linspace(low, high, count + 1), np.geomspace(a, b, count + 1)
            out += [
                (*map(float, stretch), float(max(pair)))
                for stretch, pair in zip(pairwise(places), pairwise(sizes), strict=True)
            ]
    return out


def _climbed(cases: list, bodies, tolerance: float, once: bool, least: int) -> tuple:
    """The pieces on nested meshes from the coarsest `bodies`, fine to coarse, up to one on which every case meets the
    tolerance, or the dearest that is worth it; and the largest error over the tolerance where a case misses it: of
    those that press together, where all these meet it of the first other one. once: no more than the `least` levels."""
    pairs, tolerance = [], cases[0].mesh.tolerance or tolerance
    while True:
        pairs.insert(0, condensed(cases[0], *bodies))
        bodies = [body.refine() for body in bodies]
        if len(pairs) < least:
            continue
        known = missed_on(cases, pairs, tolerance)
        missed_by = max((by for by in known if by is not None), default=0.0)
        if missed_by <= 1:
            missed_by = next(
                (
                    by
                    for one, seen in zip(cases, known)
                    if seen is None and (by := _missed(one, pairs, tolerance)) > 1
                ),
                missed_by,
            )
        dear = bodies[0].x.size > MAX_NODES or grids.seconds_of(bodies) > ladder.most_seconds(
            cases[0], tolerance
        )
        if missed_by <= 1 or once or dear:
            return pairs, missed_by


def _missed(asked, pairs: list, tolerance: float) -> float:
    """Largest error of a case on these pieces over the tolerance; 0 where it cannot be pressed at all."""
    try:
        return missed(measures(*ladder.on_pairs(asked, pairs), tolerance=tolerance), tolerance)
    except PatchfemError:
        return 0.0
