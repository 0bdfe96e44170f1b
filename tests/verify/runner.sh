#!/usr/bin/env bash
# tests/run itself: limits are processor time and not the clock, whoever waits for ever is found, counts and exit codes, a line now and
# then also into a pipe, nothing is left running, two runs beside each other.
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh

# a test of the runner: name and what it does
make() {
  mkdir -p "$1" && printf '%s\n' "${@:3}" >"$1/$2.sh"
}
# run FOLDER ARGUMENT...: the tests of a folder; output in out.txt, exit code in $code
run() {
  "$top/tests/run" --tests "$SB_OUT/$1" --build "$SB_OUT/build" --group verify "${@:2}" 2>&1 | cat >out.txt
  code=${PIPESTATUS[0]}
}
says() {
  check "no line '$1' in: $(cat out.txt)" grep -qE -- "$1" out.txt
}
# ends FILE...: the processes whose numbers the files hold are gone
ends() {
  local pid
  for file in "$@"; do
    pid=$(cat "$file")
    check "$file: process $pid goes on" test -n "$pid" -a ! -e "/proc/$pid/status"
  done
}

# What computes too long fails, alone or through many short children; what takes long by the clock, with processes that compute beside
# it, passes.
make limits/verify slow '# @cpu 1' 'sleep 2'
make limits/verify busy '# @cpu 1' "echo \$\$ >$SB_OUT/busy.pid" 'echo computing' 'while :; do :; done'
make limits/verify children '# @cpu 1' 'while :; do bash -c "for ((i = 0; i < 20000; i++)); do :; done"; done'
make limits/verify bad 'echo the reason' 'exit 3'
make limits/verify missing 'echo no such tool' 'exit 77'
make limits/verify orphan "(while :; do :; done) &" "echo \$! >$SB_OUT/orphan.pid"
run limits --load 2 --every 0.5 --verbose
check "exit code $code" test "$code" = 1
says '^ok   verify slow.sh '
says '^FAIL verify busy.sh: no end after 1 s of processor time'
says '^    computing$'
says '^FAIL verify children.sh: no end after 1 s of processor time'
says '^FAIL verify bad.sh: exit code 3: the reason'
says '^skip verify missing.sh: no such tool$'
says '^ok   verify orphan.sh '
says '^[0-9]+ s: [0-6] of 6 done, [0-3] failed; running: .*slow.sh'
check "last line: $(tail -n 1 out.txt)" test "$(tail -n 1 out.txt)" = '2 passed, 3 failed, 1 skipped'
ends busy.pid orphan.pid

# What waits for ever without computing.
make asleep/verify asleep "echo \$\$ >$SB_OUT/asleep.pid" 'sleep 1000'
run asleep --stall 2
check "exit code $code" test "$code" = 1
says '^FAIL verify asleep.sh: computes nothing'
ends asleep.pid

# Twice, and twice at the same time: each run finds its folder empty.
# shellcheck disable=SC2016  # the test expands it
make good/verify alone 'cd "$SB_OUT" && test -z "$(ls)" && echo mine >file && sleep 1 && test "$(ls)" = file'
"$top/tests/run" --tests "$SB_OUT/good" --build "$SB_OUT/build" --group verify >other.txt 2>&1 &
run good --repeat 2
check "exit code $code" test "$code" = 0
check "last line: $(tail -n 1 out.txt)" test "$(tail -n 1 out.txt)" = '2 passed, 0 failed'
wait $!
check "beside it: exit code $?: $(tail -n 1 other.txt)" test $? = 0

# No test is a failure. An end from outside ends what runs.
run good --match nothing
check "exit code $code" test "$code" = 1
check "last line: $(tail -n 1 out.txt)" test "$(tail -n 1 out.txt)" = '0 passed, 1 failed'
rm -f asleep.pid
"$top/tests/run" --tests "$SB_OUT/asleep" --build "$SB_OUT/build" --group verify >other.txt 2>&1 &
until [ -s asleep.pid ]; do sleep 0.1; done
kill $!
wait $!
check "ended from outside: exit code $?" test $? = 143
ends asleep.pid

finish
