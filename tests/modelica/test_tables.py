"""The tables of Modelica.Blocks: against NumPy's and SciPy's interpolation, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, RegularGridInterpolator

ca = pytest.importorskip("casadi", reason="the export extra is not installed")

from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.causal import make_causal
from thsa_cosim.export.expression import Translator
from thsa_cosim.export.flatten import flatten
from thsa_cosim.modelica.tables import (
    AKIMA,
    CONSTANT,
    HOLD,
    LAST_TWO,
    LINEAR,
    NONE,
    PERIODIC,
    Table,
    interpolate,
)
from thsa_cosim.modelica.terms import Term

X = [-1.0, 0.0, 0.5, 2.0, 3.0, 4.5]
Y = [2.0, -1.0, 0.25, 0.3, 4.0, 3.5]
INSIDE = np.linspace(-1, 4.5, 89)
OUTSIDE = np.array([-3.0, -1.5, 5.0, 9.0])


class Refusing:
    """Stands for the evaluator, of which tables use the error alone."""

    def error(self, where: object, message: str) -> ModelicaError:
        return ModelicaError(message)


def curve(smoothness: int, extrapolation: int, u: np.ndarray, x=X, y=Y) -> np.ndarray:
    t = ca.SX.sym("u")
    value = interpolate(
        Refusing(), None, Table([], smoothness, extrapolation, []), x, list(y), Term("ref", ("u",))
    )
    made = Translator({"u": t}, lambda name: ca.SX(0), frozenset()).real(value, events=False)
    return np.array(ca.Function("f", [t], [made]).map(len(u))(u)).ravel()


@pytest.mark.parametrize("extrapolation", [HOLD, LAST_TWO])
def test_linear_segments_equal_numpy(extrapolation):
    np.testing.assert_allclose(curve(LINEAR, extrapolation, INSIDE), np.interp(INSIDE, X, Y), atol=1e-14)


@pytest.mark.parametrize("extrapolation", [HOLD, LAST_TWO])
def test_akima_splines_equal_scipy(extrapolation):
    expected = Akima1DInterpolator(X, Y)(INSIDE)
    np.testing.assert_allclose(curve(AKIMA, extrapolation, INSIDE), expected, atol=1e-13)


def test_constant_segments_hold_the_point_before():
    expected = np.array(Y)[np.searchsorted(X, INSIDE, side="right") - 1]
    np.testing.assert_array_equal(curve(CONSTANT, LAST_TWO, INSIDE), expected)
    np.testing.assert_array_equal(curve(CONSTANT, LAST_TWO, OUTSIDE), [2, 2, 3.5, 3.5])


@pytest.mark.parametrize("smoothness", [LINEAR, AKIMA])
def test_outside_the_end_points_are_held_or_their_slopes_go_on(smoothness):
    np.testing.assert_array_equal(curve(smoothness, HOLD, OUTSIDE), [2, 2, 3.5, 3.5])
    spline = Akima1DInterpolator(X, Y)
    slopes = (-3.0, -0.5 / 1.5) if smoothness == LINEAR else spline.derivative()([X[0], X[-1]])
    expected = np.where(OUTSIDE < 0, 2 + slopes[0] * (OUTSIDE + 1), 3.5 + slopes[1] * (OUTSIDE - 4.5))
    np.testing.assert_allclose(curve(smoothness, LAST_TWO, OUTSIDE), expected, rtol=1e-12)


@pytest.mark.parametrize("smoothness", [LINEAR, CONSTANT])
def test_a_periodic_table_repeats(smoothness):
    period, u = X[-1] - X[0], INSIDE[:-1] + 1e-3
    inside = curve(smoothness, LAST_TWO, u)
    np.testing.assert_allclose(curve(smoothness, PERIODIC, u + period), inside, atol=1e-12)
    np.testing.assert_allclose(curve(smoothness, PERIODIC, u - 2 * period), inside, atol=1e-12)


def test_two_points_of_one_abscissa_are_a_jump():
    u = np.array([0.5, 1.0 - 1e-9, 1.0, 1.5])
    found = curve(LINEAR, LAST_TWO, u, x=[0.0, 1.0, 1.0, 2.0], y=[0.0, 1.0, 5.0, 7.0])
    np.testing.assert_allclose(found, [0.5, 1.0, 5.0, 6.0], atol=1e-8)


@pytest.mark.parametrize(
    ("smoothness", "extrapolation", "x", "word"),
    [
        (LINEAR, NONE, X, "without extrapolation"),
        (4, HOLD, X, "monotone"),
        (LINEAR, HOLD, [0, 1, 0.5, 2, 3, 4], "has to rise"),
        (AKIMA, HOLD, [0, 1, 1, 2, 3, 4], "has to rise"),
    ],
)
def test_what_is_not_known_is_refused(smoothness, extrapolation, x, word):
    with pytest.raises(ModelicaError, match=word):
        curve(smoothness, extrapolation, INSIDE, x=x)


BLOCKS = """
package Tables
  type Smoothness = enumeration(LinearSegments, ContinuousDerivative, ConstantSegments);
  type Extrapolation = enumeration(HoldLastPoint, LastTwoPoints, Periodic, NoExtrapolation);
  class Curve
    extends ExternalObject;
    function constructor
      input String tableName; input String fileName; input Real table[:, :]; input Integer columns[:];
      input Smoothness smoothness; input Extrapolation extrapolation; output Curve curve;
      external "C" curve = ModelicaStandardTables_CombiTable1D_init3(fileName, tableName, table, columns);
    end constructor;
    function destructor
      input Curve curve;
      external "C" ModelicaStandardTables_CombiTable1D_close(curve);
    end destructor;
  end Curve;
  class Map
    extends ExternalObject;
    function constructor
      input String tableName; input String fileName; input Real table[:, :];
      input Smoothness smoothness; input Extrapolation extrapolation; output Map map;
      external "C" map = ModelicaStandardTables_CombiTable2D_init3(fileName, tableName, table);
    end constructor;
    function destructor
      input Map map;
      external "C" ModelicaStandardTables_CombiTable2D_close(map);
    end destructor;
  end Map;
  function curveValue
    input Curve curve; input Integer icol; input Real u; output Real y;
    external "C" y = ModelicaStandardTables_CombiTable1D_getValue(curve, icol, u);
  end curveValue;
  function mapValue
    input Map map; input Real u1; input Real u2; output Real y;
    external "C" y = ModelicaStandardTables_CombiTable2D_getValue(map, u1, u2);
  end mapValue;
  model Use
    parameter String file = "NoName";
    parameter Curve curve = Curve("NoName", file, [0, 1, 10; 1, 3, 30; 2, 2, 20], {2, 3},
      Smoothness.LinearSegments, Extrapolation.HoldLastPoint);
    parameter Map map = Map("NoName", "NoName", [0, 0, 1, 3; 0, 1, 2, 0; 2, 5, -1, 4],
      Smoothness.LinearSegments, Extrapolation.LastTwoPoints);
    output Real y[2] = {curveValue(curve, k, time) for k in 1:2};
    output Real z = mapValue(map, time, 2 - time/2);
  end Use;
  model FromFile
    extends Use(file = "data.mat");
  end FromFile;
