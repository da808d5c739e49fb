#!/bin/sh
# Builds the package in a virtual environment of its own and tests it there.
#
#     python/test.sh [arguments of pytest]
#
# PYTHON is the interpreter (python3), VENV where the environment is (target/venv).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${VENV:-$here/target/venv}
[ -x "$venv/bin/python" ] || "${PYTHON:-python3}" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet "$here[test]"
exec "$venv/bin/python" -m pytest -q "$here/tests" "$@"
