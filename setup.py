# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Builds the Python module with CMake, and puts the shared libraries that it needs beside it. See pyproject.toml.

CMake also gets the arguments in CMAKE_ARGS."""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

import setuptools
from setuptools.command.build_ext import build_ext

SOURCES = pathlib.Path(__file__).resolve().parent
# Every system with Python has these; a copy of them would not fit to its kernel and its other libraries.
OF_THE_SYSTEM = re.compile(r"(ld-linux.*|linux-vdso|lib(c|m|dl|rt|pthread|resolv|util|gcc_s|stdc\+\+))\.so\b")
MODULE = "_d2s1r"


def needed_libraries(file, folders):
    """{name: path} of all libraries that a file needs, directly or not, but for those of the system."""
    environment = dict(os.environ, LD_LIBRARY_PATH=os.pathsep.join(map(str, folders)))
    lines = subprocess.run(["ldd", str(file)], env=environment, check=True, capture_output=True, text=True).stdout.splitlines()
    found = {}
    for line in lines:
        name, _, path = line.strip().partition(" => ")
        if OF_THE_SYSTEM.match(name) or not path:
            continue
        if path.startswith("not found"):
            sys.exit(f"{name} is not found, which the module needs; install it, or set LD_LIBRARY_PATH")
        found[name] = path.rsplit(" (", 1)[0]
    return found


class BuildWithCMake(build_ext):
    def build_extension(self, ext):
        build = pathlib.Path(self.build_temp).resolve()
        package = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        # RPATH, unlike RUNPATH, also holds for the libraries that the libraries of the folder need.
        subprocess.run([
            "cmake", "-S", SOURCES, "-B", build, "-G", "Ninja", "-D", "CMAKE_BUILD_TYPE=Release", "-D", "BUILD_TESTING=OFF",
            "-D", "CMAKE_UNITY_BUILD=ON", "-D", f"Python3_EXECUTABLE={sys.executable}", "-D", "CMAKE_INSTALL_PREFIX=/opt/d2s1r",
            "-D", "D2S1R_PYTHON_DIR=python", "-D", "CMAKE_INSTALL_LIBDIR=python/d2s1r/lib", "-D", "CMAKE_BUILD_WITH_INSTALL_RPATH=ON",
            "-D", "CMAKE_MODULE_LINKER_FLAGS=-Wl,--disable-new-dtags", "-D", "CMAKE_SHARED_LINKER_FLAGS=-Wl,--disable-new-dtags",
            *shlex.split(os.environ.get("CMAKE_ARGS", ""))], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "python-d2s1r"], check=True)
        (module,) = (build / "python" / "d2s1r").glob(MODULE + "*.so")
        package.mkdir(parents=True, exist_ok=True)
        shutil.copy2(module, self.get_ext_fullpath(ext.name))
        libraries = package / "lib"
        libraries.mkdir(exist_ok=True)
        for name, path in needed_libraries(module, (build / "libs").glob("*")).items():
            shutil.copy2(path, libraries / name)


version = re.search(r"project\(d2s1r VERSION ([\d.]+)", (SOURCES / "CMakeLists.txt").read_text()).group(1)
setuptools.setup(version=version, ext_modules=[setuptools.Extension("d2s1r." + MODULE, [])], cmdclass={"build_ext": BuildWithCMake})
