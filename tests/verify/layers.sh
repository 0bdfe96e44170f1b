#!/usr/bin/env bash
# Layers, by what the object files call: no file calls a higher layer, no files of one module call
# each other in a circle, no function in include/ is used by its own module alone.
#
# @cpu 60
set -euo pipefail
exec scripts/check-layers "$SB_BUILD/src"
