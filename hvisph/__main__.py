"""`python -m hvisph`: the same as the command `hvisph`."""

from hvisph.cli.start import main

main()
