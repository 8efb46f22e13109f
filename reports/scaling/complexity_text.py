"""Says in sentences where the study's equation 4.1 holds for a variant and where not."""

import numpy as np
import pandas as pd

from reports.paper import quantity
from reports.run.cell import Missing
from reports.scaling.complexity_models import COUNTED, FAR, ORDERS, STUDY, Fitted, Power
from reports.scaling.complexity_points import FACTORS

GOOD, FAIR = 0.10, 0.20  # by which a model is off
MUCH, MOST = 1.5, 3  # times the processes' own scatter: of a larger spread, noise is 1/2.25 or 1/9 of the variance


def sentences(found: Fitted) -> list[str]:
    """Returns texts of one or two sentences each."""
    told = [_holds(found, STUDY, "Equation 4.1 as written"), _ends(found, STUDY), *_exponents(found), _depth(found)]
    return [text for text in [*told, _local(found), *_rays(found), *_negative(found)] if text]


def power(value: Power) -> str:
    """Returns an exponent with its interval, or why it is unavailable."""
    found = value.exponent
    return str(found) if isinstance(found, Missing) else quantity.interval(*found)


def percent(share: float) -> str:
    """Formats a share below 1 in per cent; two digits below 10 %."""
    return f"{100 * share:.2g} %" if abs(share) < 0.0995 else f"{100 * share:.0f} %"


def _fitted(found: Fitted, model: str) -> pd.DataFrame:
    """Returns the points that a model was fitted to, with how far it is off as `error`.

    The study's model has no work where d = 0.
    """
    points = found.series.points.assign(error=found.errors[model])
    return points[points["d"] > 0] if model == STUDY else points


def _holds(found: Fitted, model: str, name: str) -> str:
    line = found.line(model)
    if line is None:
        return f"{name}: {found.lines[model]}."
    points = _fitted(found, model)
    off = points["error"].abs()
    count = len(points)
    if off.max() <= FAIR:
        beyond = int((off > GOOD).sum())
        some = f", and within {percent(GOOD)} in all but {beyond}" if beyond else ""
        verdict = f"holds within {percent(FAIR if beyond else GOOD)} in all {count} cells{some}"
    else:
        worst = points.loc[off.idxmax()]
        where = ", ".join(f"{name} = {worst[name]:g}" for name in FACTORS)
        verdict = (
            f"does not hold: in {int((off > FAIR).sum())} of {count} cells it is more than {percent(FAIR)} off, "
            f"most at {where}, where it is {_off(worst['error'])}"
        )
    return f"{name} {verdict}. {_spread(line.spread, found.series.points['noise'])}"


def _spread(spread: float, noise: pd.Series) -> str:
    """Compares the spread of a model with the scatter of the processes."""
    own = float(np.sqrt((noise**2).mean()))
    told = f"Its relative residuals have a spread of {percent(spread)}"
    if not np.isfinite(own):
        return f"{told}; one process a cell tells nothing of how much of it is noise."
    share = "nearly all of it is" if spread > MOST * own else "more than half of it is" if spread > MUCH * own else ""
    why = f"{share} the model's" if share else "which noise may explain"
    return f"{told}, where the processes' own scatter gives {percent(own)}: {why}."


def _off(error: float) -> str:
    return f"{percent(abs(error))} too {'high' if error > 0 else 'low'}"


def _ends(found: Fitted, model: str) -> str:
    """Names the ends of factors where the model is off by more in the median than GOOD, the worst first."""
    if found.line(model) is None:
        return ""
    points = _fitted(found, model)
    ends = []
    for name in found.series.varied:
        for which, value in (("smallest", points[name].min()), ("largest", points[name].max())):
            error = points.loc[points[name] == value, "error"].median()
            ends.append((abs(error), f"{_off(error)} where {name} is {which} ({value:g})"))
    ends.sort(reverse=True)
    beyond = [text for size, text in ends if size > FAIR]
    some = [text for size, text in ends if GOOD < size <= FAIR]
    if not beyond + some:
        return f"At no end of a factor is it off by more than {percent(GOOD)} in the median."
    told = [f"beyond {percent(FAIR)}: {', '.join(beyond)}"] * bool(beyond)
    told += [f"beyond {percent(GOOD)}: {', '.join(some)}"] * bool(some)
    return f"In the median at the ends of the factors it is {'; '.join(told)}."


