"""Compiled fit of decaying sinusoids to a signal by variable projection, beside columns that stay.

Of every pair of poles, frequency [rad/s] and decay [1/s], stand two columns, exp(-decay t) cos and sin. An orthonormal
basis of all columns is made by Gram and Schmidt's method, twice over each, which is enough to be orthogonal to round-
off (Giraud, Langou, Rozloznik 2005); a column that the others make up counts for nothing.
"""

from math import cos, exp, inf, sin, sqrt

from ..compiled.jit import njit
from ..friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

EPS = 2.0**-52
ALIKE = 1e-12  # share of a column that is left beside the others, below which they make it up
FIRST, MOST = 1e-3, 1e9  # damping of a fit at first and at last
CLOSE, STILL = 1e-13, 1e-15  # steps over the scales of the poles that end a fit


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def waves(time, poles, columns, first):
    """Fill columns (c, k) from row `first` on with the sinusoids of poles (2 r,) at times (k,) [s]."""
    for r in range(poles.size // 2):
        own, rate = poles[2 * r], poles[2 * r + 1]
        for j in range(time.size):
            fall, turn = exp(min(max(-rate * time[j], -50.0), 50.0)), own * time[j]
            columns[first + 2 * r, j], columns[first + 2 * r + 1, j] = (
                fall * cos(turn),
                fall * sin(turn),
            )


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def dot(a, b):
    """Sum of a (k,) times b (k,)."""
    out = 0.0
    for j in range(a.size):
        out += a[j] * b[j]
    return out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def less(a, share, b):
    """Take share times b (k,) from a (k,)."""
    for j in range(a.size):
        a[j] -= share * b[j]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def orthonormal(columns, count, basis, corner):
    """Fill rows of basis with those of columns made orthonormal and corner (count, count) with what makes the columns
    of them: column j = sum corner[i, j] basis[i]. A column that counts for nothing has a basis of zeros."""
    for j in range(count):
        own = basis[j]
        for at in range(own.size):
            own[at] = columns[j, at]
        whole = sqrt(dot(own, own))
        for i in range(j):
            corner[i, j] = 0.0
        for _ in range(2):
            for i in range(j):
                share = dot(basis[i], own)
                corner[i, j] += share
                less(own, share, basis[i])
        left = sqrt(dot(own, own))
        corner[j, j] = left if left > ALIKE * whole else 0.0
        for at in range(own.size):
            own[at] = own[at] / left if corner[j, j] > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def projected(value, count, basis, inside, left):
    """Fill left (k,) with what a basis of `count` rows leaves of value (k,), inside (count,) with the shares of it."""
    for at in range(value.size):
        left[at] = value[at]
    for i in range(count):
        inside[i] = dot(basis[i], left)
        less(left, inside[i], basis[i])
    for i in range(count):  # the second time: what the first left over by rounding
        share = dot(basis[i], left)
        inside[i] += share
        less(left, share, basis[i])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def numbers_of(count, corner, inside, numbers):
    """Fill numbers (count,) with what the columns are taken times, by their shares in the basis."""
    for i in range(count - 1, -1, -1):
        part = inside[i]
        for j in range(i + 1, count):
            part -= corner[i, j] * numbers[j]
        numbers[i] = part / corner[i, i] if corner[i, i] > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def left_over(time, value, poles, columns, few):
    """Fill the room with what sinusoids of these poles leave of value (k,) at times (k,) [s]; its sum of squares."""
    count = few.shape[1]
    waves(time, poles, columns[0], count - poles.size)
    orthonormal(columns[0], count, columns[1], few)
    projected(value, count, columns[1], few[count], columns[2, 0])
    numbers_of(count, few, few[count], few[count + 1])
    return dot(columns[2, 0], columns[2, 0])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def derived(time, poles, scale, columns, few, slopes, normal):
    """Fill the slopes (2 r, k) of what is left by poles over scale (2 r,), after Kaufman (1975), and normal (2 r, 2 r +
    1): their products, and last those with what is left."""
    many, count = poles.size, few.shape[1]
    first, numbers = count - many, few[count + 1]
    for r in range(many // 2):
        cosine, sine = columns[0, first + 2 * r], columns[0, first + 2 * r + 1]
        a, b = numbers[first + 2 * r], numbers[first + 2 * r + 1]
        for at in range(time.size):
            slopes[2 * r, at] = (b * cosine[at] - a * sine[at]) * time[at] * scale[2 * r]
            slopes[2 * r + 1, at] = -(a * cosine[at] + b * sine[at]) * time[at] * scale[2 * r + 1]
    for r in range(many):
        for _ in range(2):
            for i in range(count):
                less(slopes[r], dot(columns[1, i], slopes[r]), columns[1, i])
        for at in range(time.size):
            slopes[r, at] = -slopes[r, at]
    for r in range(many):
        for q in range(r + 1):
            normal[r, q] = normal[q, r] = dot(slopes[r], slopes[q])
        normal[r, many] = dot(slopes[r], columns[2, 0])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stepped(normal, damping, step, lower):
    """Fill step (m,) with -(N + damping diag N)^-1 pull of normal (m, m + 1), by Cholesky's method; a direction that
    counts for nothing is not taken. lower: room (m, m). Returns pull times the step."""
    many = step.size
    for i in range(many):
        for j in range(i + 1):
            size = sqrt(normal[i, i]) * sqrt(normal[j, j])
            part = (normal[i, j] / size if size > 0 else 0.0) + (damping if i == j else 0.0)
            for k in range(j):
                part -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = sqrt(part) if part > many * EPS * (1 + damping) else inf
            else:
                lower[i, j] = part / lower[j, j]
    for i in range(many):
        size = sqrt(normal[i, i])
        part = -normal[i, many] / size if size > 0 else 0.0
        for k in range(i):
            part -= lower[i, k] * step[k]
        step[i] = part / lower[i, i]
    gain = 0.0
    for i in range(many - 1, -1, -1):
        part = step[i]
        for k in range(i + 1, many):
            part -= lower[k, i] * step[k]
        step[i] = part / lower[i, i]
    for i in range(many):
        size = sqrt(normal[i, i])
        step[i] = step[i] / size if size > 0 else 0.0
        gain += normal[i, many] * step[i]
    return gain


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def fitted(time, value, poles, scale, ends, room):
    """Fit sinusoids to value (k,) at times (k,) [s] by Levenberg and Marquardt's method: (times that a fit was looked
    at, the sum of squares that the best one leaves).

    poles (2 r,) move to the best ones; scale (2 r,) of their steps. ends (4,): sums of squares that are round-off, and
    with which a fit ends whose frequencies are all below the third [rad/s]; most steps. room: columns (3, c, k), the
    first c - 2 r of which are given, their basis, and in the first row of the last what is left; few (c + 2, c): corner
    of the basis, then shares in it and numbers of the columns; slopes (2 r, k); normal (2 r, 2 r + 1) as in `derived`
    at the best poles; more (2 r + 2, 2 r). Columns and few are those of the fit looked at last.
    """
    columns, few, slopes, normal, more = room
    many, damping, looked, largest, size = poles.size, 10 * FIRST, 0, 1.0, inf
    lower, step, tried = more[:many], more[many], more[many + 1]
    for r in range(many):
        tried[r] = poles[r]
    while True:
        new = left_over(time, value, tried, columns, few)
        looked += 1
        if new <= size:
            size, damping, highest = new, damping / 10, 0.0
            for r in range(many):
                poles[r] = tried[r]
                highest = max(highest, poles[r] if r % 2 == 0 else 0.0)
            if ends[3] == 0:
                break
            derived(time, poles, scale, columns, few, slopes, normal)
            if largest < CLOSE or size <= ends[0] or (size < ends[1] and highest < ends[2]):
                break
        elif damping > MOST or largest < STILL:
            break
        else:
            damping *= 10
        gain = -stepped(normal, damping, step, lower)
        if looked > ends[3] or gain <= EPS * size:  # whether such a step is taken or not is chance
            break
        largest = 0.0
        for r in range(many):
            tried[r] = poles[r] + scale[r] * step[r]
            largest = max(largest, abs(step[r]))
    return looked, size
