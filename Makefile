# armlab. `make table3` and `make test` do everything on a machine with Python 3.11, git, make and gcc.
PYTHON ?= python3
BIN := .venv/bin
# pip leaves it to the first import to compile a module: most modules of most packages are never imported.
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# Hundreds of short processes read what the first one has compiled.
unexport PYTHONDONTWRITEBYTECODE
COMPILED := algorithms/flight.c algorithms/flight_build.py \
	problem/kernel.c problem/kernel_build.py problem/spectra.c problem/spectra_build.py \
	armlab/common/linear_filter.c armlab/common/linear_filter_build.py \
	armlab/effects/drive_train.c armlab/effects/drive_train_build.py \
	armlab/diagnosis/motion/joint_replay.c armlab/diagnosis/motion/joint_replay_build.py \
	armlab/proof/blind/servo/servo_arm.c armlab/proof/blind/servo/servo_arm_build.py

.DEFAULT_GOAL := help
.PHONY: help install install-dev table3 figure2 figure3 paper study search-space tune landscape best-known real real-leave-one-out real-motion real-conditioning relations prove-changes test suite lint structure table3-time diagnosis-time profile speed regression fuzz logs hostile prove prove-quick docs pictures installs lock clean

help: ## what can be made
	@sed -n 's/^\([a-z0-9-]*\):.*## /  make \1	/p' Makefile | expand -t 22

# --- the environment: `run` is what running needs, `dev` adds the tests, the peers and the engines

install: .venv/run ## what running needs, into .venv, from the lock file
install-dev: .venv/dev ## what the tests need too

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/run: requirements/run.lock pyproject.toml setup.py $(COMPILED) | .venv/bin/python
	$(PIP_INSTALL) --require-hashes -r requirements/run.lock
	$(PIP_INSTALL) --no-deps --no-build-isolation -e .
	@touch $@

# uv takes a fifth of pip's time for these. It reads UV_DEFAULT_INDEX and not the settings of pip, which may know a mirror.
.venv/dev: .venv/run requirements/dev.lock
	$(BIN)/uv pip install --quiet --system-certs --python $(BIN)/python --require-hashes -r requirements/dev.lock || \
		{ echo "uv could not install: pip does"; $(PIP_INSTALL) --require-hashes -r requirements/dev.lock; }
	@touch $@

lock: .venv/dev ## choose the versions of all dependencies anew
	$(BIN)/uv pip compile --quiet --upgrade --python-version 3.11 --generate-hashes --no-emit-index-url --extra dev \
		--custom-compile-command "make lock" pyproject.toml -o requirements/dev.lock
	$(BIN)/uv pip compile --quiet --python-version 3.11 --generate-hashes --no-emit-index-url --extra build --extra diagnose --extra harness \
		--custom-compile-command "make lock" --constraint requirements/dev.lock pyproject.toml -o requirements/run.lock

# --- results

table3: .venv/run ## the paper's comparison: results/table3.csv and .md
	$(BIN)/armlab paper table3

figure2: .venv/run ## best cost and time against swarm size
	$(BIN)/armlab paper figure2

figure3: .venv/run ## average convergence
	$(BIN)/armlab paper figure3

paper: .venv/run ## all tables and figures of the paper, and what of it holds: results/paper/
	$(BIN)/armlab paper replication
	$(BIN)/armlab paper does-it-help

study: .venv/run ## the comparison where the paper stops: results/study/
	$(BIN)/armlab paper study

search-space: .venv/run ## what a search space within all limits does for each algorithm: results/search_space/
	$(BIN)/armlab paper search-space

tune: .venv/dev ## every algorithm tuned with the same budget, judged on problems that took no part: results/tune/
	$(BIN)/armlab bench tune --overwrite

landscape: .venv/run ## what makes an algorithm win, and which optimiser to take: results/landscape/
	$(BIN)/armlab bench landscape

best-known: .venv/run ## ten minutes more for the best trajectories known: results/best_known.json
	$(BIN)/armlab bench best-known

real: .venv/dev ## identify and diagnose the public recordings of real arms: results/real/arms.md
	$(BIN)/armlab proof real --part public

real-leave-one-out: .venv/dev ## settings chosen on all real arms but one, judged on that one
	$(BIN)/armlab proof real --leave-one-out

