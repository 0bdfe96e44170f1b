#!/usr/bin/env bash
# The Debian package: built from a clone, without a complaint of lintian; what is in it runs where it was unpacked, on one process and on two.
#
# @long
# @cpu 3000
set -uo pipefail
# shellcheck source=tests/scenario/scenario_common.sh
source tests/scenario/scenario_common.sh
for tool in dpkg-buildpackage dh git gmsh; do
  command -v $tool >/dev/null || skip "$tool is missing: apt-get install build-essential debhelper git gmsh"
done

git clone -q "$top" clone || skip "$top is no checkout of git"
check "make deb" make -s -C clone deb
check "one package" test "$(find clone/build/deb -name 'supple_*.deb' | wc -l)" = 1
deb=$(find clone/build/deb -name 'supple_*.deb')
dpkg-deb -x "$deb" root
check "Depends: $(dpkg-deb -f "$deb" Depends)" grep -q libpetsc <<<"$(dpkg-deb -f "$deb" Depends)"
check "version $(dpkg-deb -f "$deb" Version)" grep -qF "$(sed -n 's/^#define SB_VERSION "\(.*\)"/\1-1/p' "$top/include/sbbase.h")" <<<"$(dpkg-deb -f "$deb" Version)"
for name in bin/supple bin/supple-mesh share/man/man1/supple.1.gz share/bash-completion/completions/supple-mesh share/zsh/vendor-completions/_supple share/supple/meshes/organ.msh; do
  check "no /usr/$name in it" test -e "root/usr/$name"
done
for n in 1 2; do
  "${mpi[@]}" $n root/usr/bin/supple root/usr/share/supple/scenarios/cantilever.opts -output_dir bar$n -progress no >told$n.txt 2>&1
  check "on $n ranks: $(tail -n 1 told$n.txt)" test -s bar$n/history.csv
done

finish
