"""Compiles kernel.py to an extension module with the compiler that a variant is named after."""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.metadata import version
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

HERE = Path(__file__).parent
SOURCES = ("kernel.py", "kernel.pxd")
PACKAGES = {"cython": "Cython", "mypyc": "mypy"}
MODULE = "kernel" + EXTENSION_SUFFIXES[0]
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno")  # NUM-3
# cpow: a power of doubles is a double. The types are those of kernel.pxd, not the annotations.
DIRECTIVES = (
    "boundscheck=False,wraparound=False,cdivision=True,cpow=True,initializedcheck=False,annotation_typing=False"
)
MYPYC = (
    "from mypyc.build import mypycify; from setuptools import setup; "
    "setup(ext_modules=mypycify(['kernel.py'], opt_level='3'), script_args=['-q', 'build_ext', '--build-lib', '.'])"
)


class BuildError(Exception):
    """A compiler failed; the text says which and how."""


def commands(variant):
    """The commands that compile the sources in the current folder to MODULE."""
    if variant == "mypyc":
        return ([sys.executable, "-c", MYPYC],)
    include = sysconfig.get_path("include")
    return (
        [sys.executable, "-m", "cython", "-3", "-X", DIRECTIVES, "kernel.py", "-o", "kernel.c"],
        ["gcc", *FLAGS, "-shared", "-fPIC", f"-I{include}", "kernel.c", "-o", MODULE, "-lm"],
    )


def compiled(variant, cache):
    """The compiled module, and whether it was found in the folder `cache` ("" if there is none). BuildError."""
    parts = *((HERE / name).read_text() for name in SOURCES), Path(__file__).read_text(), variant
    key = repr((parts, version(PACKAGES[variant]), sys.version, platform.machine(), platform.node()))
    with tempfile.TemporaryDirectory(prefix="rayrace-typed-") as scratch:
        home = Path(cache or scratch, f"{variant}-{hashlib.sha256(key.encode()).hexdigest()[:16]}")
        found = (home / MODULE).is_file()
        if not found:
            home.mkdir(exist_ok=True)
            make(variant, Path(scratch))
            os.replace(shutil.move(Path(scratch, MODULE), home / (MODULE + f".{os.getpid()}")), home / MODULE)
        spec = spec_from_file_location(
            "kernel", home / MODULE, loader=ExtensionFileLoader("kernel", str(home / MODULE))
        )
        module = module_from_spec(spec)
        sys.modules["kernel"] = module
        spec.loader.exec_module(module)
    return module, found


def make(variant, folder):
    for name in SOURCES:
        shutil.copy(HERE / name, folder)
    for command in commands(variant):
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            env=os.environ | {"CFLAGS": " ".join(FLAGS)},
        )
        if done.returncode:
            lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            first = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "no message")
            raise BuildError(f"{variant}: {first.strip()} (is Python's header there? apt install python3-dev)")
