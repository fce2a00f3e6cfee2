"""Floods of what an operator asks for."""
from local_figures import FIGURES

TITLE, REFERENCE, measure = FIGURES["changes"]
