# `make demo` and `make test` need Python 3.11 to 3.13, pip and make; they set up the rest in .venv.
# Settings: PYTHON=python3.12 (the interpreter), VENV=folder, CONSTRAINTS= (empty: newest versions
# instead of the tested ones), PROCESSES=4 (that run tests at once).

PYTHON ?= python3 python3.13 python3.12 python3.11
VENV ?= .venv
CONSTRAINTS ?= constraints.txt
PROCESSES ?= 2

python := $(VENV)/bin/python
# pip repeats a general warning of setuptools about editable installations; all else is shown. It
# compiles sources by one process, and not those that are editable: `compile` takes all processors.
pip_install := PYTHONWARNINGS='ignore:Editable installation' $(python) -m pip install --quiet \
	--no-compile --disable-pip-version-check --no-input $(addprefix --constraint ,$(CONSTRAINTS))
compile = $(python) -m compileall -qq -j 0 $(VENV)/lib engine_dyn sweeps || :
# Each process that a test starts would compile the sources again where Python keeps no bytecode: that
# takes longer than most of these tests.
pytest := PYTHONDONTWRITEBYTECODE= $(python) -m pytest -n $(PROCESSES) --dist worksteal
checked := $(wildcard engine_dyn sweeps oracle tests tools benchmarks conftest.py)
typed := $(wildcard engine_dyn sweeps oracle tools benchmarks)

.NOTPARALLEL:
.DELETE_ON_ERROR:
.PHONY: help environment demo check test coverage lint imports types docs validation worked-examples calibrate data-sheet misfire-map transients bench bench-gpu bench-kernels studies rates compile-times warm-run stress \
	large-runs large-study reliability faults soak properties fuzz damage wheel dist lock licences clean distclean

help:
	@echo "make demo        the thesis's parametric study: out/thesis.nc, out/figures"
	@echo "make check       the first tier: lint and the quick tests (4 to 5 min; more after a change of engine_dyn)"
	@echo "make test        every test (20 min)"
	@echo "make coverage    which lines of engine_dyn the tests reach, with the compiler off (5 min)"
	@echo "make lint types  ruff and the rules of imports, mypy"
	@echo "make imports     who imports whom, against the contracts of pyproject.toml"
	@echo "make environment all that these commands need, installed at once"
	@echo "make docs        the site of the documentation, in out/docs (3 min; 15 s where only pages have changed)"
	@echo "make validation  docs/validation.md: every published number beside ours"
	@echo "make worked-examples  docs/worked_examples.md: examples of textbooks, printed and computed (15 s)"
	@echo "make calibrate   fit the modelled diagrams of the catalogue engines again"
	@echo "make data-sheet  write docs/data_sheet.md, whose commands it runs"
	@echo "make misfire-map write docs/misfire_detection.md and its figure: a few minutes"
	@echo "make transients  write docs/transients.md and its figure, with rates of this machine: a minute"
	@echo "make bench       docs/benchmarks.md: run time against error, beside other solvers (15 min)"
	@echo "make bench-gpu   how fast an NVIDIA card solves sampled designs, as a table to paste (5 min at most)"
	@echo "make studies     the table of studies alone, on the terminal (5 min; STUDIES='--quick --only sampled')"
	@echo "make rates       seconds behind the times of engine-dyn plan, measured here (5 min; RATES='--part 0.1')"
	@echo "make compile-times  processor time of compiling: run thesis, each study, all studies (10 min; COMPILE_TIMES='--short')"
	@echo "make bench-kernels  the kernels alone, so that a slow-down shows (pytest-benchmark)"
	@echo "make warm-run    a warm run of two designs: its calls, the functions on the way, milliseconds"
	@echo "make stress      docs/trust.md: ten million absurd designs and two million sampled ones, checked (25 min)"
	@echo "make large-runs  docs/reliability/large_runs.csv: 10^8 designs, a hundred killed runs, killed workers (1 h)"
	@echo "make large-study a V6 over eight parameters: least inertia, front, Sobol' indices of 2.6 million designs (1 min; LARGE_STUDY='--points 4194304': 84 million)"
	@echo "make reliability docs/trust.md: every promise, its tests, the figures of the last runs"
	@echo "make faults      every system call of a run made to fail once, and the run killed there (20 min)"
	@echo "make soak        2000 runs in one process, many threads and processes at once (10 min)"
	@echo "make properties  scenes of every kind, drawn: against the oracle, in parts, alone (1 h)"
	@echo "make fuzz        hostile files of every kind for ten minutes: all must be refused in one line"
	@echo "make damage      a hundred thousand damaged archives: none may hang or be taken for sound (1 h)"
	@echo "make wheel       dist/*.whl"
	@echo "make dist        the source distribution, and the wheel that is built from it"
	@echo "make lock        requirements*.txt: the tested versions with the hashes of their files"
	@echo "make licences    the licence of every installed package"
	@echo "make clean       remove results and caches (distclean: and the virtual environment)"

