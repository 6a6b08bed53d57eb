"""What condensing a grid will cost, from the sizes of its fronts, which are known from its columns and rows alone."""

from collections import Counter
from functools import lru_cache

from .grid_fronts import Shape

# CPU seconds of one core of an AMD EPYC at 2.6 GHz, fitted to 15 grids of 21 x 20 to 301 x 201 nodes, each both ways;
# 0.85 to 1.07 of what they took
PER_CALL, PER_SHAPE, PER_FRONT, PER_ENTRY, PER_OPERATION = 1.4e-3, 9.8e-5, 4.5e-6, 1.38e-8, 1.22e-11
WORD = 8


def predicted_seconds(nx: int, ny: int, mirrored: bool) -> float:
    """CPU seconds [s] of assembling and condensing one piece of nx columns and ny rows of nodes, the far face with
    them.

    mirrored: whether the piece is its own mirror image in x. The machine is not asked how fast it is; memory that a
    process touches for the first time takes up to as long again.
    """
    shapes, fronts, entries, operations, _ = counts(nx, ny, mirrored)
    return (PER_CALL + PER_SHAPE * shapes + PER_FRONT * fronts + PER_ENTRY * entries + PER_OPERATION * operations)


def predicted_bytes(nx: int, ny: int, mirrored: bool) -> float:
    """Largest memory [bytes] of condensing one piece: its stencil, factors, updates and compliance."""
    _, _, entries, _, most = counts(nx, ny, mirrored)
    return WORD * (entries + most)


@lru_cache(maxsize=1024)
def counts(nx: int, ny: int, mirrored: bool) -> tuple:
    """Shapes, fronts, entries of the factors, floating-point operations, and entries of all that is not factors."""
    half = mirrored and nx > 3
    columns = (nx + 1) // 2 if half else nx
    level = Counter({Shape(columns - 1, ny - 1, half, False, False): 1})
    shapes = fronts = entries = most = 0
    operations = 0.0
    while level:
        below, updates = Counter(), 0
        for shape, count in level.items():
            own, ring = _unknowns(shape)
            shapes, fronts, entries = shapes + 1, fronts + count, entries + count * own * (own + ring)
            operations += count * (own**3 / 3 + own * own * ring + 2 * own * ring * ring)
            updates += count * ring * ring
            for part in (shape.halves() or ())[:2]:
                below[part] += count
        most, level = max(most, updates), below
    kept = 2 * (columns + (ny - 2 if half else 0))
    operations += (1 + half) * (kept**3 / 3 + 2 * (2 * columns)**3 / 3)
    entries += (1 + half) * kept**2
    return shapes, fronts, entries, operations, 2 * most + 36 * nx * (ny - 1) * (2 if half else 1) + 5 * (2 * nx)**2


def _unknowns(shape: Shape) -> tuple:
    """Unknowns of a part that are eliminated with it, and those of its ring."""
    sides, halves = shape.left + shape.right, shape.halves()
    ring = sides * shape.lines + (shape.columns + 1 - sides) * (1 + (shape.bottom and shape.lines > 1))
    if halves is None:
        own = (shape.columns + 1) * shape.lines - ring
    elif halves[2][0]:
        own = shape.lines - 1 - shape.bottom
    else:
        own = shape.columns + 1 - sides
    return 2 * own, 2 * ring
