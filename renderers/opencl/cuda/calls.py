"""Calls of CUDA's driver and of NVRTC, whose functions return their status before what they return."""


def call(function, *arguments):
    """Returns what a function of cuda.bindings returns beside its status; RuntimeError if that tells of an error."""
    status, *found = function(*arguments)
    if status != 0:
        raise RuntimeError(f"{function.__name__}: {status.name}")
    return found[0] if len(found) == 1 else found