real-conditioning: .venv/dev ## does a small condition number help on real arms: results/real/conditioning.md
	$(BIN)/armlab proof real-conditioning

real-motion: .venv/dev ## diagnose the public recordings of position servos: results/real/motion.md
	$(BIN)/armlab proof real-motion --peer sysid

relations: .venv/dev ## relations that need no truth, on real recordings and a few simulated ones: results/relations/
	$(BIN)/armlab conceal --cases 8 --seed 1800 --out .armlab/relations-set
	$(BIN)/armlab proof relations .armlab/relations-set/observations/*

prove-changes: .venv/dev ## the comparison judged on pairs with nothing or one thing changed: results/proof/changes/
	$(BIN)/armlab proof run --tier changes

prove: .venv/dev ## hide effects, diagnose blindly, score, all judged and logged: results/proof/
	$(BIN)/armlab proof run

prove-quick: .venv/dev ## the same with a few cases of each tier, of a development seed, not logged
	$(BIN)/armlab proof run --quick --results .armlab/proof-quick

speed: .venv/dev ## how fast, beside Pinocchio, CasADi, mealpy, pygmo and scipy: results/speed/
	$(BIN)/armlab tools speed

# --- documentation

docs: .venv/dev ## the documentation site, strictly: site/index.html
	$(BIN)/python -m tools.site site

pictures: .venv/dev ## the pictures of README and tutorials, docs/pictures/, and the outputs of the notebooks
	$(BIN)/python -m tools.site.pictures
	$(BIN)/python -m tools.site.notebooks

installs: .venv/dev ## size and time of an installation per purpose: the table of docs/installation.md
	$(BIN)/python -m tools.measure_installs

# --- checks

# The regression check needs no package of the tests: it runs while these are installed.
test: ## style, types and import contracts, the regression check and every test, all at the same time
	$(MAKE) --no-print-directory --jobs=3 regression lint suite

# A worker takes the half of another one's tests when it has none: tests that share a fixture stay together.
suite: .venv/dev ## every test alone, a worker and a thread of linear algebra a core
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/pytest -n logical --dist worksteal

lint: .venv/dev ## style, types and import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

table3-time: .venv/dev ## time of Table 3 beside that of an earlier commit: make table3-time BEFORE=COMMIT
	$(BIN)/python -m tools.time_against $(BEFORE)

diagnosis-time: .venv/dev ## time, memory and verdict of diagnoses beside those of an earlier commit: BEFORE=COMMIT RECORDING=FOLDERS [AS_READ=1]
	$(BIN)/python -m tools.time_against $(BEFORE) --diagnose $(RECORDING) $(if $(AS_READ),--as-read)

profile: .venv/dev ## where the seconds of a diagnosis go, by stage and by function: RECORDING=FOLDER [AS_READ=1]
	$(BIN)/python -m tools.profile_diagnosis $(RECORDING) $(if $(AS_READ),--as-read)

structure: .venv/dev ## figures of the source tree: files, lines, modules that a diagnosis loads
	$(BIN)/python tools/structure.py

regression: .venv/run ## the best condition numbers against the committed baseline
	$(BIN)/armlab tools regression

fuzz: .venv/dev ## damaged files for every reader of recordings, FUZZ_SECONDS in all
	$(PIP_INSTALL) -e '.[fuzz]' --no-build-isolation
	$(BIN)/python tests/recordings/fuzz_readers.py --seconds $(or $(FUZZ_SECONDS),600)

logs: .venv/dev ## 2,000 logs that chance makes of clean runs: right numbers or a refusal in one line
	cd tests/recordings && PYTHONPATH=../..:..:. ../../$(BIN)/python changed_logs.py --logs 2000

hostile: .venv/dev ## damaged input for the commands: tests/hostile_outcomes.csv
	PYTHONPATH=tests $(BIN)/python tests/hostile_commands.py

clean: ## everything that was made here, the environment included
	rm -rf .venv .armlab build site jupyter_execute *.egg-info algorithms/_flight.c algorithms/*.so problem/_kernel.c problem/_spectra.c problem/*.so armlab/common/_linear_filter.c armlab/common/*.so \
		armlab/effects/_drive_train.c armlab/effects/*.so armlab/diagnosis/motion/_joint_replay.c armlab/diagnosis/motion/*.so \
		armlab/proof/blind/servo/_servo_arm.c armlab/proof/blind/servo/*.so
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
