"""Flags of rare models: compiled loops contain only the branches of the models in use.

What most cases have - the common equations of state, strengths and failure - is in every loop, so that another metal
needs no other loop. The rest is half of what a loop would be made of: `table.fitted` takes out what no material of
a case has.
"""

FURTHER_EOS = True  # Tillotson, polynomial, Murnaghan, JWL, tables
FURTHER_STRENGTH = True  # beyond Johnson-Cook
FURTHER_DAMAGE = True  # beyond Johnson-Cook
POROUS = True
