# supple - soft bodies by finite elements on PETSc. `make help` lists the targets and settings.
#
# PETSc is found by pkg-config; PETSC_DIR (and PETSC_ARCH) or PKG_CONFIG_PATH choose another one. MPI compiler, HDF5 and
# METIS are those that PETSc was configured with, as far as it tells. Objects go to $(BUILD)/ and are made again when a
# setting changes. Nothing here is installed by hand: `make check` and `make demo` call scripts/install-deps first.

# ---- settings that a user may give
BUILD  := build
OPT    := -O3 -g -fno-math-errno -fno-trapping-math
PREFIX := /usr/local
JOBS   := $(shell nproc 2>/dev/null || echo 2)
ifdef DEBUG
BUILD  := build-debug
OPT    := -O0 -g3 -DSB_DEBUG
endif

# ---- PETSc and what it was built with
ifdef PETSC_DIR
PCDIR      := $(wildcard $(PETSC_DIR)/$(PETSC_ARCH)/lib/pkgconfig)
PKG_CONFIG := PKG_CONFIG_PATH="$(PCDIR):$$PKG_CONFIG_PATH" pkg-config
PETSC_LOST := $(if $(PCDIR),,there is no $(PETSC_DIR)/$(PETSC_ARCH)/lib/pkgconfig: correct PETSC_DIR and PETSC_ARCH, or unset both)
else
PKG_CONFIG := pkg-config
endif
PETSC_VERSION := $(shell $(PKG_CONFIG) --modversion PETSc 2>/dev/null)
PETSC_LIBDIR  := $(shell $(PKG_CONFIG) --variable=libdir PETSc 2>/dev/null)
petsc_says     = $(shell sed -n 's/^$(1) = //p' $(PETSC_LIBDIR)/petsc/conf/petscvariables 2>/dev/null)
ifeq ($(origin CC),default)
CC := $(or $(shell $(PKG_CONFIG) --variable=ccompiler PETSc 2>/dev/null),mpicc)
endif
HDF5_LIB   := $(or $(call petsc_says,HDF5_LIB),$(shell $(PKG_CONFIG) --libs hdf5-openmpi 2>/dev/null))
HDF5_INC   := $(or $(call petsc_says,HDF5_INCLUDE),$(shell $(PKG_CONFIG) --cflags-only-I hdf5-openmpi 2>/dev/null))
METIS_LIB  := $(or $(call petsc_says,METIS_LIB),-lmetis)
METIS_INC  := $(call petsc_says,METIS_INCLUDE)
PETSC_INC  := $(shell $(PKG_CONFIG) --cflags-only-I PETSc 2>/dev/null)
PETSC_LIB  := $(shell $(PKG_CONFIG) --libs PETSc 2>/dev/null) $(call petsc_says,BLASLAPACK_LIB)

# ---- how things are compiled and linked
WARN     := -std=c11 -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes $(if $(WERROR),-Werror)
INCLUDES := -D_GNU_SOURCE -Iinclude -Itests $(patsubst -I%,-isystem %,$(filter-out -I/usr/include,$(PETSC_INC) $(HDF5_INC) $(METIS_INC)))
COMPILE   = $(CC) $(WARN) $(OPT) $(INCLUDES) $(CPPFLAGS) $(CFLAGS)
LIBS     := $(PETSC_LIB) $(HDF5_LIB) $(METIS_LIB) -lz -ldl -lm
comma    := ,
RPATH    := $(patsubst -L%,-Wl$(comma)-rpath$(comma)%,$(filter-out -L/usr/lib%,$(filter -L%,$(LIBS))))
LINK      = $(CC) $(OPT) $(CFLAGS) $(LDFLAGS) -Wl,--as-needed

