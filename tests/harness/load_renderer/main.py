"""Paints the background of a scene, a frame in 40 ms. Standard library only. Leaves its pid for the trace of NVML."""

import json
import os
import struct
import sys
import time

FRAME = 0.04  # s

started = time.monotonic()
flags = dict(word[2:].split("=", 1) for word in sys.argv[1:])
x0, y0, x1, y1 = map(int, flags["region"].split(","))
pixels = (y1 - y0) * (x1 - x0)


def say(event, **values):
    print(json.dumps({"event": event, **values}), flush=True)


with open(os.path.join(os.environ["HOME"], "renderer.pid"), "w") as file:
    file.write(str(os.getpid()))
with open(f"{flags['job']}/background.npy", "rb") as file:
    colour = file.read()[-24:]
render = time.monotonic()
say("phase", name="load", start=started, end=render)
start = render
for index in range(int(flags["frames"]) + 1):
    time.sleep(FRAME)
    end = time.monotonic()
    say("frame", index=index, start=start, end=end)
    start = end
say("phase", name="render", start=render, end=end)
header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {(y1 - y0, x1 - x0, 3)}, }}".ljust(117) + "\n"
with open(f"{flags['out']}/image.npy", "wb") as file:
    file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + colour * pixels)
say("phase", name="save", start=end, end=time.monotonic())
say("rays", primary=pixels, reflected=0, transmitted=0, shadow=0, non_finite=0)
say("output", file="image.npy")
