"""Order of the guides, from use to mathematics; a guide that is not listed is an error."""

ORDER = (
    "robust_simulator.py",
    "robust_examples.py",
    "robust_reliability.py",
    "robust_failures.py",
    "robust_study.py",
    "drive_data_sheet.py",
    "catalogue_to_decision.py",
    "own_problem.py",
    "extend.py",
    "exact_moments.py",
    "steady_state.py",
    "verdict_score.py",
)


def place(file_name: str) -> int:
    """Return the place of a guide."""
    return ORDER.index(file_name)
