"""Shared by all tests: who can be raced here, and one way to let them work."""

import os
import re
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sittings
from fixtures import bad_folder, environment, experiment, generate, rayrace, rows, write  # noqa: F401
from xdist.scheduler import LoadScopeScheduling

from harness.judge import reference
from harness.process import repetition
from harness.process.session import Sessions
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs, shapes
from harness.system import trouble

KNOWN = registry.entries()
# Outside programs have tests of their own; exhibits are wrong or slow on purpose. Optional peers know few shapes
# and are tested where they are installed; elsewhere they would be a thousand skips. Processes and threads of Python run
# the code of `python` on rows of a picture: test_python_parts.py shows that no byte changes. `naive` lacks the guards
# that many tests are about; its own are in test_peers.py.
VARIANTS = tuple(
    name
    for name, entry in KNOWN.items()
    if not entry.renderer.manifest.external
    and not entry.variant.exhibit
    and name not in ("python-processes", "python-threads", "naive")
    and ("box" in entry.renderer.manifest.features or not entry.unavailable)
)


# Which tests CI leaves to `make nightly`, and why. A single test says so by its mark `nightly`; these are the rules for
# many. Of a slow test, or one in a file of FIRST, CI runs the first case, unless it is marked `whole`.
FIRST = "test_cuda.py", "test_cuda_compile.py", "test_peers.py"
ANOTHER = "it is slow, and CI runs the first case of this test"
ALONE = "it is slow, and nothing may run beside it"
COMPILES = "Numba compiles 3 to 100 s for each case; CI runs its pairs (test_covering.py), and this test with others"
SIMULATES = "the simulator of a GPU takes a millisecond for a ray; CI runs its pairs (test_covering.py)"
PRODUCT = "conformance", "stability"  # folders of tests of every renderer
OF_NUMBA = "numba", "numba-parallel"
OWN_KERNELS = "test_agreement.py", "test_features.py", "test_masks.py", "test_precision.py", "test_vector.py"
SIMULATED = "test_covering.py", "test_hits.py"
# Variants that compile for each of many cases: their tests of conformance and stability are too slow for `make quick`.
COMPILED = *OF_NUMBA, "cpp", "cpp-threads"
# Tests of which a case is as large as a file.
LARGE = "test_every_pair", "test_every_triple", "test_all_renderers_agree", "test_many_scenes"


# Tests that measure are run again if they fail, but only where meanwhile this machine was not wholly ours. If it never
# was, nothing could be measured: they are skipped, with what took the machine as the reason.
AGAIN = 3
began = {}


def pytest_configure(config):
    if sittings.FILE in os.environ:
        config.pluginmanager.register(sittings.Sittings(config))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    began.update(at=time.monotonic(), system=trouble.look())


def disturbed():
    """Why times of the test that runs are doubtful: the host or a CPU quota took the processor, or it was too hot."""
    found = trouble.between(began["system"], trouble.look())
    return trouble.doubts({**found, "other_cpu_s": 0, "swapped_pages": 0}, time.monotonic() - began["at"], threads=1)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    last = getattr(item, "execution_count", 0) > AGAIN and item.get_closest_marker("alone")
    if report.failed and last and (found := disturbed()):
        why = f"could not be measured: {'; '.join(found)}\n{report.longreprtext[-2000:]}"
        report.outcome, report.longrepr = "skipped", (str(item.path), item.location[1], why)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Makes marks `nightly` without a reason an error. Not a UsageError, whose text xdist loses."""
    report = yield
    bare = {
        f"{item.location[0]}:{item.location[1] + 1}: {item.originalname}"
        for item in report.result or ()
        if isinstance(item, pytest.Function) and not all(mark.args for mark in item.iter_markers("nightly"))
    }
    if bare:
        told = (
            'a mark nightly without a reason: write why CI leaves the test out, as in nightly("test_x shows the same")'
        )
        report.outcome, report.result = "failed", []
        report.longrepr = "\n".join(f"{test}: {told}" for test in sorted(bare))
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Marks the tests that CI leaves out, those that are too slow for `make quick`, and those that may run again."""
    firsts = _firsts(items)
    for item in items:
        if item.get_closest_marker("alone"):
            item.add_marker(pytest.mark.flaky(reruns=AGAIN, reruns_delay=5, condition=disturbed))
        told = item.callspec.params.values() if hasattr(item, "callspec") else ()
        variant = next((value for value in told if isinstance(value, str) and value in VARIANTS), None)
        product = variant if item.path.parent.name in PRODUCT else None
        if reason := left_to_the_night(item, variant, product, firsts):
            item.add_marker(pytest.mark.nightly(reason))
        if product in COMPILED:
            item.add_marker(pytest.mark.slow)
    items.sort(key=_is_slow)


