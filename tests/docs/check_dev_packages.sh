#!/usr/bin/env bash
# Whether ./dev installs what a machine lacks, and only that. dpkg-query and apt-get are stood in for, so nothing is
# installed: the first says that everything but ccache and libceres-dev is there, the second writes down how it is called.
set -euo pipefail
source_dir=$1 work=$2

rm -rf "$work"
mkdir -p "$work/bin" "$work/repository"
cp "$source_dir/dev" "$work/repository/"
cat >"$work/bin/dpkg-query" <<'SCRIPT'
#!/bin/sh
for package; do :; done
case $package in ccache | libceres-dev) exit 1 ;; esac
printf installed
SCRIPT
cat >"$work/bin/apt-get" <<SCRIPT
#!/bin/sh
echo "\$*" >>"$work/apt-get.calls"
SCRIPT
cat >"$work/bin/apt-cache" <<'SCRIPT'
#!/bin/sh
SCRIPT
# sudo in a container may be missing; as root it is not called.
cat >"$work/bin/sudo" <<'SCRIPT'
#!/bin/sh
exec "$@"
SCRIPT
# The build that would follow ends here.
printf '#!/bin/sh\nexit 1\n' >"$work/bin/cmake"
chmod +x "$work"/bin/*

fail() { echo "$1" >&2; exit 1; }
cd "$work/repository"
export PATH=$work/bin:$PATH

listed=$(./dev packages | grep '^missing' | tr -s ' ' | tr '\n' ';')
[ "$listed" = "missing ccache;missing libceres-dev;" ] || fail "./dev packages lists as missing: $listed"
[ ! -e "$work/apt-get.calls" ] || fail "./dev packages called apt-get"

./dev build >"$work/output" 2>&1 && fail "./dev build did not notice that cmake failed"
grep -q 'install --no-install-recommends ccache libceres-dev$' "$work/apt-get.calls" ||
  fail "./dev build called apt-get as: $(cat "$work/apt-get.calls")"
grep -q '^== installing ccache libceres-dev' "$work/output" || fail "./dev build did not say what it installs"
