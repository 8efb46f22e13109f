# The two commands of the README, and others for developers of rayrace.
PYTHON ?= python3
BIN = .venv/bin

study: .venv/installed  ## run the study's comparison and write its report
	$(BIN)/rayrace run experiments/comparison.toml --report
	@echo "on the disk:"; du -sh .venv results

# Most tests share the cores, with a process more than there are, as a test often waits; those that measure run alone.
SHARED = -n $$(($$(nproc) + 1)) --dist

test: measuring  ## all tests except `nightly`
	$(BIN)/pytest -q -m "not alone and not nightly" $(SHARED) loadscope --no-loadscope-reorder

quick: measuring  ## only the fast tests
	$(BIN)/pytest -q -m "not slow and not alone and not nightly" $(SHARED) loadfile

measuring: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/pytest -q -rs -m "not slow and alone and not nightly"

# The kernel's source is that of numba and is tested there; these tests check how a GPU runs it.
SIMULATED = $(addprefix tests/conformance/test_,covering.py hits.py)
SIMULATOR = RAYRACE_CUDASIM=1 $(BIN)/pytest -q -k numba-cuda

cudasim: .venv/installed  ## pairs of methods and first hits for numba-cuda in Numba's simulator of a GPU
	$(SIMULATOR) -n auto -m "not nightly" $(SIMULATED)

nightly: .venv/installed  ## the tests that `test` and `cudasim` leave out
	-$(BIN)/pip install -q -c constraints.txt -e '.[cuda]'
	-$(BIN)/pip install -q -c constraints.txt -e '.[fuzz]'
	$(MAKE) -k --no-print-directory night-shared night-alone night-hostile night-simulator

# Parts of the night, so that one runs though another has failed.
night-shared:
	$(BIN)/pytest -q -m "nightly and not alone" $(SHARED) worksteal

night-alone:
	$(BIN)/pytest -q -m "nightly and alone"
	$(SIMULATOR) -m "nightly and alone"

night-hostile:
	RAYRACE_FUZZ_CASES=100000 $(BIN)/pytest -q -k "test_cases or test_guided" $(SHARED) load tests/hostile

night-simulator:
	$(SIMULATOR) -n auto -m "nightly and not alone"

mutants: .venv/installed  ## changes the code in 135 random places and runs CI's tests on each change; SEED=word chooses others
	$(BIN)/pip install -q -c constraints.txt -e '.[mutation]'
	$(BIN)/pip install -q -c constraints.txt --no-deps universalmutator
	$(BIN)/python tests/support/mutants.py $(addprefix --seed=,$(SEED)) $(MORE)

ladder: .venv/installed  ## from the study's code to ours, one change at a time
	$(BIN)/rayrace run experiments/ladder.toml --report

gallery: .venv/installed  ## the study's figures, with scenes of our own
	$(BIN)/rayrace run experiments/gallery.toml --report

figures: .venv/installed  ## regenerates every table and figure from the reference results; measures nothing
	$(BIN)/rayrace report $(sort $(wildcard results/reference/*/*.tar.xz)) -o build/figures

# Runs with the minutes that each may take, 2 for each check and 3 for the scenes of features: 25 in all.
GPU_RUNS = gpu:5 launch-memory:3 launch-blocks:4 launch-threads:3 launch-faults:1 gpu-wait:2
MACHINE ?= $(shell hostname)
GPU = build/gpu/$(MACHINE)
PACKED ?= results/reference/$(MACHINE)

gpu: .venv/installed  ## all that a GPU's owner should run, in 25 minutes; again: what is left; MACHINE: its name in results/reference
	-$(BIN)/pip install -q -c constraints.txt -e '.[cuda,opencl]'
	mkdir -p $(GPU) $(PACKED)
	$(BIN)/rayrace doctor
	for checked in opencl numba; do \
	    test -f $(GPU)/checked-$$checked && continue; \
	    timeout --foreground 2m $(BIN)/rayrace check renderers/$$checked && touch $(GPU)/checked-$$checked; \
	    true; done
	-test -f $(GPU)/checked-scenes \
	    || timeout --foreground 3m $(BIN)/pytest -q -k at_real_sizes $(SHARED) worksteal tests/conformance/test_features.py \
	    && touch $(GPU)/checked-scenes
	for run in $(GPU_RUNS); do \
	    name=$${run%:*}; folder=$(GPU)/$$name; \
	    if [ -d $$folder ]; then into=--resume; else into=--out; fi; \
	    $(BIN)/rayrace run experiments/$$name.toml --set timeout='1 min' --max-minutes $${run#*:} $$into $$folder; \
	    rm -f $(GPU)/$$name.tar.xz; \
	    $(BIN)/rayrace export $$folder --format packed --no-pictures -o $(GPU)/$$name.tar.xz \
	        && mv $(GPU)/$$name.tar.xz $(PACKED); \
	    true; done
	@for checked in opencl numba; do \
	    test -f $(GPU)/checked-$$checked || echo "left: rayrace check renderers/$$checked"; done
	@test -f $(GPU)/checked-scenes || echo "left: pytest -k at_real_sizes tests/conformance/test_features.py"
	@echo "packed in $(PACKED); a run that is not whole says above what is left, and make gpu goes on with it"

docs: .venv/installed  ## the documentation as a site, in build/site, with reports of the reference results
	$(BIN)/pip install -q -c constraints.txt -e '.[docs]'
	$(BIN)/mkdocs build

stability: .venv/installed  ## where methods fail: runs every row of the catalogue and draws its charts
	$(BIN)/rayrace run experiments/stability.toml --report

smoke: .venv/installed  ## every renderer at 32 x 32
	$(BIN)/rayrace run experiments/smoke.toml

format: .venv/installed
	$(BIN)/ruff format .

.venv/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -c constraints.txt -e '.[test]'
	touch $@

clean:  ## removes the environment; keeps results
	rm -rf .venv .pytest_cache build/site build/figures dist *.egg-info

.PHONY: study test quick measuring cudasim nightly night-shared night-alone night-hostile night-simulator mutants figures gpu docs gallery ladder stability smoke format clean
