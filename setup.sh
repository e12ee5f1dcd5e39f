#!/bin/sh
# Make the virtual environment .venv ready for what is asked: setup.sh core | test | lint | bench | fidelity
# Called by the Makefile; does nothing where nothing changed.
set -eu
cd "$(dirname "$0")"
want=$1
stamp=.venv/.ready-$want
sources="setup.sh setup.py pyproject.toml csrc"
solver=build/hapticd-hqp

fail() { printf 'setup: %s\n' "$@" >&2; exit 2; }

is_newest() { [ -e "$1" ] && [ -z "$(find $sources -newer "$1" -type f | head -n 1)" ]; }
fresh() { is_newest "$stamp"; }
is_built() { for of in .venv/.ready-*; do is_newest "$of" && return 0; done; return 1; }
fresh && exit 0

# One set-up at a time: `make run` and `make test` may start together.
mkdir -p build
if command -v flock >/dev/null 2>&1; then
    exec 9>build/.setup.lock
    flock 9
    fresh && exit 0
fi

[ "$(uname -s)" = Linux ] || fail "hapticd needs Linux (timerfd, SocketCAN); this is $(uname -s)."

python=
for candidate in "${PYTHON:-}" python3 python3.14 python3.13 python3.12 python3.11; do
    [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 || continue
    if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then python=$candidate; break; fi
done
[ -n "$python" ] || fail "no Python >= 3.11 found ($(python3 --version 2>&1 || true))." \
    "Install one, e.g.: sudo apt install python3.11 python3.11-venv python3.11-dev" \
    "or name it: make PYTHON=/path/to/python3.11 ..."

cc=${CC:-cc}
command -v "${cc%% *}" >/dev/null 2>&1 || fail "no C compiler ('$cc') found." \
    "Install one, e.g.: sudo apt install gcc libc6-dev   (or name it: make CC=clang ...)"

"$python" -c 'import venv, ensurepip' 2>/dev/null || fail "$python cannot make virtual environments." \
    "Install its venv module, e.g.: sudo apt install python3-venv"
include=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
[ -e "$include/Python.h" ] || fail "the C headers of $python are missing (no $include/Python.h)." \
    "Install them, e.g.: sudo apt install python3-dev"

if ! [ -x .venv/bin/python ] || ! .venv/bin/python -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "setup: creating .venv with $("$python" --version)"
    rm -rf .venv
    "$python" -m venv .venv
fi

case $want in
    core) extras= ;;
    bench) extras="[bench,plot]" ;;
    fidelity) extras="[plot,scene]" ;;
    *) extras="[$want]" ;;
esac
install() {
    .venv/bin/python -m pip install --quiet --disable-pip-version-check "$@" ||
        fail "pip could not install hapticd; the lines above say why."
}
if is_built; then # for another target: what this one needs beside it is missing, and nothing to compile
    echo "setup: installing what $want needs into .venv"
    install "hapticd$extras"
else
    echo "setup: installing hapticd ($want) into .venv; the first time takes a minute or two"
    # the solver is a distribution of its own: from this checkout, whatever a registry has
    .venv/bin/python csrc/stage_hqp.py --link "$solver"
    install --editable "$solver" --editable ".$extras"
    rm -f .venv/.ready-* # what the other targets need may have changed, too
fi
touch "$stamp"
