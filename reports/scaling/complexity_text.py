"""Says in sentences where the study's equation 4.1 holds for a variant and where not."""

import numpy as np
import pandas as pd

from harness.statistics.digits import percentage
from reports.paper import quantity
from reports.run.cell import Missing
from reports.scaling.complexity_models import COUNTED, FAR, ORDERS, STUDY, Fitted, Power
from reports.scaling.complexity_points import FACTORS

GOOD, FAIR = 0.10, 0.20  # by which a model is off
MUCH, MOST = 1.5, 3  # times the processes' own scatter: of a larger spread, noise is 1/2.25 or 1/9 of the variance


def sentences(fit: Fitted) -> list[str]:
    """Returns texts of one or two sentences each."""
    texts = [_holds(fit, STUDY, "Equation 4.1 as written"), _ends(fit, STUDY), *_exponents(fit), _depth(fit)]
    return [text for text in [*texts, _local(fit), *_rays(fit), *_negative(fit)] if text]


def power(value: Power) -> str:
    """Returns an exponent with its interval, or why it is unavailable."""
    exponent = value.exponent
    return str(exponent) if isinstance(exponent, Missing) else quantity.interval(*exponent)


def _fitted(fit: Fitted, model: str) -> pd.DataFrame:
    """Returns the points that a model was fitted to, with how far it is off as `error`.

    The study's model has no work where d = 0.
    """
    points = fit.series.points.assign(error=fit.errors[model])
    return points[points["d"] > 0] if model == STUDY else points


def _holds(fit: Fitted, model: str, name: str) -> str:
    line = fit.line(model)
    if line is None:
        return f"{name}: {fit.lines[model]}."
    points = _fitted(fit, model)
    off = points["error"].abs()
    count = len(points)
    if off.max() <= FAIR:
        beyond = int((off > GOOD).sum())
        some = f", and within {percentage(GOOD)} in all but {beyond}" if beyond else ""
        verdict = f"holds within {percentage(FAIR if beyond else GOOD)} in all {count} cells{some}"
    else:
        worst = points.loc[off.idxmax()]
        where = ", ".join(f"{name} = {worst[name]:g}" for name in FACTORS)
        verdict = (
            f"does not hold: in {int((off > FAIR).sum())} of {count} cells it is more than {percentage(FAIR)} off, "
            f"most at {where}, where it is {_off(worst['error'])}"
        )
    return f"{name} {verdict}. {_spread(line.spread, fit.series.points['noise'])}"


def _spread(spread: float, noise: pd.Series) -> str:
    """Compares the spread of a model with the scatter of the processes."""
    own = float(np.sqrt((noise**2).mean()))
    text = f"Its relative residuals have a spread of {percentage(spread)}"
    if not np.isfinite(own):
        return f"{text}; one process a cell tells nothing of how much of it is noise."
    share = "nearly all of it is" if spread > MOST * own else "more than half of it is" if spread > MUCH * own else ""
    why = f"{share} the model's" if share else "which noise may explain"
    return f"{text}, where the processes' own scatter gives {percentage(own)}: {why}."


def _off(error: float) -> str:
    return f"{percentage(abs(error))} too {'high' if error > 0 else 'low'}"


def _ends(fit: Fitted, model: str) -> str:
    """Names the ends of factors where the model is off by more in the median than GOOD, the worst first."""
    if fit.line(model) is None:
        return ""
    points = _fitted(fit, model)
    ends = []
    for name in fit.series.varied:
        for which, value in (("smallest", points[name].min()), ("largest", points[name].max())):
            error = points.loc[points[name] == value, "error"].median()
            ends.append((abs(error), f"{_off(error)} where {name} is {which} ({value:g})"))
    ends.sort(reverse=True)
    beyond = [text for size, text in ends if size > FAIR]
    some = [text for size, text in ends if GOOD < size <= FAIR]
    if not beyond + some:
        return f"At no end of a factor is it off by more than {percentage(GOOD)} in the median."
    parts = [f"beyond {percentage(FAIR)}: {', '.join(beyond)}"] * bool(beyond)
    parts += [f"beyond {percentage(GOOD)}: {', '.join(some)}"] * bool(some)
    return f"In the median at the ends of the factors it is {'; '.join(parts)}."


