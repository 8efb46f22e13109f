"""Judges the pictures of tests with many cases: makes references, keeps them, and gives verdicts."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from harness.judge import judge, reference
from harness.process.repetition import Result
from harness.renderer.parameters import Parameters
from harness.scene.flatten import flatten
from harness.scene.model import Scene
from harness.scene.needs import needs

# Methods that are naive on purpose and change the right picture: the reference is made with the same method.
NAIVE = {"fresnel": True, "phong": True, "csg": False}  # whether pixels of such a picture may be no numbers
NO_NUMBER = 1e3  # replaces pixels that are not finite in such a picture and in its reference


class Court:
    """Judges pictures; makes each reference once."""

    def __init__(self, bench):
        self.bench, self.kept = bench, {}

    def reference(self, makers: tuple[str, ...], scene: Scene, parameters: Parameters, masked: bool = True):
        """The Reference of a picture, made by the first of the variants `makers` that has its naive methods."""
        needed = needs(scene, parameters)
        naive = naive_of(parameters, needed)
        entries = [entry for entry in map(self.bench.known.get, makers) if entry and not entry.unavailable]
        fits = (e for e in entries if all(value in e.methods.get(name, ()) for name, value in naive.items()))
        maker = next(fits, None)
        assert maker, f"none of {', '.join(makers)} is here and has {naive}"
        key = scene, maker.name, reference.job_of(parameters), parameters.precision, tuple(naive.items()), masked
        if key not in self.kept:

            def run(entry, arrays, wanted, needed, cache):
                wanted = self.bench.sharing(entry, replace(wanted, **naive), needed)
                result = self.bench.run(entry, arrays, wanted, needed)
                return (
                    replace(result, array=told(result.array)) if may_break(naive) and result.status == "ok" else result
                )

            needed = reference.needs_of(needed)
            found = reference.make(maker, flatten(scene), parameters, needed, self.bench.caches, run, masked)
            assert isinstance(found, reference.Reference), found
            self.kept[key] = found
        return self.kept[key]

    def wrong(
        self,
        makers: tuple[str, ...],
        scene: Scene,
        parameters: Parameters,
        result: Result,
        beside: Callable[[], np.ndarray | float] = lambda: 0.0,
    ) -> str | None:
        """None, or what is wrong with the picture and the counts of a Result.

        beside: makes what each pixel may be off by beside the tolerance, (height, width). That and the mask take dozens
        of pictures: they are made only where some pixel or count does not agree.
        """
        return self._wrong(makers, scene, parameters, result) and self._wrong(
            makers, scene, parameters, result, True, beside
        )

    def _wrong(self, makers, scene, parameters, result, masked=False, beside=lambda: 0.0):
        found = self.reference(makers, scene, parameters, masked)
        broken = may_break(naive_of(parameters, needs(scene, parameters)))
        picture = told(result.array) if broken else result.array
        verdict = judge.judge(picture, found, parameters.precision, bound=beside())
        wrong = verdict.wrong or _counts(result.said.rays, found, parameters.precision)
        if result.said.rays["non_finite"] and not broken:
            wrong = wrong or f"{result.said.rays['non_finite']} samples are not finite"
        return f"by {found.maker}: {wrong}" if wrong else None


def naive_of(parameters: Parameters, needed: tuple[str, ...]) -> dict[str, str]:
    """The naive methods of a picture; CSG is stepped through only where there is a solid."""
    chosen = {name: getattr(parameters, name) for name in NAIVE if name != "csg" or "csg" in needed}
    return {name: value for name, value in chosen.items() if value != getattr(Parameters, name)}


def may_break(naive: dict[str, str]) -> bool:
    return any(NAIVE[name] for name in naive)


def told(picture: np.ndarray) -> np.ndarray:
    """The picture with NO_NUMBER in the pixels that are not finite."""
    return np.where(np.isfinite(picture).all(axis=-1, keepdims=True), picture, NO_NUMBER)


def _counts(counts: dict, found, precision: str) -> str | None:
    """None, or how ray counts differ by more than rounding and the ill-conditioned pixels can make of them."""
    masked = float(found.mask.mean())
    for kind in ("primary", "reflected", "transmitted", "shadow"):
        right = found.rays[kind]
        share = 0 if precision == "float64" and not masked else judge.RAY_TOLERANCE[precision] + 4 * masked
        if abs(counts[kind] - right) > max(share * right, 2 * bool(share)):
            return f"{counts[kind]} {kind} rays, expected {right}"
    return None
