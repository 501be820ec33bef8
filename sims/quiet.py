"""Libraries that talk, or that strict settings would stop: MJX prints about optional packages and
mixes types, Brax imports an unmaintained package that warns."""

import contextlib
import importlib
import io
import warnings

import jax


def quiet_import(name: str):
    """The module, imported without its prints and deprecation warnings: output may be read by
    programs.
    """
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return importlib.import_module(name)


@contextlib.contextmanager
def lenient():
    """MJX mixes dtypes and ranks inside; the caller's strict settings are for the caller's own
    code.
    """
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield
