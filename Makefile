# Every target sets up what it needs in .venv, says what it is doing, and works offline once set up.
# Needed beforehand: Python 3.11 or later, a Rust toolchain, make, and a package registry for the first run.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/.stamps

# Public recordings, used by the longer tests and studies when they lie beside the clone.
ifeq ($(HANDEYE_DATA),)
ifneq ($(wildcard ../shared/data),)
export HANDEYE_DATA := $(CURDIR)/../shared/data
endif
endif

# As in an activated shell: the tools find each other, the build its interpreter.
export PATH := $(CURDIR)/$(BIN):$(PATH)
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
export PIP_DISABLE_PIP_VERSION_CHECK := 1

RUST_SOURCES := $(shell find crates -type f \( -name '*.rs' -o -name Cargo.toml \))
EXTENSION := $(wildcard python/handeye/_core*.so python/handeye/_core*.pyd)

say = @printf '== %s\n'

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test check bench public docs build wheels lock clean distclean FORCE

help: ## list the targets
	@printf 'handeye: make TARGET, one of\n'
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: build ## drive a simulated arm under three policies, print the table, draw the picture, write the report
	$(say) 'handeye demo --cell out/demo --picture out/demo.png (half a minute on two cores)'
	@mkdir -p out && rm -rf out/demo
	@$(BIN)/handeye demo --cell out/demo --picture out/demo.png

test: check ## everything: the checks, the Rust tests, the Python tests, every example, every command in the README
	$(say) 'cargo test'
	@cargo test --workspace --locked --quiet
	$(say) 'pytest'
	@$(BIN)/python -m pytest $(PYTEST_ARGS)

check: build $(STAMPS)/dev ## format, lint, types, import directions
	$(say) 'cargo fmt --check'
	@cargo fmt --all --check
	$(say) 'cargo clippy'
	@cargo clippy --workspace --all-targets --locked --quiet -- -D warnings
	$(say) 'ruff check'
	@$(BIN)/ruff check .
	$(say) 'ruff format --check'
	@$(BIN)/ruff format --check .
	$(say) 'pyright'
	@$(BIN)/pyright --pythonpath $(BIN)/python
	$(say) 'lint-imports'
	@$(BIN)/lint-imports --no-logo
	$(say) 'tools/check_modules.py'
	@$(BIN)/python tools/check_modules.py

bench: build $(STAMPS)/bench ## measure solver and scorer on this machine, side by side with their peers
	@echo '#include <ceres/version.h>' | $${CXX:-c++} -x c++ -E - >/dev/null 2>&1 || \
		printf '== %s\n' 'without Ceres for C++, whose rows are left out; to have them: sudo apt-get install libceres-dev'
	$(say) 'handeye bench (about three minutes)'
	@$(BIN)/handeye bench --output benchmarks

public: build $(STAMPS)/public ## install what `handeye study public` compares with: other people's benchmark and renderer

docs: $(STAMPS)/dev ## build the documentation into docs/_build/html
	$(say) 'sphinx-build docs docs/_build/html'
	@$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	$(say) 'written: docs/_build/html/index.html'

build: $(STAMPS)/core ## build the Rust extension and install the package, editable, into .venv

# Robots run on both. A wheel serves every Python from 3.11 on and needs no Rust where it is installed.
ARM_TARGET := aarch64-unknown-linux-gnu
wheels: $(STAMPS)/run ## build dist/*.whl for this machine, and for 64-bit ARM where its Rust target is installed
	$(say) 'maturin build: this machine'
	@$(BIN)/maturin build --release --locked --out dist
	@if [ -d "$$($${RUSTC:-rustc} --print sysroot)/lib/rustlib/$(ARM_TARGET)/lib" ]; then \
		printf '== %s\n' 'maturin build: $(ARM_TARGET)' && \
		$(BIN)/maturin build --release --locked --out dist --target $(ARM_TARGET); \
	else \
		printf '== %s\n' 'no wheel for 64-bit ARM; to have it: rustup target add $(ARM_TARGET), and aarch64-linux-gnu-gcc'; \
	fi
	@ls -l dist

$(STAMPS)/run: requirements/run.txt
	@command -v $(PYTHON) >/dev/null || { echo 'Python 3.11 or later is needed: make PYTHON=/path/to/python3' >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo 'Python 3.11 or later is needed; this one is older. Try: make PYTHON=python3.12' >&2; exit 1; }
	@test -x $(BIN)/python || { printf '== %s\n' 'creating the virtual environment $(VENV)'; $(PYTHON) -m venv $(VENV); }
	$(say) 'installing the pinned packages of requirements/run.txt (a minute the first time)'
	@$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements/run.txt
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/dev: requirements/dev.txt $(STAMPS)/run
	$(say) 'installing the pinned packages of requirements/dev.txt (a minute the first time)'
	@$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements/dev.txt
	@mkdir -p $(STAMPS) && touch $@

# The peers that the benchmarks measure against; nothing else needs them.
$(STAMPS)/bench: requirements/bench.txt $(STAMPS)/run
	$(say) 'installing the pinned packages of requirements/bench.txt (a minute the first time)'
	@$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements/bench.txt
	@mkdir -p $(STAMPS) && touch $@

# Other people's benchmark and renderer, for `handeye study public`.
$(STAMPS)/public: requirements/public.txt $(STAMPS)/run
	$(say) 'installing the pinned packages of requirements/public.txt (a minute the first time)'
	@$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements/public.txt
	@mkdir -p $(STAMPS) && touch $@

# Rebuilt only when something it is made of has changed, or when the built library has been removed.
$(STAMPS)/core: $(STAMPS)/run $(RUST_SOURCES) Cargo.toml Cargo.lock pyproject.toml $(if $(EXTENSION),,FORCE)
	@command -v cargo >/dev/null || { echo 'a Rust toolchain (cargo, rustc) is needed' >&2; exit 1; }
	$(say) 'building the Rust core (two to four minutes the first time, seconds afterwards)'
	@$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --config-settings build-args=--locked --editable .
	@touch $@

FORCE:

# The files it writes carry hashes and no addresses.
lock: requirements/pins.txt pyproject.toml ## resolve requirements/*.txt from pyproject.toml (needs the registry)
	$(say) 'resolving requirements/dev.txt, run.txt, bench.txt and public.txt'
	@$(PYTHON) tools/lock.py

clean: ## remove what was built; keep .venv
	$(say) 'removing build products and caches'
	@rm -rf target build dist docs/_build out .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	@rm -f python/handeye/_core*.so python/handeye/_core*.pyd $(STAMPS)/core
	@find python tests -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove .venv too
	@rm -rf $(VENV)
