"""GPU use of one repetition while it rendered: the `gpu` of its row, from its series and the measurer's audit.

utilisation_percent, power_w      means over the phase `render`, of values that look back on nothing else
energy_j, energy_s      used between the first and the last tick in that phase, and the time between the two
joules_per_mray      energy_j over the rays of the frames, and parts of frames, in that time
process_memory_bytes      the largest over the life of the process
temperature_c, throttled      the largest, and every reason seen but "idle", in the phase `render`

Each is a number, or {"unavailable": reason}.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from harness.process.process import Outcome
from harness.race.series import ticks
from harness.renderer.events import Said
from harness.system.nvml import AVAILABLE, NO_TICK, TOO_SOON

VALUES = (
    *("utilisation_percent", "power_w", "energy_j", "energy_s", "joules_per_mray"),
    *("process_memory_bytes", "temperature_c", "throttled"),
)
# s of rendering, below which utilisation, power and energy are not told: the period of utilisation is up to 1 s, and
# the energy counter moves about every 0.1 s.
SHORTEST = 1.0


class Missing(Exception):
    """The text says why a value is not there."""


def unavailable(reason: str) -> dict:
    """Every value, for one reason."""
    return {name: {"unavailable": reason} for name in VALUES}


def use(said: Said, outcome: Outcome, series: Path) -> dict:
    """The values of one repetition."""
    if outcome.measurer is None:
        return unavailable("the measurer died")
    render = OfGpu.of(said, outcome, ticks(series), outcome.measurer["gpu"])
    return (
        unavailable(render)
        if isinstance(render, str)
        else {name: value_or_reason(getattr(render, name)) for name in VALUES}
    )


def value_or_reason(ask):
    """What `ask` returns, or {"unavailable": reason}."""
    try:
        return ask()
    except Missing as missing:
        return {"unavailable": str(missing)}


@dataclass
class Render:
    """The phase `render`, with the life around it. Times in s since the start of the process."""

    start: float
    end: float
    frames: list[tuple[float, float, int]]  # start, end and renders
    rays: int | None  # of one render
    ticks: list[dict]  # rows of the series
    states: dict[str, str]  # of its columns: AVAILABLE, or why there are no values
    audit: dict

    counter: ClassVar[str]  # the column of energy, J
    shortest: ClassVar[float]  # s of rendering, below which nothing is told

    @classmethod
    def of(cls, said: Said, outcome: Outcome, ticks: list[dict], states: dict[str, str]) -> Self | str:
        """That of a repetition, or why there is none."""
        phases = [phase for phase in said.phases if phase["name"] == "render"]
        if not phases:
            return "it told of no phase render"
        start, end = (stamp - outcome.spawned for stamp in (phases[0]["start"], phases[-1]["end"]))
        frames = [(f["start"] - outcome.spawned, f["end"] - outcome.spawned, f["renders"]) for f in said.frames]
        rays = said.rays and sum(said.rays[kind] for kind in ("primary", "reflected", "transmitted", "shadow"))
        return cls(start, end, frames, rays, ticks, states, outcome.measurer)

    def energy_j(self) -> float:
        (_, first), (_, last) = self._span()
        return last - first

    def energy_s(self) -> float:
        (start, _), (end, _) = self._span()
        return end - start

    def joules_per_mray(self) -> float:
        if not self.rays:
            raise Missing("it does not count its rays" if self.rays is None else "it has no rays")
        return self.energy_j() / (self.rays * self.renders()) * 1e6

    def renders(self) -> float:
        """The frames, and parts of frames, between the first and the last tick."""
        (start, _), (end, _) = self._span()
        inside = [n * max(0.0, min(b, end) - max(a, start)) / (b - a) for a, b, n in self.frames if b > a]
        if not sum(inside):
            raise Missing("no frame lies between the first and the last tick")
        return sum(inside)

    def _span(self):
        """(time, counter of energy) of the first and the last tick."""
        self._long_enough(self.counter)
        readings = self._values(self.counter, self.start, self.end)
        if len(readings) < 2:
            raise Missing("fewer than two ticks in the phase render")
        return readings[0], readings[-1]

    def _long_enough(self, column: str) -> None:
        if self.end - self.start < self.shortest and self.states[column] in (AVAILABLE, NO_TICK, TOO_SOON):
            raise Missing(self._short(self.shortest))

    def _short(self, window: float) -> str:
        return f"too short to sample: {self.end - self.start:.3g} s of rendering, the window is {window:.3g} s"

    def _values(self, column: str, start: float, end: float, kind=float, window: float = 0.0) -> list[tuple]:
        """(time, value) of the ticks from start to end that have one; Missing if none has."""
        if self.states[column] != AVAILABLE:
            raise Missing(self.states[column])
        rows = [(float(tick["t"]), tick[column]) for tick in self.ticks if tick[column]]
        values = [(t, kind(value)) for t, value in rows if start <= t <= end]
        if not values:
            raise Missing(self._short(max(window, self.audit["interval_s"])))
        return values


class OfGpu(Render):
    """The phase `render` by the counters of the GPU."""

    counter, shortest = "gpu_energy_j", SHORTEST

    def utilisation_percent(self) -> float:
        return self._mean("gpu_percent")

    def power_w(self) -> float:
        return self._mean("gpu_power_w")

    def process_memory_bytes(self) -> int:
        return int(max(value for _, value in self._values("gpu_process_memory_bytes", 0.0, float("inf"))))

    def temperature_c(self) -> float:
        return max(value for _, value in self._values("gpu_temperature_c", self.start, self.end))

    def throttled(self) -> list[str]:
        seen = self._values("gpu_throttle", self.start, self.end, str)
        return sorted({reason for _, text in seen for reason in text.split("; ")} - {"none", "idle"})

    def _mean(self, column: str) -> float:
        self._long_enough(column)
        window = self.audit["gpu_sources"].get(column, {}).get("window_s", 0.0)
        values = [value for _, value in self._values(column, self.start + window, self.end, window=window)]
        return sum(values) / len(values)
