"""Samples, extremes and quadratures of many slips and sticks of one mode at once, from the rows of its events."""

from dataclasses import dataclass

import numpy as np

from ...core import ModalBasis, Response
from .slip_kernels import REACH, TERMS, oscillator

PANEL, WEIGHT = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False, slots=True)
class OneMode:
    """One mode as the event engine has it: w, decay, friction (static, kinetic) over the mass, segments (s, 6), drive
    force over the mass; slide and output per coordinate, mass, and what the drive's acceleration is."""

    modes: ModalBasis
    w: float
    decay: float
    friction: tuple
    segments: np.ndarray
    slide: float
    output: float
    drive: object

    @property
    def fading(self) -> float:
        """Time [s] after which the free motion of a slip is round-off; infinite without damping or spring."""
        slow = self.decay if self.w else 0.0
        if slow >= self.w > 0:  # the slower of its two rates; at critical damping half, for u exp(-decay u)
            slow = self.w**2 / (slow + np.sqrt((slow - self.w) * (slow + self.w))) / 2
        return 40 / slow if slow > 0 else np.inf


def turn(angle):
    out = np.empty(angle.shape, complex)
    out.real, out.imag = np.cos(angle), np.sin(angle)
    return out


def _growth(x):
    """(exp(x) - 1)/x for complex |x| < 0.3."""
    reach, last, size = float(np.abs(x).max(initial=0.0)), 1, 1.0
    while size > 1e-17:
        last += 1
        size *= reach / last
    out = np.ones(x.shape, complex)
    for k in range(last, 1, -1):
        out *= x / k
        out += 1
    return out


def basis(u, mode, om) -> tuple:
    """(h, h', step answer, cosine answer, sine answer) of a mode at times u (k,): `slip_kernels.motion` in arrays."""
    beta, _, decay, own, kind, _, _ = mode
    wave = turn(om * u)
    if kind == 0:
        own_wave = np.exp(-decay * u) * turn(own * u)
        h = own_wave.imag / own
        h1 = own_wave.real - decay * h
        second = (wave - own_wave.conj()) / complex(decay, om + own)
        gap = complex(decay, om - own)
        if abs(gap) < own:
            near = abs(gap) * u < REACH
            if near.all():
                first = u * own_wave * _growth(gap * u)
            else:
                first = (wave - own_wave) / gap
                first[near] = u[near] * own_wave[near] * _growth(gap * u[near])
            e = (first - second) / (2j * own)
        else:
            e = -(h - second) / gap
    else:
        fast = -(decay + own)
        slow = beta / fast if kind == 1 and fast else fast
        q = np.exp(fast * u)
        h = -np.exp(slow * u) * np.expm1(-2 * own * u) / (2 * own) if kind == 1 else u * q
        h1 = (0.5 * (np.exp(slow * u) + q) - decay * h if 2 * own < decay else
              (slow * np.exp(slow * u) - fast * q) / (2 * own)) if kind == 1 else q - decay * h
        e = (h - (wave - q) / complex(-fast, om)) / complex(slow, -om)
    return h, h1, _step(u, mode, h, h1), e.real, e.imag


def _step(u, mode, h, h1):
    beta, alpha, decay, own, kind, _, _ = mode
    fast = decay + own if kind else np.sqrt(beta)
    short = fast * u < REACH
    low = np.zeros_like(u)
    high = out = u * u / 2
    for k in range(1, TERMS if short.any() else 0):
        low, high = high, -(alpha * u * (k + 1) * high + beta * u * u * low) / ((k + 1) * (k + 2))
        out = out + high
    if kind == 0:
        return np.where(short, out, (1 - h1 - alpha * h) / beta)
    if fast == 0:
        return out
    slow = -beta / fast
    return np.where(short, out, ((np.expm1(slow * u) / slow if slow else u) - h) / fast)


def _series(u, v0, g0, bc, bs, mode, om) -> tuple:
    beta, alpha = mode[0], mode[1]
    low, high = np.zeros_like(u), v0 * u
    shift, speed = high, v0.copy()
    drive, power, push, sine, cosine = g0, np.ones_like(u), g0, bc, -bs
    for k in range(TERMS):
        new = (push * u * u - alpha * u * (k + 1) * high - beta * u * u * low) / ((k + 1) * (k + 2))
        low, high = high, new
        shift = shift + new
        speed = speed + (k + 2) * np.divide(new, u, out=np.zeros_like(u), where=u > 0)
        power = power * om * u / (k + 1)
        push = power * sine
        drive = drive + push
        sine, cosine = cosine, -sine
    return shift, speed, drive - alpha * speed - beta * shift


