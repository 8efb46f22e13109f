"""Writes table 2.1: the machine of the run beside the study's."""

from pathlib import Path

from reports.paper import latex, markdown, table
from reports.run import study
from reports.run.results import Results


def rows(environment: dict) -> list[tuple[str, str, str]]:
    """Returns rows (property, this machine, the study's machine) as text."""
    cores, frequency = environment["cores"], environment["frequency"]
    ours = {
        "operating system": f"{environment['os']}, kernel {environment['kernel']}",
        "processor": f"{environment['cpu']} ({environment['architecture']})",
        "cores": ", ".join(f"{count} {kind}" for kind, count in cores.items()),
        "frequency": frequency if isinstance(frequency, str) else _frequency(frequency),
        "caches": _pairs(environment["caches"]),
        "memory": f"{environment['memory_bytes'] / 1e9:.1f} GB",
        "swap": f"{environment['swap_bytes'] / 1e9:.1f} GB",
        "disk": environment["disk"],
        "GPU": _gpu(environment["gpu"]),
        "virtual machine": environment["virtual_machine"],
        "frequency governor": environment["governor"],
        "turbo": environment["turbo"],
        "compilers": _pairs(environment["compilers"]),
        "Python": environment["python"],
        "packages": _pairs(environment["packages"]),
    }
    unsaid = "unavailable: the study does not say"
    return [(what, value, study.MACHINE.get(what, unsaid)) for what, value in ours.items()]


def _frequency(frequency: dict) -> str:
    now, most = frequency["now_mhz"], frequency["max_mhz"]
    return f"{now:.0f} MHz at the start; largest: {most if isinstance(most, str) else f'{most:.0f} MHz'}"


def _pairs(value: dict | str) -> str:
    return value if isinstance(value, str) else ", ".join(f"{name}: {text}" for name, text in value.items())


def _gpu(value: dict | str) -> str:
    if isinstance(value, str):
        return value
    size = value["memory_bytes"]
    memory = f"{size / 1e9:.1f} GB" if isinstance(size, int | float) else f"memory {size or 'unavailable: not known'}"
    return f"{value['name']}, driver {value['driver']}, {memory}"


def write(results: Results, out: Path) -> str:
    """Writes machine.csv; returns the section of the report."""
    header = ["what", "this machine", "the study's machine"]
    body = rows(results.facts["environment"])
    table.write_lines(out / "machine.csv", header, body)
    latex.table(header, list(map(list, body)), out / "machine.tex")
    title = "## Machine (the study's table 2.1)"
    return "\n\n".join([title, markdown.table(header, body), "[machine.csv](machine.csv)"])
