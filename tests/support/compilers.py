"""Compilers for tests: a test that needs one is skipped, with the reason, on a machine that has none."""

import pytest

from harness.renderer import builder


def compiler(kind):
    """Returns the path of a compiler of "c" or "c++"; skips the test where there is none."""
    path = builder.find_compiler(kind)
    if path is None:
        pytest.skip(builder.missing(kind))
    return path


def needs_compiler(kind):
    """Returns the mark of tests that need a compiler of "c" or "c++"."""
    return pytest.mark.skipif(builder.find_compiler(kind) is None, reason=builder.missing(kind))
