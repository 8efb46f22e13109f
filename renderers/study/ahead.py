"""Compiles the tracer ahead of time to a library that needs no Numba, by numba.pycc and a C compiler."""

import hashlib
import importlib.util
import os
import sysconfig
from importlib.metadata import version

from .target import SIGNATURES

NAME = "study_render"


def library(folder):
    """Path of the library in `folder`, which may not be there yet: by what it is made of."""
    here = os.path.dirname(__file__)
    made_of = [version("numba")]
    for name in ("target.py", "trace.py", "vector.py"):
        with open(os.path.join(here, name), encoding="utf-8") as file:
            made_of.append(file.read())
    folder = os.path.join(folder, hashlib.sha256("".join(made_of).encode()).hexdigest()[:16])
    return os.path.join(folder, NAME + sysconfig.get_config_var("EXT_SUFFIX"))


def compile_library(path, render):
    """Compiles `render`, a Python function that calls functions of Numba, for this processor."""
    from numba.pycc import CC

    folder = os.path.dirname(path)
    os.makedirs(folder, exist_ok=True)
    compiler = CC(NAME)
    compiler.target_cpu = "host"
    compiler.output_dir, compiler.output_file = folder, f"{os.getpid()}.part"
    compiler.export("render", SIGNATURES["render"])(render)
    compiler.compile()
    os.replace(os.path.join(folder, compiler.output_file), path)


def load(path):
    """Returns `render` of the library."""
    found = importlib.util.spec_from_file_location(NAME, path)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module.render
