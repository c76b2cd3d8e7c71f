within THSA.Effects;
block Empirical "Terms in speed, position, distance and load, for what no effect with a name explains"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real k_1 = 0 "Coefficient of 1";
  parameter Real k_vv = 0 "Coefficient of v |v|, at the speed v_r if the exponent is not 2";
  parameter Real n(unit="1", min=1, max=4) = 2 "Exponent";
  parameter Real v_r(min=1e-9) = 1 "Speed at which powers of all exponents are the same";
  parameter Real k_vvv = 0 "Coefficient of v^3";
  parameter Real k_z = 0 "Coefficient of z";
  parameter Real k_zz = 0 "Coefficient of z^2";
  parameter Real k_zs = 0 "Coefficient of z sgn(v)";
  parameter Real k_zzs = 0 "Coefficient of z^2 sgn(v)";
  parameter Real k_zv = 0 "Coefficient of z v";
  parameter Real k_Ns = 0 "Coefficient of |N| sgn(v)";
  parameter Real k_Nv = 0 "Coefficient of |N| v";
  parameter Real k_NNs = 0 "Coefficient of N^2 sgn(v)";
  parameter Real k_a = 0 "Coefficient of |v|";
  parameter Real k_f = 0 "Coefficient of exp(-|v|/v_f) sgn(v)";
  parameter Real k_g = 0 "Coefficient of exp(-(v/v_f)^2) sgn(v)";
  parameter Real k_h = 0 "Coefficient of sgn(v)/(1 + (v/v_f)^2)";
  parameter Real v_f(min=1e-12) = 1 "Speed over which these fall";
  parameter Real k_d = 0 "Coefficient of exp(-d/d_f) sgn(v) with the distance d since the start";
  parameter Real d_f(min=1e-12) = 1 "Distance over which that falls";
  parameter Real k_sin = 0 "Coefficient of sin(w z)";
  parameter Real k_cos = 0 "Coefficient of cos(w z)";
  parameter Real k_sin2 = 0 "Coefficient of sin(2 w z)";
  parameter Real k_cos2 = 0 "Coefficient of cos(2 w z)";
  parameter Real w = 1 "Wave number";
  Real d(start=0, fixed=true, nominal=1e-2) "Distance travelled; at rest where no term has it";
equation
  der(d) = if k_d > 0 or k_d < 0 then noEvent(abs(v)) else 0;
  F = k_1 + (if k_vv > 0 or k_vv < 0 then k_vv*v^2*((v^2 + 1e-12*v_r^2)/v_r^2)^((n - 2)/2)*s else 0) + k_vvv*v^3
    + (k_z + k_zz*z + (k_zs + k_zzs*z)*s + k_zv*v)*z
    + (k_Ns*s + k_Nv*v)*noEvent(abs(N)) + k_NNs*N^2*s + k_a*noEvent(abs(v))
    + (if k_f > 0 or k_f < 0 then k_f*exp(-noEvent(abs(v))/v_f)*s else 0)
    + (if k_g > 0 or k_g < 0 then k_g*exp(-(v/v_f)^2)*s else 0)
    + (if k_h > 0 or k_h < 0 then k_h/(1 + (v/v_f)^2)*s else 0)
    + (if k_d > 0 or k_d < 0 then k_d*exp(-d/d_f)*s else 0)
    + (if k_sin > 0 or k_sin < 0 or k_cos > 0 or k_cos < 0 then k_sin*sin(w*z) + k_cos*cos(w*z) else 0)
    + (if k_sin2 > 0 or k_sin2 < 0 or k_cos2 > 0 or k_cos2 < 0 then k_sin2*sin(2*w*z) + k_cos2*cos(2*w*z) else 0);
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end Empirical;
