# supple - soft bodies by finite elements on PETSc. `make help` lists the targets.
PKG     := $(shell pkg-config --exists PETSc && echo PETSc || echo petsc)
CC      := mpicc
OPT     := -O3 -g -fno-math-errno -fno-trapping-math
BUILD   := build
ifdef DEBUG
OPT     := -O0 -g3 -DSB_DEBUG
BUILD   := build-debug
endif
WARN    := -std=c11 -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes
CPPFLAGS += -D_GNU_SOURCE -Iinclude $(patsubst -I%,-isystem %,$(shell pkg-config --cflags-only-I $(PKG) hdf5-openmpi))
LDLIBS  := $(shell pkg-config --libs $(PKG) hdf5-openmpi) -lmetis -lm
SRC     := $(filter-out src/main.c,$(wildcard src/*/*.c))
OBJ     := $(SRC:%.c=$(BUILD)/%.o)
TESTSRC := $(wildcard tests/unit/*.c tests/verify/*.c tests/perf/*.c)
TESTBIN := $(TESTSRC:%.c=$(BUILD)/%)

all: bin/supple
bin/supple: $(BUILD)/src/main.o $(OBJ)
	@mkdir -p bin
	$(CC) $(OPT) -o $@ $^ $(LDLIBS)
tests: $(TESTBIN)
$(BUILD)/tests/%: $(BUILD)/tests/%.o $(OBJ)
	$(CC) $(OPT) -o $@ $^ $(LDLIBS)
$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(WARN) $(OPT) $(CPPFLAGS) -MMD -MP -c -o $@ $<
clean:
	rm -rf build build-* bin
.PHONY: all tests clean
.SECONDARY:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
