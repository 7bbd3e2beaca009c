# The whole workflow: `make demo`, `make test`, `make check`.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
# On a terminal pip shows what it does; in a log it is quiet.
PIP    := $(BIN)/python -m pip --disable-pip-version-check $(if $(MAKE_TERMOUT),,--quiet)
# Bytecode is made when a module is first imported: for all of them it takes as long as the rest.
INSTALL := $(PIP) install --no-compile -c constraints.txt

# What `make wheel` compiles for and what: levels of x86-64, or `generic` elsewhere.
LEVELS ?= $(if $(filter x86_64 amd64,$(shell uname -m)),x86-64-v2 x86-64-v3 x86-64-v4,generic)
WARM   ?= --for all

.PHONY: demo demo-hardware test check docs dist lowest benchmarl format wheel clean

demo: $(VENV)/.core
	$(BIN)/relpos demo

# Emulated nodes and cars behind pseudo terminals, driven through the whole hardware path.
demo-hardware: $(VENV)/.hardware
	$(BIN)/relpos demo-hardware

test: $(VENV)/.dev
	$(BIN)/relpos warmup --for all
	$(BIN)/python -m pytest -n auto --dist loadscope -m 'not realtime'
	$(BIN)/python -m pytest -m realtime

check: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tests/words.py

# The documentation as a site, build/docs/index.html; DOCS_ONLINE=1 links to other projects.
docs: $(VENV)/.dev
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q -b html docs build/docs

# Source distribution and wheel; the wheel is installed into an empty environment, and README.md
# is run there, block by block.
dist: $(VENV)/.dev
	rm -rf dist build/dist-env
	$(BIN)/python -m build --no-isolation --outdir dist .
	$(PYTHON) -m venv build/dist-env
	build/dist-env/bin/python -m pip --disable-pip-version-check install --quiet --no-compile \
	  -c constraints.txt "$$(ls dist/*.whl)[train,hardware]"
	$(BIN)/python tests/run_readme.py build/dist-env/bin

# Whether everything imports with the lowest versions that pyproject.toml admits.
lowest: .venv-lowest/.installed
	.venv-lowest/bin/python tests/lowest_versions.py import

.venv-lowest/.installed: pyproject.toml
	@echo "installing the lowest versions into .venv-lowest ..."
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/python -m pip --disable-pip-version-check --quiet install $$($(PYTHON) tests/lowest_versions.py)
	@touch $@

# Training with BenchMARL, on top of the development tools: it needs an older TorchRL than they have.
benchmarl: $(VENV)/.dev build/benchmarl/.installed
	PYTHONPATH=$(abspath build/benchmarl) $(BIN)/python -m pytest tests/relpos_env/test_benchmarl.py

build/benchmarl/.installed: Makefile
	@rm -rf build/benchmarl
	$(PIP) install --no-deps --target build/benchmarl benchmarl==1.5.2 torchrl==0.11.1 \
	  tensordict==0.11.0 hydra-core==1.3.2 omegaconf==2.3.0 antlr4-python3-runtime==4.9.3
	@touch $@

# A wheel with compiled kernels for common processors; two minutes on two cores for each of them.
wheel: $(VENV)/.dev
	@rm -rf build/kernels
	@for level in $(LEVELS); do \
	  echo "compiling for $$level ..."; mkdir -p build/kernels/$$level; \
	  tar c --exclude=__pycache__ --exclude=__compiled__ tracking relpos_env agents hardware_bridge \
	    | tar x -C build/kernels/$$level; \
	  (cd build/kernels/$$level && env -u NUMBA_CACHE_DIR NUMBA_CPU_NAME=$$level NUMBA_CPU_FEATURES= \
	    PYTHONPATH=. $(abspath $(BIN))/python -m agents.cli.main warmup $(WARM)) || exit 1; \
	done
	RELPOS_KERNELS=build/kernels $(PIP) wheel --no-deps --no-build-isolation --wheel-dir dist .

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit("relpos-env needs Python 3.11 or newer" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

# A stamp per set of dependencies: a second run installs nothing.
$(VENV)/.core: pyproject.toml constraints.txt | $(BIN)/python
	@[ -e $(VENV)/.dev ] && [ $(VENV)/.dev -nt pyproject.toml ] && [ $(VENV)/.dev -nt constraints.txt ] \
	  || { echo "installing relpos-env into $(VENV) ..."; $(INSTALL) -e .; }
	@touch $@

$(VENV)/.dev: pyproject.toml constraints.txt | $(BIN)/python
	@echo "installing relpos-env and its development tools into $(VENV) ..."
	$(INSTALL) -e '.[dev]'
	@touch $@ $(VENV)/.core

$(VENV)/.hardware: pyproject.toml constraints.txt | $(BIN)/python
	@[ -e $(VENV)/.dev ] && [ $(VENV)/.dev -nt pyproject.toml ] && [ $(VENV)/.dev -nt constraints.txt ] \
	  || { echo "installing relpos-env for hardware into $(VENV) ..."; $(INSTALL) -e '.[hardware]'; }
	@touch $@ $(VENV)/.core

clean:
	rm -rf build dist $(VENV) .venv-lowest demo demo-hardware .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
