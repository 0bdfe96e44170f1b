# What the scripts of this folder share: running the program, counting checks, and what a failing run has to look like.
# Read with `source`; moves to the empty folder of the test.
# shellcheck shell=bash

passed=0 failed=0
top=$PWD
cd "$SB_OUT" || exit 1
export PETSC_OPTIONS=
read -ra mpi <<<"$SB_MPI"
case $SB_SUPPLE in /*) supple=$SB_SUPPLE ;; *) supple=$top/$SB_SUPPLE ;; esac

check() { # text of the check, then a command that must succeed
  if "${@:2}"; then passed=$((passed + 1)); else
    failed=$((failed + 1))
    echo "failed: $1"
  fi
}

# error RANKS TEXT ARGUMENT...: the run must fail with one line that holds TEXT
error() {
  local ranks=$1 text=$2 code
  shift 2
  "${mpi[@]}" "$ranks" "$supple" "$@" >out.txt 2>err.txt
  code=$?
  check "$*: exit code $code" test "$code" -ne 0
  check "$*: $(grep -c '^supple: error: ' err.txt) error lines" test "$(grep -c '^supple: error: ' err.txt)" = 1
  check "$*: not '$text' but '$(grep '^supple: error: ' err.txt)'" grep -qF -- "supple: error: $text" err.txt
  check "$*: a trace" test -z "$(cat out.txt err.txt | grep 'PETSC ERROR')"
}

skip() { # the reason: this machine cannot do it
  echo "$1"
  exit 77
}

finish() { # the last line of a script
  echo "$passed passed, $failed failed"
  test "$failed" = 0
}
