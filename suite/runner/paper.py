"""What the paper prints of its own experiments, to stand beside ours in the report.

Source: Zhang et al., AAMAS 2020, section 4. Its figures are photographs and curves; this is all
that it gives in numbers. Texts are HTML.
"""

# Program: number of the figure.
FIGURES = {"hop_count": 4, "hop_count_two_seeds": 5, "firefly": 6, "firefly_no_delay": 7,
           "edge_following": 8}

# Which of the paper's four robots a platform stands for.
ROBOTS = {"sim-kilobot": "Kilobot", "kilobot-emulated": "Kilobot", "sim-coachbot": "Coachbot",
          "coachbot-lab": "Coachbot", "coachbot-radio": "Coachbot",
          "argos-kilobot": "Argos Kilobot", "argos-footbot": "Footbot"}

# Program: key of a figure in the report (success: runs that succeeded): what the paper prints.
TEN = {"success": "10 of 10"}  # "All experiments are performed successfully 10 times each"
PRINTED = {
    "hop_count": TEN | {"robots": "36", "converged_s": "&le; 10"},  # pictures: 10 s after the start
    "hop_count_two_seeds": TEN | {"robots": "36", "converged_s": "&le; 10"},
    # "the curves realistically never reach 36"; what figure 7 says of both is of real Kilobots:
    # shorter in the random state than the other, which is noisy until almost 10 s.
    "firefly": TEN | {"robots": "36", "together": "&lt; 1",
                      "synchronised_s": "sooner than without mitigation"},
    "firefly_no_delay": {"robots": "36", "synchronised_s": "almost 10, never as well"},
    "edge_following": TEN | {"robots": "6", "revolutions": "&ge; 5"},
}
