"""Sweeps: many scenarios from one file, over all cores or a cluster (docs/sweeps.md).

plan      the file, and the cells that it asks for
profiles  simulators of other profiles, compiled once
store     the sweep's folder: finished runs, whole or not there
work      runs what is missing, over all cores
slurm     the same as job arrays
effects   what the settings do, with intervals
table     what was found as CSV;  page  as HTML
command   what the user calls
"""


class SweepError(Exception):
    """One line for the user: what is wrong and what to do."""
