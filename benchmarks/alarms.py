"""How often the alarm of ``thsa-cosim compare --watch`` is false, and how soon it is right.

``python benchmarks/alarms.py [--units 300] [--seed 1]``: units with a number of quantities, recorded once a week for a
year, beginning without a history; the estimates scatter by more than their standard errors say, by an amount that the
alarm does not know. Counted: false alarms per unit and year (the limit promises 1 at most), and the weeks until a
quantity that jumps or drifts is reported.
"""

import argparse

import numpy as np

from thsa_cosim.report.compare.watch import FEWEST, RECORDINGS, drift_of, jump_of, limits


def year(values: np.ndarray) -> np.ndarray:
    """Alarms (weeks,) of one unit from estimates (quantities, weeks): how many quantities raise one each week."""
    quantities, weeks = values.shape
    raised = np.zeros(weeks, dtype=int)
    for week in range(FEWEST - 1, weeks):
        jump, drift = limits(week + 1, quantities)
        for own in values[:, : week + 1]:
            j, d = jump_of(own) or 0.0, drift_of(own)[0] or 0.0
            raised[week] += abs(j) > jump or abs(d) > drift
    return raised


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    print(f"{given.units} units, {RECORDINGS} weeks, seed {given.seed}")
    for quantities in (1, 4, 12):
        for name, draw in (
            ("normal", rng.standard_normal),
            ("Student's t, 5 degrees of freedom", lambda size: rng.standard_t(5, size)),
            ("Student's t, 3 degrees of freedom", lambda size: rng.standard_t(3, size)),
        ):
            counts = [year(draw((quantities, RECORDINGS))).sum() for _ in range(given.units)]
            error = np.std(counts, ddof=1) / np.sqrt(given.units)
            print(
                f"{quantities:3d} quantities, {name}: {np.mean(counts):.2f} +- {error:.2f} false alarms a unit and year"
            )
    for kind in ("jump", "drift"):
        for size in (2.0, 4.0, 6.0):
            waited = []
            for _ in range(max(given.units // 3, 50)):
                values = rng.standard_normal((4, 2 * RECORDINGS))
                weeks = np.arange(RECORDINGS)
                values[0, RECORDINGS:] += size if kind == "jump" else size * weeks / 26
                found = [
                    w
                    for w in range(RECORDINGS)
                    if (
                        abs(jump_of(values[0, : RECORDINGS + w + 1]) or 0.0)
                        > limits(RECORDINGS + w + 1, 4)[0]
                    )
                    or (
                        abs(drift_of(values[0, : RECORDINGS + w + 1])[0] or 0.0)
                        > limits(RECORDINGS + w + 1, 4)[1]
                    )
                ]
                waited.append(found[0] + 1 if found else RECORDINGS)
            what = f"{size:g} sigma" + ("" if kind == "jump" else " in half a year")
            print(f"{kind} of {what} after a year: reported after {np.median(waited):.0f} weeks (median)")


if __name__ == "__main__":
    main()
