#!/bin/sh
# Installs seatrial from this folder alone: ./install.sh [--bridge] [FOLDER]
#   FOLDER     takes the environment (default: ~/seatrial)
#   --bridge   only what runs on the vehicle: no PyTorch, SciPy, Numba or terminal app
#   PYTHON     which Python to use (default: python3)
set -eu
here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
part=ground
folder=
for word; do
  case $word in
    --bridge) part=bridge ;;
    -*) echo "there is no $word; it goes: $0 [--bridge] [FOLDER]" >&2; exit 2 ;;
    *) folder=$word ;;
  esac
done
folder=${folder:-$HOME/seatrial}
python=${PYTHON:-python3}

command -v "$python" >/dev/null || { echo "there is no $python here; install Python 3.11 or newer, or name one: PYTHON=... $0" >&2; exit 1; }
version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
machine=$(uname -m)
if ! grep -qx "$part $machine $version" "$here/holds.txt"; then
  echo "this bundle has no '$part' for $machine and Python $version; it has:" >&2
  sed 's/^/  /' "$here/holds.txt" >&2
  exit 1
fi
sums=sha256sum
command -v sha256sum >/dev/null || sums="shasum -a 256"  # macOS
# Of a bundle that was unpacked without the ground station's wheels, the sums of what is there.
(cd "$here" && $sums --check --quiet --ignore-missing SHA256SUMS) || {
  echo "a file is not as it was packed: copy the archive again" >&2
  exit 1
}
"$python" -m venv "$folder" || {
  echo "$python can't make a virtual environment; Debian, Ubuntu: python3-venv, which is not in this bundle" >&2
  exit 1
}
if [ "$part" = bridge ]; then
  what=seatrial
  set -- --find-links "$here/wheels/bridge"
else
  extras=ground
  # The libraries that read recordings of other programs, where the bundle has them for this machine.
  if grep -qx "logs $machine $version" "$here/holds.txt"; then extras=ground,logs; fi
  what="seatrial[$extras]"
  set -- --find-links "$here/wheels/bridge" --find-links "$here/wheels/ground"
fi
PIP_CONFIG_FILE=/dev/null "$folder/bin/python" -m pip --disable-pip-version-check install --quiet --no-index "$@" "$what"
echo "installed; try: $folder/bin/seatrial --help"
