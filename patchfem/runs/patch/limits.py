"""Where a value goes on ever finer nested meshes, and how far it still is from there."""

from typing import NamedTuple

SECOND = 4.0  # ratio of successive changes of second order, the best that is believed
DOUBTFUL = 2.5  # the best ratio of meshes that are not nested
REGULAR = (2.6, 6.0)  # ratios of a series that falls by its order
SLOWEST = 1.6  # ratio that the rest of a slowly falling series is taken with
GROWING = 1.3  # ratio below which a series has not begun to fall
SAFE = 1.8  # of the rest of a series that falls by a steady ratio; of random scenes it covers all but 2 in 100
WILD = 2.0  # of the largest change of one that does not


class Limit(NamedTuple):
    """What a series of values on nested meshes tells.

    value: of the finest mesh; error: half-width that holds the limit; extrapolated: the limit as the last ratio of the
    changes gives it; left: half-width around that.
    """

    value: float
    error: float
    extrapolated: float
    left: float


def edge_limit(values, nested: bool = True) -> Limit:
    """`limit` of a value that hangs on where edges lie between nodes.

    Beside its second order such a place has a part that comes and goes with the share of the cell that the edge has
    passed. So no ratio takes it further than second order does, and it is held to half or all of the rest.
    """
    seen = limit(values, nested)
    if seen.extrapolated == seen.value:
        return seen
    rest, last = seen.extrapolated - seen.value, values[-1] - values[-2]
    rest = last / (SECOND - 1) if abs(rest) < abs(last) / (REGULAR[0] - 1) else rest
    least = abs(rest) / (1 if len(values) == 3 else 2)
    return seen._replace(extrapolated=values[-1] + rest, left=max(least, seen.left if len(values) > 3 else 0.0))


def limit(values, nested: bool = True) -> Limit:
    """Limit of a series of two values or more, each on a mesh whose cells are half as long as those of the one before.

    Three values show a ratio of successive changes. Where it is steady the rest of the geometric series is what the
    finest value lacks. Of two values the error is twice their change. Meshes that are not nested show no more than the
    order log2(2.5), and nothing is extrapolated from them.
    """
    last = values[-1] - values[-2]
    if len(values) < 3:
        return Limit(values[-1], WILD * abs(last), values[-1], WILD * abs(last))
    before = values[-2] - values[-3]
    ratio = before / last if last else float("inf") * (1 if before >= 0 else -1)
    if not nested:
        rest = max(abs(last), abs(before) / DOUBTFUL) / (min(max(ratio, SLOWEST), DOUBTFUL) - 1)
        return Limit(values[-1], WILD * rest, values[-1], WILD * rest)
    if not GROWING <= ratio:
        error = WILD * max(abs(last), abs(before) / SECOND)
        return Limit(values[-1], error, values[-1], error)
    if ratio > REGULAR[1]:  # the last change is small by chance
        error = WILD * max(abs(last) / (SECOND - 1), abs(before) / SECOND**2 * 2)
        return Limit(values[-1], error, values[-1], error)
    rest = last / (min(max(ratio, SLOWEST), SECOND) - 1)
    return Limit(values[-1], SAFE * abs(rest), values[-1] + rest, _left(values, rest, ratio))


def _left(values, rest: float, ratio: float) -> float:
    """Half-width around the extrapolated value: how far it moved with the last mesh, a quarter of the rest at least."""
    least = abs(rest) / (4 if ratio >= REGULAR[0] else 2)
    if len(values) < 4:
        return 2 * least
    earlier = limit(values[:-1])
    return max(least, abs(values[-1] + rest - earlier.extrapolated))
