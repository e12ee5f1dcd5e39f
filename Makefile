# Everything from a fresh clone: each target sets up what it needs and then does its work.
.DEFAULT_GOAL := help
.PHONY: help run test vm-test lint types bench nasty fuzz mutants fidelity format clean
export PYTHON CC
BIN := .venv/bin
PACKAGES := bench configs control devices experiments hqp models runtime safety sim
C_SOURCES := $(wildcard csrc/*.c csrc/*.h tests/hqp/*.c)
C_FLAGS := -std=c11 -D_GNU_SOURCE -Icsrc -O2 -Wall -Wextra -Wconversion -Wshadow -Wvla -Werror

help:
	@echo "make run      set up, run the simulated giant with a scripted hand for 30 s, print a summary"
	@echo "make test     set up and run the tests"
	@echo "make vm-test  boot a PREEMPT_RT kernel in QEMU and test SocketCAN, FIFO, mlock and the doctor there"
	@echo "make lint     ruff, mypy, import-linter, C warnings as errors, clang-format"
	@echo "make bench    time solver, loop and tick beside their peers"
	@echo "make nasty    solve 1000 problems of each nasty kind, judged by their certificates"
	@echo "make fuzz     feed the solver's C interface with any bytes for a minute (needs clang)"
	@echo "make mutants  try 2000 damaged copies of each built-in model and configuration, another set each time"
	@echo "make fidelity run every figure and table of the papers; fills docs/fidelity.md and docs/figures"
	@echo "make format   rewrite Python and C sources in the project's style"

run:
	@./setup.sh core
	@$(BIN)/hapticd run giant $(ARGS)

test:
	@./setup.sh test
	@$(BIN)/python -m pytest $(ARGS)

vm-test:
	@./setup.sh test
	@$(BIN)/python tests/vm/boot.py $(BIN)/python -m pytest -p no:cacheprovider tests/vm/inside.py $(ARGS)

lint: types
	@./setup.sh test
	@./setup.sh lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	for f in $(filter %.c,$(C_SOURCES)); do $${CC:-cc} $(C_FLAGS) -fsyntax-only $$f || exit 1; done
	$(BIN)/clang-format --dry-run --Werror $(C_SOURCES)

types:  # links for the type checkers only; never imported at run time
	@mkdir -p build/types/hapticd
	@for d in $(PACKAGES); do ln -sfn ../../../$$d build/types/hapticd/$$d; done

bench:
	@./setup.sh bench
	@$(BIN)/hapticd bench solve
	@$(BIN)/hapticd bench jitter
	@$(BIN)/hapticd bench tick

nasty:
	@./setup.sh bench
	@$(BIN)/hapticd bench nasty $(ARGS)

fidelity:
	@./setup.sh plot
	@$(BIN)/hapticd experiment --all --out docs

fuzz:
	@./setup.sh core
	@$(BIN)/python tests/hqp/fuzz.py $(ARGS)

mutants:
	@./setup.sh test
	@HAPTICD_MUTANTS=2000 HAPTICD_MUTANT_SEED=$${SEED:-$$(date +%s)} $(BIN)/python -m pytest tests/hostile $(ARGS)

format:
	@./setup.sh lint
	$(BIN)/ruff check --fix --select I .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(C_SOURCES)

clean:
	rm -rf .venv build dist *.egg-info
	find . -name '*.so' -delete
