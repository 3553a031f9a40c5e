# Everything a fresh machine needs: make demo, make test. Each sets up what it needs first.
PYTHON ?= python3.11
NAME := $(notdir $(PYTHON))
VENV ?= $(if $(filter python3.11,$(NAME)),.venv,.venv-$(NAME))
BIN := $(VENV)/bin
SCENE ?=
OUT ?= out/$(or $(SCENE),demo)
MINUTES ?= 9
PAGE := srbf/viewer/page/index.html
PAGE_SOURCES := web/package-lock.json $(wildcard web/*.ts web/viewer/* web/src/*.ts web/src/*/*) $(wildcard glsl/*/*.*)

.PHONY: setup setup-test demo variable-lightmap gallery test test-fast test-godot check docs site torture bench extension web clean
setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml blender_bake/pyproject.toml scripts/debian-packages scripts/make-venv
	sh scripts/debian-packages
	sh scripts/make-venv $(PYTHON) $(VENV)
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable blender_bake --editable '.[blender,gl,ray,report,export]'
	touch $@

setup-test: $(VENV)/.tested-by

$(VENV)/.tested-by: $(VENV)/.installed
	sh scripts/debian-packages test
	$(BIN)/pip install --quiet --editable blender_bake --editable '.[blender,gl,ray,report,export,test,dev,docs]'
	touch $@

# Loft, caustics and coin, and a page that has them all. SCENE: one alone; loft has lights inside, caustics, coin and house distant ones.
demo: setup $(PAGE)
	$(BIN)/srbf demo $(if $(SCENE),--scene $(SCENE) )-o $(OUT)

# The article's figure 12 live: a bake that one would publish (half an hour on two cores, resumable), then the viewer.
variable-lightmap: setup $(PAGE)
	$(BIN)/srbf demo --scene caustics --quality publish -o out/variable-lightmap --view

gallery: setup
	$(BIN)/python -m scripts.gallery

# Modules are compiled once, whatever the machine says: processes of srbf start in two thirds of the time.
# Checks of every annotation take a quarter of the time of what they check: not where that is minutes.
FAST := not blender and not engines and not packaging and not slow
test: export PYTHONDONTWRITEBYTECODE =
test: setup-test
	SRBF_CHECK_ANNOTATIONS=1 $(BIN)/pytest -m "$(FAST)" -n 2 --dist worksteal
	$(BIN)/pytest -m "not ($(FAST))" -n 3 --dist loadfile --no-loadscope-reorder

test-fast: setup-test
	$(BIN)/pytest -m "$(FAST) and not lengthy" -n 2 --dist worksteal

test-godot: setup-test
	sh scripts/godot-chroot
	$(BIN)/python scripts/test_godot.py
	$(BIN)/python scripts/test_godot_surfels.py
	$(BIN)/python scripts/test_godot_probes.py

# The npm package, and the page of srbf view, by the Node.js of a Python package.
NPM := cd web && PATH="$(abspath $(BIN)):$$PATH" NODE_USE_SYSTEM_CA=1 npm --no-fund --no-audit --no-update-notifier --loglevel=error
web: $(PAGE)
	$(NPM) run build

$(PAGE): $(VENV)/.installed $(PAGE_SOURCES)
	$(BIN)/pip install --quiet --editable '.[web]'
	$(NPM) ci
	$(NPM) run build:viewer

check: setup-test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python scripts/check_words.py

# The pages and the reference of the library as a site, build/site; fails on a broken link.
docs: export NO_MKDOCS_2_WARNING = 1
docs: setup-test
	$(BIN)/mkdocs build --strict --quiet

# The same with scenes that one relights in the browser, each one file; their demos take minutes each, and are kept.
LIVE ?= loft caustics coin house
site: setup-test $(PAGE)
	$(BIN)/python -m scripts.live_pages $(LIVE)
	$(MAKE) docs

torture: setup-test
	$(BIN)/python benchmarks/torture.py --minutes $(MINUTES)

bench: setup
	$(BIN)/python benchmarks/pipeline.py
	$(BIN)/python benchmarks/fit.py

extension: setup
	$(BIN)/python scripts/build_extension.py $(addprefix --platform ,$(PLATFORMS))

clean:
	rm -rf web/node_modules web/dist srbf/viewer/page build .venv .venv-* out dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
