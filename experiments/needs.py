# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What a program needs that is not here."""
import pathlib
import sys


def stop(error, packages, and_then="run with /usr/bin/python3"):
    """Ends a program that lacks a module: with its help if that was asked for, which needs no module, else with a line."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(sys.modules["__main__"].__doc__.strip())
        print(f"\nIt needs Debian's {packages}; {and_then}.")
        sys.exit(0)
    sys.exit(f"{pathlib.Path(sys.argv[0]).name}: {error}; install Debian's {packages}, and {and_then}")
