"""Energy of the processor while a repetition rendered: the `energy` of its row, from its series.

power_w                 mean over the phase `render`
energy_j, energy_s      used between the first and the last tick in that phase, and the time between the two
joules_per_frame, joules_per_mray      energy_j over the frames, and over the rays, in that time

Each is a number, or {"unavailable": reason}; where all are missing for one reason, that is the whole. The energy is of
the packages: what idles there, and what others use, included.
"""

from pathlib import Path

from harness.process.process import Outcome
from harness.race.gpu_use import Render, value_or_reason
from harness.race.series import ticks
from harness.renderer.events import Said
from harness.system.nvml import AVAILABLE

VALUES = "power_w", "energy_j", "energy_s", "joules_per_frame", "joules_per_mray"
COLUMN = "package_energy_j"
SHORTEST = 0.1  # s of rendering: a hundred steps of the counters


class OfPackages(Render):
    """The phase `render` by the counters of the packages."""

    counter, shortest = COLUMN, SHORTEST

    def power_w(self) -> float:
        return self.energy_j() / self.energy_s()

    def joules_per_frame(self) -> float:
        return self.energy_j() / self.renders()


def use(said: Said, outcome: Outcome, series: Path) -> dict:
    """The values of one repetition."""
    why = "the measurer died" if outcome.measurer is None else outcome.measurer["package_energy"]
    if why:
        return {"unavailable": why}
    render = OfPackages.of(said, outcome, ticks(series), {COLUMN: AVAILABLE})
    if isinstance(render, str):
        return {"unavailable": render}
    return {name: value_or_reason(getattr(render, name)) for name in VALUES}
