# `make run` and `make test`: each sets up all that it needs, then does its one job. `make openfoam`
# builds the plugin, `make openfoam-test` holds it to the Python package; `make slurm-test` runs the
# campaign on a cluster of one node.

CONFIG ?= config/config.yaml
PYTHON ?= python3

VENV := .venv
STAMP := $(VENV)/requirements.sha256
PIP_INSTALL := $(VENV)/bin/python -m pip install --quiet --disable-pip-version-check
TORCH_NEEDS := filelock fsspec networkx sympy
GMSH_LIBRARIES := libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1 libgomp1
CAN_INSTALL := [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null
APT_INSTALL := apt-get update && apt-get install -y --no-install-recommends

.PHONY: run shell test docs slurm-test fault-test openfoam openfoam-test tools-test environment lock \
	gmsh-libraries clean-environment

run: environment
	@$(VENV)/bin/python -m workflow.configuration "$(CONFIG)"
	$(VENV)/bin/snakemake --configfile "$(CONFIG)" -- all

# The environment of `make run`, where every command of the README works as it is written.
shell: environment
	@. $(VENV)/bin/activate && exec "$${SHELL:-sh}"

test: environment
	$(VENV)/bin/python -m pytest -n auto --dist loadfile --no-loadscope-reorder \
		-m "not openfoam and not slurm and not tools and not faults"

# Wants root and Debian's SLURM, which it installs where it can; else the tests say what is missing.
slurm-test: environment
	$(PIP_INSTALL) -r requirements-slurm.txt
	@command -v slurmctld >/dev/null || ! { $(CAN_INSTALL); } || \
		{ $(APT_INSTALL) slurm-wlm munge; } >/dev/null
	$(VENV)/bin/python -m pytest tests/slurm -rs -s

# Kills, full disks and damage by the hundred, on a machine that is otherwise idle; their counts go
# into the table of docs/faults.md.
fault-test: environment
	FAULT_TABLE=docs/faults.md $(VENV)/bin/python -m pytest tests/faults -m faults \
		-n 2 --dist loadfile --no-loadscope-reorder

docs: environment
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/python -m mkdocs build

openfoam:
	openfoam/build.sh

openfoam-test: environment openfoam
	$(VENV)/bin/python -m pytest tests/openfoam

# The tools come on top of the environment, which they leave as it is: its versions are pinned.
tools-test: environment
	$(PIP_INSTALL) -c requirements.txt -r tests/tools/requirements.txt
	$(VENV)/bin/python -m pytest tests/tools

# Made anew when it is missing, or when the requirements are not those that it was made from.
environment:
	@{ sha256sum --check --status $(STAMP) && $(VENV)/bin/python -c ''; } 2>/dev/null \
		|| $(MAKE) --no-print-directory $(VENV)/new
	@$(MAKE) --no-print-directory gmsh-libraries

.PHONY: $(VENV)/new
$(VENV)/new:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "Python 3.11 or newer is needed, and $(PYTHON) is not: make PYTHON=/path/to/python3.11" >&2; \
		exit 1; }
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || { \
		if $(CAN_INSTALL); then { $(APT_INSTALL) python3-venv; } >/dev/null; fi; \
		$(PYTHON) -m venv $(VENV); } || { \
		echo "$(PYTHON) makes no virtual environment. On Debian or Ubuntu that comes by:" >&2; \
		echo "  sudo sh -c '$(APT_INSTALL) python3-venv'" >&2; \
		exit 1; }
	$(PIP_INSTALL) --require-hashes -r requirements.lock
	$(PIP_INSTALL) -r requirements.txt
	$(PIP_INSTALL) --no-deps --editable .
	@sha256sum requirements.txt requirements.lock > $(STAMP)

# For all platforms and Pythons. torch, and the CUDA libraries of some of its builds, are left out.
lock: environment
	{ grep -v '^torch' requirements.txt; printf '%s\n' $(TORCH_NEEDS); } | \
		$(VENV)/bin/uv pip compile - --universal --python-version 3.11 --generate-hashes --quiet \
		--no-annotate --custom-compile-command "make lock" --output-file requirements.lock

# gmsh's wheel needs X and GL libraries of the system, which no wheel brings.
gmsh-libraries:
	@$(VENV)/bin/python -c 'import gmsh' 2>/dev/null && exit 0; \
	if $(CAN_INSTALL); then \
		echo "gmsh lacks system libraries; installing $(GMSH_LIBRARIES)"; \
		{ $(APT_INSTALL) $(GMSH_LIBRARIES); } >/dev/null; \
	fi; \
	$(VENV)/bin/python -c 'import gmsh' || { \
		echo "gmsh does not load. Its system libraries come, on Debian or Ubuntu, by:" >&2; \
		echo "  sudo sh -c '$(APT_INSTALL) $(GMSH_LIBRARIES)'" >&2; \
		exit 1; }

clean-environment:
	rm -rf $(VENV)
