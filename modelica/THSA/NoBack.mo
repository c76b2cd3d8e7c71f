within THSA;
model NoBack "No-back device: free while the load opposes, a drag larger than the load while it aids"
  THSA.Interfaces.RotationalFlange flange_a "Shaft on the gearbox's side";
  THSA.Interfaces.RotationalFlange flange_b "Shaft on the screw's side";
  parameter THSA.Units.Ratio k_b(min=0, max=10) = 1.15 "Drag per torque of the aiding load";
  parameter THSA.Units.AngularVelocity w_r(min=1e-12, max=1) = 1e-5 "Half width of the regularised sign";
  THSA.Units.AngularVelocity w "Speed of the shaft";
  THSA.Units.Torque tau_s "Torque at the screw, positive opposes positive speed";
  THSA.Units.Torque tau_nb "Drag of the no-back device";
  THSA.Units.Power P_f "Friction loss";
  THSA.Units.Ratio s "Regularised sign of the speed";
equation
  flange_a.phi = flange_b.phi;
  w = der(flange_b.phi);
  s = if w > w_r then 1 elseif w < -w_r then -1 else w/w_r;
  tau_s = -flange_b.tau;
  tau_nb = k_b*max(0, -tau_s*s)*s;
  flange_a.tau + flange_b.tau - tau_nb = 0;
  P_f = tau_nb*w;
  annotation(
    Documentation(info="<html><p>T_nb = k_b max(0, &minus;T_s sgn(&omega;_g)) sgn(&omega;_g): nothing while the load
opposes; while it aids, a drag k_b &gt; 1 times the torque at the screw, so that the load never drives the motor. At
rest it holds the load within the width of the regularised sign.</p></html>"),
    Icon(graphics={Rectangle(extent={{-60,50},{60,-50}}, lineColor={0,0,0}, fillColor={255,236,200}, fillPattern=FillPattern.Solid),
      Line(points={{-30,0},{30,0}}, color={0,0,0}), Line(points={{10,15},{30,0},{10,-15}}, color={0,0,0}),
      Text(extent={{-100,100},{100,60}}, textString="%name", textColor={0,0,255})}));
end NoBack;
