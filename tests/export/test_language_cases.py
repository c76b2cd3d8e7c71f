"""Cases of the language (tests/modelica/LanguageCases.mo), all in one FMU, against closed forms."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

pytest.importorskip("casadi", reason="the export extra is not installed")
pytest.importorskip("ziglang", reason="the export extra is not installed")

import fmpy

from thsa_cosim.export import export_fmu
from thsa_cosim.export.flatten import list_models

CASES = Path(__file__).parent.parent / "modelica" / "LanguageCases.mo"
e = np.exp

CLOSED: dict[str, Callable[[np.ndarray], dict[str, np.ndarray]]] = {
    "initAlgLoop": lambda t: {"x": e(-t)},
    "initParamExprStart": lambda t: {"x": 9 * e(-t)},
    "initDerGiven": lambda t: {"x": 2 * e(-2 * t)},
    "initSecondOrder": lambda t: (lambda w: {"x": e(-t) * (np.cos(w * t) + (-2 + 1) / w * np.sin(w * t))})(
        np.sqrt(3)
    ),
    "initDiscrete": lambda t: {"n": np.where(t <= 0.5, 4, 5)},
    "initPre": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 0.5 * (t - 0.5))},
    "initNonlinear": lambda t: {"x": 2 * e(-t)},
    "initAlgorithm": lambda t: {"x": 4 * e(-t)},
    "initIf": lambda t: {"x": 1 + 0 * t},
    "initWhenInitial": lambda t: {"y": np.where(t <= 0.5, 1, 0.5)},
    "initGuessRoot": lambda t: {"x": -2 * e(-t)},
    "initTwoFixedPars": lambda t: {"x": e(-2 * t)},
    "initStartArrayParam": lambda t: {"x[3]": 3 * e(-t)},
    "initFixedDiscrete": lambda t: {"x": np.where(t < 0.5, 2 * t, 1 + 4 * (t - 0.5))},
    "evTwoSameTime": lambda t: {"x": t},
    "evElsewhen": lambda t: {"n": np.where(t <= 0.2, 0, np.where(t <= 0.6, 1, 11))},
    "evSampleCount": lambda t: {"y": np.floor((t - 0.05) / 0.1 + 1e-9) + 1},
    "evSampleZoh": lambda t: (lambda k: {"x": 0.9**k * (1 - (t - 0.1 * k))})(np.floor(t / 0.1 + 1e-9)),
    "evSampleStart": lambda t: (lambda k: {"x": 0.9**k * (1 - (t - 0.1 * k))})(np.floor(t / 0.1 + 1e-9)),
    "evReinitVec": lambda t: {"x[2]": np.where(t <= 0.5, 1 - 2 * t, 6 - 2 * (t - 0.5))},
    "evReinitPre": lambda t: {"x": np.where(t < 0.5, t, 1 - t)},
    "evEdge": lambda t: {"x": t + np.maximum(0, t - np.pi / 6)},
    "evChange": lambda t: {"x": sum(np.maximum(0, t - (j - 0.5) / 5) for j in range(1, 6))},
    "evHysteresis": lambda t: {
        "x": np.where(
            t < 0.5,
            t,
            np.where(((t - 0.5) % 0.6) < 0.3, 0.5 - ((t - 0.5) % 0.6), 0.2 + ((t - 0.5) % 0.6) - 0.3),
        )
    },
    "evNoevent": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 2 * (t - 0.5))},
    "evTimeRel": lambda t: {"x": np.clip(t - 0.25, 0, 0.5)},
    "evSignAbs": lambda t: {"y": abs(1 - 2 * t), "z": abs(1 - 2 * t)},
    "evMod": lambda t: {"y": np.mod(t, 0.3)},
    "evModState": lambda t: (lambda k: {"x": k * 0.03125 + 0.5 * (t - 0.25 * k) ** 2})(np.floor(t / 0.25)),
    "evRemNeg": lambda t: {
        "b": -1 + 0 * t,
        "c": 2 + 0 * t,
        "d": -2 + 0 * t,
        "y[1]": -1 + 0 * t,
        "y[2]": 2 + 0 * t,
        "y[3]": -2 + 0 * t,
    },
    "evCeilInt": lambda t: {"c": -2 + 0 * t, "i": -3 + 0 * t, "f": 2 + 0 * t},
    "evWhenAlgorithm": lambda t: {"x": sum(2 * np.maximum(0, t - (0.1 + 0.2 * k)) for k in range(5))},
    "evWhenInFor": lambda t: {"x": sum(i * np.maximum(0, t - 0.2 * i) for i in (1, 2, 3))},
    "evChainWhen": lambda t: {"x": np.maximum(0, t - 0.3)},
    "evPreInt": lambda t: (lambda seg: {"x": seg})(
        np.array(
            [
                sum(
                    (min(s, 0.2 * (k + 1)) - 0.2 * k) * ((2**k) + (0 if k == 0 else 2 ** (k - 1)))
                    for k in range(5)
                    if s > 0.2 * k
                )
                for s in t
            ]
        )
    ),
    "evInitialWhenSample0": lambda t: {"y": 1 + np.floor(t / 0.5 + 1e-9)},
    "evBoolToReal": lambda t: {"x": np.maximum(0, t - 0.5)},
    "evStartOnSurface": lambda t: {"x": t},
    "evGeZero": lambda t: {"z": t},
    "arMatrixMul": lambda t: {"x[1]": 6 * t, "x[2]": 15 * t},
    "arTranspose": lambda t: {"x[3]": 15 * t},
    "arComprehension2": lambda t: {"x": 23 * t},
    "arSliceAssign": lambda t: {"x[3]": 2 * t, "x[4]": t},
    "arColon": lambda t: {"r[1]": 3 * t, "c[2]": 3 * t},
    "arCat": lambda t: {"y[5]": t, "y[4]": 4 + 0 * t},
    "arMinMaxProd": lambda t: {"y[1]": t, "y[2]": 3 * t, "y[3]": 6 * t},
    "arSizeZero": lambda t: {"x": e(-t)},
    "arForNested": lambda t: {"T[2,3]": e(-6 * t)},
    "arOfComponentsMod": lambda t: {"s": e(-t) + e(-2 * t) + e(-3 * t)},
    "arMatrixOfComp": lambda t: {"r[2,1].x": e(-3 * t)},
    "arCrossSkew": lambda t: {"y[3]": t, "z[3]": t},
    "arLinsolve": lambda t: {"y[1]": (3 * t - 1) / 5, "y[2]": (2 - t) / 5},
    "arDiagonal": lambda t: {"x[3]": e(-3 * t)},
    "arPower": lambda t: {"y": 3 * t},
    "arIndexVar": lambda t: {
        "x": np.where(t < 0.3, t, np.where(t < 0.6, 0.3 + 2 * (t - 0.3), 0.9 + 4 * (t - 0.6)))
    },
    "arEnumIndex": lambda t: {"x": e(-3 * t)},
    "arBoolIndex": lambda t: {"x": e(-2 * t)},
    "arDerMatrix": lambda t: {"X[1,1]": np.cos(t), "X[2,1]": -np.sin(t)},
    "arEndMinus": lambda t: {"y": 3 + t},
    "arRangeStep": lambda t: {"y": 5 * t},
    "arStringArray": lambda t: {"x": e(-2 * t)},
    "arElementwiseDiv": lambda t: {"y[2]": 3 * t},
    "arScalarPlus": lambda t: {"y[2]": 2 + t},
    "arSumComp": lambda t: {"s": 6 - 14 * t},
    "rdPackage": lambda t: {"t.x": 1.5 * e(-2 * t) - 0.5},
    "rdFunction": lambda t: {"t.x": e(-3 * t)},
    "rdArray": lambda t: {"s.a[2].x": e(-2 * t)},
    "rdConstrainedbyMod": lambda t: {"s.t.x": e(-6 * t)},
    "rdChain": lambda t: {"q.s.t.x": 5 * e(-2 * t)},
    "rdType": lambda t: {"s.x": e(-t)},
    "rdConnector": lambda t: {"s.x": e(-t)},
    "exMulti": lambda t: {"y": 3 * e(-t)},
    "exNestedMod": lambda t: {"a.x": 3 * e(-4 * t)},
    "exParamOuter": lambda t: {"a.x": e(-5 * t)},
    "exEachNested": lambda t: {"b[2].a[1].x": e(-2 * t)},
    "exEachInner": lambda t: {"b[1].a[2].x": e(-3 * t)},
    "exShortClass": lambda t: {"b.x": e(-7 * t)},
    "exTypeAlias": lambda t: {"x": 3 * e(-t)},
    "exArrayType": lambda t: {"x[3]": 3 * e(-t)},
    "fnMulti": lambda t: {"p": t + 1, "q": 2 * t},
    "fnDefault": lambda t: {"y": 3 * t, "z": t + 1},
    "fnNamed": lambda t: {"y": 1 - t},
    "fnRecursive": lambda t: {"y": 120 * t},
    "fnVectorized": lambda t: {"y[2]": 4 + 0 * t, "y[3]": t**2},
    "fnWhile": lambda t: {"y": 12 * t},
    "fnArrayOut": lambda t: {"y[3]": 3 * t},
    "fnRecord": lambda t: {"p.y": 2 * t},
    "fnRecordCtor": lambda t: {"p.y": 7 + 0 * t, "q.y": t},
    "fnMatrix": lambda t: {"d": 3 * t - 2},
    "fnNestedCall": lambda t: {"y": 2 * (2 * t + 1) + 1},
    "fnDerAnnot": lambda t: {"z": -2 * e(-2 * t)},
    "fnInverseAnnot": lambda t: {"x": np.log(1 + t)},
    "fnBreak": lambda t: {"y": 3 * t},
    "fnProtectedInit": lambda t: {"y": t * t + 1},
    "fnPackageConst": lambda t: {"y": 2 * t},
    "fnIfExprCont": lambda t: {"x": np.where(t < 0.5, 0.5 * t, 0.25 + 0.5 * (t * t - 0.25))},
    "nmC": lambda t: {"NAN": 6 * e(-t)},
    "nmSpecial": lambda t: {"pre_": 2 * e(-t)},
    "nmShadow": lambda t: {"a.x": e(-3 * t), "A1.x": e(-2 * t)},
    "nmCase": lambda t: {"x": 2 * e(-2 * t), "X": e(-t)},
    "nmE": lambda t: {"x": e(-2 * t)},
    "nmNumbers": lambda t: {"y": 10.1 * t},
    "rcNested": lambda t: {"x": e(-6 * t)},
    "rcArray": lambda t: {"x": e(-3 * t)},
    "rcExtends": lambda t: {"x": e(-8 * t)},
    "rcEquation": lambda t: {"q.y": 2 * t},
    "rcFinalMod": lambda t: {"x": e(-10 * t)},
    "rcComponentBind": lambda t: {"w.x": e(-12 * t)},
    "enCompare": lambda t: {"x": e(-t)},
    "enInteger": lambda t: {"x": e(-3 * t)},
    "enFor": lambda t: {"x[2]": e(-2 * t)},
    "enVar": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 2 * (t - 0.5))},
    "enAlias": lambda t: {"a.x": e(-2 * t)},
    "tbLookup": lambda t: {"y": 1 - 2 * abs(t - 0.5)},
    "nlCubic": lambda t: {
        "y": np.array(
            [np.real(next(r for r in np.roots([1, 0, 1, -2 - s]) if abs(r.imag) < 1e-9)) for s in t]
        )
    },
    "nlSqrt": lambda t: {"y": ((-1 + np.sqrt(1 + 4 * (2 + t))) / 2) ** 2},
    "nlTanh": lambda t: {"y": np.array([brentq(lambda y, s=s: y + np.tanh(5 * y) - s, -1, 2) for s in t])},
    "nlDiode": lambda t: {
        "v": np.array(
            [brentq(lambda v, s=s: 1e-6 * (e(v / 0.025) - 1) + v - s, -1, 1, xtol=1e-14) for s in t]
        )
    },
    "alIf": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 2 * (t - 0.5))},
    "alFor": lambda t: {"y": 10 * t},
    "alWhile": lambda t: {"y": 15 * t},
    "alTwoSections": lambda t: {"b": 2 * t + 1},
    "alKeep": lambda t: {"x": np.where(3 * t < 0.5, 3 * t, 0.5 + 4 * (t - 0.5 / 3))},
    "alArray": lambda t: {"y[2]": 5 * t},
    "ioNested": lambda t: {"b.v": 5 * t, "s.b.v": 2 * t},
    "ioVar": lambda t: {"b.v": t * t},
    "cdConnect": lambda t: {"s.a.f": -1 + 0 * t},
    "cdArray": lambda t: {"q.x": e(-t)},
    "coSignal": lambda t: {"h.y": 6 * t},
    "coArray": lambda t: {"a.y": 3 * t},
    "coRecordInConnector": lambda t: {"t.p.q.b": 2 * t},
    "opHomotopy": lambda t: {"x": e(-2 * t)},
    "opSmooth": lambda t: {"y": np.maximum(0, 2 * t - 1) ** 2},
    "opSemilinear": lambda t: {"y": np.where(t < 0.5, 2 * t - 1, 3 * (2 * t - 1))},
    "opIntdiv": lambda t: {"x": e(-9.5 * t)},
    "opPowerAssoc": lambda t: {"y": 4 * t + 1},
    "opPrecedence": lambda t: {"y": t - 4},
    "opExpNeg": lambda t: {"y": -4 + 0 * t},
    "opPowParam": lambda t: {"y": (3 - t) ** 3},
    "opAtan2": lambda t: {"y": t},
    "opLog10": lambda t: {"y": np.log10(1 + t)},
    "opString": lambda t: {"x": e(-t)},
    "imVariants": lambda t: {"y": 36 * t},
    "imMulti": lambda t: {"y": 6 * t},
    "unDisplay": lambda t: {"T": 300 * e(-t)},
    "anMany": lambda t: {"x": e(-t)},
    "anEvaluatePar": lambda t: {"x": e(-3 * t)},
    "ifEqEvents": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 2 * (t - 0.5))},
    "ifEqState": lambda t: {"x": np.where(t < 0.5, t, 0.5 + 3 * (t - 0.5))},
    "ifEqImplicit": lambda t: {"x": np.where(t < 0.5, 2 * t, 1 + 4 * (t - 0.5))},
    "derAlg": lambda t: {"z": np.cos(e(-t)) * -e(-t)},
    "derTime": lambda t: {"y": 2 * np.cos(2 * t)},
    "derExpr": lambda t: {"x": e(-2 * t)},
    "idxReduction": lambda t: {"x": 1 + 0 * t, "y": t},
    "idxParamMass": lambda t: {"x2": 0.5 * t * t},
    "constEq": lambda t: {"x": 3 * t},
    "intOverflow": lambda t: {"x": e(-t)},
    "annotDerivative": lambda t: {"z": -2 * e(-t)},
    "complexRec": lambda t: {"y": t * t + 1},
    "strEnumParam": lambda t: {"x": e(-3 * t)},
    "arc": lambda t: {
        "x": np.where(
            t < 0.25, 2 * t, np.where(t < 0.5, 0.5 + (t - 0.25) + 2 * (t - 0.25) ** 2, 0.875 + 2 * (t - 0.5))
        )
    },
    "freeInLoop": lambda t: {
        "y": np.array([brentq(lambda y, s=s: y + 2 * np.arctan(y / 2) - s, -1, 2, xtol=1e-14) for s in t])
    },
    "fnVectorizedTwo": lambda t: {"s[2]": 2 + t, "d[1]": 1 - t},
    "fnVectorizedMatrix": lambda t: {"y[2,1]": 6 + 0 * t, "y[2,2]": 2 * t},
    "fnVectorizedOverVectors": lambda t: {"y[2]": 12 + 0 * t, "y[3]": 5 * t},
    "ovPlus": lambda t: {"c.x": 3 * t, "c.y": 1 + t},
    "ovDot": lambda t: {"s": 2 * t * t + t},
    "ovScale": lambda t: {"c.x": 3 * t, "d.y": -4 + 0 * t},
    "ovCtor": lambda t: {"a.y": t, "c.x": t + 2},
    "ovConvert": lambda t: {"c.y": t + 5},
    "ovSum": lambda t: {"s.x": 6 * t},
    "ovArray": lambda t: {"s[2].x": 2 * t - 1},
    "cxArray": lambda t: {"c[2].re": t - 2, "c[2].im": t + 2, "d[2].re": -2 + 0 * t, "d[1].im": t},
    "cxSum": lambda t: {"s.re": 2 * t, "s.im": 3 + 0 * t},
    "fnArrayRow": lambda t: {"y": t + 4},
    "recString": lambda t: {"y": 2 * t},
    "recAssignField": lambda t: {"d.b": t + 1},
    "algoRec": lambda t: {"d.b": 2 * t},
    "whenArray": lambda t: {"x[2]": np.where(t < 0.5, 2 * t, 1 + 3 * (t - 0.5))},
    "whileBreak": lambda t: {"y": 5 * t},
    "forInVector": lambda t: {"y": 9 * t},
    "forReverse": lambda t: {"y": 321 * t},
    "minComp": lambda t: {
        "y": np.minimum(np.minimum(t, 1 - t), 0.7),
        "z": np.maximum(np.maximum(t, 2 - 2 * t), 2.1),
    },
    "vecIf": lambda t: {"x[2]": np.where(t < 0.5, 2 * t, 1 + 4 * (t - 0.5))},
    "matrixConcat": lambda t: {"y": 9 * t},
    "nestedInner": lambda t: {"b.a.x": 7 * t},
    "paramArrayDep": lambda t: {"x": 2 * t},
    "stringFn": lambda t: {"x": 3 * t},
    "finalStart": lambda t: {"x": 2 * e(-t)},
    "sampleOffset": lambda t: {"x": sum(np.maximum(0, t - (0.15 + 0.2 * k)) for k in range(5))},
    "twoSamples": lambda t: {"a": sum(2 * k * np.maximum(0, t - 0.2 * k) for k in range(1, 6))},
    "initTwoUnfixed": lambda t: {"x": 2 * e(-3 * t), "y": 3 * e(-2 * t)},
    "evElsewhenOrder": lambda t: {"x": np.interp(t, [0, 0.2, 0.4, 1], [0, 0, 0.2, 0.2 + 11 * 0.6])},
    "evReinitTwo": lambda t: {"s": np.where(t < 0.3, t, 0.3 + 10.3 * (t - 0.3))},
    "evStateMachine": lambda t: {"x": np.interp(t, [0, 0.5, 0.7, 1], [0, 0.5, 0.1, 0.1])},
    "evPreChain": lambda t: {
        "x": np.interp(t, [0, 0.1, 0.3, 0.5, 0.7, 0.9, 1], np.cumsum([0, 0.1, 0.4, 0.6, 1, 1.6, 1.3]))
    },
    "evCascade": lambda t: {"x": np.maximum(0, t - 0.3)},
    "evFloorDiv": lambda t: {
        "x": np.interp(
            t,
            [0, 0.1, 0.25, 0.3, 0.5, 0.7, 0.75, 0.9, 1],
            np.cumsum([0, -2.2, -1.8, -0.55, -0.2, 0, 0.5, 1.65, 2.1]),
        ),
        "y": 0.8 * np.minimum(t, 0.5),
    },
    "arEachFinal": lambda t: {"a[2].x": e(-5 * t), "b[1].x": e(-3 * t), "b[2].x": e(-7 * t)},
}
START: dict[str, float] = {
    "initParamExprStart.a": 3.0,
    "rcFinalMod.a.k": 5.0,
    "rcComponentBind.a.k": 4.0,
    "opPowParam.n": 3.0,
    "anEvaluatePar.k": 3.0,
}


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("cases") / "All.fmu"
    return export_fmu(
        "LanguageCases.All",
        package=CASES.parent / "none",
        libraries=[CASES],
        output=output,
        platforms=["linux64"],
    )


@pytest.fixture(scope="module", params=["CoSimulation", "ModelExchange"])
def result(fmu: Path, request: pytest.FixtureRequest) -> np.ndarray:
    options = {} if request.param == "CoSimulation" else {"solver": "CVode", "relative_tolerance": 1e-8}
    output = [f"{case}.{name}" for case, reference in CLOSED.items() for name in reference(np.zeros(1))]
    return fmpy.simulate_fmu(
        str(fmu), stop_time=1.0, output_interval=0.01, output=output, start_values=START, fmi_type=request.param,
        record_events=False, **options,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CLOSED)
def test_equals_the_closed_form(result: np.ndarray, case: str) -> None:
    t = result["time"]
    assert t[-1] == pytest.approx(1.0)
    early, late = CLOSED[case](np.maximum(t - 1e-7, 0.0)), CLOSED[case](t + 1e-7)
    for name, expected in CLOSED[case](t).items():
        scale = max(1.0, float(np.max(np.abs(expected))))
        smooth = np.abs(late[name] - early[name]) < 1e-4 * scale  # at a jump both sides are right
        assert np.count_nonzero(smooth) > 80
        error = np.abs(result[f"{case}.{name}"] - expected)[smooth]
        assert float(np.max(error)) < 1e-4 * scale


def test_every_case_has_a_closed_form() -> None:
    models = {n.split(".")[1].lower() for n in list_models(CASES) if n.endswith(".M")}
    assert models == {case.lower() for case in CLOSED}
