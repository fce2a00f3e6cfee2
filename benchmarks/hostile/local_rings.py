"""Memory of rings that are kept when their connection is closed."""
from local_figures import FIGURES

TITLE, REFERENCE, measure = FIGURES["rings"]
