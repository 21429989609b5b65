# `make reproduce` and `make test` each set everything up by themselves; they need python3 (3.11 to 3.13) with venv, and make.

# Which Python makes .venv; empty: python3, or whichever of 3.11 to 3.13 is there.
PYTHON ?=
BUDGET ?= paper
# Folders of the real captures and of the real pages (README says where to get them); without them `real_boards` and the
# real part of `ocr_misses` say that they are absent.
REAL_BOARDS ?=
REAL_PAGES ?=
# Test processes at once, each with one thread.
JOBS ?= 2

BIN := .venv/bin
STAMP := .venv/.complete
SOURCES := deskew data_synth docs experiments tests
EXPERIMENTS := plane_accuracy corner_distance corner_distance_physical ocr_misses stiffness integrators
EXPERIMENTS += surfaces surfaces_noisy real_boards settling culling attribution
# Beyond the paper; they take as long again, so only the largest budget runs them.
EXPERIMENTS += $(if $(filter full,$(BUDGET)),decoders textures ablations sensitivity null_controls)

# Physical crumples: those that are shipped, at the largest budget new ones, as many as mirror folds.
PHYSICAL_smoke := sheet=physical
PHYSICAL_paper := sheet=physical
PHYSICAL_full := sheet=physical sheet.drawn=true

# What a run at this budget may overwrite: smoke proves that it runs and never touches the committed reports.
REPORTS = $(if $(filter smoke,$(BUDGET)),out/smoke,reports)

.PHONY: setup reproduce $(EXPERIMENTS) check docs report bench test lint format lock clean help

help: ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

setup: $(STAMP) ## make .venv with the locked packages (PYTHON=python3.12 chooses another Python)

$(STAMP): requirements.lock pyproject.toml
	@.ci/setup "$(PYTHON)"

reproduce: $(EXPERIMENTS) ## run every experiment and regenerate reports/ (BUDGET=smoke|paper|full)
	@$(BIN)/python -m experiments.reporting.$(if $(filter smoke,$(BUDGET)),claims $(REPORTS),generated)

# One after another, whatever -j says: each uses all cores by itself.
.NOTPARALLEL:

$(EXPERIMENTS): $(STAMP)
	@$(BIN)/python -m experiments experiment=$(patsubst %_physical,%,$(@:_noisy=)) budget=$(BUDGET) out=$(REPORTS)/$@ \
		calibrations=out/calibrations \
		$(if $(filter %_noisy,$@),surfaces.noise_mm=0.3) \
		$(if $(filter %_physical,$@),$(PHYSICAL_$(BUDGET))) \
		$(if $(filter real_boards,$@),$(if $(REAL_BOARDS),real_boards.path='$(REAL_BOARDS)')) \
		$(if $(filter ocr_misses,$@),$(if $(REAL_PAGES),ocr.real_path='$(REAL_PAGES)'))

check: $(STAMP) ## the regression gate: the pages of reports/baseline/ by the present code (docs/gate.md)
	@$(BIN)/python -m experiments.gate --baseline reports/baseline/smoke.csv --junit out/gate.xml

docs: $(STAMP) ## the documentation as a site in out/docs, every reference and link checked
	@$(BIN)/sphinx-build -E -W --keep-going -n -q -c docs . out/docs

report: $(STAMP) ## write out/report.html, the report for people: one file, offline
	@$(BIN)/python -m experiments.page

bench: $(STAMP) ## time every stage against a memory triad; writes out/speed/ (TRIALS=15 repeats more)
	@rm -rf out/speed
	@$(BIN)/python -m experiments experiment=speed out=out/speed $(if $(TRIALS),trials=$(TRIALS))
	@cat out/speed/table.md

test: $(STAMP) ## run the tests
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses=$(JOBS) --dist=worksteal

lint: $(STAMP) ## check style, types and who imports whom
	@$(BIN)/ruff check $(SOURCES)
	@$(BIN)/ruff format --check $(SOURCES)
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: $(STAMP) ## set the sources in the project's format
	@$(BIN)/ruff check --fix $(SOURCES)
	@$(BIN)/ruff format $(SOURCES)

lock: ## pin the newest allowed packages with their hashes (needs uv); no index address goes into the file
	uv pip compile --quiet --upgrade pyproject.toml --universal --python-version 3.11 --all-extras --generate-hashes \
		--no-annotate --no-header --no-emit-index-url --output-file requirements.lock

clean: ## remove .venv and what the tools cached
	rm -rf .venv build dist *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
	find $(SOURCES) -name __pycache__ -type d -exec rm -rf {} +