def _exponents(fit: Fitted) -> list[str]:
    """Gives the exponents of the study's factors, and those of objects and lights separately."""
    of = {model: [value for value in fit.powers if value.model == model] for model in (STUDY, ORDERS)}
    powers = [value for value in of[STUDY] if not isinstance(value.exponent, Missing)]
    if not powers:
        why = next((value.exponent for value in of[STUDY] if value.low < value.high), of[STUDY][0].exponent)
        return [f"Exponents: {why}."]
    texts = [
        f"Exponents, from {powers[0].cells} cells of at least {FAR} times a: {_judged(powers)}. "
        + (f"There a is up to {percentage(fit.share)} of the time, which lowers the model's own." if fit.share else "")
    ]
    pair = [value for value in of[ORDERS] if value.factor in ("o", "l") and not isinstance(value.exponent, Missing)]
    if len(pair) == 2:
        texts.append(f"Objects and lights apart: {_judged(pair)}.")
    return texts


def _judged(powers: list[Power]) -> str:
    """Lists exponents, and those that differ from the model's."""
    text = ", ".join(f"of {value.factor} {power(value)} (the model's {value.expected:.3g})" for value in powers)
    other = [value.factor for value in powers if value.differs]
    same = [value.factor for value in powers if not value.differs]
    judged = [f"beyond its interval another than the model's: {', '.join(other)}"] * bool(other)
    return "; ".join([text, *judged, *[f"the model's within it: {', '.join(same)}"] * bool(same)])


def _depth(fit: Fitted) -> str:
    """Says the effective depth at the largest d, and by how much p d overstates the rays of paths."""
    points = fit.series.points
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


def _local(fit: Fitted) -> str:
    """Says what the model misses at d = 0, and how d + 1 orders change it."""
    orders = fit.line(ORDERS)
    text = "" if orders is None else f"With d + 1 orders in place of d the spread is {percentage(orders.spread)}."
    errors = fit.errors.loc[fit.series.points["d"] == 0, STUDY].dropna()
    if errors.empty:
        return text
    share = percentage(1 + errors.median())
    return (
        f"Where d = 0 ({len(errors)} cell{'s' * (len(errors) != 1)}, not in that fit) equation 4.1 leaves a alone, "
        f"which is {share} of the measured time (median): it forgets the local light, of order 0. {text}"
    )


def _rays(fit: Fitted) -> list[str]:
    """Says whether counted rays improve the study's model."""
    counted, study = fit.line(COUNTED), fit.line(STUDY)
    if counted is None:
        return [f"With the rays that were counted: {fit.lines[COUNTED]}."]
    texts = [
        _holds(fit, COUNTED, "With the rays that were counted, T = a + b·rays·(o + l)"),
        _ends(fit, COUNTED),
        *_exponents_of_rays(fit),
    ]
    if study is None:
        return texts
    before, after = study.spread, counted.spread
    if before <= GOOD and after <= GOOD:
        verdict = "There was little for counting rays to mend"
    elif after <= before / 2:
        verdict = "Counting rays mends most of it"
    else:
        verdict = f"Counting rays mends {'a part' if after < 0.9 * before else 'nothing'}"
    return [*texts, f"{verdict}: the spread goes from {percentage(before)} to {percentage(after)}."]


def _exponents_of_rays(fit: Fitted) -> list[str]:
    powers = [value for value in fit.powers if value.model == COUNTED and not isinstance(value.exponent, Missing)]
    if not powers:
        return []
    low = any(value.factor == "o + l" and value.differs and value.exponent.value < value.expected for value in powers)
    why = " That of o + l is low, as if a ray also cost something beside objects and lights." if low else ""
    return [f"Exponents with them: {_judged(powers)}.{why}"]


def _negative(fit: Fitted) -> list[str]:
    """A time that depends on nothing cannot be negative: the line is then bent."""
    return [
        f"a of {model} is negative beyond its interval, which no time can be: time against this work is bent."
        for model in fit.lines
        if (line := fit.line(model)) and line.a.high < 0
    ]