def _exponents(found: Fitted) -> list[str]:
    """Gives the exponents of the study's factors, and those of objects and lights separately."""
    of = {model: [one for one in found.powers if one.model == model] for model in (STUDY, ORDERS)}
    known = [one for one in of[STUDY] if not isinstance(one.exponent, Missing)]
    if not known:
        why = next((one.exponent for one in of[STUDY] if one.low < one.high), of[STUDY][0].exponent)
        return [f"Exponents: {why}."]
    texts = [
        f"Exponents, from {known[0].cells} cells of at least {FAR} times a: {_judged(known)}. "
        + (f"There a is up to {percent(found.share)} of the time, which lowers the model's own." if found.share else "")
    ]
    pair = [one for one in of[ORDERS] if one.factor in ("o", "l") and not isinstance(one.exponent, Missing)]
    if len(pair) == 2:
        texts.append(f"Objects and lights apart: {_judged(pair)}.")
    return texts


def _judged(powers: list[Power]) -> str:
    """Lists exponents, and those that differ from the model's."""
    told = ", ".join(f"of {one.factor} {power(one)} (the model's {one.expected:.3g})" for one in powers)
    other = [one.factor for one in powers if one.differs]
    same = [one.factor for one in powers if not one.differs]
    judged = [f"beyond its interval another than the model's: {', '.join(other)}"] * bool(other)
    return "; ".join([told, *judged, *[f"the model's within it: {', '.join(same)}"] * bool(same)])


def _depth(found: Fitted) -> str:
    """Says the effective depth at the largest d, and by how much p d overstates the rays of paths."""
    points = found.series.points
    deepest = points[points["d"] == points["d"].max()].dropna(subset="depth")
    d = points["d"].max()
    if deepest.empty or d == 0:
        return ""
    over = deepest["p"] * d / deepest["paths"]
    judged = f"p·d is {_range(over)} times the rays along paths"
    if over.between(1 - GOOD, 1 + GOOD).all():
        judged += ": d is a fair count"
    elif over.min() > 1:
        judged += ", since paths end where they leave the scene"
    rays = _range(deepest["depth"])
    return f"Effective depth: at d = {d:g} a primary ray and all that follow it are {rays} rays; {judged}."


def _range(values: pd.Series) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high} (median {values.median():.3g})"


def _local(found: Fitted) -> str:
    """Says what the model misses at d = 0, and how d + 1 orders change it."""
    orders = found.line(ORDERS)
    text = "" if orders is None else f"With d + 1 orders in place of d the spread is {percent(orders.spread)}."
    errors = found.errors.loc[found.series.points["d"] == 0, STUDY].dropna()
    if errors.empty:
        return text
    share = percent(1 + errors.median())
    return (
        f"Where d = 0 ({len(errors)} cell{'s' * (len(errors) != 1)}, not in that fit) equation 4.1 leaves a alone, "
        f"which is {share} of the measured time (median): it forgets the local light, of order 0. {text}"
    )


def _rays(found: Fitted) -> list[str]:
    """Says whether counted rays improve the study's model."""
    counted, study = found.line(COUNTED), found.line(STUDY)
    if counted is None:
        return [f"With the rays that were counted: {found.lines[COUNTED]}."]
    told = [
        _holds(found, COUNTED, "With the rays that were counted, T = a + b·rays·(o + l)"),
        _ends(found, COUNTED),
        *_exponents_of_rays(found),
    ]
    if study is None:
        return told
    before, after = study.spread, counted.spread
    if before <= GOOD and after <= GOOD:
        verdict = "There was little for counting rays to mend"
    elif after <= before / 2:
        verdict = "Counting rays mends most of it"
    else:
        verdict = f"Counting rays mends {'a part' if after < 0.9 * before else 'nothing'}"
    return [*told, f"{verdict}: the spread goes from {percent(before)} to {percent(after)}."]


def _exponents_of_rays(found: Fitted) -> list[str]:
    known = [one for one in found.powers if one.model == COUNTED and not isinstance(one.exponent, Missing)]
    if not known:
        return []
    low = any(one.factor == "o + l" and one.differs and one.exponent.value < one.expected for one in known)
    why = " That of o + l is low, as if a ray also cost something beside objects and lights." if low else ""
    return [f"Exponents with them: {_judged(known)}.{why}"]


def _negative(found: Fitted) -> list[str]:
    """A time that depends on nothing cannot be negative: the line is then bent."""
    return [
        f"a of {model} is negative beyond its interval, which no time can be: time against this work is bent."
        for model in found.lines
        if (line := found.line(model)) and line.a.high < 0
    ]
