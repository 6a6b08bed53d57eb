"""One slip of one mode under constant friction, in closed form: plain Python that `event_kernels` compiles.

From event to event z'' + alpha z' + beta z = g0 + bc sin(om u) - bs (1 - cos(om u)), u from the start of the phase. Its
solution is written in divided differences of exp at the two free rates and i om, so that resonance, no damping,
critical damping and a rigid mode are no special cases, and by its power series for short times, so that nothing cancels
at a grazing onset. The end of a slip is found by steps that a bound on the fourth derivative of the speed proves free
of roots. Python and the compiled copy give the same bits: powers are products, and `size_of` stands for hypot, which
each of the two rounds in its own way.

`o` below: (beta, alpha, decay, own, kind, om, top) of `oscillator`.
"""

from math import acos, atan2, cos, exp, expm1, inf, sin, sqrt

TERMS = 15  # of the power series: rounding at a reach of 0.3
REACH = 0.3
LATE = 0.1  # angle of the drive in a step below which it is slow beside the mode


def oscillator(w, decay, om):
    """Constants (beta, alpha, decay, own, kind, om, top) of a mode of natural frequency w.

    decay = xi w, or half a rigid mode's damping [1/s]; kind 0 below critical damping, 1 above, 2 at it.
    """
    if decay == w:
        return w * w, 2 * decay, decay, 0.0, 2.0, om, max(w, om)
    own = sqrt(abs((w - decay) * (w + decay)))
    if decay < w:
        return w * w, 2 * decay, decay, own, 0.0, om, max(w, om)
    return w * w, 2 * decay, decay, own, 1.0, om, max(decay + own, om)


def size_of(x, y):
    """sqrt(x^2 + y^2), without overflow."""
    high, low = max(abs(x), abs(y)), min(abs(x), abs(y))
    return high * sqrt(1.0 + (low / high) * (low / high)) if high > 0.0 else 0.0


def series(u, v0, g0, bc, bs, o):
    """Motion (shift, speed, acceleration) at u by the power series, for short times: top u <= 0.3.

    v0, g0, bc, bs: of the equation at the head of the file; o: of `oscillator`.
    """
    beta, alpha, om = o[0], o[1], o[5]
    if u <= 0.0:
        return 0.0, v0, g0 - alpha * v0
    au, bu, x = alpha * u, beta * u * u, om * u
    low, high = 0.0, v0 * u
    shift, speed, drive = high, high, g0
    power, push, sine, cosine = 1.0, g0, bc, -bs
    for k in range(TERMS):
        new = (push * u * u - au * (k + 1) * high - bu * low) / ((k + 1) * (k + 2))
        low, high = high, new
        shift += new
        speed += (k + 2) * new
        power *= x / (k + 1)
        push = power * sine
        drive += push
        sine, cosine = cosine, -sine
    return shift, speed / u, drive - alpha * speed / u - beta * shift


def step_answer(u, o, h, h1):
    """Shift after u under a unit constant push from rest, h the answer to a unit impulse and h1 its rate."""
    beta, alpha, decay, own, kind = o[0], o[1], o[2], o[3], o[4]
    fast = decay + own if kind != 0.0 else sqrt(beta)
    if fast * u < REACH:
        au, bu = alpha * u, beta * u * u
        low, high, out = 0.0, u * u / 2, u * u / 2
        for k in range(1, TERMS):
            low, high = high, -(au * (k + 1) * high + bu * low) / ((k + 1) * (k + 2))
            out += high
        return out
    if kind == 0.0:
        return (1.0 - h1 - alpha * h) / beta
    slow = -beta / fast
    return ((expm1(slow * u) / slow if slow != 0.0 else u) - h) / fast


def motion(u, v0, g0, bc, bs, o):
    """Motion (shift, speed, acceleration) at u after the start of a phase with speed v0 >= 0.

    g0, bc, bs: of the equation at the head of the file; o: of `oscillator`. Exact to round-off at every damping.
    """
    return moved(u, cos(o[5] * u), sin(o[5] * u), v0, g0, bc, bs, o)


