# Two commands do everything: `make verify` and `make test`. Both make the environment first where it is missing.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.made

.PHONY: env verify paper test lint clean

env: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[gpl,robots,dev]"
	touch $(STAMP)

verify: env
	$(BIN)/sandbox verify

paper: env
	$(BIN)/sandbox paper

lint: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/python -m pytest

clean:
	rm -rf .venv build runs reports/out
