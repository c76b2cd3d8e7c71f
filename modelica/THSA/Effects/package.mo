within THSA;
package Effects "Physical effects that the declared model lacks, to be put into the effect slots of Actuator"
  annotation(Documentation(info="<html><p>Every effect is one class, neutral with its coefficients at zero, so that several
add up in one slot. The catalogue of <code>thsa-cosim diagnose</code> names the slot, the ranges and the source of each.</p></html>"));
end Effects;