def _is_slow(item):
    return item.get_closest_marker("slow") is not None


class Groups(LoadScopeScheduling):
    """Deals out to processes what one runs together: the tests of a file, which share fixtures.

    Of conformance and stability those of a file and a renderer that compiles, which share what is compiled, and each
    case of LARGE.
    """

    def _split_scope(self, nodeid):
        file, _, test = nodeid.partition("::")
        function, _, case = test.partition("[")
        if function in LARGE:
            return nodeid
        compiling = {KNOWN[variant].renderer.manifest.name for variant in COMPILED}
        words = re.split(r"[-\]]", case) if Path(file).parent.name in PRODUCT else ()
        return " ".join([file, *(word for word in words if word in compiling)][:2])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return Groups(config, log) if config.getvalue("dist") == "loadscope" else None


def _sampled(item):
    """Whether CI runs one case of this test: of slow tests and those of some files."""
    marked = item.get_closest_marker
    return (marked("slow") or item.path.name in FIRST) and not marked("whole") and not marked("nightly")


def _compiles(item):
    return "numba" in item.name.partition("[")[2]


def _firsts(items):
    """The cases that CI runs of sampled tests: the first that Numba does not compile for, else the first."""
    cases = {}
    for item in filter(_sampled, items):
        cases.setdefault((item.path, item.originalname), []).append(item)
    return {min(of_one, key=_compiles) for of_one in cases.values()}


def left_to_the_night(item, variant, product, firsts):
    """None, or why CI leaves out a test.

    product: the variant of a test of conformance or stability; else None. firsts: the cases that CI runs of slow tests.
    """
    file, marked = item.path.name, item.get_closest_marker
    if marked("nightly"):
        return None
    if marked("slow") and marked("alone"):
        return ALONE
    if marked("whole"):
        return None
    if _sampled(item):
        return None if item in firsts else ANOTHER
    if product in OF_NUMBA and (item.path.parent.name == "stability" or file in OWN_KERNELS):
        return COMPILES
    if variant == "numba-cuda" and file not in SIMULATED:
        return SIMULATES
    return None


def pytest_terminal_summary(terminalreporter):
    """Prints how many cases were drawn, from which seed, and how many faults injected: properties of tests that passed.

    A property: its kind, how many there were, and the seed if they are drawn.
    """
    for name, what in (("hostile", "hostile cases"), ("scene", "random scenes"), ("fault", "faults injected")):
        counts, drawn = Counter(), set()
        for report in terminalreporter.getreports("passed"):
            if report.when == "call":
                for key, value in report.user_properties:
                    if key == name:
                        counts[value[0]] += value[1]
                        drawn.update(value[2:])
        if counts:
            parts = ", ".join(f"{kind}: {count}" for kind, count in sorted(counts.items()))
            seed = f", seed {', '.join(map(str, drawn))}" if drawn else ""
            terminalreporter.write_line(f"{what}: {sum(counts.values())}{seed}: {parts}")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(request):
    """Builds of tests stay with the tests. They are kept by their content, so all sessions and workers share them."""
    os.environ["RAYRACE_CACHE"] = str(request.config.cache.mkdir("rayrace-builds"))
    os.environ["XDG_STATE_HOME"] = str(request.config.cache.mkdir("rayrace-state"))


@pytest.fixture(scope="session")
def known():
    return registry.entries()


SIMPLE = ("sphere", "box", "polygon", "ellipsoid")
LIGHT = ("ambient", "diffuse", "phong", "shadows", "reflection")
GLASS = ("transmission", "attenuation", "media")


