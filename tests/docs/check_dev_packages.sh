#!/usr/bin/env bash
# Whether ./dev installs what a machine lacks, and only that. dpkg-query, apt-get, apt-cache and npm are stood in for, so
# nothing is installed or fetched: what they report comes from the variables MISSING and AVAILABLE, and how they are
# called is written down.
set -euo pipefail
source_dir=$1 work=$2

rm -rf "$work"
mkdir -p "$work/bin" "$work/repository"
cp "$source_dir/dev" "$work/repository/"
cat >"$work/bin/dpkg-query" <<'SCRIPT'
#!/bin/sh
for package; do :; done
case " $MISSING " in *" $package "*) exit 1 ;; esac
printf installed
SCRIPT
cat >"$work/bin/apt-get" <<SCRIPT
#!/bin/sh
echo "\$*" >>"$work/apt-get.calls"
case "\$*" in
  *--print-uris*) [ -z "\$MIRROR" ] || echo "'\$MIRROR/dists/stable/InRelease' file 0" ;;
  *download*) cp "$work/headers.deb" libonnxruntime-dev_1.21.0_amd64.deb ;;
esac
SCRIPT
cat >"$work/bin/apt-cache" <<'SCRIPT'
#!/bin/sh
[ "$2" != "$AVAILABLE" ] || echo "Package: $2"
SCRIPT
# Packs a library that is not the right one.
cat >"$work/bin/npm" <<SCRIPT
#!/bin/sh
echo "\$*" >>"$work/npm.calls"
folder=package/bin/napi-v3/linux/x64
mkdir -p \$folder && echo wrong >\$folder/libonnxruntime.so.1 && tar -czf onnxruntime-node-1.21.0.tgz package
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
# said TEXT: in the output of the last build.
said() { grep -q -e "$1" "$work/output" || fail "./dev build did not say '$1' but: $(cat "$work/output")"; }
# build: ./dev build, which must get as far as cmake.
build() {
  rm -f "$work"/*.calls
  ./dev build >"$work/output" 2>&1 && fail "./dev build did not notice that cmake failed"
  said 'configuring failed'
}
cd "$work/repository"
export PATH=$work/bin:$PATH MISSING='' AVAILABLE='' MIRROR=''

MISSING="ccache libceres-dev"
listed=$(./dev packages | grep '^missing' | tr -s ' ' | tr '\n' ';')
[ "$listed" = "missing ccache;missing libceres-dev;" ] || fail "./dev packages lists as missing: $listed"
[ ! -e "$work/apt-get.calls" ] || fail "./dev packages called apt-get"

build
grep -q 'install --no-install-recommends ccache libceres-dev$' "$work/apt-get.calls" ||
  fail "./dev build called apt-get as: $(cat "$work/apt-get.calls")"
said '^== installing ccache libceres-dev'

# ONNX Runtime is installed where the machine's release holds it.
MISSING=libonnxruntime-dev AVAILABLE=libonnxruntime-dev
build
grep -q 'install --no-install-recommends libonnxruntime-dev$' "$work/apt-get.calls" ||
  fail "./dev build called apt-get as: $(cat "$work/apt-get.calls")"

# Where it does not and nothing can be fetched, the build goes on.
AVAILABLE=''
build
said '; this build will have no YOLO segmenter'

# A library that is not the one expected is not put into place, and nothing is left of it.
[ "$(uname -m)" = x86_64 ] && command -v apt-config >/dev/null && command -v dpkg-deb >/dev/null || exit 0
mkdir -p "$work/package/DEBIAN" "$work/package/usr/include/onnxruntime"
printf 'Package: x\nVersion: 1\nArchitecture: all\nMaintainer: x <x@x>\nDescription: x\n' >"$work/package/DEBIAN/control"
dpkg-deb --build "$work/package" "$work/headers.deb" >/dev/null
MIRROR=https://mirror.invalid/debian
build
said 'did NOT match); this build will have no YOLO segmenter'
grep -q 'onnxruntime-node@1.21.0' "$work/npm.calls" || fail "npm was called as: $(cat "$work/npm.calls")"
left=$(cd build && echo *)
[ "$left" = "onnxruntime.log packages.log release" ] || fail "in build/ there is now: $left"
