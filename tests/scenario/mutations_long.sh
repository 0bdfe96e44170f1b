#!/usr/bin/env bash
# Damaged inputs of a run (mutations.py), forty times as many.
# @long
# @cpu 3000
set -uo pipefail
export SB_MUTATIONS=1000
exec "$([ -x .venv/bin/python ] && echo .venv/bin/python || echo python3)" tests/scenario/mutations.py