demo: $(VENV)/.installed
	$(VENV)/bin/engine-dyn run thesis -o out/thesis.nc --overwrite
	$(VENV)/bin/engine-dyn plot out/thesis.nc -o out/figures

# Tests marked `quick` reach every kind of kernel; the others need no kernel, or simple ones.
check: lint
	$(pytest) -q -m 'not slow and (quick or not compiled)'

test: $(VENV)/.installed-test
	$(pytest)

# Which lines of the kernels ran: the compiler hides that. It proves no number that `make test` does not.
coverage: $(VENV)/.installed-test
	$(python) -m coverage erase
	NUMBA_DISABLE_JIT=1 $(python) -m coverage run -m pytest -n $(PROCESSES) --dist worksteal -q \
		-m 'not compiled and not slow' tests/engine_dyn
	$(python) -m coverage combine --quiet
	$(python) -m coverage report

lint: $(VENV)/.installed-lint imports
	$(python) -m ruff check $(checked)
	$(python) -m ruff format --check $(checked)

imports: $(VENV)/.installed-lint
	$(VENV)/bin/lint-imports --no-cache --no-logo

types: $(VENV)/.installed-lint
	$(python) -m mypy $(typed)

# Any warning is an error: links within the site lead somewhere.
docs: $(VENV)/.installed-docs
	$(python) -m sphinx --quiet --fail-on-warning --keep-going --builder html docs out/docs -d out/doctrees
	@echo "open out/docs/index.html"

validation: $(VENV)/.installed-test
	$(python) tools/validation.py

worked-examples: $(VENV)/.installed-test
	$(python) tools/worked_examples.py

calibrate: $(VENV)/.installed-test
	$(python) tools/calibrate_ntua.py
	$(python) tools/fit_ntua_rows.py
	$(python) tools/calibrate_catalogue.py

data-sheet: $(VENV)/.installed-test
	$(python) tools/data_sheet.py

misfire-map: $(VENV)/.installed-test
	$(python) tools/misfire_map.py

transients: $(VENV)/.installed-test
	$(python) tools/transients.py

# Settings: BENCH=--quick (a minute or two, into out/bench).
bench: $(VENV)/.installed-bench
	$(python) -m benchmarks $(BENCH)

# Needs a card: CONSTRAINTS= where its driver asks for other versions. Settings: BENCH_GPU='--seconds 2', and others.
bench-gpu: $(VENV)/.installed-test
	@$(pip_install) --editable '.[test,gpu]'
	$(python) -m benchmarks gpu $(BENCH_GPU)

# Settings: STUDIES='--quick --only sampled v6_load', and others.
studies: $(VENV)/.installed-test
	$(python) -m benchmarks studies $(STUDIES)

# Writes sweeps/scene/plan/rates.py. Settings: RATES='--part 0.1', and others.
rates: $(VENV)/.installed-test
	$(python) -m benchmarks rates $(RATES)

# Empty caches of its own. Settings: COMPILE_TIMES='--keep' (docs/benchmarks.md too), '--short', and others.
compile-times: $(VENV)/.installed-test
	$(python) -m benchmarks compile-times $(COMPILE_TIMES)

warm-run: $(VENV)/.installed-test
	$(python) -m benchmarks warm-run

bench-kernels: $(VENV)/.installed-bench
	$(python) -m pytest benchmarks/test_kernels.py

# Settings: STRESS='--designs 100000 --sample 500 --sampled 20000 --checked 2 -o out/stress' (a few minutes), and others.
stress: $(VENV)/.installed-test
	$(python) -m benchmarks stress $(STRESS)
	$(python) tools/reliability.py

# Settings: LARGE_RUNS='--designs 1000000 --kills 5 -o out/large_runs.json' (minutes), and others.
large-runs: $(VENV)/.installed-test
	$(python) -m benchmarks large-runs $(LARGE_RUNS)

