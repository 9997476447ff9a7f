# Two commands do all the set-up: `make reproduce` for the main job, `make test` for the tests.
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python
# no compiler, no licence: everything comes as wheels, at the versions in constraints.txt
INSTALL := $(RUN) -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: reproduce test lint bench docs paper clean

reproduce: $(VENV)/.stamp-main
	$(RUN) experiments/reproduce_paper.py
	$(RUN) experiments/reproduce_positioner.py

test: $(VENV)/.stamp-test
	$(RUN) -m pytest -n 2 --dist loadfile

lint: $(VENV)/.stamp-lint
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy
	$(VENV)/bin/lint-imports

# paper/nlpweld.pdf, from what results/ holds; the studies' LaTeX tables stay in results/*/tables
paper: $(VENV)/.stamp-paper
	$(RUN) paper/build.py

bench: $(VENV)/.stamp-bench
	$(RUN) -m benchmarks

docs: $(VENV)/.stamp-docs
	$(RUN) -m sphinx --fail-on-warning --keep-going --quiet -b html docs docs/_build

$(VENV)/.stamp-main: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable .
	touch $@

$(VENV)/.stamp-test: $(VENV)/.stamp-main
	$(INSTALL) --editable '.[test,fast]'
	touch $@

$(VENV)/.stamp-lint: $(VENV)/.stamp-main
	$(INSTALL) --editable '.[test,fast,lint]'
	touch $@

$(VENV)/.stamp-paper: $(VENV)/.stamp-main
	$(INSTALL) --editable '.[paper]'
	touch $@

$(VENV)/.stamp-bench: $(VENV)/.stamp-main
	$(INSTALL) --editable '.[fast,bench]'
	touch $@

$(VENV)/.stamp-docs: $(VENV)/.stamp-main
	$(INSTALL) --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) docs/_build docs/_generated .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
