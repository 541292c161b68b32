# `make demo` and `make test` do all of their own set-up.
PYTHON ?= python3
# Optional parts to install too: make test EXTRAS=dev,slurm,ray,optuna
EXTRAS ?= dev
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Compare the interpreter with the bounds in pyproject.toml.
CHECK_PYTHON := import re, sys; \
  text = open("pyproject.toml").read(); \
  low, high = re.search("requires-python = .>=3.([0-9]+),<3.([0-9]+)", text).groups(); \
  fits = (3, int(low)) <= sys.version_info[:2] < (3, int(high)); \
  version = "%d.%d" % sys.version_info[:2]; \
  sys.exit(None if fits else "error: $(PYTHON) is Python %s; this project needs at least 3.%s and \
less than 3.%s, such as make PYTHON=python3.%s" % (version, low, high, low))

.PHONY: demo notebook test check format bench readme keep stale docs mutants clean clean-outputs

# --no-compile: modules are compiled when they are first imported, which most never are.
$(STAMP): pyproject.toml
	@$(PYTHON) -c '$(CHECK_PYTHON)'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Installing into $(VENV) (a few minutes the first time) ..."
	@$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -e '.[$(EXTRAS)]'
	@touch $@

demo: $(STAMP)
	@$(BIN)/drone-rl demo

# Open the notebook of the documentation in JupyterLab.
notebook: $(STAMP)
	@$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -e '.[$(EXTRAS),notebook]'
	@$(BIN)/jupyter lab docs/tutorials/notebook.ipynb

test: $(STAMP)
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Resumes where it stopped; `drone-rl bench NAME` repeats one benchmark.
bench: $(STAMP)
	$(BIN)/drone-rl bench

# Generate tables of README.md and docs/; with the newest figures; list outdated figures.
readme: $(STAMP)
	@$(BIN)/python -m tools.readme
keep: $(STAMP)
	@$(BIN)/python -m tools.readme keep
stale: $(STAMP)
	@$(BIN)/python -m tools.readme stale

# Build the site; open site/index.html. Neither the build nor the site needs a network.
docs: $(STAMP)
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "site/index.html"

# Mutation testing: change a module in MUTANTS random places, one at a time, and list the changes
# that its tests do not notice. Do not edit the module meanwhile.
#   make mutants MODULE=drone_rl/utils/intervals.py TESTS=tests/utils/test_intervals.py
MUTANTS ?= 50
SAMPLE := import sqlite3; db = sqlite3.connect("outputs/mutants.sqlite"); \
  db.execute("delete from work_items where job_id not in \
    (select job_id from work_items order by random() limit $(MUTANTS))"); \
  db.execute("delete from mutation_specs where job_id not in (select job_id from work_items)"); \
  db.commit()
mutants: $(STAMP)
	@$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -e '.[$(EXTRAS),mutants]'
	@printf '[cosmic-ray]\nmodule-path = "%s"\ntimeout = 120\ntest-command = "%s -m pytest -x -q %s"\n\n[cosmic-ray.distributor]\nname = "local"\n' \
	  '$(MODULE)' '$(BIN)/python' '$(TESTS)' > outputs/mutants.toml
	@$(BIN)/cosmic-ray init --force outputs/mutants.toml outputs/mutants.sqlite
	@$(BIN)/python -c '$(SAMPLE)'
	@$(BIN)/cosmic-ray exec outputs/mutants.toml outputs/mutants.sqlite
	@$(BIN)/cr-report --surviving-only --show-diff outputs/mutants.sqlite

# Delete files that are created automatically: environment, site, caches, packages. Results are kept.
clean:
	rm -rf $(VENV) site dist build .pytest_cache .ruff_cache .import_linter_cache *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Delete training runs, reports and figures, which may have taken hours, after confirmation.
clean-outputs:
	@printf 'Delete everything in outputs/ (%s)? [y/N] ' "$$(du -sh outputs 2>/dev/null | cut -f1)"; \
	read -r answer || answer=; \
	case "$$answer" in \
	  y|Y|yes) rm -rf outputs && echo 'deleted outputs/';; \
	  *) echo 'kept outputs/';; \
	esac
