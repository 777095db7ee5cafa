# make figures   set up .venv from the lock, then regenerate every figure
# make test      the same set-up, then unit tests, doctests and the notebooks
.PHONY: help figures films test fast coverage fuzz check study universes people worlds bench book data clean
.DEFAULT_GOAL := help

# The lock is for Python 3.11: the first of these that really is one.
PYTHON ?= $(shell for p in python3.11 python3 python; do \
	"$$p" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' >/dev/null 2>&1 && { echo "$$p"; break; }; done)
RUN := .venv/bin/python
export MPLBACKEND := Agg
# The matrices here are tiny: more threads only get into each other's way, and cost up to five times the time.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
# What is compiled once need not be compiled anew by every worker, and by every process that a test starts.
unexport PYTHONDONTWRITEBYTECODE

FUZZ_FILES ?= 20000
FUZZ_CALLS ?= 3000
FUZZ_KILLS ?= 100
FUZZ_SEED ?= 0

help:  ## this list
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## */\t/' | expand -t 12

figures: .venv/ready  ## simulate, observe, learn, perform and draw every figure into figures/
	$(RUN) -m dollop.figures

films: .venv/ready  ## film the laboratory beside the map: every film into films/, two at a time
	$(RUN) -m dollop.replication.films

# The last notebooks are the longest: begun first, they do not keep the other core waiting.
test: .venv/ready  ## unit tests, doctests, notebooks
	$(RUN) -m pytest -q
	env -u MPLBACKEND $(RUN) -m pytest --nbmake --nbmake-timeout=120 -n 2 -q -o addopts="" $$(ls -r notebooks/*.ipynb)

fast: .venv/ready  ## the tests of the library alone, without the replication
	$(RUN) -m pytest -q -m "not replication"

coverage: .venv/ready  ## which lines of the library its tests run
	$(RUN) -m pytest -q -m "not replication" --cov=dollop --cov-report=term

fuzz: .venv/ready  ## damaged files, hostile calls, kills: half an hour; FUZZ_FILES=100000 FUZZ_SEED="0 1" for others
	$(RUN) tests/fuzzing --files $(FUZZ_FILES) --calls $(FUZZ_CALLS) --seed $(FUZZ_SEED)
	$(RUN) tests/fuzzing/kills.py --kills $(FUZZ_KILLS) --seed 0
	$(RUN) tests/fuzzing/study_kills.py --kills $(FUZZ_KILLS) --seed 0
	$(RUN) tests/fuzzing/study_kills.py --kills $(FUZZ_KILLS) --seed 1 --at-once 4

check: .venv/ready  ## lint and formatting
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m nbstripout --verify notebooks/*.ipynb

# What the claims are judged by is frozen in study/criteria.json: `dollop study criteria --first-seed N` writes it anew.
study: .venv/ready  ## judge the paper's claims over two hundred seeds; goes on where it was
	$(RUN) -m dollop study

universes: .venv/ready  ## the claims where what the paper leaves open is chosen otherwise, a hundred times; goes on
	$(RUN) -m dollop study universes

people: .venv/ready  ## the claims that real people's walks can be asked; DOLLOP_EXTERNAL_DATA names the folder
	$(RUN) -m dollop study people

worlds: .venv/ready  ## the whole chain in 300 random worlds; goes on where it was
	$(RUN) -m dollop study worlds

bench: .venv/ready  ## benchmarks beside plain baselines, one thread
	$(RUN) -m benchmarks

book: .venv/ready  ## execute the notebooks and lay them out as HTML pages in build/book
	$(RUN) book/build.py

data: .venv/ready  ## remake the recordings in data/ that the notebooks read
	$(RUN) -m dollop data

clean:  ## remove .venv and caches; figures and recordings stay
	rm -rf .venv build *.egg-info .pytest_cache .hypothesis .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# movement_primitives comes as source. Built where there is no Cython it is pure Python, and needs no compiler.
.venv/ready: environment.txt pyproject.toml
	@test -n "$(PYTHON)" || { echo "Dollop needs Python 3.11, and none was found." >&2; \
	  echo "Get one: 'apt install python3.11 python3.11-venv', 'brew install python@3.11', 'pyenv install 3.11'," >&2; \
	  echo "or from python.org; then run make again, or name it: make PYTHON=/path/to/python3.11 ..." >&2; exit 1; }
	rm -rf .venv
	"$(PYTHON)" -m venv .venv || { echo "Python's venv module is missing: 'apt install python3.11-venv' on Debian and Ubuntu." >&2; exit 1; }
	$(RUN) -m pip install --quiet --disable-pip-version-check $$(grep -E '^(setuptools|wheel)==' environment.txt)
	$(RUN) -m pip install --quiet --disable-pip-version-check --no-build-isolation -r environment.txt
	$(RUN) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@
