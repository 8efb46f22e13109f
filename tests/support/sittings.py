"""A long test run in several sittings: tests that have passed before are left out.

The environment variable RAYRACE_PASSED names a file that keeps the names of the tests that passed. Its first line is
the seed (seeds.py), by default the commit: what passed on another says nothing of this one.
"""

import os
from pathlib import Path

import pytest
import seeds

FILE = "RAYRACE_PASSED"


class Sittings:
    """Leaves out tests that passed in an earlier sitting. Only the controller of several processes writes the file."""

    def __init__(self, config: pytest.Config):
        told = getattr(config, "workerinput", None)
        self.path = None if told else Path(os.environ[FILE])
        self.passed = told["passed"] if told else self._read()
        self.calls = set()

    def _read(self) -> list[str]:
        seed, *passed = self.path.read_text().splitlines() if self.path.exists() else [seeds.seed()]
        if seed != seeds.seed():
            raise pytest.UsageError(
                f"{self.path}: these tests passed on {seed}, and this is {seeds.seed()}: set {FILE} to another file"
            )
        self.path.write_text("".join(f"{line}\n" for line in (seed, *passed)))
        return passed

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node):
        node.workerinput["passed"] = self.passed

    def pytest_collection_modifyitems(self, config, items):
        passed = set(self.passed)
        before = [item for item in items if item.nodeid in passed]
        if before:
            config.hook.pytest_deselected(items=before)
            items[:] = [item for item in items if item.nodeid not in passed]

    def pytest_runtest_logreport(self, report):
        """Adds a test whose call and teardown passed."""
        if report.when == "call" and report.passed:
            self.calls.add(report.nodeid)
        if report.when == "teardown" and report.passed and report.nodeid in self.calls and self.path:
            with open(self.path, "a") as file:
                file.write(report.nodeid + "\n")

    def pytest_sessionfinish(self, session, exitstatus):
        """Makes it no fault that all tests had passed before."""
        if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and self.passed:
            session.exitstatus = pytest.ExitCode.OK
