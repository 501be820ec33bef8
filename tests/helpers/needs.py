"""What a test needs of the machine or of packages outside the core. Without it the test skips, and
all that miss the same thing share one line of the summary; under PARC_JAX_NIGHT=1 it fails.

`pytestmark = pytest.mark.needs("node")` on tests, or `need("chromium")` in a fixture or at the head
of a file.
"""

import importlib.util
import os
import re
import shutil
import subprocess
from pathlib import Path

import driven_browser
import pytest

from parc_jax.common.errors import InputError

NIGHT = "PARC_JAX_NIGHT"  # set by .ci/nightly, on a machine that has everything
PROGRAMS = {
    "compiler": ("a C compiler (cc) is not installed", ("cc",)),
    "clang": ("clang is not installed", ("clang",)),
    "coq": ("Coq (coqc with ocamlfind) is not installed", ("coqc", "ocamlfind")),
    "eva": ("Frama-C (frama-c) is not installed", ("frama-c",)),
    "js_of_ocaml": ("js_of_ocaml is not installed", ("js_of_ocaml",)),
    "node": ("node is not installed", ("node",)),
}
EXTRAS = {
    "crazyflow": "drone",
    "jsbsim": "flight",
    "vehiclemodels": "cars",
    "shapely": "maps",
    "rosbags": "bags",
    "loky": "fleets",
    "distributed": "fleets",
    "fmpy": "fmu",
    "rclpy": "ros",
    "nav_msgs": "ros",
    "sensor_msgs": "ros",
    "viser": "live",
}


def missing(name: str) -> str | None:
    """Why a program, "chromium", "flocq", "dynobench" or a Python package cannot be had, in a
    phrase; None when it can.
    """
    if name == "chromium":
        return None if driven_browser.found() else "Chromium is not installed"
    if name == "flocq":
        return None if _flocq() else "Coq with Flocq (coqc, libcoq-flocq) is not installed"
    if name == "dynobench":
        return _dynobench()
    if name in PROGRAMS:
        why, programs = PROGRAMS[name]
        return None if all(map(shutil.which, programs)) else why
    if importlib.util.find_spec(name):
        return None
    return f"{name} is not installed: pip install 'parc_jax[{EXTRAS.get(name, 'test')}]'"


def _flocq() -> bool:
    """Does Coq find Flocq among its libraries?"""
    if not shutil.which("coqc"):
        return False
    found = subprocess.run(["coqc", "-config"], capture_output=True, text=True, check=True).stdout
    where = re.search(r"^COQLIB=(.*?)/?$", found, re.M)
    return where is not None and (Path(where[1]) / "user-contrib" / "Flocq").is_dir()


def _dynobench() -> str | None:
    """Why there is no Python with it, in a phrase."""
    from sims.foreign.dynobench.process import interpreter

    try:
        interpreter()
    except InputError as error:
        return str(error)
    return None


def need(*names: str) -> None:
    """Go on only where all of these are there."""
    for why in filter(None, map(missing, names)):
        if os.environ.get(NIGHT):
            pytest.fail(why, pytrace=False)
        pytest.skip(why, allow_module_level=True)
