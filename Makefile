# Roller: `make train` trains an agent, `make test` runs the tests. `make help` lists the rest.
# Everything is installed into .venv with pip; no step needs root.

PYTHON ?= python3
LEVEL  ?= classic
# A configuration's file instead of the recipe that comes with Roller.
CONFIG ?=
SEED   ?= 0
# The run's directory in runs/; by default the configuration's name, the level's and the seed.
NAME   ?=
ARGS   ?=

VENV   := .venv
BIN    := $(VENV)/bin
# Other environments, to be measured beside this one; never mixed with what Roller needs.
PEERS  := .venv-peers
# Ray, which pins another Gymnasium.
CLUSTER := .venv-cluster
# One environment for each supported Python.
MATRIX := .venv-matrix
# One for each library that is tried on Roller; each goes when it has been.
CLIENTS := .venv-clients
# Newer than both files it depends on exactly when the environment is complete.
READY  := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help setup train play test coverage matrix cluster clients lint format page docs dist benchmark clean
.DELETE_ON_ERROR:

help: ## show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-9s %s\n", $$1, $$2}' Makefile
	@echo
	@echo "  make train LEVEL=$(LEVEL) SEED=1"
	@echo "  make train CONFIG=my.yaml NAME=mine ARGS=\"--set ppo.gamma=0.995\""
	@echo "  make test ARGS=\"-k gate\""

setup: $(READY) ## make .venv with the pinned packages of constraints.txt

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "Roller needs Python >= 3.11, but $(PYTHON) is $$($(PYTHON) --version 2>&1);" \
		          "say 'make $(MAKECMDGOALS) PYTHON=python3.12'" >&2; exit 1; }
	@echo "Setting up $(VENV) from constraints.txt (once; a few minutes at most) ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-input \
		--constraint constraints.txt hatchling editables
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-input \
		--constraint constraints.txt --no-build-isolation --editable '.[train,lab,play,video,demos,docs,dev]'
	@$(BIN)/python -m roller_env
	@touch $(READY)
	@echo "$(VENV) is ready."

train: $(READY) ## train, evaluate and draw; goes on with an unfinished run
	@$(BIN)/python scripts/train.py $(if $(CONFIG),--config $(CONFIG),$(LEVEL)) --seed $(SEED) --resume \
		$(if $(NAME),--name $(NAME)) $(ARGS)

play: $(READY) ## play in the browser, on this machine's port 8080
	@$(BIN)/python scripts/play.py --level $(LEVEL) $(ARGS)

test: $(READY) ## run the tests on all processors
	@$(BIN)/python -m pytest --numprocesses auto --dist loadgroup $(ARGS)

coverage: $(READY) ## run the tests, and say which lines of the package they leave out
	@$(BIN)/python -m pytest --numprocesses auto --cov --cov-report term $(ARGS)
	@echo "Loops that Numba compiles are not counted: coverage does not see machine code."

matrix: $(READY) ## try the wheel with every supported Python found here, and the oldest Gymnasium
	@$(BIN)/python scripts/matrix.py

cluster: $(CLUSTER)/.ready ## train on two Ray nodes of this machine, that come and go
	@$(CLUSTER)/bin/python scripts/cluster.py $(ARGS)

$(CLUSTER)/.ready: pyproject.toml constraints.txt
	@echo "Installing Ray and Roller into $(CLUSTER) (once) ..."
	@test -x $(CLUSTER)/bin/python || $(PYTHON) -m venv $(CLUSTER)
	@grep -v '^gymnasium==' constraints.txt > $(CLUSTER)/constraints.txt
	@$(CLUSTER)/bin/python -m pip install --quiet --disable-pip-version-check --no-input \
		--constraint $(CLUSTER)/constraints.txt hatchling editables
	@$(CLUSTER)/bin/python -m pip install --quiet --disable-pip-version-check --no-input \
		--constraint $(CLUSTER)/constraints.txt --no-build-isolation --editable '.[train,cluster]'
	@touch $@

clients: $(READY) ## let other libraries learn on Roller, each in an environment of its own
	@$(BIN)/python scripts/clients.py $(ARGS)

lint: $(READY) ## check style, types and the direction of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	@# As on Windows, for the names that only a POSIX system has.
	$(BIN)/mypy --platform win32 --cache-dir .mypy_cache/win32 roller_env
	$(BIN)/lint-imports

format: $(READY) ## let ruff format the code and mend what it can
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

page: ## build the page from its TypeScript into assets/page, and test it (needs Node 20)
	cd page && npm ci --no-audit --no-fund && npm run lint && npm run check && npm test && npm run build

docs: $(READY) ## build the documentation into site/; a dead link is an error
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "site/index.html"

dist: $(READY) ## build the sdist, the wheel from the sdist, and check both
	@rm -rf dist
	@$(BIN)/python -m hatchling build --target sdist
	@$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation \
		--wheel-dir dist dist/*.tar.gz
	@$(BIN)/python -m twine check --strict dist/*

benchmark: $(READY) $(PEERS)/.ready ## measure against physics alone and other environments
	@$(BIN)/python scripts/benchmark.py $(ARGS)

$(PEERS)/.ready: scripts/benchmark-peers.txt
	@echo "Installing the other environments into $(PEERS) (once) ..."
	@test -x $(PEERS)/bin/python || $(PYTHON) -m venv $(PEERS)
	@$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --no-input -r $<
	@touch $@

clean: ## remove the environments and caches; runs/ stays
	rm -rf $(VENV) page/node_modules $(PEERS) $(CLUSTER) $(MATRIX) $(CLIENTS) build dist site .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
