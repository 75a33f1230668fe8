# make test       all tests: ruff, mypy, pytest (with the README's examples)
# make test-app   the app in a real browser; screenshots in tests/app/screenshots
# make test-pythons  sdist, wheel and some tests on every Python from 3.11 on that is there
# make test-hostile  12 000 hostile files and arguments, full disks, kills: half an hour
# make reproduce  the main job: the paper's results as one page in reproduce/
# make validate   published numbers of other levers, predicted and compared, as one page in validate/
# make docs       the documentation as a site in docs/_build/
# Each makes the environment in .venv first. FORM=quick shortens reproduce.
FORM ?= full
BIN := .venv/bin

# Tests run side by side and start many processes: linear algebra with more than one thread in each
# would wait for the others, and what all of them import is compiled once.
test test-failed test-slow test-app: export OPENBLAS_NUM_THREADS := 1
unexport PYTHONDONTWRITEBYTECODE

.PHONY: test test-failed test-slow test-app test-hostile test-pythons reproduce validate docs lock env clean

env: .venv/.ready

.venv/.ready: pyproject.toml requirements.lock tools/make_env.sh
	sh tools/make_env.sh
	touch $@

# what hangs has hung twice before the tests end
TWO := -n 2 --dist loadfile --max-worker-restart=2

test: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest $(TWO)

# what failed last, alone: whether it fails again, or failed now and then
test-failed: env
	$(BIN)/python -m pytest --last-failed --last-failed-no-failures none

test-slow: env
	$(BIN)/python -m pytest -m slow --timeout 3600 -o faulthandler_timeout=7200 $(TWO)

test-app: env
	sh tools/get_chromium.sh
	$(BIN)/python -m pytest -m browser -p no:cacheprovider $(TWO) tests/app tests/report

test-hostile: env
	HOTLEVER_HOSTILE=1 $(BIN)/python -m pytest tests/hostile --timeout 3600 -o faulthandler_timeout=7200 -rP

test-pythons: env
	sh tools/test_pythons.sh

reproduce: env
	$(BIN)/hotlever reproduce -o reproduce $(if $(filter quick,$(FORM)),--quick)

validate: env
	$(BIN)/hotlever validate -o validate

docs: env
	$(BIN)/python -m sphinx --quiet -W --keep-going -n -d docs/_build/.doctrees docs docs/_build

lock: env
	$(BIN)/pip install "pip-tools>=7.4"
	$(BIN)/pip-compile --quiet --strip-extras --generate-hashes --no-emit-index-url --no-emit-find-links \
	    --no-header --all-extras --output-file requirements.lock pyproject.toml
# pip-compile leaves out where an extra's requirement counts
	sed -i "s/^nbklu==[^ ]*/& ; sys_platform == 'win32' or (sys_platform == 'linux' and platform_machine == 'x86_64')/" \
	    requirements.lock

clean:
	rm -rf .venv build reproduce validate docs/_build benchmarks/results tests/app/screenshots
