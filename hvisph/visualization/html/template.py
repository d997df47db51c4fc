"""The templates of pages."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

PAGE = Path(__file__).with_name("page")


@cache
def template(name: str) -> Any:
    """Return a template of the folder `page` by its file's name."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string((PAGE / name).read_text(encoding="utf-8"))
