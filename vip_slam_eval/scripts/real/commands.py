# SPDX-License-Identifier: BSD-3-Clause
"""Programs of the workspace, as the scripts of real and rendered recordings call them."""
import os
import subprocess
import sys


def find(package, name):
    """A program of the workspace, found as rosrun finds it."""
    for prefix in os.environ.get('CMAKE_PREFIX_PATH', '').split(os.pathsep):
        path = os.path.join(prefix, 'lib', package, name)
        if os.access(path, os.X_OK):
            return path
    sys.exit('no program %s/%s; is the workspace built and its devel/setup.bash sourced?' % (package, name))


def logged(command, log):
    """Exit status; what the command prints goes into the file `log`."""
    with open(log, 'w', encoding='utf-8') as file:
        return subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, check=False).returncode


def printed(command):
    """What the command prints."""
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False).stdout.decode()


def last_words(log):
    with open(log, encoding='utf-8', errors='replace') as file:
        lines = [line.strip() for line in file.read().replace('\r', '\n').splitlines() if line.strip()]
    return lines[-1] if lines else 'no word'