def _one(u, rows, owner, block, om, parts) -> np.ndarray:
    return motions(u, *(rows[owner, k] for k in (5, 6, 7, 8)), oscillator(block.w, block.decay, om), parts)


def motions(u, v0, g0, bc, bs, mode, parts) -> np.ndarray:
    """The first `parts` of (shift, speed, acceleration) at times u (k,) of slips, `slip_kernels.motion` in arrays."""
    om = mode[5]
    out, short = np.empty((parts, u.size)), u * mode[6] < REACH
    if short.any():
        out[:, short] = _series(u[short], v0[short], g0[short], bc[short], bs[short], mode, om)[:parts]
    far = ~short
    if far.any():
        v0, g0, bc, bs = v0[far], g0[far], bc[far], bs[far]
        h, h1, one, c, s = basis(u[far], mode, om)
        out[0, far] = v0 * h + g0 * one + bc * s - bs * (one - c)
        if parts == 1:
            return out
        out[1, far] = v0 * h1 + g0 * h + om * (bc * c - bs * s)
        if parts == 3:
            out[2, far] = g0 * h1 - v0 * (mode[1] * h1 + mode[0] * h) + om * (bc * (h - om * s) - bs * om * c)
    return out


def position(u, rows, owner, block: OneMode):
    """Position z (k,) [m] alone, as `states` gives it."""
    return _states(u, rows, owner, block, 1)[0]


def states(u, rows, owner, block: OneMode) -> tuple:
    """Motion (z [m], v [m/s], z'' [m s-2]), (k,) each, at times u (k,) [s] after the starts of the phases rows[owner].

    rows: (p, 10) of `sdof_kernels.march`; owner: (k,) their numbers.
    """
    return _states(u, rows, owner, block, 3)


def _states(u, rows, owner, block, parts):
    out = np.zeros((parts, u.size))
    out[0] = rows[owner, 4]
    way, segment = rows[owner, 3], rows[owner, 9]
    for om in {float(om) for om in block.segments[:, 4]}:
        mine = np.flatnonzero((way != 0) & (block.segments[:, 4] == om)[segment.astype(int)])
        if mine.size:
            out[:, mine] += way[mine] * _one(u[mine], rows, owner[mine], block, om, parts)
    return out


def starts(rows, block: OneMode) -> tuple:
    """Motion (z [m], v [m/s], z'' [m s-2]), (p,) each, at the starts of phases rows (p, 10)."""
    way = rows[:, 3]
    return rows[:, 4], way * rows[:, 5], way * (rows[:, 6] - 2 * block.decay * rows[:, 5])


def pull(u, rows, owner, block: OneMode, parts: int = 3) -> tuple:
    """Drive force over the mass and, up to `parts`, its first and second derivative at times u (k,) after the starts of
    phases."""
    _, _, push, b, om, _ = block.segments[rows[owner, 9].astype(int)].T
    angle = rows[owner, 1] + om * u
    wave = b * np.sin(angle)
    return (push + wave,) if parts == 1 else (push + wave, b * om * np.cos(angle), -om * om * wave)


def base_part(u, rows, owner, block: OneMode):
    """Acceleration (k,) [m s-2] of a moving base at times u (k,) [s] in the phases `owner`; 0 where none moves."""
    if not getattr(block.drive, "moving", True):
        return np.zeros(u.size)
    if block.modes.base[0] == 0:
        return block.drive.values(rows[owner, 0] + u)
    return pull(u, rows, owner, block, 1)[0] / -block.modes.base[0]


def force(u, rows, owner, block: OneMode):
    """Friction force (k,) [N] at times u (k,) [s] in the phases `owner`: kinetic in slip, what holds in stick."""
    if block.slide == 0 or block.friction[0] == 0:
        return np.zeros(u.size)
    held, way = pull(u, rows, owner, block, 1)[0] - block.w**2 * rows[owner, 4], rows[owner, 3]
    return np.where(way == 0, held, way * block.friction[1]) * (block.modes.mass / block.slide)


def response(time, z, v, gain, pushed, block: OneMode) -> Response:
    """The histories of a run from z, v, z'' (k,) at `time` (k,) [s] and the friction force `pushed` (k,) [N]."""
    base = block.drive.values(time) if getattr(block.drive, "moving", True) else np.zeros(np.size(time))
    slide = block.slide * z
    return Response(time, z[:, None], v[:, None], slide, block.slide * v, block.output * z, block.output * v,
                    block.output * gain + base, base, pushed, slide)


def stretches(low, high, rows, block: OneMode) -> tuple:
    """Parts of the intervals [low, high] (k,) of phases rows (k, 10): (number of the interval, from, to, rate [rad/s]).

    A slip moves as fast as mode and drive until its free motion has died out, and a stick as the drive from the first.
    """
    om = block.segments[rows[:, 9].astype(int), 4]
    fades = np.where(rows[:, 3] == 0, -np.inf, block.fading)
    if not (fades < high).any():
        return np.arange(len(rows)), low, high, np.maximum(block.w, om)
    middle = np.clip(fades, low, high)
    owner, begin, end = np.repeat(np.arange(len(rows)), 2), *(np.stack(pair, axis=1).ravel() for pair in
                                                            ((low, middle), (middle, high)))
    rate = np.stack([np.maximum(block.w, om), om], axis=1).ravel()
    kept = end > begin
    return owner[kept], begin[kept], end[kept], rate[kept]


def panels(low, high, fastest) -> tuple:
    """(number of the interval, time, weight) of 12 Gauss points per panel of 1.5 rad, intervals [low, high] (k,) with
    the angular frequencies `fastest`, (k,) or one for all."""
    count = np.maximum(1, np.ceil((high - low) * fastest / 1.5).astype(int))
    owner = np.repeat(np.arange(count.size), count)
    inside = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    half = 0.5 * ((high - low) / count)[owner]
    at = low[owner] + 2 * half * inside
    tau = at[:, None] + half[:, None] * (1 + PANEL)
    return np.repeat(owner, PANEL.size), tau.ravel(), (half[:, None] * WEIGHT).ravel()


def peak_acceleration(low, high, rows, block: OneMode) -> float:
    """Largest |absolute acceleration| of the output over intervals [low, high] (k,) of phases, both ends included."""
    return _peak(_output_acceleration, low, high, rows, block)


def peak_force(low, high, rows, block: OneMode) -> float:
    """Largest |friction force| [N] over intervals [low, high] (k,) of phases, both ends included."""
    return _peak(_force_rates, low, high, rows, block)


def _peak(curve, low, high, rows, block: OneMode) -> float:
    """Largest size of a curve that gives its value, rate and second rate at tau in the phases `owner`."""
    part, low, high, fastest = stretches(low, high, rows, block)
    count = np.maximum(5, np.ceil((high - low) * fastest * 8).astype(int) + 1)
    owner = np.repeat(np.arange(count.size), count)
    inside = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    tau = low[owner] + (high - low)[owner] * inside / (count[owner] - 1)
    owner = part[owner]
    value, rate, _ = curve(tau, rows, owner, block)
    top = float(np.abs(value).max())
    turn = np.flatnonzero((owner[:-1] == owner[1:]) & (rate[:-1] * rate[1:] < 0)
                          & (np.maximum(np.abs(value[:-1]), np.abs(value[1:])) >= 0.9 * top))
    if not turn.size:
        return top
    a, b = tau[turn], tau[turn + 1]
    t, mine = a - rate[turn] * (b - a) / (rate[turn + 1] - rate[turn]), owner[turn]
    for _ in range(6):
        _, slope, bend = curve(t, rows, mine, block)
        t = np.clip(t - np.divide(slope, bend, out=np.zeros_like(t), where=bend != 0), a, b)
    return max(top, float(np.abs(curve(t, rows, mine, block)[0]).max()))


def _force_rates(u, rows, owner, block: OneMode) -> tuple:
    stuck = (rows[owner, 3] == 0) * (block.modes.mass / block.slide if block.slide else 0.0)
    _, rate, second = pull(u, rows, owner, block)
    return force(u, rows, owner, block), stuck * rate, stuck * second


def _output_acceleration(u, rows, owner, block: OneMode) -> tuple:
    _, v, gain = states(u, rows, owner, block)
    drive, rate, second = pull(u, rows, owner, block)
    alpha, beta, slips = 2 * block.decay, block.w**2, rows[owner, 3] != 0
    jerk = np.where(slips, rate - alpha * gain - beta * v, 0.0)
    snap = np.where(slips, second - alpha * jerk - beta * gain, 0.0)
    share = -1 / block.modes.base[0] if getattr(block.drive, "moving", True) and block.modes.base[0] else 0.0
    return (block.output * gain + share * drive, block.output * jerk + share * rate,
            block.output * snap + share * second)
