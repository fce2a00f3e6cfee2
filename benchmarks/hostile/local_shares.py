"""All that one user's programs can take."""
from local_figures import FIGURES

TITLE, REFERENCE, measure = FIGURES["shares"]
