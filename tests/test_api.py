"""The Python interface that `import mjnav` offers."""

import pytest

import mjnav


def test_it_offers_what_it_lists():
    assert mjnav.__all__ == ["Simulation", "load_scenario", "open_log", "replay", "run"]
    assert set(mjnav.__all__) <= set(dir(mjnav))
    assert all(callable(getattr(mjnav, name)) for name in mjnav.__all__)


def test_a_name_that_it_does_not_have_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'mjnav' has no attribute 'runn'"):
        _ = mjnav.runn