SRC      := $(filter-out src/main.c,$(wildcard src/*/*.c))
OBJ      := $(SRC:%.c=$(BUILD)/%.o)
TESTSRC  := $(wildcard tests/unit/*.c tests/verify/*.c tests/perf/*.c)
TESTBIN  := $(TESTSRC:%.c=$(BUILD)/%) $(BUILD)/tests/hard/hard
HARDOBJ  := $(patsubst %.c,$(BUILD)/%.o,$(wildcard tests/hard/*.c))
MESHES   := $(patsubst %.geo,%.msh,$(wildcard meshes/*.geo))

# A second make, with one job per core unless the user said otherwise: what was missing may have been installed meanwhile.
AGAIN     = +@$(MAKE) $(if $(V),,-s) --no-print-directory $(if $(filter -j%,$(MAKEFLAGS)),,-j$(JOBS))
Q        := $(if $(V),,@)
SAY       = $(if $(V),@:,@echo)

# ---- program and tests
all: bin/supple bin/supple-mesh ## the programs, bin/supple and bin/supple-mesh (default)

bin/%: $(BUILD)/% FORCE
	@mkdir -p bin; cmp -s $< $@ || install -m 755 $< $@

$(BUILD)/supple: $(BUILD)/src/main.o $(BUILD)/src/version.o $(BUILD)/libsupple.a
	$(SAY) "  link     $@"
	$(Q)$(LINK) -o $@ $^ $(LIBS) $(RPATH)

$(BUILD)/supple-mesh: $(BUILD)/src/mesh_main.o $(BUILD)/src/version.o $(BUILD)/libsupple.a
	$(SAY) "  link     $@"
	$(Q)$(LINK) -o $@ $^ $(LIBS) $(RPATH)

$(BUILD)/libsupple.a: $(OBJ)
	$(Q)rm -f $@; ar rcs $@ $^

tests: $(TESTBIN) ## every test and benchmark program, in build/tests

$(BUILD)/tests/hard/hard: $(HARDOBJ) $(BUILD)/libsupple.a
	$(SAY) "  link     $@"
	$(Q)$(LINK) -o $@ $^ $(LIBS) $(RPATH)

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(BUILD)/libsupple.a
	$(SAY) "  link     $@"
	$(Q)$(LINK) -o $@ $^ $(LIBS) $(RPATH)

$(BUILD)/%.o: %.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(SAY) "  compile  $<"
	$(Q)$(COMPILE) -MMD -MP -c -o $@ $<

# What -version says of the build: commit (of an archive: packaging/commit, which git fills in), compiler and flags.
BUILT = $(CC) $(OPT) $(filter-out -ffile-prefix-map=% -fdebug-prefix-map=%,$(CPPFLAGS) $(CFLAGS) $(LDFLAGS))
$(BUILD)/version.h: $(BUILD)/flags FORCE
	@if [ -e .git ]; then commit=$$(git describe --always --dirty --abbrev=12 --exclude='*' 2>/dev/null); else commit=$$(sed /Format/d packaging/commit 2>/dev/null); fi; \
	new=$$(printf '%s\n' "$$commit" '$(strip $(BUILT))' | sed 's/[\\"]/\\&/g; s/.*/"&"/; 1s/^/#define SB_COMMIT /; 2s/^/#define SB_BUILT /'); \
	[ "$$new" = "$$(cat $@ 2>/dev/null)" ] || printf '%s\n' "$$new" >$@

$(BUILD)/src/version.o: src/version.c $(BUILD)/version.h $(BUILD)/flags
	@mkdir -p $(@D)
	$(SAY) "  compile  $<"
	$(Q)$(COMPILE) -include $(BUILD)/version.h -MMD -MP -c -o $@ $<

# Holds the settings that the objects were made with; it is written, and so everything made again, only when they change.
$(BUILD)/flags: FORCE
	$(if $(PETSC_LOST),$(error $(PETSC_LOST)))
	$(if $(PETSC_VERSION),,$(error PETSc was not found by pkg-config: run scripts/install-deps (Debian, Ubuntu), or set PETSC_DIR and PETSC_ARCH))
	@mkdir -p $(@D)
	@new='$(COMPILE) | $(LINK) $(LIBS) | PETSc $(PETSC_VERSION)'; \
	if [ "$$new" != "$$(cat $@ 2>/dev/null)" ]; then \
	  printf '#include <petsc.h>\n#include <hdf5.h>\n#include <metis.h>\n#include <zlib.h>\n' | $(CC) $(INCLUDES) $(CPPFLAGS) -E -xc -o /dev/null - || \
	    { echo "supple: the headers above are missing: run scripts/install-deps (Debian, Ubuntu), or install PETSc, parallel HDF5, METIS and zlib" >&2; exit 1; }; \
	  echo "  PETSc $(PETSC_VERSION), $(CC), objects in $(BUILD)/"; printf '%s\n' "$$new" >$@; fi

meshes/%.msh: meshes/%.geo
	$(SAY) "  mesh     $@"
	$(Q)gmsh -3 -format msh41 -o $@.tmp $< >$@.log 2>&1 || { cat $@.log; rm -f $@.tmp; exit 1; }
	@mv $@.tmp $@; rm -f $@.log

# ---- what a user runs
deps:
	@scripts/install-deps run

demo: deps ## install missing packages, build, run scenarios/demo.opts on 2 ranks, draw it: out/demo
	$(AGAIN) bin/supple meshes/lobe.msh
	@scripts/venv
	@scripts/mpi 2 bin/supple scenarios/demo.opts
	@scripts/render out/demo --obstacles
	@scripts/render out/demo --obstacles --animate out/demo/animation.gif
	@echo "open out/demo/fields.vtkhdf in ParaView (5.12 or newer; older: fields.xmf); out/demo/picture.png and animation.gif show the run"

pictures: deps ## run the scenarios of contact on 1 rank and draw them: docs/pictures/*.png and out/*/animation.gif (1 to 2 minutes)
	$(AGAIN) bin/supple meshes/lobe.msh meshes/hook.msh
	@scripts/venv
	@scripts/pictures

CHECK = tests/run --build $(BUILD) $(if $(T),--match '$(T)')
check: deps ## install missing packages, build, run the tests (25 minutes of processor time, on all cores; one of them: T=name)
	$(AGAIN) bin/supple bin/supple-mesh tests $(MESHES)
	@scripts/venv
	@$(CHECK)

check-long: deps ## the tests that take longer or need ParaView
	@scripts/install-deps long
	$(AGAIN) bin/supple bin/supple-mesh tests $(MESHES)
	@scripts/venv
	@$(CHECK) --long

check-hard: deps ## robustness tests on 1, 2 and 3 ranks, ten perturbed runs each, and the table of their margins (an hour and more; one: T=name)
	$(AGAIN) $(BUILD)/tests/hard/hard
	@tests/run --build $(BUILD) --group hard --all $(if $(T),--match '$(T)'); status=$$?; scripts/stability --build $(BUILD); exit $$status

stability: check-hard ## the same, with the table written into docs/reports/stability.md
	@scripts/stability --build $(BUILD) --write

lint: ## format, layers of the include lines, clang-tidy, shellcheck; syntax, style and types of Python
	@scripts/install-deps lint
	@COMPILE_FLAGS='-std=c11 $(INCLUDES)' scripts/lint

SANITIZE = -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined -Wno-format-truncation
sanitize: deps ## unit tests and damaged inputs under the address and undefined-behaviour sanitizers
	$(AGAIN) BUILD=build-sanitize OPT='$(SANITIZE)' build-sanitize/unit build-sanitize/supple build-sanitize/supple-mesh
	@tests/run --build build-sanitize --group unit --sanitize $(if $(T),--match '$(T)')
	@$(if $(T),,tests/run --build build-sanitize --supple build-sanitize/supple --group scenario --sanitize --match mutations.py)
	@$(if $(T),,for t in formulas.py foreign_meshes.py; do tests/run --build build-sanitize --supple build-sanitize/supple --group verify --sanitize --match $$t || exit 1; done)

coverage: deps ## how much of each source file the tests run, by gcov: unit tests, or GROUP=unit,verify (one: T=name)
	$(AGAIN) BUILD=build-coverage OPT='-O0 -g --coverage' build-coverage/supple build-coverage/supple-mesh $(if $(filter-out unit,$(GROUP)),tests,build-coverage/unit)
	@find build-coverage -name '*.gcda' -delete
	@tests/run --build build-coverage --supple build-coverage/supple --group $(or $(GROUP),unit) $(if $(T),--match '$(T)'); status=$$?; scripts/coverage build-coverage; exit $$status

# MPI's compiler is told to call clang.
FUZZ    := -O1 -g -fno-omit-frame-pointer -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined
# NULL + 0 of an empty array is undefined in C11 and harmless: only the readers must not have it.
ifneq ($(findstring fuzzer-no-link,$(OPT)),)
$(filter-out $(foreach folder,meshio surface geometry base,$(BUILD)/src/$(folder)/%),$(OBJ)): CFLAGS += -fno-sanitize=pointer-overflow
endif
$(BUILD)/tests/fuzz/fuzz: $(BUILD)/tests/fuzz/fuzz.o $(OBJ)
	$(SAY) "  link     $@"
	$(Q)$(LINK) -fsanitize=fuzzer -o $@ $^ $(LIBS) $(RPATH)

fuzz: deps ## readers of meshes and other inputs under clang's libFuzzer, FUZZ_SECONDS=60 each (one: T=vtu)
	@scripts/install-deps fuzz
	$(AGAIN) BUILD=build-fuzz CC='env OMPI_CC=clang MPICH_CC=clang $(CC)' OPT='$(FUZZ)' build-fuzz/tests/fuzz/fuzz
	@scripts/fuzz --build build-fuzz $(T)

memcheck: deps ## unit tests under valgrind
	@scripts/install-deps lint
	$(AGAIN) BUILD=build-memcheck OPT='-O1 -g3' build-memcheck/unit
	@tests/run --build build-memcheck --group unit --valgrind $(if $(T),--match '$(T)')

$(BUILD)/unit: $(filter $(BUILD)/tests/unit/%,$(TESTBIN))
	@touch $@

bench: deps ## speed, kept as CSV below tests/perf/results; QUICK=1 measures less
	$(AGAIN) bin/supple bin/supple-mesh tests
	@scripts/bench --build $(BUILD) $(if $(QUICK),--quick)

measured: deps ## what others measured or published beside what supple finds, into docs/reports/measured.md
	$(AGAIN) bin/supple
	@scripts/venv
	@scripts/measured --write

ventricle: deps ## the ventricle of Land et al. (2015), into docs/reports/ventricle.md with its picture
	@scripts/ventricle --write

locking: deps ## how P1, P2, CR and DG behave near nu = 1/2, measured into docs/reports/locking.md with its plots (about 10 minutes)
	$(AGAIN) $(BUILD)/tests/perf/locking
	@scripts/locking --build $(BUILD)

solvers: deps ## linear solvers for CR and DG near nu = 1/2, measured into docs/reports/solvers.md; QUICK=1 measures less and writes nothing
	$(AGAIN) $(BUILD)/tests/perf/solvers
	@scripts/solvers --build $(BUILD) $(if $(QUICK),--quick)

accuracy: deps ## error against time for all methods, measured into docs/reports/accuracy.md with plots and a CSV (5 to 10 minutes); QUICK=1: a test, in build
	$(AGAIN) bin/supple
	@scripts/venv
	@.venv/bin/python scripts/accuracy --build $(BUILD) $(if $(QUICK),--quick)

docs: bin/supple bin/supple-mesh ## docs/options.md from the option table, and all documents as a site: build/site/index.html
	@scripts/manual markdown
	@scripts/venv
	@.venv/bin/mkdocs build --strict --quiet --site-dir $(BUILD)/site
	@echo "open $(BUILD)/site/index.html"

manual: bin/supple bin/supple-mesh ## man pages and completion of shells from the option table: build/share
	@scripts/manual man -o $(BUILD)/share
	@scripts/manual completion -o $(BUILD)/share

# ---- what is installed and handed on
TO        = $(DESTDIR)$(PREFIX)
SHARE     = $(TO)/share/supple
COMPLETE  = $(TO)/share/bash-completion/completions
GIVEN    := $(if $(shell command -v gmsh),$(MESHES))
install: bin/supple bin/supple-mesh manual $(GIVEN) ## programs, man pages, completion, scenarios, documents to PREFIX=/usr/local (DESTDIR= in front); meshes where gmsh is there
	install -d $(TO)/bin $(TO)/share/man/man1 $(COMPLETE) $(TO)/share/zsh/site-functions $(SHARE)/scenarios $(SHARE)/meshes $(SHARE)/scripts $(TO)/share/doc/supple
	install -m 755 bin/supple bin/supple-mesh $(TO)/bin
	install -m 644 $(BUILD)/share/supple.1 $(BUILD)/share/supple-mesh.1 $(TO)/share/man/man1
	install -m 644 $(BUILD)/share/supple $(COMPLETE)
	ln -sf supple $(COMPLETE)/supple-mesh
	install -m 644 $(BUILD)/share/_supple $(TO)/share/zsh/site-functions
	install -m 755 scripts/render scripts/plot scripts/fit scripts/unload scripts/export scripts/live scripts/venv $(SHARE)/scripts
	install -m 644 scripts/own_python.py $(SHARE)/scripts
	install -d $(SHARE)/python/supple
	install -m 644 python/supple/*.py $(SHARE)/python/supple
	install -m 644 scenarios/*.opts $(SHARE)/scenarios
	install -m 644 meshes/*.geo $(GIVEN) $(SHARE)/meshes
	install -m 644 README.md CHANGELOG.md LICENSE CITATION.cff $(TO)/share/doc/supple
	cp -r docs $(TO)/share/doc/supple

check-installed: ## a scenario on one rank and on two, with the programs below PREFIX, after make install
	@SUPPLE='$(abspath $(TO)/bin)' SCENARIOS='$(abspath $(SHARE)/scenarios)' sh packaging/debian/tests/scenario && echo "the programs in $(TO)/bin work"

dist: ## build/supple-VERSION.tar.gz of the last commit, and its checksum
	@scripts/package dist

deb: ## a Debian package of the last commit: build/deb/*.deb, examined by lintian (about 8 minutes of processor time)
	@scripts/package deb

packaging: ## linters of the packaging: Debian package, container file, recipes, CITATION.cff
	@scripts/check-packaging

clean: ## remove build results and meshes; results in out/ stay
	rm -rf build build-* bin meshes/*.msh

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{ printf "%-24s%s\n", $$1, $$2 }'
	@echo "settings: T=name (tests)  GROUP=unit,verify (coverage)  QUICK=1 (bench, solvers, accuracy)  DEBUG=1  WERROR=1  V=1 (show commands)  CC=  OPT=  CFLAGS=  BUILD=  JOBS=  PREFIX=  DESTDIR=  PETSC_DIR= PETSC_ARCH="

.PHONY: all tests deps demo pictures check check-long check-hard stability lint sanitize coverage memcheck bench measured ventricle locking solvers accuracy docs manual install check-installed dist deb packaging fuzz clean help FORCE
.SECONDARY:
.DELETE_ON_ERROR:
-include $(wildcard $(BUILD)/src/*.d $(BUILD)/src/*/*.d $(BUILD)/tests/*/*.d)