# Into out/large_study.nc. Settings: LARGE_STUDY='--points 4194304 --resume', and others.
large-study: $(VENV)/.installed-test
	$(python) -m benchmarks large-study $(LARGE_STUDY)

# From what the commands around this one have measured.
reliability: $(VENV)/.installed-test
	$(python) tools/reliability.py

# Needs Linux and gcc. Settings: FAULTS='--first 2500 --points 12000', and others.
faults: $(VENV)/.installed-test
	$(python) -m benchmarks faults $(FAULTS)

# Settings: SOAK='--runs 10000', and others.
soak: $(VENV)/.installed-test
	$(python) -m benchmarks soak $(SOAK)

# Settings: PROPERTIES='--scenes 200 --seed 7', and others.
properties: $(VENV)/.installed-test
	$(python) -m benchmarks properties $(PROPERTIES)

# Settings: FUZZ='--seconds 3600', and others.
fuzz: $(VENV)/.installed-test
	$(python) -m benchmarks fuzz $(FUZZ)

# Settings: DAMAGE='--seed 7 --first 5000 --number 1000000', and others.
damage: $(VENV)/.installed-test
	$(python) -m benchmarks damage $(DAMAGE)

# build/ is removed first: setuptools would pack what an earlier build left there.
wheel: $(VENV)/.installed
	rm -rf build dist
	$(python) -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .

# The wheel is built from the source distribution, which so is known to be whole.
dist: $(VENV)/.installed-release
	rm -rf build dist
	$(python) -m build --outdir dist .

# For all platforms and Python from 3.11 on; the versions are those of constraints.txt.
lock: $(VENV)/.installed-release
	tools/lock.sh $(VENV)/bin/uv requirements.txt parquet torsion cluster lab excel exchange optimise report explore study
	tools/lock.sh $(VENV)/bin/uv requirements-test.txt test lint docs

licences: $(VENV)/.installed-release
	$(VENV)/bin/pip-licenses --from=mixed --order=license --with-urls

clean:
	rm -rf out build dist *.egg-info .coverage .numba_cache .pytest_cache .hypothesis .mypy_cache .ruff_cache
	find $(checked) -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV)

# The environment. Python itself is a prerequisite of what is installed: after a change of the
# interpreter its time is newer, and everything is installed again.
$(python):
	@set -e; \
	for candidate in $(PYTHON); do \
	  if $$candidate -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null; \
	  then found=$$candidate; break; fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo "none of '$(PYTHON)' is Python 3.11 to 3.13; name one: make PYTHON=/path/to/python3 ..." >&2; exit 1; \
	fi; \
	echo "setting up $(VENV) with $$($$found --version)"; \
	if ! $$found -m venv --clear $(VENV) >/dev/null 2>&1; then \
	  : "Debian without python3-venv has no ensurepip: pip then comes from outside"; \
	  $$found -m venv --clear --without-pip $(VENV); \
	  $$found -m pip --python $(python) install --quiet --disable-pip-version-check --no-input pip \
	    || { rm -rf $(VENV); exit 1; }; \
	fi

# What all targets but `bench` need, at once: sooner than one after the other.
environment: $(python) pyproject.toml $(CONSTRAINTS)
	@$(pip_install) --editable '.[test,lint,docs,release]'
	@$(compile)
	@touch $(addprefix $(VENV)/.installed,'' -test -lint -docs -release)

$(VENV)/.installed: $(python) pyproject.toml $(CONSTRAINTS)
	@echo "installing engine-dyn and what the README needs"
	@$(pip_install) --editable '.[study,optimise,report]'
	@$(compile)
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	@echo "installing what the tests need"
	@$(pip_install) --editable '.[test]'
	@$(compile)
	@touch $@

$(VENV)/.installed-lint: $(VENV)/.installed-test
	@echo "installing what the checks need"
	@$(pip_install) --editable '.[test,lint]'
	@$(compile)
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	@echo "installing what the documentation needs"
	@$(pip_install) --editable '.[docs]'
	@$(compile)
	@touch $@

$(VENV)/.installed-release: $(VENV)/.installed-test
	@$(pip_install) --editable '.[release]'
	@$(compile)
	@touch $@

$(VENV)/.installed-bench: $(VENV)/.installed-test
	@echo "installing what the benchmarks compare with"
	@$(pip_install) --editable '.[bench]'
	@$(compile)
	@touch $@
