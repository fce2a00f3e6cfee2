"""Connections that are held by no process."""
from local_figures import FIGURES

TITLE, REFERENCE, measure = FIGURES["places"]
