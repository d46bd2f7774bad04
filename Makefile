# make install   the environment, in .venv
# make demo      one dive end to end with the simulated vehicle
# make test      every test, of the long ones a short form
# make check     format, lint, types, import rules, then every test
# make docs      docs/reference and docs/reliability.md, from the code and what was measured
# make pictures  docs/images, from dives of the simulated vehicle
# make bench     every benchmark, into docs/benchmarks.md; resumes where it stopped
# make wheel     seatrial's own wheel, in dist/, for pipx and pip; docs/install.md
# make bundle    one archive in dist/ that installs without a net; docs/offline.md
# make soak      the long form of every test, and what `make test` leaves out: hours, into docs/reliability.md; then
#                small changes to the code, which tests must notice, into docs/benchmarks.md
# make power     how large each hidden effect has to be to be named: hours, into docs/benchmarks.md; resumes where it stopped

PYTHON ?= python3
PIP_FLAGS ?=
MACHINES ?= x86_64 aarch64
PYTHONS ?= 3.11 3.12 3.13
PYTEST_FLAGS ?= -n 4 --dist loadfile --no-loadscope-reorder

BIN := .venv/bin
STAMP := .venv/.installed
COMPILED := .venv/.compiled
KERNELS := $(shell grep -rl --include='*.py' '^@njit' bench bridge identify)
TORCH := $(shell sed -n 's/^ *"torch==\([0-9.]*\)".*/\1/p' pyproject.toml)
PIP := $(BIN)/python -m pip --disable-pip-version-check install $(PIP_FLAGS)
# Of all that pip says: what it fetches, where that is large, and that it installs.
LARGE := sed -n 's/^ *\(Downloading\|Using cached\) \(.*\/\)*\([A-Za-z0-9_.]*\)-[0-9].*(\([0-9.]* [MG]B\)).*/  \3, \4/p; s/^Installing collected.*/  installing what was fetched .../p'
# pip with these arguments; sed would hide how it ended.
pip = { rm -f .venv/.done; { $(PIP) $(1) && touch .venv/.done; } | $(LARGE); rm .venv/.done 2>/dev/null; }
# By a name: the comma would end the argument of pip.
WITH_BENCH := --editable '.[dev,bench]'

.PHONY: install demo test lint check format docs pictures bench power soak wheel bundle clean

install: $(STAMP)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "seatrial needs Python 3.11 or newer and $(PYTHON) is none; name one: make $(or $(MAKECMDGOALS),install) PYTHON=python3.12" >&2; \
	  exit 1; }
	@test -x $(BIN)/pip || $(PYTHON) -m venv --clear .venv || { \
	  echo "$(PYTHON) can't make a virtual environment; install its venv package (Debian, Ubuntu: python3-venv)" >&2; \
	  exit 1; }
	@echo "installing into .venv (PyTorch $(TORCH), its CPU build where there is one) ..."
	@$(call pip,"torch==$(TORCH)+cpu" 2>/dev/null) || $(call pip,"torch==$(TORCH)")
	@echo "what else it needs ..."
	@$(call pip,--editable '.[dev]')
	@touch $(STAMP)
	@echo "installed; try: $(BIN)/seatrial --help"

demo: $(STAMP)
	@$(BIN)/seatrial demo

# Libraries that each take every core would mostly wait for each other: a thread for each worker. Of four, two mostly
# wait, for a terminal, a browser or a link: enough for two cores, and for 6 GB. Bytecode is kept, for what they start.
test: $(COMPILED)
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python -m pytest -rs $(PYTEST_FLAGS)

# Numba can't read what it kept of a module that has another name by now.
$(COMPILED): $(STAMP) $(KERNELS) tests/kernels.py
	@find . -path ./.venv -prune -o -name '*.nb[ic]' -exec rm {} +
	@PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python tests/kernels.py
	@touch $(COMPILED)

lint: $(STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

check: lint test

format: $(STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: $(STAMP)
	$(BIN)/python -m docs.make

pictures: $(STAMP)
	$(BIN)/python -m docs.make.pictures

bench: $(COMPILED)
	@$(call pip,$(WITH_BENCH))
	$(BIN)/python -m bench

soak: $(STAMP)
	SEATRIAL_KEEP_FIGURES=1 $(BIN)/python -m pytest -rs -m soak
	$(BIN)/python -m docs.make
	$(BIN)/python -m bench mutants

power: $(STAMP)
	@$(call pip,$(WITH_BENCH))
	$(BIN)/python -m bench power

wheel:
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	@$(BIN)/python -m pip --disable-pip-version-check wheel --quiet $(PIP_FLAGS) --no-deps --wheel-dir dist .
	@ls dist/seatrial-*.whl

bundle: $(STAMP)
	@$(BIN)/python -m bundle --out dist --machines "$(MACHINES)" --pythons "$(PYTHONS)" --pip-flags "$(PIP_FLAGS)"

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis build dist *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
