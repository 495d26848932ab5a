# Two commands matter: `make run` and `make test`. Everything they need goes into .venv and web/node_modules.

PYTHON ?= python3
BIN := .venv/bin
.DEFAULT_GOAL := help
# Parts of the tests that run beside all the rest, each with services, ports and databases of its own. One: with more,
# browsers on two cores wait longer than their tests do.
PARTS := stack
TESTS_stack := tests/browser tests/services
SLOWEST := --durations=30 --durations-min=10
.PHONY: help run test check format lock pages types sbom

help:
	@echo "make run     set up, start the server and its workers, print the address"
	@echo "make test    all tests (browser tests where Chromium is installed); ARGS=\"tests/sim -x\" for some"
	@echo "make check   linters, types, architecture"
	@echo "make format  format everything"
	@echo "make lock    compile the hash-pinned requirements anew"
	@echo "make sbom    write what is in each part into build/sbom (CycloneDX)"
	@echo "make types   generate the pages' types from the server's OpenAPI, and their words of metrics"

# --- set up --------------------------------------------------------------------------------------------------------

.venv/bin/uv: requirements-uv.txt
	@command -v $(PYTHON) >/dev/null || { echo "mapless: $(PYTHON) not found: install Python 3.11 or newer."; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "mapless: Python 3.11 or newer is needed, this is $$($(PYTHON) -V). Try: make run PYTHON=python3.12"; exit 1; }
	@[ -w . ] || { echo "mapless: no write access to $$(pwd): copy it to a folder of your own."; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo "mapless: Python's venv module is missing: install it (Debian, Ubuntu: apt install python3-venv)."; exit 1; }
	@echo "Setting up .venv ..."
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --disable-pip-version-check --require-hashes -r requirements-uv.txt >.venv/install.log 2>&1 || { \
	  echo "mapless: packages could not be downloaded (.venv/install.log says why): is there a network? Then run make again."; \
	  exit 1; }
	@touch $@

define install
	@echo "Installing packages (PyTorch is large: a few minutes the first time) ..."
	@{ $(BIN)/uv pip install --python $(BIN)/python --require-hashes -r $(1) && \
	   $(BIN)/uv pip install --python $(BIN)/python --no-build-isolation --no-deps -e .; } >.venv/install.log 2>&1 || { \
	  echo "mapless: packages could not be installed (.venv/install.log says why): is there a network? Then run make again."; \
	  exit 1; }
	@touch $@
endef

.venv/.run: requirements.txt pyproject.toml .venv/bin/uv
	$(call install,requirements.txt)

.venv/.dev: requirements-dev.txt .venv/.run
	$(call install,requirements-dev.txt)

.venv/.kernels: $(wildcard sim/*.py sim/engine/*.py sim/kernels/*.py workers/kernels/*.py workers/networks/*.py) .venv/.run
	@echo "Compiling the simulator and the networks' passes ..."
	@rm -rf sim/kernels/__pycache__ workers/kernels/__pycache__
	@$(BIN)/python -m workers.precompile
	@touch $@

pages: .venv/.run
	@$(BIN)/python web/build.py

# --- use -----------------------------------------------------------------------------------------------------------

run: pages .venv/.kernels
	@exec $(BIN)/mapless up $(ARGS)

test: .venv/.dev pages .venv/.kernels
	$(BIN)/python web/build.py run test
ifdef ARGS
	$(BIN)/python -m pytest $(ARGS)
else
	@# In two halves side by side, one with whole services and a browser. AGAIN=5: up to so many that fail are tried once more, alone.
	@logs=$$(mktemp -d) && trap 'rm -rf $$logs' EXIT; started=; \
	$(foreach part,$(PARTS),$(BIN)/python -m pytest $(SLOWEST) -o cache_dir=.pytest_cache/$(part) $(TESTS_$(part)) >$$logs/$(part) 2>&1 & \
	started="$$started $(part)=$$!";) \
	$(BIN)/python -m pytest $(SLOWEST) -o cache_dir=.pytest_cache/rest $(foreach part,$(PARTS),$(TESTS_$(part):%=--ignore=%)); worst=$$?; \
	for part in $$started; do \
	  wait $${part#*=}; ended=$$?; cat $$logs/$${part%=*}; [ $$ended -le $$worst ] || worst=$$ended; \
	done; \
	if [ $$worst -ne 1 ] || [ -z "$(AGAIN)" ]; then exit $$worst; fi; \
	$(BIN)/python .ci/again.py $(AGAIN) $(PARTS:%=.pytest_cache/%) .pytest_cache/rest
endif

check: .venv/.dev pages
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python web/build.py run check

# --- change --------------------------------------------------------------------------------------------------------

format: .venv/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/python web/build.py run format

types: .venv/.dev
	$(BIN)/python -m server.written.openapi web/openapi.json
	$(BIN)/python -m server.written.metric_words web/src/charts/metricWords.json
	$(BIN)/python web/build.py run generate

# The header that uv writes names the command, and nothing in these files names a host.
LOCK := $(BIN)/uv pip compile -q --universal --generate-hashes --python-version 3.11 --custom-compile-command 'make lock'
lock: .venv/bin/uv
	$(LOCK) pyproject.toml --extra all --extra build -o requirements.txt
	$(LOCK) pyproject.toml --extra all --extra build --extra dev -o requirements-dev.txt -c requirements.txt
	$(LOCK) pyproject.toml -o requirements-base.txt -c requirements.txt
	$(LOCK) pyproject.toml --extra server -o requirements-server.txt -c requirements.txt
	$(LOCK) pyproject.toml --extra worker -o requirements-worker.txt -c requirements.txt
	$(LOCK) pyproject.toml --extra server --extra s3 -o requirements-s3.txt -c requirements.txt
	$(LOCK) pyproject.toml --extra server --extra parquet -o requirements-parquet.txt -c requirements.txt
	$(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["build"], sep="\n")' \
	  | $(LOCK) - -o requirements-build.txt -c requirements.txt
	$(LOCK) server/client/pyproject.toml --extra mcp -o server/client/requirements.txt -c requirements.txt
	echo 'cyclonedx-bom==7.3.1' | $(LOCK) - -o requirements-sbom.txt
	echo 'uv==0.13.8' | $(LOCK) - -o requirements-uv.txt

# Of the locks, with their hashes: what an installation from them has in it. The tool has an environment of its own.
SBOM := build/sbom
$(SBOM)/.venv: requirements-sbom.txt .venv/bin/uv
	@rm -rf $@ && $(BIN)/uv venv -q --python $(BIN)/python $@
	@$(BIN)/uv pip install -q --python $@/bin/python --require-hashes -r requirements-sbom.txt

sbom: $(SBOM)/.venv .venv/.run
	@for part in server worker; do \
	  $</bin/cyclonedx-py requirements requirements-$$part.txt --output-reproducible -o $(SBOM)/$$part.cdx.json || exit 1; done
	@$(BIN)/python web/build.py sbom --package-lock-only --sbom-format cyclonedx --loglevel=error >$(SBOM)/pages.cdx.json
	@ls $(SBOM)/*.cdx.json
