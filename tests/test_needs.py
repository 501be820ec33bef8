"""What a machine lacks skips by day and fails at night."""

import needs
import pytest
from needs import NIGHT, need


@pytest.mark.parametrize("name", ["compiler", "coq", "node", "chromium", "jsbsim"])
def test_what_is_missing_skips_by_day_and_fails_at_night(name, monkeypatch):
    monkeypatch.setattr(needs.shutil, "which", lambda program: None)
    monkeypatch.setattr(needs.importlib.util, "find_spec", lambda package: None)
    monkeypatch.delenv(NIGHT, raising=False)
    with pytest.raises(pytest.skip.Exception, match="not installed"):
        need(name)
    monkeypatch.setenv(NIGHT, "1")
    with pytest.raises(pytest.fail.Exception, match="not installed"):
        need(name)


def test_what_is_there_is_no_reason(monkeypatch):
    monkeypatch.setenv(NIGHT, "1")
    need("numpy", "pytest")
