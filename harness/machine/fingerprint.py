"""Identifies a machine with its software, so that rows of two are never pooled silently."""

import hashlib
import json

MACHINE = "host", "cpu", "architecture", "cores", "memory_bytes", "gpu"
SOFTWARE = "os", "kernel", "python", "compilers", "packages"


def of(environment: dict) -> str:
    """A machine's name with a hash of all that makes it and its software; of the same, the same."""
    told = {name: environment.get(name) for name in (*MACHINE, *SOFTWARE)}
    digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
    return f"{environment.get('host', 'unknown')}-{digest[:8]}"


def changes(before: dict, now: dict, names: tuple[str, ...], prefix: str = "") -> list[tuple[str, object, object]]:
    """(name, old, new) of each value that is not the same; tables are looked into."""
    found = []
    for name in names:
        old, new = before.get(name), now.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            found += changes(old, new, tuple(sorted({*old, *new})), f"{prefix}{name}.")
        elif old != new:
            found.append((f"{prefix}{name}", old, new))
    return found
