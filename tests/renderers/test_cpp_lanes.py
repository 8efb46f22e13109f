"""The code that the compiler makes of lanes: whole vectors, whatever width it prefers for loops.

No picture shows it if they are taken apart into single numbers; they are then ten times slower.
"""

import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from harness.renderer.builder import find_compiler

SOURCE = Path(__file__).parents[2] / "renderers" / "cpp" / "main.cpp"
NEEDS = "SPHERE", "BOX", "POLYGON", "ELLIPSOID", "DIFFUSE", "PHONG", "REFLECTION", "SHADOWS"
# Processors with AVX-512 and with AVX2, for which a compiler likes its own vectors to be half as wide.
WIDE = "-march=x86-64-v4", "-mprefer-vector-width=256"
NARROW = "-march=x86-64-v3", "-mprefer-vector-width=128"
FUSED = r"\tvfn?m(?:add|sub)\d+{}[sd]\b"


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the code of x86-64 is looked at")
@pytest.mark.skipif(not find_compiler("c++") or not shutil.which("objdump"), reason="no C++ compiler, or no objdump")
@pytest.mark.parametrize(("precision", "target"), [("FLOAT32", WIDE), ("FLOAT64", WIDE), ("FLOAT32", NARROW)])
def test_fused_products_are_of_vectors(precision, target, tmp_path):
    """In what takes rays in lanes nothing is fused of single numbers."""
    program = tmp_path / "render"
    defines = [f"-DNEED_{name}" for name in NEEDS] + ["-DKIND_IMAGE", f"-DPRECISION_{precision}", "-DVECTOR_ON"]
    flags = ["-std=c++20", "-O3", "-ffp-contract=off", "-fno-math-errno", "-pthread", *target]
    subprocess.run([find_compiler("c++"), *flags, *defines, SOURCE, "-o", program], check=True, timeout=300)
    code = subprocess.run(["objdump", "-dC", "--no-show-raw-insn", program], capture_output=True, text=True, check=True)
    bodies = re.split(r"^[0-9a-f]+ <(.*)>:$", code.stdout, flags=re.MULTILINE)
    single, whole = {}, 0
    for name, body in zip(bodies[1::2], bodies[2::2], strict=True):
        if re.match(r"Lane(Spheres|Tracer|Image)<|LaneScene<\w+>::(nearest_of_all|block_by_all)", name):
            whole += len(re.findall(FUSED.format("p"), body))
            single[name] = len(re.findall(FUSED.format("s"), body))
    print(whole, "of vectors, of single numbers:", single)
    assert whole > 100 and not any(single.values())
