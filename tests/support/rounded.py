"""Two alike coated pieces with rounded edges, meshed by Gmsh, finest where the flat ends.

The interface is the flat and as much of each fillet as is not steep; the coating follows it. The height of the fillet
is part of the mesh and enters the contact through `PieceMesh.interface_depths`.
"""

from math import atan, sin

import numpy as np

from patchfem.core import Missing, PatchfemError
from patchfem.mesh.anymesh import MAX_SLOPE, PairMesh, TaggedMesh, build_pair

# fine cells around the ends of the flat, growth of their size with the distance beyond
NEAR, GROWTH = (16, 0.1)


def rounded_pair(
    length: float,
    height: float,
    coating: float,
    radius: float,
    fine: float,
    coarse: float,
    *,
    flat: float | None = None,
    quads: bool = False,
) -> PairMesh:
    """Mesh two alike pieces with rounded edges by Gmsh, the upper the mirror image of the lower.

    length, height [m], coating [m] included (0: none). flat: half width of the flat [m], [length/2 - radius]; beyond it
    the profile is a circle of `radius` [m]. Cells of `fine` [m] at its ends grow to `coarse`. quads: cells are
    recombined, a few triangles stay. Missing without a working Gmsh; PatchfemError for sizes that do not fit.
    """
    flat = length / 2 - radius if flat is None else flat
    reach = length / 2 - flat
    if not (
        0 < flat < length / 2
        and reach <= radius * (1 + 1e-12)
        and 0 <= coating
        and 0 < fine <= coarse
    ):
        raise PatchfemError(
            f"rounded edges: a flat of half width {flat:.6g} m and a radius of {radius:.6g} m do not "
            f"fit a length of {length:.6g} m; need 0 < length/2 - flat <= radius, 0 < fine <= coarse"
        )
    drop = radius - np.sqrt(max(radius**2 - reach**2, 0.0))
    if coating + drop >= height:
        raise PatchfemError(
            f"rounded edges: coating and fillet take {coating + drop:.6g} m of {height:.6g} m"
        )
    gmsh = _gmsh()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        _draw(gmsh.model, length / 2, height, coating, radius, flat)
        _sizes(gmsh, fine, coarse, flat)
        if quads:
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
            gmsh.option.setNumber("Mesh.Algorithm", 8)
        gmsh.model.mesh.generate(2)
        raw = _mirrored(gmsh.model)
    finally:
        gmsh.finalize()
    return build_pair(raw, "rounded edges")


def _gmsh():
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise Missing(
            f"gmsh cannot be used ({error}); install gmsh and the system's libGLU and libXft "
            "(Debian: libglu1-mesa libxft2 libxcursor1 libxinerama1)"
        ) from None
    return gmsh


def _draw(model, half: float, height: float, coating: float, radius: float, flat: float) -> None:
    """Draw the upper piece with its groups: per layer the flat between two arcs, each cut where it becomes steep."""
    geo = model.geo
    steep = min(half, flat + radius * sin(atan(0.97 * MAX_SLOPE)))  # chords of the arc stay below
    stations = [
        -half,
        *([-steep] if steep < half else []),
        -flat,
        flat,
        *([steep] if steep < half else []),
        half,
    ]

    def profile(below: float) -> tuple:
        rise = [
            radius - np.sqrt(max(radius**2 - max(abs(x) - flat, 0.0) ** 2, 0.0)) for x in stations
        ]
        points = [geo.addPoint(x, below + r, 0) for x, r in zip(stations, rise)]
        middle = {sign: geo.addPoint(sign * flat, below + radius, 0) for sign in (-1, 1)}
        curves = [
            geo.addLine(p, q)
            if abs(x) <= flat and abs(y) <= flat
            else geo.addCircleArc(p, middle[1 if x >= 0 else -1], q)
            for p, q, x, y in zip(points, points[1:], stations, stations[1:])
        ]
        return points, curves

    top, surface = profile(0.0)
    base = [geo.addPoint(x, height, 0) for x in (-half, half)]
    far = geo.addLine(*base)
    groups = {"interface": surface[1:-1] if steep < half else surface, "far": [far]}
    if coating > 0:
        low, seam = profile(coating)
        sides = [geo.addLine(a, b) for a, b in ((top[0], low[0]), (top[-1], low[-1]))]
        layer = geo.addPlaneSurface(
            [geo.addCurveLoop([*surface, sides[1], *(-c for c in seam[::-1]), -sides[0]])]
        )
        groups["coating"] = [layer]
    else:
        low = top
        seam = surface
    walls = [geo.addLine(a, b) for a, b in ((low[0], base[0]), (low[-1], base[1]))]
    groups["substrate"] = [
        geo.addPlaneSurface([geo.addCurveLoop([*seam, walls[1], -far, -walls[0]])])
    ]
    geo.synchronize()
    for name, parts in groups.items():
        model.addPhysicalGroup(1 if name in ("interface", "far") else 2, parts, name=name)


def _sizes(gmsh, fine: float, coarse: float, flat: float) -> None:
    field = gmsh.model.mesh.field
    ends = [
        tag
        for _, tag in gmsh.model.getEntities(0)
        if np.allclose(np.abs(gmsh.model.getValue(0, tag, [])), [flat, 0, 0], atol=1e-9 * flat)
    ]
    away = field.add("Distance")
    field.setNumbers(away, "PointsList", ends)
    grow = field.add("Threshold")
    for key, value in (
        ("InField", away),
        ("SizeMin", fine),
        ("SizeMax", coarse),
        ("DistMin", NEAR * fine),
        ("DistMax", NEAR * fine + (coarse - fine) / GROWTH),
    ):
        field.setNumber(grow, key, value)
    field.setAsBackgroundMesh(grow)
    for key in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{key}", 0)


def _mirrored(model) -> TaggedMesh:
    """The upper piece as meshed and its mirror image."""
    numbers, place, _ = model.mesh.getNodes()
    row = np.full(int(numbers.max()) + 1, -1)
    row[numbers.astype(int)] = np.arange(numbers.size)
    points = place.reshape(-1, 3)
    cells = {2: [], 3: []}
    names = {2: [], 3: []}
    nodes = {}
    for dim, group in model.getPhysicalGroups():
        name = model.getPhysicalName(dim, group)
        for entity in model.getEntitiesForPhysicalGroup(dim, group):
            for kind, _, members in zip(*model.mesh.getElements(dim, entity)):
                members = row[members.astype(int)]
                if dim == 1:
                    nodes[name] = np.union1d(nodes.get(name, []), members).astype(int)
                else:
                    cells[kind].append(members.reshape(-1, kind + 1))
                    names[kind] += [name] * len(cells[kind][-1])
    count = len(points)
    triangles, quads = (np.concatenate([np.empty((0, k + 1), int), *cells[k]]) for k in (2, 3))
    label = [
        f"{side}_{name}" for kind in (2, 3) for side in ("upper", "lower") for name in names[kind]
    ]
    both = {
        f"{side}_{name}": found + shift
        for name, found in nodes.items()
        for side, shift in (("upper", 0), ("lower", count))
    }
    return TaggedMesh(
        np.concatenate([points, points * [1, -1, 1]]),
        np.concatenate([triangles, triangles + count]),
        np.concatenate([quads, quads + count]),
        np.array(label),
        both,
        "by Gmsh",
    )
