"""Changes the files of the harness, and puts other things in their places."""

import os
import shutil
import sys

from main import flags, good, npy

OUT, JOB, CACHE = flags["out"], flags["job"], flags["cache"]
HERE = os.path.dirname(OUT)  # the folder that is removed when the process has ended


def change(name, keep_times=False):
    path = f"{JOB}/{name}"
    with open(path, "rb") as file:
        data = file.read()
    good()
    before = os.stat(path)
    with open(path, "r+b") as file:
        file.write(data[:-1] + b"?")
    if keep_times:
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def after(action, *arguments):
    def misdeed():
        good()
        sys.stdout.flush()
        action(*arguments)

    return misdeed


def replace(path, make):
    if os.path.isdir(path):
        shutil.rmtree(path)
    else:
        os.unlink(path)
    make(path)


def device(path):
    try:
        os.mknod(path, 0o600 | 0o020000, os.makedev(1, 5))  # /dev/zero
    except PermissionError:
        os.symlink("/dev/zero", path)


def link_to_elsewhere(path):
    """A folder that is not ours, with a file in it that must stay."""
    os.symlink(f"{CACHE}/precious", path)


def precious():
    os.makedirs(f"{CACHE}/precious", exist_ok=True)
    open(f"{CACHE}/precious/file", "w").close()


def link_for_all():
    precious()
    good()
    sys.stdout.flush()
    replace(HERE, link_to_elsewhere)


def link_for_out():
    precious()
    good()
    replace(OUT, link_to_elsewhere)


def claim_much():
    """A header of 96 GB, and a file of some MB."""
    good(data=npy([], (40000, 100000, 3)) + bytes(10**6))


MISDEEDS = {
    "zoo-job-changed": lambda: change("background.npy"),
    "zoo-job-backdated": lambda: change("background.npy", keep_times=True),
    "zoo-job-parameters": lambda: change("job.json"),
    "zoo-job-added": after(lambda: open(f"{JOB}/more.npy", "w").close()),
    "zoo-job-removed": after(shutil.rmtree, JOB),
    "zoo-stdout-removed": after(os.unlink, f"{HERE}/stdout"),
    "zoo-stdout-pipe": after(replace, f"{HERE}/stdout", os.mkfifo),
    "zoo-stderr-folder": after(replace, f"{HERE}/stderr", os.mkdir),
    "zoo-all-removed": after(shutil.rmtree, HERE),
    "zoo-all-link": link_for_all,
    "zoo-picture-none": lambda: good(file=None),
    "zoo-picture-pipe": after(replace, f"{OUT}/image.npy", os.mkfifo),
    "zoo-picture-link": after(replace, f"{OUT}/image.npy", lambda path: os.symlink("/etc/passwd", path)),
    "zoo-picture-folder": after(replace, f"{OUT}/image.npy", os.mkdir),
    "zoo-picture-device": after(replace, f"{OUT}/image.npy", device),
    "zoo-picture-claim": claim_much,
    "zoo-out-closed": after(os.chmod, OUT, 0),
    "zoo-out-removed": after(shutil.rmtree, OUT),
    "zoo-out-link": link_for_out,
}
