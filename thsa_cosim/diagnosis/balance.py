"""Balance equations between measured signals (filled in by another hand)."""

from thsa_cosim.diagnosis.results import Balance
from thsa_cosim.scenario import DiagnoseSpec, Scenario


def close_balances(scenario: Scenario, spec: DiagnoseSpec) -> tuple[Balance, ...]:
    """Every balance of the scenario over all fit recordings."""
    return ()
