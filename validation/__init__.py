"""Verification problems and experiments beyond those of the wheel: loaded by `hvisph.verification.runner`."""
