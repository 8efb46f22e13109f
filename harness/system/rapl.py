"""Reads the energy that the processor's packages use, by RAPL (running average power limit), from the kernel's files.

Source: Linux, Documentation/power/powercap/powercap.rst: energy_uj counts microjoules and begins again at
max_energy_range_uj. AMD's processors have the same files. The counters move about every millisecond (Intel SDM,
volume 3B, 15.10.4), and only root may read them since version 5.10 (CVE-2020-8694).
"""

from dataclasses import dataclass
from pathlib import Path

from harness.errors import of_system

ROOT = Path("/sys/class/powercap")
PACKAGES = "*-rapl:[0-9]*"
NONE = "the system has no RAPL counters of a processor package (virtual machines seldom have)"
REMEDY = "sudo chmod a+r /sys/class/powercap/*-rapl:*/energy_uj, until the next start"


@dataclass
class Package:
    """A package's counter, µJ: its file, where it begins again, and what it read last."""

    file: Path
    most: int
    last: int


class Rapl:
    """The energy of all packages since it was made. unavailable: None, or why there is none."""

    def __init__(self, root: Path = ROOT):
        self.unavailable: str | None = None
        self._used, self._packages = 0, []
        try:
            for zone in sorted(root.glob(PACKAGES)):
                if zone.name.count(":") == 1 and (zone / "name").read_text().startswith("package"):
                    most = int((zone / "max_energy_range_uj").read_text())
                    self._packages.append(Package(zone / "energy_uj", most, _read(zone / "energy_uj")))
        except PermissionError as error:
            self.unavailable = f"{of_system(error)}; {REMEDY}"
        except (OSError, ValueError) as error:
            self.unavailable = of_system(error) if isinstance(error, OSError) else f"RAPL: {error}"
        if self.unavailable is None and not self._packages:
            self.unavailable = NONE

    def joules(self) -> float | None:
        """What the packages have used since this was made, J; None if it cannot be read."""
        if self.unavailable is not None:
            return None
        try:
            for package in self._packages:
                now = _read(package.file)
                self._used += now - package.last if now >= package.last else now + package.most - package.last
                package.last = now
        except (OSError, ValueError) as error:
            self.unavailable = of_system(error) if isinstance(error, OSError) else f"RAPL: {error}"
            return None
        return self._used / 1e6


def _read(file: Path) -> int:
    return int(file.read_text())
