# Every target sets up what it needs; PYTHON names the interpreter if the default does not fit.

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
SHELL := /bin/sh

PYTHON ?= python3
WORKERS ?= 2
TRIAL ?= bondsight-out/blind
VENV := .venv
BIN := $(VENV)/bin
AGAIN = [ ! -e $(VENV)/.core ] || echo "bringing the environment in $(VENV) up to date"
PIP := $(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check

.PHONY: help environment demo test lint types tests coverage docs proofs proof proof-quick wheel bench notebooks format clean

help:
	@echo "make demo       set up and show what the project does"
	@echo "make test       set up, then lint, types, tests, pages"
	@echo "make coverage   set up, then the tests with coverage by line"
	@echo "make docs       set up, then build the documentation"
	@echo "make proofs     set up, then proofs and tests of more than a minute"
	@echo "make proof      set up, then the sealed trial into the folder TRIAL (hours; resumes)"
	@echo "make proof-quick  set up, then a sealed trial of sixty from a new seed (ten minutes)"
	@echo "make wheel      set up, then build the wheel and try it in an empty environment"
	@echo "make bench      set up, then measure times and memory"
	@echo "make notebooks  set up, then run every notebook"
	@echo "make format     set up, then rewrite the sources as the linter wants them"
	@echo "make clean      remove the environment and all caches"

environment: $(VENV)/.test

demo: $(VENV)/.core
	$(BIN)/bondsight demo

bench: $(VENV)/.core
	$(BIN)/bondsight bench

# With -j 2 types are checked while tests wait for a device.
test: lint types tests

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.test
	$(BIN)/mypy -n $(WORKERS)

tests: $(VENV)/.test
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --durations=15

coverage: $(VENV)/.test
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --cov --cov-report=term

docs: $(VENV)/.test
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html
	@echo docs/_build/html/index.html

proofs: $(VENV)/.test
	$(BIN)/python -m pytest -m long

# Generate only where nothing is committed yet; an interrupted run goes on. Every gate that failed
# ends it with an error after all is written.
proof: $(VENV)/.core
	[ -e $(TRIAL)/commitment.json ] || $(BIN)/bondsight blind generate --kind trial --folder $(TRIAL)
	$(BIN)/bondsight blind run --folder $(TRIAL)
	status=0; $(BIN)/bondsight blind score --folder $(TRIAL) || status=$$?; \
	$(BIN)/bondsight blind withheld --folder $(TRIAL) && exit $$status

proof-quick: $(VENV)/.core
	$(BIN)/bondsight blind quick

wheel: $(VENV)/.core
	$(BIN)/python -m tests.proof.wheel

notebooks: $(VENV)/.test
	@found=; for n in notebooks/*.py; do \
	  [ -e "$$n" ] || continue; found=yes; echo "$$n"; \
	  $(BIN)/jupytext --to ipynb --output "$${n%.py}.ipynb" "$$n" && \
	  $(BIN)/jupyter-execute --inplace "$${n%.py}.ipynb" || exit 1; \
	done; [ -n "$$found" ] || echo "notebooks: there is none"

format: $(VENV)/.test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .coverage htmlcov docs/_build

# An interpreter of at least 3.11: PYTHON if it is one, else the newest python3.x on the path.
# Without ensurepip (some distributions split it off) the outer pip fills the environment.
$(BIN)/python:
	@echo "setting up the environment in $(VENV): about two minutes the first time"
	@set -e; chosen=; \
	for p in $(PYTHON) python3 python3.14 python3.13 python3.12 python3.11 python; do \
	  if command -v "$$p" >/dev/null 2>&1 && \
	     "$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	    chosen=$$p; break; fi; \
	done; \
	if [ -z "$$chosen" ]; then \
	  echo "no Python >= 3.11 found; install one or call make PYTHON=..." >&2; exit 1; fi; \
	if "$$chosen" -c 'import ensurepip' 2>/dev/null; then "$$chosen" -m venv --clear $(VENV); \
	else "$$chosen" -m venv --clear --without-pip $(VENV); \
	  "$$chosen" -m pip --python $(BIN)/python install --quiet --quiet pip; fi
	-@$(PIP) --upgrade pip

$(VENV)/.core: pyproject.toml | $(BIN)/python
	@$(AGAIN)
	@$(PIP) -e .
	@touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	@$(AGAIN)
	@$(PIP) -e '.[test,dev]'
	@touch $@ $(VENV)/.core
