"""Other spellings, for error messages and `hvisph help`: common words, and words of other codes."""

from functools import cache
from pathlib import Path

from hvisph.core.text import Plain


@cache
def spellings(table: str) -> Plain:
    """Return a table of `spellings.yaml` by its name."""
    import yaml  # not before it is used: the help needs none

    return dict(yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))[table])