def sharing(entry, parameters, needed):
    """`parameters` with a kernel that carries more than is needed, so that tests share what `entry` compiles.

    The pictures are the same (test_kernel.py).
    """
    if "general" not in entry.methods.get("kernel", ()):
        return parameters
    if entry.renderer.manifest.build:  # C++, where everything takes hardly longer to build than the least
        return replace(parameters, kernel="general")
    light = LIGHT if parameters.kind == "image" else ()
    glass = GLASS if set(GLASS) & set(needed) else ()  # Numba takes the longer the more there is
    return replace(parameters, kernel="+".join(["needed", *SIMPLE, *light, *glass]))


def blocks(entry):
    """Small blocks for the simulator of a GPU, to which a thread costs more than its work."""
    return {"block_width": 4, "block_height": 4} if entry.simulated else {}


def parsed(scene):
    return text.read(scene, "scene of the test") if isinstance(scene, str) else scene


class Bench:
    """Renders scenes and traces rays with any variant, sharing compiled code between the tests of a session.

    A scene is scene text or a `Scene`.
    """

    sharing = staticmethod(sharing)

    def __init__(self, known, caches, sessions):
        self.known, self.caches, self.sessions = known, caches, sessions

    def run(self, entry, arrays, parameters, needs):
        """The Result of a job, in a process that does other jobs of the tests too."""
        return self.sessions.run(entry, arrays, parameters, needs, cache=self.caches / entry.name)

    def entry(self, variant):
        entry = self.known[variant]
        if entry.unavailable:
            pytest.skip(entry.unavailable)
        return entry

    def by_speed(self, variant, few, many):
        """`few` for a variant that Python runs step by step."""
        return few if variant == "python" or self.known[variant].simulated else many

    def result(self, variant, scene_text, exact=False, **parameters):
        """The Result of a picture; the test is skipped if the manifest says that the variant cannot make it.

        exact: the kernel is what the job asks for, and nothing that it can do without.
        """
        entry = self.entry(variant)
        scene = parsed(scene_text)
        wanted = Parameters(**{"threads": entry.threads(), **blocks(entry), **parameters})
        needed = needs(scene, wanted)
        if not exact and wanted.kernel == "needed":
            wanted = sharing(entry, wanted, needed)
        reason = repetition.unsupported(entry, wanted, needed)
        if reason:
            pytest.skip(f"{variant} {reason}")
        result = self.run(entry, flatten(scene), wanted, needed)
        assert result.status == "ok", f"{variant}: {result.status}: {result.reason}\n{result.stderr}"
        return result

    def reference(self, maker, arrays, parameters, needs):
        """The Reference of a job, by the entry `maker`, with a kernel that tests share."""

        def run(entry, arrays, wanted, needed, cache):
            return self.run(entry, arrays, sharing(entry, wanted, needed), needed)

        return reference.make(maker, arrays, parameters, needs, self.caches, run)

    def picture(self, variant, scene_text, **parameters):
        return self.result(variant, scene_text, **parameters).array

    def hits(self, variant, scene_text, rays, precision="float64", **methods):
        """Hits (R, 8) of rays (R, 6), as the contract returns them."""
        entry = self.entry(variant)
        scene = parsed(scene_text)
        wanted = Parameters(kind="rays", precision=precision, **{**blocks(entry), **methods})
        wanted = sharing(entry, wanted, shapes(scene))
        arrays = {**flatten(scene), "rays": np.asarray(rays, dtype=np.float64).reshape(-1, 6)}
        result = self.run(entry, arrays, wanted, shapes(scene))
        if result.status == "unsupported":
            pytest.skip(f"{variant} {result.reason}")
        assert result.status == "ok", f"{variant}: {result.status}: {result.reason}\n{result.stderr}"
        return result.array


@pytest.fixture(scope="session")
def bench(known, request):
    with Sessions() as sessions:
        yield Bench(known, request.config.cache.mkdir("rayrace-compiled"), sessions)  # as the builds


@pytest.fixture(params=VARIANTS)
def variant(request):
    """Every variant in turn."""
    return request.param


# Variants that differ in more than the number of threads: enough where the question is about arithmetic.
@pytest.fixture(params=[name for name in VARIANTS if KNOWN[name].variant.threads == 1])
def serial(request):
    """Every variant of one thread in turn."""
    return request.param
