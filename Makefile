# One target per habit. `make demo` and `make test` work from a fresh clone with Python 3.11 and nothing else.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
SPEEDUP ?= 40
KEEP ?=
JOBS ?= 2

.PHONY: demo test lint leaks audit fuzz unit page bench rivals crash soak gate-long chaos train format client site wheel clean help

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

$(VENV)/.base: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade pip
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/.dev: pyproject.toml $(VENV)/.base
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[train,dev]'
	@touch $@

page:  ## build the operator's page (fetches Node.js from PyPI where there is none)
	@$(PYTHON) gcs/dashboard/build.py

demo: $(VENV)/.base page  ## fly the demo campaign with two mock drones; KEEP=1 leaves the server up
	$(BIN)/python -m gcs fly missions/demo.toml --fleet mock --speedup $(SPEEDUP) --serve 127.0.0.1:8080 \
		--report reports/demo --json reports/demo/results.json --trajectory reports/demo/trajectory.csv \
		$(if $(KEEP),--keep)

test: $(VENV)/.dev page lint unit  ## everything that needs no long training

lint: $(VENV)/.dev leaks
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/hadolint Dockerfile

leaks: $(VENV)/.dev  ## look for keys and passwords in what git keeps; mark a false alarm with "pragma: allowlist secret"
	@if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then \
		git ls-files -z -- . ':!docs/results' ':!policy/checkpoints' ':!*.ipynb' ':!*.svg' ':!*.png' ':!*.csv' \
			':!*package-lock.json' | xargs -0 -n 100 -P 2 $(BIN)/detect-secrets-hook --no-verify --baseline .secrets.baseline; \
	else echo "no git repository here: nothing was looked at"; fi

audit: $(VENV)/.dev  ## look up known holes of what is installed; needs the Internet
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'pip-audit>=2.7'
	@mkdir -p .build
	$(BIN)/python -m pip freeze --exclude-editable | sed 's/+cpu$$//' > .build/installed.txt
	$(BIN)/pip-audit --strict --disable-pip --no-deps --requirement .build/installed.txt
	$(BIN)/python gcs/dashboard/build.py --audit

fuzz: $(VENV)/.dev  ## every operation of the API with 200 values for each role (minutes)
	UCS_FUZZ_EXAMPLES=200 $(BIN)/python -m pytest --timeout=3600 tests/api/test_api_schema.py

unit: $(VENV)/.dev
	@sh tests/install_system_packages.sh
	$(BIN)/python tests/warm_up.py
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile

format: $(VENV)/.dev  ## let ruff put the sources in order
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.dev  ## measure decision times, steps per second, flights, setpoint periods and load; writes docs/bench.md
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/bench/run.py --out docs/bench.md

train:  $(VENV)/.dev  ## train the default gcrl anew into runs/gcrl-default (long)
	OMP_NUM_THREADS=1 $(BIN)/python -m policy.training --out runs/gcrl-default --episodes 360

rivals: $(VENV)/.dev  ## train each rival on a campaign with a known optimum (minutes on one core)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m rivals -rP tests/agents

crash: $(VENV)/.dev  ## kill -9 the server fifty times in flight (about half an hour)
	$(BIN)/python tests/durability/crash.py --kills 50

soak: $(VENV)/.dev  ## a day of campaigns on the virtual clock in one process (an hour): memory, threads, sockets, tasks
	$(BIN)/python tests/soak/day.py --hours 24

gate-long: $(VENV)/.dev  ## 100,000 random cases of the safety gate (an hour); 0 breaches and 0 dead ends or it fails
	OMP_NUM_THREADS=1 $(BIN)/python tests/safety/gate_simulation.py --cases 100000

chaos: $(VENV)/.dev  ## 100 campaigns over random bad links (about an hour); all end, all land, no breach, or it fails
	OMP_NUM_THREADS=1 $(BIN)/python tests/chaos/run.py --campaigns 100

site: $(VENV)/.dev  ## build the documentation into .build/site; strict, offline
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

wheel: $(VENV)/.dev page  ## a wheel with the built page inside, into dist
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir dist .

client: $(VENV)/.dev  ## write gcs/client/models.py and sync.py anew from the server's schemas and aio.py
	$(BIN)/python -m gcs openapi > .build/openapi.json
	$(BIN)/python gcs/client/write_models.py < .build/openapi.json
	$(BIN)/python gcs/client/unasync.py
	$(BIN)/ruff check --quiet --fix gcs/client
	$(BIN)/ruff format --quiet gcs/client

clean:  ## remove what was built
	rm -rf $(VENV) .build gcs/dashboard/dist gcs/dashboard/node_modules reports runs artifacts
