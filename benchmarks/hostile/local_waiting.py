"""Messages that wait for copies ten seconds apart."""
from local_figures import FIGURES

TITLE, REFERENCE, measure = FIGURES["waiting"]
