"""What every test stands on."""

import signal

import pytest

from hvisph.verification.runner import checkout_module

checkout_module("problems")  # the folder `validation`, which tests import as `hvisph_validation`

# A shell that starts the tests in the background has Ctrl-C ignored, here and in every process started from here.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def threads_that_small_runs_ask_for(monkeypatch):
    """Let small runs have the threads that they ask for, so that they tell whether results hang on them."""
    monkeypatch.setattr("hvisph.precheck.estimate.FEEDS_A_THREAD", 1e-9)
