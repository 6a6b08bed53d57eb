"""One BLAS thread for small dense work; the libraries are looked up once, so that an entry costs 10 us."""

from functools import cache


@cache
def _libraries():
    import scipy.linalg  # noqa: F401  (loads the second BLAS before the libraries are looked up)
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread():
    """Context in which numpy and scipy use a single BLAS thread; it may be entered again inside, at 10 us an entry."""
    return _libraries().limit(limits=1, user_api="blas")
