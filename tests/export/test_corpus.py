"""The corpus of small models (tests/modelica/Corpus.mo), all in one FMU, against closed forms."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy

from thsa_cosim.export import export_fmu
from thsa_cosim.export.flatten import list_models

CORPUS = Path(__file__).parent.parent / "modelica" / "Corpus.mo"
POINTS = 201
e = np.exp


def chain(t: np.ndarray) -> np.ndarray:
    """Speed of the last of three inertias between springs."""
    stiffness = 4 * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]])
    values, vectors = np.linalg.eigh(stiffness)
    start = vectors.T @ np.array([1.0, 0.0, 0.0])
    return np.array([vectors[2] @ (start * np.cos(np.sqrt(np.maximum(values, 0)) * s)) for s in t])


def ball(t: np.ndarray) -> np.ndarray:
    """Height of a ball that loses half of its speed at every impact."""
    first = np.sqrt(0.2)
    second = first + 2 * 0.5 * 10 * first / 10
    third = second + 2 * 0.25 * 10 * first / 10
    speeds = [0.0, 5 * first, 2.5 * first, 1.25 * first]
    starts = [0.0, first, second, third]
    height = np.where(t < first, 1 - 5 * t**2, 0.0)
    for speed, begin, end in zip(speeds[1:], starts[1:], [second, third, 9.0], strict=True):
        inside = (t >= begin) & (t < end)
        height = np.where(inside, speed * (t - begin) - 5 * (t - begin) ** 2, height)
    return height


def sampled(t: np.ndarray) -> np.ndarray:
    """A sampled proportional controller on an integrator: (1 - K T)^k, linear between."""
    k = np.floor(t / 0.1 + 1e-9)
    return 0.8**k * (1 - 2 * (t - 0.1 * k))


def pendulum(t: np.ndarray) -> np.ndarray:
    """Height of a pendulum that goes over the top."""
    run = solve_ivp(
        lambda _, y: [y[1], -9.81 * np.sin(y[0])], (0, 1), [0, 7], t_eval=t, rtol=1e-11, atol=1e-12
    )
    return -np.cos(run.y[0])


def implicit(t: np.ndarray) -> np.ndarray:
    """y with exp(y) + y = 1 + t."""
    return np.array([brentq(lambda y, s=s: e(y) + y - 1 - s, -1, 2, xtol=1e-14) for s in t])


def loop(t: np.ndarray) -> np.ndarray:
    """a with a = cos(sin(a)/2)/2 + x, x = 0.2 + 0.1 t."""
    return np.array(
        [brentq(lambda a, s=s: 0.5 * np.cos(0.5 * np.sin(a)) + 0.2 + 0.1 * s - a, 0, 2) for s in t]
    )


def big_loop(t: np.ndarray) -> np.ndarray:
    """The first of five unknowns."""
    found = []
    for s in (1.0, 2.0):
        matrix = np.diag(s * (3 + np.arange(1, 6.0))) + 1
        found.append(np.linalg.solve(matrix, np.arange(1, 6.0))[0])
    return np.where(t <= 0.5, *found)


def triangle(t: np.ndarray) -> np.ndarray:
    """Up to 0.3, then between 0.3 and 0.1."""
    s = np.mod(t - 0.3, 0.4)
    return np.where(t < 0.3, t, np.where(s < 0.2, 0.3 - s, s - 0.1))


CLOSED: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "loopOverDerivatives.T[1]": lambda t: 1 - e(-t),
    "loopOverDerivatives.T[3]": lambda t: 1 - e(-3 * t),
    "loopOverDerivatives.T[5]": lambda t: 1 - e(-5 * t),
    "redeclaredModel.m.v": lambda t: e(-2 * t),
    "redeclaredNested.s.m.v": lambda t: e(-3 * t),
    "redeclaredComponent.s.m.v": lambda t: e(-4 * t),
    "redeclaredByExtension.v": lambda t: e(-2 * t),
    "finalBoolean.x": lambda t: 2 * t,  # with k = 0
    "vectors.s": lambda t: e(-t) + 2 * e(-2 * t) + 3 * e(-3 * t),
    "vectors.d": lambda t: e(-t) + 4 * e(-2 * t) + 9 * e(-3 * t),
    "vectors.tail[2]": lambda t: 3 * e(-3 * t),
    "matrices.x[2]": lambda t: -np.sin(t),
    "matrices.t": lambda t: 2 + 2 * np.cos(t),
    "functions.x": lambda t: (1 + 2 * t) ** -0.5,
    "functions.p": lambda t: 1 + 2 * (1 + 2 * t) ** -0.5 + 3 / (1 + 2 * t),
    "functions.y": lambda t: np.minimum(4 * (1 + 2 * t) ** -0.5, 1),
    "enumerations.x": lambda t: e(-5 * t),
    "chain.j[3].w": chain,
    "rigid.j2.phi": lambda t: 6 * t,
    "environment.body.v": lambda t: -5 * t,
    "conditional.b.x": lambda t: e(-2 * t),
    "records.coil.i": lambda t: e(-2 * t),
    "bouncingBall.h": ball,
    "sampledController.x": sampled,
    "latch.x": triangle,
    "rounding.m": lambda t: t - 0.25 * np.floor(t / 0.25 + 1e-9),
    "algorithm_.x": lambda t: 1.5 * e(-2 * t) - 0.5,
    "implicit.y": implicit,
    "nonlinearLoop.a": loop,
    "nonlinearLoop.q": lambda t: np.sqrt((1.2 + 0.1 * t) / 2),
    "otherRoot.q": lambda t: -np.sqrt(4 + 5 * t),
    "freeParameter.y": lambda t: 2 * t,
    "steadyStart.x": lambda t: 2 + 0 * t,
    "initially.x": lambda t: t,
    "initially.y": lambda t: 7 + 0 * t,
    "pendulum.y": pendulum,
    "names.sx_0": lambda t: 1 + 3 * e(-t),
    "edges.early": lambda t: 1 + 0 * t,
    "edges.x": lambda t: t,
    "bigLoop.z[1]": big_loop,
    "pivots.x": lambda t: e(-t),
    "pivots.y[4]": lambda t: 4 * e(-t),
    "leaving.f": lambda t: np.where(2 * t > 1, 2, 3),
    "leaving.c": lambda t: np.where(2 * t > 1, 10, 20),
    "simplified.y": lambda t: -2 + 0 * t,
    "noLoss.x": lambda t: e(-2 * t),
    "held.x": lambda t: np.where(t < 0.5, t, 2 * t - 0.5),
}
AT_THE_END = {
    "bouncingBall.n": 2,
    "sampledController.ticks": 11,
    "latch.turns": 22,
    "edgeAndChange.rising": 1,
    "edgeAndChange.changes": 2,
    "rounding.n": 10,
    "rounding.f": -3,
    "rounding.c": 3,
    "algorithm_.last": 1.5 * float(e(-1.0)) - 0.5,
    "functions.active": 1,
}


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("corpus") / "All.fmu"
    return export_fmu(
        "Corpus.All", package=CORPUS.parent / "none", libraries=[CORPUS], output=output, platforms=["linux64"]
    )


@pytest.fixture(scope="module", params=["CoSimulation", "ModelExchange"])
def result(fmu: Path, request: pytest.FixtureRequest) -> np.ndarray:
    options = {} if request.param == "CoSimulation" else {"solver": "CVode", "relative_tolerance": 1e-9}
    return fmpy.simulate_fmu(
        str(fmu), stop_time=1.0, output_interval=1.0 / (POINTS - 1), output=[*CLOSED, *AT_THE_END],
        start_values={"finalBoolean.k": 0.0}, fmi_type=request.param, record_events=False, **options,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CLOSED)
def test_equals_the_closed_form(result: np.ndarray, name: str) -> None:
    t = result["time"]
    expected = CLOSED[name](t)
    scale = max(1.0, float(np.max(np.abs(expected))))
    near_jump = np.zeros(len(t), dtype=bool)
    for jump in {
        "rounding.m": (0.25, 0.5, 0.75, 1.0),
        "bigLoop.z[1]": (0.5,),
        "leaving.f": (0.5,),
        "leaving.c": (0.5,),
    }.get(name, ()):
        near_jump |= np.abs(t - jump) < 1e-9
    error = np.abs(result[name] - expected)[~near_jump]
    assert float(np.max(error)) < 2e-5 * scale


@pytest.mark.slow
@pytest.mark.parametrize("name", AT_THE_END)
def test_ends_at_the_closed_form(result: np.ndarray, name: str) -> None:
    assert result[name][-1] == pytest.approx(AT_THE_END[name], abs=1e-5)


def test_every_model_of_the_corpus_is_tested() -> None:
    models = {n.split(".", 1)[1] for n in list_models(CORPUS)} - {"All"}
    tested = {name.split(".")[0].rstrip("_").lower() for name in (*CLOSED, *AT_THE_END)}
    assert {m.lower() for m in models if not m.startswith("Parts.")} == tested
