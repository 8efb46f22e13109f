"""Compiles the kernel by NVRTC for a compute capability; needs no GPU."""

from dataclasses import dataclass

from cuda.bindings import nvrtc

from renderers import worker

from .calls import call

INSTALL = "pip install 'rayrace[cuda]'"
OPTIONS = {"strict": ("--fmad=false",), "contract": (), "fast": ("--use_fast_math",)}  # NUM-3


@dataclass(frozen=True)
class Compiled:
    """program: what the driver loads. ptx: its source in PTX. log: what the assembler says of its kernels."""

    program: bytes
    ptx: str
    log: str


def compile_source(source, target, floating_point):
    """target: such as "sm_90". Refuses what NVRTC refuses, and a machine that has none."""
    try:
        handle = call(nvrtc.nvrtcCreateProgram, source.encode(), b"kernel.cu", 0, [], [])
    except RuntimeError as error:  # the library is loaded by the first call
        worker.refuse(f"NVIDIA's compiler is not installed ({INSTALL}): {error}")
    options = [f"--gpu-architecture={target}", "--ptxas-options=-v", *OPTIONS[floating_point]]
    try:
        (status,) = nvrtc.nvrtcCompileProgram(handle, len(options), [option.encode() for option in options])
        log = _text(nvrtc.nvrtcGetProgramLogSize, nvrtc.nvrtcGetProgramLog, handle).decode(errors="replace")
        if status != 0:
            worker.refuse(f"NVRTC, for {target}: {_first_error(log)}")
        ptx = _text(nvrtc.nvrtcGetPTXSize, nvrtc.nvrtcGetPTX, handle).decode()
        return Compiled(_text(nvrtc.nvrtcGetCUBINSize, nvrtc.nvrtcGetCUBIN, handle), ptx, log.rstrip("\0"))
    finally:
        nvrtc.nvrtcDestroyProgram(handle)


def version():
    return ".".join(map(str, call(nvrtc.nvrtcVersion)))


def _text(size, get, handle):
    text = bytearray(call(size, handle))
    call(get, handle, text)
    return bytes(text)


def _first_error(log):
    lines = [line.strip("\0 ") for line in log.splitlines() if line.strip("\0 ")]
    return next((line for line in lines if "error" in line), lines[0] if lines else "it gave no reason")
