"""Covering arrays: sets of cases in which every allowed pair (or triple) of values occurs.

Compiling a kernel takes much longer than a case. So an array has two levels: covertable makes a few kernels with every
pair of their methods, and then cases are added that use these kernels wherever they can. At last kernels are given up
whose tuples fit into others.
"""

import random
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import combinations, product

from covertable import make

TRIES = 40  # random candidates per share, of which the best becomes a case
OTHERS = 150  # random cases that are there, which with the values that are wanted are candidates too

Case = dict[str, object]


@dataclass(frozen=True)
class Space:
    """The values of each factor, the default first, with the rules for cases and kernels.

    allowed: tells whether a case is allowed. If any case with some values is allowed, then the case with these values
    and all other defaults must be: this is how it is decided whether a tuple of values is possible. kernel: names the
    compiled code that a case uses (hashable). price: how many additional new tuples justify a new kernel for a case.
    begin: the values of the factors of the first kernels. fewer: the first kernels cover tuples of `strength - fewer`
    values. alike: for a value of a factor, the other values that compile to the same kernel.
    """

    factors: dict[str, tuple]
    allowed: Callable[[Case], bool]
    kernel: Callable[[Case], object]
    price: Callable[[Case], float]
    begin: dict[str, tuple] = field(default_factory=dict)
    fewer: int = 0
    alike: dict[str, dict] = field(default_factory=dict)

    @property
    def defaults(self) -> Case:
        return {name: values[0] for name, values in self.factors.items()}

    def all(self, strength: int) -> Iterator[frozenset]:
        """All tuples of `strength` values, each a set of (factor, value)."""
        for names in combinations(self.factors, strength):
            for values in product(*(self.factors[name] for name in names)):
                yield frozenset(zip(names, values, strict=True))

    def possible(self, strength: int) -> set[frozenset]:
        """All tuples of `strength` values that occur in an allowed case."""
        defaults = self.defaults
        return {wanted for wanted in self.all(strength) if self.allowed({**defaults, **dict(wanted)})}


def tuples(case: Case, strength: int) -> set[frozenset]:
    """The tuples of `strength` values that a case has."""
    return set(map(frozenset, combinations(case.items(), strength)))


def first_kernels(space: Space, strength: int, seed: str) -> list[Case]:
    """Values of the factors of kernels in which every allowed tuple of `strength - fewer` values occurs."""
    if not space.begin:
        return [{}]
    factors = {name: list(values) for name, values in space.begin.items()}
    never = [
        {"operator": "not", "condition": {"operator": "and", "conditions": [_is(*one), _is(*other)]}}
        for one, other in combinations([(name, value) for name, values in factors.items() for value in values], 2)
        if one[0] != other[0] and not space.allowed({**space.defaults, **dict((one, other))})
    ]
    return make(factors, strength=max(1, strength - space.fewer), salt=seed, constraints=never)


def _is(name: str, value) -> dict:
    return {"operator": "eq", "left": name, "value": value}


def cover(space: Space, strength: int, seed: str) -> list[Case]:
    """Cases in which every possible tuple of `strength` values occurs; cases of one kernel follow each other."""
    rng = random.Random(seed)
    missing = space.possible(strength)
    ready = [other for made in first_kernels(space, strength, seed) for other in _alike(space, made)]
    cases, used = [], {space.kernel({**space.defaults, **made}) for made in ready}

    def worth(case):
        return len(tuples(case, strength) & missing) - (space.kernel(case) not in used and space.price(case))

    for wanted in rng.sample(sorted(missing, key=_order), len(missing)):
        if wanted in missing:
            others = rng.sample(cases, min(len(cases), OTHERS))
            case = max(_candidates(space, dict(wanted), ready, others, rng), key=worth)
            used.add(space.kernel(case))
            cases.append(case)
            missing -= tuples(case, strength)
    cases = fewer_kernels(space, cases, strength, rng)
    order = {kernel: number for number, kernel in enumerate(dict.fromkeys(map(space.kernel, cases)))}
    return sorted(cases, key=lambda case: order[space.kernel(case)])


def fewer_kernels(space: Space, cases: list[Case], strength: int, rng: random.Random) -> list[Case]:
    """Cases with the same tuples and fewer kernels: it gives up each kernel whose tuples others can take over.

    A kernel was chosen before the later ones were known. The dearest, with the fewest cases, are tried first.
    """
    by_kernel: dict = {}
    for case in cases:
        by_kernel.setdefault(space.kernel(case), []).append(case)
    count = Counter(found for case in cases for found in tuples(case, strength))
    given_up = True
    while given_up:
        given_up = False
        for kernel in sorted(by_kernel, key=lambda one: (-space.price(by_kernel[one][0]), len(by_kernel[one]))):
            mine = by_kernel.pop(kernel)
            own = Counter(found for case in mine for found in tuples(case, strength))
            moved = _moved(space, {one for one, number in own.items() if number == count[one]}, by_kernel, rng)
            if moved is None:
                by_kernel[kernel] = mine
                continue
            given_up = True
            count -= own
            for case in moved:
                by_kernel[space.kernel(case)].append(case)
                count.update(tuples(case, strength))
    return [case for found in by_kernel.values() for case in found]


def _moved(space: Space, lost: set[frozenset], by_kernel: dict, rng: random.Random) -> list[Case] | None:
    """Cases of these kernels with the tuples `lost`, or None if some tuple finds no kernel. All tuples are as long."""
    there, moved = [case for found in by_kernel.values() for case in found], []
    for wanted in sorted(lost, key=_order):
        if wanted in lost:
            others = rng.sample(there, min(len(there), OTHERS)) + moved
            fit = [case | dict(wanted) for case in others]
            fit = [case for case in fit if space.allowed(case) and space.kernel(case) in by_kernel]
            if not fit:
                return None
            moved.append(max(fit, key=lambda case: len(tuples(case, len(wanted)) & lost)))
            lost = lost - tuples(moved[-1], len(wanted))
    return moved


def _order(wanted: frozenset) -> list[tuple]:
    return sorted((name, repr(value)) for name, value in wanted)


def _alike(space: Space, made: Case) -> Iterator[Case]:
    """`made`, and all values that compile to the same kernel."""
    choices = [(value, *space.alike.get(name, {}).get(value, ())) for name, value in made.items()]
    for values in product(*choices):
        yield dict(zip(made, values, strict=True))


def _candidates(
    space: Space, wanted: Case, ready: list[Case], others: list[Case], rng: random.Random
) -> Iterator[Case]:
    """Allowed cases with the values `wanted`.

    That with all defaults; random ones, of a kernel of `ready` if one fits; and `others`, whose kernel often stays as
    it is.
    """
    yield from filter(space.allowed, (case | wanted for case in others))
    fits = [made for made in ready if all(made.get(name, value) == value for name, value in wanted.items())]
    yield space.defaults | wanted
    for share in (1, 1, 0.3):  # of the values that are drawn; the others are defaults
        for _ in range(TRIES):
            case = {n: rng.choice(v) if rng.random() < share else v[0] for n, v in space.factors.items()}
            case |= (rng.choice(fits) if fits else {}) | wanted
            if space.allowed(case):
                yield case
