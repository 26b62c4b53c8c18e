# SPDX-License-Identifier: GPL-3.0-or-later
# make            build everything into build/
# make demo       install what is missing, build, run one job of the 2022 paper through a server
# make check      install what is missing, build, run every test that fits in CI
# make check-long what takes longer
# make check-slurm jobs on a real Slurm, started for the test
# make bench      the performance suite
# make schema     write the descriptions in schema/ anew, from the program
# make install    DESTDIR= PREFIX=
# make deb        a Debian package of what was built, in build/deb

CC      ?= gcc
PREFIX  ?= /usr/local
SYSCONFDIR ?= $(if $(filter /usr,$(PREFIX)),/etc,$(PREFIX)/etc)
UNITDIR ?= $(PREFIX)/lib/systemd/system
B       ?= build
PACKAGES = libmicrohttpd jansson sqlite3 gsl

# Reproducible bits: no contraction to FMA, no fast-math, own elementary functions in engine/kernels.
# -fno-math-errno and -fno-trapping-math change no value; they let loops be vectorised.
BITS    = -ffp-contract=off -fno-math-errno -fno-trapping-math
WARN    = -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wvla \
          -Wpointer-arith -Wwrite-strings -Wundef -Werror
CFLAGS ?= -O3 -g
ALL_CFLAGS = -std=c17 $(WARN) $(CFLAGS) $(BITS) -fPIC -fvisibility=hidden -MMD -MP -Iengine -D_DEFAULT_SOURCE
# Kernels: independent numbers side by side in the order of instructions, for processors look ahead
# only so far. clang does so unasked.
KERNEL_CFLAGS := $(if $(findstring clang,$(shell $(CC) --version 2>/dev/null)),,-fschedule-insns)
# What the linker has filled in can be read only, once the program runs.
HARD    = -Wl,-z,relro,-z,now
ROOMS = $(wildcard server/*/)
HOST_CFLAGS = -D_GNU_SOURCE -pthread -Iserver $(ROOMS:%/=-I%) -I$B $(shell pkg-config --cflags $(PACKAGES) 2>/dev/null)
ENGINE_LIBS = $(shell pkg-config --libs gsl 2>/dev/null)
CLIENT_LIBS = $(shell pkg-config --libs libcurl 2>/dev/null)
HOST_LIBS   = $(shell pkg-config --libs $(PACKAGES) 2>/dev/null) -lmd -lm -pthread

ENGINE_SRC = $(wildcard engine/*.c engine/*/*.c)
SERVER_SRC = $(filter-out server/main.c server/cli/cli.c, $(wildcard server/*.c server/*/*.c))
SCHEMA_SQL = $(sort $(wildcard schema/*.sql))
TEST_SRC   = $(wildcard tests/*/test_*.c)
SUPPORT_SRC = $(filter-out $(TEST_SRC) $(PRELOAD_SRC) $(TOOL_SRC) tests/fuzz/% tests/fault/short_memory.c, \
		$(wildcard tests/*/*.c))
FUZZ_SRC    = $(filter-out $(TEST_SRC) tests/fuzz/libfuzzer.c, $(wildcard tests/fuzz/*.c))
PRELOAD_SRC = $(wildcard tests/preload/*.c)
TOOL_SRC    = $(wildcard tests/tools/*.c)
Q = $(if $V,,@)# make V=1 shows whole commands
# More than a hundred programs: another linker of binutils, where it is there, takes half the time.
TEST_LINK := $(shell $(CC) -fuse-ld=gold -Wl,--version 2>/dev/null | grep -o -m 1 gold | sed 's/^/-fuse-ld=/')
comma      = ,
obj        = $(patsubst %.c,$B/obj/%.o,$(1))

all: $B/bcdd $B/bcd $B/libbcd.so $B/bcd_sqlite.so

$B/obj/engine/%.o: engine/%.c
	@mkdir -p $(@D)
	$(if $V,,@echo "  CC $<")
	$Q$(CC) $(ALL_CFLAGS) -c -o $@ $<
$B/obj/engine/kernels/%.o: ALL_CFLAGS += $(KERNEL_CFLAGS)
$B/obj/server/%.o: server/%.c
	@mkdir -p $(@D)
	$(if $V,,@echo "  CC $<")
	$Q$(CC) $(ALL_CFLAGS) $(HOST_CFLAGS) -c -o $@ $<
$B/obj/tests/%.o: tests/%.c
	@mkdir -p $(@D)
	$(if $V,,@echo "  CC $<")
	$Q$(CC) $(ALL_CFLAGS) $(HOST_CFLAGS) -Itests -c -o $@ $<

# Migrations are compiled in as strings, one per file, in order of their numbers.
$B/obj/server/store/store.o: $B/migrations.inc
$B/migrations.inc: $(SCHEMA_SQL)
	@mkdir -p $(@D)
	$(if $V,,@echo "  SQL $@")
	$Qsh deploy/embed-sql.sh $(SCHEMA_SQL) > $@.tmp && mv $@.tmp $@

# Likewise the schemas of answers.
$B/obj/server/api/openapi.o: $B/components.inc
$B/components.inc: schema/components.json
	@mkdir -p $(@D)
	$Q{ echo 'static const char components_json[] = {'; od -An -v -tu1 $< | sed 's/[0-9][0-9]*/&,/g'; \
		echo '0};'; } > $@.tmp && mv $@.tmp $@

# The web page, file by file, and the papers' scenes that it offers.
PAGE = $(sort $(wildcard server/page/*.*))
$B/obj/server/api/handle_page.o: $B/page.inc $B/scenes.inc
$B/page.inc: $(PAGE) deploy/embed-page.sh
	@mkdir -p $(@D)
	$(if $V,,@echo "  PAGE $@")
	$Qsh deploy/embed-page.sh $(PAGE) > $@.tmp && mv $@.tmp $@
SCENES = $(sort $(wildcard tests/scenes/*.json))
$B/scenes.inc: $(SCENES) deploy/embed-scenes.sh
	@mkdir -p $(@D)
	$Qsh deploy/embed-scenes.sh $(SCENES) > $@.tmp && mv $@.tmp $@

$B/libbcd.a: $(call obj,$(ENGINE_SRC))
	@rm -f $@
	$Qar rcs $@ $^
# The engine must stand on GSL and libm alone, and on the sanitizers' library where they are asked
# for: clang has that in programs only.
$B/libbcd.so: $(call obj,$(ENGINE_SRC))
	$Q$(CC) $(LDFLAGS) -shared $(if $(findstring -fsanitize,$(LDFLAGS)),,-Xlinker --no-undefined) \
		-o $@ $^ $(ENGINE_LIBS) -lm
$B/libserver.a: $(call obj,$(SERVER_SRC))
	@rm -f $@
	$Qar rcs $@ $^
# What other programs load into SQLite: the tables of store_sql_tables.h, compiled once more so that
# they reach SQLite through the program that loads them.
EXTENSION_OBJ = $(patsubst %,$B/obj/extension/%.o,store_sql_tables store_sql_view)
$B/obj/extension/%.o: server/store/%.c
	@mkdir -p $(@D)
	$(if $V,,@echo "  CC $< (extension)")
	$Q$(CC) $(ALL_CFLAGS) $(HOST_CFLAGS) -DBCD_SQLITE_EXTENSION -c -o $@ $<
$B/bcd_sqlite.so: $(EXTENSION_OBJ) $(call obj,$(addprefix server/base/,sample.c text.c json_number.c outcome_facts.c)) $B/libbcd.a
	$Q$(CC) $(LDFLAGS) -shared $(if $(findstring -fsanitize,$(LDFLAGS)),,-Xlinker --no-undefined) \
		-o $@ $^ $(ENGINE_LIBS) -lm
$B/bcdd: $B/obj/server/main.o $B/libserver.a $B/libbcd.a
	$Q$(CC) $(LDFLAGS) $(HARD) -o $@ $^ $(HOST_LIBS)
$B/bcd: $B/obj/server/cli/cli.o $B/libserver.a $B/libbcd.a
	$Q$(CC) $(LDFLAGS) $(HARD) -o $@ $^ $(HOST_LIBS) $(CLIENT_LIBS)

# A test is tests/<layer>/test_<what>.c; everything else there is shared by all of them.
TESTS = $(patsubst tests/%.c,$B/tests/%,$(TEST_SRC))
$B/tests/%: $B/obj/tests/%.o $(call obj,$(SUPPORT_SRC)) $B/libserver.a $B/libbcd.a
	@mkdir -p $(@D)
	$Q$(CC) $(TEST_LINK) $(LDFLAGS) -o $@ $^ -lcmocka $(HOST_LIBS) $(CLIENT_LIBS)
# Allocations of our own code, to fail where a test wants it.
$(filter $B/tests/fault/%,$(TESTS)): $B/tests/fault/%: $B/obj/tests/fault/%.o $B/obj/tests/fault/short_memory.o \
		$(call obj,$(SUPPORT_SRC)) $B/libserver.a $B/libbcd.a
	@mkdir -p $(@D)
	$Q$(CC) $(LDFLAGS) $(patsubst %,-Wl$(comma)--wrap=%,malloc calloc realloc aligned_alloc free strdup strndup asprintf) \
		-o $@ $^ -lcmocka $(HOST_LIBS) $(CLIENT_LIBS)
# What is fuzzed: its corpus is a test, libFuzzer (clang; tests/fuzz/fuzz_long.sh) a program.
$B/tests/fuzz/%: $B/obj/tests/fuzz/%.o $(call obj,$(FUZZ_SRC) $(SUPPORT_SRC)) $B/libserver.a $B/libbcd.a
	@mkdir -p $(@D)
	$Q$(CC) $(LDFLAGS) -o $@ $^ -lcmocka $(HOST_LIBS) $(CLIENT_LIBS)
$B/fuzzer: $(call obj,tests/fuzz/libfuzzer.c $(FUZZ_SRC) $(SUPPORT_SRC)) $B/libserver.a $B/libbcd.a
	$Q$(CC) $(LDFLAGS) -fsanitize=fuzzer -o $@ $^ -lcmocka $(HOST_LIBS) $(CLIENT_LIBS)
# What shell tests put into a daemon with LD_PRELOAD.
PRELOADS = $(patsubst tests/%.c,$B/tests/%.so,$(PRELOAD_SRC))
$B/tests/%.so: $B/obj/tests/%.o
	@mkdir -p $(@D)
	$Q$(CC) $(LDFLAGS) -shared -o $@ $^
# Programs that shell tests run.
TOOLS = $(patsubst tests/%.c,$B/tests/%,$(TOOL_SRC))
tests: $(TESTS) $(PRELOADS) $(TOOLS)

# The tests of the API's description are JavaScript; their packages stay out of the source tree.
node-modules: $B/node/installed
NODE_FILES = $(addprefix tests/node/, package.json package-lock.json .npmrc)
$B/node/installed: $(NODE_FILES)
	@mkdir -p $(@D)
	@echo "  NPM $(@D)"
	$Qcp $(NODE_FILES) $(@D) && cd $(@D) && npm ci --silent
	@touch $@

# Whole builds use all processors, unless the caller of make has said how many.
BUILD = $(MAKE) --no-print-directory $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(shell nproc))
packages:
	sh deploy/install-packages.sh
demo: packages
	+$(BUILD) all
	sh deploy/demo.sh
check: packages
	+$(BUILD) all tests node-modules
	sh tests/run.sh check
check-long: packages
	+$(BUILD) all tests node-modules
	sh tests/run.sh check-long
check-slurm: packages
	$(MAKE) --no-print-directory all
	B=$B sh tests/slurm/slurm.sh
bench: all
	$B/bcd bench --json $B/bench.json

schema: $B/bcd
	$B/bcd schema job > schema/job.schema.json
	$B/bcd schema openapi > schema/openapi.json

UNITS = $(notdir $(wildcard deploy/*.service deploy/*.timer))
install: all
	install -D -m 755 $B/bcdd $(DESTDIR)$(PREFIX)/bin/bcdd
	install -D -m 755 $B/bcd $(DESTDIR)$(PREFIX)/bin/bcd
	install -D -m 644 $B/bcd_sqlite.so $(DESTDIR)$(PREFIX)/lib/bcd/bcd_sqlite.so
	install -D -m 755 deploy/bcdd-backup.sh $(DESTDIR)$(PREFIX)/lib/bcd/bcdd-backup
	install -D -m 755 deploy/bcdd-log.sh $(DESTDIR)$(PREFIX)/lib/bcd/bcdd-log
	$B/bcd help --man > $B/bcd.1
	$B/bcd completion bash > $B/bcd.bash
	$B/bcd completion zsh > $B/_bcd
	install -D -m 644 $B/bcd.1 $(DESTDIR)$(PREFIX)/share/man/man1/bcd.1
	install -D -m 644 deploy/bcdd.8 $(DESTDIR)$(PREFIX)/share/man/man8/bcdd.8
	install -D -m 644 $B/bcd.bash $(DESTDIR)$(PREFIX)/share/bash-completion/completions/bcd
	install -D -m 644 $B/_bcd $(DESTDIR)$(PREFIX)/share/zsh/site-functions/_bcd
	install -d $(DESTDIR)$(UNITDIR)
	for unit in $(UNITS); do \
		sed 's|@PREFIX@|$(PREFIX)|g; s|@SYSCONFDIR@|$(SYSCONFDIR)|g' deploy/$$unit > $B/$$unit && \
		install -m 644 $B/$$unit $(DESTDIR)$(UNITDIR)/$$unit || exit 1; done
	install -D -m 644 deploy/bcdd.sysusers $(DESTDIR)$(PREFIX)/lib/sysusers.d/bcdd.conf
	install -D -m 644 deploy/bcdd.tmpfiles $(DESTDIR)$(PREFIX)/lib/tmpfiles.d/bcdd.conf
	test -e $(DESTDIR)$(SYSCONFDIR)/default/bcdd || \
		install -D -m 644 deploy/bcdd.default $(DESTDIR)$(SYSCONFDIR)/default/bcdd
	install -D -m 644 README.md $(DESTDIR)$(PREFIX)/share/doc/bcdd/README.md
	install -D -m 644 deploy/OPERATING.md $(DESTDIR)$(PREFIX)/share/doc/bcdd/OPERATING.md
	install -D -m 644 deploy/changelog.md $(DESTDIR)$(PREFIX)/share/doc/bcdd/changelog.md
	install -D -m 644 deploy/slurm.conf.example $(DESTDIR)$(PREFIX)/share/doc/bcdd/examples/slurm.conf.example
	install -D -m 644 deploy/bcdd-slurm.conf $(DESTDIR)$(PREFIX)/share/doc/bcdd/examples/bcdd-slurm.conf
	install -D -m 644 deploy/nginx.conf $(DESTDIR)$(PREFIX)/share/doc/bcdd/examples/nginx.conf
deb: all
	sh deploy/install-packages.sh deb
	B=$B sh deploy/deb.sh
clean:
	rm -rf $B

.PHONY: all tests packages node-modules demo check check-slurm check-long bench schema install deb clean
.SECONDARY:
-include $(shell find $B/obj -name '*.d' 2>/dev/null)