def moved(u, co, so, v0, g0, bc, bs, o):
    """Motion as `motion` gives it, with the cosine co and sine so of om u at hand."""
    beta, alpha, decay, own, kind, om, top = o
    if u * top < REACH:
        return series(u, v0, g0, bc, bs, o)
    if kind == 0.0:
        e = exp(-decay * u)
        ec, es = e * cos(own * u), e * sin(own * u)
        h = es / own
        h1 = ec - decay * h
        p, q = om + own, om - own
        size = decay * decay + p * p
        yr = ((co - ec) * decay + (so + es) * p) / size
        yi = ((so + es) * decay - (co - ec) * p) / size
        size = decay * decay + q * q
        if size < own * own:
            a, b = decay * u, q * u
            if abs(a) + abs(b) < REACH:
                pr, pi_ = 1.0, 0.0
                for k in range(13, 1, -1):
                    pr, pi_ = 1.0 + (a * pr - b * pi_) / k, (a * pi_ + b * pr) / k
                xr, xi = u * (ec * pr - es * pi_), u * (ec * pi_ + es * pr)
            else:
                xr = ((co - ec) * decay + (so - es) * q) / size
                xi = ((so - es) * decay - (co - ec) * q) / size
            c, s = 0.5 * (xi - yi) / own, -0.5 * (xr - yr) / own
        else:
            c, s = -((h - yr) * decay - yi * q) / size, (yi * decay + (h - yr) * q) / size
    else:
        fast = -(decay + own)
        slow = beta / fast if kind == 1.0 else fast
        q = exp(fast * u)
        if kind == 1.0:
            p = exp(slow * u)
            h = -p * expm1(-2 * own * u) / (2 * own)
            h1 = 0.5 * (p + q) - decay * h if 2 * own < decay else (slow * p - fast * q) / (2 * own)
        else:
            h = q * u
            h1 = q - decay * h
        size = fast * fast + om * om
        yr, yi = (-(co - q) * fast + so * om) / size, (-so * fast - (co - q) * om) / size
        size = slow * slow + om * om
        c, s = ((h - yr) * slow + yi * om) / size, (-yi * slow + (h - yr) * om) / size
    one = (1.0 - h1 - alpha * h) / beta if kind == 0.0 and beta * u * u > 0.1 else step_answer(u, o, h, h1)
    return (v0 * h + g0 * one + bc * s - bs * (one - c),
            v0 * h1 + g0 * h + om * (bc * c - bs * s),
            g0 * h1 - v0 * (alpha * h1 + beta * h) + om * (bc * (h - om * s) - bs * om * c))


def first_leap(a, j, k, m, h):
    """A time in (0, h] up to which a u + j u^2/2 + k u^3/6 - m u^4/24 stays positive; 0 where it starts downwards."""
    if a < 0.0 or (a == 0.0 and j <= 0.0):
        return 0.0
    out = 0.0
    if j > 0.0:
        root = sqrt(k * k / 36 + m * j / 12) - k / 6
        out = h if root * h <= j else j / root
    if a > 0.0:
        loss = h * (max(-j, 0.0) / 2 + h * (max(-k, 0.0) / 6 + h * m / 24))
        out = max(out, h if loss <= a else h * a / loss)
    return min(0.9 * out, h)  # inside the bound


def leap(v, a, j, k, m, h):
    """Largest time up to h up to which v + a u + j u^2/2 + k u^3/6 - m u^4/24 is sure to stay positive, v > 0.

    v, a, j, k: speed and its derivatives; m: bound of the size of the fourth (`bend`).
    """
    low = -0.25 * m * h + (k if k < 0.0 else 0.0)
    low = low * h / 3 + (j if j < 0.0 else 0.0)
    if v + h * (low * h / 2 + (a if a < 0.0 else 0.0)) > 0.0:
        return h
    s, value, slope, window = 0.0, v, a, -v / a if a * h < -v else h
    for _ in range(60):
        end = s + window if s + window < h else h
        x = _free(value, slope, j, k, m, s, end)
        if x < 0.25 * (end - s):
            end = s + 2 * x
            x = _free(value, slope, j, k, m, s, end)
        window = 2 * (end - s)
        s += x
        if s >= h:
            return h
        value = v + s * (a + s / 2 * (j + s / 3 * (k - m * s / 4)))
        slope = a + s * (j + s / 2 * (k - m * s / 3))
        if value <= 0.01 * m * s * s * s * s or value <= 1e-9 * v or x <= 1e-3 * s:
            return s
    return s


def _free(value, slope, j, k, m, s, end):
    """Time without a root from s on, at most end - s, from the least curvature on [s, end]."""
    if value <= 0.0:
        return 0.0
    curve, other = j + s * (k - m * s / 2), j + end * (k - m * end / 2)
    if other < curve:
        curve = other
    inside = slope * slope - 2 * curve * value
    if curve >= 0.0 and (slope >= 0.0 or inside <= 0.0):
        return end - s
    root = sqrt(inside)
    x = 2 * value / (root - slope) if slope < 0.0 else (slope + root) / -curve
    return x if x < end - s else end - s


def bend(v, a, size, h, o):
    """Bound of the fourth derivative of the speed over the next h, from the equation of motion; inf for too long an h.

    v, a: speed and acceleration; size: of the drive.
    """
    beta, alpha, om = o[0], o[1], o[5]
    rest = 1.0 - alpha * h - 0.5 * beta * h * h
    if rest < 0.1:  # the bound by its own right-hand side holds for rest > 0 alone
        return inf
    second = (om * size + alpha * abs(a) + beta * (abs(v) + h * abs(a))) / rest
    third = om * om * size + alpha * second + beta * (abs(a) + h * second)
    return om * om * om * size + alpha * third + beta * second


