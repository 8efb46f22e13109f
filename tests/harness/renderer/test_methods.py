"""A choice or a method that is added to the one table is everywhere but in the renderers."""

import subprocess
import sys

from harness.renderer.methods import METHODS

ADDED = """
import types
from harness.renderer import methods

table = [m._replace(choices=(*m.choices, "dummy")) if m.name == "sphere" else m for m in methods.METHODS]
table.append(methods.Method("mosaic", ("plain", "dummy"), methods.ROUNDING, "mosaics", ("plain",)))
methods.METHODS = tuple(table)
methods.CHOICES = {m.name: m.choices for m in table}

import typer
from harness.experiment.experiment import Experiment
from harness.experiment.image import Image
from harness.judge import reference
from harness.process import repetition
from harness.renderer import registry
from harness.renderer.parameters import Parameters
from pydantic import ValidationError
from rayrace import main
from reports.run import command, method
from reports.stability import stability

chosen = {"sphere": "dummy", "mosaic": "dummy"}

# the schema, and the check of an experiment
schema = Experiment.model_json_schema()["$defs"]
for table in ("Image", "Case"):
    assert all("dummy" in str(schema[table]["properties"][name]) for name in chosen)
job = Image(**chosen).parameters(1, 0)
assert (job.values()["sphere"], job.values()["mosaic"], Parameters().mosaic) == ("dummy", "dummy", "plain")
try:
    Image(mosaic="dumy")
    raise AssertionError
except ValidationError as error:
    assert "'plain' or 'dummy'" in str(error)

# options, and the command that a report prints
commands = typer.main.get_command(main.app).commands
options = {(name, option.name): option for name in commands for option in commands[name].params}
assert options["render", "mosaic"].help == "plain or dummy." and options["render", "mosaic"].default == "plain"
assert all("wide or dummy" in options[name, "sphere"].help for name in ("render", "trace"))
assert ("needs", "mosaic") not in options
assert "--mosaic dummy" in command.of_job("a.txt", "cpp", job, "a.npy")

# a renderer that has it not, and the plain reference
cpp = registry.entries()["cpp"]
assert repetition.unsupported(cpp, Parameters(sphere="dummy"), ()) == (
    "has no sphere dummy (has robust, textbook, stable, wide)"
)
assert repetition.unsupported(cpp, Parameters(mosaic="dummy"), ()) == "has no mosaic dummy (has plain)"
assert reference.job_of(job).mosaic == "plain"

# names in reports
cell = types.SimpleNamespace(variant="cpp", parameters=job.values(), swept={})
name = method.Names([cell]).method(cell)
assert "dummy spheres" in name and "dummy mosaics" in name, name
assert stability.NAIVE["mosaic"] == ("plain",)
"""


def test_what_is_added_to_the_table_is_everywhere():
    done = subprocess.run([sys.executable, "-c", ADDED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_table():
    for method in METHODS:
        assert len(set(method.choices)) == len(method.choices) > 1
        assert set(method.naive) <= set(method.choices[1:])
