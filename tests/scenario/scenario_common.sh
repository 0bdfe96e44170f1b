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

# error RANKS NAMES ARGUMENT...: the run must fail with one line that names all of NAMES, with | between them: options, files, lines, values.
# How the sentence reads is not checked.
error() {
  local ranks=$1 code line name
  local -a names
  IFS='|' read -ra names <<<"$2"
  shift 2
  "${mpi[@]}" "$ranks" "$supple" "$@" >out.txt 2>err.txt
  code=$?
  check "$*: exit code $code" test "$code" -ne 0
  check "$*: $(grep -c '^supple: error: ' err.txt) error lines" test "$(grep -c '^supple: error: ' err.txt)" = 1
  line=$(grep '^supple: error: ' err.txt)
  for name in "${names[@]}"; do check "$*: '$line' does not name $name" grep -qF -- "$name" <<<"$line"; done
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