def over_parts(v0, a0, size, bc, bs, o):
    """Sizes of the fourth derivatives of an overdamped speed at first: of its fast, its slow and its forced term."""
    beta, alpha, decay, own, om = o[0], o[1], o[2], o[3], o[5]
    fast = -(decay + own)
    slow = beta / fast
    x, y = beta - om * om, alpha * om
    weight = x * x + y * y
    va, aa = v0 - om * (bc * x + bs * y) / weight, a0 + om * om * (bs * x - bc * y) / weight
    quick, late = (aa - slow * va) / (fast - slow), (aa - fast * va) / (slow - fast)
    square, other, turn = fast * fast, slow * slow, om * om
    return abs(quick) * (square * square), abs(late) * (other * other), turn * turn * om * size / sqrt(weight)


def forced_part(v0, a0, bc, bs, o):
    """Speed of a slip once the free motion has died out, vc cos(om u) + vs sin(om u): (vc, vs, free, slow).

    v0, a0: speed and acceleration at first. The free speed stays within free exp(-slow u).
    """
    beta, alpha, decay, own, kind, om = o[0], o[1], o[2], o[3], o[4], o[5]
    x, y = beta - om * om, alpha * om
    weight = x * x + y * y
    vc, vs = om * (bc * x + bs * y) / weight, om * (bc * y - bs * x) / weight
    v, a = v0 - vc, a0 - om * vs
    if kind == 0.0:
        return vc, vs, size_of(v, (a + decay * v) / own), decay
    if kind == 1.0:
        fast = -(decay + own)
        slow = beta / fast
        return vc, vs, (abs(a - slow * v) + abs(a - fast * v)) / (slow - fast), -slow
    return vc, vs, abs(v) + 0.74 * abs(a + decay * v) / decay, 0.5 * decay  # u exp(-decay u/2) <= 2/(e decay)


def clear(u, vc, vs, free, om):
    """Time from u on in which vc cos(om u) + vs sin(om u) stays above `free`; 0 where it is not above it at u."""
    size, angle = size_of(vc, vs), om * u
    now = vc * cos(angle) + vs * sin(angle)
    if now <= free:
        return 0.0
    past = atan2(vc * sin(angle) - vs * cos(angle), now)  # since the largest forced speed
    return max(0.0, (acos(min(1.0, free / size)) - past) / om)


def stop(v0, g0, bc, bs, o, limit):
    """First time in (0, limit] at which the speed, positive just after 0, is back at zero; with shift and acceleration
    there.

    The time is -1 if there is none, -2 if it was lost.
    """
    beta, alpha, om = o[0], o[1], o[5]
    size = size_of(bc, bs)
    free = alpha if o[4] != 1.0 else 0.0
    stride = 1.1 / (free + sqrt(free * free + 1.1 * beta)) if beta + free > 0.0 else inf
    if size > 0.0:
        stride = min(stride, 1.0 / om)
    quick, rest = 0.0, 0.0
    if o[4] == 1.0:
        quick, late, forced = over_parts(v0, g0 - alpha * v0, size, bc, bs, o)
        rest = late + forced
    # far below the mode, leaps with the drive alone are worth a look
    late = stride * om < LATE and beta * alpha > 0.0 and limit > 8 * stride
    vc, vs, rings, slow = forced_part(v0, g0 - alpha * v0, bc, bs, o) if late else (0.0, 0.0, 0.0, 0.0)
    y, u, v, a, co, so, peak = 0.0, 0.0, v0, g0 - alpha * v0, 1.0, 0.0, 0.0
    for _ in range(200000):  # a guard: a slip that needs more is lost
        j = om * (bc * co - bs * so) - alpha * a - beta * v
        # so near the end the speed is a parabola: one step along it ends the slip to round-off
        if u > 0.0 and v <= 1e-6 * peak:
            x = -v / a if a < 0.0 else inf
            if abs(j) * x <= -1e-5 * a:
                x *= 1.0 - 0.5 * j * x / a
                return min(u + x, limit), y + x * (v + 0.5 * a * x), a + x * j
            if v <= 1e-14 * peak:  # a speed of round-off: this is the end
                return u, y, a
        peak = max(peak, v)
        if late and u > 0.0:
            s = (1.0 - 1e-9) * clear(u, vc, vs, rings * exp(-slow * u) + 1e-13 * peak, om)
            if s >= limit - u:
                return -1.0, 0.0, 0.0
            if s > 4 * stride:
                u += s
                co, so = cos(om * u), sin(om * u)
                y, v, a = moved(u, co, so, v0, g0, bc, bs, o)
                continue
        h = min(stride, limit - u)
        k = -om * om * (bc * so + bs * co) - alpha * j - beta * a
        m = bend(v, a, size, h, o)
        if o[4] == 1.0:
            m = min(m, quick * exp(-(o[2] + o[3]) * u) + rest)
        s = leap(v, a, j, k, m, h) if v > 0.0 else first_leap(a, j, k, m, h)
        if s >= limit - u:
            return -1.0, 0.0, 0.0
        if u + s == u:
            return u, y, a
        u += s
        co, so = cos(om * u), sin(om * u)
        y, v, a = moved(u, co, so, v0, g0, bc, bs, o)
    return -2.0, 0.0, 0.0
