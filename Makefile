# Everything from a fresh clone: each target sets up what it needs and then does its work.
.DEFAULT_GOAL := help
.PHONY: help run demo pictures run-bimanual test conformance vm-test lint types bench nasty fuzz mutants fidelity hqp-dist install-c format clean
export PYTHON CC
# the tests start hundreds of processes, each of which would compile all modules anew
unexport PYTHONDONTWRITEBYTECODE
# matrices are small: a second thread of a process only takes the processor of another
export OPENBLAS_NUM_THREADS := 1
BIN := .venv/bin
PACKAGES := bench binding configs control devices experiments hqp link machines models runtime safety sim testing view
C_SOURCES := $(wildcard csrc/*.c csrc/*.h csrc/*.hpp csrc/extended/*.c csrc/extended/*.h tests/hqp/*.c docs/examples/*.c docs/examples/*.cpp)
# a group of tests is one process's, and tests of wall time are the first
SEVERAL := -n auto --dist loadgroup --no-loadscope-reorder
C_FLAGS := -std=c11 -D_GNU_SOURCE -Icsrc -O2 -Wall -Wextra -Wconversion -Wshadow -Wvla -Werror
# what csrc/qp_module.c sees of Python and numpy
OF_PYTHON = -DPy_LIMITED_API=0x030b0000 $$($(BIN)/python -c 'import sysconfig, numpy; \
    print("-isystem", sysconfig.get_path("include"), "-isystem", numpy.get_include())')

help:
	@echo "make run      set up, run the simulated giant with a scripted hand for 30 s, print a summary"
	@echo "make run-bimanual  two daemons and two simulated stations, linked: a minute of telemanipulation"
	@echo "make demo     set up, and play with the simulated giant in the browser; ARGS=panda plays with another"
	@echo "make test     set up and run the tests; ARGS='-m \"not slow\"' leaves out the long ones"
	@echo "make pictures draw the dashboard and a report for the documents (needs Chromium)"
	@echo "make conformance  every stop, arming, reset, replay, frame and limit test over each built-in machine"
	@echo "make vm-test  boot a PREEMPT_RT kernel in QEMU and test SocketCAN, FIFO, mlock and the doctor there"
	@echo "make lint     ruff, mypy, import-linter, C warnings as errors, clang-format"
	@echo "make bench    time solver, loop and tick beside their peers"
	@echo "make nasty    solve 1000 problems of each nasty kind, judged by their certificates"
	@echo "make fuzz     feed the solver's C interface with any bytes for a minute (needs clang)"
	@echo "make mutants  try 2000 damaged copies of each built-in model and configuration, another set each time"
	@echo "make fidelity run every figure and table of the papers; fills docs/fidelity.md and docs/figures"
	@echo "make hqp-dist build wheel and sdist of the solver alone, hapticd-hqp, into dist"
	@echo "make install-c install the solver's C library, headers and pkg-config file (PREFIX=/usr/local)"
	@echo "make format   rewrite Python and C sources in the project's style"

run:
	@./setup.sh core
	@$(BIN)/hapticd run giant $(ARGS)

run-bimanual:
	@./setup.sh link
	@$(BIN)/hapticd bimanual --live --duration 60 $(ARGS)

demo:
	@./setup.sh view
	@$(BIN)/hapticd demo $(ARGS)

pictures:
	@./setup.sh pictures
	@$(BIN)/python docs/draw_view.py

test:
	@./setup.sh test
	@$(BIN)/python -m pytest $(SEVERAL) $(ARGS)

conformance:
	@./setup.sh test
	@$(BIN)/python -m pytest $(SEVERAL) --hapticd-machine giant --hapticd-machine rhi --hapticd-machine panda --hapticd-machine panda_rhi --hapticd-machine operator --hapticd-machine avatar $(ARGS)

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
	of_python="$(OF_PYTHON)"; for f in $(filter %.c,$(C_SOURCES)); do \
	    $${CC:-cc} $(C_FLAGS) $$of_python -fsyntax-only $$f || exit 1; done
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
	@./setup.sh fidelity
	@$(BIN)/hapticd experiment --all --out docs

fuzz:
	@./setup.sh core
	@$(BIN)/python tests/hqp/fuzz.py $(ARGS)

mutants:
	@./setup.sh test
	@HAPTICD_MUTANTS=2000 HAPTICD_MUTANT_SEED=$${SEED:-$$(date +%s)} $(BIN)/python -m pytest tests/hostile $(ARGS)

hqp-dist:  # the wheel is built out of the sdist
	@./setup.sh dist
	@rm -rf build/hqp-dist
	@$(BIN)/python csrc/stage_hqp.py build/hqp-dist
	@$(BIN)/python -m build --outdir dist build/hqp-dist

# Needs a C compiler alone. DESTDIR is put before every path, for those who package.
PREFIX ?= /usr/local
SOLVER := $(sort $(wildcard csrc/hqp*.c csrc/extended/*.c))
SOLVER_VERSION = $(shell sed -n 's/^\#define HQP_VERSION "\(.*\)"/\1/p' csrc/hqp.h)
SONAME = libhapticd-hqp.so.$(firstword $(subst ., ,$(SOLVER_VERSION)))

install-c:
	@mkdir -p build
	$${CC:-cc} -std=c11 -O3 -ffp-contract=off -fPIC -shared -Icsrc -Wl,-soname,$(SONAME) \
	    -Wl,--version-script,csrc/hqp.map $(SOLVER) -lm -o build/$(SONAME)
	install -d $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/include/hapticd
	install -m 755 build/$(SONAME) $(DESTDIR)$(PREFIX)/lib/$(SONAME)
	ln -sf $(SONAME) $(DESTDIR)$(PREFIX)/lib/libhapticd-hqp.so
	install -m 644 csrc/hqp.h csrc/hqp_qp.h csrc/hqp.hpp $(DESTDIR)$(PREFIX)/include/hapticd
	printf '%s\n' 'prefix=$(PREFIX)' 'Name: hapticd-hqp' 'Version: $(SOLVER_VERSION)' \
	    'Description: hierarchical least squares with inequalities' 'Libs: -L$${prefix}/lib -lhapticd-hqp' \
	    'Cflags: -I$${prefix}/include/hapticd' >$(DESTDIR)$(PREFIX)/lib/pkgconfig/hapticd-hqp.pc

format:
	@./setup.sh lint
	$(BIN)/ruff check --fix --select I .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(C_SOURCES)

clean:
	rm -rf .venv build dist *.egg-info
	find . -name '*.so' -delete
