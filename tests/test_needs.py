"""What a machine lacks skips by day and fails at night."""

import needs
import pytest
from needs import NIGHT, need


def ending(name: str) -> tuple[type, bool] | None:
    try:
        return need(name)
    except (pytest.skip.Exception, pytest.fail.Exception) as ended:
        return type(ended), "not installed" in str(ended)


def test_what_is_missing_skips_by_day_and_fails_at_night(monkeypatch):
    monkeypatch.setattr(needs.shutil, "which", lambda program: None)
    monkeypatch.setattr(needs.importlib.util, "find_spec", lambda package: None)
    for night, kind in (("", pytest.skip.Exception), ("1", pytest.fail.Exception)):
        monkeypatch.setenv(NIGHT, night)
        names = ("compiler", "coq", "node", "chromium", "jsbsim")
        wrong = [name for name in names if ending(name) != (kind, True)]
        assert not wrong, (night, wrong)


def test_what_is_there_is_no_reason(monkeypatch):
    monkeypatch.setenv(NIGHT, "1")
    need("numpy", "pytest")
