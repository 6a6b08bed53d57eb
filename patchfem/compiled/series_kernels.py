"""Sine and 1 - exp(-x) as series without branches or calls, so that a loop over several numbers takes them at once.

The C library's functions serve one number in a call and stop such a loop from becoming vector code.
"""

from .inner import njit

ROUNDS = 6755399441055744.0  # 1.5 * 2^52: added and taken off again it leaves the nearest whole number
PER_HALF_TURN = 0.3183098861837907
HALF_TURN, REST = 3.141592653589793, 1.2246467991473532e-16  # pi as the sum of two numbers
LEAST, MOST = -8.0, 64.0  # of the x of `gone`
PARTS = 64.0


@njit(error_model="numpy", fastmath={"contract"})
def sine(x):
    """sin x to 3e-16 besides the round-off of x itself; x at most 1e8.

    With k the whole number next to x/pi it is (-1)^k sin(x - k pi), a series up to the power 19.
    """
    k = (x * PER_HALF_TURN + ROUNDS) - ROUNDS
    r = x - k * HALF_TURN - k * REST
    half = 0.5 * k
    odd = half - ((half + ROUNDS) - ROUNDS)  # 0, or a half either way
    s = r * r
    series = s * (s * (2.8114572543455206e-15 - 8.22063524662433e-18 * s) - 7.647163731819816e-13)
    series = series + 1.6059043836821613e-10
    series = s * (s * (s * series - 2.505210838544172e-08) + 2.7557319223985893e-06) - 0.0001984126984126984
    series = s * (s * (s * series + 0.008333333333333333) - 0.16666666666666666)
    return (1 - 8 * odd * odd) * (r + r * series)


@njit(error_model="numpy", fastmath={"contract"})
def gone(x):
    """1 - exp(-x) for -8 <= x, to 2e-15 of itself; beyond 64 it is that of 64, 1 to the last digit.

    A series for x/64, then six times g(2x) = g(x) (2 - g(x)).
    """
    x = x if x < MOST else MOST
    x = x if x > LEAST else LEAST
    r = x * (1 / PARTS)
    g = 1 - r * (1 / 12) * (1 - r * (1 / 13))
    g = 1 - r * (1 / 9) * (1 - r * (1 / 10) * (1 - r * (1 / 11) * g))
    g = 1 - r * (1 / 5) * (1 - r * (1 / 6) * (1 - r * (1 / 7) * (1 - r * (1 / 8) * g)))
    g = r * (1 - r * (1 / 2) * (1 - r * (1 / 3) * (1 - r * (1 / 4) * g)))
    for _ in range(6):
        g = g * (2 - g)
    return g
