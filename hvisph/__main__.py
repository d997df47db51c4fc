"""`python -m hvisph`: the same as the command `hvisph`."""

from hvisph.cli.entry_point import main

main()
