within THSA;
model Screw "Roller screw with stiff, damped contact between screw and nut"
  THSA.Interfaces.RotationalFlange flange_a "Screw shaft";
  THSA.Interfaces.TranslationalFlange flange_b "Nut";
  input THSA.Units.Length e = 0 "Added deflection of the contact";
  input THSA.Units.Velocity v_e = 0 "Its rate";
  input Real k_e(unit="m/rad") = 0 "Its change with the screw's angle";
  input THSA.Units.Torque tau_f = 0 "Added torque at the shaft";
  parameter THSA.Units.Length P_h(min=1e-5, max=1) = 10e-3 "Lead";
  parameter THSA.Units.Stiffness k_s(min=1, max=1e12) = 3.0e8 "Contact stiffness";
  parameter THSA.Units.Damping d_s(min=0, max=1e9) = 5.0e5 "Contact damping";
  final parameter Real k(unit="m/rad") = P_h/(2*3.141592653589793) "Travel per angle";
  THSA.Units.Force F_s "Contact force on the nut";
  THSA.Units.Torque T_c "Torque that the contact force takes";
  THSA.Units.Length delta "Deflection of the contact";
  THSA.Units.Velocity v_s "Relative speed of the contact";
equation
  v_s = k*der(flange_a.phi) - der(flange_b.s);
  delta = k*flange_a.phi - flange_b.s;
  F_s = k_s*(delta + e) + d_s*(v_s + v_e);
  T_c = (k + k_e)*F_s;
  flange_a.tau = T_c + tau_f;
  flange_b.f = -F_s;
  annotation(
    Documentation(info="<html><p>F_s = k_s (k &theta;_g &minus; x) + d_s (k &omega;_g &minus; dx/dt), T_s = k F_s,
k = P_h/(2&pi;). Where the travel per angle errs by k_e, so does T_s/F_s: a wrong lead makes no power. The screw's own
friction is that of the nut (<code>Nut</code>).</p></html>"),
    Icon(graphics={Rectangle(extent={{-100,10},{100,-10}}, lineColor={0,0,0}, fillColor={160,160,164}, fillPattern=FillPattern.HorizontalCylinder),
      Rectangle(extent={{-30,50},{30,-50}}, lineColor={0,0,0}, fillColor={200,200,200}, fillPattern=FillPattern.Solid),
      Text(extent={{-100,100},{100,60}}, textString="%name", textColor={0,0,255})}));
end Screw;
