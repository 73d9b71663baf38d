"""Packages that only some files and devices need: extras of the installation."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Final

from forcelab.errors import InputError

#: Packages that may be missing, and the extra that brings each.
PACKAGES: Final = {
    "rosbags": "rosbag",
    "av": "video",
    "pyarrow": "parquet",
    "h5py": "hdf5",
    "openpyxl": "excel",
    "pyxdf": "xdf",
    "nptdms": "tdms",
    "pylsl": "lsl",
    "distributed": "cluster",
}


def load_extra(module: str, extra: str, what: str) -> ModuleType:
    """Import a package's module where it is needed; `what` needs it, as in "An ELAN file".

    `InputError` if it is not installed; the sentence names the extra that brings it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or module.partition(".")[0] != error.name.partition(".")[0]:
            raise  # the package is there, and broken
        raise InputError(
            f"{what} needs the package {error.name}; install it with "
            f"{sys.executable} -m pip install 'forcelab[{extra}]'."
        ) from error
