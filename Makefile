# Two commands do everything on a fresh clone: `make report` and `make test`.
# docs/installation.md says what they set up; `make` alone lists the targets.
#
# Variables:
#   PYTHON       the interpreter that .venv is made from, 3.11 or newer
#                (unset: the first usable one of python3.14 ... python3.11, python3)
#   QUICK        QUICK=1: `make report` runs every case with fewer points
#   PYTEST_ARGS  handed to pytest by `make test`, `make coverage` and `make bench`

VENV := .venv
PY   := $(VENV)/bin/python

export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_NO_INPUT := 1

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup libraries report test coverage lint format bench bench-table docs fast clean distclean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

report: setup ## set everything up, then write the report (QUICK=1 for fewer points)
	@echo "== Report"
	@$(VENV)/bin/bh report $(if $(filter-out 0,$(QUICK)),--quick)

test: lint ## set everything up, then run the linters and the tests (PYTEST_ARGS="-k name")
	@echo "== pytest"
	@$(PY) -m pytest -n auto --maxprocesses=4 --dist worksteal $(PYTEST_ARGS)

coverage: setup ## run the tests and write which lines they reach into build/coverage/html
	@echo "== pytest, with coverage"
	@mkdir -p build/coverage
	@$(PY) -m pytest -n auto --maxprocesses=4 --dist worksteal --cov --cov-report=term --cov-report=html $(PYTEST_ARGS)
	@echo "coverage: $(CURDIR)/build/coverage/html/index.html"

lint: setup ## ruff check, ruff format --check, mypy
	@echo "== ruff check"
	@$(PY) -m ruff check .
	@echo "== ruff format --check"
	@$(PY) -m ruff format --check .
	@echo "== mypy"
	@$(PY) -m mypy

format: setup ## apply ruff's fixes and formatting
	@$(PY) -m ruff check --fix .
	@$(PY) -m ruff format .

bench: setup ## run the benchmarks
	@$(PY) -m pytest benchmarks $(PYTEST_ARGS)

bench-table: setup ## measure the table of speeds, docs/performance.md
	@$(PY) -m benchmarks.table

docs: setup ## build the documentation site into build/docs/html
	@echo "== Documentation"
	@$(PY) docs/build_site.py build/docs
	@echo "documentation: $(CURDIR)/build/docs/html/index.html"

fast: setup ## add the extra `fast` (pypardiso with MKL, 0.9 GB; x86-64 only)
	@$(PY) -m pip install -q --no-build-isolation -c requirements.lock -e '.[fast]'

setup: libraries $(VENV)/.warm ## make .venv, install the pinned packages and the project

clean: ## remove caches and build products; .venv, results/ and out/ stay
	@rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks build dist *.egg-info $(VENV)/.warm
	@find . -path './$(VENV)' -prune -o -path ./.git -prune -o -type d -name __pycache__ -prune -exec rm -rf {} +

distclean: clean ## clean, and remove .venv
	@rm -rf $(VENV)

# ---------------------------------------------------------------------------------------------
# Set-up. Every step leaves a stamp in .venv, so that what is done is not done again.

# Prints the version; exits with 3 if it is too old, with 4 if it can make no environment.
define probe
import sys; v = sys.version_info; print("%d.%d.%d" % v[:3]); v < (3, 11) and sys.exit(3); \
from importlib.util import find_spec as has; \
sys.exit(0 if has("venv") and (has("ensurepip") or has("pip")) else 4)
endef

# A PYTHON that is given, and is not the version that .venv has, makes .venv anew.
ifneq ($(PYTHON),)
ifneq ($(shell "$(PYTHON)" -c '$(probe)' 2>/dev/null),$(shell $(PY) -c '$(probe)' 2>/dev/null))
.PHONY: $(PY)
endif
endif

$(PY):
	@if [ -n "$$PYTHON" ]; then set -- "$$PYTHON"; \
	else set -- python3.14 python3.13 python3.12 python3.11 python3; fi; \
	old=; bare=; \
	for python; do \
	    status=0; version=$$("$$python" -c '$(probe)' 2>/dev/null) || status=$$?; \
	    case $$status in \
	    0) echo "== Making $(VENV) with $$python ($$version)"; \
	       exec "$$python" -m venv --clear --without-pip $(VENV);; \
	    3) old="$$old ($$python is $$version)";; \
	    4) bare=$$python;; \
	    esac; \
	done; \
	if [ -n "$$bare" ]; then \
	    echo "error: $$bare lacks venv, or both ensurepip and pip (Debian, Ubuntu: sudo apt-get install -y python3-venv)" >&2; \
	else \
	    echo "error: no Python 3.11 or newer found$$old; name one with: make PYTHON=/path/to/python3" >&2; \
	fi; exit 1

# Debian's Python has no ensurepip unless python3-venv is installed. Its pip, however old, can fetch
# a pip, and the fetched wheel can install itself.
$(VENV)/.pip: $(PY)
	@$(PY) -m pip --version >/dev/null 2>&1 || $(PY) -m ensurepip >/dev/null 2>&1 || { \
	    echo "== Fetching pip (this Python has no ensurepip)"; \
	    rm -rf $(VENV)/fetched; \
	    "$$($(PY) -c 'import sys; print(sys._base_executable)')" -m pip download -q --no-deps -d $(VENV)/fetched pip && \
	    for wheel in $(VENV)/fetched/pip-*.whl; do \
	        $(PY) "$$wheel/pip" install -q --no-index --no-deps "$$wheel" || exit 1; \
	    done && rm -rf $(VENV)/fetched; }
	@touch $@

libraries: $(PY)
	@sh .ci/system-libraries $(PY)

$(VENV)/.packages: requirements.lock $(VENV)/.pip | libraries
	@echo "== Installing the packages pinned in requirements.lock (a new .venv downloads about 350 MB)"
	@quiet=-q; if [ -t 1 ]; then quiet=; fi; \
	$(PY) -m pip install $$quiet --only-binary :all: -r requirements.lock
	@touch $@

# The stamp holds the folder: an editable install in a moved or copied folder would run the old one.
ifneq ($(shell cat $(VENV)/.project 2>/dev/null),$(CURDIR))
.PHONY: $(VENV)/.project
endif

$(VENV)/.project: pyproject.toml $(VENV)/.packages
	@echo "== Installing the project (editable)"
	@$(PY) -m pip install -qq --no-deps --no-build-isolation -e .
	@pwd -P > $@

$(VENV)/.warm: $(VENV)/.project
	@echo "== Warming the compiled caches"
	@$(PY) -m bh.commands.warm_up
	@touch $@
