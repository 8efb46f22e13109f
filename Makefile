# The two commands of the README, and a few for those who work on rayrace.
PYTHON ?= python3
BIN = .venv/bin

study: .venv/installed  ## run the study's comparison and write its report
	$(BIN)/rayrace run experiments/comparison.toml --report

test: .venv/installed  ## all tests, the fast ones first
	$(BIN)/ruff check .
	$(BIN)/pytest -q -m "not slow"
	$(BIN)/pytest -q -m slow

quick: .venv/installed  ## the fast tests alone
	$(BIN)/pytest -q -m "not slow"

smoke: .venv/installed  ## every renderer at 32 x 32
	$(BIN)/rayrace run experiments/smoke.toml

format: .venv/installed
	$(BIN)/ruff format .

.venv/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -c constraints.txt -e '.[test]'
	touch $@

clean:  ## forget the environment; results stay
	rm -rf .venv build dist *.egg-info

.PHONY: study test quick smoke format clean
