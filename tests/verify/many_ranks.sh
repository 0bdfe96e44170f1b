#!/usr/bin/env bash
# Solves on more and more ranks with as many tets for each: bounds on the growth of the iterations, and on the coarse problem of a rank.
# One rank has no borders that cut its incomplete factorisation; from 4 ranks on that is the same for all. Measured are 1.03 and
# 19 aggregates for P1 with multigrid (1.08 and 37 when every rank factors), 1.03 for CR.
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/many_ranks --build "${SB_BUILD:-build}" --tets 1000 --ranks 4,8 --growth 1.2 --aggregates 50
scripts/many_ranks --build "${SB_BUILD:-build}" --tets 1000 --ranks 4,8 --cases p1 --growth 1.2 --aggregates 25 --more "-pc_coarse_gathered 0"
