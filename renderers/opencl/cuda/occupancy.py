"""Occupancy of a GPU that is not here: the share of a multiprocessor's threads that can be resident. With a GPU the
driver tells.

The numbers are of the CUDA C++ Programming Guide, table "Technical Specifications per Compute Capability".
"""

WARP, REGISTERS, QUARTERS = 32, 65536, 4  # a multiprocessor's registers and warps lie in quarters
ROUNDED = 256  # a warp gets its registers in so many
# Warps, blocks, and KiB of shared memory; from 8.0 on the system takes a KiB of each block's, and rounds to 128 bytes.
LIMITS = {
    "70": (64, 32, 96), "75": (32, 16, 64), "80": (64, 32, 164), "86": (48, 16, 100), "89": (48, 24, 100),
    "90": (64, 32, 228), "100": (64, 32, 228), "120": (48, 24, 100),
}  # fmt: skip


def occupancy(target, threads, registers, shared):
    """None for a target that is not in the table. threads: of a block. registers: of a thread. shared: of a block."""
    number = target.removeprefix("sm_")
    if number not in LIMITS:
        return None
    most, blocks, size = LIMITS[number]
    warps = _steps(threads, WARP)
    reserved, step = (1024, 128) if int(number) >= 80 else (0, 256)
    of_quarter = REGISTERS // QUARTERS // (_steps(max(registers, 1) * WARP, ROUNDED) * ROUNDED)
    taken = _steps(shared + reserved, step) * step
    fit = size * 1024 // taken if taken else blocks
    return min(blocks, most // warps, of_quarter * QUARTERS // warps, fit) * warps / most


def _steps(count, step):
    return -(-count // step)
