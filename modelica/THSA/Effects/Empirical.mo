within THSA.Effects;
block Empirical "Polynomial in speed, position and load, for what no effect with a name explains"
  extends THSA.Interfaces.FrictionEffect;
  parameter Real k_1 = 0 "Coefficient of 1";
  parameter Real k_vv = 0 "Coefficient of v |v|";
  parameter Real k_vvv = 0 "Coefficient of v^3";
  parameter Real k_z = 0 "Coefficient of z";
  parameter Real k_zz = 0 "Coefficient of z^2";
  parameter Real k_zs = 0 "Coefficient of z sgn(v)";
  parameter Real k_zzs = 0 "Coefficient of z^2 sgn(v)";
  parameter Real k_zv = 0 "Coefficient of z v";
  parameter Real k_N = 0 "Coefficient of N";
  parameter Real k_Ns = 0 "Coefficient of |N| sgn(v)";
  parameter Real k_Nv = 0 "Coefficient of |N| v";
  parameter Real k_NNs = 0 "Coefficient of N^2 sgn(v)";
equation
  F = k_1 + (k_vv*v*s + k_vvv*v^2)*v + (k_z + k_zz*z + (k_zs + k_zzs*z)*s + k_zv*v)*z
    + k_N*N + (k_Ns*s + k_Nv*v)*noEvent(abs(N)) + k_NNs*N^2*s;
  annotation(Documentation(info="<html><p>No physics is meant by it: terms are chosen by what the recordings show, one coefficient
each.</p></html>"));
end Empirical;
