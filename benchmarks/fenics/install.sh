#!/bin/sh
# Install legacy FEniCS (dolfin) from Debian for /usr/bin/python3.  Safe to run again.
set -eu

if /usr/bin/python3 -c "import dolfin, petsc4py" 2>/dev/null; then
    echo "legacy FEniCS is already installed"
    exit 0
fi
if [ "$(id -u)" -ne 0 ]; then
    echo "install.sh: installing python3-dolfin needs root; run it as 'sudo sh install.sh'" >&2
    exit 1
fi
apt-get update
DEBIAN_FRONTEND=noninteractive apt-get install -y python3-dolfin
/usr/bin/python3 -c "import dolfin; print('installed dolfin', dolfin.__version__)"
