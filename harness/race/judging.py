"""Judges the pictures of one run: their agreement with a reference by another renderer, and their errors.

References and truths are made when first asked for, stored in the run, and kept for other runs (cache.py).
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from harness.judge import bound, certificate, hits, judge, reference, truth
from harness.judge.cache import Kept
from harness.judge.reference import NoReference, Reference
from harness.judge.truth import Truth
from harness.picture import perception
from harness.plan.plan import Cell, Plan
from harness.process import repetition
from harness.process.session import Sessions
from harness.race import frames
from harness.race.host import Host
from harness.renderer import job
from harness.renderer.parameters import Parameters
from harness.renderer.registry import Entry
from harness.store import record, store


class Judging:
    """Judges the pictures of a run. caches: folder for compiled code. untimed: runs what they are judged by."""

    def __init__(
        self, plan: Plan, entries: dict[str, Entry], folder: Path, caches: Path, host: Host, untimed: Sessions
    ):
        self.plan, self.entries, self.folder, self.caches, self.untimed = plan, entries, folder, caches, untimed
        self.kept = Kept(host.references)
        self.wanted = plan.truths.wanted
        self.made: dict[str, tuple] = {}  # what was made, and its files, by content
        self.seen: dict[tuple[str, str], dict] = {}  # perception by picture and what it is beside
        self.compared: dict[tuple, dict] = {}
        self.stored: set[str] = set()  # files of dropped weights
        self.truth_s: float | None = None  # of the last picture: how long its truth took; None if it was there
        self.clock = host.clock

    def judge(
        self, cell: Cell, result: repetition.Result, picture: dict | None
    ) -> tuple[dict, dict | None, dict | None, str | None]:
        """`agreement`, `error` and `bound` of a record (store.py), and why the picture is wrong, or None.

        picture: where the array of `result` is stored; None for hits.
        """
        self.truth_s = None
        if cell.parameters.kind == "rays":
            return self._hits(cell, result)
        limit, bounded = self._bound(cell, result, picture)
        broken = judge.broken(result)
        expected, files = self._reference(cell)
        if isinstance(expected, NoReference):
            agreement, wrong, mask = {"unavailable": expected.reason}, broken, None
        else:
            verdict, wrong = self._verdict(cell, result, expected, limit)
            agreement, mask = {"reference": expected.maker, **files, **verdict.record()}, expected.mask
            wrong = wrong or broken
        if cell.whole:  # whose errors are distances from the truth of a larger scene
            whole, _ = self._reference(cell.whole)
            mask = None if isinstance(whole, NoReference) else whole.mask
        return agreement, self._error(cell, result.array, picture, mask, broken), bounded, wrong

    def frame(self, cell: Cell, job: Parameters, result: repetition.Result, first: np.ndarray) -> str | None:
        """None, or why the picture of a later frame is wrong, or UNCHECKED why nobody knows (frames.fault)."""
        arrays, needs = self.plan.arrays[cell.scene_version], reference.needs_of(cell.needs)
        judges = reference.judges_of(arrays, cell.parameters)
        maker = reference.choose(cell.entry, self.entries, cell.parameters, needs, judges)
        cache = self.caches / f"{maker and maker.name}.reference"
        self.untimed.close()  # no other renderer runs beside the one that makes the reference
        try:
            return frames.fault(job, result, first, cell.entry, arrays, cell.needs, maker, cache, self.untimed.run)
        finally:
            self.untimed.close()

    def _hits(self, cell: Cell, result: repetition.Result):
        """`judge` of a list of hits, whose truth is the reference."""
        expected, files = self._reference(cell)
        if isinstance(expected, NoReference):
            return {"unavailable": expected.reason}, None, None, None
        verdict = hits.judge(result.array, expected, cell.parameters.precision)
        agreement = {"reference": expected.maker, **files, **verdict.record()}
        error = {"truth": expected.maker, "against": "hits", "max": record.largest(agreement)}
        error |= {"bad_pixels": verdict.bad_pixels, "mask_fraction": verdict.mask_fraction}
        return agreement, error, None, verdict.wrong

    def _verdict(self, cell: Cell, result: repetition.Result, expected: Reference, limit):
        precision, external = cell.parameters.precision, cell.entry.renderer.manifest.external
        verdict = judge.judge(result.array, expected, precision, external, limit)
        wrong = verdict.wrong
        if not external and "cutoff" not in cell.needs:  # others count other things, and the reference cuts nothing off
            wrong = wrong or judge.compare_rays(result.said.rays, expected.rays, precision)
        return verdict, wrong

    def _bound(self, cell: Cell, result: repetition.Result, picture: dict):
        """Returns the bound of what a cut-off may have changed in each pixel, and `bound` of the record."""
        if result.dropped is None:
            return 0.0, None
        arrays, depth = self.plan.arrays[cell.scene_version], cell.parameters.depth
        limit = bound.bound(arrays, depth, result.dropped)
        name = picture["file"].removesuffix(".npy") + ".dropped.npy"
        if name not in self.stored:
            store.save_whole(self.folder / name, result.dropped)
            self.stored.add(name)
        radiance = float(bound.radiance(arrays, depth).max())
        return limit, {
            "radiance": radiance,
            "max": float(limit.max()),
            "mean": float(limit.mean()),
            "dropped_file": name,
        }

    def _error(self, cell: Cell, picture: np.ndarray, kept: dict, mask: np.ndarray | None, broken: str | None) -> dict:
        if broken:
            return {"unavailable": broken}
        count, begun = len(self.made), self.clock()
        ground_truth, files = self._truth(cell, mask)
        if len(self.made) > count:
            self.truth_s = self.clock() - begun
        if isinstance(ground_truth, NoReference):
            return {"unavailable": ground_truth.reason}
        if picture.shape != ground_truth.picture.shape:
            return {"unavailable": f"its shape is {picture.shape}, the truth's {ground_truth.picture.shape}"}
        key = kept["sha256"], files["truth_file"]
        if key not in self.compared:
            self.compared[key] = judge.errors(
                picture, ground_truth.picture, ground_truth.standard_error, mask, ground_truth.doubt
            )
        seen = self._perceive(cell, picture, kept, ground_truth.picture, files["truth_file"])
        facts = {
            "truth": ground_truth.maker,
            "against": self.plan.truths.of(cell).against,
            **files,
            **ground_truth.facts(),
        }
        return {**facts, **self.compared[key], **seen}

    def _perceive(self, cell: Cell, picture: np.ndarray, kept: dict, right: np.ndarray, file: str) -> dict:
        """Computes the perceptual difference once for each picture; its map is stored beside the picture."""
        key = kept["sha256"], file
        if key not in self.seen:
            difference = perception.perceive(picture, right, cell.parameters.arithmetic)
            name = kept["file"].removesuffix(".npy") + ".flip.npy"
            store.save_whole(self.folder / name, difference.flip_map)
            self.seen[key] = {**difference.record(), "flip_file": name}
        return self.seen[key]

    def _reference(self, cell: Cell) -> tuple[Reference | NoReference, dict]:
        """The reference for a cell, and its files."""
        needs = reference.needs_of(cell.needs)
        judges = reference.judges_of(self.plan.arrays[cell.scene_version], cell.parameters)
        maker = reference.choose(cell.entry, self.entries, cell.parameters, needs, judges)
        if maker is None:
            return NoReference("no other renderer here can make this picture"), {}

        def make():
            arrays, cache = self.plan.arrays[cell.scene_version], self.caches / f"{maker.name}.reference"
            way = hits if cell.parameters.kind == "rays" else reference
            return way.make(maker, arrays, cell.parameters, needs, cache, self.untimed.run)

        key = reference.key(maker, cell.scene_version, cell.parameters)
        return self._once(key, make, Reference.stored, Reference.restored)

    def _truth(self, cell: Cell, mask: np.ndarray | None) -> tuple[Truth | NoReference, dict]:
        """The truth that a cell's picture is held against, with its files and certificate."""
        truth_job = self.plan.truths.of(cell)
        maker = truth.choose(self.entries, truth_job)
        if maker is None:
            return NoReference("no renderer here can make its truth"), {}

        def make():
            try:
                return truth.make(truth_job, maker, arrays, self.caches / f"{maker.name}.reference", self.untimed.run)
            except LookupError as error:
                return NoReference(str(error))

        version = (cell.whole or cell).scene_version
        arrays = self.plan.arrays[version]
        key = truth.key(truth_job.shown, self.wanted, maker, version)
        ground_truth, files = self._once(key, make, Truth.stored, Truth.restored, lambda kept: kept.serves(truth_job))
        if isinstance(ground_truth, Truth):
            files = {"truth_file": files["truth_file"], "standard_error_file": files.get("standard_error_file")}
            certified = self._certificate(key, cell, maker, ground_truth, mask)
            if certified.get("wrong"):
                text = f"{certified['wrong']} of {certified['spots']} spots, by {certified['largest']:.2g} at the most"
                return NoReference(f"the truth by {maker.name} is not what 60 digits make in {text}"), {}
            files["certificate"] = certified
        return ground_truth, files

    def _certificate(self, key: str, cell: Cell, maker: Entry, ground_truth: Truth, mask: np.ndarray | None) -> dict:
        """Certifies single pixels of a truth in 60 digits (certificate.py); of one that is a mean, of a picture with
        few of its samples."""
        truth_job, spots, seconds = self.plan.truths.of(cell), self.wanted.spots, self.wanted.spot_seconds
        if spots == 0:
            return {"unavailable": "not asked for: reference.spots is 0, or the experiment has no [reference]"}
        sampled = ground_truth.standard_error is not None
        if not sampled and mask is None:
            return {"unavailable": "there is no mask"}
        mask = None if sampled else mask

        def make():
            arrays = self.plan.arrays[(cell.whole or cell).scene_version]
            cache = self.caches / f"{maker.name}.reference"
            picture, parameters = ground_truth.picture, truth.certifiable(truth_job, ground_truth)
            if sampled:
                result = self.untimed.run(maker, arrays, parameters, truth_job.needs, cache=cache)
                if result.status != "ok":
                    return {"unavailable": f"{maker.name}: {result.status}: {result.reason}"}
                picture = result.array
            about = self.entries, arrays, parameters, truth_job.needs, spots, seconds
            return certificate.certify(picture, mask, *about, stray=sampled or truth_job.deepen)

        depth = ground_truth.depth, ground_truth.cutoff
        key = job.fingerprint({} if mask is None else {"mask": mask}, key, depth, ground_truth.seeds[0], spots, seconds)
        certified, _ = self._once(key, make, lambda made: (made, {}), lambda facts, _: facts)
        return certified

    def _once(self, key: str, make: Callable, pack: Callable, unpack: Callable, good=lambda kept: True) -> tuple:
        """Returns the result of `make` and its files in the run; reuses one of this run or a good one of another.

        pack: it as facts for JSON and arrays, which become files; unpack: the other way.
        """
        if key in self.made:
            return self.made[key]
        kept = self.kept.get(key)
        product = unpack(*kept) if kept else None
        reused = product is not None and good(product)
        if not reused:
            self.untimed.close()  # no other renderer runs beside the one that makes it
        try:
            product = product if reused else make()
        finally:
            self.untimed.close()  # nothing is there while others are measured
        files = {}
        if not isinstance(product, NoReference):
            facts, arrays = pack(product)
            if not reused and "unavailable" not in facts:
                self.kept.put(key, facts, arrays)
            content = job.fingerprint(arrays)  # a resumed run may find another truth, or reference, than before
            for name, array in arrays.items():
                files[f"{name}_file"] = f"pictures/{content}.{name}.npy"
                store.save_whole(self.folder / files[f"{name}_file"], array)
        self.made[key] = product, files
        return self.made[key]
