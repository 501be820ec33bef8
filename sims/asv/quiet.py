"""Imports that talk: MuJoCo MJX prints about optional packages, Brax imports an unmaintained one that warns."""

import contextlib
import importlib
import io
import warnings


def quiet_import(name: str):
    """The module, imported without its prints and deprecation warnings: output may be read by programs."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return importlib.import_module(name)
