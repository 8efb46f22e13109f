"""Computes the theoretical occupancy of a multiprocessor: resident threads as a share of the maximum.

CUDA C++ Programming Guide, table "Technical Specifications per Compute Capability", and the rules of NVIDIA's occupancy
calculator: registers are given out to a warp in steps of 256, shared memory to a block in steps of `step` bytes, of
which the system takes `reserved`.
"""

from dataclasses import dataclass

WARP = 32
REGISTER_STEP = 256


@dataclass(frozen=True)
class Limits:
    """Limits of a multiprocessor: resident warps and blocks, registers, bytes of shared memory."""

    warps: int
    blocks: int
    shared: int
    step: int = 128
    reserved: int = 1024
    registers: int = 65536


LIMITS = {
    (7, 0): Limits(64, 32, 96 * 1024, 256, 0),
    (7, 5): Limits(32, 16, 64 * 1024, 256, 0),
    (8, 0): Limits(64, 32, 164 * 1024),
    (8, 6): Limits(48, 16, 100 * 1024),
    (8, 9): Limits(48, 24, 100 * 1024),
    (9, 0): Limits(64, 32, 228 * 1024),
    (10, 0): Limits(64, 32, 228 * 1024),
    (12, 0): Limits(48, 24, 100 * 1024),
}


def occupancy(capability, threads, registers, shared):
    """Share of a multiprocessor's warps; None for a capability that is not in the table.

    threads: of a block. registers: of a thread. shared: bytes of a block.
    """
    limits = LIMITS.get(tuple(capability))
    if limits is None:
        return None
    warps = -(-threads // WARP)
    by_registers = limits.blocks
    if registers:
        of_warp = -(-registers * WARP // REGISTER_STEP) * REGISTER_STEP
        # A multiprocessor is four parts, each with its own registers and warps.
        by_registers = limits.registers // 4 // of_warp * 4 // warps
    of_block = -(-(shared + limits.reserved) // limits.step) * limits.step
    by_shared = limits.shared // of_block if of_block else limits.blocks
    return min(limits.blocks, limits.warps // warps, by_registers, by_shared) * warps / limits.warps
