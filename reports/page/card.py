"""Makes the card of a run: what a page of several runs shows of each."""

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from harness.errors import UserError
from harness.store import clean, confined
from harness.system import output
from reports.chart.embedded import Embedded
from reports.run.results import Results
from reports.summary import glance
from reports.times import headline

FILE = ".rayrace-card"  # in the folder of a report
ROOM = 60_000  # bytes of a picture
LONGEST = 1 << 20  # bytes of a card


@dataclass(frozen=True)
class Card:
    """A run on a page of several.

    title, sentence, raced, machine: texts. begun: ISO time. commit: of rayrace. processes: how many were stored.
    picture: address, "" without one.
    """

    title: str
    sentence: str
    raced: str
    machine: str
    begun: str
    commit: str
    processes: int
    picture: str


def of(results: Results) -> Card:
    """Returns the card of a run."""
    outcome, pictures = headline.of(results), Embedded(ROOM)
    seen = glance.pictures_of(results, outcome, pictures, most=1)
    facts = results.facts
    return Card(
        facts["title"],
        outcome.sentences[0],
        glance.raced(results, outcome),
        f"{facts['environment']['host']}: {glance.machine(results)}",
        facts["started"],
        facts["environment"]["commit"],
        len(results.records),
        pictures.images[seen[0][0]] if seen else "",
    )


def write(results: Results, folder: Path) -> Card:
    """Writes the card of a run into the folder of its report, and returns it."""
    made = of(results)
    output.text(folder / FILE, json.dumps(asdict(made)))
    return made


def read(folder: Path) -> Card:
    """Reads the card in the folder of a report. UserError if there is none."""
    try:
        card = Card(**clean.parsed(confined.content(folder / FILE, LONGEST)))
        if not all(type(getattr(card, field.name)) is field.type for field in fields(Card)):
            raise ValueError("a value of another type")
        if not (card.picture == "" or card.picture.startswith("data:image/")):
            raise ValueError("its picture is elsewhere")
        return card
    except (OSError, ValueError, TypeError) as error:
        raise UserError(f"{folder / FILE}: not a card of a report: {error}") from None
