"""Decorates the functions of the tracer for the technology of a variant (the study, 2.6.2)."""


def decorators(variant):
    """Returns the decorator of functions, that of the function that loops over rows, and the `range` of that loop."""
    if variant.startswith("study-python"):
        return _unchanged, _unchanged, range
    import numba

    if variant == "study-numba-object":
        jit = numba.jit(forceobj=True, looplift=False)
        return jit, jit, range
    jit = numba.jit(nopython=True)
    if variant == "study-numba-parallel":
        return jit, numba.jit(nopython=True, parallel=True), numba.prange
    return jit, jit, range


def _unchanged(function):
    return function
