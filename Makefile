# make paper | test | verify | validate | soak | mutants | bench | docs | clean.  The Python that creates .venv: make PYTHON=python3.12 ...
PYTHON ?= python3
# What `make test` installs; EXTRAS=test,oracles adds the comparisons with other engines.
EXTRAS ?= test
# Processes that test, a file of tests at a time: make test WORKERS=8 where there are more cores.
WORKERS ?= 2

VENV := .venv
BIN := $(VENV)/bin
# Compiled Python is kept, for the other processes and tiers of tests.
export PYTHONDONTWRITEBYTECODE :=
comma := ,
# The package is installed in place, so that only these two files call for another installation.
INPUTS := pyproject.toml constraints.txt

.PHONY: paper test verify validate soak mutants bench docs clean

paper: $(VENV)/installed
	$(BIN)/continuair paper --out results/paper --check
	@echo "The results of every study are in $(CURDIR)/results."

test: $(VENV)/installed-$(subst $(comma),-,$(EXTRAS))
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache --no-logo
	@# One thread of BLAS: matrices are small here, and threads would wait for each other.
	OMP_NUM_THREADS=1 $(BIN)/pytest -q -n $(WORKERS) --dist loadfile -m "not (long or slow or soak)"

# The page is written whatever was reached; a claim that misses without an explanation fails.
verify: $(VENV)/installed-test-oracles
	@$(BIN)/pytest -q tests/oracles --verify verify.json; status=$$?; \
	  $(BIN)/python docs/make_trust.py verify.json && \
	  echo "The claims are in verify.json and docs/explanation/trust_claims.md." && exit $$status

# The folder of measured data, which are not part of this repository: make validate DATA=folder.
# A set that is not there is skipped, in words; figures from publications need no folder.
DATA ?= data
validate: $(VENV)/installed-test
	@for set in trunk tentacle; do \
	  OMP_NUM_THREADS=1 $(BIN)/python validation/$$set.py "$(DATA)" || exit 1; done
	@for set in tdcr aet helix; do \
	  OMP_NUM_THREADS=1 $(BIN)/python validation/$$set.py || exit 1; done
	@echo "The overview of the pages is docs/validation.md."

# An hour by default; MINUTES=600 for a night.
MINUTES ?= 60
soak: $(VENV)/installed-test
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.fuzz.soak --minutes $(MINUTES) --out docs/explanation/soak.md
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.fuzz.swarm --count 20000
	OMP_NUM_THREADS=1 $(BIN)/pytest -q -n $(WORKERS) --dist loadfile -m "slow or soak"

# Do the tests of `make test` notice one changed operation? COUNT=60 takes hours; it may be stopped,
# and goes on where it was.
COUNT ?= 60
mutants: $(VENV)/installed-test
	$(BIN)/python -m tests.fuzz.mutants --count $(COUNT) --workers $(WORKERS) --out mutants.jsonl

bench: $(VENV)/installed-test-oracles
	$(BIN)/pytest benchmarks/ --benchmark-only
	$(BIN)/python benchmarks/cold_start.py
	$(BIN)/python benchmarks/roofline.py
	$(BIN)/python benchmarks/compare.py

docs: $(VENV)/installed-docs
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html
	@echo "The documentation is docs/_build/html/index.html."

clean:
	rm -rf $(VENV) .peers docs/_build docs/gallery .mypy_cache .pytest_cache .ruff_cache .benchmarks .hypothesis

# Twice quiet: errors are told. Warnings are of the user's own settings of pip, such as an index that
# is not there, and come once for every package.
$(VENV)/installed: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --quiet -c constraints.txt -e .
	@touch $@

$(VENV)/installed-%: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --quiet -c constraints.txt -e ".[$(subst -,$(comma),$*)]"
	@touch $@

$(BIN)/python:
	@command -v "$(PYTHON)" > /dev/null || { \
	  echo "make: there is no $(PYTHON); name a Python 3.11 or newer: make PYTHON=python3.12" >&2; \
	  exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "make: $(PYTHON) is $$($(PYTHON) --version), but continuair needs Python 3.11 or newer;" \
	    "name one: make PYTHON=python3.12" >&2; \
	  exit 1; }
	"$(PYTHON)" -m venv $(VENV)
