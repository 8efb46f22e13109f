"""Identifies a machine with its software, so that rows of two machines are never pooled silently."""

import hashlib
import json

MACHINE = "host", "cpu", "architecture", "cores", "memory_bytes", "gpu"
SOFTWARE = "os", "kernel", "python", "compilers", "packages"


def of(environment: dict) -> str:
    """The host name with a hash of the machine's properties and software. environment: from capture()."""
    properties = {name: environment.get(name) for name in (*MACHINE, *SOFTWARE)}
    digest = hashlib.sha256(json.dumps(properties, sort_keys=True).encode()).hexdigest()
    return f"{environment.get('host', 'unknown')}-{digest[:8]}"


def changes(before: dict, now: dict, names: tuple[str, ...], prefix: str = "") -> list[tuple[str, object, object]]:
    """(name, old, new) for each value of `names` that differs; tables are compared key by key, with dotted names."""
    differences = []
    for name in names:
        old, new = before.get(name), now.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            differences += changes(old, new, tuple(sorted({*old, *new})), f"{prefix}{name}.")
        elif old != new:
            differences.append((f"{prefix}{name}", old, new))
    return differences
