#!/bin/sh
# Makes .venv with the locked dependencies and this package in editable form.
# A bare Debian python3 cannot make a venv until python3-venv is there; as root we add it.
set -eu
cd "$(dirname "$0")/.."

for python in python3.11 python3.12 python3.13 python3; do
    if command -v "$python" >/dev/null 2>&1 &&
        "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
        break
    fi
    python=
done
[ -n "$python" ] || { echo "hotlever needs Python 3.11 or newer; none found" >&2; exit 1; }

rm -rf .venv
if ! "$python" -m venv .venv >/dev/null 2>&1; then
    rm -rf .venv
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        echo "python3-venv is missing: installing it"
        apt-get update -qq && apt-get install -y -qq python3-venv
        "$python" -m venv .venv
    else
        echo "$python cannot make a virtual environment: install python3-venv, e.g." >&2
        echo "    sudo apt-get install python3-venv" >&2
        exit 1
    fi
fi
.venv/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
