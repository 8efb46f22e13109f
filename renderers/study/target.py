"""Decorates the functions of the tracer for the technology of a variant (the study, 2.6.2)."""

VECTOR, TABLE = "float64[::1]", "float64[:, ::1]"
FOUR = ", ".join([VECTOR] * 4)
SCENE = ", ".join([TABLE] * 4 + [VECTOR])  # spheres, surfaces, lights, colours, frame
PICTURE = "float64[:, :, ::1]"
# The types of every function that a picture takes, as an explicit signature spells them.
SIGNATURES = {
    "vector": f"{VECTOR}(float64, float64, float64)",
    "add": f"{VECTOR}({VECTOR}, {VECTOR})",
    "subtract": f"{VECTOR}({VECTOR}, {VECTOR})",
    "multiply": f"{VECTOR}({VECTOR}, {VECTOR})",
    "scale": f"{VECTOR}({VECTOR}, float64)",
    "dot": f"float64({VECTOR}, {VECTOR})",
    "unit": f"{VECTOR}({VECTOR})",
    "sphere_intersection": f"float64({VECTOR}, {VECTOR}, {VECTOR})",
    "intersection": f"Tuple((int64, float64))({TABLE}, {VECTOR}, {VECTOR})",
    "is_lit": f"boolean({TABLE}, {VECTOR}, {VECTOR}, float64)",
    "local_illumination": f"{VECTOR}({TABLE}, {VECTOR}, {TABLE}, {TABLE}, {FOUR}, float64, {VECTOR})",
    "reflection_coefficient": "float64(float64, float64, float64)",
    "surface_point": f"Tuple(({VECTOR}, {VECTOR}, float64))({VECTOR}, {VECTOR}, {VECTOR}, float64, float64)",
    "reflected_ray": f"Tuple(({VECTOR}, {VECTOR}, float64))({FOUR}, float64)",
    "ray_trace_by_recursion": f"{VECTOR}({SCENE}, {VECTOR}, {VECTOR}, int64, {VECTOR})",
    "render": f"void({PICTURE}, {PICTURE}, {', '.join([TABLE] * 5)}, {VECTOR})",
}


def decorators(variant):
    """Returns the decorator of functions, that of the function that loops over rows, and the `range` of that loop."""
    if variant.startswith("study-python"):
        return _unchanged, _unchanged, range
    import numba

    if variant == "study-numba-object":
        jit = numba.jit(forceobj=True, looplift=False)
        return jit, jit, range
    if variant == "study-numba-signatures":
        return _signed, _signed, range
    if variant == "study-numba-aot":
        return _signed, _unchanged, range  # ahead.py compiles the loop, but in there no arrays lazily
    jit = numba.jit(nopython=True)
    if variant == "study-numba-parallel":
        return jit, numba.jit(nopython=True, parallel=True), numba.prange
    return jit, jit, range


def _unchanged(function):
    return function


def _signed(function):
    """Compiles a function at once for the types of its signature; what has none is not called (ray_trace_by_table)."""
    import numba

    signature = SIGNATURES.get(function.__name__)
    return numba.jit(signature, nopython=True)(function) if signature else function
