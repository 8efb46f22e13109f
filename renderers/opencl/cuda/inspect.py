"""Reports the GPU resources of a job's kernels by compiling them: needs NVRTC, but no GPU.

`python -m renderers.opencl.cuda.inspect --job=.. .. --targets=sm_75,sm_90`: the flags of a job, and compute
capabilities. Prints an event `kernel` for each kernel and target (README.md in the folder of renderers).
"""

import re
import sys
import time

from renderers import worker

from .. import method, program
from ..run import names, read, scratch_bytes
from . import compiler
from .occupancy import occupancy
from .session import Session

SHARED_BYTES = 49152  # that a kernel may declare for a block, on every GPU
COUNTS = {  # what the assembler says of a kernel
    "registers": r"Used (\d+) registers",
    "shared_bytes": r"(\d+) bytes smem",
    "local_bytes": r"(\d+) bytes stack frame",
    "spill_store_bytes": r"(\d+) bytes spill stores",
    "spill_load_bytes": r"(\d+) bytes spill loads",
}


def main(arguments):
    job = worker.Job(arguments)
    targets = next(a.removeprefix("--targets=") for a in arguments if a.startswith("--targets=")).split(",")
    method.check(job)
    source, threads = source_of(job), job.block_width * job.block_height
    for target in targets:
        start = time.monotonic()
        compiled = compiler.compile_source(source, target, job.floating_point)
        took = time.monotonic() - start
        found = dict(kernels_of(compiled))
        assembling = sum(float(ms) for ms in re.findall(r"Compile time = ([\d.]+) ms", compiled.log)) / 1e3
        for name, facts in found.items():
            if name == "sizes":  # which runs once, and in one thread of use
                continue
            worker.say(
                "kernel",
                name=name,
                target=target,
                **facts,
                occupancy=occupancy(target, threads, facts["registers"], facts["shared_bytes"]),
                threads_per_block=threads,
                compile_s=took - assembling,
                assemble_s=assembling,
            )


def source_of(job):
    """The source that a device would get."""
    walk, scene, tree = read(job)
    if tree:
        scene.build()
    memory = method.memory_of(job, walk, scene, tree, SHARED_BYTES - scratch_bytes(job))
    return program.source(names(job, walk, scene, tree, memory, Session.SIZED))


def kernels_of(compiled):
    """Name and facts of each kernel of a program."""
    # Constants are the program's: all kernels may read them.
    constants = sum(map(int, re.findall(r"^\.(?:visible )?const .*\[(\d+)\]", compiled.ptx, re.MULTILINE)))
    bodies = dict(re.findall(r"^\.visible \.entry (\w+)\((.*?)^}", compiled.ptx, re.MULTILINE | re.DOTALL))
    for said in compiled.log.split("Compiling entry function '")[1:]:
        name, body = said.partition("'")[0], bodies[said.partition("'")[0]]
        facts = {fact: re.search(pattern, said) for fact, pattern in COUNTS.items()}
        yield (
            name,
            {
                **{fact: int(match[1]) if match else 0 for fact, match in facts.items()},
                "constant_bytes": constants,
                "float64_instructions": len(re.findall(r"^\s*(?:@%p\d+ )?[a-z.]+\S*\.f64\b", body, re.MULTILINE)),
                "contracted": len(re.findall(r"^\s*(?:@%p\d+ )?fma\.", body, re.MULTILINE)),
                "ptx_bytes": len(body),
            },
        )


if __name__ == "__main__":
    main(sys.argv[1:])
