"""Make the pages of results: run what has not been run, measure, draw and write.

    python tools/generate.py [PAGE ...] [--resolution 0.4mm] [--threads 2] [--runs runs] [--out docs/results]

At the own resolution of the cases all rows take about half an hour on two cores; a trial at 0.4mm
first fills the cache of compiled loops, which would count as cost otherwise. Runs that are there are
not repeated; delete them to do so. By hand are only the reasons in the page's script.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import published

PAGES = {"published": published.write}


def main() -> None:
    """Write the pages that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=", ".join(PAGES))
    parser.add_argument("--resolution", help="spacing in place of the cases' own, for a trial")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs/results")
    options = parser.parse_args()
    unknown = [page for page in options.pages if page not in PAGES]
    if unknown:
        parser.error(f"there is no page {unknown[0]}; there are: {', '.join(PAGES)}")
    options.out.mkdir(parents=True, exist_ok=True)
    for page in options.pages or PAGES:
        print(PAGES[page](options.out, options.runs, options.resolution, options.threads))


if __name__ == "__main__":
    main()
