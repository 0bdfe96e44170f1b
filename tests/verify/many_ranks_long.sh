#!/usr/bin/env bash
# 5,000 tets for each of 1 and 16 ranks: iterations of P1 grow by less than 1.3 (1.10 measured, 1.5 when every rank factors the coarse
# operator), and a rank solves for its own aggregates only (66 measured). CR: 1.09 measured.
# @long
# @cpu 900
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/many_ranks --build "${SB_BUILD:-build}" --ranks 1,16 --cases p1 --growth 1.3 --aggregates 100
scripts/many_ranks --build "${SB_BUILD:-build}" --ranks 1,16 --cases cr --growth 1.2
