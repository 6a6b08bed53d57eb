"""Two pieces as any mesh of triangles and quads, and the checks that a tagged mesh must pass before it is used.

Both pieces are turned so that y is the depth below the interface; x is 0 in the middle of the interface.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..core import PatchfemError, frozen_array
from .grading import CLOSE, tributary_lengths

STEEP = 0.1  # slope of a rounded edge from which normal and vertical differ by half a percent
CELLS = ("upper_substrate", "upper_coating", "lower_substrate", "lower_coating")
EDGES = ("upper_interface", "lower_interface", "upper_far", "lower_far")


@dataclass(frozen=True, eq=False, slots=True)
class Tagged:
    """A tagged mesh as its file gives it.

    points: (N, 2 or 3) [m]; triangles: (t, 3), quads: (q, 4) node numbers; names: (t + q,) tag of every cell, triangles
    first; nodes: edge tag -> node numbers; how: how this format tags, for messages.
    """

    points: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray
    names: np.ndarray
    nodes: dict
    how: str


@dataclass(frozen=True, eq=False, slots=True)
class PieceMesh:
    """One piece as a mesh of triangles and quads.

    points: (N, 2) as x and depth >= 0 [m]; triangles: (t, 3), quads: (q, 4), counter-clockwise in them; is_coating: (t
    + q,), triangles first; interface: (m,) node numbers by rising x; far: (f,) node numbers.
    """

    points: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray
    is_coating: np.ndarray
    interface: np.ndarray
    far: np.ndarray

    @property
    def x(self) -> np.ndarray:
        """Places of the interface nodes (m,) [m], rising."""
        return self.points[self.interface, 0]

    @property
    def rise(self) -> np.ndarray:
        """Distance of the interface nodes from y = 0 (m,) [m], >= 0: what rounded edges add to the gap."""
        return self.points[self.interface, 1]

    @property
    def row(self) -> float:
        """Median height [m] of the cells along the interface: their area over the length of their edge there."""
        at = np.full(len(self.points), -2)
        at[self.interface] = np.arange(self.interface.size)
        found = []
        for cells, whole in ((self.triangles, 2.0), (self.quads, 1.0)):
            place = at[cells]
            for side in range(cells.shape[1]):
                here = np.abs(place[:, side] - np.roll(place, -1, axis=1)[:, side]) == 1
                here &= (place[:, side] >= 0) & (np.roll(place, -1, axis=1)[:, side] >= 0)
                ends = self.points[cells[here][:, [side, (side + 1) % cells.shape[1]]]]
                found.append(
                    whole
                    * _areas(self.points[cells[here]])
                    / np.hypot(*(ends[:, 1] - ends[:, 0]).T)
                )
        return float(np.median(np.concatenate(found)))

    @property
    def length(self) -> float:
        """Extent of the interface [m]."""
        return float(np.ptp(self.x))

    @property
    def height(self) -> float:
        """Greatest depth of the far face [m]."""
        return float(self.points[self.far, 1].max())

    @property
    def coating(self) -> float:
        """Mean thickness of the coating: its area over its extent along x [m], 0 without one."""
        if not self.is_coating.any():
            return 0.0
        count = len(self.triangles)
        cells = self.triangles[self.is_coating[:count]], self.quads[self.is_coating[count:]]
        x = self.points[np.concatenate([part.ravel() for part in cells]), 0]
        return float(self.areas()[self.is_coating].sum() / np.ptp(x))

    def areas(self) -> np.ndarray:
        """Areas of the cells (t + q,) [m2], > 0, triangles first."""
        return np.concatenate(
            [_areas(self.points[self.triangles]), _areas(self.points[self.quads])]
        )

    def tributary(self) -> np.ndarray:
        """Return the length of interface that belongs to each of its nodes (m,) [m]."""
        return tributary_lengths(self.x)


@dataclass(frozen=True, eq=False, slots=True)
class PairMesh:
    """Two pieces that share no node and whose interfaces have the same ends.

    Their interface nodes between the ends may differ.
    """

    lower: PieceMesh
    upper: PieceMesh

    @property
    def matching(self) -> bool:
        """Whether both pieces have their interface nodes at the same x, to 1e-9 of the length."""
        a, b = self.lower.x, self.upper.x
        return a.size == b.size and bool(np.abs(a - b).max() <= CLOSE * self.lower.length)


def pieces(raw: Tagged, where) -> PairMesh:
    """Both pieces of a tagged mesh; `where` begins every message.

    PatchfemError names missing and unknown tags, node numbers that do not exist, twisted or empty cells, nodes and
    cells that lie on one another, loose parts, an interface off y = 0 or with a hole, a far face inside its piece,
    interfaces with other ends.
    """
    _tags(raw, where)
    _numbers(raw, where)
    owned = {}
    for side in ("lower", "upper"):
        mine = (raw.names == f"{side}_substrate") | (raw.names == f"{side}_coating")
        count = len(raw.triangles)
        owned[side] = (
            mine,
            np.unique(
                np.concatenate(
                    [raw.triangles[mine[:count]].ravel(), raw.quads[mine[count:]].ravel()]
                )
            ),
        )
    shared = np.intersect1d(owned["lower"][1], owned["upper"][1]).size
    if shared:
        raise PatchfemError(
            f"{where}: the two pieces share {shared} nodes; each piece needs its own interface nodes"
        )
    lower, upper = (
        _piece(raw, "lower", *owned["lower"], where),
        _piece(raw, "upper", *owned["upper"], where),
    )
    apart = np.abs(lower.x[[0, -1]] - upper.x[[0, -1]]).max()
    if apart > CLOSE * lower.length:
        fault = f"lengths {lower.length:.9g} and {upper.length:.9g} m, with ends up to {apart:.6g} m apart"
        raise PatchfemError(
            f"{where}: lower_interface and upper_interface do not match ({fault}); let both interfaces "
            "begin and end at the same x (the nodes between may differ)"
        )
    return PairMesh(_centred(lower, lower.x), _centred(upper, lower.x))


def _tags(raw: Tagged, where) -> None:
    there = set(np.unique(raw.names).tolist())
    missing = {"upper_substrate", "lower_substrate"} - there | {
        e for e in EDGES if not len(raw.nodes.get(e, ()))
    }
    if missing:
        raise PatchfemError(
            f"{where}: no cells or nodes are tagged {', '.join(sorted(missing))} (tags of this format: "
            f"{raw.how})"
        )
    unknown = there - set(CELLS)
    if unknown:
        shown = ", ".join(sorted(name or "no tag" for name in unknown)[:4])
        raise PatchfemError(
            f"{where}: some cells have an unknown tag ({shown}); possible tags are {', '.join(CELLS)}"
        )


def _numbers(raw: Tagged, where) -> None:
    count = len(raw.points)
    for group in (raw.triangles, raw.quads, *(raw.nodes[e] for e in EDGES)):
        if group.size and (group.min() < 0 or group.max() >= count):
            wrong = group.min() if group.min() < 0 else group.max()
            raise PatchfemError(
                f"{where}: a cell names node {int(wrong)}, but the file has {count} nodes"
            )
    if not np.isfinite(raw.points).all():
        raise PatchfemError(f"{where}: a node has a coordinate that is not finite")
    used = np.unique(np.concatenate([raw.triangles.ravel(), raw.quads.ravel()]))
    span = np.ptp(raw.points[used], axis=0)
    if span.size > 2 and span[2] > CLOSE * span[:2].max():
        raise PatchfemError(
            f"{where}: the mesh is not plane: its z values span {span[2]:.6g} m; draw the mesh in x "
            "and y"
        )
    if not np.abs(raw.points[used, :2]).max() < 1e150:
        raise PatchfemError(f"{where}: a node lies beyond 1e150 m")


def _piece(raw: Tagged, side: str, mine, used, where) -> PieceMesh:
    count = len(raw.triangles)
    points = raw.points[used, :2] * [1.0, -1.0 if side == "lower" else 1.0]
    triangles = _upright(points, np.searchsorted(used, raw.triangles[mine[:count]]), where)
    quads = _upright(points, np.searchsorted(used, raw.quads[mine[count:]]), where)
    ends = {}
    for name in ("interface", "far"):
        nodes = np.unique(raw.nodes[f"{side}_{name}"])
        strange = int((~np.isin(nodes, used)).sum())
        if strange:
            raise PatchfemError(
                f"{where}: {side}_{name} contains {strange} nodes that belong to no cell of the {side} "
                "piece"
            )
        ends[name] = np.searchsorted(used, nodes)
    ends["interface"] = _interface(points, ends["interface"], side, where)
    if ends["far"].size < 2 or np.isin(ends["far"], ends["interface"]).any():
        raise PatchfemError(
            f"{where}: {side}_far must contain two nodes or more, none of them at the interface"
        )
    mesh = PieceMesh(
        points,
        triangles,
        quads,
        raw.names[mine] == f"{side}_coating",
        ends["interface"],
        ends["far"],
    )
    _joined(mesh, side, where)
    return mesh


def _areas(corner) -> np.ndarray:
    """Signed areas (cells,) of corners (cells, n, 2)."""
    following = np.roll(corner, -1, axis=1)
    own = corner[:, :1]  # from a corner of the cell, so that a far origin costs no digits
    a, b = corner - own, following - own
    return (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=1) / 2


def _upright(points, cells, where) -> np.ndarray:
    """The cells, counter-clockwise; PatchfemError for one that is twisted, not convex or has no area."""
    clockwise = _areas(points[cells]) < 0
    cells = np.where(clockwise[:, None], cells[:, ::-1], cells)
    side = np.roll(points[cells], -1, axis=1) - points[cells]
    following = np.roll(side, -1, axis=1)
    turns = side[..., 0] * following[..., 1] - side[..., 1] * following[..., 0]
    # area of a corner that is round-off
    wrong = ~(turns > 1e-10 * (side**2).sum(axis=2).max(axis=1)[:, None]).all(axis=1)
    if wrong.any():
        x, y = points[cells[np.argmax(wrong)]].mean(axis=0)
        raise PatchfemError(
            f"{where}: {wrong.sum()} cells are twisted or have no area, the first at "
            f"x = {x:.6g} m, {abs(y):.6g} m from the interface"
        )
    return cells


def _interface(points, nodes, side: str, where) -> np.ndarray:
    """The interface nodes by rising x.

    PatchfemError unless they lie on y = 0 or fall off it gently, stand apart, and nothing lies beyond y = 0.
    """
    name = f"{side}_interface"
    if nodes.size < 3:
        raise PatchfemError(
            f"{where}: {name} contains {nodes.size} nodes; three or more are needed"
        )
    nodes = nodes[np.argsort(points[nodes, 0], kind="stable")]
    x, y = points[nodes].T
    close = CLOSE * np.ptp(x)
    twin = int(np.argmin(np.diff(x)))
    if x[twin + 1] - x[twin] <= close and np.ptp(x) > 0:
        raise PatchfemError(
            f"{where}: {name} has two nodes at x = {x[twin]:.6g} m; merge these nodes"
        )
    flat = np.abs(y) <= close
    slope = np.diff(y) / np.maximum(np.diff(x), 1e-300)
    hollow = np.append(False, np.diff(slope) < -1e-6 - 4 * close / max(np.diff(x).min(), close))
    wrong = (np.abs(slope) > STEEP) | hollow
    if wrong.any() or not flat.any():
        off = int(np.argmax(np.abs(y))) if not flat.any() else int(np.argmax(wrong))
        if not flat.any() and not wrong.any():
            raise PatchfemError(
                f"{where}: no node of {name} lies on y = 0, where rounded faces touch; the nearest "
                f"node is {abs(y).min():.6g} m away"
            )
        raise PatchfemError(
            f"{where}: {name} is not the straight line y = 0 (rounded edges may reach a slope of "
            f"{STEEP:g}): the node at x = {x[off]:.6g} m lies {abs(y[off]):.6g} m away "
            "from this line; give the shape of a surface by [contact.crown] or [contact.tilt]"
        )
    if points[:, 1].min() < -close:
        raise PatchfemError(
            f"{where}: the {side} piece reaches {-points[:, 1].min():.6g} m across y = 0; the lower "
            "piece must lie at y <= 0, and the upper piece at y >= 0"
        )
    if flat.all():
        points[nodes, 1] = 0.0
    np.maximum(points[:, 1], 0.0, out=points[:, 1])
    return nodes


def _joined(mesh: PieceMesh, side: str, where) -> None:
    """Raise PatchfemError unless the cells meet edge to edge, in one part, and interface and far face run along their
    border."""
    ends, owner = cell_edges(mesh)
    count = len(mesh.points)
    near = cKDTree(mesh.points).query_pairs(CLOSE * mesh.length, output_type="ndarray")
    if len(near):
        x, y = mesh.points[near[0, 0]]
        raise PatchfemError(
            f"{where}: {len(near)} pairs of nodes of the {side} piece coincide, the first at x = "
            f"{x:.6g} m, {y:.6g} m from the interface; merge these nodes"
        )
    if np.unique(ends[:, 0] * count + ends[:, 1]).size < len(ends):
        raise PatchfemError(f"{where}: cells of the {side} piece overlap")
    key = ends.min(axis=1) * count + ends.max(axis=1)
    order = np.argsort(key, kind="stable")
    twice = np.flatnonzero(key[order][1:] == key[order][:-1])
    left, right = owner[order][twice], owner[order][twice + 1]
    cells = mesh.is_coating.size
    parts = connected_components(
        coo_matrix((np.ones(left.size), (left, right)), shape=(cells, cells)), False
    )[0]
    if parts > 1:
        raise PatchfemError(
            f"{where}: the {side} piece falls into {parts} parts that share no edge"
        )
    inner = np.zeros(len(key), bool)
    inner[order[twice]] = inner[order[twice + 1]] = True
    border = ends[~inner]
    _hanging(mesh, border, side, where)
    within = np.setdiff1d(mesh.far, border)
    if within.size:
        raise PatchfemError(
            f"{where}: {side}_far contains {within.size} nodes inside the {side} piece; tag only nodes "
            "on the border"
        )
    wanted = np.sort(np.stack([mesh.interface[:-1], mesh.interface[1:]], axis=1), axis=1)
    gone = ~np.isin(wanted[:, 0] * count + wanted[:, 1], key[~inner])
    if gone.any():
        x = mesh.x[np.argmax(gone)]
        raise PatchfemError(
            f"{where}: {side}_interface has a hole or leaves out nodes after x = {x:.6g} m; make the "
            "interface one continuous edge"
        )


def cell_edges(mesh: PieceMesh) -> tuple:
    """Edges (e, 2) of all cells as node numbers, counter-clockwise, and the cell (e,) of each; triangles first.

    An edge between two cells stands twice, once in either direction.
    """
    found, owner, first = [], [], 0
    for cells in (mesh.triangles, mesh.quads):
        found.append(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2))
        owner.append(np.repeat(np.arange(first, first + len(cells)), cells.shape[1]))
        first += len(cells)
    return np.concatenate(found), np.concatenate(owner)


def _hanging(mesh: PieceMesh, border, side: str, where) -> None:
    """Raise PatchfemError for a node of the border inside another border edge: cells that do not meet edge to edge."""
    nodes = np.unique(border)
    a, b = mesh.points[border[:, 0]], mesh.points[border[:, 1]]
    size = np.hypot(*(b - a).T)
    near = cKDTree(mesh.points[nodes]).query_ball_point((a + b) / 2, size / 2 * (1 - 1e-6))
    edge = np.repeat(np.arange(len(border)), [len(found) for found in near])
    if edge.size == 0:
        return
    point = mesh.points[nodes[np.concatenate([found for found in near if found]).astype(int)]]
    along, aside = (b - a)[edge], point - a[edge]
    off = np.abs(along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0]) / size[edge]
    if off.min() <= CLOSE * mesh.length:
        x, y = point[np.argmin(off)]
        raise PatchfemError(
            f"{where}: cells of the {side} piece do not meet edge to edge: a node lies inside an edge "
            f"at x = {x:.6g} m, {y:.6g} m from the interface"
        )


def _centred(mesh: PieceMesh, x) -> PieceMesh:
    points = mesh.points - [(x[0] + x[-1]) / 2, 0.0]
    return PieceMesh(
        frozen_array(points),
        *(frozen_array(part, np.int64) for part in (mesh.triangles, mesh.quads)),
        frozen_array(mesh.is_coating, bool),
        frozen_array(mesh.interface, np.int64),
        frozen_array(mesh.far, np.int64),
    )


def halved(mesh: PieceMesh) -> PieceMesh:
    """Refine a piece for error estimates: every edge is halved and every cell becomes four.

    New interface and far nodes lie half way between the old ones.
    """
    ends, _ = cell_edges(mesh)
    count, turn = len(mesh.points), 3 * len(mesh.triangles)
    pairs, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    number = number.ravel() + count
    middle = {tuple(pair): k + count for k, pair in enumerate(pairs.tolist())}
    a, b, c = mesh.triangles.T
    ab, bc, ca = number[:turn].reshape(-1, 3).T
    triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    p, q, r, s = mesh.quads.T
    pq, qr, rs, sp = number[turn:].reshape(-1, 4).T
    hub = np.arange(len(mesh.quads)) + count + len(pairs)
    quads = np.stack(
        [p, pq, hub, sp, pq, q, qr, hub, hub, qr, r, rs, sp, hub, rs, s], axis=1
    ).reshape(-1, 4)
    points = np.concatenate(
        [mesh.points, mesh.points[pairs].mean(axis=1), mesh.points[mesh.quads].mean(axis=1)]
    )
    between = [
        middle[tuple(sorted(pair))]
        for pair in zip(mesh.interface[:-1].tolist(), mesh.interface[1:].tolist())
    ]
    interface = np.empty(2 * mesh.interface.size - 1, np.int64)
    interface[::2], interface[1::2] = mesh.interface, between
    held = np.isin(pairs, mesh.far).all(axis=1) & (np.bincount(number - count) == 1)
    far = np.concatenate([mesh.far, np.flatnonzero(held) + count])
    return PieceMesh(
        frozen_array(points),
        frozen_array(triangles, np.int64),
        frozen_array(quads, np.int64),
        frozen_array(np.repeat(mesh.is_coating, 4), bool),
        frozen_array(interface, np.int64),
        frozen_array(far, np.int64),
    )