end Tables;
"""


def test_columns_and_two_dimensions_of_the_standard_librarys_functions(tmp_path: Path):
    file = tmp_path / "Tables.mo"
    file.write_text(BLOCKS)
    model = make_causal(flatten("Tables.Use", tmp_path / "none", [file]))
    t = np.linspace(-1, 3, 41)
    found = np.array(ca.Function("w", [model.time, model.m], [model.w]).map(len(t))(t, ca.DM(0, len(t))))
    names = {v.name: v.index for v in model.variables if v.kind == "algebraic"}
    one = np.interp(t, [0, 1, 2], [1, 3, 2])
    np.testing.assert_allclose(found[names["y[1]"]], one, atol=1e-14)
    np.testing.assert_allclose(found[names["y[2]"]], 10 * one, atol=1e-13)
    grid = RegularGridInterpolator(
        ([0, 2], [0, 1, 3]), [[1, 2, 0], [5, -1, 4]], bounds_error=False, fill_value=None
    )
    np.testing.assert_allclose(found[names["z"]], grid(np.column_stack((t, 2 - t / 2))), atol=1e-13)


def test_a_table_of_a_file_is_refused_with_its_place(tmp_path: Path):
    file = tmp_path / "Tables.mo"
    file.write_text(BLOCKS)
    with pytest.raises(ModelicaError, match=r"Tables.mo:\d+: a table that is read from a file"):
        flatten("Tables.FromFile", tmp_path / "none", [file])
