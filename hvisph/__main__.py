"""`python -m hvisph`: the same as the command `hvisph`."""

from hvisph.cli.main import app

app(prog_name="hvisph")
